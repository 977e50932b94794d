"""Values of the parameters that the equations allow: no division by zero, no root of a negative number.

Parts of the expressions that depend on parameters alone are collected once. A single parameter in a
denominator, by far the most common, is then a look-up; others are evaluated.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.symbolic.period import timed_expressions
from nonsmooth.system.symbolic.traced import Traced


class _Rule:
    """One expression of the parameters and what it must be."""

    def __init__(self, expression: sp.Expr, kind: str, owner: str, traced: Traced) -> None:
        self.expression, self.kind, self.owner = expression, kind, owner
        self._symbols, self._names = traced.p, traced.parameter_names
        self.used = {
            name
            for symbol, name in zip(traced.p, traced.parameter_names, strict=True)
            if symbol in expression.free_symbols
        }

    @cached_property
    def _scalar(self) -> Any:
        return sp.lambdify(self._symbols, self.expression, modules="math")

    @cached_property
    def _array(self) -> Any:
        return sp.lambdify(self._symbols, self.expression, modules="numpy")

    def check(self, values: Mapping[str, float]) -> None:
        try:
            number = float(self._scalar(*(values[name] for name in self._names)))
        except (ArithmeticError, ValueError, TypeError):
            number = math.nan
        if not self.allows(number):
            raise SystemDefinitionError(self._sentence(values, number))

    def allows(self, number: Any) -> Any:
        finite = np.isfinite(number)
        if self.kind == "nonzero":
            return finite & (number != 0)
        if self.kind == "phase":
            return finite & (number >= 0) & (number < 1)
        if self.kind in ("nonnegative", "apart"):
            return finite & (number >= 0)
        return finite & (number > 0)

    def first_refused(self, points: np.ndarray) -> int | None:
        """Index of the first row of ``points`` that is not allowed."""
        with np.errstate(all="ignore"):
            refused = ~np.broadcast_to(self.allows(self._array(*points.T)), len(points))
        return int(np.argmax(refused)) if refused.any() else None

    def _sentence(self, values: Mapping[str, float], number: float) -> str:
        given = ", ".join(f"{name} = {values[name]!r}" for name in self._names if name in self.used)
        text = str(self.expression.subs({s: sp.Symbol(n) for s, n in zip(self._symbols, self._names, strict=True)}))
        if self.kind == "apart":
            return f"{given}: {self.owner}"
        if self.kind == "period":
            return f"{given} makes the forcing period {text} = {number}; it must be positive and finite"
        if self.kind == "phase":
            return f"{given} makes {self.owner}, {text}, {number}; a phase is in forcing periods, 0 <= at < 1"
        if self.kind == "nonzero":
            return f"{given} makes {self.owner} divide by zero: {text} = {number}"
        what = "root" if self.kind == "nonnegative" else "logarithm"
        return f"{given} makes {self.owner} take the {what} of {text}, which is not positive"


class Domain:
    """The conditions on the parameters of a traced system.

    Parameters
    ----------
    traced : Traced
    apart : iterable of (expression, message), optional
        Further expressions of the parameters that must not be negative.
    """

    def __init__(self, traced: Traced, apart: Iterable[tuple[sp.Expr, str]] = ()) -> None:
        self._names = traced.parameter_names
        self._zero: dict[str, str] = {}  # parameter -> what divides by it
        self._rules: list[_Rule] = []
        symbols = set(traced.p)
        owned = timed_expressions(traced)
        if traced.period is not None:
            owned["the forcing period"] = traced.period
        phases = {f"`at` of {jump.label}": jump.at for jump in traced.transitions if hasattr(jump.at, "free_symbols")}
        owned |= phases
        seen: set[tuple[sp.Expr, str]] = set()
        for owner, expression in owned.items():
            for part, kind in _restricted(expression, symbols):
                if (part, kind) in seen:
                    continue
                seen.add((part, kind))
                if part.is_Symbol and kind == "nonzero":
                    self._zero[self._names[traced.p.index(part)]] = owner
                else:
                    self._rules.append(_Rule(part, kind, owner, traced))
        if traced.period is not None:
            self._rules.append(_Rule(traced.period, "period", "", traced))
        self._rules += [_Rule(phase, "phase", owner, traced) for owner, phase in phases.items()]
        self._rules += [_Rule(expression, "apart", message, traced) for expression, message in apart]

    def check(self, values: Mapping[str, float], changed: Iterable[str] | None = None) -> None:
        """Raise SystemDefinitionError where ``values`` are not allowed.

        Parameters
        ----------
        values : mapping of name to float
        changed : iterable of str, optional
            Only what depends on these has to be looked at.
        """
        for name in values if changed is None else changed:
            if name in self._zero and values[name] == 0:
                raise SystemDefinitionError(self._by_zero(name))
        for rule in self._rules:
            if changed is None or not rule.used.isdisjoint(changed):
                rule.check(values)

    def _by_zero(self, name: str) -> str:
        return (
            f"{name} = 0 makes {self._zero[name]} divide by zero: give {name} another value, or write it without "
            f"that division"
        )

    def check_points(self, points: np.ndarray) -> None:
        """Check rows of parameter values (P, n_parameters), all points of a sweep or a chart, in one go."""
        for name in self._zero:
            if (points[:, self._names.index(name)] == 0).any():
                raise SystemDefinitionError(self._by_zero(name))
        for rule in self._rules:
            refused = rule.first_refused(points)
            if refused is not None:
                rule.check(dict(zip(self._names, points[refused].tolist(), strict=True)))


def _restricted(expression: sp.Expr, parameters: set[sp.Symbol]) -> Iterator[tuple[sp.Expr, str]]:
    """The parts, in parameters only, that must not be zero, or negative, or both."""
    for power in expression.atoms(sp.Pow):
        base, exponent = power.args
        if not base.free_symbols or not base.free_symbols <= parameters:
            continue
        if exponent.is_negative or (exponent.is_number and exponent < 0):
            yield base, "nonzero"
        if not exponent.is_integer:
            yield base, "nonnegative"
    for logarithm in expression.atoms(sp.log):
        if logarithm.free_symbols and logarithm.free_symbols <= parameters:
            yield logarithm.args[0], "positive"
