"""Taylor jets: the recurrences that give the coefficients of a solution's power series, order by order.

An expression is taken apart into a linear form over *nodes* (states, the time, and values of nonlinear
operations). The k-th coefficient of a node follows from lower ones; the sums over earlier coefficients of all
nodes run in one inner loop, which leaves the processor many independent chains of additions. Coefficients of
linear forms depend on parameters only and are computed once per call.

Recurrences: G. Corliss, Y. F. Chang, ACM Trans. Math. Softw. 8 (1982) 114-144; A. Griewank, A. Walther,
*Evaluating Derivatives* (2008), ch. 13.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import sympy
from sympy import Basic, Expr, Symbol

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.printing import Printer, assignments, is_corner

__all__ = ["CornerError", "Linear", "Series"]

Sum = tuple[str, int, int]  # (weight, x, y): sum over 0 < j < k of weight * x[j] * y[k - j]


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
    constant: Expr = sympy.S.Zero
    terms: dict[int, Expr] = {}
    for part in parts:
        constant += part.constant
        for node, coefficient in part.terms:
            terms[node] = terms.get(node, sympy.S.Zero) + coefficient
    return Linear(constant, tuple((node, c) for node, c in terms.items() if c != 0))


def _scaled(factor: str, text: str) -> str:
    return {"1.0": text, "-1.0": f"-({text})"}.get(factor, f"{factor}*({text})")


def _opposite(factor: str) -> str:
    return factor[1:] if factor.startswith("-") else "-" + factor


@dataclass
class Node:
    """One series: the text of its coefficient 0 and, in ``step``, of its coefficient k.

    There z3 is coefficient 0 and c3 coefficient k of node 3, r is 1/k, and s[0], s[1], ... are the names of the
    inner sums ``sums``. ``needs`` are the nodes computed before it, ``partner`` one that is always computed
    too. Where ``carried``, c of the node and of its partner stand for coefficient k - 1.
    """

    value: str
    step: Callable[[list[str]], str]
    needs: tuple[int, ...] = ()
    sums: tuple[Sum, ...] = ()
    partner: int = -1
    carried: bool = False


@dataclass
class Series:
    """The nodes of one mode's field, indicators and outputs, and the code that computes them.

    Parameters
    ----------
    t, u : Symbol, tuple of Symbol
        The variables; all other symbols are constant along a trajectory.
    names : dict
        Constant symbol -> identifier.
    """

    t: Symbol
    u: Sequence[Symbol]
    names: dict[Basic, str]
    nodes: list[Node] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._known: dict[object, int] = {}
        self._linear: dict[Basic, Linear] = {}
        self._hoisted: dict[Basic, str] = {}
        self._printer = Printer(self.names)
        self._variables = {self.t, *self.u}
        for i in range(len(self.u)):
            self.nodes.append(Node(f"u[{i}]", lambda s: ""))
            self._known["state", i] = i
        self.time = -1

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

    def constant_lines(self) -> list[str]:
        lines = assignments([(name, e) for e, name in self._hoisted.items()], self._printer, "g")
        return lines

    @property
    def functions(self) -> set[str]:
        """Functions of ``math`` that the code needs."""
        return self._printer.used

    def _math(self, function: str) -> str:
        self._printer.used.add(function)
        return function

    # -- expressions to linear forms ---------------------------------------------------------------------------

    def linear(self, expression: Expr) -> Linear:
        """The expression as a linear form over nodes, making the nodes it needs."""
        if expression not in self._linear:
            self._linear[expression] = self._taken_apart(expression)
        return self._linear[expression]

    def _taken_apart(self, e: Expr) -> Linear:
        if e == self.t:
            return self._single(self._time_node())
        if e.is_Symbol:
            return self._single(self.u.index(e)) if e in self._variables else Linear(e)
        if not e.args or not e.free_symbols & self._variables:
            return Linear(e)
        if e.is_Add:
            return _added(self.linear(a) for a in e.args)
        if e.is_Mul:
            return self._product(e)
        if e.is_Pow:
            return self._power(*e.args)
        if isinstance(e, sympy.Piecewise) and not any(c.free_symbols & self._variables for _, c in e.args):
            return self._chosen(e)
        if is_corner(e):
            raise CornerError(f"{e} has a corner")
        if isinstance(e, sympy.atan2):
            return self._atan2(*e.args)
        argument = self.linear(e.args[0])
        makers: dict[type, Callable[[Linear], Linear]] = {
            sympy.exp: self._exp,
            sympy.log: self._log,
            sympy.sin: lambda a: self._pair(a, "sin", "cos", "-")[0],
            sympy.cos: lambda a: self._pair(a, "sin", "cos", "-")[1],
            sympy.sinh: lambda a: self._pair(a, "sinh", "cosh", "")[0],
            sympy.cosh: lambda a: self._pair(a, "sinh", "cosh", "")[1],
            sympy.tan: lambda a: self._tangent(a, "tan", ""),
            sympy.tanh: lambda a: self._tangent(a, "tanh", "-"),
            sympy.atan: lambda a: self._integral(a, "atan", lambda x: 1 + x**2),
            sympy.asin: lambda a: self._integral(a, "asin", lambda x: sympy.sqrt(1 - x**2)),
            sympy.acos: lambda a: self._integral(a, "acos", lambda x: -sympy.sqrt(1 - x**2)),
            sympy.asinh: lambda a: self._integral(a, "asinh", lambda x: sympy.sqrt(1 + x**2)),
            sympy.acosh: lambda a: self._integral(a, "acosh", lambda x: sympy.sqrt(x**2 - 1)),
            sympy.atanh: lambda a: self._integral(a, "atanh", lambda x: 1 - x**2),
        }
        if type(e) in makers:
            return makers[type(e)](argument)
        raise SystemDefinitionError(
            f"no Taylor series is known for {e} ({type(e).__name__}); allowed are + - * / **, "
            f"{', '.join(sorted(kind.__name__ for kind in makers))} and atan2"
        )

    @staticmethod
    def _single(node: int) -> Linear:
        return Linear(sympy.S.Zero, ((node, sympy.S.One),))

    def _node(self, key: object, make: Callable[[], Node]) -> int:
        if key not in self._known:
            node = make()
            self.nodes.append(node)
            self._known[key] = len(self.nodes) - 1
        return self._known[key]

    def _time_node(self) -> int:
        self.time = self._node("time", lambda: Node("t", lambda s: ""))
        return self.time

    def _stripped(self, a: Linear) -> tuple[Expr, int]:
        """(factor, node) with a = factor * node; a node of its own where there are several terms."""
        if a.constant == 0 and len(a.terms) == 1:
            return a.terms[0][1], a.terms[0][0]
        needs = tuple(node for node, _ in a.terms)
        value, step = self.combination(a, True), self.combination(a, False)
        return sympy.S.One, self._node(("linear", a), lambda: Node(value, lambda s: step, needs))

    def _whole(self, a: Linear) -> int:
        """A node that equals ``a``."""
        factor, node = self._stripped(a)
        if factor == 1:
            return node
        value, step = self.combination(a, True), self.combination(a, False)
        return self._node(("linear", a), lambda: Node(value, lambda s: step, (node,)))

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

    # -- operations --------------------------------------------------------------------------------------------

    def _product(self, e: Expr) -> Linear:
        factor: Expr = sympy.S.One
        above: list[int] = []
        below: list[Linear] = []
        whole: list[Linear] = []
        for f in e.args:
            if not f.free_symbols & self._variables:
                factor *= f
            elif f.is_Pow and f.exp == -1:
                below.append(self.linear(f.base))
            else:
                whole.append(self.linear(f))
        if len(whole) == 1 and not below:
            return whole[0].scaled(factor)
        for a in whole:
            c, node = self._stripped(a)
            factor *= c
            above.append(node)
        if not below:
            return Linear(sympy.S.Zero, ((self._times(above), factor),))
        divisors = []
        for a in below:
            c, node = self._stripped(a)
            factor /= c
            divisors.append(node)
        divisor = self._times(divisors)
        quotient = self._divided(self._times(above), divisor) if above else self._inverse(divisor)
        return Linear(sympy.S.Zero, ((quotient, factor),))

    def _times(self, factors: list[int]) -> int:
        """Product of nodes; pairs that exist already are used first."""
        factors = sorted(factors)
        while len(factors) > 1:
            pairs = [(a, b) for i, a in enumerate(factors) for b in factors[i + 1 :]]
            a, b = next((pair for pair in pairs if ("times", *pair) in self._known), pairs[0])
            factors.remove(a)
            factors.remove(b)
            factors.append(self._node(("times", a, b), lambda a=a, b=b: self._times_node(a, b)))  # type: ignore[misc]
            factors.sort()
        return factors[0]

    @staticmethod
    def _times_node(a: int, b: int) -> Node:
        if a == b:
            return Node(f"z{a}*z{a}", lambda s: f"2.0*z{a}*c{a} + {s[0]}", (a,), (("", a, a),))
        return Node(
            f"z{a}*z{b}", lambda s: f"z{a}*c{b} + z{b}*c{a} + {s[0]}", (a, b), (("", a, b),)
        )

    def _divided(self, a: int, b: int) -> int:
        q = len(self.nodes)
        return self._node(
            ("divided", a, b),
            lambda: Node(
                f"z{a}/z{b}",
                lambda s: f"(c{a} - z{q}*c{b} - {s[0]})/z{b}",
                (a, b),
                (("", b, q),),
            ),
        )

    def _inverse(self, b: int) -> int:
        q = len(self.nodes)
        return self._node(
            ("inverse", b),
            lambda: Node(f"1.0/z{b}", lambda s: f"-(z{q}*c{b} + {s[0]})*z{q}", (b,), (("", b, q),)),
        )

    def _power(self, base: Expr, exponent: Expr) -> Linear:
        if exponent.free_symbols & self._variables:
            return self._exp(self.linear(exponent * sympy.log(base)))
        factor, a = self._stripped(self.linear(base))
        if isinstance(exponent, sympy.Integer) and exponent > 0:
            node, n, square = -1, int(exponent), a
            while n:
                if n & 1:
                    node = square if node < 0 else self._times([node, square])
                n >>= 1
                square = self._times([square, square]) if n else square
            return Linear(sympy.S.Zero, ((node, factor**exponent),))
        if exponent == -1:
            return Linear(sympy.S.Zero, ((self._inverse(a), 1 / factor),))
        # From here on the factor stays inside: it may be negative, and so may the node.
        a = self._whole(self.linear(base))
        r = len(self.nodes)
        if exponent == sympy.S.Half:
            root = self._math("sqrt")
            return self._single(
                self._node(
                    ("root", a),
                    lambda: Node(
                        f"{root}(z{a})",
                        lambda s: f"(c{a} - {s[0]})*(0.5/z{r})",
                        (a,),
                        (("", r, r),),
                    ),
                )
            )
        e, weight = self.constant(exponent), self.constant(exponent + 1)
        if isinstance(exponent, sympy.Integer):
            value = f"1.0/z{a}**{-int(exponent)}"
        elif exponent == -sympy.S.Half:
            value = f"1.0/{self._math('sqrt')}(z{a})"
        else:
            value = f"z{a}**({e})"
        return self._single(
            self._node(
                ("power", a, exponent),
                lambda: Node(
                    value,
                    lambda s: f"(({e})*z{r}*c{a} + r*{s[0]})/z{a}",
                    (a,),
                    ((f"(({weight})*x - xk)*", a, r),),
                ),
            )
        )

    def _affine_in_time(self, a: Linear) -> Expr | None:
        """The rate w where a = w t + constant."""
        return a.terms[0][1] if len(a.terms) == 1 and a.terms[0][0] == self.time else None

    def _exp(self, a: Linear) -> Linear:
        exp, z = self._math("exp"), self.combination(a, True)
        rate = self._affine_in_time(a)
        y = len(self.nodes)
        if rate is not None:
            w = self.constant(rate)
            make = lambda: Node(f"{exp}({z})", lambda s: f"{w}*r*c{y}", carried=True)  # noqa: E731
            return self._single(self._node(("exp", a), make))
        factor, x = self._stripped(a)
        w, y = self.constant(factor), len(self.nodes)
        return self._single(
            self._node(
                ("exp", a),
                lambda: Node(
                    f"{exp}({z})", lambda s: _scaled(w, f"z{y}*c{x} + r*{s[0]}"), (x,), (("x*", x, y),)
                ),
            )
        )

    def _log(self, a: Linear) -> Linear:
        log, x = self._math("log"), self._whole(a)
        y = len(self.nodes)
        return self._single(
            self._node(
                ("log", x),
                lambda: Node(f"{log}(z{x})", lambda s: f"(c{x} - r*{s[0]})/z{x}", (x,), (("x*", y, x),)),
            )
        )

    def _pair(self, a: Linear, odd: str, even: str, sign: str) -> tuple[Linear, Linear]:
        """(sin, cos) or (sinh, cosh): odd' = even * a', even' = sign odd * a'."""
        if (odd, a) in self._known:
            first = self._known[odd, a]
            return self._single(first), self._single(first + 1)
        z, rate = self.combination(a, True), self._affine_in_time(a)
        factor, x = (rate, self.time) if rate is not None else self._stripped(a)
        w = self.constant(factor)
        s_, c_ = len(self.nodes), len(self.nodes) + 1
        if rate is not None:
            nodes = (
                Node(f"{self._math(odd)}({z})", lambda s: f"{w}*r*c{c_}", (), (), c_, True),
                Node(f"{self._math(even)}({z})", lambda s: f"{_opposite(w) if sign else w}*r*c{s_}", (), (), s_, True),
            )
        else:
            nodes = (
                Node(
                    f"{self._math(odd)}({z})",
                    lambda s: _scaled(w, f"z{c_}*c{x} + r*{s[0]}"),
                    (x,),
                    (("x*", x, c_),),
                    c_,
                ),
                Node(
                    f"{self._math(even)}({z})",
                    lambda s: _scaled(_opposite(w) if sign else w, f"z{s_}*c{x} + r*{s[0]}"),
                    (x,),
                    (("x*", x, s_),),
                    s_,
                ),
            )
        self._known[odd, a], self._known[even, a] = s_, c_
        self.nodes.extend(nodes)
        return self._single(s_), self._single(c_)

    def _tangent(self, a: Linear, name: str, sign: str) -> Linear:
        """T' = w a' with w = 1 + T^2 (tan) or 1 - T^2 (tanh)."""
        if (name, a) not in self._known:
            z, (factor, x) = self.combination(a, True), self._stripped(a)
            c, T, w = self.constant(factor), len(self.nodes), len(self.nodes) + 1
            step = lambda s: _scaled(c, f"z{w}*c{x} + r*{s[0]}")  # noqa: E731
            self.nodes.append(Node(f"{self._math(name)}({z})", step, (x,), (("x*", x, w),), w))
            square = f"1.0 {sign or '+'} z{T}*z{T}"
            step_w = lambda s: f"{sign}(2.0*z{T}*c{T} + {s[0]})"  # noqa: E731
            self.nodes.append(Node(square, step_w, (T,), (("", T, T),), T))
            self._known[name, a] = T
        return self._single(self._known[name, a])

    def _integral(self, a: Linear, name: str, slope: Callable[[Expr], Expr]) -> Linear:
        """y' = a' / w for the inverse functions, with w = slope(a)."""
        x = self._whole(a)
        stand_in = sympy.Dummy()
        self._variables.add(stand_in)
        self._linear[stand_in] = self._single(x)
        w = self._whole(self.linear(slope(stand_in)))
        y, function = len(self.nodes), self._math(name)
        return self._single(
            self._node(
                (name, x),
                lambda: Node(
                    f"{function}(z{x})",
                    lambda s: f"(c{x} - r*{s[0]})/z{w}",
                    (x, w),
                    (("x*", y, w),),
                ),
            )
        )

    def _atan2(self, above: Expr, right: Expr) -> Linear:
        """y = atan2(b, a): (a^2 + b^2) y' = a b' - b a'."""
        b, a = self._whole(self.linear(above)), self._whole(self.linear(right))
        w = self._whole(_added([self._single(self._times([a, a])), self._single(self._times([b, b]))]))
        y, function = len(self.nodes), self._math("atan2")
        return self._single(
            self._node(
                ("atan2", b, a),
                lambda: Node(
                    f"{function}(z{b}, z{a})",
                    lambda s: (
                        f"(z{a}*c{b} - z{b}*c{a} + r*({s[0]} - {s[1]} - {s[2]}))/z{w}"
                    ),
                    (a, b, w),
                    (("x*", b, a), ("x*", a, b), ("x*", y, w)),
                ),
            )
        )

    def _chosen(self, e: sympy.Piecewise) -> Linear:
        """A choice by parameters only: the coefficients of the branch that holds."""
        values = [(self.linear(value), condition) for value, condition in e.args]
        value_text = step_text = "(0.0*1e400)"
        for a, condition in reversed(values):
            chosen = self._printer(condition)
            value_text = f"({self.combination(a, True)} if {chosen} else {value_text})"
            step_text = f"({self.combination(a, False)} if {chosen} else {step_text})"
        needs = tuple(dict.fromkeys(node for a, _ in values for node, _ in a.terms))
        return self._single(self._node(("chosen", e), lambda: Node(value_text, lambda s: step_text, needs)))
