"""Bifurcation diagrams beside each other: the exact flow and the smoothed switch, several starts behind the sweeps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from nonsmooth import plot, sweep
from nonsmooth.plot import annotate, shared_legend
from nonsmooth_savi2007.figures.branches import BEGINNINGS, branches, branches_of
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, only_outer
from nonsmooth_savi2007.flows import EXACT, FLOWS, Flow, Settings, starts
from nonsmooth_savi2007.measure import parameter_of

_OTHER, _SHARE = 0.05, 0.25  # another motion: a quarter of its points so far off, in parts of the diagram's range

#: What a caption says of them.
ABOUT_BRANCHES = (
    "Branches in (a): orbits of period 1, 2, 4 and 8 of the exact flow, continued from one of period 1; where they are "
    "stable, the swept points lie on them. Special points are marked on those of period 1 and 2. "
)


def diagrams(
    settings: Settings, figure: str, steps: tuple[int, int], also: Iterable[float], patience: int = 600
) -> Datasets:
    """Sweeps up and down (``exact``, ``smoothed``), from several starts (``exact_starts``, ...), and the branches.

    ``steps``: of the exact and of the smoothed sweep; the starts are tried at a half or a quarter of them.
    ``also``: values to be among those swept. ``patience``: transient of the exact flow from the starts.
    """
    begin, data = BEGINNINGS[figure], dict[str, xr.Dataset]()

    def grid(steps: int) -> np.ndarray:
        return np.unique(np.round([*np.linspace(*begin.range, steps + 1), *also], 9))

    def swept(flow: Flow, steps: int, transient: int, **options: Any) -> xr.Dataset:
        system, options = flow.system(**begin.parameters), {**options, **flow.options, "progress": settings.progress}
        found = sweep(system, begin.parameter, grid(steps), transient=transient, **options)
        return found.assign_attrs(transient=transient)

    for flow in FLOWS:
        data[flow.key] = swept(
            flow,
            settings.of(flow, exact=steps[0], smoothed=steps[1], quick=70),
            settings.of(flow, exact=600, smoothed=200, quick=100),
            direction="both",
            keep=settings.of(flow, exact=200, smoothed=64, quick=40),
        )
        data[f"{flow.key}_starts"] = swept(
            flow,
            settings.of(flow, exact=steps[0] // (2 if patience <= 600 else 4), smoothed=steps[1] // 4, quick=10),
            settings.of(flow, exact=patience, smoothed=150, quick=80),
            direction=None,
            start=starts(settings.of(flow, exact=12, smoothed=8, quick=4)),
            keep=32,
        )
    return data | branches(figure)


def draw_diagram(ax: Axes, data: Datasets, key: str, y: str, *, values: Mapping[float, str], words: str) -> None:
    """One diagram: up, down over it, and in grey what other starts lead to; ``values`` of the paper as dotted lines.

    On that of the exact flow the branches of periodic orbits. Other starts that reached no period are told apart: chaos
    looks like a transient that is not over. ``words`` say in the legend which values these are.
    """
    many, swept = data[f"{key}_starts"], data[key]
    other, settled = other_motions(many, swept), many["period_number"] > 0
    for chosen, color, size, name in (
        (other & ~settled, "#D0D0D0", 1.4, "other starts, no period"),
        (other & settled, "#8C8C8C", 1.8, "other starts, periodic"),
    ):
        if bool(chosen.any()):
            plot.bifurcation(many.assign(section=many["section"].where(chosen)), ax, y=y, color=color, size=size)
            ax.get_lines()[-1].set(label=name, zorder=0.3)
    lines = branches_to_draw(data) if key == EXACT.key else []
    plot.bifurcation(swept, *lines, ax, y=y, size=0.9 if swept.sizes["iterate"] > 100 else 1.1, linewidth=1.0)
    mark_values(ax, values, words)


def draw_both(canvas: Canvas, data: Datasets, *, values: Mapping[float, str], words: str) -> None:
    """Draw the velocity at the section, of each flow; ``values`` and ``words`` as in `draw_diagram`."""
    grid = canvas.subplots(1, 2, sharey=True)
    for ax, flow, letter in zip(grid, FLOWS, "ab", strict=True):
        draw_diagram(ax, data, flow.key, "v", values=values, words=words)
        ax.set_title(f"({letter}) {flow.title}")
    only_outer(grid)
    shared_legend(canvas)


def other_motions(many: xr.Dataset, swept: xr.Dataset) -> xr.DataArray:
    """Of each value and start, whether it leads to section points that the sweeps at this value have not."""
    parameter = parameter_of(swept)
    known = swept["section"].stack(point=("direction", "iterate")).transpose(parameter, "point", "state").values
    found = many["section"].transpose(parameter, "start", "iterate", "state").values
    scale = np.nanmax(known, axis=(0, 1)) - np.nanmin(known, axis=(0, 1))
    nearest = np.abs(swept[parameter].values[None, :] - many[parameter].values[:, None]).argmin(axis=1)
    far = np.zeros(found.shape[:2], bool)
    for i, at in enumerate(nearest):
        there = known[at][np.isfinite(known[at]).all(axis=1)] / scale
        distance = np.linalg.norm(found[i][:, :, None] / scale - there, axis=-1).min(axis=-1)
        far[i] = (distance > _OTHER).mean(axis=-1) > _SHARE
    return many["period_number"].copy(data=far)


def mark_values(ax: Axes, values: Mapping[float, str], words: str, foot: bool = False) -> None:
    """A dotted line with its number at each of these values, at the top or at the foot."""
    for i, (value, text) in enumerate(values.items()):
        ax.axvline(value, color="black", linewidth=0.7, linestyle=":", zorder=2.5, label=words if i == 0 else None)
        annotate(
            ax,
            text,
            (value, 0.0 if foot else 1.0),
            (-1.5, 3 if foot else -3),
            xycoords=ax.get_xaxis_transform(),
            rotation=90,
            ha="right",
            va="bottom" if foot else "top",
        )


def mark_grazing(ax: Axes, places: Sequence[float]) -> None:
    """A short line at the foot for each grazing in closed form, so that it hides no jump that begins there."""
    for i, place in enumerate(places):
        ax.plot(
            [place, place],
            [0.0, 0.07],
            color=plot.COLORS["third"],
            linewidth=2.0,
            transform=ax.get_xaxis_transform(),
            zorder=1,
            label="grazing, closed form" if i == 0 else None,
            solid_capstyle="butt",
        )


def branches_to_draw(data: Datasets) -> list[xr.Dataset]:
    """The branches of a figure, special points on those of period 1 and 2 only."""
    return [one if int(one["period_number"]) <= 2 else one.isel(special=slice(0, 0)) for one in branches_of(data)]


def how(data: Datasets) -> str:
    """Settings of the sweeps, for a caption."""
    words = []
    for flow in FLOWS:
        swept, many = data[flow.key], data[f"{flow.key}_starts"]
        parameter = parameter_of(swept)
        words.append(
            f"{flow.key}: {swept.sizes[parameter]} values up and down, {swept.sizes['iterate']} section points each "
            f"after {swept.attrs['transient']} periods; {many.sizes['start']} starts at {many.sizes[parameter]} "
            f"values, after {many.attrs['transient']} periods"
        )
    return "Section at phase 0. " + "; ".join(words) + "."
