"""Figures 17 and 18: the forcing frequency is varied across a range of chaos that ends in grazing."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from nonsmooth import poincare, sweep
from nonsmooth.plot import annotate, comparison_diagram, comparison_phase_portrait, shared_legend
from nonsmooth_savi2007.figures.branches import BEGINNINGS
from nonsmooth_savi2007.figures.diagrams import (
    ABOUT_BRANCHES,
    diagrams,
    draw_diagram,
    how,
    mark_grazing,
    mark_values,
)
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure, only_outer
from nonsmooth_savi2007.figures.motions import (
    GRID,
    chosen,
    compared,
    diagram_of,
    motions,
    runs_of,
    said,
    without_flips,
)
from nonsmooth_savi2007.figures.portraits import (
    chosen_start,
    describe,
    draw_portraits,
    portraits,
    sheet_size,
    twins,
)
from nonsmooth_savi2007.figures.resonance import grazing_of
from nonsmooth_savi2007.flows import EXACT, FLOWS, Settings, starts
from nonsmooth_savi2007.printed import FIGURE_17, FIGURE_18
from nonsmooth_savi2007.rig.figures import SECTIONS

_CHAOTIC = 9.55
_JUST_ABOVE = 9.8  # rad/s, above the grazing frequency
SHOWN = {omega: f"{omega:.2f}" for omega in FIGURE_18}
_SHOWN: dict[str, Any] = {"parameter": "omega", "shown": FIGURE_18}
_WORDS = "frequencies of Fig. 18 (rad/s)"
_PATIENCE = 4000  # periods: above grazing the model's chaos is a transient, which is no motion to compare with


def _compute_17(settings: Settings) -> Datasets:
    data = diagrams(settings, "fig17", (800, 300), FIGURE_18, patience=_PATIENCE)
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
            ax = grid[i, j]
            draw_diagram(ax, data, flow.key, state, values=SHOWN, words=_WORDS)
            ends = data[flow.key]["omega"].values[[0, -1]]
            mark_grazing(ax, [omega for omega in grazing_of(data[flow.key]) if ends[0] < omega < ends[1]])
            if flow is EXACT and state == "v":  # above each other in x
                _name_windows(ax, data, state)
        grid[0, j].set_title(f"({'ab'[j]}) {flow.title}")
    only_outer(grid)
    shared_legend(canvas)


def _windows(data: Datasets) -> dict[int, tuple[float, float]]:
    """Periods above 1 that starts reach at frequencies above grazing, each with its lowest and highest frequency."""
    above = data["exact_starts"].sel(omega=slice(_JUST_ABOVE, None))
    periods = above["period_number"]
    found = {}
    for period in np.unique(periods.values[periods.values > 1]):
        at = above["omega"].values[(periods == period).any("start").values]
        found[int(period)] = (float(at[0]), float(at[-1]))
    return found


def _name_windows(ax: Axes, data: Datasets, state: str) -> None:
    """The period of each window, above the highest of its points."""
    many = data["exact_starts"]
    for period, (low, high) in _windows(data).items():
        top = many["section"].sel(state=state, omega=slice(low, high)).where(many["period_number"] == period).max()
        annotate(ax, f"period {period}", (0.5 * (low + high), float(top)), (0, 3), ha="center")


def _caption_17(data: Datasets) -> str:
    grazing = ", ".join(f"{omega:.5f}" for omega in grazing_of(data["exact"]))
    return (
        "Bifurcation diagram over the forcing frequency, rho = 0.23 N, g = 3.6 mm: displacement (above) and "
        "velocity at the section. Dotted: the three frequencies of Fig. 18; green: closed-form grazing of the "
        f"motion without contact ({grazing} rad/s; in (b) that of a gap g - eta). Above it chaos dies out, given time: "
        "what has no period in (b) had no time to. "
        f"Grey shows motions that coexist with what the sweeps follow. {_about_windows(data)}"
        + ABOUT_BRANCHES
        + how(data)
    )


def _about_windows(data: Datasets) -> str:
    ends = {n: sorted({f"{low:.2f}", f"{high:.2f}"}) for n, (low, high) in _windows(data).items()}
    if not ends:
        return ""
    words = " and ".join(f"period {period} at {' to '.join(at)} rad/s" for period, at in ends.items())
    return (
        f"The small hooks above grazing are narrow windows of further motions: {words}, each with motions of no period "
        "at its lower end. "
    )


def _compute_18(settings: Settings) -> Datasets:
    data = portraits(settings, FIGURE_17, **_SHOWN)
    for flow in FLOWS:
        begin = starts(data[flow.key].sizes["start"])[chosen_start(data[flow.key], _CHAOTIC, FIGURE_18[_CHAOTIC])]
        system = flow.system(omega=_CHAOTIC, **FIGURE_17)
        attractor = poincare(system, start=begin, transient=300, n=1000, **flow.options)
        data[f"{flow.key}_twins"] = twins(flow, system, attractor)
    return data


def _caption_18(data: Datasets) -> str:
    return (
        "Phase portraits at three frequencies of Fig. 17; section points black, contact zone shaded. Where motions "
        "coexist, the first start that ends in the paper's is drawn. " + describe(data, FIGURE_18)
    )


def _measure_17(settings: Settings) -> Datasets:

    bench = settings.bench
    found = motions(bench, 17, [omega for omega, _, _ in SECTIONS[17]], periods=40 if settings.quick else 60)
    measured, set_ = diagram_of(found, "omega")
    values = np.linspace(*BEGINNINGS["fig17"].range, 101 if settings.quick else 401)
    result = bench.compare(measured, set_, parameter="omega", direction="both", values=values)
    return {"compared": result, "runs": runs_of(found, "omega")}


def _draw_rig_17(canvas: Canvas, data: Datasets) -> None:
    for ax, state, letter in zip(canvas.subplots(1, 2), "xv", "ab", strict=True):
        comparison_diagram(without_flips(data["compared"]), ax, y=state, size=2.6)
        mark_values(ax, SHOWN, _WORDS)
        ax.set_title(f"({letter})", loc="left")
    shared_legend(canvas)


def _caption_rig_17(data: Datasets) -> str:
    steps = np.unique(data["compared"]["measured_omega"].values)
    return (
        f"Displacement and velocity at the section over the forcing frequency: the virtual rig (synthetic) at "
        f"{len(steps)} steps of rising frequency, over the model's diagram with the parameters identified, swept up "
        "and down. Dotted: the frequencies of Fig. 18."
    )


def _measure_18(settings: Settings) -> Datasets:
    return compared(
        settings.bench,
        motions(settings.bench, 18, tuple(FIGURE_18), periods=60 if settings.quick else 200),
        grid=GRID,
        transient=600 if settings.quick else _PATIENCE,
    )


def _draw_rig_18(canvas: Canvas, data: Datasets) -> None:
    grid = canvas.subplots(1, 3, sharey=True)
    for ax, letter, (omega, wanted) in zip(grid, "abc", FIGURE_18.items(), strict=True):
        comparison_phase_portrait(chosen(data, omega, wanted), ax, zone="g")
        ax.set_title(rf"({letter}) $\omega = {omega:g}$ rad/s", loc="left")
    grid[0].autoscale(axis="y")  # no room for legends of their own
    only_outer(grid)
    shared_legend(canvas)


def _caption_rig_18(data: Datasets) -> str:
    return (
        "State space at three frequencies of Fig. 17: the virtual rig (synthetic, dashed, section points black) "
        "over the model with the parameters identified; the contact zone is shaded. "
        f"Rig: {said(data, FIGURE_18, 'rad/s')}."
    )


FIGURES = (
    Figure(
        "fig17", 17, "Bifurcation diagrams over the forcing frequency", _compute_17, _draw_17, _caption_17, (1.0, 0.76)
    ),
    Figure(
        "fig18",
        18,
        "Phase portraits over the forcing frequency",
        _compute_18,
        partial(draw_portraits, **_SHOWN),
        _caption_18,
        sheet_size(FIGURE_18),
    ),
    Figure(
        "fig17_rig", 17, "Sections over the forcing frequency", _measure_17, _draw_rig_17, _caption_rig_17, rig=True
    ),
    Figure(
        "fig18_rig",
        18,
        "State space over the forcing frequency",
        _measure_18,
        _draw_rig_18,
        _caption_rig_18,
        (1.0, 0.44),
        rig=True,
    ),
)
