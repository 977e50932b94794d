"""Twelve systems with data from another program: equations written out again here, SciPy's DOP853 between events.

Each case has the system, the true parameters, which of them a fit is to find, and ``motion(p, start, times)``: states
(or what is measured) at the instants. The readings then get noise, a clock that jitters, and a resolution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import nonsmooth as ns


def march(fields, events, mode, u, times):
    """States (N, n) at increasing times from times[0] on: ``fields[mode](t, u)``; ``events[mode]``: (g, direction,
    action(t, u) -> (mode, u))."""
    t, end, out, k = times[0], times[-1], np.empty((len(times), len(u))), 0
    for _ in range(20_000):
        rows = []
        for g, direction, action in events[mode]:

            def zero(t, u, g=g):
                return g(t, u)

            zero.terminal, zero.direction = True, direction
            rows.append((zero, action))
        found = solve_ivp(
            fields[mode],
            (t, end + 1e-9),
            u,
            "DOP853",
            rtol=1e-11,
            atol=1e-12,
            dense_output=True,
            events=[zero for zero, _ in rows],
            max_step=0.2,
        )
        last = found.t[-1]
        here = np.searchsorted(times, last, "left") if found.status == 1 else len(times)
        if here > k:
            out[k:here] = found.sol(times[k:here]).T
            k = here
        if found.status != 1:
            return out
        which = next(i for i, hits in enumerate(found.t_events) if len(hits))
        t, u = last, found.y[:, -1]
        mode, u = rows[which][1](t, np.array(u))
    raise RuntimeError("too many events")


@dataclass(frozen=True)
class Case:
    """A system, the truth, and its recording."""

    name: str
    system: Callable[[], Any]
    truth: dict[str, float]
    find: list[str]
    motion: Callable[[dict[str, float], Any, Any], Any]  # -> measured columns (N, c)
    start: Callable[[Any], dict[str, float]]
    measured: dict[str, str]
    duration: float
    samples: int = 1200
    noise: float = 0.01  # of the reading's standard deviation
    resolution: float = 0.01
    jitter: float = 0.02  # of the step

    def recording(self, seed: int):
        """Readings by seed, with the sensors that a user would state."""
        rng = np.random.default_rng(seed)
        start = self.start(rng)
        t = np.linspace(0.0, self.duration, self.samples)
        step = t[1] - t[0]
        read = np.concatenate([[0.0], t[1:] + self.jitter * step * rng.standard_normal(len(t) - 1)])
        clean = self.motion(self.truth, start, np.maximum.accumulate(read))
        data, measured = {}, {}
        for c, (quantity, channel) in enumerate(self.measured.items()):
            size = clean[:, c].std()
            count = self.resolution * size
            y = count * np.rint((clean[:, c] + self.noise * size * rng.standard_normal(len(t))) / count)
            data[channel], measured[quantity] = (t, y), ns.Sensor(channel, resolution=count)
        return data, measured, start

    def guess(self, seed: int, off: float = 0.3):
        """The system, its parameters off by 30 % either way, as far as it allows them together."""
        rng = np.random.default_rng(seed + 1000)
        while True:
            signs = rng.choice([-1.0, 1.0], len(self.find))
            far = {name: self.truth[name] * (1.0 + off * sign) for name, sign in zip(self.find, signs, strict=True)}
            try:
                return self.system().with_parameters({**self.truth, **far})
            except ns.SystemDefinitionError:  # static friction below the kinetic one
                continue


def duffing() -> ns.System:
    """A Duffing oscillator with a rigid stop."""

    def motion(t, u, p):
        x, v = u
        return v, p.F * np.cos(p.w * t) - p.c * v - p.a * x - p.b * x**3

    return ns.System(
        name="Duffing with a stop",
        states=["x", "v"],
        modes={"free": motion},
        parameters={"a": 1.0, "b": 0.5, "c": 0.15, "F": 1.0, "w": 0.9, "g": 0.8, "e": 0.7},
        indicators={"stop": lambda t, u, p: u.x - p.g},
        transitions=[ns.Transition("free", "free", when="stop > 0", reset=lambda t, u, p: (u.x, -p.e * u.v))],
    )


def _xv(rng):
    return {"x": 0.1 * rng.standard_normal(), "v": 0.2 * rng.standard_normal()}


def _duffing(p, start, t):
    def f(t, u):
        return [u[1], p["F"] * np.cos(p["w"] * t) - p["c"] * u[1] - p["a"] * u[0] - p["b"] * u[0] ** 3]

    hit = (lambda t, u: u[0] - p["g"], 1, lambda t, u: ("", np.array([p["g"], -p["e"] * u[1]])))
    return march({"": f}, {"": [hit]}, "", [start["x"], start["v"]], t)[:, :1]


def _impact(p, start, t):
    def f(t, u):
        return [u[1], p["A"] * np.cos(p["omega"] * t) - p["k"] * u[0] - p["c"] * u[1]]

    hit = (lambda t, u: u[0] - p["d"], 1, lambda t, u: ("", np.array([p["d"], -p["e"] * u[1]])))
    return march({"": f}, {"": [hit]}, "", [start["x"], start["v"]], t)


def cell() -> ns.System:
    """v' = (I - v) / tau, begun anew at ``rest`` where v comes to 1."""
    return ns.System(
        states=["v"],
        parameters={"I": 2.0, "tau": 1.0, "rest": 0.1},
        modes={"charges": lambda t, u, p: ((p.I - u.v) / p.tau,)},
        indicators={"threshold": lambda t, u, p: u.v - 1},
        transitions=[ns.Transition("charges", "charges", when="threshold > 0", reset=lambda t, u, p: (p.rest,))],
    )


