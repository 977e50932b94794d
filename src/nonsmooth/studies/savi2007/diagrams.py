"""Bifurcation diagrams beside each other: the exact flow and the smoothed switch, several starts behind the sweeps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from nonsmooth import plot
from nonsmooth.analysis.sweep import sweep
from nonsmooth.plot.branch import draw_branch
from nonsmooth.results.provenance import read_provenance
from nonsmooth.studies.savi2007.branches import branches_of
from nonsmooth.studies.savi2007.flows import EXACT, FLOWS, Settings, starts

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

__all__ = ["ABOUT_BRANCHES", "diagrams", "draw_branches", "draw_diagram", "how", "name_lines", "shared_legend"]

#: What a caption says of them.
ABOUT_BRANCHES = (
    "Black lines in (a): orbits of period 1, 2, 4 and 8 of the exact flow, continued from one of period 1 (solid: "
    "stable, dashed: unstable); special points marked on those of period 1 and 2. "
)


def diagrams(
    settings: Settings,
    parameters: Mapping[str, float],
    parameter: str,
    low: float,
    high: float,
    steps: tuple[int, int],
    also: tuple[float, ...],
    patience: int = 600,
) -> dict[str, xr.Dataset]:
    """Sweeps up and down (``exact``, ``smoothed``) and from several starts (``exact_starts``, ``smoothed_starts``).

    ``steps``: of the exact and of the smoothed sweep; the starts are tried at a half or a quarter of them.
    ``also``: values to be among those swept. ``patience``: transient of the exact flow from the starts.
    """
    data = {}
    for flow in FLOWS:
        system = flow.system(**parameters)
        n = settings.of(flow, exact=steps[0], smoothed=steps[1], quick=70)
        data[flow.key] = sweep(
            system, parameter, _grid(low, high, n, also), direction="both", progress=settings.progress,
            transient=settings.of(flow, exact=600, smoothed=200, quick=100),
            keep=settings.of(flow, exact=200, smoothed=64, quick=40), **flow.options,
        )  # fmt: skip
        fewer = 2 if patience <= 600 else 4
        n = settings.of(flow, exact=steps[0] // fewer, smoothed=steps[1] // 4, quick=10)
        data[f"{flow.key}_starts"] = sweep(
            system, parameter, _grid(low, high, n, also), direction=None,
            start=starts(settings.of(flow, exact=12, smoothed=8, quick=4)), progress=settings.progress,
            transient=settings.of(flow, exact=patience, smoothed=150, quick=80), keep=32, **flow.options,
        )  # fmt: skip
    return data


def _grid(low: float, high: float, steps: int, also: tuple[float, ...]) -> np.ndarray:
    return np.unique(np.round(np.concatenate([np.linspace(low, high, steps + 1), also]), 9))


def draw_diagram(ax: Axes, data: Mapping[str, xr.Dataset], key: str, y: str, *, values: Sequence[float] = ()) -> None:
    """One diagram: starts in grey behind, down over up; the paper's parameter values as dotted lines.

    On that of the exact flow the branches of periodic orbits.
    """
    plot.bifurcation(data[f"{key}_starts"], ax, y=y, color="#B4B4B4", size=1.8)
    behind = len(ax.get_lines())
    plot.bifurcation(data[key], ax, y=y, size=0.9 if data[key].sizes["iterate"] > 100 else 1.3)
    for i, line in enumerate(ax.get_lines()):
        line.set_zorder(1 + (i >= behind))
    ax.get_lines()[0].set_label("several starts")
    for i, value in enumerate(values):
        label = "printed in the paper" if i == 0 else None
        ax.axvline(value, color="black", linewidth=0.6, linestyle=":", zorder=0, label=label)
    if key == EXACT.key:
        draw_branches(ax, data, y=y)


def draw_branches(ax: Axes, data: Mapping[str, xr.Dataset], *, y: str) -> None:
    """The branches of a figure in black, where there are any; marks on those of period 1 and 2."""
    found = branches_of(data)
    for one in found:
        few = int(one["period_number"]) <= 2
        draw_branch(ax, one, y=y, special=few, color="black", width=0.6)
    if found:
        name_lines(ax)


def name_lines(ax: Axes) -> None:
    """Entries of the legend for the lines of branches."""
    for words, line in (("stable orbits", "-"), ("unstable orbits", "--")):
        ax.plot([], [], line, color="black", linewidth=0.7, label=words)


def shared_legend(canvas: Canvas, columns: int = 5) -> None:
    """One legend under all axes in place of their own, so that it hides no branch."""
    entries: dict[str, Any] = {}
    for ax in canvas.axes:
        for handle, words in zip(*ax.get_legend_handles_labels(), strict=True):
            entries.setdefault(words, handle)
        if (own := ax.get_legend()) is not None:
            own.remove()
    drawn = canvas.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=columns)
    for shown in drawn.legend_handles:
        if isinstance(shown, Line2D):
            shown.set_markersize(4)


def how(data: Mapping[str, xr.Dataset]) -> str:
    """How the sweeps were made, for a caption."""
    words = []
    for flow in FLOWS:
        swept, many = data[flow.key], data[f"{flow.key}_starts"]
        parameter = str(swept["maximum"].dims[0])
        words.append(
            f"{flow.key}: {swept.sizes[parameter]} values up and down, {swept.sizes['iterate']} section points each "
            f"after {_transient(swept)} periods; {many.sizes['start']} starts at {many.sizes[parameter]} values, after "
            f"{_transient(many)} periods"
        )
    return "Section at phase 0. " + "; ".join(words) + "."


def _transient(swept: xr.Dataset) -> int:
    return int(read_provenance(swept)["options"]["transient"])
