"""Figures 15 and 16: the strange attractor at g = 0.0018 m, sections at four phases: by the model, and from the rig."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from matplotlib.axes import Axes

from nonsmooth import Stroboscopic, lyapunov, plot, poincare
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure, two_rows
from nonsmooth_savi2007.figures.motions import SIDES, motions
from nonsmooth_savi2007.figures.portraits import EXPONENT_PERIODS
from nonsmooth_savi2007.flows import FLOWS, Settings
from nonsmooth_savi2007.printed import FIGURE_13

PHASES = {"0": 0.0, "quarter": 0.25, "half": 0.5, "three_quarters": 0.75}  # of a forcing period
_ANGLES = ("0", r"\pi/2", r"\pi", r"3\pi/2")
_ABOUT = "Strange attractor at g = 1.8 mm, omega = 11.15 rad/s, rho = 0.33 N: sections at four phases of the forcing"


def _draw(canvas: Canvas, rows: Iterable[str], cell: Callable[[Axes, int, int], object]) -> None:
    """A row of sections at the four phases for each of ``rows``."""
    two_rows(canvas, list(rows), [f"phase ${angle}$" for angle in _ANGLES], cell, sharey="col")


def _compute(settings: Settings) -> Datasets:
    data = {}
    for flow in FLOWS:
        system = flow.system(g=0.0018, **FIGURE_13)
        n = settings.of(flow, exact=20_000, smoothed=20_000, quick=2_000)
        for key, phase in PHASES.items():
            data[f"{flow.key}_{key}"] = poincare(
                system, section=Stroboscopic(phase), n=n, transient=300, **flow.options
            )
        data[f"{flow.key}_exponents"] = lyapunov(system, periods=EXPONENT_PERIODS, progress=False, **flow.options)
    return data


def _draw_model(canvas: Canvas, data: Datasets) -> None:
    keys = list(PHASES)
    _draw(
        canvas,
        (flow.short for flow in FLOWS),
        lambda ax, i, j: plot.section(data[f"{FLOWS[i].key}_{keys[j]}"], ax, size=0.7),
    )


def _caption(data: Datasets) -> str:
    sizes = " and ".join(f"{data[f'{flow.key}_0'].sizes['iterate']} ({flow.key})" for flow in FLOWS)
    return f"{_ABOUT}, {sizes} points each, from rest. Both rows have the same axes."


def _measure(settings: Settings) -> Datasets:
    ((measured, set_),) = motions(settings.bench, 16).values()
    return {"attractor": settings.bench.compare(measured, set_, section_phase=list(PHASES.values()))}


def _draw_rig(canvas: Canvas, data: Datasets) -> None:
    result = data["attractor"]

    def cell(ax: Axes, i: int, j: int) -> None:
        points = result[f"{list(SIDES)[i]}_section"].isel(section_phase=j).values
        color = plot.COLORS[("first", "section")[i]]
        ax.plot(*points.T, ".", color=color, markersize=1.4, markeredgewidth=0, rasterized=True)
        plot.name_plane(ax, result, "x", "v")

    _draw(canvas, SIDES.values(), cell)


def _caption_rig(data: Datasets) -> str:
    result = data["attractor"]
    far, halves = result["energy_distance_matched"].values, result["measured_halves_p95"].values
    words = ", ".join(f"{a:.3f} ({a / b:.2f})" for a, b in zip(far, halves, strict=True))
    return (
        f"{_ABOUT} by the model with the parameters identified (above) and from one record of the virtual rig "
        f"(synthetic, below, {result.sizes['measured_iterate']} turns). Energy distances of the two clouds at the four "
        f"phases, and over the 95th percentile of those of the record's own halves: {words}."
    )


_TITLE, _SIZE = "Strange attractor at four section phases", (1.0, 0.56)
FIGURES = (
    Figure("fig15", 15, _TITLE, _compute, _draw_model, _caption, _SIZE),
    Figure("fig16", 16, _TITLE, _measure, _draw_rig, _caption_rig, _SIZE, rig=True),
)
