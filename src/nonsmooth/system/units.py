"""Units as products of powers: what a force, an impulse or an energy is measured in, by the units of a system.

A unit is a mapping from symbols to exponents, ``{"kg": 1, "m": 1, "s": -2}``. N, J, W, Pa and Hz are written out, rad
is 1, and every other symbol (mm, V) stands for itself: nothing is converted.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sympy import Expr, Symbol

Unit = dict[str, float]

_DERIVED: dict[str, Unit] = {
    "N": {"kg": 1, "m": 1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "Hz": {"s": -1},
    "rad": {},
    "1": {},
}
_NAMED = {
    "N": _DERIVED["N"],
    "J": _DERIVED["J"],
    "W": _DERIVED["W"],
    "N s": {"kg": 1, "m": 1, "s": -1},
    "N m s": {"kg": 1, "m": 2, "s": -1},
}
_RAISED = {"\N{SUPERSCRIPT TWO}": 2, "\N{SUPERSCRIPT THREE}": 3}
_HIGH = "".join(_RAISED)
_TOKEN = re.compile(
    rf"\s*(?:([/()*\N{{MIDDLE DOT}}])(?!\*)|([^\W\d_{_HIGH}]+|%|1)(?:(?:\^|\*\*)?([+-]?\d+|[{_HIGH}]))?)"
)


def read_unit(text: str) -> Unit | None:
    """Return a unit such as ``"N s/m"`` or ``"kg/(m s^2)"``; None for none, and for what cannot be read."""
    found: list[Unit] = []
    text, sign, outer, at = text.strip(), 1, [1], 0
    if not text:
        return None
    while at < len(text):
        token = _TOKEN.match(text, at)
        if token is None:
            return None
        at, (mark, name, power) = token.end(), token.groups()
        if name:
            exponent = sign * outer[-1] * (1 if power is None else _RAISED.get(power) or int(power))
            found.append({key: exponent * of for key, of in _DERIVED.get(name, {name: 1}).items()})
            sign = 1
        elif mark == "(":
            outer.append(sign * outer[-1])
            sign = 1
        elif mark == ")":
            if len(outer) == 1:
                return None
            outer.pop()
        elif mark == "/":
            sign = -1
    return product(*found) if len(outer) == 1 and sign == 1 else None


_PREFIXES = {"n": -9, "u": -6, "\N{MICRO SIGN}": -6, "m": -3, "c": -2, "k": 3, "M": 6}


def power_between(one: str, other: str) -> int | None:
    """Return the power of ten between two units of which one is the other with a prefix, ``-3`` of ``"mm"`` and
    ``"m"``; None of any others."""
    for prefix, power in {"": 0, **_PREFIXES}.items():
        if one == prefix + other or other == prefix + one:
            return power if one == prefix + other else -power
    return None


def product(*units: Unit | None) -> Unit | None:
    """Return the unit of a product; None where one of them is not known."""
    total: Unit = {}
    for unit in units:
        if unit is None:
            return None
        for name, power in unit.items():
            total[name] = total.get(name, 0) + power
    return {name: power for name, power in total.items() if power}


def write_unit(unit: Unit | None, turning: bool = False) -> str:
    """Return a unit as text: by its own name where it has one, ``"kg/(m s)"`` else; ``""`` where it is not known.

    ``turning``: of the two that kg m^2/s^2 can be, it is the torque."""
    if unit is None:
        return ""
    if turning and unit == _DERIVED["J"]:
        return "N m"
    for name, own in _NAMED.items():
        if unit == own:
            return name
    over, below = (
        [name if abs(power) == 1 else f"{name}^{abs(power):g}" for name, power in unit.items() if power * side > 0]
        for side in (1, -1)
    )
    if not below:
        return " ".join(over) or "1"
    under = " ".join(below)
    return f"{' '.join(over) or '1'}/{under if len(below) == 1 else f'({under})'}"


def unit_of(expression: Expr, units: Mapping[Symbol, Unit | None]) -> Unit | None:
    """Return the unit of an expression, by its first term; None where no symbol in it has one.

    Numbers, and symbols without a unit beside others that have one, count as ratios."""
    known = {symbol for symbol, unit in units.items() if unit is not None}
    return _unit(expression, units) if known & expression.free_symbols else None


def _unit(e: Expr, units: Mapping[Symbol, Unit | None]) -> Unit:
    if e.is_Symbol:
        return units.get(e) or {}
    if e.is_Mul:
        return product(*(_unit(factor, units) for factor in e.args)) or {}
    if e.is_Add:
        terms = [term for term in e.args if unit_of(term, units) is not None]
        return _unit(terms[0], units) if terms else {}
    if e.is_Pow and e.exp.is_number:
        return {name: power * float(e.exp) for name, power in _unit(e.base, units).items()}
    return {}
