"""Numbers at one instant, of which elements that decide together are asked (:mod:`nonsmooth.system.derived.deciding`).

:class:`Numbers` are values of expressions at one instant, with the sums of their absolute terms, and derivatives along
the flow behind it, order by order: those of a rate with the forces found so far, then the forces of that order are put
in. :class:`RowNumbers` are those of affine systems, over w = (u, 1, cos, sin, ...); :class:`SeriesNumbers` of any other,
by the recurrences of Taylor coefficients with the forces as inputs (:mod:`nonsmooth.system.codegen.recurrences`).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from nonsmooth.arrays import FloatArray

if TYPE_CHECKING:
    from nonsmooth.system.derived.assembly import Assembler, Pattern
    from nonsmooth.system.derived.combinations import Expressions
    from nonsmooth.system.derived.patterns import Rows

__all__ = ["Ahead", "Numbers", "RowNumbers", "SeriesCode", "SeriesNumbers"]

ROUNDING = 1e-12  # of the terms of an effect: below it there is none


class Ahead(ABC):
    """Derivatives behind an instant, of one order after the other."""

    @abstractmethod
    def rates(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The next derivatives of the rates without forces of this order, the sums of their absolute terms, and the
        derivatives of the laws."""

    @abstractmethod
    def put(self, forces: FloatArray) -> None:
        """Put in the forces of this order, and go on to the next."""


class Numbers(ABC):
    """Values at one instant; ``u`` are the states there, which impulses change."""

    make: Assembler
    mode: str
    u: FloatArray

    @abstractmethod
    def copy(self) -> Numbers:
        """The same instant, to be changed apart."""

    @abstractmethod
    def value(self, expression: Any) -> float:
        """The value of an expression."""

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
    def ahead(self, some: Sequence[int], pattern: Pattern, forces: Sequence[tuple[int, Any]], laws: Any) -> Ahead:
        """The derivatives of the rates of some elements and of ``laws`` behind the instant, where others have
        ``forces`` by their laws in a combination of phases."""


class RowNumbers(Numbers):
    """Numbers of an affine system."""

    def __init__(self, rows: Rows, mode: str, w: FloatArray, step: float = 0.0) -> None:
        self.make, self.rows, self.mode, self.w = rows, rows, mode, w
        self.u = w[: rows.n]
        self.size = np.abs(w)
        self.size[: rows.n] += 0.25 * step * np.abs(rows.base(mode)) @ self.size

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

    def ahead(self, some: Sequence[int], pattern: Pattern, forces: Sequence[tuple[int, Any]], laws: Any) -> Ahead:
        return _RowsAhead(self, some, forces, laws)


