r"""Natural frequency and damping over amplitude (the backbone), from forced responses that may hang over.

Each measured point is a frequency, an amplitude and, where recorded, a force and a phase. The force is one function of
the first two (:mod:`nonsmooth.identification.nonlinear_mode`), whether the point is stable, unstable, measured under
constant force or constant amplitude. So the fit asks for each point what force and phase the mode needs for *this*
amplitude at *this* frequency, and compares their logarithm,

.. math::

    r = \ln \frac{F}{m\,[\omega_n^2(a) - \Omega^2 + i D(a) \Omega]\, a e^{i\varphi}} ,

real part: the force, imaginary part: the phase. Nothing asks for *the* amplitude at a frequency, which would lose the
points of an overhanging curve.

Curves measured one after the other differ by more than their points scatter: a joint settles, a room warms up. Each
curve therefore has its own small shift of :math:`\ln \omega_n^2` and :math:`\ln D`, normal with standard deviations
that are found from the data (a random effect); they are stated, and carried into the uncertainty of the backbone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.arrays import FloatArray
from nonsmooth.blas import one_blas_thread
from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.identification.nonlinear_mode import FEWEST_CURVES, NonlinearMode, ResponseFit, interpolation
from nonsmooth.recordings.recording import Recording
from nonsmooth.results.labels import labelled

_POWERS = {"m": 0, "m/s": 1, "m/s^2": 2, "m/s²": 2}
_METHOD = "forced responses fitted along their curves by one mode with amplitude-dependent frequency and damping"


@dataclass(frozen=True, eq=False)
class ResponseCurve:
    """Forced responses measured in one go: over the same points, frequency (Hz), amplitude of displacement (m), and
    where they were recorded force (N) and phase of the displacement after the force (rad).
    """

    name: str
    frequency: FloatArray
    amplitude: FloatArray
    force: FloatArray | None = None
    phase: FloatArray | None = None

    def __post_init__(self) -> None:
        given = {key: np.asarray(v) for key, v in vars(self).items() if key != "name" and v is not None}
        sizes = {key: v.shape for key, v in given.items()}
        if {*sizes.values()} != {(given["frequency"].size,)}:
            raise ValueError(f"curve {self.name!r}: all must be arrays of one length, got {sizes}")
        for key, v in given.items():
            if bad := np.count_nonzero(~np.isfinite(v)):
                raise ValueError(f"curve {self.name!r}: {bad} values of {key} are not finite; leave those points out")
            if key != "phase" and not (v > 0).all():
                raise ValueError(f"curve {self.name!r}: {key} must be positive everywhere; leave other points out")


def response_curves(
    recording: Recording, *, amplitude: str = "amplitude", force: str | None = "force", phase: str | None = "phase"
) -> tuple[ResponseCurve, ...]:
    """The curves of a recording over ``frequency``, one for each run; amplitudes become displacements (m).

    Parameters
    ----------
    recording : Recording
        Read with ``load_recording(path, axis="frequency")``.
    amplitude, force, phase : str
        Names of the channels; None where there is none. The amplitude is one of displacement (m), velocity (m/s) or
        acceleration (m/s^2); the phase is that of the displacement after the force, in rad.

    Raises
    ------
    ValueError
        If a channel is missing or its unit is not one of those.
    """
    from nonsmooth.recordings.signals.checks import take

    curves = []
    for run in recording.runs:
        size = take(recording, amplitude, run, units=tuple(_POWERS), samples=3)
        (axis,) = size.dims
        if axis != "frequency":
            raise ValueError(f"run {run!r}: stands over {axis!r}; read it with load_recording(..., axis='frequency')")
        f = np.asarray(size["frequency"].values, float)
        beside: list[FloatArray | None] = []
        for name, unit in ((force, "N"), (phase, "rad")):
            at = None if name is None else take(recording, name, run, units=(unit,), samples=3).values
            beside.append(None if at is None else np.asarray(at, float))
        power = _POWERS[size.attrs["units"]]
        curves.append(ResponseCurve(run, f, np.asarray(size.values) / (2 * np.pi * f) ** power, *beside))
    return tuple(curves)


@one_blas_thread()
def amplitude_dependent(
    curves: Sequence[ResponseCurve], *, knots: int | ArrayLike = 5, residual: bool = False, mass: float | None = None
) -> tuple[Finding, NonlinearMode]:
    r"""Fit :math:`\omega_n(a)` and :math:`\zeta(a)` of one mode to forced responses.

    Parameters
    ----------
    curves : sequence of ResponseCurve
        With forces: the modal mass is fitted with the rest. Without: each curve was measured under a force of constant,
        unknown amplitude, and its force by mass is fitted.
    knots : int or array_like
        Amplitudes (m) at which frequency and damping are sought, or how many, evenly spaced; a cubic spline between.
    residual : bool
        Fit what other modes add, R (complex); needs forces and phases.
    mass : float, optional
        The modal mass (kg) where it is known.

    Returns
    -------
    finding : Finding
        ``f_n`` at the least amplitude measured; besides it ``zeta`` there, both at the largest, the modal mass, and how
        far curves differ from each other. Its data hold the backbone with its errors over ``amplitude``, and every
        point with its ``slope`` d ln F / d ln a and whether that makes it ``unstable``.
    mode : NonlinearMode
        The mode; ``mode.response(force)`` draws the curve for any force, unstable middle part included.

    Raises
    ------
    ValueError
        If the curves do not agree in what was recorded, or have fewer points than there are unknowns.
    """
    fit = ResponseFit(curves, knots, residual=residual, mass=mass)
    mode = fit.mode
    grid = np.linspace(mode.knots[0], mode.knots[-1], 101)
    basis = interpolation(mode.knots, grid)
    # The unknowns are ln omega_n^2 and ln D at the knots; ln zeta = ln D - ln 2 - ln(omega_n^2) / 2.
    by_square = np.zeros((len(grid), len(fit.covariance)))
    by_square[:, fit.at["square"]] = basis * mode.squares / mode.square(grid)[:, None]
    by_zeta = -0.5 * by_square
    by_zeta[:, fit.at["damping"]] += basis
    (f, f_error), (zeta, zeta_error) = (
        (values, values * np.sqrt(np.einsum("ij,jk,ik->i", slope, fit.covariance, slope)))
        for values, slope in ((mode.natural_frequency(grid), 0.5 * by_square), (mode.damping_ratio(grid), by_zeta))
    )
    slope, own = fit.slopes(), fit.own()
    table: dict[str, Any] = {} if fit.force is None else {"force": ("point", fit.force, {"units": "N"})}
    table |= {
        "frequency": ("point", fit.omega / (2 * np.pi), {"units": "Hz"}),
        "response": ("point", np.abs(fit.measured), {"units": "m"}),
        "modal_amplitude": ("point", fit.amplitude, {"units": "m"}),
        "curve": ("point", fit.curve),
        "slope": labelled("point", slope, "d ln F / d ln a"),
        "unstable": ("point", slope < 0),
        "f_n": labelled("amplitude", f, "natural frequency", "Hz"),
        "f_n_error": ("amplitude", f_error, {"units": "Hz"}),
        "zeta": labelled("amplitude", zeta, "damping ratio"),
        "zeta_error": ("amplitude", zeta_error),
        "curve_f_n": ("curves", own[0], {"units": "Hz"}),
        "curve_zeta": ("curves", own[1]),
        "curve_amplitude": ("curves", own[2], {"units": "m"}),
    }
    coords = {
        "amplitude": labelled("amplitude", grid, "amplitude of the mode", "m"),
        "curves": ("curves", list(fit.names)),
    }
    f_n, f_last = (Estimate(f[i], f_error[i], "Hz") for i in (0, -1))
    zeta_n, zeta_last = (Estimate(zeta[i], zeta_error[i]) for i in (0, -1))
    others = {"zeta": zeta_n, "f_n at the largest amplitude": f_last, "zeta at the largest amplitude": zeta_last}
    others |= _others(fit)
    finding = Finding(
        "f_n",
        f_n,
        _METHOD,
        sum(len(c.frequency) for c in curves),
        tuple(c.name for c in curves),
        tuple(_notes(fit, slope)),
        others,
        None,
        xr.Dataset(table, coords, {"scatter": fit.sigma}),
        "backbone",
    )
    return finding, mode


def _others(fit: ResponseFit) -> dict[str, Estimate]:
    """Modal mass, residual, and how far curves differ."""
    error = np.sqrt(np.diag(fit.covariance))
    found: dict[str, Estimate] = {}
    if fit.forced and fit.mass is None:
        found["modal mass"] = Estimate(fit.mode.mass, fit.mode.mass * error[fit.at["load"]][0], "kg")
    if fit.residual:
        R = fit.mode.residual
        for name, size, value in zip(("real", "imag"), error[fit.at["residual"]], (R.real, R.imag), strict=True):
            found[f"residual, {name}"] = Estimate(1e6 * value, 1e6 * size * fit.unit, "µm/N")
    if fit.shifts:
        n = np.sqrt(2.0 * len(fit.names))
        f = 0.5 * np.sqrt(np.mean(fit.mode.squares)) / (2 * np.pi) * fit.spread[0]
        found["f_n from curve to curve"] = Estimate(f, f / n, "Hz")
        found["zeta from curve to curve, relative"] = Estimate(fit.spread[1], fit.spread[1] / n)
    return found


def _notes(fit: ResponseFit, slope: FloatArray) -> list[str]:
    """Notes for a reader."""
    unstable = np.count_nonzero(slope < 0)
    said = [
        f"{unstable} of {len(slope)} points lie on an unstable middle part (d ln F / d ln a < 0); the least slope "
        f"is {slope.min():.2f}, that of a linear mode 1"
    ]
    if not fit.shifts:
        said.append(f"fewer than {FEWEST_CURVES} curves: how far one differs from the next is not known, nor stated")
    if not fit.forced:
        said.append("no forces were recorded: the modal mass is not known")
    if not fit.phased:
        said.append("no phases were recorded: damping comes from the amplitudes alone")
    return said
