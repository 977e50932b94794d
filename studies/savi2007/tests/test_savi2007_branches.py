"""The branches behind the figures, and the table of their special points: closed forms and an independent code."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[3] / "tests" / "independent"))
import reference_values as known

import nonsmooth as ns
from nonsmooth import plot
from nonsmooth_savi2007 import Reproduction
from nonsmooth_savi2007.figures.branches import VARIED, branches, branches_of
from nonsmooth_savi2007.printed import FIGURE_9, FIGURE_10, FIGURE_17
from nonsmooth_savi2007.report.pages import to_markdown
from nonsmooth_savi2007.report.special import SpecialPoint, ratios, special_table, table_of_points

GRAZES = {"fig09": (FIGURE_9, 2), "fig10": (FIGURE_10, 2), "fig17": (FIGURE_17, 1)}


@pytest.fixture(scope="module", params=[("fig09", "fig11"), pytest.param(tuple(VARIED), marks=pytest.mark.slow)])
def data(quick: Reproduction, request: pytest.FixtureRequest) -> dict[str, dict]:
    """The branches of the figures that have them; the quick run has made two."""
    return {figure: quick.data.get(figure) or branches(figure) for figure in request.param}


@pytest.fixture(scope="module")
def points(data: dict[str, dict]) -> list[SpecialPoint]:
    return table_of_points(data)


def of(points: list[SpecialPoint], figure: str, kind: str, period: int) -> list[float]:
    return [one.value for one in points if (one.figure, one.kind, one.period) == (figure, kind, period)]


def test_grazing_points_are_the_closed_form(data: dict[str, dict], points: list[SpecialPoint]) -> None:
    """g = (rho/m) / sqrt((2k/m - w^2)^2 + (c w/m)^2), to 1e-10; only these have a closed form."""
    for figure in data.keys() & GRAZES.keys():
        parameters, count = GRAZES[figure]
        here = [one for one in points if one.figure == figure and one.closed is not None]
        assert sorted(one.value for one in here) == pytest.approx(known.grazing_frequencies(**parameters), abs=1e-10)
        assert len(here) == count
        for one in here:
            assert (one.kind, one.period) == ("grazing", 1)
            assert one.closed == pytest.approx(one.value, abs=1e-10)
            assert known.amplitude(known.TABLE_1 | parameters | {"omega": one.value}) == pytest.approx(parameters["g"])
            # Without contact the multipliers are exp((-c/2m +- i w_d) T), of one modulus.
            decay = np.exp(-0.5 * known.TABLE_1["c"] / known.TABLE_1["m"] * 2 * np.pi / one.value)
            assert abs(one.multiplier) == pytest.approx(decay, rel=1e-9)


def test_folds_and_flips_are_those_of_an_independent_code(data: dict[str, dict], points: list[SpecialPoint]) -> None:
    nine = [known.FOLDS[f"figure 9 {name}"] for name in ("upper", "rising")]
    assert sorted(of(points, "fig09", "fold", 1)) == pytest.approx(nine, abs=2e-9)
    assert of(points, "fig09", "flip", 1)[0] == pytest.approx(known.FLIPS_NEAR_GRAZING["figure 9 lower"], abs=2e-9)
    if "fig10" in data:
        ten = of(points, "fig10", "fold", 1)
        for name in ("upper", "small", "rising"):
            assert min(abs(value - known.FOLDS[f"figure 10 {name}"]) for value in ten) < 2e-9
    if "fig17" in data:
        assert of(points, "fig17", "flip", 1)[-1] == pytest.approx(known.FLIPS_NEAR_GRAZING["figure 17"], abs=2e-9)
    for period, value in known.FLIPS_FIGURE_11.items():
        assert of(points, "fig11", "flip", period) == pytest.approx([value], abs=2e-9)
    for one in points:
        if one.kind in ("fold", "flip"):
            assert one.multiplier == pytest.approx(1.0 if one.kind == "fold" else -1.0, abs=1e-8)


def test_four_flips_of_each_cascade_approach_the_ratio_of_feigenbaum(
    data: dict[str, dict], points: list[SpecialPoint]
) -> None:
    found = ratios(points)
    assert set(found) == {"fig11", "fig13", "fig17"} & set(data)
    for two in found.values():
        assert two == pytest.approx([4.669, 4.669], rel=0.25)


def test_returns_are_the_section_points_of_the_orbit(data: dict[str, dict]) -> None:
    """All period-n orbits close, and a stable one is what a simulation settles on."""
    for figure in data.values():
        for branch in branches_of(figure):
            returns = branch["returns"].transpose("point", "return", "state").values
            assert returns.shape[1] == int(branch["period_number"])
            assert np.isfinite(returns).all()
            assert np.array_equal(returns[:, 0], branch["section"].transpose("point", "state").values)
    branch = next(one for one in branches_of(data["fig11"]) if int(one["period_number"]) == 2)
    stable = np.flatnonzero(branch["stable"].values)
    at = int(stable[len(stable) // 2])
    system = ns.models.discontinuous_support(**VARIED["fig11"].parameters, rho=float(branch["rho"][at]))
    orbit = branch["returns"].values[at]
    settled = ns.poincare(system, start=orbit[1] + [1e-7, 0.0], transient=400, n=2)["section"].values
    assert settled == pytest.approx(orbit[[0, 1]], abs=1e-9)


def test_the_table_says_all_of_it(data: dict[str, dict], points: list[SpecialPoint]) -> None:
    text = to_markdown([special_table(points)])
    assert text.count("\n") == len(points) + 2
    for value in ("3.56757620", "5.81036893", "0.40146958", *(["9.78644409"] if "fig17" in data else [])):
        assert value in text
    assert "nan" not in text


def test_the_unstable_branch_is_in_the_report(quick: Reproduction) -> None:
    (row,) = (row for row in quick.rows if row.id == "F9c")
    assert row.verdict == "agrees"
    assert "5.15984017 ... 5.81036893 rad/s: unstable throughout" in row.exact  # the folds, by heyoka
    text = (quick.out / "report.md").read_text(encoding="utf-8")
    assert "## Special points" in text and "0.24044985 N" in text
    assert {"fig09_branches.nc", "fig11_branches.nc"} <= {path.name for path in quick.out.iterdir()}


def test_branches_are_drawn_over_the_response(quick: Reproduction) -> None:
    import matplotlib.pyplot as plt

    swept, branch = quick.data["fig09"]["exact"], branches_of(quick.data["fig09"])[0]
    ax = plot.frequency_response(swept, branch, plt.figure().add_subplot())
    half = 0.5 * (branch["maximum"] - branch["minimum"]).sel(state="x").values
    unstable = next(line for line in ax.lines if line.get_label() == "unstable branch")
    line = {(x, y) for x, y in zip(*unstable.get_data(), strict=True) if not np.isnan(y)}
    points = list(zip(branch["omega"].values, half, strict=True))
    assert line <= set(points)
    assert line >= {point for point, stable in zip(points, branch["stable"].values, strict=True) if not stable}
    with pytest.raises(ValueError, match=r"over 'omega', this branch over 'rho'"):
        plot.frequency_response(swept, branches_of(quick.data["fig11"])[0])
    plt.close("all")
