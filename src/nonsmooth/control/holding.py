"""``Holding``: how a controller holds a motion, and how long it is measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from nonsmooth.errors import shortened
from nonsmooth.flow.arguments import real_number, whole_number

__all__ = ["Holding"]

#: Turns of the drive, with the fewest that make sense.
TURNS = {"transient": 0, "settle": 1, "record": 3, "release": 0}


@dataclass(frozen=True, kw_only=True)
class Holding:
    r"""Gains of the controller, and the turns of the drive that each measurement takes.

    Parameters
    ----------
    mass : float, optional
        The moving mass, from which the gains follow; where not given, the rig's attribute ``mass``.
    gains : (K_p, K_d), optional
        In place of the rule :math:`K_p = 0`, :math:`K_d = m \omega`.
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
        positive = {"tolerance": self.tolerance} | ({} if self.mass is None else {"mass": self.mass})
        for name, value in positive.items():
            if real_number(value, name) <= 0:
                raise ValueError(f"{name} = {value!r} must be positive")
        checked["gains"] = _gains(self.gains)
        for name, value in checked.items():
            object.__setattr__(self, name, value)

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
