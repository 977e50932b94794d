"""The paper's oscillator in heyoka's scalar mode, as fast as we could make it while its logic stays complete.

What was tried, in microseconds per forcing period at the parameters of Fig. 11 / Fig. 13 on one machine:

- both indicators as terminal events in either direction, decided in the callback (the plain way): 20-26 / 7-11;
- one directed event ``on h_b + (1 - on) h_a`` for entry and release, a second one for entry through h_b: 17-20 / 7-9;
- the same with coefficients divided by the mass beforehand and callbacks that write through memory views:
  14-16 / 5.5-7 (`complete`: the one that counts);
- without the second event: 9.4-11 / 3.7-4.7 (`minimal`: blind to a contact that begins at x > g. It gives the right
  answer at these parameters, where none begins so, and a wrong one in general. Printed beside the other.);
- a non-terminal second event costs as much as a terminal one; compact mode takes twice the time, `slp_vectorize` 5 %
  more; `force_avx512` changes nothing; `fast_math` gains 5 % and was left off, as ours is.

The integrator is compiled once; parameters and the mode are runtime parameters; `propagate_until` crosses many
periods in one call and Python is entered at terminal events only.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from time import perf_counter
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

ON = 8  # index of the mode among the runtime parameters


class _Toggle:
    """Entry or release: switch the support on or off and go on."""

    def __init__(self) -> None:
        self.pars: Any = None
        self.n_calls = 0

    def __deepcopy__(self, _memo: Any) -> _Toggle:
        return self

    def __call__(self, _ta: Any, _direction: int) -> bool:
        pars = self.pars
        pars[ON] = 1.0 - pars[ON]
        self.n_calls += 1
        return True


class _Second:
    """h_b falls through zero while free: a contact if the mass is beyond the gap."""

    def __init__(self) -> None:
        self.pars: Any = None
        self.state: Any = None
        self.n_calls = 0

    def __deepcopy__(self, _memo: Any) -> _Second:
        return self

    def __call__(self, _ta: Any, _direction: int) -> bool:
        if self.state[0] > self.pars[4]:
            self.pars[ON] = 1.0
        self.n_calls += 1
        return True


def equations() -> tuple[list[Any], Any, Any]:
    """The equations of motion, and what rises through zero at an entry or a release, and at an entry through h_b.

    The second is minus h_b while free and the constant -1 in contact: h_b falling is this rising.
    """
    x, v = hy.make_vars("x", "v")
    stiffness, damping, force, omega, gap, support, dashpot, tau, on = (hy.par[i] for i in range(9))
    depth = x - gap
    free = force * hy.cos(omega * hy.time) - stiffness * x - damping * v
    motion = [(x, v), (v, free - on * (support * depth + dashpot * v))]
    return motion, (1.0 - on) * depth - on * (depth + tau * v), (1.0 - on) * (depth + tau * v) - on


class Oscillator:
    """A compiled integrator; `start` sets parameters and state, the rest marches on from there.

    `events` is "complete" (the fastest complete logic) or "minimal" (blind to contact that begins beyond the gap).
    """

    def __init__(self, events: str = "complete", tolerance: float = 1e-14) -> None:
        motion, change, entry = equations()
        rising = hy.event_direction.positive
        self._toggle, self._second = _Toggle(), _Second()
        watched = [hy.t_event(change, callback=self._toggle, direction=rising)]
        if events == "complete":
            watched.append(hy.t_event(entry, callback=self._second, direction=rising))
        self.ta = hy.taylor_adaptive(motion, [0.0, 0.0], pars=[0.0] * 9, tol=tolerance, t_events=watched)
        for callback in (self._toggle, self._second):
            callback.pars = memoryview(self.ta.pars)
        self._second.state = memoryview(self.ta.state)

    def start(self, p: Mapping[str, float], u: NDArray[np.float64] | tuple[float, float] = (0.0, 0.0)) -> None:
        m = p["m"]
        x, v = u
        depth, tau = x - p["g"], p["c_s"] / p["k_s"]
        inside = depth > 0 and depth + tau * v > 0
        self.period = 2 * np.pi / p["omega"]
        coefficients = (2 * p["k"] / m, p["c"] / m, p["rho"] / m, p["omega"], p["g"], p["k_s"] / m, p["c_s"] / m, tau)
        self.ta.pars[:] = [*coefficients, float(inside)]
        self.ta.time = 0.0
        self.ta.state[:] = u
        self.ta.reset_cooldowns()

    def march(self, n_periods: int) -> NDArray[np.float64]:
        """`n_periods` further; the state there."""
        self.ta.propagate_until(self.ta.time + n_periods * self.period)
        return np.array(self.ta.state)

    def section(self, n_periods: int) -> NDArray[np.float64]:
        """States after each of `n_periods` further periods, by heyoka's own dense output on a grid."""
        grid = self.ta.time + self.period * np.arange(n_periods + 1)
        return np.asarray(self.ta.propagate_grid(grid)[5][1:])

    @property
    def n_callbacks(self) -> int:
        return self._toggle.n_calls + self._second.n_calls

    def callback_cost(self, n: int = 100_000) -> float:
        """Seconds per callback, the Python part alone (called from Python, an even number of times)."""
        begin = perf_counter()
        for _ in range(n):
            self._toggle(self.ta, 1)
        return (perf_counter() - begin) / n


@cache
def oscillator(events: str = "complete") -> Oscillator:
    return Oscillator(events)
