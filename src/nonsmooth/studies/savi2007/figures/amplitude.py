"""Figures 11 and 12: the forcing amplitude is varied at a support that is pressed at rest (g = -0.0045 m)."""

from __future__ import annotations

from nonsmooth.studies.savi2007.figures.branches import branches
from nonsmooth.studies.savi2007.figures.diagrams import ABOUT_BRANCHES, diagrams, draw_both, how
from nonsmooth.studies.savi2007.figures.figure import Datasets, Figure
from nonsmooth.studies.savi2007.figures.portraits import describe, draw_portraits, portraits
from nonsmooth.studies.savi2007.flows import Settings
from nonsmooth.studies.savi2007.printed import FIGURE_11, FIGURE_12, NUMBERS

__all__ = ["FIGURES", "PRINTED"]

PRINTED = {NUMBERS[key].value: NUMBERS[key].text for key in ("period 4 from", "period 2 from", "period 1 from")}


def _compute_11(settings: Settings) -> Datasets:
    return diagrams(settings, FIGURE_11, "rho", 0.2, 0.5, (600, 300), tuple(FIGURE_12)) | branches("fig11")


def _caption_11(data: Datasets) -> str:
    return (
        "Bifurcation diagram over the forcing amplitude, omega = 3.69 rad/s, g = -4.5 mm: velocity at the section. "
        "Dotted: the paper's printed ends of chaos (0.26 N), period 4 (0.28 N) and period 2 (0.406 N). "
        + ABOUT_BRANCHES
        + how(data)
    )


def _compute_12(settings: Settings) -> Datasets:
    return portraits(settings, FIGURE_11, "rho", FIGURE_12)


def _caption_12(data: Datasets) -> str:
    return (
        "Phase portraits with section points (black) at four amplitudes of Fig. 11; contact zone x > g shaded, orbit "
        "in contact in vermilion. " + describe(data, FIGURE_12)
    )


FIGURES = (
    Figure(
        "fig11", 11, "Bifurcation diagram over the forcing amplitude", _compute_11,
        draw_both(PRINTED, "printed in the paper (N)"), _caption_11,
    ),
    Figure(
        "fig12", 12, "Phase portraits over the forcing amplitude", _compute_12,
        draw_portraits("rho", "N", r"\rho", FIGURE_12), _caption_12,
    ),
)  # fmt: skip
