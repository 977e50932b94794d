"""The systems with which the series kernels are tried on a GPU, each with something the others lack."""

from __future__ import annotations

from typing import Any

import numpy as np

import nonsmooth as ns

TOP = ns.Poincare("lift_velocity", rising=False)
UNIT = 0.1  # of time, in which nothing may depend on its size
START = {"y1": 0.2, "y2": 0.0, "y3": 10.0}


def two_wells() -> ns.System:
    """Forced, with a steep layer (whose steps are checked), impacts that remember, an output with a corner."""

    def field(t: Any, u: Any, p: Any) -> Any:
        force = u.x - u.x**3 - p.c * u.v - p.mu * np.tanh(u.v / 0.05) + p.F * np.cos(p.w * t / UNIT)
        return u.v / UNIT, force / UNIT

    return ns.System(
        name="two wells",
        states=["x", "v"],
        parameters={"c": 0.3, "mu": 0.01, "F": 0.15, "w": 1.0, "g": 1.25, "r": 0.5},
        memory={"blow": 0.0},
        modes={"open": field},
        indicators={"stop": lambda t, u, p: u.x - p.g},
        transitions=[
            ns.Transition(
                "open",
                "open",
                when="stop > 0",
                write={"blow": lambda t, u, p: u.v},
                reset=lambda t, u, p: (u.x, -p.r * u.v * (1 - 0.1 * p.blow)),
            )
        ],
        outputs={"size": lambda t, u, p: abs(u.x), "square": lambda t, u, p: u.v**2},
    )


def grows_to_a_stop() -> ns.System:
    """Two states, linear, without forcing: oscillations grow until they meet a stop."""
    return ns.System(
        name="grows to a stop",
        states=["x", "v"],
        parameters={"c": 0.2, "r": 0.5},
        modes={"open": lambda t, u, p: (u.v, p.c * u.v - u.x)},
        indicators={"stop": lambda t, u, p: u.x - 1.0, "speed": lambda t, u, p: u.v},
        transitions=[ns.Transition("open", "open", when="stop > 0", reset=lambda t, u, p: (u.x, -p.r * u.v))],
    )


def filtered() -> ns.System:
    """Four states, linear in both modes: the exact flow by series."""

    def free(t: Any, u: Any, p: Any) -> Any:
        return u.v, p.F * np.cos(p.w * t) - u.x - 0.1 * u.v, u.v - u.z, u.z - 2 * u.y

    def contact(t: Any, u: Any, p: Any) -> Any:
        return u.v, free(t, u, p)[1] - p.k * (u.x - p.g), u.v - u.z, u.z - 2 * u.y

    return ns.System(
        name="filtered",
        states=["x", "v", "z", "y"],
        parameters={"F": 0.3, "w": 0.8, "k": 10.0, "g": 0.4},
        modes={"free": free, "contact": contact},
        indicators={"wall": lambda t, u, p: u.x - p.g},
        transitions=[
            ns.Transition("free", "contact", when="wall > 0"),
            ns.Transition("contact", "free", when="wall < 0"),
        ],
    )
