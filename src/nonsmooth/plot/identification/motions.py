"""Motions: impulse responses and their spectrum, grazing, records with contact, tossed bodies, steady responses."""

from __future__ import annotations

from typing import Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import MEASURED
from nonsmooth.plot.identification.picture import Picture, data_of, number, picture
from nonsmooth.system.kinds import Positive

_TIME, _DISPLACEMENT = ("time", "s"), ("displacement", "m")
_BINS = 9  # shown on either side of the peak
_PEAKS = (("peak_frequency", "interpolated peak", "first", "-"), ("decay_frequency", "decay fit", "second", "--"))
_IMPACTS = ((True, "second", "-", "impact of one corner"), (False, "muted", ":", "other impact"))
_METHODS = {
    "fit": ("fit", "first", "-"),
    "phase": ("line of the phases", "third", "-."),
    "spectrum": ("peak of the spectrum", "second", "--"),
}


@picture("magnitude frequency peak_frequency", ("frequency", "Hz"), "magnitude")
def impulse_response(one: Picture, finding: Any) -> None:
    """Draw the spectrum of an impulse response about its peak.

    Stems are the lines of the transform. The largest of them can be half a step away from the frequency; the
    interpolated peak and the decay fit are not bound to the grid.

    Parameters
    ----------
    finding
        A natural frequency, or its data: ``magnitude`` over ``frequency``, ``peak_frequency``, ``grid_peak``,
        ``grid_step``, ``decay_frequency``.
    ax
        Where to draw; a new one-column figure if None.
    """
    frequency, magnitude = one.values("frequency", "magnitude")
    peak, step = number(one.data, "grid_peak"), number(one.data, "grid_step")
    top = int(np.nanargmax(magnitude if np.isnan(peak) else -np.abs(frequency - peak)))
    shown = slice(max(top - _BINS, 0), top + _BINS + 1)
    at, heights = frequency[shown], magnitude[shown]
    one.ax.vlines(at, 0, heights, color=MEASURED, linewidth=0.7)
    one.ax.plot(at, heights, "o", color=MEASURED, markersize=2.6, label=f"DFT, {one.word}")
    if "fine_magnitude" in one.data:
        fine, curve = one.values("fine_frequency", "fine_magnitude")
        inside = (fine >= at[0]) & (fine <= at[-1])
        one.line(fine[inside], curve[inside], "transform between its lines", "muted", linewidth=0.7)
    largest = frequency[top]
    words = f"largest line {largest:.4f} Hz, half a step to each side"
    one.span(largest - step / 2, largest + step / 2, words)
    for name, word, color, line in _PEAKS:
        if np.isfinite(value := number(one.data, name)):
            one.ax.axvline(
                value, label=f"{word} {value:.4f} Hz", color=style.COLORS[color], linestyle=line, linewidth=1.0
            )
    one.ax.set_ylim(0, 1.06 * heights.max())


@picture("x time", _TIME, _DISPLACEMENT, loc="upper right", columns=1, margin=0)
def impulse_history(one: Picture, finding: Any) -> None:
    """Draw the impulse response over time, with the decay that was fitted to it."""
    time, x = one.values("time", "x")
    # Joined: a few unjoined samples per oscillation make patterns that are not there.
    one.line(time, x, one.word, "section", linewidth=0.5)
    if "fitted" in one.data:
        one.line(time, one.data["fitted"].values, "fitted decay", "second", "--", linewidth=1.0)


@picture("setting amplitude", "setting", ("largest displacement", "m"))
def grazing(one: Picture, finding: Any) -> None:
    """Draw the largest displacement over the stepped setting, free runs and runs with contact told apart.

    Parameters
    ----------
    finding
        A gap from grazing, or its data: ``setting``, ``amplitude``, ``contact`` over ``run``; ``grazing_low``,
        ``grazing_high``, ``gap``.
    ax
        Where to draw; a new one-column figure if None.
    """
    data = one.data
    contact = data["contact"].values.astype(bool) if "contact" in data else np.zeros(data["setting"].shape, bool)
    for chosen, face, word in ((~contact, "white", "free"), (contact, MEASURED, "contact")):
        one.points("setting", "amplitude", f"{one.word}, {word}", where=chosen, face=face)
    one.span(number(data, "grazing_low"), number(data, "grazing_high"), "first contact")
    one.level(number(data, "gap"), one.text("gap", "mm", 1e3, "$g$ = "))


@picture("x fitted time", _TIME, _DISPLACEMENT, margin=0, ratio=0.9)
def multiple_shooting(one: Picture, finding: Any, *, seconds: Positive = 6.0) -> None:
    """Draw a record with contact, the segments fitted to it, and their residuals.

    Parameters
    ----------
    finding
        Contact parameters from multiple shooting, or their data: ``x``, ``fitted``, ``segment``, ``in_contact`` over
        ``time``; ``gap``.
    ax
        Where to draw; a new one-column figure if None.
    seconds
        Length shown, from the first fitted sample on.
    """
    time, x, fitted = one.values("time", "x", "fitted")
    used = np.flatnonzero(np.isfinite(fitted))
    if not len(used):
        raise ValueError("no sample of this record was fitted")
    first = time[used[0]]
    data = one.data.isel(time=(time >= first) & (time <= first + seconds))
    time, x, fitted = (data[name].values for name in ("time", "x", "fitted"))
    one.cloud(time, x)
    segment = data["segment"].values if "segment" in data else np.zeros(len(time))
    cut = np.flatnonzero(np.diff(segment) != 0) + 1
    curve = np.insert(np.where(segment >= 0, fitted, np.nan), cut, np.nan)
    one.line(np.insert(time, cut, np.nan), curve, "fitted, segment by segment", linewidth=0.9)
    if "in_contact" in data:
        style.shade(one.ax, time, data["in_contact"].values.astype(bool), alpha=0.3, label="contact", zorder=0)
    one.level(number(data, "gap"), one.text("gap", "mm", 1e3, "$g$ = "))
    one.residual(time, x - fitted)


