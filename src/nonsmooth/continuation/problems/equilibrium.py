"""Equilibria of one mode: the vector field, its derivatives, and how far the mode's boundaries are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.continuation.problems.curve import Curve, Point
from nonsmooth.flow.equilibria import ModeField, sorted_eigenvalues
from nonsmooth.system.system import System

__all__ = ["Equilibria", "Rest", "SetOfEquilibria", "set_near"]

EDGE = 1e-12  # of an indicator's size: zero
CLOSE = 1e-11
FREE = 1e-9  # a singular value as small as this leaves its direction free
STEP = 1e-6  # of differences, of the parameter's range


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
    ends: tuple[FloatArray, FloatArray]  # of the set it stands for: twice the state where it is a single one


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
    ) -> Rest | None:
        """The equilibrium with its eigenvalues and margins."""
        jacobian = solved.J[:, :-1] / self.scale[:-1]
        u, values = self._at(solved.X)
        h, h_u = self.field.indicators(u, values, self.memory)
        margins = self.field.margins(h, EDGE * (np.abs(h_u) @ (self.system.scale_vector() + np.abs(u))))
        eigenvalues = sorted_eigenvalues(jacobian)
        return Rest(Y, tangent, orientation, iterations, solved, u, jacobian, eigenvalues, margins, (u, u))

    def stable(self, rest: Rest) -> bool:
        """Return whether all eigenvalues have negative real parts."""
        return bool((rest.eigenvalues.real < 0).all())

    def word(self) -> int:
        """The mode."""
        return self.mode

    def margins(self, point: Rest) -> FloatArray:
        """The least distance to a transition out of the mode."""
        return np.array([-point.margins.max(initial=-np.inf)])

    def at(self, u: FloatArray, value: float) -> Rest | None:
        """The equilibrium at a value of the parameter, by Newton from a state."""
        return self.at_parameter(np.append(u[self.own], value) / self.scale, value)


class SetOfEquilibria(Equilibria):
    """Equilibria of a mode that leaves one direction free, as dry friction does: an interval between two boundaries.

    One end is followed, by the field's independent equations and the indicator that vanishes there; the other one is
    solved for beside it.
    """

    def __init__(
        self, system: System, mode: int, parameter: str, width: float, ends: tuple[int, int], other: FloatArray
    ) -> None:
        super().__init__(system, mode, parameter, width)
        self.ends, self._other = ends, other
        self._across: FloatArray | None = None  # (n - 1, n) the independent equations among those of the field

    def evaluate(self, Y: FloatArray, end: int = 0) -> _Field:
        """The independent equations, the indicator of an end, and their derivatives."""
        solved = super().evaluate(Y)
        if self._across is None:
            self._across = np.linalg.svd(solved.J[:, :-1] / self.scale[:-1])[0][:, :-1].T
        u, values = self._at(solved.X)
        at = self.ends[end]
        h, h_u = (found[at] for found in self.field.indicators(u, values, self.memory))
        step = STEP * self.width  # indicators are differentiated in the states only
        there = [self.field.indicators(u, values + sign * step * self._unit, self.memory)[0][at] for sign in (1, -1)]
        slopes = np.append(h_u[self.own], (there[0] - there[1]) / (2.0 * step)) * self.scale
        return _Field(solved.X, np.append(self._across @ solved.f, h), np.vstack([self._across @ solved.J, slopes]))

    @cached_property
    def _unit(self) -> FloatArray:
        return np.eye(len(self.values))[self.place]

    def described(
        self, Y: FloatArray, tangent: FloatArray, orientation: float, iterations: int, solved: _Field
    ) -> Rest | None:
        """The middle of the set with its two ends; None where the other end is not found."""
        other, values = Y.copy(), self._at(solved.X)[1]
        other[:-1] = self._other / self.scale[:-1]
        for _ in range(self.most):
            there = self.evaluate(other, 1)
            step = np.linalg.lstsq(there.J[:, :-1], -there.f, rcond=None)[0]
            other[:-1] += step
            if np.abs(step).max() < CLOSE:
                break
        else:
            return None
        self._other = other[:-1] * self.scale[:-1]
        ends = self._at(solved.X)[0], self._at(other * self.scale)[0]
        middle = 0.5 * (ends[0] + ends[1])
        jacobian = self.field.evaluate(middle, values, self.memory)[1]
        margins = np.max([self.inside(u, values, end) for u, end in zip(ends, self.ends, strict=True)], axis=0)
        eigenvalues = sorted_eigenvalues(jacobian)
        return Rest(Y, tangent, orientation, iterations, solved, middle, jacobian, eigenvalues, margins, ends)

    def inside(self, u: FloatArray, values: FloatArray, end: int) -> FloatArray:
        """Margins at an end but for the transitions that it is the boundary of."""
        h, h_u = self.field.indicators(u, values, self.memory)
        margins = self.field.margins(h, EDGE * (np.abs(h_u) @ (self.system.scale_vector() + np.abs(u))))
        own = [any(row.indicator == end for row in jump.rows) for jump in self.field.traced.transitions]
        return np.where(own, -np.inf, margins)

    def stable(self, rest: Rest) -> bool:
        """Return whether all eigenvalues but that of the free direction have negative real parts."""
        others = np.delete(rest.eigenvalues, int(np.abs(rest.eigenvalues).argmin()))
        return bool((others.real < 0).all())


def set_near(single: Equilibria, u: FloatArray, value: float) -> tuple[SetOfEquilibria, Rest] | None:
    """The interval of equilibria of a mode next to a state; None where it has none, or leaves more free."""
    system, mode = single.system, single.mode
    u, values = u.copy(), single.values.copy()
    values[single.place] = value
    for _ in range(single.most):
        f, J, _ = single.field.evaluate(u, values, single.memory)
        if not (np.isfinite(f).all() and np.isfinite(J).all()) or not len(f):
            return None
        u[single.own] -= np.linalg.lstsq(J, f, rcond=None)[0]
    _, sizes, right = np.linalg.svd(J * single.scale[:-1])
    free = sizes <= FREE * max(float(sizes[0]), FREE)
    if free.sum() != 1 or np.abs(f).max() > CLOSE * max(1.0, float(np.abs(J).max())):
        return None
    line = np.zeros(len(u))
    line[single.own] = right[-1] * single.scale[:-1]
    found: list[tuple[float, int]] = []
    for i in sorted({row.indicator for jump in system.transitions if jump.source == mode for row in jump.rows}):
        s = 0.0
        for _ in range(single.most):
            h, h_u = single.field.indicators(u + s * line, values, single.memory)
            slope = float(h_u[i] @ line)
            if slope == 0.0:  # this indicator bounds nothing here
                s = np.inf
                break
            s -= float(h[i]) / slope
        probe = SetOfEquilibria(system, mode, single.parameter, single.width, (i, i), u)
        if np.isfinite(s) and (probe.inside(u + s * line, values, i) < 0.0).all():
            found.append((s, i))
    if len(found) != 2:
        return None
    (low, first), (high, second) = sorted(found)
    if line[int(np.abs(line).argmax())] < 0.0:
        low, first, high, second = high, second, low, first
    ends = [(u + s * line)[single.own] for s in (low, high)]
    curve = SetOfEquilibria(system, mode, single.parameter, single.width, (first, second), ends[1])
    rest = curve.at_parameter(np.append(ends[0], value) / curve.scale, value)
    return (curve, rest) if rest is not None and (rest.margins < 0.0).all() else None
