"""``Holding``: how a controller holds a motion, and how long it is measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Range, above, at_least, real_number


@checked
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

    mass: Annotated[float, above(0)] | None = None
    gains: Annotated[tuple[float, float], "give (K_p, K_d), two numbers"] | None = None
    greatest_force: Annotated[float, above(0)] | None = None
    greatest_position: Annotated[float, above(0)] | Range | None = None
    harmonics: Annotated[int, at_least(1)] | None = None
    transient: Annotated[int, at_least(0)] = 50
    settle: Annotated[int, at_least(1)] = 5
    record: Annotated[int, at_least(3)] = 10
    release: Annotated[int, at_least(0)] = 12
    tolerance: Annotated[float, above(0)] = 1e-3

    def __post_init__(self) -> None:
        if self.gains is not None and self.gains[1] <= 0:
            raise ValueError(f"K_d = {self.gains[1]:g}: without damping the controller holds nothing; give more than 0")

    @property
    def positions(self) -> tuple[float, float]:
        """Least and greatest reading."""
        far = math.inf if self.greatest_position is None else self.greatest_position
        return far if isinstance(far, tuple) else (-far, far)

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
