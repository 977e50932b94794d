"""Numbers at one instant, of which elements that decide together are asked (:mod:`nonsmooth.system.derived.deciding`).

:class:`Numbers` are values of expressions at one instant, with the sums of their absolute terms, and derivatives along
the flow behind it, order by order: those of rates with the forces found so far, then the forces of that order are put
in. :class:`RowNumbers` are those of affine systems, over w = (u, 1, cos, sin, ...); :class:`SeriesNumbers` are those of
any other, by the recurrences of their Taylor coefficients (:mod:`nonsmooth.system.codegen.recurrences`) with the forces
as inputs.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from nonsmooth.arrays import FloatArray
from nonsmooth.system.derived.calculus import kept

if TYPE_CHECKING:
    from nonsmooth.system.derived.assembly import Assembler, Pattern
    from nonsmooth.system.derived.expressions import Expressions
    from nonsmooth.system.derived.rows import Rows

ZERO = 1e-11  # of the sum of its terms: what is smaller is zero
ROUNDING = 1e-12  # of the terms of an effect: below it there is none
OFF = 1e-7  # of numbers, to see their sizes


class Numbers(ABC):
    """Values at one instant; ``u`` are the states there, which impulses change."""

    make: Assembler
    mode: str
    u: FloatArray
    known: dict[Any, Any]  # what follows from the effects of forces alone

    @abstractmethod
    def copy(self) -> Numbers:
        """The same instant, to be changed apart."""

    @abstractmethod
    def value(self, expression: Any) -> float:
        """The value of an expression."""

    def number(self, expression: Any) -> float:
        """The value of an expression, 0 where it is rounding."""
        total = self.value(expression)
        return total if abs(total) > ZERO * self.terms(expression) else 0.0

    @abstractmethod
    def terms(self, expression: Any) -> float:
        """The sum of its absolute terms, those of its change on the last step too: its rounding is a part of it."""

    @abstractmethod
    def slopes(self, expression: Any) -> FloatArray:
        """Its derivatives in the states."""

    @abstractmethod
    def direction(self, k: int) -> FloatArray:
        """The change of the states' derivatives by a unit force of element k."""

    @abstractmethod
    def effects(self, some: Sequence[int], by: Sequence[int]) -> FloatArray:
        """Changes of the derivatives of the rates of some elements by unit forces of others."""

    @abstractmethod
    def shift(self, change: FloatArray) -> None:
        """Change the states."""

    @abstractmethod
    def ahead(self, some: Sequence[int], forces: Sequence[tuple[int, Any]], laws: Any) -> Ahead:
        """The derivatives of the rates of some elements and of ``laws`` behind the instant, where others have
        ``forces`` by their laws."""


class RowNumbers(Numbers):
    """Numbers of an affine system."""

    def __init__(self, rows: Rows, mode: str, w: FloatArray, step: float = 0.0, pattern: Pattern | None = None) -> None:
        self.make, self.rows, self.mode, self.w, self.known = rows, rows, mode, w, rows.known
        self.u = w[: rows.n]
        self.size = np.abs(w)
        self.size[rows.n :] = 1.0  # a sine that is zero has the rounding of its phase
        if pattern is not None:
            self.size[: rows.n] += 0.25 * step * np.abs(rows.flow(mode, pattern)[0]) @ self.size

    def copy(self) -> RowNumbers:
        found = RowNumbers(self.rows, self.mode, self.w.copy())
        found.size = self.size
        return found

    def row(self, expression: Any) -> FloatArray:
        """The numbers of an expression."""
        if hasattr(expression, "values"):
            found: FloatArray = expression.values
            return found
        constant = np.zeros(len(self.w))
        constant[self.rows.n] = expression
        return constant

    def value(self, expression: Any) -> float:
        return float(self.row(expression) @ self.w)

    def terms(self, expression: Any) -> float:
        return float(np.abs(self.row(expression)) @ self.size)

    def slopes(self, expression: Any) -> FloatArray:
        return self.row(expression)[: self.rows.n]

    def direction(self, k: int) -> FloatArray:
        found: FloatArray = self.rows.parts[k].direction
        return found

    def effects(self, some: Sequence[int], by: Sequence[int]) -> FloatArray:
        return self.rows.changes[np.ix_(some, by)]

    def shift(self, change: FloatArray) -> None:
        self.u += change
        states = np.maximum(self.size[: self.rows.n], np.abs(self.u))  # an impact makes terms of what was zero
        self.size = np.append(states, self.size[self.rows.n :])

    def ahead(self, some: Sequence[int], forces: Sequence[tuple[int, Any]], laws: Any) -> Ahead:
        return _RowsAhead(self, some, forces, laws)


