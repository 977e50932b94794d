"""The paper's figures, each from one orbit: folds, flips and grazing points against closed forms at 40 digits."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import closed_form_support as closed
import numpy as np
import pytest
import reference_values as known
import xarray as xr

import nonsmooth as ns

pytestmark = pytest.mark.physics

support = ns.models.discontinuous_support


def rows(branch: xr.Dataset, kind: str) -> list[xr.Dataset]:
    special = ns.special_points(branch)
    return [special.isel(special=int(i)) for i in np.flatnonzero(special["kind"].values == kind)]


def truth(row: xr.Dataset, name: str) -> float:
    """The same fold or flip from the closed form, begun at ours."""
    X = row["unknowns"].values
    X = X[~np.isnan(X)]
    p = {key: float(row[key]) for key in ("g", "rho", "omega")}
    n, contact = int(row["period_number"]), int(row["mode"]) == 1
    return closed.special(str(row["kind"].values), p, name, n, X[:2], X[2:-1:3], contact)


def follow(name: str, limits: tuple[float, float], **parameters: float) -> xr.Dataset:
    return ns.continue_orbit(ns.find_orbit(support(**parameters)), name, limits)


@pytest.fixture(scope="module")
def figure_9() -> xr.Dataset:
    return follow("omega", (3.0, 7.0), rho=0.14, g=0.02, omega=3.3)


@pytest.fixture(scope="module")
def figure_10() -> xr.Dataset:
    return follow("omega", (2.0, 8.0), rho=0.16, g=0.0145, omega=2.2)


@pytest.fixture(scope="module")
def figure_17() -> xr.Dataset:
    return follow("omega", (7.5, 11.0), rho=0.23, g=0.0036, omega=7.6)


CASES: dict[str, tuple[float, float, dict[str, float]]] = {
    # rho, g, and the fold or flip beside each grazing point that heyoka found
    "figure_9": (
        0.14,
        0.02,
        {"upper": known.FOLDS["figure 9 upper"], "lower": known.FLIPS_NEAR_GRAZING["figure 9 lower"]},
    ),
    "figure_10": (0.16, 0.0145, {"upper": known.FOLDS["figure 10 upper"], "lower": known.FOLDS["figure 10 small"]}),
    "figure_17": (0.23, 0.0036, {"upper": known.FLIPS_NEAR_GRAZING["figure 17"]}),
}


@pytest.mark.parametrize("figure", CASES)
def test_grazing_points_and_what_stands_beside_them(figure: str, request: pytest.FixtureRequest) -> None:
    """Grazing frequencies to 1e-10 of the closed form; the fold or flip within 4e-4 rad/s is a point of its own."""
    branch = request.getfixturevalue(figure)
    rho, g, beside = CASES[figure]
    grazes = rows(branch, "grazing")
    exact = known.grazing_frequencies(rho, g)
    exact = [omega for omega in exact if branch["omega"].min() < omega < branch["omega"].max()]
    assert sorted(float(row["omega"]) for row in grazes) == pytest.approx(exact, abs=1e-10)
    assert len(grazes) == len(beside)
    for row in grazes:
        p = {**known.TABLE_1, "rho": rho, "g": g, "omega": float(row["omega"])}
        assert row["section"].values == pytest.approx(known.steady_state(p), abs=1e-11)
        assert str(row["grazing"].values) == "persistence" and bool(row["bounded"])
        assert str(row["touched"].values) == "penetration"
    smooth = [float(row["omega"]) for kind in ("fold", "flip") for row in rows(branch, kind)]
    for omega in beside.values():
        found = min(smooth, key=lambda x, omega=omega: abs(x - omega))
        assert found == pytest.approx(omega, abs=2e-9)
        assert min(abs(found - graze) for graze in exact) < 4e-4


@pytest.mark.parametrize(
    ("figure", "kind", "count"),
    [("figure_9", "fold", 2), ("figure_9", "flip", 2), ("figure_10", "fold", 4), ("figure_17", "flip", 2)],
)
def test_folds_and_flips_against_the_closed_form(
    figure: str, kind: str, count: int, request: pytest.FixtureRequest
) -> None:
    """Eight digits are asked for; these agree to the last ones."""
    found = rows(request.getfixturevalue(figure), kind)
    assert len(found) == count
    for row in found:
        assert float(row["omega"]) == pytest.approx(truth(row, "omega"), abs=1e-11)
        mu = row["floquet_multipliers"].values
        assert np.abs(mu - (1.0 if kind == "fold" else -1.0)).min() < 1e-9


def test_the_unstable_branch_between_the_jumps_of_figure_9(figure_9: xr.Dataset) -> None:
    """Claim F9c: from the fold where the rising jump is to that of the falling one all orbits are unstable."""
    special = ns.special_points(figure_9)
    folds = special["point"].values[special["kind"].values == "fold"]
    between = slice(int(folds.min()) + 1, int(folds.max()))
    assert not figure_9["stable"].values[between].any()
    omega = figure_9["omega"].values[between]
    assert known.FOLDS["figure 9 upper"] < omega.min() and omega.max() < known.FOLDS["figure 9 rising"]


def doublings(branch: xr.Dataset, name: str, count: int, first: int = 0) -> list[xr.Dataset]:
    """The flip ``first`` of a branch, then that of the branch of twice the period, and so on."""
    found: list[xr.Dataset] = []
    for i in range(count):
        flips = rows(branch, "flip")
        if found:  # the branch begins at the flip it comes from
            flips = [row for row in flips if abs(float(row[name]) - float(found[-1][name])) > 1e-9]
        found.append(flips[first if i == 0 else 0])
        if i < count - 1:
            branch = ns.continue_orbit(found[-1])
    return found


CASCADES: dict[str, tuple[str, Callable[[], xr.Dataset]]] = {
    "figure 11": ("rho", lambda: follow("rho", (0.2, 0.5), rho=0.45, omega=3.69, g=-0.0045)),
    "figure 13": ("g", lambda: follow("g", (-0.0015, 0.002), rho=0.33, omega=11.15, g=-0.0012)),
    "figure 17": ("omega", lambda: follow("omega", (7.5, 11.0), rho=0.23, g=0.0036, omega=7.6)),
}


@pytest.mark.slow
@pytest.mark.parametrize("figure", CASCADES)
def test_period_doublings(figure: str) -> None:
    """The first four flips, each on the branch that leaves the one before; the first two against the closed form."""
    name, begin = CASCADES[figure]
    flips = doublings(begin(), name, 4)
    values = [float(row[name]) for row in flips]
    steps = np.diff(values)
    print(f"\n{figure}: flips {values}, ratios of intervals {(steps[:-1] / steps[1:]).tolist()}")
    assert [int(row["period_number"]) for row in flips] == [1, 2, 4, 8]
    for row in flips[:2]:
        assert float(row[name]) == pytest.approx(truth(row, name), abs=1e-10)
    # Feigenbaum's ratio is approached: 4.669 from the third interval on, within a quarter.
    ratios = steps[:-1] / steps[1:]
    assert ratios == pytest.approx(4.669, rel=0.25)
    if figure == "figure 11":
        assert dict(zip([1, 2, 4, 8], values, strict=True)) == pytest.approx(known.FLIPS_FIGURE_11, abs=2e-9)


@pytest.mark.slow
@pytest.mark.parametrize("figure", CASCADES)
def test_later_doublings_against_the_closed_form(figure: str) -> None:
    name, begin = CASCADES[figure]
    for row in doublings(begin(), name, 4)[2:]:
        assert float(row[name]) == pytest.approx(truth(row, name), abs=1e-9)


def test_intervals_are_in_order(figure_17: xr.Dataset) -> None:
    """Points follow each other along the branch: no step is much longer than its neighbours."""
    section = figure_17["section"].values / [1e-3, 1e-2]
    gaps = np.linalg.norm(np.diff(section, axis=0), axis=1)
    assert all(b < 50 * a + 2.0 for a, b in itertools.pairwise(gaps))
