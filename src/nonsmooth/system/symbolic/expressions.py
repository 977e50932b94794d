"""Expressions as text and back.

SymPy prints floats with 15 digits and reads text by executing it; both are unusable here. This writes
``repr`` of every float and reads with Python's ``ast`` and a white list, building SymPy nodes itself.
"""

from __future__ import annotations

import ast
import cmath
import math
from collections.abc import Callable, Mapping
from typing import Any

import sympy as sp

from nonsmooth.errors import shortened
from nonsmooth.system.symbolic.printing import FUNCTIONS, RELATIONS
from nonsmooth.system.symbolic.scalar import to_expression

_NAMES: dict[Any, str] = {
    **{function: name for function, (_, name) in FUNCTIONS.items()},
    sp.Abs: "abs",
    sp.sign: "sign",
    sp.Max: "max",
    sp.Min: "min",
}
_FUNCTIONS: dict[str, Callable[..., Any]] = {name: function for function, name in _NAMES.items()} | {"sqrt": sp.sqrt}
_COMPARE: dict[type, Callable[[Any, Any], Any]] = {
    ast.Lt: sp.StrictLessThan,
    ast.LtE: sp.LessThan,
    ast.Gt: sp.StrictGreaterThan,
    ast.GtE: sp.GreaterThan,
    ast.Eq: sp.Eq,
    ast.NotEq: sp.Ne,
}
_SUM, _PRODUCT, _SIGN, _POWER, _ATOM = range(5)
# Text may come with a file of somebody else: what it asks for is bounded before SymPy works it out.
_LONGEST = 200_000  # characters
_NODES = 10_000
_DEEPEST = 60  # sums and products count once, however many terms they have
_JOINED = 40  # operands of `and`, `or`, max and min: SymPy compares all pairs of them
_BITS = 1100  # of a whole number: a float has 1024
_LARGEST_EXPONENT = 100  # of anything but a number
_TERMS = 5_000  # when multiplied out
_STEEP = ("exp", "sinh", "cosh")
_LARGEST_LOGARITHM = 709.0  # of a float


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
    if type(e) in RELATIONS:
        left, right = e.args
        return f"{inside(left, _SUM)} {RELATIONS[type(e)]} {inside(right, _SUM)}", _SUM
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
    """Return the expression of `write_expression`'s text, ``symbols`` being those of ``t``, ``u.x``, ``p.k``; nothing
    is executed. Anything but numbers, these names, arithmetic, comparisons, the known functions is a ValueError."""
    if not isinstance(text, str):
        raise ValueError(f"an expression must be a string, not {shortened(text)}")
    if len(text) > _LONGEST:
        raise ValueError(f"an expression of {len(text)} characters is too long; at most {_LONGEST} are read")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ValueError(f"cannot read the expression {shortened(text)}: {error}") from None
    try:
        _check_size(tree.body)
        expression = _read(tree.body, symbols)
        _multiplied_out(expression)
        return expression
    except (ValueError, TypeError, ArithmeticError, RecursionError) as error:
        raise ValueError(f"{error} (in the expression {shortened(text)})") from None


def _check_size(tree: ast.AST) -> None:
    """ValueError for a tree that SymPy would take long to build."""
    nodes, pending = 0, [(tree, 1)]
    while pending:
        node, depth = pending.pop()
        nodes += 1
        if nodes > _NODES or depth > _DEEPEST:
            raise ValueError(f"it is too large: at most {_NODES} parts, nested at most {_DEEPEST} deep, are read")
        if isinstance(node, ast.BoolOp | ast.Call):
            joined = len(node.values if isinstance(node, ast.BoolOp) else node.args)
            if joined > _JOINED:
                raise ValueError(f"it joins {joined} parts at once; at most {_JOINED} are read")
        for child in ast.iter_child_nodes(node):
            if not isinstance(child, ast.expr_context | ast.operator | ast.unaryop | ast.boolop | ast.cmpop):
                chained = isinstance(node, ast.BinOp) and child is node.left and isinstance(child, ast.BinOp)
                pending.append((child, depth + (not chained)))


def _multiplied_out(e: sp.Basic) -> int:
    """Terms of an expression when it is multiplied out, as its derivatives are; ValueError for very many."""
    counts = [_multiplied_out(part) for part in e.args]
    if e.is_Add:
        count = sum(counts)
    elif e.is_Mul:
        count = math.prod(counts)
    elif e.is_Pow and e.exp.is_Rational:
        power = int(abs(e.exp))
        count = math.comb(counts[0] + power - 1, power)
    else:
        count = 1
    if count > _TERMS:
        raise ValueError(f"it has {count} terms when it is multiplied out; at most {_TERMS} are read")
    return count


def _read(node: ast.AST, symbols: Mapping[str, sp.Symbol]) -> Any:
    match node:
        case ast.Constant(value=bool() as value):
            return sp.true if value else sp.false
        case ast.Constant(value=int() as value):
            return _bounded(sp.Integer(value))
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
            return _bounded(sp.Add(*_terms(node, symbols)))
        case ast.BinOp(op=ast.Mult() | ast.Div()) | ast.UnaryOp(op=ast.USub() | ast.UAdd()):
            return _bounded(sp.Mul(*_factors(node, symbols)))
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            return _power(_read(left, symbols), _read(right, symbols))
        case ast.Call(func=ast.Name(id="where"), args=[condition, a, b], keywords=[]):
            return sp.Piecewise((_read(a, symbols), _read(condition, symbols)), (_read(b, symbols), sp.true))
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in _FUNCTIONS:
            values = [_read(argument, symbols) for argument in arguments]
            if name in _STEEP and any(value.is_number and abs(_number(value)) > _LARGEST_LOGARITHM for value in values):
                raise ValueError(f"{name} of a number as large as {shortened(values[0])} is not accepted")
            return _bounded(_FUNCTIONS[name](*values))
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARE:
            return _COMPARE[type(op)](_read(left, symbols), _read(right, symbols))
        case ast.BoolOp(op=op, values=values):
            return (sp.And if isinstance(op, ast.And) else sp.Or)(*(_read(value, symbols) for value in values))
    raise ValueError(f"`{shortened(ast.unparse(node), quoted=False)}` is not allowed")


def _power(base: Any, exponent: Any) -> Any:
    """A power whose value, and whose digits where it is exact, are bounded before they are worked out."""
    if exponent.is_number:
        size = abs(_number(exponent))
        if not base.is_number:
            fits = size <= _LARGEST_EXPONENT
        elif base.is_Rational and exponent.is_Rational:
            fits = size * max(base.p.bit_length(), base.q.bit_length()) <= _BITS
        else:
            value = abs(_number(base))
            fits = size * abs(math.log(value) if value else 0.0) <= _LARGEST_LOGARITHM
        if not fits:
            raise ValueError(f"{shortened(base)} to the power {shortened(exponent)} is not accepted: it is too large")
    return _bounded(sp.Pow(base, exponent))


def _bounded(expression: Any) -> Any:
    """The expression; ValueError where it is a number beyond those of floating point."""
    if getattr(expression, "is_Rational", False):
        if max(expression.p.bit_length(), expression.q.bit_length()) > _BITS:
            raise ValueError("it holds a number with more digits than a float can have")
    elif getattr(expression, "is_number", False):
        _number(expression)
    return expression


def _number(expression: Any) -> complex:
    """The value of an expression without symbols, in floating point."""
    value = complex(expression.evalf(15))
    if not cmath.isfinite(value):
        raise ValueError(f"it holds the number {shortened(expression)}, which is not finite")
    return value


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
