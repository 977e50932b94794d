"""Facts of the traced equations about parameters: the forcing period, and values that divide nothing by zero.

Parts of the expressions that depend on parameters alone are collected once, and evaluated all together.

Time may enter in sin, cos, tan of arguments linear in t; their frequencies must be rational multiples
of one another. Anything else needs ``period=``, which is checked against the equations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.symbolic.numeric import numeric
from nonsmooth.system.symbolic.traced import Traced

REPEATS = 1e-6  # radians that a wave may be off after a period, or twice what it is where the system is defined


def timed_expressions(traced: Traced) -> list[tuple[str, sp.Expr]]:
    """All expressions in which the time may occur, each with what it is; several transitions may have one label."""
    found: list[tuple[str, sp.Expr]] = []
    for mode, part in zip(traced.mode_names, traced.fields, strict=True):
        named = zip(traced.state_names, part, strict=True)
        found += [(f"the vector field of mode {mode!r} ({state})", e) for state, e in named]
    found += [(f"indicator {name!r}", e) for name, e in zip(traced.indicator_names, traced.indicators, strict=True)]
    for jump in traced.transitions:
        if jump.reset is not None:
            named = zip(traced.state_names, jump.reset, strict=True)
            found += [(f"the reset of {jump.label} ({state})", e) for state, e in named]
        found += [(f"what {jump.label} writes to {traced.memory_names[i]!r}", e) for i, e in jump.writes]
    for name, row in zip(traced.output_names, traced.outputs, strict=True):
        found += [(f"output {name!r} in mode {mode!r}", e) for mode, e in zip(traced.mode_names, row, strict=True)]
    return found


def forcing_period(expressions: Sequence[sp.Expr], t: sp.Symbol, values: Mapping[sp.Symbol, float]) -> sp.Expr | None:
    """Return the common period of expressions in the parameters, positive at their ``values``, or None where there is
    none to be read off."""
    frequencies: list[sp.Expr] = []
    for expression in expressions:
        if not _collect(expression, t, values, frequencies):
            return None
    if not frequencies:
        return None
    ratios = [sp.cancel(frequency / frequencies[0]) for frequency in frequencies]
    ratios = [_simple(ratio) for ratio in ratios]
    if not all(ratio.is_Rational for ratio in ratios):
        return None
    # gcd of fractions: gcd of the numerators over lcm of the denominators
    base = sp.Rational(sp.igcd(*(r.p for r in ratios), 0), sp.ilcm(*(r.q for r in ratios), 1))
    return 2 * sp.pi / (base * frequencies[0])


def repeating(
    expressions: Iterable[sp.Expr], t: sp.Symbol, period: sp.Expr, values: Mapping[sp.Symbol, float]
) -> list[sp.Expr]:
    """Return expressions of the parameters that are not negative where harmonics repeat after a given period, as they
    do at some ``values``: those of which it is no multiple by form."""
    frequencies: list[sp.Expr] = []
    for expression in expressions:
        _collect(expression, t, values, frequencies)
    turns = [sp.cancel(frequency * period / sp.pi) for frequency in frequencies]
    # half a turn is whole where a wave stands in an even power
    shares = [(half, 1 if round(float(half.subs(values))) % 2 else 2) for half in turns if half.free_symbols]
    off = [sp.Abs(sp.sin(sp.pi * half / share)) for half, share in shares]
    return [max(REPEATS, 2.0 * float(one.subs(values))) - one for one in off]


def _simple(ratio: sp.Expr) -> sp.Expr:
    """Return the small fraction a float stands for (3.3/1.1 is 3), or what was given."""
    if not ratio.is_Float:
        return ratio
    fraction = Fraction(float(ratio)).limit_denominator(1000)
    close = abs(float(ratio) - float(fraction)) <= 1e-13 * abs(float(ratio))
    return sp.Rational(fraction.numerator, fraction.denominator) if close else ratio


def _collect(e: sp.Expr, t: sp.Symbol, values: Mapping[sp.Symbol, float], found: list[sp.Expr]) -> bool:
    """Add the frequencies in ``e`` to ``found``; False where t occurs in another way."""
    if t not in e.free_symbols:
        return True
    if isinstance(e, (sp.sin, sp.cos, sp.tan)):
        argument = sp.expand(e.args[0])
        slope = argument.diff(t)
        if slope.free_symbols <= values.keys():
            # SymPy writes cos(w t - c) as cos(c - w t): what is negative of positive parameters is turned round. Of a
            # difference their values say it.
            sign = slope.subs({p: sp.Dummy(positive=True) for p in slope.free_symbols})
            size = -slope if (slope.subs(values) if sign.is_positive is None else sign).is_negative else slope
            if size not in found:
                found.append(size)
            return True
    return bool(e.args) and all(_collect(part, t, values, found) for part in e.args)


def check_period(
    traced: Traced, expressions: Iterable[tuple[str, sp.Expr]], values: Sequence[float], period: float, given: str
) -> None:
    """Raise unless every expression, by what it is, repeats after the ``period`` that was ``given``: numerically, at
    these parameters and fixed pseudo-random states and memory."""
    random = np.random.default_rng(5)
    t = random.uniform(0, 3 * period, 7)
    u, m = (random.uniform(0.1, 0.9, (7, len(some))) for some in (traced.u, traced.m))
    for what, expression in expressions:
        if traced.t not in expression.free_symbols:
            continue
        now, later = (numeric(traced, (expression,))(values, time, u, m)[:, 0] for time in (t, t + period))
        with np.errstate(all="ignore"):
            off = np.isfinite(now) & (np.abs(later - now) > 1e-7 * (1 + np.abs(now)))
        for i in np.flatnonzero(off):
            raise SystemDefinitionError(
                f"{what} does not repeat after the period {given} = {period:.12g}: "
                f"{now[i]:.9g} at t = {t[i]:.6g}, {later[i]:.9g} one period later"
            )


#: Of each kind of rule, which finite numbers it allows, and the sentence on another.
_RULES: dict[str, tuple[Callable[[Any], Any], str]] = {
    "divisor": (
        lambda x: x != 0,
        "{text} = 0 makes {owner} divide by zero: give {text} another value, or write it without that division",
    ),
    "nonzero": (lambda x: x != 0, "{given} makes {owner} divide by zero: {text} = {number}"),
    "nonnegative": (lambda x: x >= 0, "{given} makes {owner} take the root of {text}, which is not positive"),
    "positive": (lambda x: x > 0, "{given} makes {owner} take the logarithm of {text}, which is not positive"),
    "period": (
        lambda x: x > 0,
        "{given} makes the forcing period {text} = {number}; it must be positive and finite",
    ),
    "phase": (
        lambda x: (x >= 0) & (x < 1),
        "{given} makes {owner}, {text}, {number}; a phase is in forcing periods, 0 <= at < 1",
    ),
    "apart": (lambda x: x >= 0, "{given}: {owner}"),
}


class Domain:
    """The conditions on the parameters of a traced system; ``apart`` are further expressions of them that must not be
    negative, each with its message."""

    def __init__(self, traced: Traced, apart: Iterable[tuple[sp.Expr, str]] = ()) -> None:
        owned, period = timed_expressions(traced), traced.period
        phases = [(f"`at` of {jump.label}", jump.at) for jump in traced.transitions if hasattr(jump.at, "free_symbols")]
        owned += phases if period is None else [("the forcing period", period), *phases]
        rules: dict[tuple[sp.Expr, str], str] = {}  # expression and kind -> what it belongs to
        for owner, expression in owned:
            for part, kind in _restricted(expression, set(traced.p)):
                rules.setdefault((part, kind), owner)
        rules |= {} if period is None else {(period, "period"): ""}
        rules |= {(phase, "phase"): owner for owner, phase in phases}
        self._rules = rules | {(expression, "apart"): message for expression, message in apart}
        self._expressions = tuple(expression for expression, _ in self._rules)
        self._allows = [_RULES[kind][0] for _, kind in self._rules]
        used = set[sp.Basic]().union(*(expression.free_symbols for expression in self._expressions))
        names = zip(traced.p, traced.parameter_names, strict=True)
        self._traced, self._used = traced, {name for symbol, name in names if symbol in used}

    @cached_property
    def _at_one(self) -> Callable[[list[float]], list[float]]:
        return numeric(self._traced, self._expressions, quick=True)

    def check(self, values: Mapping[str, float], changed: Iterable[str] | None = None) -> None:
        """Raise SystemDefinitionError where ``values`` are not allowed, of which some have ``changed``."""
        if changed is not None and self._used.isdisjoint(changed):
            return
        point = [values[name] for name in self._traced.parameter_names]
        try:
            found = zip(self._at_one(point), self._allows, strict=True)
            fine = all(math.isfinite(number) and allows(number) for number, allows in found)
        except (ArithmeticError, ValueError, TypeError):  # or a power is complex
            fine = False
        if not fine:
            self.check_points(np.array([point]))

    def check_points(self, points: np.ndarray) -> None:
        """Check rows of parameter values (P, n_parameters), all points of a sweep or a chart, in one go."""
        numbers = numeric(self._traced, self._expressions)(points)
        for ((expression, kind), owner), allows, column in zip(
            self._rules.items(), self._allows, numbers.T, strict=True
        ):
            refused = ~(np.isfinite(column) & allows(column))
            if refused.any():
                i = int(refused.argmax())
                values = zip(self._traced.p, self._traced.parameter_names, points[i].tolist(), strict=True)
                given = ", ".join(f"{name} = {value!r}" for p, name, value in values if p in expression.free_symbols)
                text = expression.xreplace({s: sp.Symbol(n) for s, n in self._traced.named().items()})
                says = _RULES[kind][1]
                raise SystemDefinitionError(says.format(given=given, owner=owner, text=text, number=column[i]))


def _restricted(expression: sp.Expr, parameters: set[sp.Symbol]) -> Iterator[tuple[sp.Expr, str]]:
    """The parts, in parameters only, that must not be zero, or negative, or both."""
    for power in expression.atoms(sp.Pow):
        base, exponent = power.args
        if not base.free_symbols or not base.free_symbols <= parameters:
            continue
        if exponent.is_negative or (exponent.is_number and exponent < 0):
            yield base, "divisor" if base.is_Symbol else "nonzero"
        if not exponent.is_integer:
            yield base, "nonnegative"
    for logarithm in expression.atoms(sp.log):
        if logarithm.free_symbols and logarithm.free_symbols <= parameters:
            yield logarithm.args[0], "positive"
