"""Closed form of u' = A u + b + sum_k c_k cos(k w t) + s_k sin(k w t): one matrix exponential, nothing of ours.

The forcing is written as further states (1, cos, sin of each harmonic), so that over-, under- and critically damped,
singular and resonant cases are one formula: z(t) = expm(M (t - t0)) z(t0).
"""

from __future__ import annotations

import mpmath
import numpy as np
from scipy.linalg import expm


class LinearFlow:
    """The flow of one linear mode."""

    def __init__(self, A, b=None, harmonics=None, omega=1.0):
        self.A = np.asarray(A, dtype=float)
        self.n = len(self.A)
        self.omega = float(omega)
        self.multiples = sorted(harmonics or {})
        size = self.n + 1 + 2 * len(self.multiples)
        self.M = np.zeros((size, size))
        self.M[: self.n, : self.n] = self.A
        self.M[: self.n, self.n] = 0.0 if b is None else b
        for j, k in enumerate(self.multiples):
            at = self.n + 1 + 2 * j
            self.M[: self.n, at], self.M[: self.n, at + 1] = harmonics[k]
            self.M[at, at + 1], self.M[at + 1, at] = -k * self.omega, k * self.omega

    def _z(self, t0: float, u0) -> np.ndarray:
        waves = [f(k * self.omega * t0) for k in self.multiples for f in (np.cos, np.sin)]
        return np.array([*u0, 1.0, *waves])

    def at(self, t0: float, u0, t: float) -> np.ndarray:
        """The state at t, in double precision."""
        return (expm(self.M * (t - t0)) @ self._z(t0, u0))[: self.n]

    def exactly(self, t0: float, u0, t: float) -> np.ndarray:
        """The state at t, by 40 digits."""
        with mpmath.workdps(40):
            w = [f(k * mpmath.mpf(self.omega) * t0) for k in self.multiples for f in (mpmath.cos, mpmath.sin)]
            z = mpmath.matrix([*map(mpmath.mpf, map(float, u0)), 1, *w])
            end = mpmath.expm(mpmath.matrix(self.M.tolist()) * (mpmath.mpf(float(t)) - mpmath.mpf(float(t0)))) * z
            return np.array([float(end[i]) for i in range(self.n)])

    def along(self, t0: float, u0, t1: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        """``count`` + 1 equidistant instants from t0 to t1, and the states there."""
        step = expm(self.M * ((t1 - t0) / count))
        z = self._z(t0, u0)
        states = [z[: self.n]]
        for _ in range(count):
            z = step @ z
            states.append(z[: self.n])
        return np.linspace(t0, t1, count + 1), np.array(states)