def _cell(p, start, t):
    fire = (lambda t, u: u[0] - 1.0, 1, lambda t, u: ("", np.array([p["rest"]])))
    return march({"": lambda t, u: [(p["I"] - u[0]) / p["tau"]]}, {"": [fire]}, "", [start["v"]], t)


def _belt(p, start, t):
    def slow(t, u):
        return [u[1], p["F"] / (1 + p["delta"] * (p["v_b"] - u[1])) - u[0]]

    def stick(t, u):
        return [p["v_b"], 0.0]

    fields = {"slow": slow, "stick": stick}
    events = {
        "slow": [(lambda t, u: u[1] - p["v_b"], 1, lambda t, u: ("stick", np.array([u[0], p["v_b"]])))],
        "stick": [(lambda t, u: u[0] - p["F"], 1, lambda t, u: ("slow", np.array([u[0], p["v_b"] - 1e-12])))],
    }
    return march(fields, events, "slow", [start["x"], start["v"]], t)[:, :1]


def _gears(p, start, t):
    def field(sign):
        def f(t, u):
            spring = (u[0] - sign * p["b"]) if sign else 0.0
            return [
                u[1],
                p["F_m"] + p["F_a"] * p["omega"] ** 2 * np.cos(p["omega"] * t) - 2 * p["zeta"] * u[1] - spring,
            ]

        return f

    def go(mode):
        return lambda t, u: (mode, u)

    fields = {0: field(0), 1: field(1), -1: field(-1)}
    events = {
        0: [(lambda t, u: u[0] - p["b"], 1, go(1)), (lambda t, u: u[0] + p["b"], -1, go(-1))],
        1: [(lambda t, u: u[0] - p["b"], -1, go(0))],
        -1: [(lambda t, u: u[0] + p["b"], 1, go(0))],
    }
    return march(fields, events, 1, [start["q"], start["v_q"]], t)[:, :1]


def _damper(p, start, t):
    mu, e = p["mu"], p["e"]

    def f(t, u):
        return [u[2], u[3], p["F"] * np.cos(p["omega"] * t) - 2 * p["zeta"] * u[2] - u[0], 0.0]

    def hit(t, u):
        v, w = u[2], u[3]
        mean = (v + mu * w) / (1 + mu)
        return "", np.array([u[0], u[1], mean + mu * e * (w - v) / (1 + mu), mean - e * (w - v) / (1 + mu)])

    events = {"": [(lambda t, u: u[1] - u[0] - p["d"] / 2, 1, hit), (lambda t, u: u[1] - u[0] + p["d"] / 2, -1, hit)]}
    return march({"": f}, events, "", [start[k] for k in ("x", "y", "v_x", "v_y")], t)[:, :1]


def _valve(p, start, t):
    def f(t, u):
        return [u[1], -p["k"] * u[1] - u[0] - p["delta"] + u[2], p["beta"] * (p["q"] - u[0] * np.sqrt(u[2]))]

    hit = (lambda t, u: u[0], -1, lambda t, u: ("", np.array([0.0, -p["r"] * u[1], u[2]])))
    return march({"": f}, {"": [hit]}, "", [start["y1"], start["y2"], start["y3"]], t)[:, 2:]


