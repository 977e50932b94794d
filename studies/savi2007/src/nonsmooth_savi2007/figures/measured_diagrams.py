"""Figures 11, 13 and 17 on the virtual rig: a slow rise of the forcing, and steady records at settings of gap and
frequency, over the model's diagrams with the parameters identified."""

from __future__ import annotations

import numpy as np
import xarray as xr

from nonsmooth import plot, sweep, system_of
from nonsmooth.plot import COLORS, comparison_diagram, shared_legend
from nonsmooth_savi2007.figures.branches import VARIED
from nonsmooth_savi2007.figures.diagrams import mark
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure
from nonsmooth_savi2007.figures.motions import diagram_of, motions, runs_of
from nonsmooth_savi2007.flows import EXACT, Settings, starts

RISES = (450.0, 900.0, 1800.0)  # s, from 0.2 to 0.5 N; the one in the middle is drawn
_SHORT = (300.0,)


def _rise(settings: Settings) -> Datasets:
    bench, data = settings.bench, {}
    for duration in _SHORT if settings.quick else RISES:
        session = bench.record(f"fig11_{duration:g}_s", bench.rig.figure(11, duration=duration))
        measured, set_ = bench.measured(session, "rise")
        values = np.linspace(*VARIED["fig11"].range, 121 if settings.quick else 301)
        compared = bench.compare(measured, set_, parameter="rho", direction="up", values=values)
        data[f"{duration:g}"] = compared.assign_attrs(rise=f"{duration:g} s")
    return data


def _draw_rise(canvas: Canvas, data: Datasets) -> None:
    ax = canvas.subplots()
    comparison_diagram(_drawn(data), ax, y="v")
    ax.margins(y=0.14)  # the marks of flips above
    mark(ax, "fig11", foot=True)
    shared_legend(canvas, columns=3)


def _drawn(data: Datasets) -> xr.Dataset:
    return list(data.values())[len(data) // 2]


def rate_of(rise: xr.Dataset) -> float:
    """The rate of a rise (N/s)."""
    return 0.3 / float(rise.attrs["rise"].split()[0])


def _caption_rise(data: Datasets) -> str:
    read = [f"{1e3 * rate_of(one):.3f} mN/s: {flips_said(one, 'measured_flip_read')}" for one in data.values()]
    found = [flips_said(one, "measured_flip") for one in data.values()]
    drawn = _drawn(data)
    return (
        "Velocity at the section while the forcing of the virtual rig (synthetic) rises slowly and evenly, 0.2 to "
        f"0.5 N in {drawn.attrs['rise']}, over the model's diagram with the parameters identified. Marks above: flips "
        "of the model (blue), of the record (black) and of the record with its delay taken out (diamond). Where the "
        "records themselves change their period, late by the more the faster they rise: "
        f"{'; '.join(read)} (in N). The flips with this delay taken out, in the same order: "
        f"{'; '.join(found)}. The model's: {flips_said(drawn, 'theory_flip')}. Dotted: the paper's printed ends of "
        "chaos, period 4 and period 2."
    )


def slowest(data: Datasets) -> xr.Dataset:
    """The rise that took longest."""
    return min(data.values(), key=rate_of)


def flip_of(rise: xr.Dataset, name: str, kind: str) -> float:
    """A number of the flip ``1-2`` or ``2-4`` of a rise; NaN where there is none."""
    at = np.flatnonzero(rise["flip"].values.astype(str) == name)
    return rise[kind].values[at[0]] if len(at) else np.nan


def flips_said(result: xr.Dataset, name: str) -> str:
    """``1-2 at 0.401, 2-4 at 0.270``: the flips of one kind; those that were not found are left out."""
    rows = zip(result["flip"].values, result[name].values, strict=True)
    return ", ".join(f"{flip} at {value:.4f}" for flip, value in rows if np.isfinite(value)) or "none found"


def _compared(settings: Settings, figure: str, number: int, n: int) -> Datasets:
    """The motions recorded for Fig. ``number`` as a diagram over the model's of ``n`` values, swept up and down."""
    found, begin = motions(settings.bench, number), VARIED[figure]
    measured, set_ = diagram_of(found, begin.parameter)
    values = np.linspace(*begin.range, n)
    result = settings.bench.compare(measured, set_, parameter=begin.parameter, direction="both", values=values)
    return {"compared": result, "runs": runs_of(found, begin.parameter)}


def _without_flips(result: xr.Dataset) -> xr.Dataset:
    """A diagram for a picture of steady runs: a few settings do not tell where a period doubles."""
    return result.isel(flip=slice(0, 0)) if "flip" in result.dims else result


def _measure_13(settings: Settings) -> Datasets:
    """The diagram, and the model's motions from several starts, with the parameters identified."""
    data = _compared(settings, "fig13", 14, 71 if settings.quick else 351)
    points, count, transient = (21, 4, 80) if settings.quick else (141, 12, 600)
    data["starts"] = sweep(
        system_of(data["compared"]),
        "g",
        np.linspace(*VARIED["fig13"].range, points),
        direction=None,
        start=starts(count),
        transient=transient,
        keep=32,
        progress=False,
        **EXACT.options,
    )
    return data


def _draw_13(canvas: Canvas, data: Datasets) -> None:
    ax = canvas.subplots()
    plot.bifurcation(data["starts"], ax, y="v", color="#B4B4B4", size=1.8)
    ax.get_lines()[0].set(label="theory, several starts", zorder=0.5)
    compared, over = _without_flips(data["compared"]), transient_points(data["compared"], data["runs"])
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
    mark(ax, "fig13")
    shared_legend(canvas, columns=3)


def transient_points(compared: xr.Dataset, runs: xr.Dataset) -> np.ndarray:
    """Mask of the section points of records that have no period where others at the same setting have one."""
    periodic, setting = runs["period_number"].values > 0, runs["setting"].values
    over = np.isin(setting, setting[periodic]) & ~periodic
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


def _draw_17(canvas: Canvas, data: Datasets) -> None:
    for ax, state, letter in zip(canvas.subplots(1, 2), "xv", "ab", strict=True):
        comparison_diagram(_without_flips(data["compared"]), ax, y=state, size=2.6)
        mark(ax, "fig17")
        ax.set_title(f"({letter})", loc="left")
    shared_legend(canvas)


def _caption_17(data: Datasets) -> str:
    steps = np.unique(data["compared"]["measured_omega"].values)
    return (
        f"Displacement and velocity at the section over the forcing frequency: the virtual rig (synthetic) at "
        f"{len(steps)} steps of rising frequency, over the model's diagram with the parameters identified, swept up "
        "and down. Dotted: the frequencies of Fig. 18."
    )


_SIZE = (0.72, 0.56)
FIGURES = (
    Figure("fig11_rig", 11, "Slow rise of the forcing", _rise, _draw_rise, _caption_rise, _SIZE, rig=True),
    Figure(
        "fig13_rig",
        13,
        "Sections at four gaps over the bifurcation diagram",
        _measure_13,
        _draw_13,
        _caption_13,
        _SIZE,
        rig=True,
    ),
    Figure(
        "fig17_rig",
        17,
        "Sections over the forcing frequency",
        lambda settings: _compared(settings, "fig17", 17, 101 if settings.quick else 401),
        _draw_17,
        _caption_17,
        rig=True,
    ),
)
