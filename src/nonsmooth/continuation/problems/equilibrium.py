"""Equilibria of one mode: the vector field, its derivatives, and how far the mode's boundaries are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonsmooth.flow.equilibria import ModeField, sorted_eigenvalues

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["Equilibria", "Rest"]

FloatArray = NDArray[np.float64]
MOST = 20
CLOSE = 1e-13


@dataclass
class Rest:
    """An equilibrium on a branch."""

    Y: FloatArray  # (n + 1,) scaled: states, parameter
    tangent: FloatArray
    u: FloatArray
    value: float
    jacobian: FloatArray  # (n, n)
    eigenvalues: NDArray[np.complex128]  # largest real part first
    margins: FloatArray  # (n_transitions,) of the transitions out of the mode, -inf for the others
    orientation: float


class Equilibria:
    """Zeros of one mode's vector field over one parameter.

    Parameters
    ----------
    system : System
        Autonomous.
    mode : int
    parameter : str
    width : float
        Size of the parameter.
    """

    def __init__(self, system: System, mode: int, parameter: str, width: float) -> None:
        self.system, self.mode, self.parameter = system, mode, parameter
        self.place = list(system.values).index(parameter)
        self.values, self.memory = system.parameter_vector(), system.memory_vector()
        self.field = ModeField(system.traced, mode, (self.place,))
        self.own = self.field.own
        self.n, self.n_u = len(self.own), len(system.traced.u)
        self.scale = np.append(system.scale_vector()[self.own], width)

    @cached_property
    def linear(self) -> bool:
        """The mode's field is linear in the states: where a pair passes +-i omega all its orbits are closed."""
        traced = self.system.traced
        fields = [traced.fields[self.mode][i] for i in self.own]
        return all(not f.diff(x).free_symbols & set(traced.u) for f in fields for x in traced.u)

    def whole(self, x: FloatArray) -> FloatArray:
        """All states from those of the mode."""
        u = np.zeros(self.n_u)
        u[self.own] = x
        return u

    def evaluate(self, Y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """f (n,) and its derivatives (n, n + 1) in scaled unknowns."""
        X = Y * self.scale
        values = self.values.copy()
        values[self.place] = X[-1]
        f, J, in_parameter = self.field.evaluate(self.whole(X[:-1]), values, self.memory)
        return f, np.column_stack([J, in_parameter]) * self.scale

    def correct(self, Y: FloatArray, border: FloatArray, level: float) -> tuple[FloatArray, FloatArray] | None:
        """Newton for f = 0 and border . Y = level: (Y, J)."""
        for i in range(MOST):
            f, J = self.evaluate(Y)
            matrix, right = np.vstack([J, border]), np.append(f, border @ Y - level)
            if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
                return None
            try:
                step = np.linalg.solve(matrix, right)
            except np.linalg.LinAlgError:
                return None
            Y = Y - step
            length = float(np.abs(step).max())
            if not length < 1e6:
                return None
            if length < CLOSE * (1.0 + np.abs(Y).max()) or (i > 5 and length < 1e-10):
                return Y, self.evaluate(Y)[1]
        return None

    def rest(self, Y: FloatArray, J: FloatArray, border: FloatArray) -> Rest | None:
        """A solved point with tangent, eigenvalues and margins."""
        right = np.append(np.zeros(self.n), 1.0)
        try:
            t = np.linalg.solve(np.vstack([J, border]), right)
        except np.linalg.LinAlgError:
            return None
        t /= np.linalg.norm(t)
        X = Y * self.scale
        jacobian = J[:, :-1] / self.scale[:-1]
        eigenvalues = sorted_eigenvalues(jacobian)
        values = self.values.copy()
        values[self.place] = X[-1]
        u = self.whole(X[:-1])
        margins = self.field.margins(self.field.indicators(u, values, self.memory)[0])
        sign = float(np.linalg.slogdet(np.vstack([J, t]))[0])
        return Rest(Y, t, u, float(X[-1]), jacobian, eigenvalues, margins, sign)

    def at(self, u: FloatArray, value: float) -> Rest | None:
        """The equilibrium at a value of the parameter, by Newton from a state."""
        border = np.append(np.zeros(self.n), 1.0)
        Y = np.append(u[self.own], value) / self.scale
        found = self.correct(Y, border, float(Y[-1]))
        return None if found is None else self.rest(*found, border)

    def step(self, rest: Rest, ds: float) -> Rest | None:
        """The point at distance ds along the tangent."""
        Y = rest.Y + ds * rest.tangent
        found = self.correct(Y, rest.tangent, float(rest.tangent @ Y))
        return None if found is None else self.rest(*found, rest.tangent)


def hopf_number(eigenvalues: NDArray[np.complex128]) -> float:
    """Product of all sums of two eigenvalues: zero at a Hopf point."""
    if len(eigenvalues) < 2:
        return 1.0
    i, j = np.triu_indices(len(eigenvalues), 1)
    return float(np.prod(eigenvalues[i] + eigenvalues[j]).real)
