"""The calculus of any system: expressions of SymPy, as a user would have written them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import sympy as sp

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SystemDefinitionError, shortened, unknown
from nonsmooth.system.derived.assembly import Assembler, Pattern
from nonsmooth.system.derived.calculus import Part, kept
from nonsmooth.system.derived.elements import Element
from nonsmooth.system.derived.elements.element import Condition, Law
from nonsmooth.system.derived.faces import INDEPENDENT
from nonsmooth.system.symbolic.scalar import Scalar, to_expression
from nonsmooth.system.symbolic.traced import along
from nonsmooth.system.symbolic.tracing import Symbols, call_scalar, one_number

OTHER = 8  # draws from here on have other parameters too
SPEED = sp.Symbol("speed_", real=True)  # in a law of it


class Expressions(Assembler):
    """The calculus of expressions: a vector is a list of them, one for each state."""

    def __init__(
        self,
        symbols: Symbols,
        base: Mapping[str, tuple[sp.Expr, ...]],
        elements: Mapping[str, Element],
        scale: Mapping[str, float],
        values: Mapping[sp.Symbol, float],
    ) -> None:
        self.symbols, self.fields, self.scale, self.values, self.draws = symbols, base, scale, values, (1, OTHER)
        self.u = tuple(symbols.u.values())
        self.inputs = [i for i, name in enumerate(symbols.u) if name in symbols.inputs]
        self.parts = [self._part(name, element) for name, element in elements.items()]
        self.indicators: dict[str, sp.Expr] = {}
        self._known: dict[tuple[str, sp.Expr], str] = {}

    # What the user gave

    def _call(self, function: Any, what: str) -> sp.Expr:
        return call_scalar(function, self.symbols.arguments(), what)

    def _given(self, given: Law, what: str) -> sp.Expr:
        """A number, the name of a parameter or of memory, or a function of t, u, p."""
        if isinstance(given, str):
            known = {**self.symbols.p, **self.symbols.m}
            if given not in known:
                raise SystemDefinitionError(f"{what}: {unknown(given, 'a parameter', 'this system', list(known))}")
            return known[given]
        return self._call(given, what) if callable(given) else one_number(given, what)

    def _part(self, name: str, element: Element) -> Part:
        what, names = f"element {name!r}", list(self.symbols.u)
        if not isinstance(element, Element):
            raise SystemDefinitionError(f"{what} is one of nonsmooth.elements, not {shortened(element)}")
        if element.on is None:
            raise SystemDefinitionError(f"{what}: at= is for ns.mechanical; here give {element.kinematics}= and on=")
        direction = {}
        for state, given in element.on.items():
            if state not in self.symbols.u:
                raise SystemDefinitionError(f"{what}: {unknown(state, 'a state', 'this system', names)}")
            direction[names.index(state)] = self._given(given, f"on[{state!r}] of {what}")
        own = getattr(element, element.kinematics)
        return Part(name, element, direction, self._call(own, f"{element.kinematics} of {what}"))

    @kept
    def law(self, k: int, name: str, side: int | None = None) -> sp.Expr:
        part = self.parts[k]
        given, what = getattr(part.element, name), f"{name} of element {part.name!r}"
        if side is not None and callable(given) and _arguments(given) == 2:
            return call_scalar(given, (Scalar(side * part.where), self.symbols.parameters()), what)
        return self._given(given, what)

    def spoken(self, k: int, name: str) -> sp.Expr:
        """A law as an expression; one of the speed's magnitude in the symbol ``SPEED``."""
        given = getattr(self.parts[k].element, name)
        if callable(given) and _arguments(given) == 2:
            return call_scalar(given, (Scalar(SPEED), self.symbols.parameters()), name)
        return self.law(k, name)

    # Calculus

    def base(self, mode: str) -> list[sp.Expr]:
        return list(self.fields[mode])

    def identity(self) -> list[sp.Expr]:
        return list(self.u)

    def along(self, expression: sp.Expr, field: Sequence[sp.Expr]) -> sp.Expr:
        return sp.expand(along(expression, self.symbols.t, self.u, field))

    def across(self, expression: sp.Expr, part: Part) -> sp.Expr:
        return sp.Add(*[sp.diff(expression, self.u[i]) * d for i, d in part.direction.items()])

    def moved(self, vector: Sequence[sp.Expr], part: Part, amount: sp.Expr) -> list[sp.Expr]:
        return [entry + part.direction.get(i, 0) * amount for i, entry in enumerate(vector)]

    def holding(
        self, vector: list[sp.Expr], rate: sp.Expr, value: sp.Expr, known: set[int], states: bool = False
    ) -> list[sp.Expr]:
        slopes = [sp.diff(rate, symbol) for symbol in self.u]
        some = [i for i, slope in enumerate(slopes) if slope != 0 and i not in known]
        if len(some) != 1 or sp.diff(rate, self.symbols.t) != 0 or not all(slope.is_number for slope in slopes):
            return vector
        (i,) = some
        known.add(i)
        own = rate - sp.Add(*map(sp.Mul, slopes, self.u)) if states else 0
        others = sp.Add(*[slope * entry for j, (slope, entry) in enumerate(zip(slopes, vector, strict=True)) if j != i])
        return [*vector[:i], sp.expand((value - own - others) / slopes[i]), *vector[i + 1 :]]

    def joined(self, part: Part, other: Part, share: Any) -> Part:
        both = {*part.direction, *other.direction}
        return replace(part, direction={i: part.direction.get(i, 0) + share * other.direction.get(i, 0) for i in both})

    def shifted_back(self, states: Sequence[sp.Expr], expression: sp.Expr) -> list[sp.Expr]:
        slopes = [0 if i in self.inputs else sp.diff(expression, symbol) for i, symbol in enumerate(self.u)]
        length = sp.Add(*[slope**2 for slope in slopes])
        return self.tidy([x - expression * s / length for x, s in zip(states, slopes, strict=True)])

    def behind(self, expression: sp.Expr, states: Sequence[sp.Expr]) -> sp.Expr:
        return sp.sympify(expression).subs(dict(zip(self.u, states, strict=True)), simultaneous=True)

    def mapped(self, states: Sequence[sp.Expr], before: Sequence[sp.Expr]) -> list[sp.Expr]:
        return [self.behind(one, before) for one in states]

    def solved(self, matrix: list[list[sp.Expr]], right: list[Any]) -> list[sp.Expr]:
        found = list(sp.Matrix(matrix).LUsolve(sp.Matrix(right)))
        return [sp.cancel(value) for value in found] if len(found) > 1 else found

    def vanishes(self, expression: Any) -> bool:
        expanded = sp.expand(expression)
        return expanded == 0 or (not expanded.is_number and sp.simplify(expanded) == 0)

    def size(self, expression: sp.Expr) -> sp.Expr:
        found = [self.scale[name] for name, symbol in self.symbols.u.items() if expression.has(symbol)]
        return to_expression(max(found, default=1.0))

    def tidy(self, states: Sequence[sp.Expr]) -> list[sp.Expr]:
        return [sp.expand(sp.cancel(entry)) for entry in states]

    @kept
    def flow(
        self, mode: str, pattern: Pattern, some: Collection[int] | None = None
    ) -> tuple[list[sp.Expr], dict[int, sp.Expr]]:
        field, forces = super().flow(mode, pattern, some)
        return [sp.expand(entry) for entry in field], {k: sp.expand(force) for k, force in forces.items()}

    @kept
    def slopes(self, expression: sp.Expr, draw: int = 0) -> FloatArray:
        return self._numbers([sp.diff(expression, symbol) for symbol in self.u], draw)

    def pushes(self, part: Part, draw: int = 0) -> FloatArray:
        return self._numbers([part.direction.get(i, sp.Integer(0)) for i in range(len(self.u))], draw)

    def touched(self, part: Part) -> Any:
        return np.array([part.direction.get(i, 0) != 0 for i in range(len(self.u))])

    def involved(self, expression: sp.Expr) -> Any:
        return np.array([symbol in expression.free_symbols for symbol in self.u])

    def _numbers(self, expressions: Sequence[Any], draw: int) -> FloatArray:
        """Their values in a state drawn at random; from ``OTHER`` on at parameters drawn at random too."""
        return np.array([float(sp.sympify(one).xreplace(self._drawn(draw))) for one in expressions])

    @kept
    def _drawn(self, draw: int) -> dict[sp.Basic, sp.Float]:
        at, rng = dict(self.values), np.random.default_rng(draw)
        for symbol in [self.symbols.t, *self.u, *self.symbols.m.values(), *(at if draw >= OTHER else ())]:
            at[symbol] = rng.uniform(0.5, 1.5)
        return {symbol: sp.Float(value) for symbol, value in at.items()}

    def feels(self) -> set[sp.Basic]:
        """The symbols of which the places of elements and the rates that they hold are made."""
        bearing = [k for k, part in enumerate(self.parts) if part.element.held]
        rates = [self.rate(k, mode) for k in bearing for mode in self.fields]
        return set[sp.Basic]().union(*(e.free_symbols for e in (*rates, *(part.where for part in self.parts))))

    @kept
    def may_hold(self, some: tuple[int, ...], mode: str) -> bool:
        """Return whether some elements can be held at once."""
        rates = [self.rate(k, mode) for k in some]
        gaps = [self.parts[k].where for k in some if self.parts[k].element.bears]
        return self._vanish_together(rates, OTHER) and self._vanish_together(gaps, 2)

    def _vanish_together(self, expressions: Sequence[sp.Expr], draw: int) -> bool:
        """Return whether expressions may be zero at once: not where a sum of them is a number other than zero, as far
        as drawn states (with ``OTHER`` parameters too) tell."""
        chosen: list[sp.Expr] = []
        for one in expressions:
            before = np.array([self.slopes(other) for other in chosen]).reshape(len(chosen), len(self.u))
            sums, off = np.linalg.lstsq(before.T, self.slopes(one), rcond=None)[0], np.inf
            if len(chosen):
                off = np.abs(before.T @ sums - self.slopes(one)).max()
            if off > INDEPENDENT * np.abs(self.slopes(one)).max():
                chosen.append(one)
                continue
            left = [n[0] - sums @ n[1:] for n in (self._numbers([one, *chosen], draw) for draw in (0, 1, draw))]
            if abs(left[0]) > INDEPENDENT and np.ptp(left) < INDEPENDENT * abs(left[0]):
                return False
        return True

    # What a user would have written

    def ranges(self, mode: str) -> list[tuple[sp.Expr, str]]:
        """Expressions of the parameters that must not be negative, each with the sentence for where it is.

        Where a number is, or what must not be with the parameters as they are given, the sentence is raised."""
        known, found = set(self.symbols.p.values()), []
        for k in range(len(self.parts)):
            here = self.place(k, mode, (0,) * len(self.parts))
            rows = [(sp.sympify(e), text) for e, text in here.element.ranges(here)]
            found += [(e, text) for e, text in rows if e.free_symbols and e.free_symbols <= known]
            read = isinstance(here.element.given, str)  # of a text: it was given before, at other values maybe
            given = () if read else (*here.element.limits(here), here.effect())
            for e, sentence in (*rows, *((sp.sympify(sp.sympify(e).xreplace(self.values)), text) for e, text in given)):
                if e.is_number and e < 0:
                    raise SystemDefinitionError(sentence)
        return found

    def condition(self, rows: Sequence[Condition], owner: str) -> str:
        """The text of a condition; its expressions become indicators, equal ones of an element the same."""
        words = []
        for expression, sign, name, strict in rows:
            indicator = sp.expand(expression)
            key = owner, indicator
            if key not in self._known:
                unique, n = f"{owner}_{name}" if owner else name, 1
                while unique in self.indicators:
                    n += 1
                    unique = f"{owner}_{name}_{n}" if owner else f"{name}_{n}"
                self._known[key] = unique
                self.indicators[unique] = indicator
            words.append(f"{self._known[key]} {'>' if sign > 0 else '<'}{'' if strict else '='} 0")
        return " and ".join(words)


def _arguments(function: Callable[..., Any]) -> int:
    """Number of arguments that a function must be given: a law of the speed takes two, others three."""
    kinds = inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD
    try:
        found = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):  # a function of C
        return 3
    return sum(one.kind in kinds and one.default is one.empty for one in found)
