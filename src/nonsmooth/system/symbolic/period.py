"""The forcing period, read off the traced equations.

Time may enter in sin, cos, tan of arguments linear in t; their frequencies must be rational multiples
of one another. Anything else needs ``period=``, which is checked against the equations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np
import sympy as sp

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.symbolic.traced import Traced


def timed_expressions(traced: Traced) -> dict[str, sp.Expr]:
    """All expressions in which the time may occur, each with what it is."""
    found: dict[str, sp.Expr] = {}
    for mode, part in zip(traced.mode_names, traced.fields, strict=True):
        found |= {
            f"the vector field of mode {mode!r} ({state})": e for state, e in zip(traced.state_names, part, strict=True)
        }
    found |= {f"indicator {name!r}": e for name, e in zip(traced.indicator_names, traced.indicators, strict=True)}
    for jump in traced.transitions:
        if jump.reset is not None:
            named = zip(traced.state_names, jump.reset, strict=True)
            found |= {f"the reset of {jump.label} ({state})": e for state, e in named}
        found |= {f"what {jump.label} writes to {traced.memory_names[i]!r}": e for i, e in jump.writes}
    for name, row in zip(traced.output_names, traced.outputs, strict=True):
        found |= {f"output {name!r} in mode {mode!r}": e for mode, e in zip(traced.mode_names, row, strict=True)}
    return found


def forcing_period(expressions: Sequence[sp.Expr], t: sp.Symbol, values: Mapping[sp.Symbol, float]) -> sp.Expr | None:
    """Return the common period in the parameters, positive at their values, or None where there is none to be read off.

    Parameters
    ----------
    expressions : sequence of Expr
        All that may depend on time.
    t : Symbol
    values : mapping of Symbol to float
        Those of the parameters, on which a frequency may depend.
    """
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
    expressions: Mapping[str, sp.Expr], t: sp.Symbol, others: Mapping[sp.Symbol, float], period: float, given: str
) -> None:
    """Raise unless every expression repeats after ``period`` (numerically, at fixed pseudo-random points).

    Parameters
    ----------
    expressions : mapping of str to Expr
        What each is, and its expression.
    t : Symbol
    others : mapping of Symbol to float
        Values of the parameters; states and memory are drawn at random.
    period : float
    given : str
        What the user gave, for the message.
    """
    random = np.random.default_rng(5)
    for what, expression in expressions.items():
        if t not in expression.free_symbols:
            continue
        free = sorted(expression.free_symbols - {t} - others.keys(), key=str)
        order = [t, *free, *others]
        function = sp.lambdify(order, expression, modules="numpy")
        for instant in random.uniform(0, 3 * period, 7):
            # NumPy's numbers: a power that is too large for Python's floats is an exception
            values = np.array([*random.uniform(0.1, 0.9, len(free)), *others.values()])
            with np.errstate(all="ignore"):
                now, later = (complex(function(time, *values)) for time in (instant, instant + period))
            if np.isfinite(now) and abs(later - now) > 1e-7 * (1 + abs(now)):
                raise SystemDefinitionError(
                    f"{what} does not repeat after the period {given} = {period:.12g}: "
                    f"{now.real:.9g} at t = {instant:.6g}, {later.real:.9g} one period later"
                )
