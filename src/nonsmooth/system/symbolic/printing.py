"""SymPy expressions as lines of Python: scalar code for Numba, or array code for NumPy.

SymPy's own printers, and so ``lambdify``, write a double with 15 digits (most doubles change). Here every double is
its ``repr``, integers and rationals become doubles, and a subexpression that occurs twice is computed once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import sympy
from sympy import Basic, Expr
from sympy.logic.boolalg import Boolean, BooleanFalse, BooleanTrue

from nonsmooth.errors import SystemDefinitionError

# Function -> its name in ``math``, and in NumPy where that differs.
FUNCTIONS: dict[type, tuple[str, str]] = {
    sympy.sin: ("sin", "sin"),
    sympy.cos: ("cos", "cos"),
    sympy.tan: ("tan", "tan"),
    sympy.asin: ("asin", "arcsin"),
    sympy.acos: ("acos", "arccos"),
    sympy.atan: ("atan", "arctan"),
    sympy.atan2: ("atan2", "arctan2"),
    sympy.sinh: ("sinh", "sinh"),
    sympy.cosh: ("cosh", "cosh"),
    sympy.tanh: ("tanh", "tanh"),
    sympy.asinh: ("asinh", "arcsinh"),
    sympy.acosh: ("acosh", "arccosh"),
    sympy.atanh: ("atanh", "arctanh"),
    sympy.exp: ("exp", "exp"),
    sympy.log: ("log", "log"),
    sympy.floor: ("floor", "floor"),
    sympy.ceiling: ("ceil", "ceil"),
}
#: Operations with a corner or a jump, which have no Taylor series everywhere.
CORNERS = (
    sympy.Abs,
    sympy.sign,
    sympy.Max,
    sympy.Min,
    sympy.Heaviside,
    sympy.Piecewise,
    sympy.floor,
    sympy.ceiling,
)
#: What derivatives of floor, ceiling and sign are to SymPy; they are zero but where these jump.
STEPS = sympy.Subs, sympy.Derivative, sympy.DiracDelta
RELATIONS: dict[type, str] = {
    sympy.Gt: ">",
    sympy.Ge: ">=",
    sympy.Lt: "<",
    sympy.Le: "<=",
    sympy.Eq: "==",
    sympy.Ne: "!=",
}


class Printer:
    """Text of an expression whose symbols and subexpressions are called as in ``names``, which grow while
    :func:`assignments` names some: scalar code with functions of ``math``, or code of NumPy for ``arrays``."""

    def __init__(self, names: Mapping[Basic, str], arrays: bool = False) -> None:
        self.names: dict[Basic, str] = dict(names)
        self.arrays = arrays
        self.used: set[str] = set()  # functions of ``math`` that the text needs

    def __call__(self, expression: Basic) -> str:
        return self._raw(expression)[0]

    def _atom(self, e: Basic) -> str:
        text, atomic = self._raw(e)
        return text if atomic else f"({text})"

    def _call(self, function: str, *arguments: Basic) -> tuple[str, bool]:
        if not self.arrays:
            self.used.add(function)
        return f"{'np.' if self.arrays else ''}{function}({', '.join(self(a) for a in arguments)})", True

    def _raw(self, e: Basic) -> tuple[str, bool]:
        """(text, whether it stands in a product or a power without parentheses)."""
        if e in self.names:
            return self.names[e], True
        if isinstance(e, STEPS):
            return "0.0", True
        if isinstance(e, sympy.Number | sympy.NumberSymbol):
            text = _number(e)
            return text, not text.startswith("-")
        if isinstance(e, sympy.Add):
            return self._sum(e), False
        if isinstance(e, sympy.Mul):
            return self._product(e), False
        if isinstance(e, sympy.Pow):
            return self._power(e)
        if type(e) in FUNCTIONS:
            return self._call(FUNCTIONS[type(e)][self.arrays], *e.args)
        if isinstance(e, sympy.Piecewise):
            return self._piecewise(e), True
        if isinstance(e, Boolean):
            return self._condition(e), True
        if isinstance(e, sympy.Abs):
            return (f"np.abs({self(e.args[0])})" if self.arrays else f"abs({self(e.args[0])})"), True
        if isinstance(e, sympy.sign):
            x = self._atom(e.args[0])
            return (f"np.sign({x})" if self.arrays else f"float(({x} > 0.0) - ({x} < 0.0))"), True
        if isinstance(e, sympy.Max | sympy.Min):
            name = "max" if isinstance(e, sympy.Max) else "min"
            parts = [self(a) for a in e.args]
            text = parts[0]
            for part in parts[1:]:
                text = f"np.{name}imum({text}, {part})" if self.arrays else f"{name}({text}, {part})"
            return text, True
        if isinstance(e, sympy.Heaviside):
            x, middle = self._atom(e.args[0]), self(e.args[1])
            if self.arrays:
                return f"np.heaviside({x}, {middle})", True
            return f"(1.0 if {x} > 0.0 else (0.0 if {x} < 0.0 else {middle}))", True
        raise SystemDefinitionError(
            f"no code can be written for {e} ({type(e).__name__}); allowed are + - * / **, abs, sign, maximum, "
            f"minimum, where, heaviside and {', '.join(names[1] for names in FUNCTIONS.values())}"
        )

    def _sum(self, e: sympy.Add) -> str:
        text = ""
        # Start with a positive term where there is one: -a + b reads, and computes, better as b - a.
        terms = sorted(e.args, key=lambda term: term.could_extract_minus_sign())
        for term in terms:
            negative = term.could_extract_minus_sign() and term not in self.names
            part = -term if negative else term
            shown = self._atom(part) if isinstance(part, sympy.Add) else self(part)
            text += (" - " if negative else " + ") + shown if text else ("-" if negative else "") + shown
        return text

    def _product(self, e: sympy.Mul) -> str:
        sign, above, below = "", [], []
        for factor in e.args:
            if factor in self.names:
                above.append(self.names[factor])
            elif factor is sympy.S.NegativeOne:
                sign = "-"
            elif isinstance(factor, sympy.Rational) and not isinstance(factor, sympy.Integer) and abs(factor.p) == 1:
                sign = "-" if factor.p < 0 else ""
                below.append(_number(sympy.Integer(factor.q)))
            elif isinstance(factor, sympy.Number) and factor < 0:
                sign = "-"
                above.append(_number(-factor))
            elif isinstance(factor, sympy.Pow) and factor.exp.could_extract_minus_sign():
                below.append(self._atom(1 / factor))
            else:
                above.append(self._atom(factor))
        text = sign + ("*".join(above) or "1.0")
        if below:
            text += "/" + (below[0] if len(below) == 1 else f"({'*'.join(below)})")
        return text

    def _power(self, e: sympy.Pow) -> tuple[str, bool]:
        base, exponent = e.args
        if exponent == sympy.S.Half:
            return self._call("sqrt", base)
        if exponent.could_extract_minus_sign():
            return f"1.0/{self._atom(sympy.Pow(base, -exponent))}", False
        if isinstance(exponent, sympy.Integer) and int(exponent) <= 4:
            return "*".join([self._atom(base)] * int(exponent)), False
        if isinstance(exponent, sympy.Integer):
            return f"{self._atom(base)}**{int(exponent)}", False
        return f"{self._atom(base)}**{self._atom(exponent)}", False

    def _piecewise(self, e: sympy.Piecewise) -> str:
        # No branch: NaN. Every branch value is a double, so that Numba sees one type.
        text = _number(sympy.nan)
        for value, condition in reversed(e.args):
            if condition == sympy.true:
                text = self(value)
            elif self.arrays:
                text = f"np.where({self(condition)}, {self(value)}, {text})"
            else:
                text = f"({self(value)} if {self(condition)} else {text})"
        return text if text.endswith(")") else f"({text})"

    def _condition(self, e: Boolean) -> str:
        if isinstance(e, BooleanTrue | BooleanFalse):
            return str(bool(e))
        if type(e) in RELATIONS:
            return f"({self(e.args[0])} {RELATIONS[type(e)]} {self(e.args[1])})"
        both: dict[type, tuple[str, str]] = {sympy.And: (" and ", " & "), sympy.Or: (" or ", " | ")}
        if type(e) in both:
            return f"({both[type(e)][self.arrays].join(self(a) for a in e.args)})"
        if isinstance(e, sympy.Not):
            return f"({'~' if self.arrays else 'not '}{self(e.args[0])})"
        raise SystemDefinitionError(f"no code can be written for the condition {e} ({type(e).__name__})")


def _number(e: Basic) -> str:
    try:
        value = float(e)
    except TypeError:
        raise SystemDefinitionError(f"the number {e} in an expression of the model is not a real number") from None
    if math.isfinite(value):
        return repr(value)
    return "(0.0*1e400)" if math.isnan(value) else ("1e400" if value > 0 else "-1e400")


def assignments(targets: Iterable[tuple[str, Basic]], printer: Printer, prefix: str) -> list[str]:
    """Lines ``target = expression`` of (text of the left-hand side, expression), behind lines for what they share."""
    targets = list(targets)
    lines = shared_terms([expression for _, expression in targets], printer, prefix)
    return lines + [f"{left} = {printer(expression)}" for left, expression in targets]


def compiled(head: str, targets: Iterable[tuple[str, Basic]], printer: Printer) -> Callable[..., Any]:
    """The function with the arguments ``head`` that gives targets the values of expressions."""
    lines = assignments(targets, printer, "g") or ["pass"]
    scope: dict[str, Any] = {"np": np} if printer.arrays else dict(vars(math))
    exec(compile("\n    ".join([f"def f({head}):", *lines]), "<expressions>", "exec"), scope)
    found: Callable[..., Any] = scope["f"]
    return found


def shared_terms(
    expressions: Iterable[Basic], printer: Printer, prefix: str, wanted: Callable[[Basic], bool] = lambda e: True
) -> list[str]:
    """Lines that name what some expressions share, if it is ``wanted``.

    The ``names`` of the printer learn them, so that later calls use them too: ``prefix`` and a number.
    """
    counts: dict[Basic, int] = {}
    order: list[Basic] = []

    def visit(e: Basic) -> None:
        if e in printer.names or not e.args or isinstance(e, STEPS):
            return
        counts[e] = counts.get(e, 0) + 1
        if counts[e] == 1:
            for argument in e.args:
                visit(argument)
            order.append(e)

    for expression in expressions:
        visit(expression)
    lines: list[str] = []
    for e in order:
        if counts[e] > 1 and _worth_a_name(e) and wanted(e):
            name = f"{prefix}{len(lines)}"
            text = printer(e)
            printer.names[e] = name
            lines.append(f"{name} = {text}")
    return lines


def _worth_a_name(e: Any) -> bool:
    if not isinstance(e, Expr) or isinstance(e, Boolean | sympy.functions.elementary.piecewise.ExprCondPair):
        return False
    return not (isinstance(e, sympy.Mul) and len(e.args) == 2 and e.args[0] is sympy.S.NegativeOne)