class _RowsAhead(Ahead):
    """Derivatives of rows: each is a product with the matrix of the flow."""

    def __init__(self, here: RowNumbers, some: Sequence[int], forces: Sequence[tuple[int, Any]], laws: Any) -> None:
        rows = here.rows
        self.n, self.waves, self.w, self.size = rows.n, rows.rates, here.w, np.abs(here.w)
        self.field = rows.base(here.mode).copy()
        for k, law in forces:
            if hasattr(law, "values"):
                self.field += np.outer(here.direction(k), law.values)
        self.rows = np.array([rows.rate(k, here.mode).values for k in some])
        self.directions = np.array([here.direction(k) for k in some])
        self.laws = np.array([here.row(law) for law in laws]).reshape(len(laws), len(here.w))

    def rates(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        laws = self.laws @ self.w
        self.w, self.size = self._onward(self.field, self.w), self._onward(np.abs(self.field), self.size, 1.0)
        return self.rows @ self.w, np.abs(self.rows) @ self.size, laws

    def put(self, forces: FloatArray) -> None:
        self.w[: self.n] += forces @ self.directions
        self.size[: self.n] += np.abs(forces) @ np.abs(self.directions)

    def _onward(self, field: FloatArray, w: FloatArray, sign: float = -1.0) -> FloatArray:
        """The derivative in time of w; with ``sign`` 1 a bound on its size."""
        n, ahead = self.n, np.zeros_like(w)
        ahead[:n] = field @ w
        ahead[n + 1 :: 2] = sign * self.waves * w[n + 2 :: 2]
        ahead[n + 2 :: 2] = self.waves * w[n + 1 :: 2]
        return ahead


class Sized:
    """A number with a size of which its rounding is a small part: the sum of its absolute terms."""

    __slots__ = ("size", "value")

    def __init__(self, value: float, size: float | None = None) -> None:
        self.value, self.size = value, abs(value) if size is None else size

    def __float__(self) -> float:
        return self.value

    def __add__(self, other: Sized | float) -> Sized:
        if isinstance(other, Sized):
            return Sized(self.value + other.value, self.size + other.size)
        return Sized(self.value + other, self.size + abs(other))

    __radd__ = __add__

    def __neg__(self) -> Sized:
        return Sized(-self.value, self.size)

    def __sub__(self, other: Sized | float) -> Sized:
        return self + -other

    def __rsub__(self, other: float) -> Sized:
        return -self + other

    def __mul__(self, other: Sized | float) -> Sized:
        if not isinstance(other, Sized):
            return Sized(self.value * other, self.size * abs(other))
        a, b = abs(self.value), abs(other.value)
        return Sized(self.value * other.value, self.size * b + a * (other.size - b))

    __rmul__ = __mul__

    def __truediv__(self, other: Sized | float) -> Sized:
        return self * (other**-1 if isinstance(other, Sized) else 1.0 / other)

    def __rtruediv__(self, other: float) -> Sized:
        return self**-1 * other

    def __pow__(self, exponent: Sized | float) -> Sized:
        e = float(exponent)
        found = self.value**e
        off = abs(e * self.value ** (e - 1)) * (self.size - abs(self.value)) if self.value else self.size * (e == 1)
        return Sized(found, abs(found) + off)

    def __abs__(self) -> Sized:
        return Sized(abs(self.value), self.size)

    def __lt__(self, other: Sized | float) -> bool:
        return self.value < float(other)

    def __gt__(self, other: Sized | float) -> bool:
        return self.value > float(other)

    def __le__(self, other: Sized | float) -> bool:
        return self.value <= float(other)

    def __ge__(self, other: Sized | float) -> bool:
        return self.value >= float(other)


def _sized(function: Callable[..., float]) -> Callable[..., Any]:
    """A function of ``math`` of sized numbers: its size grows with its slope."""

    def of(*arguments: Sized | float) -> Sized:
        at = [float(x) for x in arguments]
        found = function(*at)
        size = abs(found)
        for i, x in enumerate(arguments):
            off = 1e-6 * (x.size if isinstance(x, Sized) else abs(x)) or 1e-300
            for near in (at[i] + off, at[i] - off):
                try:
                    size += abs(function(*at[:i], near, *at[i + 1 :]) - found) * 1e6
                except ValueError:  # beyond the end of its domain
                    continue
                break
        return Sized(found, size)

    return of


FUNCTIONS = {name: _sized(f) for name, f in vars(math).items() if callable(f)}


class SeriesCode:
    """Text of the expressions of one system, compiled for numbers of any kind; kept, and shared by all instants."""

    def __init__(self, make: Expressions) -> None:
        self.make = make
        symbols = make.symbols
        self.names: dict[sp.Basic, str] = {s: f"q{i}" for i, s in enumerate([*symbols.p.values(), *symbols.m.values()])}
        self.own: dict[sp.Basic, str] = {
            **self.names, symbols.t: "t", **{s: f"x{i}" for i, s in enumerate(make.u)},
        }  # fmt: skip
        self._values: dict[Any, Any] = {}
        self._slopes: dict[Any, list[sp.Expr]] = {}
        self._effects: dict[tuple[str, int, int], sp.Expr] = {}
        self._steps: dict[Any, tuple[Any, Any]] = {}

    def value(self, expression: sp.Expr) -> Any:
        """The code of one expression."""
        from nonsmooth.system.symbolic.printing import Printer

        if expression not in self._values:
            self._values[expression] = compile(Printer(self.own)(expression), "<instant>", "eval")
        return self._values[expression]

    def slopes(self, expression: sp.Expr) -> list[sp.Expr]:
        """Its derivatives in the states."""
        if expression not in self._slopes:
            self._slopes[expression] = [sp.diff(expression, symbol) for symbol in self.make.u]
        return self._slopes[expression]

    def effect(self, mode: str, i: int, j: int) -> sp.Expr:
        """The change of the derivative of the rate of element i by a unit force of element j."""
        key = mode, i, j
        if key not in self._effects:
            self._effects[key] = self.make.across(self.make.rate(i, mode), self.make.parts[j])
        return self._effects[key]

    def steps(
        self, mode: str, some: Sequence[int], pattern: Pattern, forces: Sequence[tuple[int, Any]], laws: Sequence[Any]
    ) -> tuple[Any, Any]:
        """Code that writes the coefficients 0, and that of the next ones: of the states, then of the forces of some
        elements, which are inputs, then of the derivatives of their rates, then of the laws."""
        from nonsmooth.system.codegen.jet import jet_steps

        key = mode, tuple(some), pattern, tuple(laws)
        if key not in self._steps:
            make = self.make
            field = make.base(mode)
            inputs = [sp.Symbol(f"force_{k}", real=True) for k in some]
            for k, law in [*forces, *zip(some, inputs, strict=True)]:
                field = make.moved(field, make.parts[k], law)
            rates = [make.along(make.rate(k, mode), field) for k in some]
            first, following = jet_steps(
                make.symbols.t, (*make.u, *inputs), self.names, [*field, *([sp.S.Zero] * len(inputs))],
                [*rates, *map(sp.sympify, laws)],
            )  # fmt: skip
            self._steps[key] = (
                compile("\n".join(first), "<instant>", "exec"), compile("\n".join(following), "<instant>", "exec"),
            )  # fmt: skip
        return self._steps[key]


class SeriesNumbers(Numbers):
    """Numbers of a system whose expressions are any that have Taylor series."""

    def __init__(
        self, code: SeriesCode, mode: str, t: float, u: FloatArray, constants: Sequence[float], step: float = 0.0
    ) -> None:
        self.make, self.code, self.mode, self.t, self.constants = code.make, code, mode, t, constants
        self.u = u.copy()
        self.size = np.abs(u)
        self.names = self._names()
        if step:
            self.size = self.size + 0.25 * step * np.array([self._sized(e).size for e in code.make.base(mode)])
            self.names = self._names()

    def _names(self) -> dict[str, Any]:
        """The numbers at this instant by their names in code."""
        return {
            **FUNCTIONS, "t": Sized(self.t), **{f"q{i}": Sized(value) for i, value in enumerate(self.constants)},
            **{f"x{i}": Sized(value, size) for i, (value, size) in enumerate(zip(self.u, self.size, strict=True))},
        }  # fmt: skip

    def _sized(self, expression: Any) -> Sized:
        expression = sp.sympify(expression)
        if expression.is_Number:
            return Sized(float(expression))
        found = eval(self.code.value(expression), self.names)
        return found if isinstance(found, Sized) else Sized(found)

    def copy(self) -> SeriesNumbers:
        found = SeriesNumbers(self.code, self.mode, self.t, self.u, self.constants)
        found.size, found.names = self.size, self.names
        return found

    def value(self, expression: Any) -> float:
        return self._sized(expression).value

    def terms(self, expression: Any) -> float:
        return self._sized(expression).size

    def slopes(self, expression: Any) -> FloatArray:
        return np.array([self.value(e) for e in self.code.slopes(expression)])

    def direction(self, k: int) -> FloatArray:
        found = np.zeros(len(self.u))
        for i, e in self.make.parts[k].direction.items():
            found[i] = self.value(e)
        return found

    def effects(self, some: Sequence[int], by: Sequence[int]) -> FloatArray:
        found = np.zeros((len(some), len(by)))
        for a, i in enumerate(some):
            for b, j in enumerate(by):
                effect = self._sized(self.code.effect(self.mode, i, j))
                found[a, b] = effect.value if abs(effect.value) > ROUNDING * effect.size else 0.0
        return found

    def shift(self, change: FloatArray) -> None:
        self.u = self.u + change
        self.names = self._names()

    def ahead(self, some: Sequence[int], pattern: Pattern, forces: Sequence[tuple[int, Any]], laws: Any) -> Ahead:
        return _SeriesAhead(self, self.code.steps(self.mode, some, pattern, forces, laws), len(some), len(laws))


class _SeriesAhead(Ahead):
    """Taylor coefficients: the k-th derivative is k! times the k-th of them, in forces, rates and bounds alike."""

    def __init__(self, here: SeriesNumbers, steps: tuple[Any, Any], count: int, laws: int) -> None:
        n = len(here.u)
        self.steps, self.order, self.n, self.count, self.laws = steps, 0, n, count, laws
        self.C: dict[tuple[int, int], Any] = {}
        states = [here.names[f"x{i}"] for i in range(n)]
        self.known: Mapping[str, Any] = {**here.names, "C": self.C, "W": {}, "u": states + [Sized(0.0)] * count}

    def rates(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        self._step(np.zeros(self.count))
        first = self.n + self.count
        rates = [self.C[row, self.order] for row in range(first, first + self.count)]
        laws = [float(self.C[row, self.order]) for row in range(first + self.count, first + self.count + self.laws)]
        found = [one if isinstance(one, Sized) else Sized(one) for one in rates]
        return np.array([one.value for one in found]), np.array([one.size for one in found]), np.array(laws)

    def put(self, forces: FloatArray) -> None:
        self.known = self._step(forces)
        self.order += 1

    def _step(self, forces: FloatArray) -> dict[str, Any]:
        """Write the coefficients of this order; the numbers by their names behind it."""
        names = {**self.known, "k": self.order}
        inputs = [Sized(float(force)) for force in forces]
        if self.order == 0:
            names["u"] = [*names["u"][: self.n], *inputs]
            exec(self.steps[0], names)
            return names
        for j, one in enumerate(inputs, start=self.n):
            names[f"c{j}"] = self.C[j, self.order] = one
        exec(self.steps[1], names)
        return names
