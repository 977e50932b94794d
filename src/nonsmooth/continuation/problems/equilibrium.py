"""Equilibria of one mode: the vector field, its derivatives, and how far the mode's boundaries are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.continuation.march.arclength import Curve, Point
from nonsmooth.continuation.march.event import Crossing, Event, Fold, Met, Step
from nonsmooth.continuation.march.marches import INTERRUPTED
from nonsmooth.continuation.problems.multipliers import pairs
from nonsmooth.flow.equilibria import ModeField, sorted_eigenvalues

if TYPE_CHECKING:
    from nonsmooth.continuation.march.marches import March
    from nonsmooth.system.system import System

__all__ = ["Equilibria", "Rest"]

COMMON = 1e-8  # of the states' scales: nearer than this two equilibria are one
BEYOND = 1e-6  # along the branch: the first equilibrium behind a boundary
ENDS = {
    "range": "The branch reached the edge of the range.",
    "points": "The largest number of points was reached.",
    "no_convergence": "Newton's method did not converge, however small the step.",
    "boundary": (
        "The equilibrium meets the boundary of its mode, and no equilibrium of the mode beyond continues it: on the "
        "other side it is virtual."
    ),
    "interrupted": f"{INTERRUPTED}.",
}


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


class Hopf(Event):
    """A pair of eigenvalues passes +-i omega; in a linear mode a focus becomes a centre."""

    name = "hopf"

    def number(self, curve: Any, point: Any) -> float:
        """The product of all sums of two eigenvalues."""
        if len(point.eigenvalues) < 2:
            return 1.0
        i, j = pairs(len(point.eigenvalues))
        return float(np.prod(point.eigenvalues[i] + point.eigenvalues[j]).real)

    def named(self, step: Step, point: Any) -> tuple[str, str | None] | None:
        """None where the sum of two real eigenvalues vanishes."""
        nearest = point.eigenvalues[np.argmin(np.abs(point.eigenvalues.real))]
        if abs(nearest.imag) <= 1e-9:
            return None
        return ("focus_centre" if step.curve.linear else "hopf"), None


class Edge(Event):
    """The equilibrium reaches the boundary of its mode."""

    name = "boundary_equilibrium"

    def number(self, curve: Any, point: Any) -> float:
        """The least distance to a transition."""
        return float(curve.margins(point)[0])

    def happened(self, step: Step, was: float, now: float) -> bool:
        """Return whether the equilibrium leaves its mode on the step."""
        return now < 0.0 < was


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

    kinds = (Fold(), Crossing(), Hopf())
    boundaries = (Edge(),)
    endings = ENDS
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

    def behind(self, found: March, met: list[Met]) -> tuple[Equilibria, Rest] | None:
        """Record the boundary; the equilibrium of the mode behind it, or None."""
        found.mark(met[0].name, self, met[0].point)
        after = self._beyond(met[0].point)
        if after is None:
            found.ending = "boundary"
        return after

    def _beyond(self, rest: Rest) -> tuple[Equilibria, Rest] | None:
        """The equilibrium of the mode behind a boundary, where the two meet; None where there is none."""
        jump = self.system.transitions[int(rest.margins.argmax())]
        if jump.reset is not None or jump.target == self.mode:
            return None
        other = Equilibria(self.system, jump.target, self.parameter, self.width)
        common = other.at(rest.u, rest.value)
        if common is None or np.abs((common.u - rest.u) / self.system.scale_vector()).max() > COMMON:
            return None
        for one in (common.facing(1.0), common.facing(-1.0)):
            first = other.step(one, BEYOND)
            if first is not None and (first.margins <= 0.0).all():
                return other, first
        return None
