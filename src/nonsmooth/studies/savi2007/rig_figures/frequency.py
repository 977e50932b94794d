"""The experimental side of Figs. 17 and 18: the forcing frequency is varied on the virtual rig across chaos."""

from __future__ import annotations

import numpy as np

from nonsmooth.plot import comparison_diagram, comparison_phase_portrait
from nonsmooth.studies.savi2007.figures.diagrams import mark_values, shared_legend
from nonsmooth.studies.savi2007.figures.figure import Canvas, Datasets, Figure, drawn, only_outer
from nonsmooth.studies.savi2007.figures.frequency import SHOWN
from nonsmooth.studies.savi2007.flows import Settings
from nonsmooth.studies.savi2007.printed import FIGURE_18
from nonsmooth.studies.savi2007.rig_figures.motions import (
    GRID,
    chosen,
    compared,
    diagram_of,
    motions,
    runs_of,
    said,
    without_flips,
)  # fmt: skip

__all__ = ["FIGURES"]


_PATIENCE = 4000  # periods: above grazing the model's chaos is a transient, which is no motion to compare with


def _compute_17(settings: Settings) -> Datasets:
    from nonsmooth.studies.savi2007.rig.figures import SECTIONS

    bench = settings.bench
    steps = [omega for omega, _, _ in SECTIONS[17]]
    found = motions(bench, 17, steps, periods=40 if settings.quick else 60)
    measured, set_ = diagram_of(found, "omega")
    fine = 101 if settings.quick else 401
    result = bench.compare(measured, set_, parameter="omega", direction="both", values=np.linspace(8.4, 10.4, fine))
    return {"compared": result, "runs": runs_of(found, "omega")}


@drawn(1.0, 0.5)
def _draw_17(canvas: Canvas, data: Datasets) -> None:
    for ax, state, letter in zip(canvas.subplots(1, 2), "xv", "ab", strict=True):
        comparison_diagram(without_flips(data["compared"]), ax, y=state, size=2.6)
        mark_values(ax, SHOWN, "frequencies of Fig. 18 (rad/s)")
        ax.set_title(f"({letter})", loc="left")
    shared_legend(canvas)


def _caption_17(data: Datasets) -> str:
    result = data["compared"]
    steps = np.unique(result["measured_omega"].values)
    return (
        f"Displacement and velocity at the section over the forcing frequency: the virtual rig (synthetic) at "
        f"{len(steps)} steps of rising frequency, over the model's diagram with the parameters identified, swept up "
        "and down. Dotted: the frequencies of Fig. 18."
    )


def _compute_18(settings: Settings) -> Datasets:
    return compared(
        settings.bench, motions(settings.bench, 18, tuple(FIGURE_18), periods=60 if settings.quick else 200),
        grid=GRID, transient=600 if settings.quick else _PATIENCE,
    )  # fmt: skip


@drawn(1.0, 0.44)
def _draw_18(canvas: Canvas, data: Datasets) -> None:
    grid = canvas.subplots(1, 3, sharey=True)
    for ax, letter, (omega, wanted) in zip(grid, "abc", FIGURE_18.items(), strict=True):
        comparison_phase_portrait(chosen(data, omega, wanted), ax, zone="g")
        ax.set_title(rf"({letter}) $\omega = {omega:g}$ rad/s", loc="left")
    grid[0].autoscale(axis="y")  # no room for legends of their own
    only_outer(grid)
    shared_legend(canvas)


def _caption_18(data: Datasets) -> str:
    return (
        "State space at three frequencies of Fig. 17: the virtual rig (synthetic, dashed, section points black) "
        "over the model with the parameters identified; the contact zone is shaded. "
        f"Rig: {said(data, FIGURE_18, 'rad/s')}."
    )


FIGURES = (
    Figure("fig17_rig", 17, "Sections over the forcing frequency", _compute_17, _draw_17,
           _caption_17, rig=True),
    Figure("fig18_rig", 18, "State space over the forcing frequency", _compute_18, _draw_18,
           _caption_18, rig=True),
)  # fmt: skip
