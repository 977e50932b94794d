r"""Exact derivatives of everything traced, built when first asked for and kept.

Jacobians of the vector fields, resets and writes, gradients of indicators and outputs, in u, t, p and
memory; Hessians of indicators; Lie derivatives
:math:`L_f h = h_t + h_u f`, :math:`L_f^k h = L_f (L_f^{k-1} h)` along a mode's field.
All are expanded, so that "is it constant?" is a question about free symbols.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import sympy as sp

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced

Vector = tuple[sp.Expr, ...]
Matrix = tuple[Vector, ...]


class Derivatives:
    """Derivatives of a traced system.

    Parameters
    ----------
    traced : Traced

    Notes
    -----
    ``of`` is one of ``"u"``, ``"t"``, ``"p"``, ``"m"`` (memory): the columns of a Jacobian. All methods
    take indices and return tuples of SymPy expressions.
    """

    def __init__(self, traced: Traced) -> None:
        self.traced = traced
        # One cache for each object, gone with it (a cache on the methods would keep the object alive).
        self.field = cache(self._field)
        self.indicator = cache(self._indicator)
        self.indicator_hessian = cache(self._indicator_hessian)
        self.output = cache(self._output)
        self.reset = cache(self._reset)
        self.write = cache(self._write)
        self.lie = cache(self._lie)
        self.divergence = cache(self._divergence)

    def variables(self, of: str) -> tuple[sp.Symbol, ...]:
        """The symbols meant by ``of``."""
        t = self.traced
        try:
            return {"u": t.u, "t": (t.t,), "p": t.p, "m": t.m}[of]
        except KeyError:
            raise ValueError(f"`of` is one of 'u', 't', 'p', 'm', not {of!r}") from None

    def _gradient(self, expression: sp.Expr, of: str) -> Vector:
        free = expression.free_symbols
        return tuple(sp.expand(expression.diff(s)) if s in free else sp.Integer(0) for s in self.variables(of))

    def _field(self, mode: int, of: str = "u") -> Matrix:
        """Jacobian of a vector field, (n, n_of)."""
        return tuple(self._gradient(entry, of) for entry in self.traced.fields[mode])

    def _divergence(self, mode: int) -> sp.Expr:
        """Divergence of a vector field: the rate at which it changes volumes."""
        return sp.expand(sum(self.field(mode, "u")[i][i] for i in range(len(self.traced.u))))

    def _indicator(self, indicator: int, of: str = "u") -> Vector:
        """Gradient of an indicator, (n_of,)."""
        return self._gradient(self.traced.indicators[indicator], of)

    def _indicator_hessian(self, indicator: int) -> Matrix:
        """Second derivatives of an indicator in u, (n, n)."""
        return tuple(self._gradient(entry, "u") for entry in self.indicator(indicator, "u"))

    def _output(self, output: int, mode: int, of: str = "u") -> Vector:
        """Gradient of an output in a mode, (n_of,)."""
        return self._gradient(self.traced.outputs[output][mode], of)

    def _reset(self, transition: int, of: str = "u") -> Matrix:
        """Jacobian of the map applied at a transition, (n, n_of); the identity's where there is none."""
        reset = self.traced.transitions[transition].reset
        return tuple(self._gradient(entry, of) for entry in (self.traced.u if reset is None else reset))

    def _write(self, transition: int, of: str = "u") -> dict[int, Vector]:
        """Gradients of what a transition writes, by index of memory."""
        return {i: self._gradient(value, of) for i, value in self.traced.transitions[transition].writes}

    def _lie(self, indicator: int, mode: int, order: int = 1) -> sp.Expr:
        """Lie derivative of an indicator along the field of a mode, order 0 to 3 and more."""
        if order < 0:
            raise ValueError(f"the order of a Lie derivative is not negative, {order}")
        if order == 0:
            return self.traced.indicators[indicator]
        before, t = self.lie(indicator, mode, order - 1), self.traced
        flow = sum(before.diff(u) * f for u, f in zip(t.u, t.fields[mode], strict=True))
        return sp.expand(before.diff(t.t) + flow)
