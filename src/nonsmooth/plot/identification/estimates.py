"""Estimates with what they leave: lines through readings, fits by place, profiles of a likelihood, coverage."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from nonsmooth.errors import unknown
from nonsmooth.plot import style
from nonsmooth.plot.figure import figure
from nonsmooth.plot.identification.picture import Picture, data_of, number, picture
from nonsmooth.plot.labels import symbol_of
from nonsmooth.results.labels import words_of_flags

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN = 600
#: What the sign of ``pull`` means, and the colour of its residuals.
_WAYS = {1: ("growing", "first"), -1: ("falling", "zone")}


@picture("displacement force slope intercept", ("displacement", "m"), ("force", "N"), margin=0.03, ratio=0.85)
def force_displacement(one: Picture, finding: Any) -> None:
    """Draw the samples of slow pulls, the fitted lines and their slopes; below, what the mean line leaves.

    Where the data say which way the car was moved, the two ways have two colours: they differ by twice the friction.

    Parameters
    ----------
    finding
        A stiffness (``k`` or ``k_s``), or its data: ``displacement``, ``force`` over ``sample`` and ``slope``,
        ``intercept`` over ``line``.
    ax
        Where to draw; a new one-column figure if None.
    """
    x, force, slopes, intercepts = map(np.atleast_1d, one.values("displacement", "force", "slope", "intercept"))
    # Thinned for the eye only: half of the samples lie on top of each other.
    shown = np.linspace(0, len(x) - 1, min(SHOWN, len(x))).astype(int)
    one.cloud(x[shown], force[shown])
    ends = np.array([np.nanmin(x), np.nanmax(x)])
    alike = len(slopes) == 1 or np.ptp(slopes) < 1e-9 * abs(slopes[0])  # one slope was fitted to all
    many = f"{len(slopes)} lines, slopes {slopes.min():.4g} to {slopes.max():.4g} N/m"
    label = one.text("slope", "N/m", before="slope ") if alike else many
    for slope, intercept in zip(slopes, intercepts, strict=True):
        one.line(ends, intercept + slope * ends, label, "second", linewidth=1.6, alpha=0.7)
    one.note(0.97, 0.36, one.text("friction_force", "mN", 1e3, "friction "))
    at, left = x[shown], (force - float(np.mean(slopes)) * x - float(np.mean(intercepts)))[shown]
    if "pull" not in one.data:
        one.residual(at, left)
    else:
        for way, (words, color) in _WAYS.items():
            here = one.data["pull"].values[shown] * way > 0
            one.residual(at[here], left[here], f"residual, displacement {words}", color=style.COLORS[color])


@picture("setting reading", "setting", "reading", columns=3, margin=0.03, ratio=0.85)
def calibration(one: Picture, finding: Any) -> None:
    """Draw a calibration: frequency over motor voltage, or the forcing's amplitude over the crank's length.

    Parameters
    ----------
    finding
        A calibration, or its data: ``setting``, ``reading``, ``reading_error`` over ``run``; ``setting_fine`` with
        ``fitted``, ``fitted_low``, ``fitted_high``; ``slope``, ``intercept``.
    ax
        Where to draw; a new one-column figure if None.
    """
    setting, reading = one.values("setting", "reading")
    if "fitted" in one.data:
        at, fitted = one.values("setting_fine", "fitted")
        # No further than to zero: what is measured here has one sign.
        there = fitted * np.sign(np.mean(reading)) >= 0
        one.line(at[there], fitted[there], "fitted")
        band = None
        if "fitted_low" in one.data:
            band = [at[there], *((one.data[f"fitted_{end}"].values - fitted)[there] for end in ("low", "high"))]
            one.ax.fill_between(
                [], [], label="its 95 % band (below)", color=style.COLORS["first"], alpha=0.25, linewidth=0
            )
        error = one.data["reading_error"].values if "reading_error" in one.data else None
        one.residual(setting, reading - np.interp(setting, at, fitted), error=error, band=band, marker="o")
    one.points("setting", "reading")
    one.note(0.04, 0.96, _law(one))


def _law(one: Picture) -> str:
    slope, intercept, error = (number(one.data, name) for name in ("slope", "intercept", "intercept_error"))
    units = [one.data[name].attrs.get("units", "") for name in ("reading", "setting")]
    text = one.text("slope", ("/" if all(units) and "/" not in units[0] else " per ").join(units), before="slope ")
    # a line that does not pass through the origin: where it begins
    away = abs(intercept) > 5 * error and np.isfinite(intercept / slope)
    return f"{text},\nfrom {-intercept / slope:.4g} {units[1]} on" if away and text else text


_FEW = 3  # readings of a place, below which it has no bar


@picture("", "time", columns=3, margin=0.05, strip=r"$\sigma$", ratio=0.9)
def fit_residuals(
    one: Picture,
    fitted: Any,
    *,
    show: Literal["time", "places"] = "time",
    quantity: str | None = None,
    run: str | None = None,
) -> None:
    """Draw readings, fit and residuals over time, or the residuals' size at each place of the motion.

    Parameters
    ----------
    fitted
        A result of :func:`nonsmooth.fit`, or its ``residuals``.
    ax
        Where to draw; a new one-column figure if None.
    show
        ``"time"``: readings with the fit, coloured by mode, and residuals over their standard deviation below;
        ``"places"``: their root mean square in each mode, at each transition and at grazes.
    quantity, run
        Of which measured quantity, and of which run; where not given the first ones, of places all.
    """
    data = data_of(getattr(fitted, "residuals", fitted), "measured", "fitted", "residual", "place")
    if show == "places":
        _by_place(one.ax, _chosen(data, quantity=quantity, run=run))
    else:
        _over_time(one, _chosen(data, True, quantity=quantity, run=run))


def _chosen(data: Any, one: bool = False, **asked: str | None) -> Any:
    """The samples of what is asked for by name; of ``one`` the first where no name is given."""
    for name, given in asked.items():
        if given is None and not one:
            continue
        words = words_of_flags(data[name])
        word = words[0] if given is None else given.replace(" ", "_")
        if word not in words:
            raise ValueError(unknown(given, f"a {name}", "this fit", words))
        data = data.isel(sample=data[name].values == words.index(word))
    return data


def _quantity(part: Any) -> str:
    return words_of_flags(part["quantity"])[int(part["quantity"].values[0])]


@picture("", columns=3, margin=0.03, strip=r"$\sigma$", ratio=0.9)
def steady_readings(
    one: Picture, fitted: Any, *, over: str | None = None, quantity: str | None = None, run: str | None = None
) -> None:
    """Draw readings of steady states with the fit over a parameter, and residuals over their standard deviation below.

    Parameters
    ----------
    fitted
        A result of :func:`nonsmooth.fit`, or its ``steady``.
    ax
        Where to draw; a new one-column figure if None.
    over
        The parameter; the first that differs from run to run where not given.
    quantity, run
        Of which measured state, and of which run; the first ones where not given.
    """
    data = data_of(getattr(fitted, "steady", fitted), "measured", "fitted", "used", "iterate")
    one.data = part = _chosen(data, True, quantity=quantity, run=run)
    known = ("run", "quantity", "iterate", "measured", "fitted", "measured_error", "used", "residual")
    set_ = [str(name) for name in part.data_vars if name not in known and np.isfinite(part[name].values).any()]
    if over is not None and over not in set_:
        raise ValueError(unknown(over, "a parameter that was set", "these runs", set_))
    name = over or max(set_, key=lambda each: len(np.unique(part[each].values)))
    attrs, of = part["measured"].attrs, symbol_of(_quantity(part))
    one.x = symbol_of(name), part[name].attrs.get("units", "")
    one.y = f"{attrs.get('long_name', 'reading')} of {of}", str(attrs.get("units", ""))
    used, residual = one.values("used", "residual")
    one.points(name, "measured")
    one.line(part[name].values[used], part["fitted"].values[used], "fit", "second", "_", markersize=6, zorder=4)
    one.residual(part[name].values[used], residual[used])


def _over_time(one: Picture, part: Any) -> None:
    one.data = part
    one.y = symbol_of(_quantity(part)), part["measured"].attrs.get("units", "")
    modes = words_of_flags(part["mode"])
    time, mode, window, residual, fitted = one.values("time", "mode", "window", "residual", "fitted")
    one.cloud(time, part["measured"].values)
    for k, m in enumerate(np.unique(mode)):
        inside = (mode == m) & np.append(np.diff(window) == 0, False)
        line = np.where(inside | np.roll(inside, 1), fitted, np.nan)
        one.line(time, line, f"fit: {modes[int(m)].replace('_', ' ')}", style.nth(k), linewidth=0.9)
    one.residual(time, residual)
    near = part["place"].values >= len(modes)
    if near.any():
        color = style.COLORS["second"]
        one.residual(time[near], residual[near], "residual at a transition or graze", color=color, markersize=3.5)


def _by_place(ax: Axes, data: Any) -> None:
    names, place, residual = words_of_flags(data["place"]), data["place"].values, data["residual"].values
    held = [i for i in np.unique(place) if np.count_nonzero(place == i) >= _FEW]
    n_modes = len(words_of_flags(data["mode"]))
    for row, i in enumerate(held):
        r = residual[place == i]
        size = float(np.sqrt(np.mean(r**2)))
        color = style.COLORS["first" if i < n_modes else "second"]
        ax.barh(row, size, color=color, height=0.6, xerr=size / np.sqrt(2.0 * len(r)), error_kw={"elinewidth": 0.8})
        ax.text(0.0, row, f" {len(r)}", va="center", fontsize=style.small(ax), color="white")
    ax.axvline(1.0, color=style.COLORS["muted"], linewidth=0.7)
    words = [names[i].replace("->", " \N{RIGHTWARDS ARROW} ").replace("_", " ") for i in held]
    ax.set_yticks(range(len(held)), words)
    ax.invert_yaxis()
    ax.set_xlabel(r"rms of the residuals ($\sigma$)")


CHI_SQUARE_95 = 3.841  # of one degree of freedom


@picture("value cost", y=(r"$\chi^2$ above its least", ""), loc="upper center", margin=0)
def profile(one: Picture, finding: Any) -> None:
    """Draw the profile of chi square over one parameter, with the interval that it gives.

    A flat profile is a parameter that the data do not see.

    Parameters
    ----------
    finding
        A profile, or its data: ``cost`` (chi square above its least) over ``value``; ``best``, ``low``, ``high``.
    ax
        Where to draw; a new one-column figure if None.
    """
    data = one.data
    unit = str(data["value"].attrs.get("units", data.attrs.get("units", "")))
    one.x = symbol_of(data.attrs.get("parameter", "value")), unit
    value, cost = one.values("value", "cost")
    one.span(number(data, "low"), number(data, "high"), "95 % interval", ymax=0.74)
    one.line(value, cost, f"profile, {one.word}", marker="o", markersize=1.5)
    one.ax.axhline(CHI_SQUARE_95, label="95 % bound, 3.84", color=style.COLORS["muted"], linestyle="--", linewidth=0.7)
    if np.isfinite(best := number(data, "best")):
        one.ax.axvline(best, ymax=0.74, color=style.COLORS["second"], linewidth=0.9, label="best fit")
    one.ax.set_ylim(0, max(1.1 * CHI_SQUARE_95, min(float(np.nanmax(cost)), 5 * CHI_SQUARE_95)) * 1.35)
    if value.min() > 0 and value.max() > 20 * value.min():
        one.ax.set_xscale("log")


@figure(width=style.PAGE, ratio=0.42)
def coverage(ax: Axes, finding: Any) -> None:
    """Draw the normalised errors of the identified parameters over many virtual rigs.

    Each point is (estimate - truth) / standard uncertainty of one rig; in a fair statement they spread like a unit
    normal law. The numbers above say how many of the 95 % intervals hold the truth.

    Parameters
    ----------
    finding
        Data over ``rig`` and ``parameter``: ``truth``, ``estimate``, ``uncertainty``, and ``low``, ``high`` (95 %).
    ax
        Where to draw; a new figure of page width if None.
    """
    data = data_of(finding, "truth", "estimate", "uncertainty", "parameter").transpose("rig", "parameter", ...)
    truth, estimate, error = (data[name].values for name in ("truth", "estimate", "uncertainty"))
    names = data["parameter"].values.astype(str)
    if "low" in data and "high" in data:
        held = (data["low"].values <= truth) & (truth <= data["high"].values)
    else:
        held = np.abs(estimate - truth) <= 1.96 * error
    off = (estimate - truth) / error
    rigs = len(truth)
    spread = (np.arange(rigs) / max(rigs - 1, 1) - 0.5) * 0.6
    ax.axhspan(-1.96, 1.96, color=style.COLORS["first"], alpha=0.10, linewidth=0)
    ax.axhline(0, color=style.COLORS["muted"], linewidth=0.6)
    for k in range(len(names)):
        for mine, color in ((held[:, k], "section"), (~held[:, k], "second")):
            ax.plot(k + spread[mine], off[mine, k], ".", color=style.COLORS[color], markersize=3)
        rms = float(np.sqrt(np.nanmean(off[:, k] ** 2)))
        words = f"{np.count_nonzero(held[:, k])}/{rigs}\nrms {rms:.2f}"
        ax.text(k, 1.02, words, fontsize=style.small(ax), transform=ax.get_xaxis_transform(), ha="center", va="bottom")
    reach = max(3.0, 1.08 * float(np.nanmax(np.abs(off[np.isfinite(off)]), initial=0.0)))
    ax.set_ylim(-reach, reach)
    ax.set_xticks(range(len(names)), [symbol_of(name) for name in names])
    ax.tick_params(axis="x", top=False, length=0)
    ax.set_ylabel("(estimate − truth) / uncertainty")
    ax.set_xlabel(f"{rigs} virtual rigs (synthetic), by seed from left to right")
