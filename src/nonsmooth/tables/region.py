"""``region``: where in a plane, along an axis or in time a condition on a result's quantities holds."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping
from functools import reduce
from itertools import chain
from typing import Annotated, Any

import numpy as np
import sympy as sp
import xarray as xr

from nonsmooth.errors import shortened
from nonsmooth.results.labels import by_name
from nonsmooth.system.arguments import checked
from nonsmooth.system.symbolic.expressions import read_expression
from nonsmooth.tables.quantities import dataset_of, quantities_of, quantity

_LONGEST = 2000  # characters of a condition
_COMPARE: dict[Any, Callable[[Any, Any], Any]] = {
    sp.StrictLessThan: operator.lt,
    sp.LessThan: operator.le,
    sp.StrictGreaterThan: operator.gt,
    sp.GreaterThan: operator.ge,
    sp.Eq: operator.eq,
}
#: Loads that are asked for without their element: then of each of them.
_OF_ELEMENTS = ("force", "friction_force", "impact_speed", "impacts", "impulse", "energy")
_FORM = 'a condition such as "abs(q) < 2e-3 and impact_speed < 0.1"'


@checked
def region(result: Any, condition: Annotated[str, _FORM]) -> xr.DataArray:
    r"""The points of a result at which a condition on its quantities holds.

    Parameters
    ----------
    result : xarray.Dataset
        Of ``chart``, ``sweep``, ``frequency_response``, a branch, a run.
    condition : str
        Comparisons of arithmetic expressions joined by ``and`` and ``or``: ``"abs(q3) < 2e-3 and period_number == 1"``.
        It is read by the reader of systems in text; nothing is executed. Names are those of the result's variables, of
        its parameters, and:

        - a state or an output, ``q3``: **every value that it takes**, between its minimum and its maximum, must fulfil
          the comparison, so ``abs(q3) < 2e-3`` means :math:`\max_t |q_3(t)| < 0.002`. In a run it is its value.
        - ``q3_maximum``, ``q3_minimum``, ``q3_amplitude`` (half the difference), of an output too;
        - loads of an element (of results with ``loads=True``), ``stop_impact_speed``, or of **each** element where none
          is named: ``impact_speed``, ``force``, ``impulse``, ``impacts``, ``energy``.

    Returns
    -------
    xarray.DataArray
        True and False over the result's points, with the condition as its ``long_name``. Where a quantity is not known
        (a point that failed or was not computed) or what is compared has no value (``impulse/impacts`` where there are
        none) it is False; ``unknown`` in its attributes counts these points.

    Raises
    ------
    TypeError, ValueError
        What is no result; a condition that cannot be read, or a name that the result does not hold.

    See Also
    --------
    nonsmooth.plot.chart : draws it, ``region="..."``.

    Examples
    --------
    >>> import numpy as np
    >>> import nonsmooth as ns
    >>> plane = {"omega": np.linspace(3, 5, 5), "rho": np.linspace(0.1, 0.2, 3)}
    >>> chart = ns.chart(ns.models.discontinuous_support(g=0.005), plane, progress=False)
    >>> quiet = ns.region(chart, "abs(x) < 0.01 and period_number == 1")
    >>> quiet.dims, int(quiet.sum())
    (('omega', 'rho'), 6)
    """
    data = dataset_of(result)
    known = quantities_of(data)
    tree = _parsed(condition)
    words = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)} - {"pi"}
    called = {node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
    names = sorted(words - called)
    symbols = {name: sp.Symbol(name, real=True) for name in names}
    read = read_expression(ast.unparse(tree), symbols)
    held = {symbols[name]: _held(data, name, known) for name in names}
    compared: list[Any] = [xr.DataArray(0.0), *chain.from_iterable(held.values())]
    with np.errstate(all="ignore"):
        inside = _holds(read, held, condition, compared)
        whole = reduce(operator.and_, (~np.isnan(one) for one in compared))
        inside = whole & inside
    kept = [dim for dim in data.dims if dim in inside.dims]
    inside, whole = (array.transpose(*kept).astype(bool) for array in (inside, whole & xr.ones_like(inside)))
    inside.attrs = {"long_name": " ".join(condition.split()), "unknown": int(inside.size - whole.sum())}
    return inside.rename("region")


#: A quantity by the values that it takes: its one value, or the least (of speeds of impacts zero) and the largest.
_Ends = tuple[Any, ...]


def _held(data: xr.Dataset, name: str, known: Mapping[str, xr.DataArray]) -> _Ends:
    if name in known or name in data.coords:
        one = quantity(data, name, known)
        if one.dtype.kind not in "iufb":
            raise ValueError(f"{name} is text in this result: a condition compares numbers")
        if name != "period_number":
            return (one,)
        # It is -1 of an attractor that is not there, and 0 of a run that failed or had not settled too.
        never = data["status"] == by_name("not_periodic").code if "status" in data else True
        return (one.where((one > 0) | (one == 0) & never),)
    stems = [name] if f"{name}_maximum" in known else []
    if not stems and name in _OF_ELEMENTS:
        found = (re.fullmatch(rf"(.+_{name})(?:_maximum)?", key) for key in known)
        stems = [one[1] for one in found if one is not None and not one[1].endswith(("_minimum", "_amplitude"))]
        stems = [stem for stem in dict.fromkeys(stems) if name != "force" or not stem.endswith("friction_force")]
    if not stems:
        return (quantity(data, name, known),)  # which says what there is
    if len(stems) == 1 and stems[0] in known:
        return (known[stems[0]],)
    upper: list[Any] = [known[f"{stem}_maximum"] if f"{stem}_maximum" in known else known[stem] for stem in stems]
    lower: list[Any] = [
        known[f"{stem}_minimum"] if f"{stem}_minimum" in known else one if stem in known else xr.zeros_like(one)
        for stem, one in zip(stems, upper, strict=True)
    ]
    return reduce(np.minimum, lower), reduce(np.maximum, upper)


def _parsed(condition: str) -> ast.expr:
    """The condition, ``a < b < c`` as ``a < b and b < c``; what has no meaning for ranges is refused."""
    if len(condition) > _LONGEST:
        raise ValueError(f"a condition of {len(condition)} characters is too long; at most {_LONGEST} are read")
    try:
        tree = ast.parse(condition.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        hint = "is equal to: ==; numbers stand without units"
        raise ValueError(f"cannot read the condition {shortened(condition)}: {error}; {hint}; write {_FORM}") from None
    if any(isinstance(node, ast.Not) for node in ast.walk(tree)):
        raise ValueError(f"`not` in {shortened(condition)}: write the opposite comparison, or take ~region(...)")
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitAnd | ast.BitOr):
            raise ValueError(f"`&` and `|` in {shortened(condition)}: write `and`, `or`, as in {_FORM}")
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("max", "min") and len(node.args) == 1:
            whose = ast.unparse(node.args[0])  # SymPy's is this one number, of a range either of its ends
            raise ValueError(
                f"`{ast.unparse(node)}` in {shortened(condition)}: the extremes have names, {whose}_maximum and "
                f"{whose}_minimum; {whose} alone stands for every value along the motion"
            )
    return ast.fix_missing_locations(_Chains().visit(tree))


class _Chains(ast.NodeTransformer):
    """Chains of comparisons as pairs joined by ``and``."""

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        if len(node.ops) == 1:
            return node
        terms = [node.left, *node.comparators]
        pairs = zip(terms[:-1], node.ops, terms[1:], strict=True)
        return ast.BoolOp(ast.And(), [ast.Compare(left, [op], [right]) for left, op, right in pairs])


def _holds(read: Any, held: Mapping[sp.Symbol, _Ends], condition: str, compared: list[Any]) -> Any:
    """The condition over the points; what it compares is added to ``compared``."""
    if read in (sp.true, sp.false):
        return bool(read)
    if isinstance(read, sp.And | sp.Or):
        parts = [_holds(part, held, condition, compared) for part in read.args]
        return reduce(operator.and_ if isinstance(read, sp.And) else operator.or_, parts)
    if isinstance(read, sp.Ne):  # of a range both ends may differ from what lies between them
        both = (one(*read.args, evaluate=False) for one in (sp.Lt, sp.Gt))
        return operator.or_(*(_holds(one, held, condition, compared) for one in both))
    if type(read) not in _COMPARE:
        raise ValueError(f"{shortened(condition)} is no condition: write {_FORM}")
    left, right = read.args
    cases = _cases(left - right, held, condition)
    sides = [(_value(left, one), _value(right, one)) for one in cases]
    compared += chain.from_iterable(sides)
    parts = [_COMPARE[type(read)](*pair) for pair in sides]
    speeds = [str(one) for one in read.free_symbols if len(held[one]) > 1 and str(one).endswith("impact_speed")]
    if speeds and (~parts[0] & parts[1]).any():
        raise ValueError(
            f"{shortened(condition)}: of {speeds[0]} this result holds the largest value alone, which says nothing of "
            f"the smaller ones: compare it from below ({speeds[0]} < ...), or take the quantity that ends in _maximum"
        )
    return reduce(operator.and_, parts)


def _cases(difference: sp.Expr, held: Mapping[sp.Symbol, _Ends], condition: str) -> list[dict[sp.Symbol, Any]]:
    """Values of the symbols at which a comparison is asked: where a quantity takes many, at the ends of its range, or
    of the range of its absolute value. What is linear in it holds between them too."""
    here = difference.free_symbols
    values = {symbol: ends[0] for symbol, ends in held.items() if symbol in here and len(ends) == 1}
    wide = [symbol for symbol in here if len(held[symbol]) > 1]
    if not wide:
        return [values]
    symbol = wide[0]
    size = sp.Symbol("size_", nonnegative=True)
    plain = difference.subs(sp.Abs(symbol), size)
    along = size if plain.has(size) else symbol
    if len(wide) > 1 or (plain.has(size) and plain.has(symbol)) or sp.diff(plain, along).has(along):
        names = " and ".join(sorted(map(str, wide)))
        raise ValueError(
            f"{shortened(condition)}: {names} stands for all values along the motion: a comparison may hold one such "
            f"name, alone, times a number, or in abs(); for more of them together give the system an output, or take "
            f"{symbol}_maximum, {symbol}_minimum"
        )
    lower, upper = held[symbol]
    if along is size:
        crossed = (lower <= 0) & (upper >= 0)
        lower, upper = abs(lower), abs(upper)
        lower, upper = np.minimum(lower, upper).where(~crossed, 0.0), np.maximum(lower, upper)
    return [values | {symbol: end} for end in (lower, upper)]


def _value(expression: sp.Expr, values: Mapping[sp.Symbol, Any]) -> Any:
    symbols = sorted(expression.free_symbols, key=str)
    if not symbols:
        return float(expression)
    return sp.lambdify(symbols, expression, modules="numpy")(*(values[one] for one in symbols))
