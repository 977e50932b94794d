"""Figures 9 and 10: amplitude over the forcing frequency, up and down, with the jumps and the grazing frequencies.

On the virtual rig frequency steps, over the response of the model with the parameters identified.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from nonsmooth import frequency_response, plot
from nonsmooth.plot import annotate, comparison_response, shared_legend
from nonsmooth_savi2007.figures.branches import VARIED, branches, branches_of
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure, only_outer
from nonsmooth_savi2007.flows import EXACT, FLOWS, Settings
from nonsmooth_savi2007.laboratory import as_result
from nonsmooth_savi2007.measure import grazing_frequencies, jumps, measured_periods
from nonsmooth_savi2007.printed import NUMBERS
from nonsmooth_savi2007.rig.motor import voltage_for


def grazing_of(response: xr.Dataset) -> list[float]:
    """Closed-form grazing frequencies at the parameters of a response (rad/s): of g - eta where it is smoothed."""
    parameters = {name: float(response[name]) for name in ("m", "k", "c", "rho", "g")}
    band = float(response["eta"]) if "eta" in response.coords else 0.0
    return grazing_frequencies({**parameters, "g": parameters["g"] - band})


def mark_grazing(ax: Axes, places: Sequence[float]) -> None:
    """A short line at the foot for each grazing in closed form, so that it hides no jump that begins there."""
    for i, place in enumerate(places):
        ax.plot(
            [place, place],
            [0.0, 0.07],
            color=plot.COLORS["third"],
            linewidth=2.0,
            transform=ax.get_xaxis_transform(),
            zorder=1,
            label="grazing, closed form" if i == 0 else None,
            solid_capstyle="butt",
        )


def _compute(settings: Settings, name: str) -> Datasets:
    data, (low, high) = {}, VARIED[name].range
    for flow in FLOWS:
        step = settings.of(flow, exact=0.0025, smoothed=0.005, quick=0.02)
        data[flow.key] = frequency_response(
            flow.system(**VARIED[name].parameters),
            np.linspace(low, high, round((high - low) / step) + 1),
            transient=settings.of(flow, exact=300, smoothed=150, quick=60),
            keep=16,
            max_period=4,
            progress=settings.progress,
            **flow.options,
        )
    return data | branches(name)


def _draw(canvas: Canvas, data: Datasets, printed: Sequence[float]) -> None:
    """Each flow's response with grazing frequencies, the range of period 2, and the paper's numbers."""
    grid = canvas.subplots(1, 2, sharey=True)
    for ax, flow, letter in zip(grid, FLOWS, "ab", strict=True):
        response = data[flow.key]
        plot.frequency_response(response, *(branches_of(data) if flow is EXACT else []), ax)
        mark_grazing(ax, grazing_of(response))
        doubled = (response["period_number"] == 2).any("direction").values
        if doubled.any():
            ax.fill_between(
                response["omega"].values,
                0,
                1,
                where=doubled,
                transform=ax.get_xaxis_transform(),
                color=plot.COLORS["zone"],
                alpha=0.25,
                linewidth=0,
                zorder=0,
                label="period 2",
            )
        _mark_printed(ax, printed)
        ax.margins(y=0.12)
        ax.set_title(f"({letter}) {flow.title}", y=1.0, pad=14 if printed else 6)
    only_outer(grid)
    shared_legend(canvas)


def _mark_printed(ax: Axes, printed: Sequence[float]) -> None:
    """The paper's numbers at the upper edge."""
    for i, value in enumerate(printed):
        ax.plot(
            value,
            1.0,
            "v",
            transform=ax.get_xaxis_transform(),
            color="black",
            markersize=4,
            clip_on=False,
            label="printed in the paper (rad/s)" if i == 0 else None,
        )
        annotate(ax, f"{value:.2f}", (value, 1.0), (0, 3.5), xycoords=ax.get_xaxis_transform(), ha="center")


