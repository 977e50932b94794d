"""The least squares behind :func:`~nonsmooth.identification.amplitude_dependent.amplitude_dependent`.

Unknowns: ln omega_n^2 and ln D at the knots, then ln m or each curve's ln(F/m), the residual, and for each curve a
shift of the first two with a normal prior. Standard deviations of points and of shifts are found by expectation and
maximisation around the fit (A.P. Dempster et al., J. R. Stat. Soc. B 39 (1977) 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.identification.nonlinear_mode import NonlinearMode, interpolation

__all__ = ["FEWEST_CURVES", "ResponseFit"]

_ROUNDS = 40
FEWEST_CURVES = 4  # curves: how far they differ cannot be told from fewer


class ResponseFit:
    """Fit of a nonlinear mode to curves; see :mod:`nonsmooth.identification.amplitude_dependent`."""

    def __init__(self, curves: Sequence[Any], knots: int | ArrayLike, *, residual: bool, mass: float | None) -> None:
        if not curves:
            raise ValueError("there are no response curves")
        self.names = tuple(str(c.name) for c in curves)
        self.phased = _all_or_none(curves, "phase")
        self.forced = _all_or_none(curves, "force")
        if residual and not (self.phased and self.forced):
            raise ValueError("the residual of other modes can be told only with forces and phases; leave it out")
        if mass is not None and not (mass > 0 and self.forced):
            raise ValueError("a modal mass is a positive number, and of use only with forces in N")
        self.residual, self.mass = residual, mass
        self.curve = np.repeat(np.arange(len(curves)), [len(c.frequency) for c in curves])
        self.omega = 2 * np.pi * np.concatenate([c.frequency for c in curves])
        size = np.concatenate([c.amplitude for c in curves])
        self.phase = np.concatenate([c.phase for c in curves]) if self.phased else None
        self.force = np.concatenate([c.force for c in curves]) if self.forced else None
        self.measured = size * np.exp(1j * self.phase) if self.phase is not None else size.astype(complex)
        self.knots = _knots(knots, size)
        self.shifts = len(curves) >= FEWEST_CURVES
        self._fit()

    # ------------------------------------------------------------------------------------------------- the unknowns

    @property
    def sizes(self) -> tuple[int, int]:
        """Index of the first shift, and the number of unknowns."""
        K, n = len(self.knots), len(self.names)
        first = 2 * K + (0 if self.mass is not None else 1 if self.forced else n) + 2 * self.residual
        return first, first + 2 * n * self.shifts

    def _unpack(self, p: FloatArray) -> tuple[NonlinearMode, Any, FloatArray, FloatArray]:
        """The mode, ln(F/m) of each point, and the shifts of the points' ln omega_n^2 and ln D."""
        K, (first, _) = len(self.knots), self.sizes
        R = complex(*p[first - 2 : first]) * self.unit if self.residual else 0j
        if self.force is None:
            mass, load = 1.0, p[2 * K : 2 * K + len(self.names)][self.curve]
        else:
            mass = self.mass if self.mass is not None else float(np.exp(p[2 * K]))
            load = np.log(self.force / mass)
        mode = NonlinearMode(self.knots, np.exp(p[:K]), p[K : 2 * K], mass, R)
        shift = p[first:].reshape(2, -1)[:, self.curve] if self.shifts else np.zeros((2, len(self.curve)))
        return mode, load, shift[0], shift[1]

    def _left(self, p: FloatArray) -> FloatArray:
        """ln of force over what the mode needs (and its phase), for all points."""
        mode, load, by_square, by_damping = self._unpack(p)
        own = self.measured - mode.residual * self.force if self.force is not None else self.measured
        a = np.abs(own)
        G, D = mode.square(a) * np.exp(by_square), mode.damping(a) * np.exp(by_damping)
        needed = (G - self.omega**2 + 1j * D * self.omega) * own
        size = load - np.log(np.abs(needed))
        if not self.phased:
            return np.asarray(size)
        return np.concatenate([size, -np.angle(needed)])

    def _jacobian(self, p: FloatArray) -> FloatArray:
        """Derivatives of :meth:`_left`; those by the residual, which moves the amplitudes, by differences."""
        mode, _, by_square, by_damping = self._unpack(p)
        K, (first, count), n = len(self.knots), self.sizes, len(self.names)
        a = np.abs(self.measured - mode.residual * self.force if self.force is not None else self.measured)
        basis = interpolation(self.knots, a)
        plain = basis @ mode.squares
        G, D = plain * np.exp(by_square), np.exp(basis @ mode.log_damping + by_damping)
        needed = G - self.omega**2 + 1j * D * self.omega
        to_square, to_damping = -G / needed, -1j * D * self.omega / needed
        J: Any = np.zeros((len(a), count), complex)
        J[:, :K] = to_square[:, None] * basis * mode.squares / plain[:, None]
        J[:, K : 2 * K] = to_damping[:, None] * basis
        if self.force is None:
            J[np.arange(len(a)), 2 * K + self.curve] = 1.0
        elif self.mass is None:
            J[:, 2 * K] = -1.0
        if self.shifts:
            J[np.arange(len(a)), first + self.curve] = to_square
            J[np.arange(len(a)), first + n + self.curve] = to_damping
        full: FloatArray = np.concatenate([J.real, J.imag] if self.phased else [J.real])
        for k in range(first - 2, first) if self.residual else ():
            step = np.zeros(count)
            step[k] = 1e-6
            full[:, k] = (self._left(p + step) - self._left(p - step)) / 2e-6
        return full

    # ------------------------------------------------------------------------------------------------------ the fit

    def _fit(self) -> None:
        first, count = self.sizes
        n, rows = len(self.names), len(self.omega) * (1 + self.phased)
        if rows <= first:
            raise ValueError(f"{rows} measured values cannot tell {first} unknowns: take fewer knots, or more points")
        p = self._start(count)
        sigma, spread = 0.05, np.array([1e-3, 0.1])
        for k in range(_ROUNDS):
            prior = np.zeros(count)
            prior[first:] = np.repeat(1 / spread**2, n) if self.shifts else 0.0
            p, normal = self._settle(p, sigma, prior)
            inverse = np.linalg.pinv(normal, hermitian=True)
            left = self._left(p)
            # Unknowns that the measurement determined: all but what the prior of the shifts did.
            freedom = max(rows - (count - float(prior @ np.diag(inverse))), 1.0)
            before, moved = (sigma, *spread), 0.0
            # Points of a curve that err alike count less.
            sigma = max(float(np.sqrt(left @ left / freedom * self._alike(left))), 1e-9)
            if self.shifts:
                own, own_error = p[first:].reshape(2, n), np.diag(inverse)[first:].reshape(2, n)
                spread = np.sqrt(np.maximum(np.mean(own**2 + own_error, axis=1), 1e-18))
                # by how much of what the points of a curve say of its shift: towards 0 the way is long
                told = np.mean(np.maximum(np.diag(normal - np.diag(prior))[first:], 1e-300).reshape(2, n), axis=1)
                change = np.abs(spread - before[1:])
                moved = float(np.max(np.minimum(change / spread, change * np.sqrt(told))))
            if k > 2 and moved < 1e-2 and abs(sigma / before[0] - 1) < 1e-2:
                break
        else:
            raise SolveError(
                f"the scatter of points and curves has not settled in {_ROUNDS} rounds: {before} and "
                f"{(sigma, *spread)} in the last two; take fewer knots, or leave out a curve that stands apart"
            )
        self.p, self.covariance, self.left = p, inverse, left
        self.sigma = float(np.sqrt(left @ left / freedom))
        self.spread = spread if self.shifts else np.array([np.nan, np.nan])
        self.mode = self._unpack(p)[0]
        R = self.mode.residual
        self.amplitude = np.abs(self.measured - R * self.force if self.force is not None else self.measured)

    def _settle(self, p: FloatArray, sigma: float, prior: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Least squares from ``p``; the outcome and its normal matrix. ``prior``: 1 / variance of unknowns."""
        from scipy.optimize import least_squares

        known = np.sqrt(prior)
        found = least_squares(
            lambda q: np.concatenate([self._left(q) / sigma, known * q]), p,
            lambda q: np.vstack([self._jacobian(q) / sigma, np.diag(known)]), method="lm", x_scale="jac",
        )  # fmt: skip
        if not found.success:
            raise SolveError(f"the fit of the responses has not converged: {found.message} Take fewer knots")
        return found.x, found.jac.T @ found.jac

    def _start(self, count: int) -> FloatArray:
        """Natural frequencies by the tops of the curves; damping by the width of the lowest, the least bent of them."""
        load = self.force if self.force is not None else np.ones_like(self.omega)
        size = np.abs(self.measured)
        gain = size / load
        tops = [int(np.argmax(np.where(self.curve == c, gain, 0.0))) for c in range(len(self.names))]
        tops.sort(key=lambda i: size[i])
        w, h = (v[self.curve == self.curve[tops[0]]] for v in (self.omega, gain))
        top = int(np.argmax(h))
        wide = w[h > h[top] / np.sqrt(2.0)]
        step = float(np.median(np.abs(np.diff(w)))) if len(w) > 1 else 0.01 * w[0]
        D = max(float(np.ptp(wide)), step)
        K, n = len(self.knots), len(self.names)
        self.unit = 1.0 / float(np.median(1.0 / gain)) if self.residual else 1.0
        p = np.zeros(count)
        p[:K] = 2 * np.log(np.interp(self.knots, size[tops], self.omega[tops]))
        p[K : 2 * K] = np.log(D)
        if self.force is None:
            for c in range(n):
                here = np.abs(self.measured[self.curve == c])
                p[2 * K + c] = np.log(here.max() * D * w[top])
        elif self.mass is None:
            p[2 * K] = -np.log(h[top] * D * w[top])
        return p

    def _alike(self, left: FloatArray) -> float:
        """Number of neighbouring points of a curve that say as much as one."""
        blocks = left.reshape(-1, len(self.curve))
        total = cross = 0.0
        for row in blocks:
            for c in range(len(self.names)):
                r = row[self.curve == c]
                total += float(r @ r)
                cross += float(r[1:] @ r[:-1])
        rho = min(max(cross / total, 0.0), 0.9) if total > 0 else 0.0
        return (1 + rho) / (1 - rho)

    # ----------------------------------------------------------------------------------------------------- outcomes

    def slopes(self) -> FloatArray:
        """d ln F / d ln a at the points' frequencies, each curve's own shift taken into account."""
        mode, _, by_square, by_damping = self._unpack(self.p)
        a, w, change = self.amplitude, self.omega, interpolation(self.knots, self.amplitude, 1)
        G, D = mode.square(a) * np.exp(by_square), mode.damping(a) * np.exp(by_damping)
        turn = (change @ mode.squares) * np.exp(by_square) + 1j * w * D * (change @ mode.log_damping)
        return np.asarray(1.0 + np.real(a * turn / (G - w**2 + 1j * w * D)))

    def own(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Natural frequency (Hz) and damping ratio of each curve alone, at the amplitude of its phase resonance."""
        places = np.zeros(len(self.names))
        for c in range(len(places)):
            here = self.curve == c
            off = np.abs(np.log(self.mode.square(self.amplitude[here]) / self.omega[here] ** 2))
            places[c] = self.amplitude[here][int(np.argmin(off))]
        first, _ = self.sizes
        shift = self.p[first:].reshape(2, -1) if self.shifts else np.zeros((2, len(places)))
        omega = np.sqrt(self.mode.square(places) * np.exp(shift[0]))
        return omega / (2 * np.pi), self.mode.damping(places) * np.exp(shift[1]) / (2 * omega), places


def _all_or_none(curves: Sequence[Any], name: str) -> bool:
    """Return whether all curves have it."""
    having = [c.name for c in curves if getattr(c, name) is not None]
    if having and len(having) < len(curves):
        lacking = [c.name for c in curves if c.name not in having]
        raise ValueError(f"some curves have a {name} and {', '.join(map(repr, lacking))} have none; fit them apart")
    return bool(having)


def _knots(knots: int | ArrayLike, size: FloatArray) -> FloatArray:
    if isinstance(knots, int):
        if knots < 1:
            raise ValueError(f"knots must be at least 1, got {knots}")
        return np.linspace(size.min(), size.max(), knots) if knots > 1 else np.array([float(np.median(size))])
    given = np.asarray(knots, dtype=np.float64)
    if given.ndim != 1 or len(given) < 1 or not (given > 0).all() or not (np.diff(given) > 0).all():
        raise ValueError(f"knots must be positive, increasing amplitudes (m), got {given!r}")
    return given
