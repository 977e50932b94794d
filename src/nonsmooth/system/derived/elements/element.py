"""The ground of all elements: the place where one acts, its phases, what it says of itself and asks of others.

An element is in one of a few phases (open or at rest, slipping or sticking, ...). In each its force is a law, or it is
whatever keeps a rate at zero: the approach of a contact that rests, the speed of one that sticks. A system with
elements has a mode for each combination of their phases. An element knows its own rules and no other element; what
stands around it is a :class:`Place`.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from nonsmooth.errors import SystemDefinitionError, shortened

if TYPE_CHECKING:
    from nonsmooth.system.derived.assembly import Assembler, Pattern
    from nonsmooth.system.derived.calculus import Part


SMALL = 1e-4  # of the states' scale: what a rate or a gap that is held at zero may be off where a run begins
CREEP = 1e-7  # of the same: the speed of approach below which impacts are not followed
THROWN = ("rate_above", "rate_below")  # names of the conditions on a held rate that an input makes jump
SLOW = 1e-5  # of the same: the speed at which a preloaded spring still takes hold
Law = float | str | Callable[..., Any]


class Condition(NamedTuple):
    """``sign * value > 0``, and the name by which logs call it behind the element's; one that is not ``strict`` holds
    as well where the value and all its derivatives are zero."""

    value: Any
    sign: int
    name: str
    strict: bool = True


class Leaving(NamedTuple):
    """A way out of a phase: the phase behind it (None: it is asked, :mod:`nonsmooth.system.derived.deciding`), the
    conditions that must all hold, the states behind it."""

    phase: str | None
    conditions: list[Condition]
    states: Any = None  # None: as they were


@dataclass(frozen=True, kw_only=True)
class Element(ABC):
    """The place where an element acts, which all of them have.

    Parameters
    ----------
    at : str, or mapping of str to float, optional
        Of a system made by :func:`nonsmooth.mechanical`: the coordinate, or a combination such as
        ``{"q1": 1, "q2": -1}`` for an element between two masses.
    on : mapping of str to number, parameter or function, optional
        Of any other system: what a unit force of the element adds to the derivatives of states,
        ``{"v": lambda t, u, p: 1 / p.m}``.
    """

    at: str | Mapping[str, float] | None = None
    on: Mapping[str, Law] | None = None

    kinematics: ClassVar[str] = ""  # the field that says where the element is, where ``at`` does not
    phases: ClassVar[tuple[str, ...]] = ()
    laws: ClassVar[tuple[str, ...]] = ()  # its arguments that are numbers, parameters or functions
    conditions: ClassVar[tuple[str, ...]] = ()  # names of the conditions on its ways out
    held: ClassVar[tuple[str, ...]] = ()  # the phases in which its force is that of a constraint
    touching: ClassVar[tuple[str, ...]] = ()  # the phases in which it is in contact
    sides: ClassVar[tuple[str, str]] = ("", "")  # the phases in which it lets go, its rate rising or falling
    strikes: ClassVar[bool] = False  # its impacts turn speeds at once
    bears: ClassVar[bool] = False  # while it is held it bears its part of an impulse
    exceeds: ClassVar[bool] = False  # its force goes beyond ``most`` where it is not held
    drives: ClassVar[str] = "drives its speed up"  # a positive force
    slow: ClassVar[float] = SLOW  # of the scale of its rate: below it it may hold, where a place decides
    presses: ClassVar[bool] = False  # its law is a normal force for friction
    given: ClassVar[Any] = None  # on an element that stands for one with ``at``: that one; of a text: its own text

    def __post_init__(self) -> None:
        label = type(self).__name__
        own = getattr(self, self.kinematics)
        if self.at is None and (own is None or not self.on):
            raise SystemDefinitionError(
                f"{label}: give {self.kinematics}= (a function of t, u, p) and on= (what a unit force adds to which "
                f"state's derivative), or at= (a coordinate) in ns.mechanical"
            )
        for name, given in (("on", self.on), (self.kinematics, own)):
            if self.at is not None and given is not None:
                instead = "; with at= the place of a stop is position=" if name == "gap" else ""
                raise SystemDefinitionError(f"{label}: at= (of ns.mechanical) and {name}= exclude each other{instead}")
        if self.on is not None and not isinstance(self.on, Mapping):
            raise SystemDefinitionError(
                f'{label}: on= maps states to numbers or functions, {{"v": 1.0}}; not {shortened(self.on)}'
            )

    @property
    def into(self) -> int:
        """With ``at=``: the sign of what a positive force does to the coordinate."""
        return 1

    def parts(self, name: str) -> dict[str, Element]:
        """The elements of which it consists, by names that begin with its own."""
        return {name: self}

    @abstractmethod
    def force(self, here: Place) -> Any:
        """The force by its law, in a phase that is not held."""

    @abstractmethod
    def leaving(self, here: Place) -> list[Leaving]:
        """The ways out of the present phase, in the order in which they are tried."""

    def needs(self, others: Collection[str]) -> list[tuple[str, int | None]]:
        """Its laws by name, each with the sides of the speed at which it is asked for; ``others`` are the elements."""
        return [(name, None) for name in self.laws]

    def rate(self, here: Place) -> Any:
        """The rate that a constraint of the element holds at zero."""
        return here.approach()

    def pull(self, here: Place) -> Any:
        """The term that brings a state back onto the surface, which rounding leaves; zero there (Baumgarte 1972)."""
        kappa = here.size(here.rate()) / here.size(here.where)
        return -2 * kappa * here.rate() - kappa**2 * here.where

    def most(self, here: Place) -> Any:
        """The greatest force of its constraint, either way; None where it pushes only."""
        return None

    def lies(self, where: float, rate: float, slow: float) -> int:
        """Return on which of its ``sides`` it is, 1 or -1, by its place and its rate; 0 where it may hold."""
        return 0

    def meeting(self, here: Place) -> list[list[Condition]]:
        """The conditions, of each way in, at which what it does next is asked where it is not held."""
        return []

    def ranges(self, here: Place) -> list[tuple[Any, str]]:
        """Expressions of the parameters that must not be negative, each with the sentence for where it is."""
        return []

    def limits(self, here: Place) -> list[tuple[Any, str]]:
        """The same of the parameters as they are given: a fit may come from beyond zero to a value beside it."""
        return []

    @abstractmethod
    def placed(self, q: Any, v: Any, law: Callable[[Law], Any]) -> Any:
        """The place of the element, by a coordinate ``q`` and its speed ``v`` (:func:`nonsmooth.mechanical`)."""


def words_of(elements: Mapping[str, Element | type[Element]]) -> str:
    """The regular expression of a combination's name, with a group for the phase of each element."""
    return "_".join(f"{re.escape(name)}_({'|'.join(one.phases)})" for name, one in elements.items())