def _caption(data: Datasets, printed: str) -> str:
    exact = data["exact"]
    grazing = " and ".join(f"{omega:.5f}" for omega in grazing_of(exact))
    fine, coarse = (np.diff(data[flow.key]["omega"].values).max() for flow in FLOWS)
    return (
        f"Frequency response for rho = {float(exact['rho']):g} N and g = {1e3 * float(exact['g']):g} mm: half the "
        "peak-to-peak displacement with rising and falling frequency; arrows: jumps, with their frequencies. "
        "Branches in (a): periodic orbits of the exact flow, continued. "
        f"Closed-form grazing at {grazing} rad/s (green; in (b) of g - eta). Steps of "
        f"{fine:.4f} rad/s (exact) and {coarse:.4f} rad/s (smoothed; a shorter transient). {printed}"
    )


def _measure(settings: Settings, number: int) -> Datasets:
    bench = settings.bench
    session = bench.record(f"fig{number:02d}", bench.rig.figure(number, **_steps(settings, number)))
    measured, set_ = bench.measured(session, "response")
    return {"compared": bench.compare(measured, set_), "runs": as_result(measured, "response over frequency")}


def _steps(settings: Settings, number: int) -> dict[str, Any]:
    """Steps of the frequency: the rig's own for Fig. 9; for Fig. 10 finer about its small jump; few for a quick run."""

    if settings.quick:
        omegas, options = np.arange(2.5, 6.6, 0.25), {"duration": 14.0}
    elif number == 10:
        parts = ((2.4, 2.6, 0.05), (2.64, 2.78, 0.01), (2.8, 5.4, 0.1), (5.45, 6.65, 0.05), (6.7, 7.3, 0.1))
        omegas = np.concatenate([np.arange(low, high + step / 2, step) for low, high, step in parts])
        options = {}
    else:
        return {}
    return {"voltages": [voltage_for(settings.bench.rig, float(omega)) for omega in omegas], **options}


def _draw_rig(canvas: Canvas, data: Datasets, printed: Sequence[float]) -> None:
    ax = canvas.subplots()
    comparison_response(data["compared"], ax)
    _mark_printed(ax, printed)
    shared_legend(canvas, columns=2)


def _caption_rig(data: Datasets) -> str:
    runs, compared = data["runs"], data["compared"]
    words = [
        f"{word}: {', '.join(map(str, jumps(runs, direction))) or 'none'} rad/s"
        for direction, word in (("up", "rising"), ("down", "falling"))
    ]
    doubled = np.count_nonzero(measured_periods(runs)[1] == 2)
    differences = 100 * np.abs(compared["relative_difference"].values)
    return (
        f"Frequency steps on the virtual rig (synthetic), {runs.sizes['run']} runs with rising and falling frequency, "
        f"over the model's response with the parameters identified, rho = {float(compared['rho']):.4f} N and g = "
        f"{1e3 * float(compared['g']):.3f} mm. Jumps of the rig, {'; '.join(words)}; {doubled} runs with period 2. "
        f"Half of the runs lie within {np.nanmedian(differences):.2f} % of the model, nine of ten within "
        f"{np.nanquantile(differences, 0.9):.1f} %. Diamonds: jumps measured (full) and predicted (open), with their "
        "difference."
    )


_PRINTED_9 = [NUMBERS[key].value for key in ("period 2 near", "jump rising", "jump falling")]
_SHOWN: tuple[tuple[int, str, Sequence[float], str], ...] = (
    (9, "Frequency response with a period-2 range", _PRINTED_9, "Triangles: printed in the paper."),
    (10, "Frequency response with a small jump", (), "The paper prints no numbers for this figure."),
)

FIGURES = tuple(
    Figure(
        f"fig{number:02d}",
        number,
        title,
        partial(_compute, name=f"fig{number:02d}"),
        partial(_draw, printed=printed),
        partial(_caption, printed=words),
    )
    for number, title, printed, words in _SHOWN
) + tuple(
    Figure(
        f"fig{number:02d}_rig",
        number,
        title,
        partial(_measure, number=number),
        partial(_draw_rig, printed=printed),
        _caption_rig,
        (0.72, 0.6),
        rig=True,
    )
    for number, title, printed, _ in _SHOWN
)
