"""The paper's oscillator integrated by heyoka: a reference that shares no code and no method with `nonsmooth`.

Savi, Divenyi, Franca, Weber, J. Sound Vib. 301 (2007), Eqs. 1-5: a mass between springs ``2k`` meets a support
(stiffness ``k_s``, damping ``c_s``) at the gap ``g``. Contact is ``h_a > 0 and h_b < 0`` with ``h_a = x - g``
and ``h_b = -(x - g) - (c_s / k_s) v``: it begins when the second of the two conditions becomes true (usually
``h_a``; ``h_b`` when the mass turns back while still beyond the gap) and ends when ``h_b`` rises through zero,
at ``x > g``, where it must not begin again.

heyoka isolates the crossings on the Taylor polynomial of each step. Both indicators are terminal events in
either direction; what a stop means is decided here, in Python, from the state just after it. The support is
switched by a runtime parameter, so one compiled integrator serves every parameter set.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

NAMES = ("m", "k", "k_s", "c", "c_s", "g", "rho", "omega")
TABLE_1 = {"m": 0.838, "k": 8.47, "k_s": 1210.0, "c": 0.87, "c_s": 0.60}  # the paper's Table 1

#: Time for which an event that has just fired is deaf. Within it the support moves by less than rounding
#: (a t^2 / 8 < 1e-19 m); without it heyoka may find the same root again, 1e-17 s later.
COOLDOWN = 1e-10

#: An indicator smaller than this at a stop is zero within rounding, and is judged by its rate (metres).
ZERO = 1e-17


@dataclass
class Extremum:
    """An interior extremum of an indicator row that guards the next transition: a touch when it stays below 0."""

    time: float
    indicator: str  # "penetration" (local maximum of x) or "separation" (extremum of h_b beyond the gap)
    value: float  # h_a or h_b there, in metres
    mode: int


@dataclass
class Crossing:
    time: float
    kind: str  # "enter_a" (h_a rises), "enter_b" (h_b falls with x > g), "release" (h_b rises)
    speed: float  # rate of the indicator that crossed, m/s
    u: NDArray[np.float64]


@dataclass
class Run:
    """Record of one run. ``states[i]`` is the state after i forcing periods, ``modes`` 0 free, 1 contact."""

    states: NDArray[np.float64]
    modes: NDArray[np.int64]
    crossings: list[Crossing] = field(default_factory=list)
    extrema: list[Extremum] = field(default_factory=list)
    n_steps: int = 0
    maximum: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))  # largest |x|, |v| at the records

    @property
    def n_contacts(self) -> int:
        return sum(c.kind != "release" for c in self.crossings)

    def first_near_grazing(self, distance: float = 1e-9) -> float:
        """Time of the first touch or crossing whose extremum lies nearer to the surface than `distance` (inf: none)."""
        return min((e.time for e in self.extrema if abs(e.value) < distance), default=np.inf)

    def nearest_graze(self) -> float:
        return min((abs(e.value) for e in self.extrema), default=np.inf)


class _Stop:
    """Terminal event without consequences of its own: it notes which way the indicator went and stops."""

    def __init__(self) -> None:
        self.direction = 0

    def __call__(self, _integrator: Any, direction: int) -> bool:
        self.direction = direction
        return False

    def __deepcopy__(self, _memo: Any) -> _Stop:
        return self  # heyoka copies its callbacks; we must be able to read this one


class _Note:
    """Non-terminal event that collects its times and the states there."""

    def __init__(self) -> None:
        self.hits: list[tuple[float, float, float]] = []

    def __call__(self, integrator: Any, time: float, _direction: int) -> None:
        integrator.update_d_output(time)
        x, v = integrator.d_output
        self.hits.append((time, x, v))

    def __deepcopy__(self, _memo: Any) -> _Note:
        return self


@dataclass
class _Compiled:
    integrator: Any
    stops: tuple[_Stop, _Stop]
    maxima: _Note
    turns: _Note


@cache
def compiled(tolerance: float = 1e-14) -> _Compiled:
    x, v = hy.make_vars("x", "v")
    m, k, k_s, c, c_s, g, rho, omega, on = (hy.par[i] for i in range(9))
    acceleration = (rho * hy.cos(omega * hy.time) - 2.0 * k * x - c * v - on * (k_s * (x - g) + c_s * v)) / m
    stops, maxima, turns = (_Stop(), _Stop()), _Note(), _Note()
    integrator = hy.taylor_adaptive(
        [(x, v), (v, acceleration)],
        [0.0, 0.0],
        pars=[0.0] * 9,
        tol=tolerance,
        high_accuracy=True,
        t_events=[
            hy.t_event(x - g, callback=stops[0], cooldown=COOLDOWN),
            hy.t_event(-(x - g) - c_s / k_s * v, callback=stops[1], cooldown=COOLDOWN),
        ],
        nt_events=[
            hy.nt_event(v, maxima, direction=hy.event_direction.negative),
            hy.nt_event(-v - c_s / k_s * acceleration, turns),
        ],
    )
    return _Compiled(integrator, stops, maxima, turns)


def acceleration(p: Mapping[str, float], t: float, x: float, v: float, mode: int) -> float:
    support = p["k_s"] * (x - p["g"]) + p["c_s"] * v if mode else 0.0
    return (p["rho"] * np.cos(p["omega"] * t) - 2 * p["k"] * x - p["c"] * v - support) / p["m"]


def region(p: Mapping[str, float], x: float, v: float) -> int:
    """1 inside the contact region (Eq. 4b), else 0."""
    return int(x - p["g"] > 0 and -(x - p["g"]) - p["c_s"] / p["k_s"] * v < 0)


def _decide(p: Mapping[str, float], t: float, x: float, v: float, mode: int) -> int:
    """The mode just after a stop: an indicator that is zero is judged by where it is going."""
    tau, a = p["c_s"] / p["k_s"], acceleration(p, t, x, v, mode)
    rounding = ZERO + 2e-16 * (abs(x) + abs(p["g"]))

    def sign(value: float, rate: float) -> float:
        return rate if abs(value) <= rounding else value

    h_a, h_b = x - p["g"], -(x - p["g"]) - tau * v
    return int(sign(h_a, v) > 0 and sign(h_b, -v - tau * a) < 0)


def run(
    parameters: Mapping[str, float],
    n_periods: int,
    start: tuple[float, float] | NDArray[np.float64] = (0.0, 0.0),
    *,
    per_period: int = 1,
    tolerance: float = 1e-14,
    record: bool = True,
) -> Run:
    """March `n_periods` forcing periods from `start` at phase 0; states are kept `per_period` times a period.

    The clock is set back to zero after each period, so that the forcing's argument loses no digits.
    """
    p = dict(parameters)
    machine = compiled(tolerance)
    ta = machine.integrator
    period = 2 * np.pi / p["omega"]
    ta.time = 0.0
    ta.state[:] = start
    ta.reset_cooldowns()
    mode = region(p, *start)
    ta.pars[:] = [p[name] for name in NAMES] + [float(mode)]
    states, modes, largest = [np.array(start, dtype=float)], [mode], np.abs(np.array(start, dtype=float))
    out = Run(np.empty(0), np.empty(0, dtype=np.int64))
    machine.maxima.hits.clear()
    machine.turns.hits.clear()
    for i in range(n_periods):
        ta.time = 0.0
        for j in range(1, per_period + 1):
            until = period * j / per_period
            while True:
                outcome = ta.propagate_until(until)
                out.n_steps += outcome[3]
                if record:
                    _collect(out, machine, p, i * period, mode)
                if int(outcome[0]) == int(hy.taylor_outcome.time_limit):
                    break
                index = -int(outcome[0]) - 1
                if index not in (0, 1):
                    raise RuntimeError(f"heyoka stopped with {outcome[0]} at t = {ta.time} of period {i}")
                x, v = ta.state
                after = _decide(p, ta.time, x, v, mode)
                direction = machine.stops[index].direction
                # The indicator that crossed is judged by its direction, not by its rounded value.
                if index == 1:
                    after = 0 if direction > 0 else after
                elif direction < 0:
                    after = 0 if mode == 0 else after
                if after != mode:
                    kind = "release" if mode else ("enter_a", "enter_b")[index]
                    rate = v if index == 0 else -v - p["c_s"] / p["k_s"] * acceleration(p, ta.time, x, v, mode)
                    out.crossings.append(Crossing(i * period + ta.time, kind, rate, np.array([x, v])))
                    mode = after
                    ta.pars[8] = float(mode)
            states.append(np.array(ta.state))
            modes.append(mode)
            largest = np.maximum(largest, np.abs(ta.state))
    out.states, out.modes, out.maximum = np.array(states), np.array(modes), largest
    return out


def _collect(out: Run, machine: _Compiled, p: Mapping[str, float], origin: float, mode: int) -> None:
    for t, x, _ in machine.maxima.hits:
        out.extrema.append(Extremum(origin + t, "penetration", x - p["g"], mode))
    for t, x, v in machine.turns.hits:
        if x > p["g"]:
            out.extrema.append(Extremum(origin + t, "separation", -(x - p["g"]) - p["c_s"] / p["k_s"] * v, mode))
    machine.maxima.hits.clear()
    machine.turns.hits.clear()


def growth(
    parameters: Mapping[str, float], reference: Run, *, scale: NDArray[np.float64], offset: float = 1e-9
) -> NDArray[np.float64]:
    """Largest growth factor of two neighbours of `reference` since the start, one value per record.

    The neighbours start `offset` (times `scale`) away, one in each state: factor = |d_n| / |d_0|, at least 1.
    """
    factors = np.ones(len(reference.states))
    for axis in range(2):
        start = reference.states[0].copy()
        start[axis] += offset * scale[axis]
        neighbour = run(parameters, len(reference.states) - 1, start, record=False)
        distance = np.linalg.norm((neighbour.states - reference.states) / scale, axis=1)
        factors = np.maximum(factors, distance / offset)
    return factors
