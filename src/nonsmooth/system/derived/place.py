"""The place of one element in a combination of phases: what it may ask of the others around it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nonsmooth.system.derived.assembly import Assembler, Part, Pattern
    from nonsmooth.system.derived.elements import Element


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
        """1 where it slips forward, -1 back, else 0."""
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

    def other(self, j: int) -> Place:
        """The place of another element in the same combination."""
        return Place(self.make, j, self.mode, self.pattern)

    def named(self, name: Any) -> Place | None:
        """That of an element by its name; None where there is none."""
        found = [j for j, part in enumerate(self.make.parts) if part.name == name]
        return self.other(found[0]) if found else None

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
        expressions: Any = self.make  # where nothing is asked: rows always are
        return expressions.shifted_back(states, self.where)

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

    def may_be_beyond(self) -> bool:
        """Return whether its place may be any where it enters a phase: a run begins there, or an input jumps."""
        return self.begins_alone() or self.make.driven(self.where)

    def vanishes(self, expression: Any) -> bool:
        """Return whether an expression is zero whatever the state."""
        return self.make.vanishes(expression)

    def size(self, expression: Any) -> Any:
        """The scale of the states that an expression involves."""
        return self.make.size(expression)