@dataclass(frozen=True, kw_only=True)
class Contact(Element):
    """A contact on one side, with a gap: the ground of rigid and elastic stops."""

    gap: Callable[..., Any] | None = None
    position: Law = 0.0
    side: int = 1

    kinematics = "gap"
    drives = "opens its gap"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.side not in (1, -1):
            raise SystemDefinitionError(
                f"{type(self).__name__}: side is 1 (the stop lies above) or -1 (below), not {self.side!r}"
            )

    @property
    def into(self) -> int:
        """A positive force opens it, away from its side."""
        return -self.side

    def placed(self, q: Any, v: Any, law: Callable[[Law], Any]) -> Any:
        return self.side * (law(self.position) - q)


@dataclass(frozen=True)
class Place:
    """View of one element on the combination of phases in which it stands."""

    make: Assembler
    k: int
    mode: str
    pattern: Pattern

    @property
    def part(self) -> Part:
        return self.make.parts[self.k]

    @property
    def name(self) -> str:
        return self.part.name

    @property
    def element(self) -> Element:
        return self.part.element

    @property
    def phase(self) -> str:
        return self.element.phases[self.pattern[self.k]]

    @property
    def side(self) -> int:
        """1 where it is in the first of its ``sides``, -1 in the second, else 0."""
        sides = self.element.sides
        return (self.phase == sides[0]) - (self.phase == sides[1])

    @property
    def where(self) -> Any:
        """Gap, displacement or speed."""
        return self.part.where

    def law(self, name: str, side: int | None = None) -> Any:
        """An argument of the element; with ``side`` at the magnitude ``side`` times its speed."""
        return self.make.law(self.k, name, side)

    def rate(self) -> Any:
        """The rate that its constraint holds at zero."""
        return self.element.rate(self)

    def approach(self) -> Any:
        """The derivative of its place, which no force changes at once."""
        return self.make.approach(self.k, self.mode)

    def put(self, phase: str) -> Place:
        """The same place with the element in another phase."""
        pattern = (*self.pattern[: self.k], self.element.phases.index(phase), *self.pattern[self.k + 1 :])
        return Place(self.make, self.k, self.mode, pattern)

    def named(self, name: Any) -> Place | None:
        """That of an element by its name; None where there is none."""
        found = [j for j, part in enumerate(self.make.parts) if part.name == name]
        return self.make.place(found[0], self.mode, self.pattern) if found else None

    def holding(self) -> Any:
        """The force of the element."""
        return self.make.flow(self.mode, self.pattern)[1][self.k]

    def free(self) -> Any:
        """The derivative of its rate where it is open."""
        field, _ = self.make.flow(self.mode, self.put("open").pattern)
        return self.make.along(self.rate(), field)

    def struck(self, factor: Any) -> Any:
        """States behind an impulse of the element that takes its rate to -factor times it."""
        return self.make.impact((self.k,), self.mode, factor)

    def behind(self, expression: Any, states: Any) -> Any:
        """An expression behind an impulse, by the states before it."""
        return self.make.behind(expression, states)

    def back_on(self, states: Any) -> Any:
        """States moved onto the surface of the contact, the shortest way; inputs stay."""
        return self.make.shifted_back(states, self.where)

    def is_turned(self) -> bool:
        """Return whether the impact of a stop, or an input, may turn its speed at once."""
        strikes = (part for part in self.make.parts if part.element.strikes)
        struck = any(not self.vanishes(self.make.across(self.where, part)) for part in strikes)
        return struck or self.make.driven(self.where)

    def effect(self) -> tuple[Any, str]:
        """The effect of a unit force of the element on its own rate, with the sentence for where it is negative."""
        own = self.make.across(self.where, self.part)  # a force may act on the place itself
        return (
            self.make.across(self.rate(), self.part) if self.vanishes(own) else own,
            f"element {self.name!r}: a positive force {self.element.drives}, and on= does the opposite; turn the sign "
            f"of on= or of {self.element.kinematics}=",
        )

    def begins_alone(self) -> bool:
        """Return whether nothing is asked where a run begins, so that its conditions must lead out of its phase."""
        return not self.make.asks

    def may_jump(self) -> bool:
        """Return whether its place may change at once: by an input, or by a transition of the system's own."""
        return self.make.resets or self.make.driven(self.where)

    def may_be_beyond(self) -> bool:
        """Return whether its place may be any where it enters a phase: a run begins there, or an input jumps."""
        return self.begins_alone() or self.make.driven(self.where)

    def vanishes(self, expression: Any) -> bool:
        """Return whether an expression is zero whatever the state."""
        return self.make.vanishes(expression)

    def size(self, expression: Any) -> Any:
        """The scale of the states that an expression involves."""
        return self.make.size(expression)
