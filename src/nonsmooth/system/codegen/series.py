"""Expressions taken apart for their Taylor series: linear forms over nodes, and the nodes' recurrences.

A field like (rho cos(omega t) - 2 k x - c v)/m becomes h0 cos + h1 x + h2 v with coefficients that depend on
parameters only and are computed once per call; every nonlinear operation becomes a node of ``recurrences``, the
same node wherever it occurs.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import sympy
from sympy import Basic, Expr, Symbol
from sympy.logic.boolalg import Boolean

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.codegen import recurrences
from nonsmooth.system.codegen.recurrences import Node
from nonsmooth.system.symbolic.printing import CORNERS, Printer, assignments

ZERO, ONE = sympy.S.Zero, sympy.S.One
_NAMED = re.compile(r"\bh\d+\b")


class CornerError(SystemDefinitionError):
    """The expression has a corner in the state or the time, so that it has no Taylor series."""


@dataclass(frozen=True)
class Linear:
    """``constant`` + sum of coefficient * node; constant and coefficients hold parameters only."""

    constant: Expr
    terms: tuple[tuple[int, Expr], ...] = ()

    def scaled(self, factor: Expr) -> Linear:
        return Linear(self.constant * factor, tuple((node, c * factor) for node, c in self.terms))


def _added(parts: Iterable[Linear]) -> Linear:
    constant: Expr = ZERO
    terms: dict[int, Expr] = {}
    for part in parts:
        constant += part.constant
        for node, coefficient in part.terms:
            terms[node] = terms.get(node, ZERO) + coefficient
    return Linear(constant, tuple((node, c) for node, c in terms.items() if c != 0))


def _single(node: int, factor: Expr = ONE) -> Linear:
    return Linear(ZERO, ((node, factor),))


def _times_of(a: int, b: int) -> Callable[[int], Node]:
    return lambda y: recurrences.times(a, b)


class Series:
    """The nodes that some expressions need, the states being the first; ``time`` is that of the time itself, or -1.

    The variables are t and u; all other symbols, by ``names``, are constant along a trajectory."""

    def __init__(self, t: Symbol, u: tuple[Symbol, ...], names: dict[Basic, str]) -> None:
        self.t, self.u, self.names = t, u, names
        self.nodes = [Node(f"u[{i}]", lambda s: "") for i in range(len(u))]
        self.time = -1
        self._known: dict[object, int] = {}
        self._linear: dict[Basic, Linear] = {}
        self._hoisted: dict[Basic, str] = {}
        self._printer = Printer(names)
        self._variables = {t, *u}

    # -- constants ---------------------------------------------------------------------------------------------

    def constant(self, expression: Expr) -> str:
        """A name for (or the digits of) an expression of parameters, computed once per call."""
        if isinstance(expression, sympy.Number | sympy.NumberSymbol) or expression in self.names:
            return self._printer(expression)
        if expression not in self._hoisted:
            if expression.could_extract_minus_sign() and -expression in self._hoisted:
                return "-" + self._hoisted[-expression]
            self._hoisted[expression] = f"h{len(self._hoisted)}"
        return self._hoisted[expression]

    def constant_lines(self, lines: Iterable[str], before: Iterable[str] = ()) -> list[str]:
        """The lines that compute the constants that some lines need, but for those that lines before them needed."""
        used = set(_NAMED.findall("\n".join(lines))) - set(_NAMED.findall("\n".join(before)))
        printer = Printer(dict(self.names))
        found = assignments([(name, e) for e, name in self._hoisted.items() if name in used], printer, "g")
        self._printer.used |= printer.used
        return found

    @property
    def functions(self) -> set[str]:
        """Functions of ``math`` that the code needs."""
        return self._printer.used

    def _at_first(self, function: str, a: Linear) -> str:
        """The text of coefficient 0 of a function of a linear form."""
        return f"{self._math(function)}({self.combination(a, True)})"

    def _math(self, function: str) -> str:
        self._printer.used.add(function)
        return function

    # -- linear forms ------------------------------------------------------------------------------------------

    def combination(self, a: Linear, first: bool) -> str:
        """Text of coefficient 0 (``first``) or k of a linear form."""
        letter = "z" if first else "c"
        # The constant first: near a surface, x - g is then exact.
        parts = [self.constant(a.constant)] if first and (a.constant != 0 or not a.terms) else []
        for node, coefficient in a.terms:
            c = self.constant(coefficient)
            name = f"{letter}{node}"
            parts.append({"1.0": name, "-1.0": "-" + name}.get(c, f"{c}*{name}"))
        return " + ".join(parts).replace("+ -", "- ") or "0.0"

    def linear(self, expression: Expr) -> Linear:
        """The expression as a linear form over nodes, making the nodes it needs; CornerError where it has a corner in a
        variable, SystemDefinitionError where it holds a function without known series."""
        if expression not in self._linear:
            self._linear[expression] = self._taken_apart(expression)
        return self._linear[expression]

    def _taken_apart(self, e: Expr) -> Linear:
        if e == self.t:
            self.time = self._node("time", lambda y: Node("t", lambda s: ""))
            return _single(self.time)
        if not e.free_symbols & self._variables:
            return Linear(e)
        if e.is_Symbol:
            return _single(self.u.index(e))
        if e.is_Add:
            return _added(self.linear(a) for a in e.args)
        if e.is_Mul:
            return self._product(e)
        if e.is_Pow:
            return self._power(*e.args)
        if isinstance(e, sympy.Piecewise) and not any(c.free_symbols & self._variables for _, c in e.args):
            return self._chosen(e)
        if isinstance(e, (*CORNERS, Boolean)):
            raise CornerError(f"{e} has a corner")
        if isinstance(e, sympy.atan2):
            return self._atan2(*e.args)
        return self._function(e)

    def _node(self, key: object, make: Callable[[int], Node]) -> int:
        """The node made before for this key, or a new one; ``make`` is given its number."""
        if key not in self._known:
            self.nodes.append(make(len(self.nodes)))
            self._known[key] = len(self.nodes) - 1
        return self._known[key]

    def _two_nodes(self, key: object, make: Callable[[int], tuple[Node, Node]]) -> int:
        """The same for a pair; the number of the first."""
        if key not in self._known:
            self._known[key] = len(self.nodes)
            self.nodes.extend(make(len(self.nodes)))
        return self._known[key]

    def _stripped(self, a: Linear) -> tuple[Expr, int]:
        """(factor, node) with a = factor * node; a node of its own where there are several terms."""
        if a.constant == 0 and len(a.terms) == 1:
            return a.terms[0][1], a.terms[0][0]
        return ONE, self._whole(a)

    def _whole(self, a: Linear) -> int:
        """A node that equals ``a``."""
        if a.constant == 0 and len(a.terms) == 1 and a.terms[0][1] == 1:
            return a.terms[0][0]
        value, step = self.combination(a, True), self.combination(a, False)
        needs = tuple(node for node, _ in a.terms)
        return self._node(("linear", a), lambda y: Node(value, lambda s: step, needs))

    # -- operations --------------------------------------------------------------------------------------------

    def _product(self, e: Expr) -> Linear:
        factor: Expr = ONE
        above: list[Linear] = []
        below: list[Linear] = []
        for part in e.args:
            if not part.free_symbols & self._variables:
                factor *= part
            elif part.is_Pow and part.exp == -1:
                below.append(self.linear(part.base))
            else:
                above.append(self.linear(part))
        if len(above) == 1 and not below:
            return above[0].scaled(factor)
        top, bottom = [self._stripped(a) for a in above], [self._stripped(a) for a in below]
        factor = sympy.Mul(factor, *(c for c, _ in top), *(1 / c for c, _ in bottom))
        a = self._times([node for _, node in top]) if top else -1
        if not below:
            return _single(a, factor)
        b = self._times([node for _, node in bottom])
        if not above:
            return self._inverse(b, factor)
        return _single(self._node(("quotient", a, b), lambda y: recurrences.quotient(y, a, b)), factor)

    def _inverse(self, b: int, factor: Expr) -> Linear:
        return _single(self._node(("inverse", b), lambda y: recurrences.inverse(y, b)), factor)

    def _times(self, factors: list[int]) -> int:
        """Product of nodes; pairs that exist already are used first."""
        factors = sorted(factors)
        while len(factors) > 1:
            pairs = [(a, b) for i, a in enumerate(factors) for b in factors[i + 1 :]]
            pair = next((pair for pair in pairs if ("times", pair) in self._known), pairs[0])
            for node in pair:
                factors.remove(node)
            factors.append(self._node(("times", pair), _times_of(*pair)))
            factors.sort()
        return factors[0]

    def _power(self, base: Expr, exponent: Expr) -> Linear:
        if exponent.free_symbols & self._variables:
            return self._exponential(self.linear(exponent * sympy.log(base)))
        if isinstance(exponent, sympy.Integer) and (exponent > 0 or exponent == -1):
            factor, a = self._stripped(self.linear(base))
            if exponent == -1:
                return self._inverse(a, 1 / factor)
            return _single(self._integer_power(a, int(exponent)), factor**exponent)
        # A factor stays inside: it may be negative, and so may the rest.
        a = self._whole(self.linear(base))
        if exponent == sympy.S.Half:
            return _single(self._node(("root", a), lambda y: recurrences.root(y, a, self._math("sqrt"))))
        e, e_plus_one = self.constant(exponent), self.constant(exponent + 1)
        if isinstance(exponent, sympy.Integer):
            value = f"1.0/z{a}**{-int(exponent)}"
        elif exponent == -sympy.S.Half:
            value = f"1.0/{self._math('sqrt')}(z{a})"
        else:
            value = f"z{a}**({e})"
        return _single(
            self._node(("power", a, exponent), lambda y: recurrences.power(y, a, value, e, e_plus_one)),
        )

    def _integer_power(self, a: int, n: int) -> int:
        """By squaring: it holds where a is zero, too."""
        node, square = -1, a
        while n:
            if n & 1:
                node = square if node < 0 else self._times([node, square])
            n >>= 1
            square = self._times([square, square]) if n else square
        return node

    def _function(self, e: Expr) -> Linear:
        makers: dict[type, Callable[[Linear], Linear]] = {
            sympy.exp: self._exponential,
            sympy.log: self._logarithm,
            sympy.sin: lambda a: _single(self._pair(a, "sin", "cos")),
            sympy.cos: lambda a: _single(self._pair(a, "sin", "cos") + 1),
            sympy.sinh: lambda a: _single(self._pair(a, "sinh", "cosh")),
            sympy.cosh: lambda a: _single(self._pair(a, "sinh", "cosh") + 1),
            sympy.tan: lambda a: self._tangent(a, "tan"),
            sympy.tanh: lambda a: self._tangent(a, "tanh"),
            sympy.atan: lambda a: self._inverse_function(a, "atan", lambda x: 1 + x**2),
            sympy.asin: lambda a: self._inverse_function(a, "asin", lambda x: sympy.sqrt(1 - x**2)),
            sympy.acos: lambda a: self._inverse_function(a, "acos", lambda x: -sympy.sqrt(1 - x**2)),
            sympy.asinh: lambda a: self._inverse_function(a, "asinh", lambda x: sympy.sqrt(1 + x**2)),
            sympy.acosh: lambda a: self._inverse_function(a, "acosh", lambda x: sympy.sqrt(x**2 - 1)),
            sympy.atanh: lambda a: self._inverse_function(a, "atanh", lambda x: 1 - x**2),
        }
        if type(e) not in makers:
            raise SystemDefinitionError(
                f"no Taylor series is known for {e} ({type(e).__name__}); allowed are + - * / **, "
                f"{', '.join(sorted(kind.__name__ for kind in makers))} and atan2"
            )
        return makers[type(e)](self.linear(e.args[0]))

    def _rate_in_time(self, a: Linear) -> Expr | None:
        """The rate w where a = w t + constant."""
        return a.terms[0][1] if len(a.terms) == 1 and a.terms[0][0] == self.time else None

    def _exponential(self, a: Linear) -> Linear:
        value, rate = self._at_first("exp", a), self._rate_in_time(a)
        if rate is not None:
            w = self.constant(rate)
            return _single(self._node(("exp", a), lambda y: recurrences.exponential_in_time(y, value, w)))
        factor, x = self._stripped(a)
        w = self.constant(factor)
        return _single(self._node(("exp", a), lambda y: recurrences.exponential(y, x, value, w)))

    def _logarithm(self, a: Linear) -> Linear:
        x = self._whole(a)
        return _single(self._node(("log", x), lambda y: recurrences.logarithm(y, x, self._math("log"))))

    def _pair(self, a: Linear, odd: str, even: str) -> int:
        """The node of sin or sinh; that of cos or cosh is the next."""
        values, hyperbolic = (self._at_first(odd, a), self._at_first(even, a)), odd == "sinh"
        rate = self._rate_in_time(a)
        if rate is not None:
            w = self.constant(rate)
            return self._two_nodes((odd, a), lambda y: recurrences.circular_in_time(y, values, w, hyperbolic))
        factor, x = self._stripped(a)
        w = self.constant(factor)
        return self._two_nodes((odd, a), lambda y: recurrences.circular(y, x, values, w, hyperbolic))

    def _tangent(self, a: Linear, name: str) -> Linear:
        value, (factor, x) = self._at_first(name, a), self._stripped(a)
        w = self.constant(factor)
        return _single(self._two_nodes((name, a), lambda y: recurrences.tangent(y, x, value, w, name == "tanh")))

    def _inverse_function(self, a: Linear, name: str, slope: Callable[[Expr], Expr]) -> Linear:
        x, stand_in = self._whole(a), sympy.Dummy()
        self._variables.add(stand_in)
        self._linear[stand_in] = _single(x)
        w = self._whole(self.linear(slope(stand_in)))
        return _single(self._node((name, x), lambda y: recurrences.inverse_function(y, x, w, self._math(name))))

    def _atan2(self, above: Expr, right: Expr) -> Linear:
        b, a = self._whole(self.linear(above)), self._whole(self.linear(right))
        w = self._whole(_added([_single(self._times([a, a])), _single(self._times([b, b]))]))
        return _single(self._node(("atan2", b, a), lambda y: recurrences.angle(y, b, a, w, self._math("atan2"))))

    def _chosen(self, e: sympy.Piecewise) -> Linear:
        """A choice by parameters only: the coefficients of the branch that holds."""
        branches = [(self.linear(value), self._printer(condition)) for value, condition in e.args]
        value = step = self._printer(sympy.nan)
        for a, condition in reversed(branches):
            value = f"({self.combination(a, True)} if {condition} else {value})"
            step = f"({self.combination(a, False)} if {condition} else {step})"
        needs = tuple(dict.fromkeys(node for a, _ in branches for node, _ in a.terms))
        return _single(self._node(("chosen", e), lambda y: Node(value, lambda s: step, needs)))
