r"""The equations of the rig, more than the model that is to be identified from its recordings; runs at given times.

Car between two springs on strings, one of them driven by a crank; a support with its own coordinate y.

.. math::

    m \dot v = s\,(T_d - T_f) - c v - F + f, \quad
    T_d = T_0 + k (d(\varphi) - s x), \quad T_f = T_0 + k s x, \quad F = F_C \tanh(v / v_s)

    d(\varphi) = a \cos\varphi + L - \sqrt{L^2 - a^2 \sin^2\varphi}, \quad
    \varphi = \theta + \epsilon \sin(\theta + \beta), \quad
    \theta = \omega t + \sum_j a_j \sin(\nu_j t + \beta_j)

The motor is on the support's side (s = 1) or on the other (s = -1); the slow terms of :math:`\theta` are those of a
motor that wanders. Friction lets the car creep to where the springs balance, at about v_s; on request it holds: v_s is
then 0.1 µm/s, and a car that stops stays, within F_C/2k of that place, for as long as anything is recorded.

A string cannot push: a tension that would be negative is zero. In contact :math:`y = x - g` and
:math:`f = -(k_s y + c_s v)`; contact ends where f vanishes, and then :math:`k_s y + c_s \dot y = 0`. The driven end
moves by d, so that to first order :math:`\rho = k a`, and its mean :math:`a^2 / (4 L)` moves the car's mean position
by :math:`s a^2 / (8 L)`.

The same functions serve symbols (the ``System``) and numbers (the hand that pulls, the force sensor).
"""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth import Mode, System, Transition, mechanical, simulate
from nonsmooth.arrays import FloatArray
from nonsmooth_savi2007.rig.truth import UNITS, published

NO_SUPPORT = 10.0  # m: a gap that the car never closes
AT_REST = 1e-9  # m: a relaxing support that is nearer to its rest than this is there
WANDERING = 3  # slow terms of a motor that wanders

#: What of the truth the equations of the car hold.
OF_THE_CAR = ("m", "k", "k_s", "c", "c_s", "g", "friction", "creep_velocity", "pretension", "ripple", "ripple_phase")


def crank_angle(t: Any, p: Any, wanders: bool = False) -> Any:
    """The crank's angle: even turning, the slow terms of a motor that wanders, a ripple that repeats with each turn."""
    turned = p.omega * t
    for j in range(1, WANDERING + 1) if wanders else ():
        size, rate, phase = (getattr(p, f"wander_{word}{j}") for word in ("", "rate_", "phase_"))
        turned = turned + size * np.sin(rate * t + phase)
    return turned + p.ripple * np.sin(turned + p.ripple_phase)


def drive(t: Any, p: Any, crank_length: Any, wanders: bool = False) -> Any:
    """Displacement d of the driven end, with the string's curvature 1/L; exact also for 1/L = 0."""
    phi = crank_angle(t, p, wanders)
    square = (crank_length * np.sin(phi)) ** 2 * p.curvature
    return crank_length * np.cos(phi) + square / (1.0 + np.sqrt(1.0 - square * p.curvature))


def friction(v: Any, p: Any) -> Any:
    """Force of the magnetic damper and of dry friction against the velocity v."""
    return p.c * v + p.friction * np.tanh(v / p.creep_velocity)


def driven_tension(t: Any, x: Any, p: Any, crank_length: Any, side: float = 1.0, wanders: bool = False) -> Any:
    """Tension of the string at the driven spring; below zero it would have to push."""
    return p.pretension + p.k * (drive(t, p, crank_length, wanders) - side * x)


def fixed_tension(x: Any, p: Any, side: float = 1.0) -> Any:
    """Tension of the string at the spring whose other end is fixed."""
    return p.pretension + p.k * side * x


def support_force(x: Any, v: Any, p: Any) -> Any:
    """Force of the support on the car in contact."""
    return -(p.k_s * (x - p.g) + p.c_s * v)


@cache
def hanging_mass() -> System:
    """The support's spring with the test mass on it, about its equilibrium: M y'' + c_s y' + k_s y = 0."""
    known = {name: (published()[name], UNITS[name]) for name in ("k_s", "c_s", "test_mass")}
    return mechanical(
        "test_mass", "c_s", "k_s", coordinates={"x": "m"}, parameters=known, name="support with test mass"
    )


