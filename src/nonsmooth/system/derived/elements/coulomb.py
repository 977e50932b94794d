"""Dry friction with sticking: by a normal force that is given, or under the force of a rigid stop."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.derived.elements.element import CREEP, SMALL, Condition, Element, Law, Leaving

if TYPE_CHECKING:
    from nonsmooth.system.derived.elements.element import Place


@dataclass(frozen=True, kw_only=True)
class Friction(Element):
    """The ground of all friction: it holds a relative speed at zero, or slips one way or the other."""

    speed: Callable[..., Any] | None = None
    belt: Law = 0.0
    friction: Law = 0.0

    kinematics = "speed"
    held = ("stick",)
    sides = ("forward", "back")

    def placed(self, q: Any, v: Any, law: Callable[[Law], Any]) -> Any:
        return v - law(self.belt)

    def rate(self, here: Place) -> Any:
        return here.where

    def pull(self, here: Place) -> Any:
        return -here.where

    def lies(self, where: float, rate: float, slow: float) -> int:
        return int(np.sign(rate))

    def meeting(self, here: Place) -> list[list[Condition]]:
        return [[Condition(here.where, -here.side, "speed")]]


@dataclass(frozen=True, kw_only=True)
class Coulomb(Friction):
    r"""Dry friction with sticking: F = -f(v) sgn v while it slips, what holds v = 0 while it sticks.

    It sticks as long as the force that holds it stays below ``static``; Stribeck curves are functions ``friction(v)``
    of the speed's magnitude.

    Parameters
    ----------
    speed : callable
        Relative speed ``v(t, u, p)``; a positive force drives it up. With ``at=`` the coordinate's own, less ``belt``.
    belt : number, name of a parameter, or function
        Speed of what the coordinate slides on (``at=`` only).
    friction : number, name of a parameter, or function
        The friction force while slipping, positive: a number, a parameter, ``f(t, u, p)``, or ``f(v, p)`` of the
        magnitude of the speed. With ``normal``: the coefficient of friction.
    static : number, name of a parameter, or function, optional
        The largest force (coefficient) that holds; ``friction`` at v = 0 where not given.
    normal : number, name of a parameter or of an elastic element, or function, optional
        The normal force; the name of an :class:`ElasticStop` stands for its contact force.
    at, on
        See :class:`Element`.
    """

    static: Law | None = None
    normal: Law | None = None

    phases = ("stick", "forward", "back")
    laws = ("friction", "static", "normal")
    conditions = (
        "speed",
        "speed_above",
        "speed_below",
        "over",
        "under",
        "turned_forward",
        "turned_back",
    )

    def needs(self, others: Collection[str]) -> list[tuple[str, int | None]]:
        sides = (1, -1, 0) if self.static is None else (1, -1)
        own = [("static", None)] if self.static is not None else []
        pressed = [("normal", None)] if self.normal is not None and self.normal not in others else []
        return [*(("friction", side) for side in sides), *own, *pressed]

    def limits(self, here: Place) -> list[tuple[Any, str]]:
        kinetic, name = here.law("friction", 0), f"element {here.name!r}"
        rows = [(kinetic, f"the friction of {name} must not be negative")]
        stop = here.named(self.normal)
        if self.normal is not None and stop is None:
            rows.append((here.law("normal"), f"the normal force of {name} must not be negative"))
        if stop is not None and getattr(stop.element, "pulls", False):
            way = "which is no normal force; leave pulls out"
            rows.append((-stop.law("damping"), f"{name}: the damper of {self.normal!r} pulls (pulls=True), {way}"))
        if self.static is not None:
            static = here.law("static")
            less = f"the static friction of {name} must not be less than its kinetic friction (it is no ratio of both)"
            rows.append((static - kinetic, less))
        return rows

    def force(self, here: Place) -> Any:
        side = here.side
        return -side * here.law("friction", side) * self.pressure(here)

    def pressure(self, here: Place) -> Any:
        """The normal force; 1 where ``friction`` is a force itself."""
        if self.normal is None:
            return 1
        other = here.named(self.normal)
        if other is None:
            return here.law("normal")
        if not other.element.presses:
            raise SystemDefinitionError(
                f"element {here.name!r}: normal={self.normal!r} must name an ElasticStop; with the force of a rigid "
                "contact, which friction changes in turn, a motion need not exist or be unique (Painleve); that is "
                "Stop(friction=..., tangent=...)"
            )
        return other.element.force(other)

    def most(self, here: Place) -> Any:
        """The greatest force that holds."""
        static = here.law("friction", 0) if self.static is None else here.law("static")
        return static * self.pressure(here)

    def leaving(self, here: Place) -> list[Leaving]:
        v, hold, most = here.where, here.put("stick").holding(), self.most(here)
        torn_back, torn_forward = Condition(hold - most, 1, "over"), Condition(hold + most, -1, "under")
        if here.phase == "stick":
            off = SMALL * here.size(v)
            begins = (
                [
                    Leaving("forward", [Condition(v - off, 1, "speed_above")]),
                    Leaving("back", [Condition(v + off, -1, "speed_below")]),
                ]
                if here.begins_alone()
                else []
            )
            return [*begins, Leaving("back", [torn_back]), Leaving("forward", [torn_forward])]
        other, sign = ("back", -1) if here.side > 0 else ("forward", 1)
        stopped = Condition(v, sign, "speed")
        if here.vanishes(most):
            return [Leaving(other, [stopped])]  # an open contact, which bears no friction
        passes = [torn_back, torn_forward]
        if here.is_turned():
            # An impact or an input turns the speed round at once, and no finite force can stop it then.
            passes.append(Condition(v - sign * CREEP * here.size(v), sign, f"turned_{here.phase}"))
        # What does not pass is held: within the bounds, or by a load as large as the friction, to all orders.
        return [*(Leaving(other, [stopped, one]) for one in passes), Leaving("stick", [stopped], here.struck(0))]
