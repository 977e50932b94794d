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

__all__ = ["FREE", "Equilibria", "Rest", "equilibria_near", "goes_on"]

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
        self, point: Point, u: FloatArray, jacobian: FloatArray, margins: FloatArray, lower: FloatArray,
        upper: FloatArray,
    ) -> Rest:  # fmt: skip
        eigenvalues = sorted_eigenvalues(jacobian)
        return Rest(**vars(point), u=u, jacobian=jacobian, eigenvalues=eigenvalues, margins=margins, lower=lower,
                    upper=upper)  # fmt: skip

    def stable(self, rest: Rest) -> bool:
        """Return whether all eigenvalues have negative real parts."""
        return bool((rest.eigenvalues.real < 0).all())

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
        return any(
            _within(rest.lower, rest.upper, one.lower, one.upper, size)
            and _within(one.lower, one.upper, rest.lower, rest.upper, size)
            for one in found
        )

    def at(self, u: FloatArray, value: float) -> Rest | None:
        """The equilibrium at a value of the parameter, by Newton from a state."""
        return self.at_parameter(np.append(u[self.own], value) / self.scale, value)


class _Corner:
    """An extreme point of a set: the independent equations of its mode's field and the conditions that vanish there."""

    def __init__(self, curve: Equilibria, extreme: Extreme, value: float) -> None:
        self.known = {value: extreme.u}  # by the parameter
        self.curve, self.u, self.side, self.keys = curve, extreme.u, extreme.side, [i for i, _ in extreme.keys]
        place, traced = curve.place, curve.system.traced
        same = extreme.mode == curve.mode
        self.field = curve.field if same else mode_field(traced, extreme.mode, (place,))
        self.own, self.scale = self.field.own, curve.system.scale_vector()[self.field.own]
        self.unit = np.eye(len(curve.values))[place] * STEP * curve.width
        # conditions that are met there by construction
        self.met = [any(row.indicator in self.keys for row in jump.rows) for jump in traced.transitions]
        self.signs = np.array([sign for _, sign in extreme.keys])
        self.across = np.zeros((0, 0))  # the independent equations among those of the field

    def equations(self, u: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As many equations as states, and their derivatives in scaled unknowns; what nothing bounds rests."""
        curve, keys = self.curve, self.keys
        f, J, f_p = self.field.evaluate(u, values, curve.memory)
        J = np.column_stack([J * self.scale, f_p * curve.width])
        if not len(self.across):
            left, sizes, _ = np.linalg.svd(J[:, :-1])
            self.across = left[:, : int((sizes > FREE * max(float(sizes[0]), FREE)).sum())].T
        h, h_u = self.field.indicators(u, values, curve.memory)
        # indicators are differentiated in the states only
        there = [self.field.indicators(u, values + one, curve.memory)[0] for one in (self.unit, -self.unit)]
        slopes = np.column_stack([h_u[:, self.own] * self.scale, (there[0] - there[1]) / (2.0 * STEP)])[keys]
        J, f = np.vstack([self.across @ J, slopes]), np.append(self.across @ f, h[keys])
        if (missing := len(self.own) - len(f)) > 0:
            still = np.linalg.svd(J[:, :-1])[2][-missing:]
            f = np.append(f, still @ ((u - self.u)[self.own] / self.scale))
            J = np.vstack([J, np.pad(still, ((0, 0), (0, 1)))])
        return f, J

    def solved(self, values: FloatArray) -> FloatArray | None:
        """The corner at other values of the parameters, from the nearest where it is known."""
        value = float(values[self.curve.place])
        begun = self.known[min(self.known, key=lambda one: abs(one - value))]
        u = begun.copy()
        for _ in range(self.curve.most):
            f, J = self.equations(u, values)
            step = np.linalg.lstsq(J[:, :-1], -f, rcond=None)[0]
            u[self.own] += step * self.scale
            if np.abs((u - begun)[self.own] / self.scale).max() > FARTHEST:
                return None
            if np.abs(step).max() < CLOSE:
                self.known[value] = u
                return u
        return None

    def margins(self, u: FloatArray, values: FloatArray) -> tuple[FloatArray, float]:
        """Margins of the conditions that are not met by construction; and how nearly another corner is as extreme."""
        h, h_u = self.field.indicators(u, values, self.curve.memory)
        edge = EDGE * (np.abs(h_u) @ (self.curve.system.scale_vector() + np.abs(u)))
        margins = np.where(self.met, -np.inf, self.field.margins(h, edge))
        if not self.keys:
            return margins, -np.inf
        (k, sign), J = self.side, self.equations(u, values)[1][:, :-1]
        pushes = np.linalg.lstsq(J.T, sign * np.eye(len(J))[self.own.index(k)], rcond=None)[0]
        own = (pushes * np.abs(J).max(axis=1))[len(self.across) :][: len(self.keys)] * self.signs
        return margins, -float(own.min() / max(np.abs(own).max(), FREE)) - FREE


class SetOfEquilibria(Equilibria):
    """A set of equilibria, as dry friction leaves it: one of its extreme points is followed, the others beside it."""

    def __init__(self, system: System, parameter: str, width: float, found: EquilibriumSet, value: float) -> None:
        super().__init__(system, found.modes[0], parameter, width)
        self.found = found
        first = min(found.extremes, key=lambda one: one.mode != self.mode, default=None)
        first = first or Extreme(found.point, self.mode)
        self.corners = [_Corner(self, one, value) for one in (first, *(e for e in found.extremes if e is not first))]
        self.scale = np.append(self.corners[0].scale, width)

    def evaluate(self, Y: FloatArray) -> _Field:
        """The equations of the extreme point that is followed."""
        X = Y * self.scale
        return _Field(X, *self.corners[0].equations(*self._at(X)))

    def described(self, point: Point) -> Rest | None:
        """The middle of the set with its extent; None where an extreme point is not found."""
        first, values = self._at(point.X)
        ends = [first]
        for corner in self.corners[1:]:
            if (end := corner.solved(values)) is None:
                return None
            ends.append(end)
        both = [corner.margins(u, values) for corner, u in zip(self.corners, ends, strict=True)]
        margins = np.append(np.max([one for one, _ in both], axis=0), max(other for _, other in both))
        lower = np.where(np.isinf(self.found.lower), -np.inf, np.min(ends, axis=0))
        upper = np.where(np.isinf(self.found.upper), np.inf, np.max(ends, axis=0))
        middle = np.mean(ends, axis=0)
        jacobian = self.field.evaluate(middle, values, self.memory)[1]
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
        curve = Equilibria(system, one.modes[0], parameter, width)
        if one.free:
            curve = SetOfEquilibria(system, parameter, width, one, value)
        if watched:
            curve.watched = tuple({*watched, *one.modes})
        rest = curve.at(curve.corners[0].u if isinstance(curve, SetOfEquilibria) else one.point, value)
        if rest is not None:
            yield rest


def goes_on(rest: Rest, other: Rest, size: FloatArray) -> bool:
    """Return whether of two sets beside each other one is part of the other."""
    ends = rest.lower, rest.upper, other.lower, other.upper
    return _within(*ends, size) or _within(*ends[2:], *ends[:2], size)


def _within(low: FloatArray, high: FloatArray, lower: FloatArray, upper: FloatArray, size: FloatArray) -> bool:
    return bool((low >= lower - size).all() and (high <= upper + size).all())
