"""Figures 13 to 16: the gap is varied, from pressed at rest to open; the strange attractor at g = 0.0018 m.

On the virtual rig steady records at four gaps, and a long one for the attractor.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from nonsmooth import Stroboscopic, plot, poincare, sweep
from nonsmooth.plot import COLORS, comparison_diagram, name_plane, prefixed, shared_legend
from nonsmooth_savi2007.figures.branches import BEGINNINGS
from nonsmooth_savi2007.figures.diagrams import (
    ABOUT_BRANCHES,
    diagrams,
    draw_both,
    how,
    mark_values,
)
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure, two_rows
from nonsmooth_savi2007.figures.motions import (
    GRID,
    SIDES,
    Motions,
    compared,
    diagram_of,
    draw_pairs,
    model_at,
    motions,
    runs_of,
    said,
    without_flips,
)
from nonsmooth_savi2007.figures.portraits import describe, draw_portraits, portraits, sheet_size, twins
from nonsmooth_savi2007.flows import EXACT, FLOWS, Settings, starts
from nonsmooth_savi2007.laboratory import Laboratory
from nonsmooth_savi2007.printed import FIGURE_13, FIGURE_14, FIGURE_14_TEXT

PHASES = {"0": 0.0, "quarter": 0.25, "half": 0.5, "three_quarters": 0.75}  # of a forcing period
_ANGLES = ("0", r"\pi/2", r"\pi", r"3\pi/2")
_CHAOTIC = 0.0018
GAPS = {g: prefixed(g, "m")[0] for g in FIGURE_14}


def _caption_13(data: Datasets) -> str:
    return (
        "Bifurcation diagram over the gap, omega = 11.15 rad/s, rho = 0.33 N: velocity at the section. Dotted: the "
        "four gaps of Fig. 14. Grey shows motions that coexist with what the sweeps follow. "
        + ABOUT_BRANCHES
        + how(data)
    )


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


def _draw_attractor(canvas: Canvas, rows: list[str], cell: Callable[[Axes, int, int], object]) -> None:
    """A row of sections at the four phases for each of ``rows``."""
    two_rows(canvas, rows, [f"phase ${angle}$" for angle in _ANGLES], cell, sharey="col")


def _draw_15(canvas: Canvas, data: Datasets) -> None:
    keys = list(PHASES)
    _draw_attractor(
        canvas,
        [flow.short for flow in FLOWS],
        lambda ax, i, j: plot.section(data[f"{FLOWS[i].key}_{keys[j]}"], ax, size=0.7),
    )


def _caption_15(data: Datasets) -> str:
    sizes = " and ".join(f"{data[f'{flow.key}_0'].sizes['iterate']} ({flow.key})" for flow in FLOWS)
    return (
        "Strange attractor at g = 1.8 mm, omega = 11.15 rad/s, rho = 0.33 N: sections at four phases of the "
        f"forcing, {sizes} points each, from rest. Both rows have the same axes."
    )


@cache
def _records(bench: Laboratory) -> Motions:
    """The steady records at four gaps, measured once for Figs. 13 and 14."""
    return motions(bench, 14, tuple(FIGURE_14), periods=60 if bench.quick else 100)


def _measure_13(settings: Settings) -> Datasets:
    found = _records(settings.bench)
    measured, set_ = diagram_of(found, "g")
    fine = 71 if settings.quick else 351
    result = settings.bench.compare(
        measured, set_, parameter="g", direction="both", values=np.linspace(*BEGINNINGS["fig13"].range, fine)
    )
    return {"compared": result, "runs": runs_of(found, "g"), "starts": _coexisting(settings, set_)}


def _coexisting(settings: Settings, set_: Mapping[str, Any]) -> xr.Dataset:
    """The model's motions from several starts, with the parameters identified."""
    points, count, transient = (21, 4, 80) if settings.quick else (141, 12, 600)
    return sweep(
        model_at(settings.bench, set_),
        "g",
        np.linspace(*BEGINNINGS["fig13"].range, points),
        direction=None,
        start=starts(count),
        transient=transient,
        keep=32,
        progress=False,
        **EXACT.options,
    )


def _draw_rig_13(canvas: Canvas, data: Datasets) -> None:
    ax = canvas.subplots()
    plot.bifurcation(data["starts"], ax, y="v", color="#B4B4B4", size=1.8)
    ax.get_lines()[0].set(label="theory, several starts", zorder=0.5)
    compared, over = without_flips(data["compared"]), transient_points(data["compared"], data["runs"])
    comparison_diagram(compared.isel(sample=~over), ax, y="v", size=2.8)
    if over.any():
        points = compared.isel(sample=over)
        ax.plot(
            points["measured_g"].values,
            points["measured_section"].sel(state="v").values,
            "_",
            markersize=4,
            color=COLORS["muted"],
            markeredgewidth=0.3,
            rasterized=True,
            zorder=1,
            label="virtual rig (synthetic), transient",
        )
    mark_values(ax, GAPS, "gaps of Fig. 14 (mm)")
    shared_legend(canvas, columns=3)


