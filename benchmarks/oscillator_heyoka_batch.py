"""The paper's oscillator in heyoka's batch mode: one trajectory per SIMD lane, the events of `oscillator_heyoka`.

The lanes of a batch step together, each with a step of its own; a callback is told its lane. An end of a step at an
event of one lane is a step of all lanes, which is why this mode gains less than the width here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from oscillator_heyoka import ON, equations


class _Toggle:
    def __init__(self) -> None:
        self.pars: Any = None

    def __deepcopy__(self, _memo: Any) -> _Toggle:
        return self

    def __call__(self, _ta: Any, _direction: int, lane: int) -> bool:
        self.pars[ON, lane] = 1.0 - self.pars[ON, lane]
        return True


class _Second:
    def __init__(self) -> None:
        self.pars: Any = None
        self.state: Any = None

    def __deepcopy__(self, _memo: Any) -> _Second:
        return self

    def __call__(self, _ta: Any, _direction: int, lane: int) -> bool:
        if self.state[0, lane] > self.pars[4, lane]:
            self.pars[ON, lane] = 1.0
        return True


class Batch:
    """A compiled integrator of several lanes with the complete logic of contact."""

    def __init__(self, lanes: int | None = None, tolerance: float = 1e-14) -> None:
        self.lanes = hy.recommended_simd_size() if lanes is None else lanes
        motion, change, entry = equations()
        rising = hy.event_direction.positive
        self._toggle, self._second = _Toggle(), _Second()
        self.ta = hy.taylor_adaptive_batch(
            motion,
            np.zeros((2, self.lanes)),
            pars=np.zeros((9, self.lanes)),
            tol=tolerance,
            t_events=[
                hy.t_event_batch(change, callback=self._toggle, direction=rising),
                hy.t_event_batch(entry, callback=self._second, direction=rising),
            ],
        )
        self._toggle.pars = self._second.pars = memoryview(self.ta.pars)
        self._second.state = memoryview(self.ta.state)

    def march(self, points: Sequence[Mapping[str, float]], n_periods: int) -> NDArray[np.float64]:
        """Every point from rest over ``n_periods``, ``lanes`` at a time, the last batch filled up: states (P, 2)."""
        found = []
        for first in range(0, len(points), self.lanes):
            part = list(points[first : first + self.lanes])
            part += [part[-1]] * (self.lanes - len(part))
            ends = np.empty(self.lanes)
            for lane, p in enumerate(part):
                m, depth = p["m"], -p["g"]
                self.ta.pars[:, lane] = [
                    2 * p["k"] / m,
                    p["c"] / m,
                    p["rho"] / m,
                    p["omega"],
                    p["g"],
                    p["k_s"] / m,
                    p["c_s"] / m,
                    p["c_s"] / p["k_s"],
                    float(depth > 0),
                ]
                ends[lane] = n_periods * 2 * np.pi / p["omega"]
            self.ta.set_time(0.0)
            self.ta.state[:] = 0.0
            self.ta.reset_cooldowns()
            self.ta.propagate_until(ends)
            found.append(self.ta.state.T.copy())
        return np.concatenate(found)[: len(points)]


@cache
def batch() -> Batch:
    return Batch()