class _RowsAhead:
    """Derivatives of rows: each is a product with the matrix of the flow."""

    def __init__(self, here: RowNumbers, some: Sequence[int], forces: Sequence[tuple[int, Any]], laws: Any) -> None:
        rows = here.rows
        self.n, self.waves, self.w, self.size = rows.n, rows.rates, here.w, here.size
        known = [(k, law.values) for k, law in forces if hasattr(law, "values")]
        by, of = [k for k, _ in known], np.array([values for _, values in known]).reshape(len(known), len(here.w))
        self.field = rows.base(here.mode) + rows.directions[by].T @ of
        self.rows = np.array([rows.rate(k, here.mode).values for k in some])
        self.directions = rows.directions[[*some]]
        self.laws = np.array([here.row(law) for law in laws]).reshape(len(laws), len(here.w))

    def rates(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The next derivatives of the rates without forces of this order, the sums of their absolute terms, and the
        derivatives of the laws."""
        laws = self.laws @ self.w
        self.w, self.size = self._onward(self.field, self.w), self._onward(np.abs(self.field), self.size, 1.0)
        return self.rows @ self.w, np.abs(self.rows) @ self.size, laws

    def put(self, forces: FloatArray) -> None:
        """Put in the forces of this order, and go on to the next."""
        self.w[: self.n] += forces @ self.directions
        self.size[: self.n] += np.abs(forces) @ np.abs(self.directions)

    def _onward(self, field: FloatArray, w: FloatArray, sign: float = -1.0) -> FloatArray:
        """The derivative in time of w; with ``sign`` 1 a bound on its size."""
        n, ahead = self.n, np.zeros_like(w)
        ahead[:n] = field @ w
        ahead[n + 1 :: 2] = sign * self.waves * w[n + 2 :: 2]
        ahead[n + 2 :: 2] = self.waves * w[n + 1 :: 2]
        return ahead


class SeriesCode:
    """Text of the expressions of one system, compiled for numbers of any kind; kept, and shared by all instants."""

    def __init__(self, make: Expressions, changes: Mapping[sp.Basic, sp.Expr]) -> None:
        self.make, self.changes = make, changes  # functions of time in place of parameters
        symbols = make.symbols
        self.names: dict[sp.Basic, str] = {s: f"q{i}" for i, s in enumerate([*symbols.p.values(), *symbols.m.values()])}
        self.own: dict[sp.Basic, str] = {
            **self.names,
            symbols.t: "t",
            **{s: f"x{i}" for i, s in enumerate(make.u)},
        }

    @kept
    def value(self, expression: sp.Expr) -> Any:
        """The code of one expression."""
        from nonsmooth.system.symbolic.printing import Printer

        return compile(Printer(self.own)(expression.xreplace(self.changes)), "<instant>", "eval")

    @kept
    def slopes(self, expression: sp.Expr) -> list[sp.Expr]:
        """Its derivatives in the states."""
        return [sp.diff(expression, symbol) for symbol in self.make.u]

    @kept
    def effect(self, mode: str, i: int, j: int) -> sp.Expr:
        """The change of the derivative of the rate of element i by a unit force of element j."""
        return self.make.across(self.make.rate(i, mode), self.make.parts[j])

    @kept
    def steps(
        self, mode: str, some: tuple[int, ...], forces: tuple[tuple[int, Any], ...], laws: tuple[Any, ...]
    ) -> tuple[Any, ...]:
        """Code that writes the coefficients 0, and that of the next ones: of the states, then of the forces of some
        elements, which are inputs, then of the derivatives of their rates, then of the laws."""
        from nonsmooth.system.codegen.jet import jet_steps

        make = self.make
        field = make.base(mode)
        inputs = [sp.Symbol(f"force_{k}", real=True) for k in some]
        for k, law in [*forces, *zip(some, inputs, strict=True)]:
            field = make.moved(field, make.parts[k], law)
        rates = [make.along(make.rate(k, mode), field) for k in some]
        first, following = jet_steps(
            make.symbols.t,
            (*make.u, *inputs),
            self.names,
            [*(e.xreplace(self.changes) for e in field), *([sp.S.Zero] * len(inputs))],
            [sp.sympify(e).xreplace(self.changes) for e in (*rates, *laws)],
        )
        return tuple(compile("\n".join(lines), "<instant>", "exec") for lines in (first, following))


class SeriesNumbers(Numbers):
    """Numbers of a system whose expressions are any that have Taylor series.

    They are computed three times: as they are, and with all that they are computed from off by ``OFF`` at random; what
    that changes is their size, of which rounding is a small part."""

    def __init__(
        self,
        code: SeriesCode,
        mode: str,
        t: float,
        u: FloatArray,
        constants: FloatArray,
        step: float = 0.0,
        field: Sequence[Any] = (),
    ) -> None:
        self.make, self.code, self.mode, self.u, self.size = code.make, code, mode, u.copy(), np.abs(u)
        self.constants = np.array([t, *constants])
        self.known = {}
        self.lanes = self._lanes()
        if step:
            self.size = self.size + 0.25 * step * np.abs([self.value(e) for e in field])
            self.lanes = self._lanes()

    def _lanes(self) -> list[dict[str, Any]]:
        """The numbers at this instant by their names in code, three times."""
        names, lanes = ["t", *self.code.names.values(), *(f"x{i}" for i in range(len(self.u)))], []
        for way in off(len(names)):
            constants, states = np.split(way, [len(self.constants)])
            numbers = [*self.constants * (1.0 + constants), *self.u + states * self.size]
            lanes.append({**vars(math), **dict(zip(names, map(float, numbers), strict=True))})
        return lanes

    def _three(self, expression: Any) -> list[float]:
        code = self.code.value(sp.sympify(expression))
        return [float(eval(code, names)) for names in self.lanes]

    def copy(self) -> SeriesNumbers:
        found = SeriesNumbers(self.code, self.mode, self.constants[0], self.u, self.constants[1:])
        found.size, found.lanes = self.size, self.lanes
        return found

    def value(self, expression: Any) -> float:
        return float(eval(self.code.value(sp.sympify(expression)), self.lanes[0]))

    def terms(self, expression: Any) -> float:
        return float(sizes(np.array(self._three(expression))))

    def slopes(self, expression: Any) -> FloatArray:
        return np.array([self.value(e) for e in self.code.slopes(expression)])

    def direction(self, k: int) -> FloatArray:
        found = np.zeros(len(self.u))
        for i, e in self.make.parts[k].direction.items():
            found[i] = self.value(e)
        return found

    def effects(self, some: Sequence[int], by: Sequence[int]) -> FloatArray:
        found = np.array([[self._three(self.code.effect(self.mode, i, j)) for j in by] for i in some])
        found = np.moveaxis(found.reshape(len(some), len(by), len(self.lanes)), -1, 0)
        return np.where(np.abs(found[0]) > ROUNDING * sizes(found), found[0], 0.0)

    def shift(self, change: FloatArray) -> None:
        self.u, self.known = self.u + change, {}
        self.size = np.maximum(self.size, np.abs(self.u))
        self.lanes = self._lanes()

    def ahead(self, some: Sequence[int], forces: Sequence[tuple[int, Any]], laws: Any) -> Ahead:
        steps = self.code.steps(self.mode, tuple(some), tuple(forces), tuple(laws))
        return _SeriesAhead(self, steps, len(some), len(laws))


class _SeriesAhead:
    """Taylor coefficients: the k-th derivative is k! times the k-th of them, in forces, rates and bounds alike."""

    def __init__(self, here: SeriesNumbers, steps: tuple[Any, Any], count: int, laws: int) -> None:
        self.steps, self.order, self.n, self.count, self.laws = steps, 0, len(here.u), count, laws
        states = [f"x{i}" for i in range(self.n)]
        self.lanes: list[dict[str, Any]] = [
            {**names, "C": {}, "W": {}, "u": [*(names[x] for x in states), *([0.0] * count)]} for names in here.lanes
        ]

    def rates(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        lanes, first = self._step(np.zeros(self.count)), self.n + self.count
        rows = range(first, first + self.count + self.laws)
        found = np.array([[names["C"].get((row, self.order), 0.0) for row in rows] for names in lanes])
        return found[0, : self.count], sizes(found)[: self.count], found[0, self.count :]

    def put(self, forces: FloatArray) -> None:
        self.lanes = self._step(forces)
        self.order += 1

    def _step(self, forces: FloatArray) -> list[dict[str, Any]]:
        """Write the coefficients of this order; the numbers by their names behind it."""
        lanes = [{**names, "k": self.order} for names in self.lanes]
        for names, way in zip(lanes, off(self.count, 1 + self.order), strict=True):
            inputs = list(map(float, forces * (1.0 + way)))
            names["u"] = [*names["u"][: self.n], *inputs]
            if self.order:
                for j, force in enumerate(inputs, start=self.n):
                    names[f"c{j}"] = names["C"][j, self.order] = force
            exec(self.steps[self.order > 0], names)
        return lanes


Ahead = _RowsAhead | _SeriesAhead  # derivatives behind an instant, of one order after the other


@cache
def off(count: int, seed: int = 0) -> FloatArray:
    """Zeros, and what two copies of so many numbers are off by."""
    rng = np.random.default_rng([count, seed])
    ways = OFF * rng.uniform(0.5, 1.0, (3, count)) * rng.choice([-1.0, 1.0], (3, count))
    ways[0] = 0.0
    return ways


def sizes(three: FloatArray) -> FloatArray:
    """The sizes of numbers (3, ...) that were computed three times."""
    found: FloatArray = np.abs(three[1:] - three[0]).max(axis=0) * (2.0 / OFF)
    return found
