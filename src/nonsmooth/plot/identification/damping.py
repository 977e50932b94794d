"""Damping: fitted amplitudes, complex responses, free decays, modes that depend on amplitude."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import MEASURED
from nonsmooth.plot.identification.picture import Picture, picture
from nonsmooth.plot.sweeps import MARKERS

_TIME = ("time", "s")
_OMEGA, _AMPLITUDE = (r"$\omega$", "rad/s"), ("amplitude of $x$", "m")
_FITS = (("joint", "$c$ beside dry friction", "first", "-", "s"), ("viscous", "$c$ alone", "second", "--", "D"))
_ENVELOPES = (("both", "viscous and dry", "first", "-"), ("viscous", "viscous alone", "second", "--"))
_CRANKS = ("o", "s", "^", "D")


@picture("amplitude omega omega_fine", _OMEGA, _AMPLITUDE, ratio=0.85)
def amplitude_fit(one: Picture, finding: Any) -> None:
    """Draw measured amplitudes over frequency with the fits; below, what each fit leaves.

    The fit that knows no friction puts all losses into c; its bias is written beside it.

    Parameters
    ----------
    finding
        A viscous damping, or its data: ``amplitude`` over ``run`` with ``omega``; ``joint_amplitude`` and
        ``viscous_amplitude`` over ``omega_fine``.
    ax
        Where to draw; a new one-column figure if None.
    """
    omega, heights, fine = one.values("omega", "amplitude", "omega_fine")
    words = one.data["direction"].values.astype(str) if "direction" in one.data else np.full(len(omega), "")
    for word in dict.fromkeys(words):
        label, mark = f"{one.word}, steps {word}" if word else "", MARKERS.get(word, "o")
        one.points("omega", "amplitude", label, where=words == word, mark=mark, face="white")
    error = one.data["amplitude_error"].values if "amplitude_error" in one.data else None
    for name, word, color, line, mark in _FITS:
        if f"{name}_amplitude" in one.data:
            curve = one.data[f"{name}_amplitude"].values
            one.line(fine, curve, word + one.text(f"c_{name}", "N s/m", before=": "), color, line)
            left, error = error, None  # bars on the first residuals alone
            rest = heights - np.interp(omega, fine, curve)
            one.residual(omega, rest, f"residual, {word}", error=left, marker=mark, color=style.COLORS[color])
    one.ax.set_ylim(bottom=0)


@picture(
    "real imaginary crank fitted_real fitted_imaginary crank_length", (r"Re $X/a$", ""), (r"Im $X/a$", ""), ratio=0.95
)
def nyquist(one: Picture, finding: Any) -> None:
    """Draw the response over the crank's length, X/a, in the complex plane, each crank with its fitted curve.

    Without friction all lengths lie on one curve. The natural frequency is where the car lags by a quarter of a turn.

    Parameters
    ----------
    finding
        A damping by the complex response, or its data: ``real``, ``imaginary``, ``crank`` over ``run``;
        ``fitted_real``, ``fitted_imaginary`` over ``crank_length`` and ``omega_fine``.
    ax
        Where to draw; a new one-column figure if None.
    """
    lengths, crank, real, imaginary = one.values("crank_length", "crank", "fitted_real", "fitted_imaginary")
    for k, length in enumerate(lengths):
        mark = _CRANKS[k % len(_CRANKS)]
        one.line(real[k], imaginary[k], f"fitted, crank {1e3 * length:.4g} mm", style.nth(k), linewidth=0.9)
        here, label = np.isclose(crank, length), f"{one.word}, {1e3 * length:.4g} mm"
        one.points("real", "imaginary", label, where=here, mark=mark, face="white")
    for axis in (one.ax.axhline, one.ax.axvline):
        axis(0, color=style.COLORS["muted"], linewidth=0.5)
    natural = one.text("omega_0", "rad/s", before=r"$\omega_0$ = ")
    one.note(0.5, 0.5, natural, one.text("c", "N s/m", before="$c$ = "))
    one.ax.set_aspect("equal", adjustable="datalim")


@picture("peak_time peak_height", _TIME, ("peak height (mm)", ""), loc="upper right", columns=1)
def free_decay(one: Picture, finding: Any) -> None:
    r"""Draw the heights of a free decay's peaks on a logarithmic scale, with the fitted envelopes.

    Viscous damping alone gives a straight line. Dry friction takes a constant part from each half cycle and bends it
    down towards the end.

    Parameters
    ----------
    finding
        A damping found from free decays, or its data: ``peak_time``, ``peak_height`` over ``peak`` (and
        ``peak_run``); ``envelope_viscous``, ``envelope_both`` over ``fine_time``.
    ax
        Where to draw; a new one-column figure if None.
    """
    height = 1e3 * one.data["peak_height"].values
    one.points("peak_time", "peak_height", f"peaks, {one.word}", scale=1e3)
    for name, word, color, line in _ENVELOPES:
        if f"envelope_{name}" in one.data:
            time, curve = one.values("fine_time", f"envelope_{name}")
            one.line(time[curve > 0], 1e3 * curve[curve > 0], word, color, line)
    one.ax.set_yscale("log")
    one.ax.set_ylim(0.5 * np.nanmin(height[height > 0]), 1.6 * np.nanmax(height))
    friction = one.text("friction_force", "mN", 1e3, "friction ")
    one.note(0.04, 0.06, one.text("c", "N s/m", before="$c$ = "), friction)


@picture("peak_time log_height slope intercept", _TIME, ("ln (peak height / m)", ""), loc="upper right", columns=1)
def drop_decay(one: Picture, finding: Any) -> None:
    """Draw the logarithm of the peaks' heights of the support's free decay with its regression line.

    Parameters
    ----------
    finding
        The support's damping, or its data: ``peak_time``, ``log_height`` (and ``log_height_error``, ``used``) over
        ``peak``; ``slope``, ``intercept``, ``damping_ratio``. Of several runs (``peak_run``) each has its own
        ``intercept``.
    ax
        Where to draw; a new one-column figure if None.
    """
    time, data = one.data["peak_time"].values, one.data
    used = data["used"].values.astype(bool) if "used" in data else np.ones(len(time), dtype=bool)
    runs = data["peak_run"].values if "peak_run" in data else np.zeros(len(time), dtype=int)
    for chosen, face, word in ((used, MEASURED, ", used"), (~used, "white", ", left out")):
        label = one.word + word * bool((~used).any())
        one.points("peak_time", "log_height", label, where=chosen, face=face)
    slope, intercepts = float(data["slope"].values.mean()), np.atleast_1d(data["intercept"].values)
    for k, run in enumerate(np.unique(runs[used])):
        mine = time[used & (runs == run)]
        ends = np.array([mine.min(), mine.max()])
        height = intercepts[min(k, len(intercepts) - 1)] + slope * ends
        one.line(ends, height, one.text("damping_ratio", before=r"regression, $\xi_s$ = "), "second", zorder=4)


@picture("f_n f_n_error amplitude curve_f_n", ("amplitude", "m"), ("natural frequency (Hz)", ""), loc="best", columns=1)
def backbone(one: Picture, finding: Any) -> None:
    """Draw the natural frequency over the amplitude with its 95 % band, and each curve's own beside it.

    Parameters
    ----------
    finding
        What ``amplitude_dependent`` found, or its data.
    ax
        Where to draw; a new one-column figure if None.
    """
    _over_amplitude(one, "f_n", 1.0)


@picture("zeta zeta_error amplitude curve_zeta", ("amplitude", "m"), ("damping ratio (%)", ""), loc="best", columns=1)
def modal_damping(one: Picture, finding: Any) -> None:
    """Draw the damping ratio over the amplitude, as :func:`backbone` does the frequency."""
    _over_amplitude(one, "zeta", 100.0)


def _over_amplitude(one: Picture, name: str, scale: float) -> None:
    a, y, error = one.values("amplitude", name, f"{name}_error")
    low, high = (scale * (y + sign * 1.96 * error) for sign in (-1, 1))
    one.ax.fill_between(a, low, high, color=style.COLORS["first"], alpha=0.2, linewidth=0, label="95 %")
    one.line(a, scale * y, "mode")
    one.points("curve_amplitude", f"curve_{name}", "each curve by itself", scale=scale, face="white")


@picture("frequency response unstable f_n amplitude", ("frequency", "Hz"), ("amplitude", "m"), loc="upper left")
def forced_responses(one: Picture, finding: Any, *, responses: Sequence[Any] = ()) -> None:
    """Draw the measured points over frequency, the backbone, and computed responses along their curves.

    Parameters
    ----------
    finding
        What ``amplitude_dependent`` found, or its data.
    ax
        Where to draw; a new one-column figure if None.
    responses : sequence of Dataset
        Curves for constant forces, from ``NonlinearMode.response``; their unstable parts are dashed.
    """
    frequency, height, unstable = one.values("frequency", "response", "unstable")
    for chosen, face, word in ((unstable == 0, MEASURED, one.word), (unstable != 0, "white", "unstable part")):
        if chosen.any():
            looks: style.Properties = {"markersize": 3.0, "markerfacecolor": face, "markeredgewidth": 0.4}
            one.line(frequency[chosen], height[chosen], word, "section", ".", zorder=3, **looks)
    for curve in responses:
        f, a, stable = (curve[name].values for name in ("frequency", "amplitude", "stable"))
        one.line(f, np.where(stable, a, np.nan), "mode, constant force", "second", zorder=4)
        if not stable.all():
            wide = ~stable | np.roll(~stable, 1) | np.roll(~stable, -1)
            one.line(f, np.where(wide, a, np.nan), "", "second", "--", zorder=4)
        if len(a):
            top = int(np.argmax(a))
            paper = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.4}
            looks = {"color": style.COLORS["second"], "ha": "left", "va": "bottom", "bbox": paper}
            style.annotate(one.ax, f"{curve.attrs['force']:.2g} N", (f[top], a[top]), (3, 2), **looks)
    natural, a = one.values("f_n", "amplitude")
    one.line(natural, a, "backbone", linewidth=1.1, zorder=5)
    one.ax.set_ylim(bottom=0, top=1.32 * float(height.max()))
    reach = 0.03 * np.ptp(frequency)
    one.ax.set_xlim(frequency.min() - reach, frequency.max() + reach)
