"""Friction at a rigid contact; what ``Stop(friction=...)`` brings along."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.system.derived.elements.element import Condition, Element, Law, Leaving

if TYPE_CHECKING:
    from nonsmooth.system.derived.place import Place

RUBS = "_friction"  # ends its name, behind that of the stop


@dataclass(frozen=True, kw_only=True)
class Rubbing(Element):
    """Coulomb's friction under the force of a rigid stop: |lambda_t| <= mu lambda_n, of which none is given.

    While the stop is closed and it slips, its force is -mu sgn v times that of the stop; while the stop is open it is
    free. What it does is always decided together with the stop (:mod:`nonsmooth.system.derived.deciding`)."""

    of: str = ""  # the stop
    speed: Callable[..., Any] | None = None
    belt: Law = 0.0
    friction: Law = 0.0

    kinematics = "speed"
    phases = ("free", "stick", "forward", "back")
    laws = ("friction",)
    conditions = ("speed", "over", "under")
    held = ("stick",)
    sides = ("forward", "back")

    def placed(self, q: Any, v: Any, law: Callable[[Law], Any]) -> Any:
        return v - law(self.belt)

    def needs(self, others: Collection[str]) -> list[tuple[str, int | None]]:
        return [("friction", None)]

    def rate(self, here: Place) -> Any:
        return here.where

    def pull(self, here: Place) -> Any:
        return -here.where

    def force(self, here: Place) -> Any:
        """None of its own: what it adds comes with the force of the stop."""
        return 0

    def most(self, here: Place) -> Any:
        """The coefficient of friction, which no force is measured by without that of the stop."""
        return here.law("friction")

    def lies(self, where: float, rate: float, slow: float) -> int:
        return int(np.sign(rate))

    def meeting(self, here: Place) -> list[list[Condition]]:
        if here.phase == "free":
            return []
        return [[Condition(here.where, -1 if here.phase == "forward" else 1, "speed")]]

    def leaving(self, here: Place) -> list[Leaving]:
        return here.make.asked(here.k, here.mode, here.pattern)

    def ranges(self, here: Place) -> list[tuple[Any, str]]:
        return [(here.law("friction"), f"the friction of element {here.name!r} must not be negative")]
