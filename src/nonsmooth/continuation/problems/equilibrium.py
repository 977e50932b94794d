"""Equilibria of one mode: the vector field, its derivatives, and how far the mode's boundaries are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.continuation.problems.curve import Curve, Point
from nonsmooth.flow.equilibria import sorted_eigenvalues
from nonsmooth.flow.equilibrium_sets import EquilibriumSet, equilibrium_sets, modes_of_sets
from nonsmooth.flow.mode_fields import mode_field
from nonsmooth.flow.polytopes import Extreme
from nonsmooth.system.system import System

EDGE = 1e-12  # of an indicator's size: zero
CLOSE = 1e-11
FREE = 1e-9  # a singular value as small as this leaves its direction free
ALIKE = 1e-7  # of the states' scales: extents this near are those of one set
FARTHEST = 1.0  # of the states' scales: an extreme point that moves more on a step may be another one
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

    curve: Equilibria
    solved: _Field
    u: FloatArray
    jacobian: FloatArray  # (n, n)
    eigenvalues: ComplexArray  # largest real part first
    margins: FloatArray  # (n_transitions,) of the transitions out of the mode, -inf for the others
    lower: FloatArray  # extent of the set it stands for
    upper: FloatArray


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
    watched: tuple[int, ...] = ()  # modes in which lie sets of equilibria that may run into this one

    def __init__(self, system: System, mode: int, parameter: str, width: float) -> None:
        self.system, self.mode, self.parameter, self.width = system, mode, parameter, width
        self.place = list(system.values).index(parameter)
        self.values, self.memory = system.parameter_vector(), system.memory_vector()
        self.field = mode_field(system.traced, mode, (self.place,))
        self.own = self.field.own
        self.scale = np.append(system.scale_vector()[self.own], width)

    @property
    def linear(self) -> bool:
        """The mode's field is linear in the states: where a pair passes +-i omega all its orbits are closed."""
        return self.field.linear

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

    def described(self, point: Point) -> Rest | None:
        """The equilibrium with its eigenvalues and margins."""
        u, values = self._at(point.X)
        h, h_u = self.field.indicators(u, values, self.memory)
        margins = self.field.margins(h, EDGE * (np.abs(h_u) @ (self.system.scale_vector() + np.abs(u))))
        return self._measured(point, u, point.solved.J[:, :-1] / self.scale[:-1], margins, u, u)

    def _measured(
        self,
        point: Point,
        u: FloatArray,
        jacobian: FloatArray,
        margins: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
    ) -> Rest:
        eigenvalues = sorted_eigenvalues(jacobian)
        return Rest(
            **vars(point), u=u, jacobian=jacobian, eigenvalues=eigenvalues, margins=margins, lower=lower, upper=upper
        )

    def stable(self, rest: Rest) -> bool:
        """Return whether all eigenvalues have negative real parts."""
        return bool((rest.eigenvalues.real < 0).all())

    def spread(self, a: Rest, b: Rest) -> float:
        """1 where more than a pair of eigenvalues becomes stable or unstable: two events of a step hide each other."""
        unstable = [int((one.eigenvalues.real > 0.0).sum()) for one in (a, b)]
        return float(abs(unstable[1] - unstable[0]) > 2)

    def word(self) -> Any:
        """The mode."""
        return self.mode

    def margins(self, point: Rest) -> FloatArray:
        """The least distance to a transition out of the mode."""
        return np.array([-point.margins.max(initial=-np.inf)])

    def alone(self, rest: Rest) -> bool:
        """Return whether no other set of equilibria has run into this one."""
        if not self.watched:
            return True
        found = equilibrium_sets(self.system, rest.u, values=self._at(rest.X)[1], modes=self.watched)
        size = ALIKE * self.system.scale_vector()
        return any(_within(rest, one, size) and _within(one, rest, size) for one in found)


