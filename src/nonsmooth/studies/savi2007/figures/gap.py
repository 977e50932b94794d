"""Figures 13, 14 and 15: the gap is varied, from pressed at rest to open; the strange attractor at g = 0.0018 m."""

from __future__ import annotations

from nonsmooth import Stroboscopic, plot, poincare
from nonsmooth.plot.units import prefixed
from nonsmooth.studies.savi2007.figures.branches import branches
from nonsmooth.studies.savi2007.figures.diagrams import ABOUT_BRANCHES, diagrams, draw_both, how
from nonsmooth.studies.savi2007.figures.figure import Canvas, Datasets, Figure, drawn, only_outer
from nonsmooth.studies.savi2007.figures.portraits import describe, draw_portraits, portraits
from nonsmooth.studies.savi2007.figures.twins import twins
from nonsmooth.studies.savi2007.flows import FLOWS, Settings
from nonsmooth.studies.savi2007.printed import FIGURE_13, FIGURE_14, FIGURE_14_TEXT

__all__ = ["FIGURES", "GAPS", "PHASES"]

PHASES = {"0": 0.0, "quarter": 0.25, "half": 0.5, "three_quarters": 0.75}  # of a forcing period
_ANGLES = ("0", r"\pi/2", r"\pi", r"3\pi/2")
_CHAOTIC = 0.0018
GAPS = {g: prefixed(g, "m")[0] for g in FIGURE_14}


def _compute_13(settings: Settings) -> Datasets:
    return diagrams(settings, FIGURE_13, "g", -0.0015, 0.002, (700, 280), tuple(FIGURE_14)) | branches("fig13")


def _caption_13(data: Datasets) -> str:
    return (
        "Bifurcation diagram over the gap, omega = 11.15 rad/s, rho = 0.33 N: velocity at the section. Dotted: the "
        "four gaps of Fig. 14. Grey shows motions that coexist with what the sweeps follow. "
        + ABOUT_BRANCHES
        + how(data)
    )


def _compute_14(settings: Settings) -> Datasets:
    return portraits(settings, FIGURE_13, "g", FIGURE_14, others=tuple(FIGURE_14_TEXT))


def _caption_14(data: Datasets) -> str:
    return (
        "Phase portraits at the gaps of the paper's caption; section points black, contact zone shaded. Where motions "
        "coexist, the first start that ends in the paper's is drawn. " + describe(data, FIGURE_14)
    )


def _compute_15(settings: Settings) -> Datasets:
    data = {}
    for flow in FLOWS:
        system = flow.system(g=_CHAOTIC, **FIGURE_13)
        n = settings.of(flow, exact=20_000, smoothed=20_000, quick=2_000)
        for key, phase in PHASES.items():
            data[f"{flow.key}_{key}"] = poincare(
                system, section=Stroboscopic(phase), n=n, transient=300, **flow.options
            )
        data[f"{flow.key}_twins"] = twins(flow, system, data[f"{flow.key}_0"])
    return data


@drawn(1.0, 0.56)
def _draw_15(canvas: Canvas, data: Datasets) -> None:
    grid = canvas.subplots(2, 4, sharex="col", sharey="col")
    for row, flow in zip(grid, FLOWS, strict=True):
        for i, (ax, key) in enumerate(zip(row, PHASES, strict=True)):
            plot.section(data[f"{flow.key}_{key}"], ax, size=0.7)
            ax.set_ylabel(f"{flow.short}\n{ax.get_ylabel()}")
            if flow is FLOWS[0]:
                ax.set_title(f"({'abcd'[i]}) phase ${_ANGLES[i]}$", y=1.0, pad=9)
    only_outer(grid)


def _caption_15(data: Datasets) -> str:
    sizes = " and ".join(f"{data[f'{flow.key}_0'].sizes['iterate']} ({flow.key})" for flow in FLOWS)
    return (
        "Strange attractor at g = 1.8 mm, omega = 11.15 rad/s, rho = 0.33 N: sections at four phases of the "
        f"forcing, {sizes} points each, from rest. Both rows have the same axes."
    )


FIGURES = (
    Figure(
        "fig13", 13, "Bifurcation diagram over the gap", _compute_13, draw_both(GAPS, "gaps of Fig. 14 (mm)"),
        _caption_13,
    ),
    Figure(
        "fig14", 14, "Phase portraits over the gap", _compute_14, draw_portraits("g", "m", "g", FIGURE_14), _caption_14
    ),
    Figure("fig15", 15, "Strange attractor at four section phases", _compute_15, _draw_15, _caption_15),
)  # fmt: skip