def transient_points(compared: xr.Dataset, runs: xr.Dataset) -> np.ndarray:
    """Mask of the section points of records that have no period where others at the same setting have one."""
    periodic = runs["period_number"].values > 0
    settled = set(runs["setting"].values[periodic])
    over = np.array([setting in settled for setting in runs["setting"].values]) & ~periodic
    return np.repeat(over, compared.sizes["sample"] // runs.sizes["run"])  # as many points of each run, run by run


def _caption_rig_13(data: Datasets) -> str:
    gaps = ", ".join(f"{1e3 * g:.2f}" for g in np.unique(data["compared"]["measured_g"].values))
    return (
        "Velocity at the section over the gap: the virtual rig (synthetic) at four settings of the support, let go "
        "from several places, over the model's diagram with the parameters identified, swept up and down (blue) and "
        "from several starts (grey). Grey bars: records that have no period yet where others at the same gap "
        "have one, transient chaos. Gaps "
        f"referred to the car's mean position under the drive: {gaps} mm."
    )


def _measure_14(settings: Settings) -> Datasets:
    """At each gap the first record of each period number that its starts lead to."""
    found = _records(settings.bench)
    runs = runs_of(found, "g")
    first: dict[tuple[float, int], str] = {}
    for key, setting, number in zip(*(runs[name].values for name in ("run", "setting", "period_number")), strict=True):
        first.setdefault((float(setting), int(number)), str(key))
    return compared(settings.bench, {key: found[key] for key in first.values()}, grid=GRID)


def _caption_rig_14(data: Datasets) -> str:
    return (
        "State space at the gaps of the paper's caption, the model with the parameters identified (above) and the "
        "virtual rig (synthetic, below); crosses are the model's section points, the contact zone is shaded. "
        "Where starts lead to several motions, that of the paper is drawn. "
        f"Rig: {said(data, FIGURE_14, 'm')}."
    )


def _measure_16(settings: Settings) -> Datasets:
    bench = settings.bench
    measured, set_ = motions(bench, 16, (0.0018,), periods=300 if settings.quick else 1500)["0.0018"]
    return {"attractor": bench.compare(measured, set_, section_phase=list(PHASES.values()))}


def _draw_16(canvas: Canvas, data: Datasets) -> None:
    result = data["attractor"]

    def cell(ax: Axes, i: int, j: int) -> None:
        points = result[f"{list(SIDES)[i]}_section"].isel(section_phase=j).values
        ax.plot(
            *points.T,
            ".",
            color=COLORS[("first", "section")[i]],
            markersize=1.4,
            markeredgewidth=0,
            rasterized=True,
        )
        name_plane(ax, result, "x", "v")

    _draw_attractor(canvas, list(SIDES.values()), cell)


def _caption_16(data: Datasets) -> str:
    result = data["attractor"]
    far, halves = result["energy_distance_matched"].values, result["measured_halves_p95"].values
    words = ", ".join(f"{a:.3f} ({a / b:.2f})" for a, b in zip(far, halves, strict=True))
    return (
        "Strange attractor at g = 1.8 mm, omega = 11.15 rad/s, rho = 0.33 N: sections at four phases of the forcing "
        "by the model with the parameters identified (above) and from one record of the virtual rig (synthetic, below, "
        f"{result.sizes['measured_iterate']} turns). Energy distances of the two clouds at the four phases, and over "
        f"the 95th percentile of those of the record's own halves: {words}."
    )


_SHOWN: dict[str, Any] = {"parameter": "g", "shown": FIGURE_14}

FIGURES = (
    Figure(
        "fig13",
        13,
        "Bifurcation diagram over the gap",
        partial(diagrams, figure="fig13", steps=(700, 280), also=FIGURE_14),
        partial(draw_both, values=GAPS, words="gaps of Fig. 14 (mm)"),
        _caption_13,
    ),
    Figure(
        "fig14",
        14,
        "Phase portraits over the gap",
        partial(portraits, parameters=FIGURE_13, others=tuple(FIGURE_14_TEXT), **_SHOWN),
        partial(draw_portraits, **_SHOWN),
        _caption_14,
        sheet_size(FIGURE_14),
    ),
    Figure("fig15", 15, "Strange attractor at four section phases", _compute_15, _draw_15, _caption_15, (1.0, 0.56)),
    Figure(
        "fig13_rig",
        13,
        "Sections at four gaps over the bifurcation diagram",
        _measure_13,
        _draw_rig_13,
        _caption_rig_13,
        (0.72, 0.56),
        rig=True,
    ),
    Figure(
        "fig14_rig",
        14,
        "State space over the gap",
        _measure_14,
        partial(draw_pairs, **_SHOWN),
        _caption_rig_14,
        sheet_size(FIGURE_14),
        rig=True,
    ),
    Figure(
        "fig16",
        16,
        "Strange attractor at four section phases",
        _measure_16,
        _draw_16,
        _caption_16,
        (1.0, 0.56),
        rig=True,
    ),
)