@picture("", _TIME, loc="upper right")
def toss(one: Picture, time: Any, centre: Any, lowest: Any, impacts: Any, *, unit: str = "m") -> None:
    """Draw the height of the centre and of the lowest corner over time, with the impacts that were found.

    Parameters
    ----------
    time, centre, lowest : array_like, shape (N,)
        Seconds, and heights.
    impacts : Dataset
        As ``corner_restitution`` finds them.
    ax
        Where to draw; a new one-column figure if None.
    unit : str
        Unit of the heights.
    """
    one.data, one.y = data_of(impacts, "single", "impact_time"), (f"height ({unit})", "")
    one.cloud(time, centre, "centre")
    one.cloud(time, lowest, "lowest corner", style.COLORS["muted"])
    single, at = one.values("single", "impact_time")
    for kind, color, line, word in _IMPACTS:
        for moment in at[single.astype(bool) == kind]:
            looks: style.Properties = {"color": style.COLORS[color], "linestyle": line, "linewidth": 0.8}
            one.ax.axvline(moment, ymax=0.72, label=style.once(one.ax, word), **looks)
    one.ax.set_ylim(top=1.45 * float(np.max(centre)))


@picture("", y=("restitution", ""), loc="upper left", margin=0.08)
def restitution(one: Picture, impacts: Any, *, unit: str = "m/s") -> None:
    """Draw the restitution of single impacts over the speed of approach, with their median.

    The bars are what half a sample of doubt about the instant of the impact does.

    Parameters
    ----------
    impacts : Dataset
        As ``corner_restitution`` finds them, or several joined along ``impact``.
    ax
        Where to draw; a new one-column figure if None.
    unit : str
        Unit of the velocities.
    """
    single = impacts.isel(impact=impacts["single"].values.astype(bool))
    e = single["restitution"].values
    one.data = single.assign(speed=-single["v_before"], restitution_error=single["half_sample"])
    one.x = f"speed of the corner before ({unit})", ""
    one.points("speed", "restitution", f"{len(e)} impacts of one corner")
    if len(e):
        looks: style.Properties = {"color": style.COLORS["first"]}
        one.ax.axhline(np.median(e), label=f"median {np.median(e):.2f}", **looks)
        looks |= {"alpha": 0.15, "linewidth": 0, "zorder": 0}
        one.ax.axhspan(*np.quantile(e, [0.25, 0.75]), label="middle half", **looks)
    one.ax.set_ylim(0, 1.5 * float(np.max(e)) if len(e) else 1)


@picture("", _TIME, ("amplitude, change (1/1000)", ""), loc="upper right", columns=1)
def steady_amplitude(one: Picture, response: Any) -> None:
    """Draw how far the amplitude of each block is from their mean, and the fastest decay that could hide there.

    Parameters
    ----------
    response : SteadyResponse
    ax
        Where to draw; a new one-column figure if None.
    """
    blocks = response.blocks
    middle = float(np.exp(np.log(blocks["amplitude"]).mean()))
    change, error = blocks["amplitude"] / middle - 1, blocks["amplitude_error"] / middle
    one.data = data = blocks.assign(change=change, change_error=error).assign_attrs(blocks.attrs)
    one.points("time", "change", f"blocks, {one.word}", scale=1e3)
    t = data["time"].values
    fine = np.linspace(t[0], t[-1], 50)
    rate, error, bound = 1e3 * np.array([response.rate, response.rate_error, response.rate_bound])
    one.line(fine, -rate * (fine - t.mean()), f"line: decay rate {rate:.2f} ± {error:.2f} per 1000 s")
    words = f"fastest free decay at 95 %: {bound:.2f} per 1000 s"
    one.line(fine, -bound * (fine - t.mean()), words, "second", "--")
    reach = 1e3 * float((np.abs(data["change"]) + data["change_error"]).max())
    one.ax.set_ylim(-1.3 * reach, 2.4 * reach)


@picture("", _TIME, ("phase (mrad)", ""), loc="upper right", columns=1)
def steady_phase(one: Picture, response: Any) -> None:
    """Draw the phase of each block less that of the fitted frequency, with the line of each other method."""
    one.data = response.blocks
    one.points("time", "phase", f"blocks, {one.word}", scale=1e3)
    t, phase, error = one.values("time", "phase", "phase_error")
    for name, (value, own) in response.by_method.items():
        word, color, line = _METHODS[name]
        drift = phase.mean() - 2 * np.pi * (value - response.frequency) * (t - t.mean())
        one.line(t, 1e3 * drift, f"{word}: {value:.5f} ± {own:.5f} Hz", color, line)
    reach = 1e3 * float(np.max(np.abs(phase) + error))
    one.ax.set_ylim(-1.3 * reach, 2.9 * reach)
