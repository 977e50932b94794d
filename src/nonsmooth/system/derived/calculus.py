"""The calculus over which the rules of :mod:`nonsmooth.system.derived.assembly` are written.

Sums and products of expressions, their derivatives, linear systems of them, and the states that they involve.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Any, TypeVar, cast

from nonsmooth.arrays import FloatArray
from nonsmooth.system.derived.elements import Element

Method = TypeVar("Method", bound=Callable[..., Any])


def kept(method: Method) -> Method:
    """A method whose object keeps its answers, by the arguments."""

    @wraps(method)
    def known(self: Any, *given: Any) -> Any:
        key = method, given
        if key not in self.__dict__.setdefault("_kept", {}):
            answer = method(self, *given)
            self.__dict__["_kept"][key] = answer
        return self.__dict__["_kept"][key]

    return cast("Method", known)


@dataclass(frozen=True)
class Part:
    """An element in a system, by its name; what it acts on and where it is, in the calculus of the assembler."""

    name: str
    element: Element
    direction: Any  # what a unit force adds to the states' derivatives
    where: Any  # gap, displacement or speed


class Calculus(ABC):
    """One kind of expressions, with the elements in them; a child of the assembler brings it."""

    parts: list[Part]
    inputs: list[int]  # of the states that stand for inputs

    @abstractmethod
    def base(self, mode: str) -> Any:
        """The vector field without elements."""

    @abstractmethod
    def law(self, k: int, name: str, side: int | None = None) -> Any:
        """An argument of element k by its name; at the magnitude ``side`` times its speed where it is a law of that."""

    @abstractmethod
    def along(self, expression: Any, field: Any) -> Any:
        """The derivative in time along a vector field."""

    @abstractmethod
    def across(self, expression: Any, part: Part) -> Any:
        """Change of the derivative of an expression by a unit force of an element."""

    @abstractmethod
    def moved(self, vector: Any, part: Part, amount: Any) -> Any:
        """A vector of states, or field, with ``amount`` times the direction of an element added."""

    @abstractmethod
    def mapped(self, states: Any, before: Any) -> Any:
        """One map of the states behind another."""

    @abstractmethod
    def holding(self, vector: Any, rate: Any, value: Any, known: set[int], states: bool = False) -> Any:
        """A field, or ``states``, with the derivative of a rate, or the rate itself, as ``value``, without rounding,
        where the rate is constant in time and of all its states but one the entries are ``known`` so: then that one is
        too. Else what is left of large forces moves what rests."""

    def held_exactly(self, vector: Any, rates: list[tuple[Any, Any]], states: bool = False) -> Any:
        """A field or states with several rates and their values (:meth:`holding`), as far as one leads to the next."""
        known = set(self.inputs)  # their motion is given
        before = -1
        while before < len(known):
            before = len(known)
            for rate, value in rates:
                vector = self.holding(vector, rate, value, known, states)
        return vector

    @abstractmethod
    def joined(self, part: Part, other: Part, share: Any) -> Part:
        """An element whose force brings ``share`` of it along as the force of another."""

    def constant(self, k: int, name: str) -> Any:
        """A law of element k that depends on parameters alone."""
        return self.law(k, name)

    @abstractmethod
    def behind(self, expression: Any, states: Any) -> Any:
        """An expression behind an impulse, by the states before it."""

    @abstractmethod
    def shifted_back(self, states: Any, expression: Any) -> Any:
        """States moved to where an expression of those before them is zero, the shortest way; inputs stay."""

    @abstractmethod
    def identity(self) -> Any:
        """The states themselves."""

    @abstractmethod
    def solved(self, matrix: list[list[Any]], right: list[Any]) -> list[Any]:
        """The solution of a linear system of expressions."""

    @abstractmethod
    def slopes(self, expression: Any, draw: int = 0) -> FloatArray:
        """The derivatives of an expression in the states, as numbers; where they depend on the state, in one of those
        that are drawn at random."""

    @abstractmethod
    def pushes(self, part: Part, draw: int = 0) -> FloatArray:
        """The direction of an element as numbers, likewise; at the present values of the parameters."""

    @abstractmethod
    def touched(self, part: Part) -> Any:
        """True of the states on whose derivatives an element acts."""

    @abstractmethod
    def involved(self, expression: Any) -> Any:
        """True of the states on which an expression depends."""

    @abstractmethod
    def vanishes(self, expression: Any) -> bool:
        """Return whether an expression is zero whatever the state."""

    @abstractmethod
    def size(self, expression: Any) -> Any:
        """The scale of the states that an expression involves."""

    def driven(self, expression: Any) -> bool:
        """Return whether an input, which may jump, is a part of an expression."""
        return bool(self.slopes(expression)[self.inputs].any())

    def tidy(self, states: Any) -> Any:
        """States behind an impulse in the form in which they are kept."""
        return states
