"""The experimental side of Figs. 13, 14 and 16: the gap is varied on the virtual rig; the strange attractor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth import plot, sweep
from nonsmooth.plot import comparison_diagram
from nonsmooth.plot.comparison import MEASURED, THEORY
from nonsmooth.plot.labels import name_and_unit, name_axes
from nonsmooth.studies.savi2007.figures.diagrams import mark_values, shared_legend
from nonsmooth.studies.savi2007.figures.figure import Canvas, Datasets, Figure, drawn, only_outer
from nonsmooth.studies.savi2007.figures.gap import GAPS, PHASES
from nonsmooth.studies.savi2007.flows import EXACT, Settings, starts
from nonsmooth.studies.savi2007.printed import FIGURE_14
from nonsmooth.studies.savi2007.rig_figures.motions import (
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
)  # fmt: skip

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.studies.savi2007.laboratory import Laboratory

__all__ = ["FIGURES", "transient_points"]

_ANGLES = ("0", r"\pi/2", r"\pi", r"3\pi/2")


def _records(bench: Laboratory) -> Motions:
    """The steady records at four gaps, measured once for Figs. 13 and 14."""
    return bench.once("fig14", lambda: motions(bench, 14, tuple(FIGURE_14), periods=60 if bench.quick else 100))


def _compute_13(settings: Settings) -> Datasets:
    found = _records(settings.bench)
    measured, set_ = diagram_of(found, "g")
    fine = 71 if settings.quick else 351
    result = settings.bench.compare(
        measured, set_, parameter="g", direction="both", values=np.linspace(-0.0015, 0.002, fine)
    )
    return {"compared": result, "runs": runs_of(found, "g"), "starts": _coexisting(settings, set_)}


def _coexisting(settings: Settings, set_: Mapping[str, Any]) -> xr.Dataset:
    """The model's motions from several starts, with the parameters identified."""
    return sweep(
        model_at(settings.bench, set_), "g", np.linspace(-0.0015, 0.002, 21 if settings.quick else 141), direction=None,
        start=starts(4 if settings.quick else 12), transient=settings.of(EXACT, exact=600, smoothed=0, quick=80),
        keep=32, progress=False, **EXACT.options,
    )  # fmt: skip


@drawn(0.72, 0.56)
def _draw_13(canvas: Canvas, data: Datasets) -> None:
    ax = canvas.subplots()
    plot.bifurcation(data["starts"], ax, y="v", color="#B4B4B4", size=1.8)
    ax.get_lines()[0].set(label="theory, several starts", zorder=0.5)
    compared, over = without_flips(data["compared"]), transient_points(data["compared"], data["runs"])
    comparison_diagram(compared.isel(sample=~over), ax, y="v", size=2.8)
    if over.any():
        points = compared.isel(sample=over)
        ax.plot(
            points["measured_g"].values, points["measured_section"].sel(state="v").values, "_", markersize=4,
            color=plot.COLORS["muted"], markeredgewidth=0.3, rasterized=True, zorder=1,
            label="virtual rig (synthetic), transient",
        )  # fmt: skip
    mark_values(ax, GAPS, "gaps of Fig. 14 (mm)")
    shared_legend(canvas, columns=3)


def transient_points(compared: xr.Dataset, runs: xr.Dataset) -> np.ndarray:
    """Mask of the section points of records that have no period where others at the same setting have one."""
    periodic = runs["period_number"].values > 0
    settled = set(runs["setting"].values[periodic])
    over = np.array([setting in settled for setting in runs["setting"].values]) & ~periodic
    return np.repeat(over, compared.sizes["sample"] // runs.sizes["run"])  # as many points of each run, run by run


def _caption_13(data: Datasets) -> str:
    gaps = ", ".join(f"{1e3 * g:.2f}" for g in np.unique(data["compared"]["measured_g"].values))
    return (
        "Velocity at the section over the gap: the virtual rig (synthetic) at four settings of the support, let go "
        "from several places, over the model's diagram with the parameters identified, swept up and down (blue) and "
        "from several starts (grey). Grey bars: records that have no period yet where others at the same gap "
        "have one, transient chaos. Gaps "
        f"referred to the car's mean position under the drive: {gaps} mm."
    )


def _compute_14(settings: Settings) -> Datasets:
    """At each gap the first record of each period number that its starts lead to."""
    found = _records(settings.bench)
    runs = runs_of(found, "g")
    first: dict[tuple[float, int], str] = {}
    for key, setting, number in zip(found, runs["setting"].values, runs["period_number"].values, strict=True):
        first.setdefault((float(setting), int(number)), key)
    return compared(settings.bench, {key: found[key] for key in first.values()}, grid=GRID)


def _caption_14(data: Datasets) -> str:
    return (
        "State space at the gaps of the paper's caption, the model with the parameters identified (above) and the "
        "virtual rig (synthetic, below); crosses are the model's section points, the contact zone is shaded. "
        "Where starts lead to several motions, that of the paper is drawn. "
        f"Rig: {said(data, FIGURE_14, 'm')}."
    )


def _compute_16(settings: Settings) -> Datasets:
    bench = settings.bench
    found = motions(bench, 16, (0.0018,), periods=300 if settings.quick else 1500)
    measured, set_ = found["0.0018"]
    return {"attractor": bench.compare(measured, set_, section_phase=list(PHASES.values()))}


@drawn(1.0, 0.56)
def _draw_16(canvas: Canvas, data: Datasets) -> None:
    result = data["attractor"]
    grid = canvas.subplots(2, 4, sharex="col", sharey="col")
    for row, side, color in zip(grid, SIDES, (THEORY, MEASURED), strict=True):
        for i, ax in enumerate(row):
            points = result[f"{side}_section"].isel(section_phase=i).values
            looks = {"color": color, "markersize": 1.4, "markeredgewidth": 0, "rasterized": True}
            ax.plot(points[:, 0], points[:, 1], ".", **looks)
            name_axes(ax, name_and_unit(result, "x"), name_and_unit(result, "v"))
            ax.set_ylabel(f"{SIDES[side]}\n{ax.get_ylabel()}")
            if side == "theory":
                ax.set_title(f"({'abcd'[i]}) phase ${_ANGLES[i]}$", y=1.0, pad=9)
    only_outer(grid)


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


FIGURES = (
    Figure("fig13_rig", 13, "Sections at four gaps over the bifurcation diagram", _compute_13, _draw_13,
           _caption_13, rig=True),
    Figure("fig14_rig", 14, "State space over the gap", _compute_14,
           draw_pairs("m", "g", FIGURE_14), _caption_14, rig=True),
    Figure("fig16", 16, "Strange attractor at four section phases", _compute_16, _draw_16,
           _caption_16, rig=True),
)  # fmt: skip
