"""The relief valve in heyoka: impacts by a terminal event, maxima of the lift (the section) by a non-terminal one.

Python is entered at impacts and maxima only; a maximum costs one evaluation of the dense output.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray


class _Impact:
    def __init__(self) -> None:
        self.pars: Any = None
        self.state: Any = None
        self.n_calls = 0

    def __deepcopy__(self, _memo: Any) -> _Impact:
        return self

    def __call__(self, _ta: Any, _direction: int) -> bool:
        state = self.state
        state[0] = 0.0
        state[1] *= -self.pars[3]
        self.n_calls += 1
        return True


class _Maximum:
    def __init__(self) -> None:
        self.points: list[Any] = []
        self.copy = np.array

    def __deepcopy__(self, _memo: Any) -> _Maximum:
        return self

    def __call__(self, ta: Any, time: float, _direction: int) -> None:
        self.points.append(self.copy(ta.update_d_output(time)))


class Valve:
    """A compiled integrator at one tolerance."""

    def __init__(self, tolerance: float = 1e-10) -> None:
        y1, y2, y3 = hy.make_vars("y1", "y2", "y3")
        k, delta, beta, _, q = (hy.par[i] for i in range(5))
        self.impact, self.maxima = _Impact(), _Maximum()
        falling = hy.event_direction.negative
        self.ta = hy.taylor_adaptive(
            [(y1, y2), (y2, -k * y2 - (y1 + delta) + y3), (y3, beta * (q - y1 * hy.sqrt(y3)))],
            [1.0, 0.0, 11.0],
            pars=[1.25, 10.0, 20.0, 0.8, 5.0],
            tol=tolerance,
            t_events=[hy.t_event(y1, callback=self.impact, direction=falling)],
            nt_events=[hy.nt_event(y2, self.maxima, direction=falling)],
        )
        self.impact.pars, self.impact.state = memoryview(self.ta.pars), memoryview(self.ta.state)

    def start(self, q: float, u: tuple[float, float, float]) -> None:
        self.ta.pars[4] = q
        self.ta.time = 0.0
        self.ta.state[:] = u
        self.ta.reset_cooldowns()
        self.impact.n_calls = 0

    def march(self, duration: float) -> NDArray[np.float64]:
        """States at the maxima of y1 met in a further `duration`."""
        self.maxima.points.clear()
        self.ta.propagate_until(self.ta.time + duration)
        return np.array(self.maxima.points)


@cache
def valve(tolerance: float = 1e-10) -> Valve:
    return Valve(tolerance)
