"""``Holding``: how a controller holds a motion, and how long it is measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from nonsmooth.errors import shortened
from nonsmooth.flow.arguments import real_number, whole_number

__all__ = ["Holding"]

#: Turns of the drive, with the fewest that make sense.
TURNS = {"transient": 0, "settle": 1, "record": 3, "release": 0}


@dataclass(frozen=True, kw_only=True)
class Holding:
    r"""Gains and limits of the controller, and the turns of the drive that each measurement takes.

    Every reading and every force is checked. Where one is beyond its limit, no finite number, or the same for a whole
    turn of the drive, and where the rig raises an exception, the force is set to zero before the next reading and the
    points measured until then are the result.

    Parameters
    ----------
    mass : float, optional
        The moving mass, from which the gains follow; where not given, the rig's attribute ``mass``.
    gains : (K_p, K_d), optional
        In place of the rule :math:`K_p = 0`, :math:`K_d = m \omega`.
    greatest_force : float, optional
        Of the actuator: a larger one is never commanded. Where not given, three times the force with which the
        controller answers to a displacement of the motion's own size.
    greatest_position : float or (low, high), optional
        Range of the readings: up to this distance from 0, or from low to high. No limit where not given.
    harmonics : int, optional
        Of the reference; 20 where not given, fewer where the rig is read fewer than 50 times per turn.
    transient : int
        Turns of the drive before the first measurement.
    settle, record : int
        Turns of the drive to wait and to record in each measurement.
    release : int
        Turns of the drive for which each motion found is let go, to see whether it is stable; 0: that is not done.
    tolerance : float
        Largest control force at convergence, over that which would move the reference by the size of the motion; the
        force may be larger where its noise is.

    Raises
    ------
    ValueError, TypeError
        Values that make no sense.
    """

    mass: float | None = None
    gains: tuple[float, float] | None = None
    greatest_force: float | None = None
    greatest_position: float | tuple[float, float] | None = None
    harmonics: int | None = None
    transient: int = 50
    settle: int = 5
    record: int = 10
    release: int = 12
    tolerance: float = 1e-3

    def __post_init__(self) -> None:
        checked: dict[str, Any] = {name: whole_number(getattr(self, name), name, n) for name, n in TURNS.items()}
        if self.harmonics is not None:
            checked["harmonics"] = whole_number(self.harmonics, "harmonics", 1)
        optional = {"mass": self.mass, "greatest_force": self.greatest_force}
        positive = {"tolerance": self.tolerance} | {name: one for name, one in optional.items() if one is not None}
        for name, value in positive.items():
            if real_number(value, name) <= 0:
                raise ValueError(f"{name} = {value!r} must be positive")
        checked["gains"] = _gains(self.gains)
        checked["greatest_position"] = _range(self.greatest_position)
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def positions(self) -> tuple[float, float]:
        """Least and greatest reading."""
        return self.greatest_position or (-math.inf, math.inf)  # type: ignore[return-value]  # made a pair above

    def mass_of(self, rig: Any) -> float:
        """Mass from which the gains follow; 1 where they are given.

        Raises
        ------
        ValueError
            It is not known.
        """
        if self.gains is not None:
            return 1.0
        mass = getattr(rig, "mass", None) if self.mass is None else self.mass
        if mass is None:
            raise ValueError(
                "the gains follow from the moving mass: give holding=Holding(mass=...), roughly, or "
                "holding=Holding(gains=(K_p, K_d))"
            )
        if real_number(mass, "mass") <= 0:
            raise ValueError(f"mass = {mass!r} of the rig must be positive")
        return float(mass)


def _gains(given: Any) -> tuple[float, float] | None:
    if given is None:
        return None
    try:
        proportional, derivative = (real_number(one, "gains") for one in given)
    except (TypeError, ValueError):
        raise ValueError(f"gains = {shortened(given)}: give (K_p, K_d), two numbers") from None
    if derivative <= 0:
        raise ValueError(f"K_d = {derivative:g}: without damping the controller holds nothing; give more than 0")
    return proportional, derivative


def _range(given: Any) -> tuple[float, float] | None:
    if given is None:
        return None
    pair = given if isinstance(given, tuple | list) else (-given, given) if isinstance(given, int | float) else ()
    try:
        low, high = (real_number(one, "greatest_position") for one in pair)
    except (TypeError, ValueError):
        raise ValueError(f"greatest_position = {shortened(given)}: give a number, or (low, high)") from None
    if not low < high:
        raise ValueError(f"greatest_position = {shortened(given)}: give a number above 0, or (low, high), low < high")
    return low, high
