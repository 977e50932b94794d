"""Systems whose first mode no state tells, with data from SciPy's DOP853 between events (``fit_cases.march``)."""

import numpy as np
from tests.identification.fit_cases import march

import nonsmooth as ns

RELAY = {"k": 1.0, "c": 0.3, "F": 1.0, "h": 0.5}
DAMPER = {"k": 1.0, "c": 0.05, "A": 0.5, "w": 0.8, "f": 0.15, "g": 0.2}


def relay():
    """A relay with hysteresis drives an oscillator: down above h, up below -h."""

    def field(sign):
        return lambda t, u, p: (u.v, sign * p.F - p.c * u.v - p.k * u.x)

    return ns.System(
        name="relay with hysteresis",
        states=["x", "v"],
        parameters=RELAY,
        modes={"up": field(1), "down": field(-1)},
        indicators={"upper": lambda t, u, p: u.x - p.h, "lower": lambda t, u, p: u.x + p.h},
        transitions=[ns.Transition("up", "down", when="upper > 0"), ns.Transition("down", "up", when="lower < 0")],
    )


def relay_record(p, x, v, mode, t):
    def field(sign):
        return lambda t, u: [u[1], sign * p["F"] - p["c"] * u[1] - p["k"] * u[0]]

    events = {
        "up": [(lambda t, u: u[0] - p["h"], 1, lambda t, u: ("down", u))],
        "down": [(lambda t, u: u[0] + p["h"], -1, lambda t, u: ("up", u))],
    }
    return march({"up": field(1), "down": field(-1)}, events, mode, [x, v], t)[:, 0]


def damper():
    """A mass with a friction damper that follows it only behind a play of g on either side."""

    def field(sign):
        return lambda t, u, p: (u.v, p.A * np.cos(p.w * t) - p.c * u.v - p.k * u.x - sign * p.f, abs(sign) * u.v)

    return ns.System(
        name="friction damper with play",
        states=["x", "v", "y"],
        parameters=DAMPER,
        modes={"apart": field(0), "right": field(1), "left": field(-1)},
        indicators={
            "ahead": lambda t, u, p: u.x - u.y - p.g,
            "behind": lambda t, u, p: u.x - u.y + p.g,
            "speed": lambda t, u, p: u.v,
        },
        transitions=[
            ns.Transition("apart", "right", when="ahead > 0 and speed > 0"),
            ns.Transition("apart", "left", when="behind < 0 and speed < 0"),
            ns.Transition("right", "apart", when="speed < 0"),
            ns.Transition("left", "apart", when="speed > 0"),
        ],
        period=lambda p: 2 * np.pi / p.w,
    )


def damper_record(p, x, v, y, mode, t):
    def field(sign):
        return lambda t, u: [
            u[1],
            p["A"] * np.cos(p["w"] * t) - p["c"] * u[1] - p["k"] * u[0] - sign * p["f"],
            abs(sign) * u[1],
        ]

    events = {
        "apart": [
            (lambda t, u: u[0] - u[2] - p["g"], 1, lambda t, u: ("right", u)),
            (lambda t, u: u[0] - u[2] + p["g"], -1, lambda t, u: ("left", u)),
        ],
        "right": [(lambda t, u: u[1], -1, lambda t, u: ("apart", u))],
        "left": [(lambda t, u: u[1], 1, lambda t, u: ("apart", u))],
    }
    return march({"apart": field(0), "right": field(1), "left": field(-1)}, events, mode, [x, v, y], t)[:, 0]
