"""Figures 4 to 8 and Table 1: the procedures of Section 3.1 on the virtual rig, and the parameters they tell."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from nonsmooth import ParameterSet, plot
from nonsmooth.identification import Estimate
from nonsmooth.plot import identification as pictures
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure
from nonsmooth_savi2007.flows import Settings
from nonsmooth_savi2007.laboratory import TRUTH, as_result, found_in, kept, the_finding
from nonsmooth_savi2007.measure import with_uncertainty
from nonsmooth_savi2007.printed import NUMBERS, TABLE_1
from nonsmooth_savi2007.rig import IDENTIFICATION, UNITS, load_truth

#: What Table 1 holds and what identification adds to it, with units and symbols.
NAMES = {
    "k": ("N/m", "$k$"),
    "k_s": ("N/m", "$k_s$"),
    "c": ("N s/m", "$c$"),
    "c_s": ("N s/m", "$c_s$"),
    "m": ("kg", "$m$"),
    "omega_0": ("rad/s", r"$\omega_0$"),
    "gap_at_rest": ("m", "gap at rest"),
    "friction": ("N", "dry friction"),
}


def _findings(settings: Settings, names: Mapping[str, str]) -> Datasets:
    return {key: kept(the_finding(settings.bench.identified, name)) for key, name in names.items()}


def _side_by_side(canvas: Canvas, data: Datasets, *parts: tuple[str, Callable[..., Any], str]) -> None:
    """Draw pictures in a row: key of the dataset, what draws it, title."""
    axes = np.atleast_1d(canvas.subplots(1, len(parts)))
    for ax, (key, picture, title) in zip(axes, parts, strict=True):
        picture(data[key], ax)
        ax.set_title(title, loc="left", pad=6 + _legend_above(ax))


def _legend_above(ax: Axes) -> float:
    """Height in points of a legend that stands above the axes, in the place of the title."""
    legend = ax.get_legend()
    if legend is None or legend.get_bbox_to_anchor().transformed(ax.transAxes.inverted()).y0 < 0.99:
        return 0.0
    return 72 * legend.get_window_extent().height / ax.figure.dpi


def _spectrum(data: xr.Dataset, ax: Axes) -> None:
    """The spectrum of the tap with the peak as the paper reads it."""
    pictures.impulse_response(data, ax)
    printed = NUMBERS["peak of the DFT"]
    ax.axvline(printed.value, color="black", linestyle=":", linewidth=1.0, label=f"printed in the paper {printed}")
    ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2, handlelength=1.6, columnspacing=1, borderaxespad=0.2)


def _caption_4(data: Datasets) -> str:
    car, support = found_in(data["oscillator"]), found_in(data["support"])
    return (
        f"Force against displacement, {len(car.runs)} pulls of the car and {len(support.runs)} pushes of the support's "
        f"spring by hand. (a) Slope 2k = {car.estimate}, k = {car.estimate.times(0.5)} (most of it the force sensor's "
        f"gain, within 1 %); below, what the mean line leaves, the two ways apart by twice the dry friction. (b) k_s = "
        f"{support.estimate}. The paper: 8.47 and 1210 N/m."
    )


def _caption_5(data: Datasets) -> str:
    found = found_in(data["tap"])
    return (
        "Impulsive response of the car and the magnitude of its DFT. (a) Tap and free decay with the fitted motion. "
        f"(b) {found.notes[0]}. The paper reads 0.732 Hz. In the time domain omega_0 = {found.estimate}."
    )


def _caption_6(data: Datasets) -> str:
    viscous, both = found_in(data["viscous"]), found_in(data["amplitudes"])
    return (
        f"Amplitude over frequency without the support, {len(viscous.runs)} runs, and the fitted model. Viscous "
        f"damping alone, as in the paper: c = {viscous.estimate}; {viscous.notes[0]}. With dry friction beside it: c = "
        f"{both.estimate}. The paper: 0.87 N s/m."
    )


def _caption_7(data: Datasets) -> str:
    found = found_in(data["drop"])
    return (
        f"Free decay of the support with 1.33 kg on it. (a) One of {len(found.runs)} runs. (b) Logarithm of its "
        f"turning points: damping ratio {found.others['damping_ratio']}, c_s = "
        f"{with_uncertainty(found.value, found.uncertainty)} N s/m, from all runs. "
        "The paper: 0.0075 and 0.60 N s/m."
    )


def _caption_8(data: Datasets) -> str:
    motor, crank = found_in(data["voltage"]), found_in(data["crank"])
    return (
        f"Calibrations of the drive with fitted lines and what they leave. (a) Frequency over motor voltage, "
        f"{len(motor.runs)} runs: slope {motor.estimate}; the motor turns from {motor.others['offset']} on. (b) "
        f"Forcing amplitude over crank length, {len(crank.runs)} runs: slope {crank.estimate}, which is k. The paper "
        "has no numbers."
    )


def _compute_table(settings: Settings) -> Datasets:
    bench = settings.bench
    identified = bench.identified.to_dataset()  # first: it reads the session folder only
    truth = load_truth(bench.folder / TRUTH)
    truth |= {"omega_0": np.sqrt(2 * truth["k"] / truth["m"]), "gap_at_rest": truth["g"]}
    units = [UNITS.get(name, NAMES.get(name, ("",))[0]) for name in truth]
    table = xr.Dataset({"value": ("name", list(truth.values())), "unit": ("name", units)}, {"name": list(truth)})
    return {
        "identified": identified,
        "truth": as_result(table, "truth of the virtual rig"),
        "sensors": bench.sensors(),
    }


def table_rows(data: Datasets) -> dict[str, tuple[str, Estimate, float]]:
    """Of each quantity of ``NAMES``: as the paper prints it ("" where it does not), as identified, and the truth."""
    identified, truth = ParameterSet.from_dataset(data["identified"]), data["truth"]
    found = {**identified.estimates, **identified.extra}
    return {
        name: (TABLE_1[name].text if name in TABLE_1 else "", found[name], float(truth["value"].sel(name=name)))
        for name in NAMES
        if name in found
    }


def _draw_table(canvas: Canvas, data: Datasets) -> None:
    rows = table_rows(data)
    ax = canvas.subplots()
    ax.axvline(0, color=plot.COLORS["muted"], linewidth=0.6, zorder=0)
    for i, (name, (printed, number, truth)) in enumerate(rows.items()):
        ax.errorbar(
            100 * (number.value / truth - 1),
            i + 0.12,
            xerr=100 * number.expanded / truth,
            fmt="o",
            color=plot.COLORS["first"],
            markersize=3,
            capsize=1.5,
            elinewidth=0.8,
            label=None if i else "identified on the virtual rig (synthetic), 95 %",
        )
        if printed:
            ax.errorbar(
                100 * (TABLE_1[name].value / truth - 1),
                i - 0.2,
                xerr=100 * TABLE_1[name].rounding / truth,
                fmt="s",
                markersize=3,
                color="black",
                markerfacecolor="white",
                capsize=1.5,
                elinewidth=0.6,
                label=None if i else "printed in the paper, with its rounding",
            )
    ax.set_yticks(range(len(rows)), [NAMES[name][1] for name in rows])
    ax.set_ylim(len(rows) - 0.5, -0.5)
    ax.set_xlabel("difference from the rig's truth (%)")
    ax.legend(loc="lower right")


def _caption_table(data: Datasets) -> str:
    rows = table_rows(data)
    inside = sum(low <= truth <= high for _, number, truth in rows.values() for low, high in [number.interval()])
    return (
        "Table 1 by identification: each parameter's 95 % interval beside the rig's truth (which identification does "
        f"not see) and the paper's printed value. The truth lies in {inside} of {len(rows)} intervals. The rig was "
        "given the paper's values, so this checks the procedures, not the paper; omega_0 is printed as 4.60 rad/s "
        "where k and m say 4.50."
    )


def _procedure(
    number: int,
    title: str,
    caption: Callable[[Datasets], str],
    procedures: tuple[str, ...],
    names: Mapping[str, str],
    *parts: tuple[str, Callable[..., Any], str],
    size: tuple[float, float] = (1.0, 0.5),
) -> Figure:
    """A figure of findings: ``names`` by key of the dataset; ``parts`` as for `_side_by_side`."""
    return Figure(
        f"fig{number:02d}",
        number,
        title,
        partial(_findings, names=names),
        lambda canvas, data: _side_by_side(canvas, data, *parts),
        caption,
        size,
        rig=True,
        procedures=procedures,
    )


FIGURES = (
    _procedure(
        4,
        "Spring stiffness: force against displacement",
        _caption_4,
        ("springs", "support"),
        {"oscillator": "spring_slope", "support": "support_slope"},
        ("oscillator", pictures.force_displacement, "(a) oscillator"),
        ("support", pictures.force_displacement, "(b) support"),
    ),
    _procedure(
        5,
        "Natural frequency from an impulsive response",
        _caption_5,
        ("impulse",),
        {"tap": "omega_0"},
        ("tap", pictures.impulse_history, "(a) displacement"),
        ("tap", _spectrum, "(b) magnitude of the DFT"),
    ),
    _procedure(
        6,
        "Damping from the amplitude over frequency",
        _caption_6,
        ("impulse", "response"),
        {"viscous": "c_viscous_only", "amplitudes": "c_response"},
        ("amplitudes", pictures.amplitude_fit, ""),
        size=(0.62, 0.5),
    ),
    _procedure(
        7,
        "Damping of the support from a free decay",
        _caption_7,
        ("drop",),
        {"drop": "c_s_drop"},
        ("drop", pictures.impulse_history, "(a) displacement of the test mass"),
        ("drop", pictures.drop_decay, "(b) turning points"),
        size=(1.0, 0.42),
    ),
    _procedure(
        8,
        "Calibrations of the drive",
        _caption_8,
        ("springs", "voltage", "crank"),
        {"voltage": "voltage_frequency", "crank": "crank_force"},
        ("voltage", pictures.calibration, "(a) motor"),
        ("crank", pictures.calibration, "(b) crank"),
    ),
    Figure(
        "table1",
        None,
        "Table 1: parameters identified",
        _compute_table,
        _draw_table,
        _caption_table,
        (1.0, 0.36),
        rig=True,
        procedures=IDENTIFICATION,
    ),
)
