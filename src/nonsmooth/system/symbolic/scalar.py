"""The symbolic number the user's functions are called with.

It behaves as a float does in arithmetic and NumPy functions, alone and inside object arrays (there
NumPy calls methods named as the function), and refuses, with the remedy, what would hide a decision
from the tracing: ``if``, ``max()``, ``np.where``, ``math.cos``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import sympy as sp

from nonsmooth.errors import SystemDefinitionError, shortened
from nonsmooth.system.symbolic.printing import FUNCTIONS

_DECISION = (
    "`{}` cannot be decided while the function is traced: a Python `if`, `max()`, `min()`, `np.where` on a state or "
    "the time hides a switch. Make it two modes with a transition between them; on parameters, in outputs and in "
    "resets use ns.where(condition, a, b)"
)
_NUMBER = (
    "a symbolic number cannot become a float: use NumPy's functions (np.cos, np.sqrt, np.exp, ...) in place of "
    "those of `math`, and build arrays without dtype=float; a table over time (np.interp) is an input, inputs=; "
    "the number was `{}`"
)


def exact(expression: sp.Expr) -> sp.Expr:
    """The expression with whole numbers and halves exact, as they are read back from a text."""
    return expression.xreplace({number: to_expression(float(number)) for number in expression.atoms(sp.Float)})


def to_expression(value: Any) -> sp.Expr:
    """Return a SymPy expression for a `Scalar` or a plain number.

    Floats keep their exact value; those that are whole numbers or halves become exact, so that ``x**2.0``
    and ``0.5*x`` are polynomials.
    """
    if isinstance(value, Scalar):
        return value.expression
    if isinstance(value, np.ndarray) and value.ndim == 0:
        return to_expression(value.item())
    if isinstance(value, (bool, np.bool_, int, np.integer)):
        return sp.Integer(int(value))
    if isinstance(value, (float, np.floating)):
        number = float(value)
        if not math.isfinite(number):
            raise SystemDefinitionError(f"the function contains {number}, which is not a finite number")
        if abs(number) < 2**50 and number * 2 == int(number * 2):
            return sp.Rational(int(number * 2), 2)
        return sp.Float(number)
    if isinstance(value, Relation):
        raise SystemDefinitionError(
            f"`{value}` is a condition, not a number. For an indicator write the difference of both sides, whose sign "
            "is the condition; elsewhere ns.where(condition, a, b)"
        )
    if isinstance(value, (complex, np.complexfloating)):
        raise SystemDefinitionError(f"the function contains the complex number {value}; only real numbers are known")
    raise TypeError(f"expected a number, got {shortened(value)} ({type(value).__name__})")


def as_written(expression: Any) -> str:
    """Return an expression as its author writes it: ``u.x``, ``p.k`` and ``t`` for the symbols of a system."""
    text = re.sub(r"\b([upm])_(?=\w)", lambda match: "u." if match[1] == "u" else "p.", str(expression))
    return re.sub(r"\bt_\b", "t", text)


def _rest(a: Any, b: Any) -> Any:
    return a - b * sp.floor(a / b)


class Scalar(np.lib.mixins.NDArrayOperatorsMixin):
    """A real number known only by its SymPy expression; its operators are those functions of NumPy."""

    __slots__ = ("expression",)

    def __init__(self, expression: sp.Expr) -> None:
        self.expression = expression

    def __repr__(self) -> str:
        return as_written(self.expression)

    def __xor__(self, other: Any) -> Any:
        raise SystemDefinitionError(
            "`^` is not a power in Python (it is the exclusive or of bits): write x**3 for x to the third"
        )

    __rxor__ = __xor__

    def __hash__(self) -> int:
        return hash(self.expression)

    def __bool__(self) -> bool:
        if self.expression.is_number:
            return bool(self.expression != 0)
        raise SystemDefinitionError(_DECISION.format(self))

    def __float__(self) -> float:
        if self.expression.is_number:
            return float(self.expression)
        raise SystemDefinitionError(_NUMBER.format(self))

    def __int__(self) -> int:
        return int(float(self))

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **kwargs: Any) -> Any:
        """Apply a NumPy function of symbolic scalars, element by element where an input is an array."""
        function = _UFUNCS.get(ufunc.__name__)
        if kwargs.keys() == {"out"} and isinstance(inputs[0], Scalar) and kwargs["out"][0] is inputs[0]:
            kwargs = {}  # `a += b`: a number is not changed, a new one takes its name
        if any(isinstance(item, np.lib.mixins.NDArrayOperatorsMixin) and type(item) is not Scalar for item in inputs):
            return NotImplemented  # the whole state answers for both
        if function is None or method != "__call__" or kwargs:
            options = f" with {method}" if method != "__call__" else f" with {', '.join(kwargs)}=" if kwargs else ""
            raise SystemDefinitionError(
                f"np.{ufunc.__name__}{options} cannot be traced; known are np.{', np.'.join(sorted(_UFUNCS))}"
            )
        if any(isinstance(item, np.ndarray) and item.ndim for item in inputs):
            return np.frompyfunc(function, len(inputs), 1)(*(_as_object(item) for item in inputs))
        return function(*inputs)


def _as_object(item: Any) -> Any:
    """Return a 0-d object array around a Scalar, so that NumPy broadcasts it instead of asking it again."""
    if not isinstance(item, Scalar):
        return item
    box = np.empty((), dtype=object)
    box[()] = item
    return box


class Relation:
    """A comparison of symbolic numbers: only `where` may ask for it."""

    __slots__ = ("relation",)

    def __init__(self, relation: Any) -> None:
        self.relation = relation

    def __repr__(self) -> str:
        return as_written(self.relation)

    def __bool__(self) -> bool:
        if self.relation in (sp.true, sp.false):
            return bool(self.relation)
        raise SystemDefinitionError(_DECISION.format(self))

    def __and__(self, other: Any) -> Relation:
        return Relation(sp.And(self.relation, _relation(other)))

    def __or__(self, other: Any) -> Relation:
        return Relation(sp.Or(self.relation, _relation(other)))

    def __invert__(self) -> Relation:
        return Relation(sp.Not(self.relation))

    __rand__, __ror__ = __and__, __or__


def _relation(value: Any) -> Any:
    if isinstance(value, Relation):
        return value.relation
    if isinstance(value, (bool, np.bool_)):
        return sp.true if value else sp.false
    raise TypeError(f"ns.where needs a condition such as p.a > 0, not {shortened(value)}")


def where(condition: Any, a: Any, b: Any) -> Any:
    """Return ``a`` where ``condition`` holds, else ``b``: for parameters, outputs and resets.

    Parameters
    ----------
    condition : comparison
        For example ``p.k_s > 0``; joined by ``&``, ``|``, ``~``.
    a, b : number

    Notes
    -----
    On the state or the time inside a mode or an indicator it is refused: no method can see such a corner.
    """
    if not any(isinstance(item, (Scalar, Relation)) for item in (condition, a, b)):
        return np.where(condition, a, b)
    return Scalar(sp.Piecewise((to_expression(a), _relation(condition)), (to_expression(b), sp.true)))


def _of_numbers(make: Callable[..., Any], kind: Callable[[Any], Any]) -> Callable[..., Any]:
    return lambda *numbers: kind(make(*map(to_expression, numbers)))


_UNARY: dict[str, Callable[..., Any]] = {
    **{name: function for function, (_, name) in FUNCTIONS.items() if function is not sp.atan2},
    "sqrt": sp.sqrt,
    "sign": sp.sign,
    "absolute": sp.Abs,
    "fabs": sp.Abs,
    "exp2": lambda x: sp.Integer(2) ** x,
    "expm1": lambda x: sp.exp(x) - 1,
    "log1p": lambda x: sp.log(1 + x),
    "log2": lambda x: sp.log(x) / sp.log(2),
    "log10": lambda x: sp.log(x) / sp.log(10),
    "square": lambda x: x**2,
    "reciprocal": lambda x: 1 / x,
    "negative": lambda x: -x,
    "positive": lambda x: x,
    "conjugate": lambda x: x,
    "deg2rad": lambda x: x * sp.pi / 180,
    "radians": lambda x: x * sp.pi / 180,
    "rad2deg": lambda x: x * 180 / sp.pi,
    "degrees": lambda x: x * 180 / sp.pi,
}
_BINARY: dict[str, Callable[..., Any]] = {
    "add": lambda x, y: x + y,
    "subtract": lambda x, y: x - y,
    "multiply": lambda x, y: x * y,
    "divide": lambda x, y: x / y,
    "true_divide": lambda x, y: x / y,
    "power": lambda x, y: x**y,
    "float_power": lambda x, y: x**y,
    "remainder": _rest,
    "arctan2": sp.atan2,
    "hypot": lambda x, y: sp.sqrt(x**2 + y**2),
    "maximum": sp.Max,
    "minimum": sp.Min,
    "fmax": sp.Max,
    "fmin": sp.Min,
    "heaviside": lambda x, y: sp.Piecewise((0, x < 0), (y, sp.Eq(x, 0)), (1, True)),
}
_COMPARE: dict[str, Callable[[Any, Any], Any]] = {
    "less": sp.StrictLessThan,
    "less_equal": sp.LessThan,
    "greater": sp.StrictGreaterThan,
    "greater_equal": sp.GreaterThan,
    "equal": sp.Eq,
    "not_equal": sp.Ne,
}


_UFUNCS: dict[str, Callable[..., Any]] = {
    **{name: _of_numbers(make, Scalar) for name, make in {**_UNARY, **_BINARY}.items()},
    **{name: _of_numbers(make, Relation) for name, make in _COMPARE.items()},
}
# Inside an object array NumPy looks for a method of the function's name on each element.
for _name in (*_UNARY, "arctan2", "hypot", "heaviside"):
    if not hasattr(Scalar, _name):
        setattr(Scalar, _name, _UFUNCS[_name])
