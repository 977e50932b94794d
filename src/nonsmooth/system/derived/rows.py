"""The calculus of affine systems at one parameter point: expressions are rows of numbers.

A force, an indicator, a component of a reset is a :class:`Row` over w = (u, 1, cos k_1 w t, sin k_1 w t, ...), the
vector that the exact flow moves; the rules of :mod:`nonsmooth.system.derived.assembly` are sums of such rows and one
small linear system.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError, SystemDefinitionError
from nonsmooth.system.codegen.linear import put_together
from nonsmooth.system.derived.assembly import Assembler, Pattern, VaryingError
from nonsmooth.system.derived.calculus import Part, kept

if TYPE_CHECKING:
    from nonsmooth.kernels.hybrid.records import Form
    from nonsmooth.system.derived.patterns import Patterns

ROUNDING = 1e-12  # of the terms of a sum: below it the sum is zero
ROOM = 2_000_000  # numbers of fields that are kept


class Row:
    """An affine function of the states with harmonics in time: numbers over w."""

    __slots__ = ("one", "values")
    __array_ufunc__ = None  # numbers of NumPy leave sums and products to this class

    def __init__(self, values: FloatArray, one: int) -> None:
        self.values, self.one = values, one

    @property
    def number(self) -> float | None:
        """Its value where it is a constant."""
        return None if np.count_nonzero(self.values) > (self.values[self.one] != 0) else self.values[self.one].item()

    def __add__(self, other: Row | float) -> Row:
        if isinstance(other, Row):
            return Row(self.values + other.values, self.one)
        values = self.values.copy()
        values[self.one] += other
        return Row(values, self.one)

    __radd__ = __add__

    def __neg__(self) -> Row:
        return Row(-self.values, self.one)

    def __sub__(self, other: Row | float) -> Row:
        return self + -other

    def __rsub__(self, other: float) -> Row:
        return -self + other

    def __mul__(self, other: Row | float) -> Row:
        if not isinstance(other, Row):
            return Row(self.values * other, self.one)
        a, b = self.number, other.number
        if b is not None:
            return Row(self.values * b, self.one)
        if a is not None:
            return Row(other.values * a, self.one)
        raise SystemDefinitionError(
            "a product of two quantities that depend on states or time is not affine: elements with such a law "
            "(friction that depends on the speed under a normal force that varies) combine as long as all combinations "
            "of phases can be written out"
        )

    __rmul__ = __mul__


class Rows(Assembler):
    """The calculus of rows at one parameter point: a vector of states is an array (n, M).

    With complex numbers it is that of derivatives in a parameter, too (:meth:`Patterns.rows_at`)."""

    def __init__(self, patterns: Patterns, tables: Form, still: list[bytes]) -> None:
        self.n, harmonics = tables.A.shape[-1], tables.c.shape[-2]
        self.rates = tables.omega[0] * tables.multiples
        self.scale, self.asks, self.mode = patterns.scale, True, patterns.mode
        self.sequential, self.inputs = patterns.make.sequential, patterns.make.inputs
        self.field = np.zeros((self.n, self.n + 1 + 2 * harmonics), dtype=tables.A.dtype)
        put_together(self.field, self.n, tables.A[0, 0], tables.b[0, 0], tables.c[0, 0].T, tables.s[0, 0].T)
        every = np.zeros((len(tables.ib[0]), self.field.shape[1]), dtype=self.field.dtype)
        put_together(every, self.n, tables.ia[0], tables.ib[0], tables.ic[0], tables.is_[0])
        self._every, self._at = every, patterns.at
        self.parts = [self._part(k, name, patterns) for k, name in enumerate(patterns.elements)]
        self.known: dict[Any, Any] = {}  # of what elements decide together
        # Out of its phase, of each element in a combination of its group.
        self.ways: dict[tuple[int, Any], tuple[list[Any], dict[int, FloatArray], Any]] = {}
        self._flows: dict[tuple[int, Any], tuple[FloatArray, dict[int, Any]]] = {}
        self._room = ROOM
        self.still, self.turned = still, False  # all that they are made of but the frequency; whether that counts too

    def at_rates(self, rates: FloatArray) -> Rows:
        """The same numbers at another frequency, answers included; those that ask for it are no longer shared."""
        found = copy(self)
        found.rates = rates
        return found

    def _turns(self) -> None:
        """Keep answers from those of other frequencies: from here on they depend on it."""
        if not self.turned:
            self.turned = True
            self.known, self.ways, self._flows = dict(self.known), dict(self.ways), dict(self._flows)
            self.__dict__["_kept"] = dict(self.__dict__.get("_kept", {}))

    def augmented(self, u: FloatArray, time: Any) -> FloatArray:
        """w of states at a time, or at several; of one state at several too."""
        angles, shape = np.multiply.outer(time, self.rates), np.shape(time)
        waves = np.stack([np.cos(angles), np.sin(angles)], axis=-1).reshape(*shape, 2 * len(self.rates))
        return np.concatenate([np.broadcast_to(u, (*shape, u.shape[-1])), np.ones((*shape, 1)), waves], axis=-1)

    def _part(self, k: int, name: str, patterns: Patterns) -> Part:
        direction = np.zeros(self.n, dtype=self.field.dtype)
        for i in patterns.acts_on[k]:
            number = Row(self._every[self._at[k, "on", i]], self.n).number
            if number is None:
                raise SystemDefinitionError(
                    f"element {name!r}: what its force adds to a state's derivative depends on states or time; with so "
                    "many elements it must be a number or a function of parameters"
                )
            direction[i] = number
        return Part(name, patterns.elements[name], direction, Row(self._every[self._at[k, "where", None]], self.n))

    def base(self, mode: str) -> FloatArray:
        return self.field

    @kept
    def law(self, k: int, name: str, side: int | None = None) -> Row:
        return Row(self._every[self._at[k, name, side]], self.n)

    def constant(self, k: int, name: str) -> float:
        number = self.law(k, name).number
        if number is None:
            raise SystemDefinitionError(
                f"{name} of element {self.parts[k].name!r} depends on states or time; at a rigid contact it is a "
                "number or a function of parameters"
            )
        return number

    def along(self, expression: Row, field: FloatArray) -> Row:
        n, e = self.n, expression.values
        values = e[:n] @ field
        if e[n + 1 :].any():
            self._turns()
            values[n + 1 :: 2] += self.rates * e[n + 2 :: 2]
            values[n + 2 :: 2] -= self.rates * e[n + 1 :: 2]
        return Row(values, n)

    def across(self, expression: Row, part: Part) -> float:
        terms = expression.values[: self.n] * part.direction
        total: float = terms.sum().item()
        return total if abs(total) > ROUNDING * float(np.abs(terms).sum()) else 0.0

    def effects(self, some: Sequence[int], mode: str, parts: Sequence[Part] | None = None) -> Any:
        rates = np.array([self.rate(i, mode).values[: self.n] for i in some]).reshape(len(some), 1, self.n)
        terms = rates * np.array([part.direction for part in parts or [self.parts[k] for k in some]])
        total = terms.sum(axis=-1)
        return np.where(np.abs(total) > ROUNDING * np.abs(terms).sum(axis=-1), total, 0.0)

    @kept
    def basis(self, held: tuple[int, ...], mode: str, pattern: Pattern) -> tuple[list[int], FloatArray]:
        chosen, sums = super().basis(held, mode, pattern)
        if len(chosen) < len(held) and self.field.dtype == complex:
            ways, some = (
                np.array([self.pushing(k, self.mode, pattern).direction for k in which]) for which in (held, chosen)
            )
            if np.abs((ways - sums @ some).imag).max() > 1e-9 * np.abs(ways.imag).max(initial=0.0):
                names = ", ".join(repr(self.parts[k].name) for k in held)
                raise VaryingError(names, "a parameter in which derivatives are asked for")
        return chosen, sums

    def identity(self) -> FloatArray:
        return np.eye(self.n, self.field.shape[1])

    def moved(self, vector: FloatArray, part: Part, amount: Any) -> FloatArray:
        return vector + np.outer(part.direction, amount.values) if isinstance(amount, Row) else vector

    def holding(self, vector: FloatArray, rate: Row, value: Any, known: set[int], states: bool = False) -> FloatArray:
        slopes, waves = rate.values[: self.n], rate.values[self.n + 1 :]
        some = [i for i in np.flatnonzero(slopes).tolist() if i not in known]
        if len(some) == 1 and not waves.any():
            vector, i = vector.copy(), some[0]
            vector[i] = 0.0
            vector[i] = ((value.values if isinstance(value, Row) else 0.0) - slopes @ vector) / slopes[i]
            vector[i, self.n] -= rate.values[self.n] / slopes[i] if states else 0.0
            known.add(i)
        return vector

    def joined(self, part: Part, other: Part, share: Any) -> Part:
        return replace(part, direction=part.direction + share * other.direction)

    def behind(self, expression: Row, states: FloatArray) -> Row:
        values = expression.values[: self.n] @ states
        values[self.n :] += expression.values[self.n :]
        return Row(values, self.n)

    def mapped(self, states: FloatArray, before: FloatArray) -> FloatArray:
        found: FloatArray = states[:, : self.n] @ before
        found[:, self.n :] += states[:, self.n :]
        return found

    def shifted_back(self, states: FloatArray, expression: Row) -> FloatArray:
        slopes = expression.values[: self.n].copy()
        slopes[[*self.inputs]] = 0.0
        found: FloatArray = states - np.outer(slopes / (slopes @ slopes), expression.values)
        return found

    def solved(self, matrix: list[list[float]], right: list[Any]) -> list[Row]:
        rows = [one.values if isinstance(one, Row) else np.zeros(self.field.shape[1]) for one in right]
        try:
            found = np.linalg.solve(np.array(matrix), np.array(rows))
        except np.linalg.LinAlgError:
            raise SolveError(
                "contacts that depend on each other are struck at once, as a mass between two walls at one place: "
                "leave one of them out",
                status="not_unique",
            ) from None
        return [Row(values, self.n) for values in found]

    def slopes(self, expression: Row, draw: int = 0) -> FloatArray:
        return expression.values[: self.n].real

    def pushes(self, part: Part, draw: int = 0) -> FloatArray:
        return np.asarray(part.direction).real

    def touched(self, part: Part) -> Any:
        return part.direction != 0.0

    def involved(self, expression: Row) -> Any:
        return expression.values[: self.n] != 0.0

    def vanishes(self, expression: Any) -> bool:
        return not (expression.values.real.any() if isinstance(expression, Row) else expression)

    def size(self, expression: Row) -> float:
        return float(max(self.scale[expression.values[: self.n] != 0], default=1.0))

    @cached_property
    def changes(self) -> FloatArray:
        """Changes of the derivatives of the rates of all that may hold by unit forces of each of them."""
        bearing = [k for k, part in enumerate(self.parts) if part.element.held]
        found = np.zeros((len(self.parts), len(self.parts)))
        found[np.ix_(bearing, bearing)] = self.effects(bearing, self.mode)
        return found

    @cached_property
    def groups(self) -> list[tuple[list[int], Callable[[Pattern], Any], Any]]:
        """Of each group that is :meth:`apart` the elements, what takes their phases from a pattern, and the states that
        they act on."""
        acts = self.directions != 0.0
        return [(some, itemgetter(*some), np.flatnonzero(acts[some].any(axis=0))) for some in self.apart(self.mode)]

    @cached_property
    def directions(self) -> FloatArray:
        """Those of all elements."""
        return np.array([part.direction for part in self.parts])

    @cached_property
    def places(self) -> FloatArray:
        """The rows of all elements' places."""
        return np.array([part.where.values for part in self.parts])

    @cached_property
    def group(self) -> dict[int, int]:
        """The number of each element's group."""
        return {k: g for g, (some, *_) in enumerate(self.groups) for k in some}

    def phases(self, k: int, pattern: Pattern) -> Any:
        """Those of an element's group."""
        return self.groups[self.group[k]][1](pattern)

    def flow(
        self, mode: str, pattern: Pattern, some: Collection[int] | None = None
    ) -> tuple[FloatArray, dict[int, Any]]:
        f, forces = self.field.copy(), dict[int, Any]()
        for own, phases, states in self.groups:
            key = own[0], phases(pattern)
            if key not in self._flows:
                field, found = super().flow(mode, pattern, own)
                self._room -= len(states) * len(field[0])
                if self._room < 0:
                    self._flows.clear()
                    self._room = ROOM
                self._flows[key] = field[states], found
            f[states] = self._flows[key][0]
            forces |= self._flows[key][1]
        return f, {k: forces[k] for k in sorted(forces)}

    def rubbed(self, some: Sequence[int], slopes: FloatArray) -> FloatArray:
        """The map of an impact by the derivatives of its impulses in the rates of some elements."""
        ways = np.array([self.parts[k].direction for k in some]).T
        found: FloatArray = self.identity() + ways @ slopes @ np.array([self.rate(k, self.mode).values for k in some])
        return found
