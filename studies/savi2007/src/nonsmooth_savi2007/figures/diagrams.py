"""Figures 11, 13 and 17: bifurcation diagrams by both flows, several starts behind the sweeps.

Over the forcing amplitude, the gap, and the frequency across a range of chaos that ends in grazing.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from nonsmooth import plot, sweep
from nonsmooth.plot import annotate, prefixed, shared_legend
from nonsmooth_savi2007.figures.branches import VARIED, branches, branches_of
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure, only_outer
from nonsmooth_savi2007.figures.resonance import grazing_of, mark_grazing
from nonsmooth_savi2007.flows import EXACT, FLOWS, Flow, Settings, starts
from nonsmooth_savi2007.measure import parameter_of
from nonsmooth_savi2007.printed import FIGURE_12, FIGURE_14, FIGURE_17, FIGURE_18, NUMBERS

_OTHER, _SHARE = 0.05, 0.25  # another motion: a quarter of its points so far off, in parts of the diagram's range
_JUST_ABOVE = 9.8  # rad/s, above the grazing frequency of Fig. 17
PATIENCE = 4000  # periods: above grazing the model's chaos is a transient, which is no motion to compare with

_PRINTED = [NUMBERS[f"period {n} from"] for n in (4, 2, 1)]
#: Values that a diagram marks, each with its number, and what they are.
MARKED = {
    "fig11": ({one.value: one.text for one in _PRINTED}, "printed in the paper (N)"),
    "fig13": ({g: prefixed(g, "m")[0] for g in FIGURE_14}, "gaps of Fig. 14 (mm)"),
    "fig17": ({omega: f"{omega:.2f}" for omega in FIGURE_18}, "frequencies of Fig. 18 (rad/s)"),
}


def diagrams(
    settings: Settings, figure: str, steps: tuple[int, int], also: Iterable[float], patience: int = 600
) -> Datasets:
    """Sweeps up and down (``exact``, ``smoothed``), from several starts (``exact_starts``, ...), and the branches.

    ``steps``: of the exact and of the smoothed sweep; the starts are tried at a half or a quarter of them.
    ``also``: values to be among those swept. ``patience``: transient of the exact flow from the starts.
    """
    begin, data = VARIED[figure], dict[str, xr.Dataset]()

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


def draw_diagram(ax: Axes, data: Datasets, key: str, y: str, figure: str) -> None:
    """One diagram: up, down over it, in grey what other starts lead to, and what is ``MARKED``.

    On that of the exact flow the branches of periodic orbits. Other starts that reached no period are told apart: chaos
    looks like a transient that is not over.
    """
    many, swept = data[f"{key}_starts"], data[key]
    other, settled = other_motions(many, swept), many["period_number"] > 0
    for chosen, color, size, name in (
        (other & ~settled, "#D0D0D0", 1.4, "other starts, no period"),
        (other & settled, "#8C8C8C", 1.8, "other starts, periodic"),
    ):
        if chosen.any():
            plot.bifurcation(many.assign(section=many["section"].where(chosen)), ax, y=y, color=color, size=size)
            ax.get_lines()[-1].set(label=name, zorder=0.3)
    lines = [  # with special points on those of period 1 and 2
        one if int(one["period_number"]) <= 2 else one.isel(special=slice(0, 0))
        for one in (branches_of(data) if key == EXACT.key else ())
    ]
    plot.bifurcation(swept, *lines, ax, y=y, size=0.9 if swept.sizes["iterate"] > 100 else 1.1, linewidth=1.0)
    mark(ax, figure)


def _draw(canvas: Canvas, data: Datasets, figure: str) -> None:
    """The velocity at the section, by each flow."""
    grid = canvas.subplots(1, 2, sharey=True)
    for ax, flow, letter in zip(grid, FLOWS, "ab", strict=True):
        draw_diagram(ax, data, flow.key, "v", figure)
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


def mark(ax: Axes, figure: str, foot: bool = False) -> None:
    """A dotted line with its number at each value that is ``MARKED``, at the top or at the foot."""
    values, words = MARKED[figure]
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


def how(data: Datasets) -> str:
    """Branches and settings of the sweeps, for a caption."""
    words = []
    for flow in FLOWS:
        swept, many = data[flow.key], data[f"{flow.key}_starts"]
        parameter = parameter_of(swept)
        words.append(
            f"{flow.key}: {swept.sizes[parameter]} values up and down, {swept.sizes['iterate']} section points each "
            f"after {swept.attrs['transient']} periods; {many.sizes['start']} starts at {many.sizes[parameter]} "
            f"values, after {many.attrs['transient']} periods"
        )
    return (
        "Branches in (a): orbits of periods up to 8 of the exact flow, continued; where they are stable, the swept "
        "points lie on them. Special points are marked on those of period 1 and 2. Section at "
        f"phase 0. {'; '.join(words)}."
    )


def _compute_17(settings: Settings) -> Datasets:
    data = diagrams(settings, "fig17", (800, 300), FIGURE_18, PATIENCE)
    for word, transient in {"short": 600, "long": 50_000}.items():  # how long chaos lasts just above grazing
        data[f"exact_{word}"] = sweep(
            EXACT.system(**FIGURE_17),
            "omega",
            [_JUST_ABOVE],
            direction=None,
            start=starts(16),
            transient=transient,
            keep=64,
            progress=settings.progress,
            **EXACT.options,
        ).assign_attrs(transient=transient)
    return data


def _draw_17(canvas: Canvas, data: Datasets) -> None:
    grid = canvas.subplots(2, 2, sharex=True, sharey="row")
    for j, flow in enumerate(FLOWS):
        for i, state in enumerate("xv"):
            draw_diagram(grid[i, j], data, flow.key, state, "fig17")
            ends = data[flow.key]["omega"].values[[0, -1]]
            mark_grazing(grid[i, j], [omega for omega in grazing_of(data[flow.key]) if ends[0] < omega < ends[1]])
        grid[0, j].set_title(f"({'ab'[j]}) {flow.title}")
    many = data["exact_starts"]
    for period, (low, high) in _windows(data).items():  # named above the highest of their points; in x above each other
        top = many["section"].sel(state="v", omega=slice(low, high)).where(many["period_number"] == period).max()
        annotate(grid[1, 0], f"period {period}", (0.5 * (low + high), float(top)), (0, 3), ha="center")
    only_outer(grid)
    shared_legend(canvas)


def _windows(data: Datasets) -> dict[int, tuple[float, float]]:
    """Periods above 1 that starts reach at frequencies above grazing, each with its lowest and highest frequency."""
    above = data["exact_starts"].sel(omega=slice(_JUST_ABOVE, None))
    periods = above["period_number"]
    found = {}
    for period in np.unique(periods.values[periods.values > 1]):
        at = above["omega"].values[(periods == period).any("start").values]
        found[period] = (at[0], at[-1])
    return found


def _caption_17(data: Datasets) -> str:
    grazing = ", ".join(f"{omega:.5f}" for omega in grazing_of(data["exact"]))
    text = (
        "Bifurcation diagram over the forcing frequency, rho = 0.23 N, g = 3.6 mm: displacement (above) and "
        "velocity at the section. Dotted: the three frequencies of Fig. 18; green: closed-form grazing of the "
        f"motion without contact ({grazing} rad/s; in (b) that of a gap g - eta). Above it chaos dies out, given time: "
        "what has no period in (b) had no time to. "
        "Grey shows motions that coexist with what the sweeps follow. "
    )
    if windows := _windows(data):
        ends = {n: sorted({f"{low:.2f}", f"{high:.2f}"}) for n, (low, high) in windows.items()}
        words = " and ".join(f"period {period} at {' to '.join(at)} rad/s" for period, at in ends.items())
        text += (
            f"The small hooks above grazing are narrow windows of further motions: {words}, each with motions of no "
            "period at its lower end. "
        )
    return text + how(data)


FIGURES = (
    Figure(
        "fig11",
        11,
        "Bifurcation diagram over the forcing amplitude",
        partial(diagrams, figure="fig11", steps=(600, 300), also=FIGURE_12),
        partial(_draw, figure="fig11"),
        lambda data: (
            "Bifurcation diagram over the forcing amplitude, omega = 3.69 rad/s, g = -4.5 mm: velocity at the section. "
            "Dotted: the paper's printed ends of chaos (0.26 N), period 4 (0.28 N) and period 2 (0.406 N). " + how(data)
        ),
    ),
    Figure(
        "fig13",
        13,
        "Bifurcation diagram over the gap",
        partial(diagrams, figure="fig13", steps=(700, 280), also=FIGURE_14),
        partial(_draw, figure="fig13"),
        lambda data: (
            "Bifurcation diagram over the gap, omega = 11.15 rad/s, rho = 0.33 N: velocity at the section. Dotted: the "
            "four gaps of Fig. 14. Grey shows motions that coexist with what the sweeps follow. " + how(data)
        ),
    ),
    Figure(
        "fig17", 17, "Bifurcation diagrams over the forcing frequency", _compute_17, _draw_17, _caption_17, (1.0, 0.76)
    ),
)