def _chua(p, start, t):
    def field(side):
        def f(t, u):
            h = p["b"] * u[0] + (p["a"] - p["b"]) * side if side else p["a"] * u[0]
            return [p["alpha"] * (u[1] - h), u[0] - u[1] + u[2], -p["beta"] * u[1]]

        return f

    def go(mode):
        return lambda t, u: (mode, u)

    events = {
        0: [(lambda t, u: u[0] - 1, 1, go(1)), (lambda t, u: u[0] + 1, -1, go(-1))],
        1: [(lambda t, u: u[0] - 1, -1, go(0))],
        -1: [(lambda t, u: u[0] + 1, 1, go(0))],
    }
    return march({s: field(s) for s in (-1, 0, 1)}, events, 0, [start["x"], start["y"], start["z"]], t)[:, :1]


def _friction(p, start, t):
    def others(t, u):
        return p["f_0"] * np.cos(p["omega"] * t) - u[0] - 2 * p["zeta"] * u[1]

    fields = {
        1: lambda t, u: [u[1], others(t, u) - p["f_k"]],
        -1: lambda t, u: [u[1], others(t, u) + p["f_k"]],
        0: lambda t, u: [0.0, 0.0],
    }

    def stop(t, u):
        u = np.array([u[0], 0.0])
        rest = others(t, u)
        return (0 if abs(rest) <= p["f_s"] else 1 if rest > 0 else -1), u

    events = {
        1: [(lambda t, u: u[1], -1, stop)],
        -1: [(lambda t, u: u[1], 1, stop)],
        0: [
            (lambda t, u: others(t, u) - p["f_s"], 1, lambda t, u: (1, np.array([u[0], 1e-14]))),
            (lambda t, u: others(t, u) + p["f_s"], -1, lambda t, u: (-1, np.array([u[0], -1e-14]))),
        ],
    }
    return march(fields, events, 1, [start["x"], start["v"]], t)[:, :1]


def _bilinear(p, start, t):
    def field(side):
        def f(t, u):
            outer = p["beta"] * (u[0] - side * p["g"]) if side else 0.0
            return [u[1], p["A"] * p["omega"] ** 2 * np.cos(p["omega"] * t) - 2 * p["zeta"] * u[1] - u[0] - outer]

        return f

    def go(mode):
        return lambda t, u: (mode, u)

    events = {
        0: [(lambda t, u: u[0] - p["g"], 1, go(1)), (lambda t, u: u[0] + p["g"], -1, go(-1))],
        1: [(lambda t, u: u[0] - p["g"], -1, go(0))],
        -1: [(lambda t, u: u[0] + p["g"], 1, go(0))],
    }
    return march({s: field(s) for s in (-1, 0, 1)}, events, 0, [start["x"], start["v_x"]], t)[:, :1]


def _relay(p, start, t):
    xi, w, s = p["xi"], p["omega"], p["sigma"]

    def field(r):
        def f(t, u):
            return [
                -(2 * xi * w + 1) * u[0] + u[1] + r,
                -(2 * xi * w + w**2) * u[0] + u[2] - 2 * s * r,
                -(w**2) * u[0] + r,
            ]

        return f

    def meet(t, u):  # the relay slides where both fields lead to the surface: |x2| < 1
        if abs(u[1]) < 1.0:
            return 0, np.array([0.0, u[1], u[2]])
        return (-1 if u[1] > 0 else 1), np.array([0.0, u[1], u[2]])

    def slide(t, u):  # x1 = 0 keeps r = -x2
        return [0.0, u[2] + 2 * s * u[1], -u[1]]

    events = {
        1: [(lambda t, u: u[0], 1, meet)],
        -1: [(lambda t, u: u[0], -1, meet)],
        0: [
            (lambda t, u: u[1] - 1, 1, lambda t, u: (-1, np.array([1e-14, u[1], u[2]]))),
            (lambda t, u: u[1] + 1, -1, lambda t, u: (1, np.array([-1e-14, u[1], u[2]]))),
        ],
    }
    return march(
        {1: field(1), -1: field(-1), 0: slide},
        events,
        -1 if start["x1"] > 0 else 1,
        [start[k] for k in ("x1", "x2", "x3")],
        t,
    )[:, :1]