@cache
def car(*, relaxing: bool = True, rising: bool = False, wanders: bool = False, side: int = 1) -> System:
    """The car with its springs, strings and support.

    Parameters
    ----------
    relaxing : bool
        Whether the support takes time to come back to rest (mode ``relaxing`` with the state ``y``), or is there
        at once.
    rising : bool
        Whether the length of the crank grows at ``crank_rate`` (state ``a`` in place of the parameter
        ``crank_length``), for quasi-static rises of the forcing.
    wanders : bool
        Whether the motor wanders: further parameters, and no forcing period.
    side : {1, -1}
        Side of the motor: that of the support, or the other.

    Returns
    -------
    System
        Modes ``free``, ``slack_driven`` and ``slack_fixed`` (a string without tension), ``contact`` and
        ``relaxing``. It has no outputs, which would cost every run more than its integration; the forces are
        functions of this file.
    """

    def driven(t: Any, u: Any, p: Any) -> Any:
        return driven_tension(t, u.x, p, u.a if rising else p.crank_length, side, wanders)

    def fixed(t: Any, u: Any, p: Any) -> Any:
        return fixed_tension(u.x, p, side)

    def from_support(t: Any, u: Any, p: Any) -> Any:
        return support_force(u.x, u.v, p)

    def field(*forces: Any, beside: Any = None) -> Any:
        """The car under its friction and these forces; ``beside`` is the rate of a further state."""

        def rates(t: Any, u: Any, p: Any) -> Any:
            rate = (u.v, (sum(sign * force(t, u, p) for sign, force in forces) - friction(u.v, p)) / p.m)
            rate += () if beside is None else (beside(u, p),)
            return (*rate, p.crank_rate) if rising else rate

        return rates

    def relaxation(u: Any, p: Any) -> Any:
        return -p.k_s / p.c_s * u.y

    on_car = ["x", "v", "a"] if rising else ["x", "v"]
    both, support = ((side, driven), (-side, fixed)), (1, from_support)
    modes = {
        "free": Mode(field(*both), states=on_car),
        "contact": Mode(field(*both, support), states=on_car),
        "slack_driven": Mode(field((-side, fixed)), states=on_car),
        "slack_fixed": Mode(field((side, driven)), states=on_car),
    }
    indicators = {
        "penetration": lambda t, u, p: u.x - p.g,
        "separation": lambda t, u, p: -(u.x - p.g) - p.c_s / p.k_s * u.v,
        "pull_driven": driven,
        "pull_fixed": fixed,
    }
    transitions = [
        Transition("free", "contact", when="penetration > 0 and separation < 0"),
        Transition("free", "slack_driven", when="pull_driven < 0"),
        Transition("slack_driven", "free", when="pull_driven > 0"),
        Transition("free", "slack_fixed", when="pull_fixed < 0"),
        Transition("slack_fixed", "free", when="pull_fixed > 0"),
    ]
    if relaxing:

        def released(t: Any, u: Any, p: Any) -> Any:
            return (u.x, u.v, u.x - p.g, u.a) if rising else (u.x, u.v, u.x - p.g)

        modes["relaxing"] = Mode(field(*both, beside=relaxation), states=["x", "v", "y", *on_car[2:]])
        indicators["reach"] = lambda t, u, p: u.x - p.g - u.y
        indicators["unrest"] = lambda t, u, p: u.y - AT_REST
        transitions += [
            Transition("contact", "relaxing", when="separation > 0", reset=released),
            Transition("relaxing", "contact", when="reach > 0 and separation < 0"),
            Transition("relaxing", "free", when="unrest < 0"),
        ]
    else:
        transitions.append(Transition("contact", "free", when="separation > 0"))
    parameters = {name: (published()[name], UNITS[name]) for name in OF_THE_CAR}
    parameters |= {"curvature": (1.0, "1/m"), "omega": (4.5, "rad/s")}
    parameters |= {"crank_rate": (0.0, "m/s")} if rising else {"crank_length": (0.0165, "m")}
    for j in range(1, WANDERING + 1) if wanders else ():
        parameters |= {f"wander_{j}": (0.0, "rad"), f"wander_phase_{j}": (0.0, "rad")}
        parameters |= {f"wander_rate_{j}": (1.0, "rad/s")}
    states = {"x": "m", "v": "m/s"} | ({"y": "m"} if relaxing else {}) | ({"a": "m"} if rising else {})
    return System(
        name="virtual rig",
        states=states,
        parameters=parameters,
        modes=modes,
        indicators=indicators,
        transitions=transitions,
        scale={name: {"x": 1e-3, "v": 1e-2, "y": 1e-5, "a": 1e-2}[name] for name in states},
        period=None if wanders else lambda p: 2 * np.pi / p.omega,
    )


#: The paper's method. Over 40 periods with 121 crossings of a rig with friction it differs from the Taylor series at
#: rtol 1e-12 by 2e-10 m/s, far below what a sensor tells.
METHOD: dict[str, Any] = {"method": "rkf45", "rtol": 1e-9}


def simulated(
    system: System,
    run: str,
    *,
    instants: FloatArray,
    turns: tuple[int, int] | None = None,
    side: float = 1.0,
    **options: Any,
) -> tuple[FloatArray, xr.Dataset]:
    """Position and velocity at the instants, (2, n), and the whole result of ``simulate``.

    ``turns`` of the crank that pass before and that are recorded, in place of a duration: the last sample is then at
    their end, a start for the run that follows.

    Raises
    ------
    ValueError
        If a string would have to push while the car touches the support: the rig's equations have no mode for it.
    SolveError
        If the run could not be completed.
    """

    with_strings = "pretension" in system.parameters
    samples = instants
    if turns is not None:
        period = 2 * np.pi / system.values["omega"]
        before, recorded = (n * period for n in turns)
        samples = np.append(instants, before + recorded)
        options |= (
            {"transient": before, "duration": recorded}  # a wandering motor leaves no period
            if system.period() is None
            else {"transient": turns[0], "periods": turns[1]}
        )
    result = simulate(system, samples=samples, **options, **(METHOD if with_strings else {}))
    if with_strings:
        _check_strings(system, run, result, side)
    # Crossings stand twice in the result's time; each instant that was asked for is there exactly.
    u = result["u"].values[np.searchsorted(result["time"].values, instants)]
    return np.ascontiguousarray(u[:, :2].T), result


def _check_strings(system: System, run: str, result: xr.Dataset, side: float) -> None:
    """Slack strings are modes of the car away from the support only."""
    p = SimpleNamespace(**system.values)
    u = {str(name): result["u"].sel(state=name).values for name in system.states}
    at_support = u["x"] > p.g
    if not at_support.any():
        return
    length = p.crank_length if "crank_length" in system.parameters else u["a"]
    tensions = {
        "driven": driven_tension(result["time"].values, u["x"], p, length, side, hasattr(p, "wander_1")),
        "fixed": fixed_tension(u["x"], p, side),
    }
    for which, tension in tensions.items():
        if tension[at_support].min() < 0:
            raise ValueError(
                f"{run}: the string of the {which} spring would have to push while the car is at the support; "
                "use less forcing or more pretension"
            )
