"""Lyapunov spectra in heyoka: variational equations, the frame made orthonormal by NumPy's QR every ``unit`` of time.

Python is entered once per unit, and at the valve's impacts, whose saltation matrix is written down by hand.
"""

from __future__ import annotations

from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from work import LORENZ


class _Spectrum:
    """Three states and their frame, marched by one compiled integrator."""

    def __init__(self, ta: Any) -> None:
        self.ta, self.frame = ta, ta.state[3:].reshape(3, 3)

    def run(self, start: tuple[float, ...], transient: float, duration: float, unit: float) -> NDArray[np.float64]:
        """The exponents over ``duration``, after a ``transient`` that turns the frame into the directions of growth."""
        frame, qr, log, diagonal = self.frame, np.linalg.qr, np.log, np.diagonal
        self._begin(start, np.eye(3))
        for length in (transient, duration):
            sums, count = np.zeros(3), round(length / unit)
            for _ in range(count):
                self.ta.propagate_for(unit)
                q, r = qr(frame)
                sums += log(abs(diagonal(r)))
                frame[:] = q
        return np.sort(sums / (count * unit))[::-1]

    def short(
        self, start: tuple[float, ...], duration: float, unit: float, scale: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """The same without a transient, angles being measured in units of the states' scales."""
        self._begin(start, np.diag(scale))
        sums, count = np.zeros(3), round(duration / unit)
        for _ in range(count):
            self.ta.propagate_for(unit)
            q, r = np.linalg.qr(self.frame / scale[:, None])
            sums += np.log(abs(np.diagonal(r)))
            self.frame[:] = q * scale[:, None]
        return np.sort(sums / (count * unit))[::-1]

    def _begin(self, start: tuple[float, ...], frame: NDArray[np.float64]) -> None:
        self.ta.time = 0.0
        self.ta.state[:3], self.frame[:] = start, frame
        if self.ta.with_events:
            self.ta.reset_cooldowns()


def lorenz(tolerance: float) -> _Spectrum:
    x, y, z = hy.make_vars("x", "y", "z")
    s, r, b = (LORENZ[name] for name in ("s", "r", "b"))
    equations = [(x, s * (y - x)), (y, x * (r - z) - y), (z, x * y - b * z)]
    variations = hy.var_ode_sys(equations, hy.var_args.vars, order=1)
    return _Spectrum(hy.taylor_adaptive(variations, np.zeros(12), tol=tolerance))


class _Impact:
    """The disc on its seat: y2 -> -r y2, and what that does to the frame."""

    def __init__(self, k: float, delta: float, r: float) -> None:
        self.k, self.delta, self.r = k, delta, r
        self.state: Any = None

    def __deepcopy__(self, _memo: Any) -> _Impact:
        return self

    def __call__(self, _ta: Any, _direction: int) -> bool:
        state, k, r = self.state, self.k, self.r
        v, push = state[1], state[2] - self.delta
        shear = (r * (push - k * v) + push + k * r * v) / v
        for c in (0, 1, 2):
            state[6 + c] = shear * state[3 + c] - r * state[6 + c]
            state[3 + c] *= -r
        state[0], state[1] = 0.0, -r * v
        return True


def valve(q: float, tolerance: float) -> _Spectrum:
    k, delta, beta, restitution = 1.25, 10.0, 20.0, 0.8
    y1, y2, y3 = hy.make_vars("y1", "y2", "y3")
    equations = [(y1, y2), (y2, -k * y2 - (y1 + delta) + y3), (y3, beta * (q - y1 * hy.sqrt(y3)))]
    impact = _Impact(k, delta, restitution)
    ta = hy.taylor_adaptive(
        hy.var_ode_sys(equations, hy.var_args.vars, order=1),
        np.ones(12),
        tol=tolerance,
        t_events=[hy.t_event(y1, callback=impact, direction=hy.event_direction.negative)],
    )
    impact.state = memoryview(ta.state)
    return _Spectrum(ta)