CASES = {
    case.name: case
    for case in (
        Case(
            "Duffing with a stop",
            duffing,
            {"a": 1.0, "b": 0.5, "c": 0.15, "F": 1.0, "w": 0.9, "g": 0.8, "e": 0.7},
            ["a", "b", "c", "g", "e"],
            _duffing,
            _xv,
            {"x": "position"},
            80.0,
        ),
        Case(
            "impact oscillator",
            ns.models.impact_oscillator,
            {"k": 1.0, "c": 0.1, "omega": 1.3, "d": 0.6, "e": 0.6, "A": 1.0},
            ["k", "c", "d", "e"],
            lambda p, start, t: _impact(p, start, t)[:, :1],
            _xv,
            {"x": "position"},
            70.0,
        ),
        Case(
            "impact oscillator, speed",
            ns.models.impact_oscillator,
            {"k": 1.0, "c": 0.1, "omega": 1.3, "d": 0.6, "e": 0.6, "A": 1.0},
            ["k", "c", "d", "e"],
            lambda p, start, t: _impact(p, start, t)[:, 1:],
            _xv,
            {"v": "speed"},
            70.0,
        ),
        Case(
            "cell that fires",
            cell,
            {"I": 2.0, "tau": 1.0, "rest": 0.1},
            ["I", "tau", "rest"],
            _cell,
            lambda rng: {"v": 0.8 * rng.random()},
            {"v": "potential"},
            12.0,
        ),
        Case(
            "stick-slip belt",
            ns.models.stick_slip_belt,
            {"F": 1.0, "delta": 3.0, "v_b": 0.2},
            ["F", "delta", "v_b"],
            _belt,
            lambda rng: {"x": 0.5 + 0.1 * rng.random(), "v": 0.1 - 0.1 * rng.random()},
            {"x": "position"},
            60.0,
        ),
        Case(
            "gear pair",
            ns.models.gear_pair,
            {"zeta": 0.05, "F_m": 0.1, "F_a": 0.4, "b": 1.0, "omega": 0.7},
            ["zeta", "F_m", "F_a", "b"],
            _gears,
            lambda rng: {"q": 1.1 + 0.05 * rng.standard_normal(), "v_q": 0.1 * rng.standard_normal()},
            {"q": "transmission error"},
            90.0,
        ),
        Case(
            "impact damper",
            ns.models.impact_damper,
            {"zeta": 0.02, "mu": 0.15, "e": 0.75, "d": 1.0, "F": 0.1, "omega": 1.0},
            ["zeta", "mu", "e", "F"],
            _damper,
            lambda rng: {
                "x": 0.1 * rng.standard_normal(),
                "y": 0.1 * rng.standard_normal(),
                "v_x": 0.1 * rng.standard_normal(),
                "v_y": 0.3 + 0.1 * rng.random(),
            },
            {"x": "position"},
            60.0,
            noise=0.003,
            resolution=0.003,
        ),
        Case(
            "relief valve",
            ns.models.relief_valve,
            {"k": 1.25, "delta": 10.0, "beta": 20.0, "r": 0.8, "q": 5.0},
            ["k", "delta", "beta", "r", "q"],
            _valve,
            lambda rng: {"y1": 1.0 + 0.5 * rng.random(), "y2": 0.0, "y3": 10.0 + rng.random()},
            {"y3": "pressure"},
            25.0,
        ),
        Case(
            "Chua's circuit",
            ns.models.chua_circuit,
            {"alpha": 9.0, "beta": 100 / 7, "a": -1 / 7, "b": 2 / 7},
            ["alpha", "beta", "a", "b"],
            _chua,
            lambda rng: {
                "x": 0.1 + 0.5 * rng.random(),
                "y": 0.05 * rng.standard_normal(),
                "z": 0.1 * rng.standard_normal(),
            },
            {"x": "voltage"},
            40.0,
        ),
        Case(
            "dry friction",
            ns.models.dry_friction_oscillator,
            {"f_0": 1.0, "omega": 0.4, "f_k": 0.4, "f_s": 0.5, "zeta": 0.05, "v_b": 0.0},
            ["f_0", "f_k", "f_s", "zeta"],
            _friction,
            lambda rng: {"x": 0.2 * rng.standard_normal(), "v": 0.3 + 0.2 * rng.random()},
            {"x": "position"},
            110.0,
        ),
        Case(
            "bilinear oscillator",
            ns.models.bilinear_oscillator,
            {"zeta": 0.05, "beta": 10.0, "g": 1.0, "A": 2.0, "omega": 0.7},
            ["zeta", "beta", "g", "A"],
            _bilinear,
            lambda rng: {"x": 0.3 * rng.standard_normal(), "v_x": 0.3 * rng.standard_normal()},
            {"x": "position"},
            60.0,
        ),
        Case(
            "relay feedback",
            ns.models.relay_feedback,
            {"xi": 0.05, "omega": 6.0, "sigma": 1.0},
            ["xi", "omega", "sigma"],
            _relay,
            lambda rng: {
                "x1": 0.2 + 0.1 * rng.random(),
                "x2": 0.1 * rng.standard_normal(),
                "x3": 0.1 * rng.standard_normal(),
            },
            {"x1": "level"},
            20.0,
        ),
    )
}
