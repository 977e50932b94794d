"""Contacts with springs: elastic stops, backlash, preloaded springs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.derived.elements.element import SMALL, Condition, Contact, Element, Law, Leaving

if TYPE_CHECKING:
    from nonsmooth.system.derived.elements.element import Place


@dataclass(frozen=True, kw_only=True)
class ElasticStop(Contact):
    r"""A stop with a spring and a damper: F = -k \delta - c \dot\delta while the gap \delta is negative.

    Parameters
    ----------
    gap, position, side
        As for :class:`Stop`.
    stiffness, damping : number, name of a parameter, or function
        ``stiffness`` must be given; with 0 the stop is a plane that acts by its damper alone, or by nothing.
    pulls : bool
        True: in contact as long as the gap is negative, also where the damper pulls. False (a massless support that
        relaxes at once): in contact while the gap is negative and the force pushes (Savi et al. 2007, Eq. (2)).
    at, on
        See :class:`Element`.
    """

    stiffness: Law | None = None
    damping: Law = 0.0
    pulls: bool = False

    phases = ("open", "contact")
    touching = ("contact",)
    laws = ("stiffness", "damping")
    conditions = ("gap", "push")
    presses = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.stiffness is None:
            raise SystemDefinitionError(
                "ElasticStop: give stiffness=, without which nothing stops (0: a plane that only marks a place); a "
                "rigid stop is Stop"
            )

    def limits(self, here: Place) -> list[tuple[Any, str]]:
        return [(here.law("stiffness"), f"the stiffness of element {here.name!r} must not be negative")]

    def force(self, here: Place) -> Any:
        return 0 if here.phase == "open" else -here.law("stiffness") * here.where + damped(here)

    def leaving(self, here: Place) -> list[Leaving]:
        inside, outside = Condition(here.where, -1, "gap"), Condition(here.where, 1, "gap")
        if self.pulls or here.vanishes(here.law("damping")):
            return [Leaving("contact", [inside])] if here.phase == "open" else [Leaving("open", [outside])]
        push = self.force(here.put("contact"))
        if here.phase == "open":
            return [Leaving("contact", [inside, Condition(push, 1, "push")])]
        jumps = [Leaving("open", [outside])] if here.may_jump() else []  # else it pulls before
        return [*jumps, Leaving("open", [Condition(push, -1, "push")])]


@dataclass(frozen=True, kw_only=True)
class Displaced(Element):
    """An element that says where it is by a displacement of its own."""

    displacement: Callable[..., Any] | None = None

    kinematics = "displacement"
    drives = "drives its displacement up"

    def placed(self, q: Any, v: Any, law: Callable[[Law], Any]) -> Any:
        return q


@dataclass(frozen=True, kw_only=True)
class Backlash(Displaced):
    r"""Play with elastic flanks: F = -k (s - b) - c \dot s above the half width b, its mirror image below -b.

    Parameters
    ----------
    displacement : callable
        ``s(t, u, p)``, zero in the middle of the play; a positive force drives it up.
    half_width, stiffness, damping : number, name of a parameter, or function
    at, on
        See :class:`Element`.
    """

    half_width: Law = 0.0
    stiffness: Law = 0.0
    damping: Law = 0.0

    phases = ("free", "above", "below")
    touching = sides = ("above", "below")
    laws = ("half_width", "stiffness", "damping")
    conditions = ("upper", "lower")

    def limits(self, here: Place) -> list[tuple[Any, str]]:
        return [(here.law("half_width"), f"the half width of element {here.name!r} must not be negative")]

    def force(self, here: Place) -> Any:
        side = here.side
        if not side:
            return 0
        pressed = here.where - side * here.law("half_width")
        return -here.law("stiffness") * pressed + damped(here)

    def leaving(self, here: Place) -> list[Leaving]:
        upper, lower = here.where - here.law("half_width"), here.where + here.law("half_width")
        if here.phase == "free":
            return [
                Leaving("above", [Condition(upper, 1, "upper")]),
                Leaving("below", [Condition(lower, -1, "lower")]),
            ]
        back = Condition(upper, -1, "upper") if here.side > 0 else Condition(lower, 1, "lower")
        return [Leaving("free", [back])]


@dataclass(frozen=True, kw_only=True)
class PreloadedSpring(Displaced):
    r"""A spring with preload P and stiffness k: F = -P - k s for s > 0, P - k s for s < 0.

    Where s = 0 is crossed slower than 1e-5 of the scale of its rate and the load stays within P, it holds s = 0.

    Parameters
    ----------
    displacement : callable
        ``s(t, u, p)``; a positive force drives it up.
    preload, stiffness : number, name of a parameter, or function
    at, on
        See :class:`Element`.
    """

    preload: Law = 0.0
    stiffness: Law = 0.0

    phases = ("above", "below", "held")
    laws = ("preload", "stiffness")
    conditions = ("over", "under", "side", "fast", "beyond")
    held = ("held",)
    exceeds = True
    sides = ("above", "below")

    def limits(self, here: Place) -> list[tuple[Any, str]]:
        return [(here.law("preload"), f"the preload of element {here.name!r} must not be negative")]

    def force(self, here: Place) -> Any:
        side = here.side
        return -side * here.law("preload") - here.law("stiffness") * here.where

    def most(self, here: Place) -> Any:
        return here.law("preload")

    def meeting(self, here: Place) -> list[list[Condition]]:
        return [[Condition(here.where, -here.side, "side")]]

    def lies(self, where: float, rate: float, slow: float) -> int:
        return int(np.sign(where) if where else np.sign(rate) if abs(rate) > slow else 0)

    def leaving(self, here: Place) -> list[Leaving]:
        hold, most = here.put("held").holding(), self.most(here)
        over, under = Condition(hold - most, 1, "over"), Condition(hold + most, -1, "under")
        if here.phase == "held":
            return [Leaving("below", [over]), Leaving("above", [under])]
        to, sign = ("below", -1) if here.side > 0 else ("above", 1)
        side, rate = Condition(here.where, sign, "side"), here.rate()
        fast = Condition(rate - sign * self.slow * here.size(rate), sign, "fast")
        crossed = [Leaving(to, [side, one]) for one in (fast, over, under)]
        if here.may_be_beyond():
            off = SMALL * here.size(here.where)
            crossed.insert(0, Leaving(to, [Condition(here.where - sign * off, sign, "beyond")]))
        return [*crossed, Leaving("held", [side], here.struck(0))]


def damped(here: Place) -> Any:
    """The damper's force; without one no speed is asked for, and states need not have one."""
    damping = here.law("damping")
    none = here.vanishes(damping) and here.vanishes(1j * damping)  # nor a derivative, where numbers carry one
    return 0 if none else -damping * here.rate()
