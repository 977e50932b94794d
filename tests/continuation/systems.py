"""Test problems of the literature that the package has no model of."""

from __future__ import annotations

from typing import Any

import numpy as np

import nonsmooth as ns


def bang_bang_duffing() -> ns.System:
    """Dankowicz & Schilder, Ex. 17.3: x'' = +-A - 0.2 x' - x - x^3, minus in the first half of each period."""

    def up(t: Any, u: Any, p: Any) -> Any:
        x, v = u
        return v, p.A - 0.2 * v - x - x**3

    def down(t: Any, u: Any, p: Any) -> Any:
        x, v = u
        return v, -p.A - 0.2 * v - x - x**3

    return ns.System(
        name="bang-bang Duffing",
        states=["x", "v"],
        parameters={"A": 26.0, "omega": 1.0},
        modes={"down": down, "up": up},
        transitions=[ns.Transition("down", "up", at=0.5), ns.Transition("up", "down", at=0.0)],
        period=lambda p: 2 * np.pi / p.omega,
        symmetry=(lambda u: (-u.x, -u.v), 0.5, {"down": "up", "up": "down"}),
    )


def stick_slip_with_impact() -> ns.System:
    """Dankowicz & Schilder, Ex. 9.3-9.4: the slider's speed s exists while it slips only."""

    def force(t: Any, x: Any, v: Any, p: Any) -> Any:
        return p.V**2 * np.sin(p.omega * t) ** 2 / (1 - x) ** 2 - p.c * v - x

    def stick(t: Any, u: Any, p: Any) -> Any:
        x, v = u
        return v, force(t, x, v, p)

    def slip(t: Any, u: Any, p: Any) -> Any:
        _, x, v = u
        f = force(t, x, v, p)
        return -p.n - f / 5, v, p.n + 6 * f / 5

    return ns.System(
        name="stick-slip with impact",
        states=["s", "x", "v"],
        parameters={"V": 0.5, "c": 0.04, "omega": 0.92, "e": 0.8, "n": 3.17},
        modes={"stick": ns.Mode(stick, states=["x", "v"]), "slip": slip},
        indicators={"wall": lambda t, u, p: u.x - 0.5, "slider": lambda t, u, p: u.s},
        transitions=[
            ns.Transition(
                "stick", "slip", when="wall > 0", reset=lambda t, u, p: ((1 + p.e) / 6 * u.v, u.x, -p.e * u.v)
            ),
            ns.Transition("slip", "stick", when="slider < 0"),
        ],
        period=lambda p: np.pi / p.omega,
    )


def planar() -> ns.System:
    """Dankowicz & Schilder, Ex. 9.2, in Cartesian coordinates."""

    def field(x: Any, y: Any, growth: Any, turning: Any) -> Any:
        return growth * x - turning * y, growth * y + turning * x

    def left(t: Any, u: Any, p: Any) -> Any:
        x, y = u
        r = np.sqrt(x * x + y * y)
        return field(x, y, 1 - r, 1.0)

    def right(t: Any, u: Any, p: Any) -> Any:
        x, y = u
        r = np.sqrt(x * x + y * y)
        return field(x, y, p.alpha * (p.beta - r), p.gamma + p.beta - r)

    return ns.System(
        name="planar",
        states=["x", "y"],
        parameters={"alpha": 1.0, "beta": 2.0, "gamma": 1.5},
        modes={"right": right, "left": left},
        indicators={"side": lambda t, u, p: u.x},
        transitions=[
            ns.Transition("right", "left", when="side < 0"),
            ns.Transition("left", "right", when="side > 0"),
        ],
    )


def belt() -> ns.System:
    """Leine 1998: stick-slip on a belt; entering stick sets v to the belt's speed."""

    def stick(t: Any, u: Any, p: Any) -> Any:
        return p.v_b, 0.0 * u.v

    def slip(t: Any, u: Any, p: Any) -> Any:
        return u.v, -u.x + p.F / (1 + p.delta * (p.v_b - u.v))

    return ns.System(
        name="belt",
        states=["x", "v"],
        parameters={"v_b": 0.2, "F": 1.0, "delta": 3.0},
        modes={"stick": stick, "slip": slip},
        indicators={"pull": lambda t, u, p: u.x - p.F, "relative": lambda t, u, p: u.v - p.v_b},
        transitions=[
            ns.Transition("stick", "slip", when="pull > 0"),
            ns.Transition("slip", "stick", when="relative > 0", reset=lambda t, u, p: (u.x, p.v_b)),
        ],
    )
