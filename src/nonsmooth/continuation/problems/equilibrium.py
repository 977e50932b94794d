"""Equilibria of one mode: the vector field, its derivatives, and how far the mode's boundaries are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.continuation.problems.curve import Curve, Point
from nonsmooth.flow.equilibria import ModeField, sorted_eigenvalues
from nonsmooth.system.system import System

__all__ = ["Equilibria", "Rest"]


@dataclass
class _Field:
    """The vector field at X, and its derivatives (n, n + 1) in scaled unknowns."""

    X: FloatArray
    f: FloatArray
    J: FloatArray


@dataclass
class Rest(Point):
    """An equilibrium on a branch."""

    solved: _Field
    u: FloatArray
    jacobian: FloatArray  # (n, n)
    eigenvalues: ComplexArray  # largest real part first
    margins: FloatArray  # (n_transitions,) of the transitions out of the mode, -inf for the others


class Equilibria(Curve[Rest]):
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

    most, longest, grows = 20, 1e6, np.inf

    def __init__(self, system: System, mode: int, parameter: str, width: float) -> None:
        self.system, self.mode, self.parameter, self.width = system, mode, parameter, width
        self.place = list(system.values).index(parameter)
        self.values, self.memory = system.parameter_vector(), system.memory_vector()
        self.field = ModeField(system.traced, mode, (self.place,))
        self.own = self.field.own
        self.scale = np.append(system.scale_vector()[self.own], width)

    @cached_property
    def linear(self) -> bool:
        """The mode's field is linear in the states: where a pair passes +-i omega all its orbits are closed."""
        traced = self.system.traced
        fields = [traced.fields[self.mode][i] for i in self.own]
        return all(not f.diff(x).free_symbols & set(traced.u) for f in fields for x in traced.u)

    def _at(self, X: FloatArray) -> tuple[FloatArray, FloatArray]:
        """All states, and all parameters."""
        u, values = np.zeros(len(self.system.traced.u)), self.values.copy()
        u[self.own], values[self.place] = X[:-1], X[-1]
        return u, values

    def evaluate(self, Y: FloatArray) -> _Field:
        """The vector field and its derivatives."""
        X = Y * self.scale
        f, J, in_parameter = self.field.evaluate(*self._at(X), self.memory)
        return _Field(X, f, np.column_stack([J, in_parameter]) * self.scale)

    def fill(self, solved: _Field, matrix: FloatArray) -> None:
        """Put the derivatives into ``matrix``."""
        matrix[:] = solved.J

    def residual(self, solved: _Field) -> FloatArray:
        """The vector field."""
        return solved.f

    def moved(self, solved: _Field, Y: FloatArray) -> _Field:
        """The vector field after a last step."""
        return self.evaluate(Y)

    def described(
        self, Y: FloatArray, tangent: FloatArray, orientation: float, iterations: int, solved: _Field
    ) -> Rest:
        """The equilibrium with its eigenvalues and margins."""
        jacobian = solved.J[:, :-1] / self.scale[:-1]
        u, values = self._at(solved.X)
        margins = self.field.margins(self.field.indicators(u, values, self.memory)[0])
        eigenvalues = sorted_eigenvalues(jacobian)
        return Rest(Y, tangent, orientation, iterations, solved, u, jacobian, eigenvalues, margins)

    def word(self) -> int:
        """The mode."""
        return self.mode

    def margins(self, point: Rest) -> FloatArray:
        """The least distance to a transition out of the mode."""
        return np.array([-point.margins.max(initial=-np.inf)])

    def at(self, u: FloatArray, value: float) -> Rest | None:
        """The equilibrium at a value of the parameter, by Newton from a state."""
        return self.at_parameter(np.append(u[self.own], value) / self.scale, value)
