"""Expressions as text and back.

SymPy prints floats with 15 digits and reads text by executing it; both are unusable here. This writes
``repr`` of every float and reads with Python's ``ast`` and a white list, building SymPy nodes itself.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from typing import Any

import sympy as sp

from nonsmooth.system.scalar import to_expression

__all__ = ["read_expression", "write_expression"]

_NAMES: dict[Any, str] = {
    sp.sin: "sin", sp.cos: "cos", sp.tan: "tan", sp.asin: "arcsin", sp.acos: "arccos", sp.atan: "arctan",
    sp.atan2: "arctan2", sp.sinh: "sinh", sp.cosh: "cosh", sp.tanh: "tanh", sp.asinh: "arcsinh",
    sp.acosh: "arccosh", sp.atanh: "arctanh", sp.exp: "exp", sp.log: "log", sp.Abs: "abs", sp.sign: "sign",
    sp.Max: "max", sp.Min: "min", sp.floor: "floor", sp.ceiling: "ceil",
}  # fmt: skip
_FUNCTIONS: dict[str, Callable[..., Any]] = {name: function for function, name in _NAMES.items()} | {"sqrt": sp.sqrt}
_RELATIONS: dict[Any, str] = {
    sp.StrictLessThan: "<", sp.LessThan: "<=", sp.StrictGreaterThan: ">", sp.GreaterThan: ">=",
    sp.Eq: "==", sp.Ne: "!=",
}  # fmt: skip
_COMPARE: dict[type, Callable[[Any, Any], Any]] = {
    ast.Lt: sp.StrictLessThan, ast.LtE: sp.LessThan, ast.Gt: sp.StrictGreaterThan, ast.GtE: sp.GreaterThan,
    ast.Eq: sp.Eq, ast.NotEq: sp.Ne,
}  # fmt: skip
_SUM, _PRODUCT, _SIGN, _POWER, _ATOM = range(5)
_LARGEST_POWER = 10_000  # of numbers: text must not be able to ask for 9**9**9


def write_expression(expression: sp.Basic, names: Mapping[sp.Symbol, str]) -> str:
    """Return ``expression`` in Python's notation, symbols by ``names``, floats exactly (``repr``)."""
    return _write(expression, names)[0]


def _write(e: Any, names: Mapping[sp.Symbol, str]) -> tuple[str, int]:
    def inside(part: Any, level: int) -> str:
        text, binding = _write(part, names)
        return text if binding >= level else f"({text})"

    if e.is_Symbol:
        return names[e], _ATOM
    if e is sp.true or e is sp.false:
        return str(bool(e)), _ATOM
    if e is sp.pi or e is sp.E:
        return ("pi" if e is sp.pi else "exp(1)"), _ATOM
    if e.is_Integer:
        return str(int(e)), (_ATOM if e >= 0 else _SIGN)
    if e.is_Float:
        return repr(float(e)), (_ATOM if e >= 0 else _SIGN)
    if e.is_Rational:
        return f"{e.p}/{e.q}", _PRODUCT
    if e.is_Add:
        text = inside(e.args[0], _PRODUCT)
        for term in e.args[1:]:
            piece = inside(term, _PRODUCT)
            text += f" - {piece[1:]}" if piece.startswith("-") else f" + {piece}"
        return text, _SUM
    if e.is_Mul:
        return _write_product(e, inside)
    if e.is_Pow:
        if e.exp.is_Rational and e.exp < 0:
            return f"1/{inside(sp.Pow(e.base, -e.exp), _POWER)}", _PRODUCT
        if e.exp == sp.Rational(1, 2):
            return f"sqrt({_write(e.base, names)[0]})", _ATOM
        return f"{inside(e.base, _ATOM)}**{inside(e.exp, _ATOM)}", _POWER
    if isinstance(e, sp.Piecewise):
        text = _write(e.args[-1][0], names)[0]
        for value, condition in reversed(e.args[:-1]):
            text = f"where({_write(condition, names)[0]}, {_write(value, names)[0]}, {text})"
        return text, _ATOM
    if isinstance(e, (sp.And, sp.Or)):
        joiner = " and " if isinstance(e, sp.And) else " or "
        ordered = sorted(inside(part, _ATOM) for part in e.args)
        return joiner.join(ordered), _SUM
    if isinstance(e, sp.Not):
        return f"not {inside(e.args[0], _ATOM)}", _SUM
    if type(e) in _RELATIONS:
        left, right = e.args
        return f"{inside(left, _SUM)} {_RELATIONS[type(e)]} {inside(right, _SUM)}", _SUM
    if type(e) in _NAMES:
        return f"{_NAMES[type(e)]}({', '.join(_write(part, names)[0] for part in e.args)})", _ATOM
    raise TypeError(f"{type(e).__name__} in {e} has no text form")