class _Corner(Equilibria):
    """An extreme point of a set: the independent equations of its mode's field and the conditions that vanish there."""

    def __init__(self, system: System, parameter: str, width: float, extreme: Extreme, value: float) -> None:
        super().__init__(system, extreme.mode, parameter, width)
        self.known = {value: extreme.u}  # by the parameter
        self.u, self.side, self.keys = extreme.u, extreme.side, [i for i, _ in extreme.keys]
        self.unit = np.eye(len(self.values))[self.place] * STEP * width
        # conditions that are met there by construction
        self.met = [any(row.indicator in self.keys for row in jump.rows) for jump in system.traced.transitions]
        self.signs = np.array([sign for _, sign in extreme.keys])
        self.across = np.zeros((0, 0))  # the independent equations among those of the field

    def evaluate(self, Y: FloatArray) -> _Field:
        """As many equations as states, and their derivatives in scaled unknowns; what nothing bounds rests."""
        solved, keys = super().evaluate(Y), self.keys
        (u, values), f, J = self._at(solved.X), solved.f, solved.J
        if not len(self.across):
            left, sizes, _ = np.linalg.svd(J[:, :-1])
            self.across = left[:, : int((sizes > FREE * max(float(sizes[0]), FREE)).sum())].T
        h, h_u = self.field.indicators(u, values, self.memory)
        # indicators are differentiated in the states only
        there = [self.field.indicators(u, values + one, self.memory)[0] for one in (self.unit, -self.unit)]
        slopes = np.column_stack([h_u[:, self.own] * self.scale[:-1], (there[0] - there[1]) / (2.0 * STEP)])[keys]
        J, f = np.vstack([self.across @ J, slopes]), np.append(self.across @ f, h[keys])
        if (missing := len(self.own) - len(f)) > 0:
            still = np.linalg.svd(J[:, :-1])[2][-missing:]
            f = np.append(f, still @ (Y[:-1] - self.u[self.own] / self.scale[:-1]))
            J = np.vstack([J, np.pad(still, ((0, 0), (0, 1)))])
        return _Field(solved.X, f, J)

    def solved(self, value: float) -> FloatArray | None:
        """The corner at another value of the parameter, from the nearest where it is known."""
        begun = self.known[min(self.known, key=lambda one: abs(one - value))]
        Y, border = np.append(begun[self.own], value) / self.scale, np.eye(self.n)[-1]
        found = self.correct(Y, border, float(Y[-1]), tolerance=CLOSE, singular=True)
        if found is None or np.abs(found[1] - Y).max() > FARTHEST:
            return None
        self.known[value] = self._at(found[0].X)[0]
        return self.known[value]

    def clearances(self, u: FloatArray, value: float) -> tuple[FloatArray, float]:
        """Margins of the conditions that are not met by construction; and how nearly another corner is as extreme."""
        solved = self.evaluate(np.append(u[self.own], value) / self.scale)
        h, h_u = self.field.indicators(*self._at(solved.X), self.memory)
        edge = EDGE * (np.abs(h_u) @ (self.system.scale_vector() + np.abs(u)))
        margins = np.where(self.met, -np.inf, self.field.margins(h, edge))
        if not self.keys:
            return margins, -np.inf
        (k, sign), J = self.side, solved.J[:, :-1]
        pushes = np.linalg.lstsq(J.T, sign * np.eye(len(J))[self.own.index(k)], rcond=None)[0]
        own = (pushes * np.abs(J).max(axis=1))[len(self.across) :][: len(self.keys)] * self.signs
        return margins, -float(own.min() / max(np.abs(own).max(), FREE)) - FREE


class SetOfEquilibria(_Corner):
    """A set of equilibria, as dry friction leaves it: one of its extreme points is followed, the others beside it."""

    def __init__(self, system: System, parameter: str, width: float, found: EquilibriumSet, value: float) -> None:
        mode = found.modes[0]
        first = min(found.extremes, key=lambda one: one.mode != mode, default=None) or Extreme(found.point, mode)
        super().__init__(system, parameter, width, first, value)
        self.found, self.mode = found, mode
        others = (_Corner(system, parameter, width, one, value) for one in found.extremes if one is not first)
        self.corners: list[_Corner] = [self, *others]

    def described(self, point: Point) -> Rest | None:
        """The middle of the set with its extent; None where an extreme point is not found."""
        first, values = self._at(point.X)
        ends: list[Any] = [first, *(corner.solved(point.value) for corner in self.corners[1:])]
        if any(end is None for end in ends):
            return None
        both = [corner.clearances(u, point.value) for corner, u in zip(self.corners, ends, strict=True)]
        margins = np.append(np.max([one for one, _ in both], axis=0), max(other for _, other in both))
        lower = np.where(np.isinf(self.found.lower), -np.inf, np.min(ends, axis=0))
        upper = np.where(np.isinf(self.found.upper), np.inf, np.max(ends, axis=0))
        middle = np.mean(ends, axis=0)
        jacobian = mode_field(self.system.traced, self.mode, (self.place,)).evaluate(middle, values, self.memory)[1]
        return self._measured(point, middle, jacobian, margins, lower, upper)

    def word(self) -> Any:
        """The conditions at the extreme points, and their modes."""
        return tuple((corner.field.mode, tuple(sorted(corner.keys))) for corner in self.corners)

    def stable(self, rest: Rest) -> bool:
        """Return whether all eigenvalues but those of the free directions have negative real parts."""
        others = np.argsort(np.abs(rest.eigenvalues))[self.found.free :]
        return bool((rest.eigenvalues[others].real < 0).all())


def equilibria_near(
    system: System, parameter: str, width: float, u: FloatArray, value: float, modes: Sequence[int] | None = None
) -> Iterator[Rest]:
    """Equilibria and sets of them at a value of the parameter, the nearest to a state first."""
    values = system.parameter_vector()
    values[list(system.values).index(parameter)] = value
    found = equilibrium_sets(system, u, values=values, modes=modes)
    watched = modes_of_sets(system)
    for one in sorted(found, key=lambda one: one.distance(u)):
        curve, begun = Equilibria(system, one.modes[0], parameter, width), one.point
        if one.free:
            curve = several = SetOfEquilibria(system, parameter, width, one, value)
            begun = several.u
        if watched:
            curve.watched = tuple({*watched, *one.modes})
        rest = curve.at_parameter(np.append(begun[curve.own], value) / curve.scale, value)
        if rest is not None:
            yield rest


def goes_on(rest: Rest, other: Rest, size: FloatArray) -> bool:
    """Return whether of two sets beside each other one is part of the other."""
    return _within(rest, other, size) or _within(other, rest, size)


def _within(a: Any, b: Any, size: FloatArray) -> bool:
    """Return whether the extent of a set is part of that of another."""
    return bool((a.lower >= b.lower - size).all() and (a.upper <= b.upper + size).all())
