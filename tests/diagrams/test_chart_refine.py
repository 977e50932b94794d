"""Charts refined along boundaries against the uniform grid: the same labels from a part of the points."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy import ndimage

import nonsmooth as ns
from nonsmooth.diagrams.chart import chart
from nonsmooth.diagrams.chart_refine import confidence_of, labels_of_points

FIGURE_9 = {"g": 0.02}, {"omega": (3.0, 7.0), "rho": (0.1, 0.3)}
GAP = {"omega": 11.15}, {"g": (-0.0015, 0.002), "rho": (0.2, 0.5)}


def pair(case, n: int, part: float) -> tuple[xr.Dataset, np.ndarray, np.ndarray]:
    parameters, ranges = case
    system = ns.models.discontinuous_support(**parameters)
    grid = {name: np.linspace(*ends, n) for name, ends in ranges.items()}
    coarse = chart(system, grid, refine=part, extremes=False, progress=False)
    whole = chart(system, grid, extremes=False, progress=False)
    return coarse, labels_of_points(coarse), labels_of_points(whole)


def agree(case, n: int, part: float, least: float) -> None:
    refined, found, truth = pair(case, n, part)
    computed = refined["computed"].values == 1
    right = found == truth
    sure = refined["confidence"].values >= 0.95
    there, missed = 0, 0
    for label in np.unique(truth):
        islands, count = ndimage.label(truth == label, np.ones((3, 3)))
        sizes = np.bincount(islands.ravel())
        for k in np.flatnonzero(sizes[1 : count + 1] > 30) + 1:
            there += 1
            missed += (found[islands == k] == label).mean() <= 0.5
    print(
        f"{' and '.join(case[1])}, {n} x {n}: {100 * right.mean():.3f} % of labels from {100 * computed.mean():.2f} % "
        f"of the points; {there} islands of more than 30 pixels, {missed} missed; of the {100 * sure.mean():.2f} % of "
        f"cells with a confidence of 0.95 or more {100 * right[sure].mean():.3f} % are right, of those inferred among "
        f"them {100 * right[sure & ~computed].mean():.3f} %"
    )
    assert computed.mean() <= part
    assert right[computed].all()
    assert right.mean() >= least
    assert right[sure].mean() >= 0.95
    assert right[sure & ~computed].mean() >= 0.95
    assert sure.mean() > 0.9
    # an inferred label is never certain: of n tested without an error 1 - 1 / (n + 2) are expected right (Laplace)
    confidence = refined["confidence"].values
    assert (confidence[~computed] < 1.0).all() and (confidence[computed] == 1.0).all()
    assert not missed


def test_confidence_is_laplaces_rule_of_each_class() -> None:
    """After n probes with e errors (n + 1 - e) / (n + 2); one half without a probe; 1 for what was computed."""
    size, mixed = np.array([[1, 1, 2], [2, 2, 1]]), np.array([[0, 0, 0], [1, 1, 0]])
    computed = np.array([[True, False, False], [False, False, False]])
    found = confidence_of((size, mixed), computed, {(1, 0): (1, 8), (2, 1): (0, 3)})
    assert found == pytest.approx(np.array([[1.0, 0.8, 0.5], [0.8, 0.8, 0.8]]))


@pytest.mark.parametrize(
    ("case", "n", "part", "least"),
    [(FIGURE_9, 128, 0.15, 0.999), pytest.param(GAP, 96, 0.4, 0.98, marks=pytest.mark.slow)],
)
def test_the_same_picture_from_a_part_of_the_points(case, n, part, least) -> None:
    agree(case, n, part, least)


@pytest.mark.slow
@pytest.mark.parametrize(("case", "part", "least"), [(FIGURE_9, 0.05, 0.999), (GAP, 0.25, 0.99)])
def test_the_same_picture_at_512(case, part, least) -> None:
    agree(case, 512, part, least)


def test_refinement_does_not_depend_on_threads() -> None:
    system = ns.models.discontinuous_support(**FIGURE_9[0])
    grid = {name: np.linspace(*ends, 50) for name, ends in FIGURE_9[1].items()}
    one, two = (chart(system, grid, refine=True, threads=n, progress=False) for n in (1, 2))
    assert one.identical(two)


@pytest.mark.parametrize(
    ("options", "message"),
    [({"refine": 1.5}, "at most 1"), ({"carry": {"rho": "up"}}, "stand alone"), ({"start": [[0, 0], [1, 0]]}, "alone")],
)
def test_refinement_refuses_what_it_cannot_do(options, message) -> None:
    system = ns.models.discontinuous_support()
    with pytest.raises(ValueError, match=message):
        chart(system, {"omega": [3.0, 4.0], "rho": [0.1, 0.2]}, **{"refine": True, **options}, progress=False)
