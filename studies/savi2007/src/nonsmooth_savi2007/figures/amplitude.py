"""Figures 11 and 12: the forcing amplitude is varied at a support that is pressed at rest (g = -0.0045 m).

On the virtual rig a slow rise of the forcing, and steady records.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.plot import comparison_diagram, shared_legend
from nonsmooth_savi2007.figures.branches import BEGINNINGS
from nonsmooth_savi2007.figures.diagrams import (
    ABOUT_BRANCHES,
    diagrams,
    draw_both,
    how,
    mark_values,
)
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure
from nonsmooth_savi2007.figures.motions import GRID, compared, draw_pairs, motions, said
from nonsmooth_savi2007.figures.portraits import describe, draw_portraits, portraits, sheet_size
from nonsmooth_savi2007.flows import Settings
from nonsmooth_savi2007.printed import FIGURE_11, FIGURE_12, NUMBERS

PRINTED = {NUMBERS[key].value: NUMBERS[key].text for key in ("period 4 from", "period 2 from", "period 1 from")}
_WORDS = "printed in the paper (N)"
RISES = (450.0, 900.0, 1800.0)  # s, from 0.2 to 0.5 N; the one in the middle is drawn
_SHORT = (300.0,)


def _caption_11(data: Datasets) -> str:
    return (
        "Bifurcation diagram over the forcing amplitude, omega = 3.69 rad/s, g = -4.5 mm: velocity at the section. "
        "Dotted: the paper's printed ends of chaos (0.26 N), period 4 (0.28 N) and period 2 (0.406 N). "
        + ABOUT_BRANCHES
        + how(data)
    )


def _caption_12(data: Datasets) -> str:
    return (
        "Phase portraits with section points (black) at four amplitudes of Fig. 11; contact zone x > g shaded, orbit "
        "in contact in vermilion. " + describe(data, FIGURE_12)
    )


def _rise(settings: Settings) -> Datasets:
    bench, data = settings.bench, {}
    for duration in _SHORT if settings.quick else RISES:
        session = bench.record(f"fig11_{duration:g}_s", bench.rig.figure(11, duration=duration))
        measured, set_ = bench.measured(session, "rise", bench.with_support(session, "rise"))
        fine = 121 if settings.quick else 301
        data[f"{duration:g}"] = bench.compare(
            measured, set_, parameter="rho", direction="up", values=np.linspace(*BEGINNINGS["fig11"].range, fine)
        ).assign_attrs(rise=f"{duration:g} s")
    return data


def _draw_rise(canvas: Canvas, data: Datasets) -> None:
    ax = canvas.subplots()
    comparison_diagram(_drawn(data), ax, y="v")
    ax.margins(y=0.14)  # the marks of flips above
    mark_values(ax, PRINTED, _WORDS, foot=True)
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
    return float(rise[kind].values[at[0]]) if len(at) else float("nan")


def flips_said(result: xr.Dataset, name: str) -> str:
    """``1-2 at 0.401, 2-4 at 0.270``: the flips of one kind; those that were not found are left out."""
    rows = zip(result["flip"].values, result[name].values, strict=True)
    return ", ".join(f"{flip} at {value:.4f}" for flip, value in rows if np.isfinite(value)) or "none found"


def _records(settings: Settings) -> Datasets:
    periods = 60 if settings.quick else 200
    return compared(settings.bench, motions(settings.bench, 12, tuple(FIGURE_12), periods=periods), grid=GRID)


def _caption_records(data: Datasets) -> str:
    return (
        "State space with section points at four amplitudes of Fig. 11, the model with the parameters identified "
        "(above) and the virtual rig (synthetic, below); crosses: the model's section points; contact zone shaded. "
        f"Rig: {said(data, FIGURE_12, 'N')}."
    )


_SHOWN: dict[str, Any] = {"parameter": "rho", "shown": FIGURE_12}

FIGURES = (
    Figure(
        "fig11",
        11,
        "Bifurcation diagram over the forcing amplitude",
        partial(diagrams, figure="fig11", steps=(600, 300), also=FIGURE_12),
        partial(draw_both, values=PRINTED, words=_WORDS),
        _caption_11,
    ),
    Figure(
        "fig12",
        12,
        "Phase portraits over the forcing amplitude",
        partial(portraits, parameters=FIGURE_11, **_SHOWN),
        partial(draw_portraits, **_SHOWN),
        _caption_12,
        sheet_size(FIGURE_12),
    ),
    Figure("fig11_rig", 11, "Slow rise of the forcing", _rise, _draw_rise, _caption_rise, (0.72, 0.56), rig=True),
    Figure(
        "fig12_rig",
        12,
        "State space over the forcing amplitude",
        _records,
        partial(draw_pairs, **_SHOWN),
        _caption_records,
        sheet_size(FIGURE_12),
        rig=True,
    ),
)