def _write_product(e: Any, inside: Callable[[Any, int], str]) -> tuple[str, int]:
    above, below, sign = [], [], ""
    for factor in e.args:
        if factor.is_Rational or factor.is_Float:
            if factor < 0:
                sign, factor = "-", -factor
            if factor.is_Float or factor.p != 1:
                above.append(inside(sp.Integer(factor.p) if factor.is_Rational else factor, _SIGN))
            if factor.is_Rational and factor.q != 1:
                below.append(str(factor.q))
        elif factor.is_Pow and factor.exp.is_Rational and factor.exp < 0:
            below.append(inside(sp.Pow(factor.base, -factor.exp), _POWER))
        else:
            above.append(inside(factor, _POWER))
    text = sign + ("*".join(above) or "1")
    if below:
        text += f"/{below[0]}" if len(below) == 1 else f"/({'*'.join(below)})"
    return text, _PRODUCT


def read_expression(text: str, symbols: Mapping[str, sp.Symbol]) -> Any:
    """Return the expression of `write_expression`'s text; nothing is executed.

    Parameters
    ----------
    text : str
    symbols : mapping of str to Symbol
        What ``t``, ``u.x``, ``p.k`` stand for.

    Raises
    ------
    ValueError
        Anything but numbers, the known names, arithmetic, comparisons and the known functions.
    """
    if not isinstance(text, str):
        raise ValueError(f"an expression must be a string, not {text!r}")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ValueError(f"cannot read the expression {text!r}: {error}") from None
    try:
        return _read(tree.body, symbols)
    except (ValueError, TypeError, RecursionError) as error:
        raise ValueError(f"{error} (in the expression {text!r})") from None


def _read(node: ast.AST, symbols: Mapping[str, sp.Symbol]) -> Any:
    match node:
        case ast.Constant(value=bool() as value):
            return sp.true if value else sp.false
        case ast.Constant(value=int() as value):
            return sp.Integer(value)
        case ast.Constant(value=float() as value):
            return to_expression(value)
        case ast.Name(id="pi"):
            return sp.pi
        case ast.Name(id=name) if name in symbols:
            return symbols[name]
        case ast.Attribute(value=ast.Name(id=owner), attr=name) if f"{owner}.{name}" in symbols:
            return symbols[f"{owner}.{name}"]
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return sp.Not(_read(operand, symbols))
        case ast.BinOp(op=ast.Add() | ast.Sub()):
            return sp.Add(*_terms(node, symbols))
        case ast.BinOp(op=ast.Mult() | ast.Div()) | ast.UnaryOp(op=ast.USub() | ast.UAdd()):
            return sp.Mul(*_factors(node, symbols))
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            base, exponent = _read(left, symbols), _read(right, symbols)
            if base.is_number and exponent.is_number and abs(float(exponent)) > _LARGEST_POWER:
                raise ValueError(f"a number to the power {exponent} is not accepted")
            return sp.Pow(base, exponent)
        case ast.Call(func=ast.Name(id="where"), args=[condition, a, b], keywords=[]):
            return sp.Piecewise((_read(a, symbols), _read(condition, symbols)), (_read(b, symbols), sp.true))
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in _FUNCTIONS:
            return _FUNCTIONS[name](*(_read(argument, symbols) for argument in arguments))
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARE:
            return _COMPARE[type(op)](_read(left, symbols), _read(right, symbols))
        case ast.BoolOp(op=op, values=values):
            return (sp.And if isinstance(op, ast.And) else sp.Or)(*(_read(value, symbols) for value in values))
    raise ValueError(f"`{ast.unparse(node)}` is not allowed")


def _terms(node: ast.AST, symbols: Mapping[str, sp.Symbol], sign: int = 1) -> list[Any]:
    """Summands of a chain of + and -, so that SymPy sees them together, as when they were written."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        right = sign if isinstance(node.op, ast.Add) else -sign
        return _terms(node.left, symbols, sign) + _terms(node.right, symbols, right)
    return [_read(node, symbols) if sign > 0 else sp.Mul(-1, *_factors(node, symbols))]


def _factors(node: ast.AST, symbols: Mapping[str, sp.Symbol]) -> list[Any]:
    """Factors of a chain of *, / and signs. All at once: 2*(x + y)/m must not become (2*x + 2*y)/m."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Mult, ast.Div)):
        right = _factors(node.right, symbols)
        if isinstance(node.op, ast.Div):
            right = [sp.Pow(factor, -1) for factor in right]
        return _factors(node.left, symbols) + right
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
        return ([sp.Integer(-1)] if isinstance(node.op, ast.USub) else []) + _factors(node.operand, symbols)
    return [_read(node, symbols)]
