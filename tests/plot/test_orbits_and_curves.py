"""Figures of continuation: curves in two parameters, orbits with their crossings, manifolds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth import plot


@pytest.fixture(scope="module")
def orbit() -> ns.Orbit:
    return ns.find_orbit(ns.models.discontinuous_support(rho=0.14, g=0.02, omega=4.5))


@pytest.fixture(scope="module")
def branch(orbit: ns.Orbit) -> xr.Dataset:
    return ns.continue_orbit(orbit, "omega", (3.0, 7.0))


@pytest.fixture(scope="module")
def special(branch: xr.Dataset) -> xr.Dataset:
    return ns.special_points(branch)


def words(ax: Any) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_curves_share_axes_and_each_kind_is_named_once(special: xr.Dataset, tmp_path: Path) -> None:
    box = {"omega": (3.0, 7.0), "rho": (0.05, 0.3)}
    ax = None
    drawn = []
    folds, grazings = (np.flatnonzero(special["kind"].values == kind) for kind in ("fold", "grazing"))
    for i, points in ((folds[0], 40), (folds[1], 6), (grazings[0], 6)):  # the first reaches the cusp
        drawn.append(ns.continue_curve(special.isel(special=int(i)), box, points=points, step=0.1))
        ax = plot.curve(drawn[-1], ax)
    assert ax is not None
    assert sorted(words(ax)) == ["cusp", "fold", "grazing"]
    assert ax.get_xlabel() == r"$\omega$ (rad/s)"
    assert ax.get_ylabel() == r"$\rho$ (N)"
    lines = [line for line in ax.get_lines() if len(line.get_xdata()) > 1]
    assert len(lines) == len(drawn)
    assert np.array_equal(lines[0].get_ydata(), drawn[0]["rho"].values)
    assert {line.get_linestyle() for line in lines} == {"-", ":"}
    assert plot.save_figure(ax, tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")


def test_curves_over_a_chart_leave_its_legend(special: xr.Dataset) -> None:
    plane = ns.chart(
        ns.models.discontinuous_support(g=0.02), {"omega": [3.0, 5.0, 7.0], "rho": [0.1, 0.2, 0.3]}, progress=False
    )
    ax = plot.chart(plane)
    periods = words(ax)
    for kind in ("fold", "grazing"):
        i = np.flatnonzero(special["kind"].values == kind)[0]
        curve = ns.continue_curve(special.isel(special=int(i)), {"omega": (3.0, 7.0), "rho": (0.1, 0.3)}, step=0.2)
        plot.curve(curve, ax, special=False)
    assert sorted(words(ax)) == ["fold", "grazing"]
    kept = [item for item in ax.artists if isinstance(item, mpl.legend.Legend)]
    assert [[text.get_text() for text in item.get_texts()] for item in kept] == [periods]
    assert all(line.get_path_effects() for line in ax.get_lines())  # a seam on every colour


def test_an_orbit_shows_its_crossings_and_section_point(orbit: ns.Orbit) -> None:
    ax = plot.orbit(orbit)
    assert words(ax) == ["free", "contact", "crossing", "section"]
    by_name = {line.get_label(): line.get_xydata() for line in ax.get_lines()}
    assert by_name["section"][0] == pytest.approx(orbit.u, abs=1e-12)
    at = by_name["crossing"]
    for state in orbit.crossing_states:
        assert np.abs(at - state).max(axis=1).min() < 1e-8
    assert len(at) == 2 * len(orbit.crossing_times)  # before and after each


def test_an_orbit_without_contact_shows_its_nearest_approach() -> None:
    """Far from the support: next to the largest displacement, where the force that would begin a contact is largest."""
    free = ns.find_orbit(ns.models.discontinuous_support(rho=0.14, g=0.02, omega=7.5))
    ax = plot.orbit(free)
    assert any(word.startswith("least clearance") for word in words(ax))
    mark = next(line for line in ax.get_lines() if str(line.get_label()).startswith("least")).get_xydata()[0]
    assert mark[0] == pytest.approx(free.maximum[0], rel=1e-4)
    assert abs(mark[1]) < 0.01 * free.maximum[1]


def test_manifolds_start_at_the_saddle(orbit: ns.Orbit, branch: xr.Dataset) -> None:
    folds = branch["special_point"].values[branch["special_kind"].values == "fold"]
    at = branch.isel(point=int(folds.sum() // 2))
    saddle = ns.find_orbit(
        orbit.system.with_parameters(omega=float(at["omega"])), start=at["section"].values, period_number=1, transient=0
    )
    assert not saddle.stable
    ax = plot.manifolds(ns.manifolds(saddle, length=1.0, distance=0.1))
    assert words(ax) == ["unstable manifold", "stable manifold", "saddle"]
    lines = [line.get_xydata() for line in ax.get_lines() if len(line.get_xdata()) > 1]
    assert len(lines) == 4
    for line in lines:
        assert line[0] == pytest.approx(saddle.u, abs=1e-12)


@pytest.mark.parametrize("figure", ["curve", "manifolds"])
def test_a_result_of_another_verb_is_refused(figure: str) -> None:
    with pytest.raises(ValueError, match="it is not the result of"):
        getattr(plot, figure)(xr.Dataset({"u2": 1.0}))


@pytest.mark.parametrize("backwards", [False, True])
def test_lines_of_a_branch_change_at_its_special_points(branch: xr.Dataset, backwards: bool) -> None:
    """Unstable between the two flips and between the two folds, whichever end comes first."""
    if backwards:
        last = branch.sizes["point"] - 1
        branch = branch.isel(point=slice(None, None, -1)).assign(special_point=last - branch["special_point"])
    ax = plot.branch(branch)
    drawn = {line.get_linestyle(): np.asarray(line.get_xdata(), dtype=float) for line in ax.get_lines()[:2]}
    parts = np.split(drawn["--"], np.flatnonzero(np.isnan(drawn["--"])))
    kinds, values = branch["special_kind"].values, branch["special_value"].values
    wanted = sorted(tuple(sorted(values[kinds == kind])) for kind in ("flip", "fold"))
    assert sorted((np.nanmin(part), np.nanmax(part)) for part in parts) == wanted
    assert len(np.flatnonzero(np.isnan(drawn["-"]))) == 2  # three stable parts


def test_a_branch_of_equilibria() -> None:
    """x^2 = a: the fold at the origin is marked, one arm is stable; an equilibrium is its own maximum."""
    system = ns.System(states=["x"], parameters={"a": 1.0}, modes={"one": lambda t, u, p: p.a - u.x * u.x})
    rest = ns.continue_equilibrium(system, "a", (-0.5, 1.5), start={"x": 0.9})
    assert float(rest["special_value"][0]) == pytest.approx(0.0, abs=1e-9)
    for quantity in ("section", "maximum"):
        ax = plot.branch(rest, quantity=quantity)
        lines = [line for line in ax.get_lines() if len(line.get_xdata()) > 1]
        assert [line.get_linestyle() for line in lines] == ["-", "--"]
        a, x = (np.asarray(part, dtype=float) for part in lines[0].get_data())
        good = np.isfinite(x)
        assert a[good].min() > -1e-12 and x[good] == pytest.approx(np.sqrt(np.maximum(a[good], 0)), abs=1e-6)
        assert words(ax) == ["stable branch", "unstable branch", "fold"]


def test_branches_lie_under_what_was_measured_or_swept(branch: xr.Dataset) -> None:
    """Stable parts are a pale, wide seam below; unstable ones thin and dashed above; both stand in the legend once."""
    response = ns.frequency_response(
        ns.models.discontinuous_support(rho=0.14, g=0.02), np.arange(4.4, 4.7, 0.05), direction="both", progress=False
    )
    ax = plot.frequency_response(response, branch)
    by_name = {line.get_label(): line for line in ax.get_lines()}
    stable, unstable, swept = (by_name[name] for name in ("stable branch", "unstable branch", "increasing"))
    assert stable.get_zorder() < swept.get_zorder() < unstable.get_zorder()
    assert stable.get_linewidth() > swept.get_linewidth() and stable.get_alpha() < 0.5
    assert swept.get_linestyle() == "-" and unstable.get_linestyle() == "--"
    entries = words(ax)
    assert len(entries) == len(set(entries)) and {"stable branch", "unstable branch", "fold", "grazing"} <= set(entries)


def test_marks_at_one_point_do_not_hide_each_other(branch: xr.Dataset) -> None:
    """A fold that is a graze: the smaller cross lies on the larger circle."""
    by_name = {line.get_label(): line for line in plot.branch(branch).get_lines()}
    fold, graze = by_name["fold"], by_name["grazing"]
    assert graze.get_markersize() < fold.get_markersize() and graze.get_zorder() > fold.get_zorder()
    shared = np.abs(fold.get_xdata()[:, None] - graze.get_xdata()[None, :]).min()
    assert shared < 1e-3  # there is such a point


def test_a_legend_that_a_curve_found_is_not_cut(special: xr.Dataset) -> None:
    """Beside a chart, outside the axes: the layout makes room for it."""
    plane = ns.chart(
        ns.models.discontinuous_support(rho=0.14, g=0.02), {"omega": [4.0, 4.5], "rho": [0.14, 0.15]}, progress=False
    )
    flip = special.isel(special=np.flatnonzero(special["kind"].values == "flip")[:1]).isel(special=0)
    with plot.journal():
        ax = plot.chart(plane)
        before = ax.get_legend()
        before.get_texts()[0].set_text("a period that did not settle")
        plot.curve(ns.continue_curve(flip, {"omega": (3.4, 4.6), "rho": (0.13, 0.16)}, points=8), ax)
    ax.figure.canvas.draw()
    assert before is not ax.get_legend() and before.get_window_extent().x1 <= ax.figure.bbox.x1


def test_a_part_of_a_branch_has_the_special_points_that_are_in_it(branch: xr.Dataset) -> None:
    """They stand in the branch by number: without the points before them each number is that of another point."""
    part = branch.isel(point=slice(60, None))
    assert list(ns.special_points(part)["omega"].values) == list(branch["special_value"].values[3:])
    assert words(plot.branch(part)) == ["stable branch", "unstable branch", "fold", "grazing"]
    with pytest.raises(ValueError, match="only some of its points are there"):
        ns.continue_orbit(part, range=(3.0, 8.0))
    assert ns.special_points(part.isel(point=slice(0, 20))).sizes["special"] == 0


def held_branch() -> xr.Dataset:
    """Four held motions round a fold, one of each stability and two unstable ones."""
    n = 4
    columns = {
        "amplitude": [1.0, 2.0, 3.0, 4.0],
        "amplitude_uncertainty": [0.01, 0.02, 0.03, 0.04],
        "stability": [1, -1, 0, 0],
        "control_effort": [0.1, 0.2, 0.3, 0.4],
        "control_effort_first": [1.0, 2.0, 3.0, 4.0],
        "control_effort_noise": [0.01] * n,
    }
    result = xr.Dataset(
        {name: ("point", np.array(values)) for name, values in columns.items()}
        | {
            "special_point": ("special", [1]),
            "special_value": ("special", [5.95]),
            "special_value_uncertainty": ("special", [0.05]),
        },
        {
            "omega": ("point", [5.0, 5.9, 5.5, 5.2], {"units": "rad/s"}),
            "state": ["x", "v"],
            "state_unit": ("state", ["m", "m/s"]),
        },
        {"parameter": "omega"},
    )
    result["control_effort"].attrs["units"] = "N"
    return result


def test_held_motions_have_bars_of_two_uncertainties_and_their_stability() -> None:
    result = held_branch()
    ax = plot.controlled_branch(result)
    kinds = ["came back when let go: stable", "left when let go: unstable", "held; stability not known"]
    assert words(ax) == [*kinds, "fold"]
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"$\omega$ (rad/s)", "amplitude of $x$ (m)")
    bars = {str(one.get_label()): one for one in ax.containers}
    for kind, code in zip(kinds, (1, 0, -1), strict=True):
        here = result["stability"].values == code
        (segments,) = bars[kind].lines[2]
        reach = np.diff([one[:, 1] for one in segments.get_segments()])[:, 0]
        np.testing.assert_allclose(reach, 4 * result["amplitude_uncertainty"].values[here])
        np.testing.assert_array_equal(bars[kind].lines[0].get_ydata(), result["amplitude"].values[here])
    (across,) = bars["fold"].lines[2]
    ((begin, end),) = across.get_segments()
    assert (begin.tolist(), end.tolist()) == (pytest.approx([5.85, 2.0]), pytest.approx([6.05, 2.0]))
    none = result.isel(special=slice(0), point=slice(1))
    assert words(plot.controlled_branch(none, plt.subplots()[1])) == kinds[:1]


@pytest.mark.usefixtures("window")
def test_theory_behind_held_motions_leaves_the_axes_to_them(branch: xr.Dataset) -> None:
    result = held_branch()
    ax = plot.controlled_branch(result, theory=branch)
    alone = plot.controlled_branch(result)  # held motions with their bars
    assert (ax.get_xlim(), ax.get_ylim()) == (alone.get_xlim(), alone.get_ylim())
    half = 0.5 * (branch["maximum"] - branch["minimum"]).sel(state="x").values
    assert any(set(half[:5]) <= set(line.get_ydata()) for line in ax.lines)
    with pytest.raises(ValueError, match="the result is over 'omega', this branch over 'rho'"):
        plot.controlled_branch(result, theory=branch.assign_attrs(parameter="rho"))


def test_the_control_force_falls_from_its_first_to_that_of_noise() -> None:
    result = held_branch()
    ax = plot.controlled_branch(result, y="control_effort")
    drawn = {str(line.get_label()): line.get_ydata() for line in ax.lines}
    for words_of, name in (("before the first correction", "_first"), ("converged", ""), ("noise alone", "_noise")):
        np.testing.assert_array_equal(drawn[words_of], result[f"control_effort{name}"].values)
    assert (ax.get_yscale(), ax.get_ylabel()) == ("log", "rms of the control force (N)")
    with pytest.raises(ValueError, match="allowed: 'amplitude', 'control_effort'"):
        plot.controlled_branch(result, y="effort")
