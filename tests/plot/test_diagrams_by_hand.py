"""Diagrams against the numbers they draw: a logistic map's branches and sweeps, a report's distances, legends."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

import nonsmooth as ns

FLIPS = (3.0, 1 + np.sqrt(6))


@pytest.fixture(scope="module")
def diagram() -> Any:
    system = ns.Map(states=["x"], parameters={"r": 2.95}, branches=[ns.Branch(lambda u, p: (p.r * u.x * (1 - u.x),))])
    return ns.bifurcation_diagram(system, "r", (2.9, 3.5), n=11, start={"x": 0.6}, progress=False)


def clouds(ax: Any) -> np.ndarray:
    """Points of all clouds, (N, 2)."""
    lines = [np.column_stack(one.get_data()) for one in ax.lines if one.get_linestyle() == "None"]
    return np.concatenate([*lines, *(np.asarray(one.get_offsets()) for one in ax.collections)])


def test_a_diagram_draws_its_sweeps_and_all_points_of_its_branches(diagram: Any) -> None:
    ax = ns.plot.bifurcation_diagram(diagram, special=False)
    swept = diagram["swept_section"].values[..., 0]
    wanted = np.column_stack(
        [np.broadcast_to(diagram["swept_value"].values[None, :, None], swept.shape).ravel(), swept.ravel()]
    )
    drawn = clouds(ax)
    assert {tuple(np.round(one, 9)) for one in wanted} <= {tuple(np.round(one, 9)) for one in drawn}
    lines = [np.column_stack(one.get_data()) for one in ax.lines if one.get_linestyle() in ("-", "--")]
    points = np.concatenate(lines)
    points = points[np.isfinite(points).all(axis=1)]
    r, x = points.T
    y = x
    for _ in range(4):  # of period 1, 2 or 4
        y = r * y * (1 - y)
    assert y == pytest.approx(x, abs=1e-9)
    every = diagram["returns"].values[..., 0]
    assert len({tuple(np.round(one, 7)) for one in points}) >= 0.9 * np.isfinite(every).sum()
    dashed = np.concatenate([np.asarray(one.get_xdata(), float) for one in ax.lines if one.get_linestyle() == "--"])
    assert np.nanmin(dashed) == pytest.approx(FLIPS[0], abs=0.02)  # what has flipped is unstable
    assert ax.get_xlabel() == "$r$" and ax.get_ylabel() == "$x$"
    marked = ns.plot.bifurcation_diagram(diagram)
    assert any(
        "flip" in text.get_text() or "period doubling" in text.get_text() for text in marked.get_legend().get_texts()
    )
    assert len(marked.lines) > len(ax.lines)
    plt.close("all")


def test_a_report_draws_its_differences_over_the_widths() -> None:
    friction = ns.models.dry_friction_oscillator(omega=0.4, zeta=0.05)
    report = ns.smoothing_report(friction, [1e-3, 1e-2], band=["linear", "tanh"], progress=False)
    for y in ("state", "multiplier"):
        ax = ns.plot.smoothing_report(report, y=y)
        for band in ("linear", "tanh"):
            one = report.sel(band=band)
            order = float(one[f"{y}_order"].values[-1])
            (marks,) = (line for line in ax.lines if line.get_label() == f"{band}, order {order:.2f}")
            assert marks.get_xdata() == pytest.approx(one["eta"].values)
            assert marks.get_ydata() == pytest.approx(one[f"{y}_difference"].values)
        assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    plt.close("all")


def test_one_legend_for_all_axes_has_each_entry_once() -> None:
    figure, axes = plt.subplots(1, 2, layout="constrained")
    for ax, words in zip(axes, (("one", "two"), ("two", "three")), strict=True):
        for k, word in enumerate(words):
            ax.plot([0, 1], [k, k + 1], label=word)
        ax.legend()
    legend = ns.plot.shared_legend(figure, columns=2)
    assert [text.get_text() for text in legend.get_texts()] == ["one", "two", "three"]
    assert all(ax.get_legend() is None for ax in axes) and legend._ncols == 2
    plt.close(figure)
