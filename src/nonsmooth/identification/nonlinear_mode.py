r"""One mode whose natural frequency and damping depend on its amplitude, and the forced responses that it makes.

With the displacement :math:`x = a \cos(\Omega t + \varphi)` under the force :math:`F \cos \Omega t`,

.. math::

    (\omega_n^2(a) - \Omega^2 + 2 i \zeta(a) \omega_n(a) \Omega)\, a e^{i\varphi} = F / m ,
    \qquad
    (\omega_n^2 - \Omega^2)^2 a^2 + (2 \zeta \omega_n \Omega a)^2 = (F/m)^2 .

The force is one function of amplitude and frequency; the amplitude at a given force and frequency may be three, and
that in the middle is unstable. So a forced response is described along its curve, by a: for each a there are at
most two frequencies,

.. math::

    \Omega^2 = \omega_n^2 - D^2/2 \pm \sqrt{(F / m a)^2 - D^2 \omega_n^2 + D^4 / 4}, \qquad D = 2 \zeta \omega_n .

What other modes add to the measured motion near this one is in phase with the force and grows with it alone: the
residual R, so that what is measured is :math:`a e^{i\varphi} + R F`.

References: W. Szemplinska-Stupnicka, J. Sound Vib. 63 (1979) 475; M. Scheel, S. Peter, R.I. Leine and M. Krack,
J. Sound Vib. 435 (2018) 346; T. Karaagacli and H.N. Ozguven, Mech. Syst. Signal Process. 146 (2021) 107023.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.recordings.signals.sections import first_zero


@dataclass(frozen=True, eq=False)
class NonlinearMode:
    """A mode by its values at some amplitudes; between them a cubic spline, outside of them the nearest value.

    Attributes
    ----------
    knots : array (K,)
        Amplitudes of displacement (m), increasing.
    squares : array (K,)
        omega_n^2 there (rad^2/s^2).
    log_damping : array (K,)
        ln D there, D = 2 zeta omega_n (1/s).
    mass : float
        Modal mass as seen from drive and sensor (kg); 1 where forces are given by mass.
    residual : complex
        What all other modes add to the displacement, per force (m/N).
    """

    knots: FloatArray
    squares: FloatArray
    log_damping: FloatArray
    mass: float = 1.0
    residual: complex = 0.0

    def square(self, amplitude: ArrayLike) -> FloatArray:
        """omega_n^2 at these amplitudes (rad^2/s^2)."""
        return interpolation(self.knots, amplitude) @ self.squares

    def damping(self, amplitude: ArrayLike) -> FloatArray:
        """D = 2 zeta omega_n at these amplitudes (1/s)."""
        return np.exp(interpolation(self.knots, amplitude) @ self.log_damping)

    def natural_frequency(self, amplitude: ArrayLike) -> FloatArray:
        """omega_n / 2 pi at these amplitudes (Hz)."""
        return np.sqrt(self.square(amplitude)) / (2 * np.pi)

    def damping_ratio(self, amplitude: ArrayLike) -> FloatArray:
        """zeta at these amplitudes."""
        return self.damping(amplitude) / (2 * np.sqrt(self.square(amplitude)))

    def stiffness(self, amplitude: ArrayLike, omega: ArrayLike) -> ComplexArray:
        """Force by displacement, m (omega_n^2 - Omega^2 + i D Omega), N/m."""
        w = np.asarray(omega, float)
        return self.mass * (self.square(amplitude) - w**2 + 1j * self.damping(amplitude) * w)

    def slope(self, amplitude: ArrayLike, omega: ArrayLike) -> FloatArray:
        r"""d ln F / d ln a at a fixed frequency: 1 if linear, 0 at a fold, negative on the unstable middle part."""
        a, w = np.asarray(amplitude, float), np.asarray(omega, float)
        G, D, change = self.square(a), self.damping(a), interpolation(self.knots, a, 1)
        turn = change @ self.squares + 1j * w * D * (change @ self.log_damping)
        return 1.0 + np.real(a * turn / (G - w**2 + 1j * w * D))

    def response(self, force: float, *, points: int = 400, low: float | None = None) -> xr.Dataset:
        """The response to a force of constant amplitude, along its curve: up one side, over the top, down the other.

        The curve is the one that begins at the least amplitude, up to the first amplitude at which the force does not
        reach the damping any more. Detached curves (isolas) above it, which a damping that falls again with the
        amplitude allows, are left out; with ``low`` inside of one it is that one, from there upwards.

        Parameters
        ----------
        force : float
            Amplitude of the force (N).
        points : int
            Points on each side.
        low : float, optional
            The least amplitude (m); the first knot where not given.

        Returns
        -------
        Dataset
            Over ``point``: ``frequency`` (Hz), ``modal_amplitude`` and ``amplitude`` (m, that of the mode and with the
            residual), ``phase`` (rad), ``stable``. Empty where the force cannot reach the least amplitude.
        """
        least = float(self.knots[0]) if low is None else low
        u = np.sin(np.linspace(0.0, np.pi / 2, points))  # dense near the top, where both sides meet
        top = self._top(force, least)
        a = least + (top - least) * u if top > least else np.zeros(0)
        square, D = self.square(a), self.damping(a)
        root = np.sqrt(np.maximum((force / (self.mass * np.maximum(a, 1e-300))) ** 2 - D**2 * square + D**4 / 4, 0.0))
        below, above = square - D**2 / 2 - root, square - D**2 / 2 + root
        here = below > 0
        omega = np.sqrt(np.concatenate([below[here], above[::-1]]))
        size = np.concatenate([a[here], a[::-1]])
        mode = force / self.stiffness(size, omega)
        total = mode + self.residual * force
        return xr.Dataset(
            {
                "frequency": ("point", omega / (2 * np.pi), {"units": "Hz"}),
                "modal_amplitude": ("point", size, {"units": "m"}),
                "amplitude": ("point", np.abs(total), {"units": "m"}),
                "phase": ("point", np.angle(total), {"units": "rad"}),
                "stable": ("point", self.slope(size, omega) > 0),
            },
            attrs={"force": force},
        )

    def _top(self, force: float, least: float) -> float:
        """The largest amplitude that the force reaches, at phase resonance: F = m a D(a) sqrt(omega_n^2 - D^2/4)."""
        a = np.linspace(least, self.knots[-1], 2001)
        D = self.damping(a)
        room = force - self.mass * a * D * np.sqrt(np.maximum(self.square(a) - D**2 / 4, 0.0))
        if room[0] < 0:
            return least
        return first_zero(a, room) if (room < 0).any() else a[-1]


def interpolation(knots: FloatArray, amplitude: ArrayLike, derivative: int = 0) -> FloatArray:
    """Matrix that takes values at the knots to values (or a derivative) at the amplitudes; cubics are met exactly.

    Outside of the knots the nearest knot's value: nothing was measured there.
    """
    from scipy.interpolate import CubicSpline

    at = np.asarray(amplitude, float)
    a = np.clip(at, knots[0], knots[-1])
    if len(knots) == 1:
        return np.full((*at.shape, 1), float(derivative == 0))
    found = CubicSpline(knots, np.eye(len(knots)), bc_type="not-a-knot")(a, derivative)
    return np.where((a == at)[..., None], found, 0.0) if derivative else found


_ROUNDS = 40
FEWEST_CURVES = 4  # curves: how far they differ cannot be told from fewer


class ResponseFit:
    """Fit of a nonlinear mode to curves; see :mod:`nonsmooth.identification.amplitude_dependent`.

    Unknowns: ln omega_n^2 and ln D at the knots, then ln m or each curve's ln(F/m), the residual, and for each curve a
    shift of the first two with a normal prior. Standard deviations of points and of shifts are found by expectation and
    maximisation around the fit (A.P. Dempster et al., J. R. Stat. Soc. B 39 (1977) 1).
    """

    def __init__(self, curves: Sequence[Any], knots: int | ArrayLike, *, residual: bool, mass: float | None) -> None:
        if not curves:
            raise ValueError("there are no response curves")
        self.names = tuple(str(c.name) for c in curves)
        phase, self.force = (_column(curves, name) for name in ("phase", "force"))
        self.phased, self.forced = phase is not None, self.force is not None
        if residual and not (self.phased and self.forced):
            raise ValueError("the residual of other modes can be told only with forces and phases; leave it out")
        if mass is not None and not (mass > 0 and self.forced):
            raise ValueError("a modal mass is a positive number, and of use only with forces in N")
        self.residual, self.mass = residual, mass
        self.curve = np.repeat(np.arange(len(curves)), [len(c.frequency) for c in curves])
        self.omega = 2 * np.pi * np.concatenate([c.frequency for c in curves])
        size = np.concatenate([c.amplitude for c in curves])
        self.measured = size.astype(complex) if phase is None else size * np.exp(1j * phase)
        self.knots = _knots(knots, size)
        self.shifts = len(curves) >= FEWEST_CURVES
        self._basis = interpolation(self.knots, size)
        self._fit()

    @cached_property
    def at(self) -> dict[str, slice]:
        """Places of the unknowns, by what they are of."""
        K, n = len(self.knots), len(self.names)
        load = 0 if self.mass is not None else 1 if self.forced else n
        counts = {"square": K, "damping": K, "load": load, "residual": 2 * self.residual, "shift": 2 * n * self.shifts}
        ends = np.cumsum(list(counts.values())).tolist()
        return {name: slice(end - counts[name], end) for name, end in zip(counts, ends, strict=True)}

    def _unpack(self, p: FloatArray) -> tuple[NonlinearMode, Any, FloatArray]:
        """The mode, ln(F/m) of each point, and the shifts of ln omega_n^2 and of ln D of each curve."""
        R = complex(*p[self.at["residual"]]) * self.unit if self.residual else 0j
        if self.force is None:
            mass, load = 1.0, p[self.at["load"]][self.curve]
        else:
            mass = self.mass if self.mass is not None else float(np.exp(p[self.at["load"]][0]))
            load = np.log(self.force / mass)
        mode = NonlinearMode(self.knots, np.exp(p[self.at["square"]]), p[self.at["damping"]], mass, R)
        return mode, load, p[self.at["shift"]].reshape(2, -1) if self.shifts else np.zeros((2, len(self.names)))

    def _own(self, R: complex) -> ComplexArray:
        """Displacement of the mode alone at each point."""
        return self.measured if self.force is None else self.measured - R * self.force

    def _left(self, p: FloatArray) -> FloatArray:
        """ln of force over what the mode needs (and its phase), for all points."""
        mode, load, shift = self._unpack(p)
        own = self._own(mode.residual)
        basis = interpolation(mode.knots, np.abs(own)) if self.residual else self._basis
        square, damping = basis @ mode.squares, basis @ mode.log_damping
        by_square, by_damping = shift[:, self.curve]
        loss = np.exp(damping + by_damping) * self.omega
        needed = (square * np.exp(by_square) - self.omega**2 + 1j * loss) * own
        size = load - np.log(np.abs(needed))
        return np.concatenate([size, -np.angle(needed)]) if self.phased else size

    def _fit(self) -> None:
        from scipy.optimize import least_squares

        count, shift, n = self.at["shift"].stop, self.at["shift"], len(self.names)
        rows = len(self.omega) * (1 + self.phased)
        if rows <= shift.start:
            raise ValueError(
                f"{rows} measured values cannot tell {shift.start} unknowns: take fewer knots, or more points"
            )
        p = self._start(count)
        sigma, spread = 0.05, np.array([1e-3, 0.1])
        for k in range(_ROUNDS):
            prior = np.zeros(count)
            prior[shift] = np.repeat(1 / spread**2, n) if self.shifts else 0.0
            known = np.sqrt(prior)
            found = least_squares(
                lambda q, known=known, sigma=sigma: np.concatenate([self._left(q) / sigma, known * q]),
                p,
                method="lm",
                x_scale="jac",
            )
            if not found.success:
                raise SolveError(f"the fit of the responses has not converged: {found.message} Take fewer knots")
            p, normal = found.x, found.jac.T @ found.jac
            inverse = np.linalg.pinv(normal, hermitian=True)
            left = self._left(p)
            # Unknowns that the measurement determined: all but what the prior of the shifts did.
            freedom = max(rows - (count - (prior @ np.diag(inverse))), 1.0)
            before, moved = (sigma, *spread), 0.0
            # Points of a curve that err alike count less.
            each, same, power = left.reshape(-1, len(self.curve)), np.diff(self.curve) == 0, float(left @ left)
            rho = min(max(np.sum((each[:, 1:] * each[:, :-1])[:, same]) / power, 0.0), 0.9) if power > 0 else 0.0
            sigma = max(np.sqrt(power / freedom * (1 + rho) / (1 - rho)), 1e-9)
            if self.shifts:
                own, own_error = p[shift].reshape(2, n), np.diag(inverse)[shift].reshape(2, n)
                spread = np.sqrt(np.maximum(np.mean(own**2 + own_error, axis=1), 1e-18))
                # by how much of what the points of a curve say of its shift: towards 0 the way is long
                told = np.mean(np.maximum(np.diag(normal)[shift] - prior[shift], 1e-300).reshape(2, n), axis=1)
                change = np.abs(spread - before[1:])
                moved = np.max(np.minimum(change / spread, change * np.sqrt(told)))
            if k > 2 and moved < 1e-2 and abs(sigma / before[0] - 1) < 1e-2:
                break
        else:
            raise SolveError(
                f"the scatter of points and curves has not settled in {_ROUNDS} rounds: {before} and "
                f"{(sigma, *spread)} in the last two; take fewer knots, or leave out a curve that stands apart"
            )
        self.covariance = inverse
        self.sigma = np.sqrt(left @ left / freedom)
        self.spread = spread if self.shifts else np.array([np.nan, np.nan])
        self.mode, _, by_curve = self._unpack(p)
        self.modes = [
            replace(self.mode, squares=self.mode.squares * np.exp(square), log_damping=self.mode.log_damping + damping)
            for square, damping in by_curve.T
        ]
        self.amplitude = np.abs(self._own(self.mode.residual))

    def _start(self, count: int) -> FloatArray:
        """Natural frequencies by the tops of the curves; damping by the width of the lowest, the least bent of them."""
        size = np.abs(self.measured)
        gain = size if self.force is None else size / self.force
        tops = [np.argmax(np.where(self.curve == c, gain, 0.0)) for c in range(len(self.names))]
        lowest, *_ = tops = sorted(tops, key=lambda i: size[i])
        w, h = (v[self.curve == self.curve[lowest]] for v in (self.omega, gain))
        step = np.median(np.abs(np.diff(w))) if len(w) > 1 else 0.01 * w[0]
        D = max(np.ptp(w[h > h.max() / np.sqrt(2.0)]), step)
        at_top = D * self.omega[lowest]  # displacement times this is force by mass there
        self.unit = 1.0 / np.median(1.0 / gain) if self.residual else 1.0
        p = np.zeros(count)
        p[self.at["square"]] = 2 * np.log(np.interp(self.knots, size[tops], self.omega[tops]))
        p[self.at["damping"]] = np.log(D)
        if self.force is None:
            p[self.at["load"]] = [np.log(size[self.curve == c].max() * at_top) for c in range(len(self.names))]
        else:
            p[self.at["load"]] = -np.log(h.max() * at_top)
        return p

    def slopes(self) -> FloatArray:
        """d ln F / d ln a at the points' frequencies, each curve's own shift taken into account."""
        found = np.empty(len(self.omega))
        for c, mode in enumerate(self.modes):
            found[self.curve == c] = mode.slope(self.amplitude[self.curve == c], self.omega[self.curve == c])
        return found

    def own(self) -> tuple[FloatArray, ...]:
        """Natural frequency (Hz) and damping ratio of each curve alone, at the amplitude of its phase resonance."""
        rows = []
        for c, mode in enumerate(self.modes):
            a, w = self.amplitude[self.curve == c], self.omega[self.curve == c]
            place = a[np.argmin(np.abs(np.log(self.mode.square(a) / w**2)))]
            rows.append((mode.natural_frequency(place), mode.damping_ratio(place), place))
        return tuple(np.array(rows, float).T)


def _column(curves: Sequence[Any], name: str) -> FloatArray | None:
    """The points of all curves, or None where none has it."""
    lacking = [c.name for c in curves if getattr(c, name) is None]
    if 0 < len(lacking) < len(curves):
        raise ValueError(f"some curves have a {name} and {', '.join(map(repr, lacking))} have none; fit them apart")
    return None if lacking else np.concatenate([getattr(c, name) for c in curves])


def _knots(knots: int | ArrayLike, size: FloatArray) -> FloatArray:
    if isinstance(knots, int):
        if knots < 1:
            raise ValueError(f"knots must be at least 1, got {knots}")
        return np.linspace(size.min(), size.max(), knots) if knots > 1 else np.array([np.median(size)])
    given = np.asarray(knots, float)
    if given.ndim != 1 or len(given) < 1 or not (given > 0).all() or not (np.diff(given) > 0).all():
        raise ValueError(f"knots must be positive, increasing amplitudes (m), got {given!r}")
    return given
