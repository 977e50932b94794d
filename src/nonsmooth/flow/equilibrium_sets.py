r"""Sets of equilibria: what dry friction leaves, intervals and polytopes of states from which nothing moves.

The equilibria of a mode are the states where its field vanishes and no condition of a transition holds,

    f(u) = 0,    sign_i h_i(u) <= 0,

under a forcing at all times. Where these are linear in the states, they are a polytope, whose extent in each state is
a linear programme; elsewhere the same is asked again beside each extreme point until that stays where it is. Polytopes
of different modes that touch (sticking with an elastic stop open, with it closed) are one set.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.flow.equilibria import VANISHING
from nonsmooth.flow.mode_fields import every_mode, held_places, mode_field
from nonsmooth.flow.polytopes import TOUCHING, Extreme, Polytope, best
from nonsmooth.system.symbolic.traced import NOT_UNIQUE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from nonsmooth.system.system import System

FREE = 1e-9  # a singular value as small as this, beside the largest, leaves its direction free
MOST = 20  # linear problems, each beside the solution of the one before
TIMES = 64  # of a forcing period, at which conditions are asked
INSTANTS = np.array([0.0, 0.137, 0.262, 0.419, 0.548, 0.683, 0.811, 0.943])  # and at which a field must vanish


Bound = tuple[FloatArray, float, tuple[int, int]]  # slopes, room and key of a condition: slopes @ z <= room


class LinearCondition(NamedTuple):
    """``sign * indicator > 0`` beside a state: ``slopes @ (u - there)`` and its greatest and least value there."""

    key: tuple[int, int]  # indicator, sign
    slopes: FloatArray
    top: float
    bottom: float
    size: float  # of the terms


@dataclass(frozen=True)
class EquilibriumSet:
    """A connected set of equilibria, or a single one; its largest polytope stands first.

    ``extremes`` hold a point for the least and the greatest value of each state, where it is bounded.
    """

    polytopes: tuple[Polytope, ...]
    extremes: tuple[Extreme, ...]
    lower: FloatArray
    upper: FloatArray

    @property
    def free(self) -> int:
        """The number of directions that it leaves free: 0 for a single equilibrium."""
        return self.polytopes[0].ways.shape[1]

    @property
    def modes(self) -> tuple[int, ...]:
        """The modes that it lies in; the first is that of its largest polytope."""
        return tuple(dict.fromkeys(one.mode for one in self.polytopes))

    def name(self, modes: Sequence[str]) -> str:
        """The set in a few words."""
        return f"{'equilibria' if self.free else 'equilibrium'} in {', '.join(modes[k] for k in self.modes)}"

    @property
    def point(self) -> FloatArray:
        """The mean of the extreme points of its largest polytope; any state of it where it has none."""
        largest = self.polytopes[0]
        if not largest.extremes:
            return largest.origin * largest.scale
        return np.asarray(np.mean([one.u for one in largest.extremes], axis=0))

    def holds(self, u: FloatArray, tolerance: Any = TOUCHING) -> NDArray[np.bool_]:
        """Marks of the states (J, n) that belong to it."""
        return np.any([one.holds(u, tolerance) for one in self.polytopes], axis=0)

    def distance(self, u: FloatArray) -> float:
        """The distance of a state, in units of the scales."""
        return min(one.distance(u) for one in self.polytopes)


def equilibrium_sets(
    system: System,
    near: FloatArray,
    *,
    values: FloatArray | None = None,
    memory: FloatArray | None = None,
    modes: Sequence[int] | None = None,
) -> list[EquilibriumSet]:
    """The sets of equilibria of a system: all of them where its modes are affine, else those beside a state; none where
    it has more modes than can be looked at."""
    values = system.parameter_vector() if values is None else values
    memory = system.memory_vector() if memory is None else memory
    if system.explicit_time:
        return []
    modes, parts = every_mode(system.traced, values) if modes is None else modes, []
    traced = system.traced  # with the modes that were made for it
    for mode in modes or ():
        timed = any(jump.at is not None and jump.source == mode for jump in traced.transitions)
        if not timed and not traced.mode_names[mode].endswith(NOT_UNIQUE):
            parts += _ModeAt(system, mode, values, memory).polytopes(near)
    return _joined(parts)


def modes_of_sets(system: System) -> tuple[int, ...]:
    """The modes that leave some direction free; none where fields or indicators are not affine in the states."""
    return _modes_of_sets(system, system.traced.patterns)


@lru_cache(maxsize=16)
def _modes_of_sets(system: System, patterns: Any) -> tuple[int, ...]:
    """The same; equal systems whose modes are made when visited number them in orders of their own."""
    u, values, memory = np.zeros(len(system.states)), system.parameter_vector(), system.memory_vector()
    found = []
    for mode in every_mode(system.traced, values) or ():
        here = _ModeAt(system, mode, values, memory)
        if not here.field.affine:
            return ()
        if here.field.own and _free(here.equations(u)[0] * here.own).size:
            found.append(mode)
    return tuple(found)


def _peaks(at: FloatArray) -> FloatArray:
    """The greatest values of periodic functions given at equal steps, as trigonometric polynomials."""
    fine = np.fft.irfft(np.fft.rfft(at, axis=0), n=16 * len(at), axis=0) * 16.0
    k = fine.argmax(axis=0)
    here, before, after = (fine[(k + shift) % len(fine), np.arange(fine.shape[1])] for shift in (0, -1, 1))
    bend = before - 2.0 * here + after
    with np.errstate(all="ignore"):
        return np.where(bend < 0.0, here - (after - before) ** 2 / (8.0 * bend), here)


@dataclass(frozen=True)
class _Faces:
    """The equilibria of a mode beside a state: ``origin + ways @ z``, ``slopes @ z <= room``, scaled."""

    origin: FloatArray
    ways: FloatArray
    slopes: FloatArray
    room: FloatArray
    keys: tuple[tuple[int, int], ...]
    edge: bool

    def farthest(self, way: FloatArray) -> tuple[FloatArray, tuple[tuple[int, int], ...]] | None:
        """The vertex farthest along a direction, with its conditions: infinite where unbounded; None where empty."""
        z = best(-way @ self.ways, self.slopes, self.room)
        if z is None or not np.isfinite(z).all():
            return None if z is None else (np.full(len(self.origin), np.inf), ())
        slack = self.room - self.slopes @ z
        chosen: list[int] = []
        for i in np.flatnonzero(slack <= TOUCHING):
            if np.linalg.matrix_rank(self.slopes[np.array([*chosen, i])], tol=FREE) > len(chosen):
                chosen.append(int(i))
        z = z + np.linalg.lstsq(self.slopes[chosen], slack[chosen], rcond=None)[0]
        return self.origin + self.ways @ z, tuple(self.keys[i] for i in chosen)


class _ModeAt:
    """A mode at given parameters and memory, whose equilibria are wanted."""

    def __init__(self, system: System, mode: int, values: FloatArray, memory: FloatArray) -> None:
        self.traced, self.mode, self.at, self.period = system.traced, mode, (values, memory), system.period_at(values)
        self.field, self.scale = mode_field(system.traced, mode), system.scale_vector()
        self.own = self.scale[self.field.own]

    def equations(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Linear equations ``matrix @ step = right`` beside a state, at some times of a forcing period."""
        times = np.zeros(1) if self.period is None else self.period * INSTANTS
        f, J, _ = self.field.evaluate(u, *self.at, times)
        matrix, right = [*J], [*-f]
        held = held_places(self.traced, self.mode, self.at[0])
        if held is not None:  # a field holds what is independent: of the others too nothing moves
            rows, kept = held
            for one in kept:
                matrix += [one[:, self.field.own]] * len(times)
                right += [-one @ rows.augmented(u, t) for t in times]
        return np.vstack(matrix), np.concatenate(right)

    def conditions(self, u: FloatArray) -> list[list[LinearCondition]]:
        """The conditions of each way out, beside a state."""
        h, h_u = self.field.indicators(u, *self.at)
        size, slopes = np.abs(h_u) @ (self.scale + np.abs(u)), h_u[:, self.field.own]
        both = np.array([h, h])
        if self.period is not None:
            at = self.field.indicators(u, *self.at, np.linspace(0.0, self.period, TIMES + 1)[:-1])[0]
            both = np.array([-_peaks(-at), _peaks(at)])
        return [
            [
                LinearCondition((i, sign), sign * slopes[i], float(here.max()), float(here.min()), size[i])
                for i, sign, here in ((row.indicator, row.sign, row.sign * both[:, row.indicator]) for row in jump.rows)
            ]
            for jump in self.traced.transitions
            if jump.source == self.mode and jump.rows and jump.fires
        ]

    def polytopes(self, near: FloatArray) -> list[Polytope]:
        """The equilibria: one polytope for each choice of the conditions that do not hold."""
        scale, mode, found = self.scale, self.mode, []
        for which, faces in enumerate(self.faces(near)):
            n, d = faces.ways.shape
            extremes = [] if d else [Extreme(faces.origin * scale, mode)]
            lower, upper = faces.origin * scale, faces.origin * scale
            for k, sign in product(range(n), (-1, 1)) if d else ():
                if np.abs(faces.ways[k]).max() <= FREE:
                    continue
                here, last = faces, None
                for _ in range(MOST):
                    vertex = here.farthest(sign * np.eye(n)[k])
                    if vertex is None or not np.isfinite(vertex[0]).all() or self.field.affine:
                        break
                    if last is not None and np.abs(vertex[0] - last).max() <= VANISHING:
                        break
                    last = vertex[0]
                    again = self.faces(last * scale)
                    if which >= len(again):
                        vertex = None
                        break
                    here = again[which]
                if vertex is None:
                    break
                u, keys = vertex
                (upper if sign > 0 else lower)[k] = u[k] * scale[k] * (1.0 if np.isfinite(u[k]) else sign)
                if np.isfinite(u).all():
                    extremes.append(Extreme(u * scale, mode, (k, sign), keys))
            else:
                bounds = faces.origin, faces.ways, faces.slopes, faces.room
                found.append(Polytope(mode, scale, *bounds, lower, upper, tuple(extremes), faces.edge))
        return found

    def faces(self, u: FloatArray) -> list[_Faces]:
        """The bounds of the equilibria next to a state, found by Newton's method; empty: there are none."""
        some, own = self.field.own, self.own
        u = np.where(np.isin(np.arange(len(u)), some), u, 0.0)
        if not some:
            return []
        for _ in range(MOST):
            matrix, right = self.equations(u)
            if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
                return []
            step = np.linalg.lstsq(matrix * own, right, rcond=FREE)[0]
            u[some] += step * own
            size = float(np.abs(step).max())
            if size <= VANISHING:
                break
        if size > VANISHING or (np.abs(right) > VANISHING * (np.abs(matrix) @ (own + np.abs(u[some])))).any():
            return []
        free = _free(matrix * own)
        ways = np.zeros((len(u), free.shape[1]))
        ways[some] = free
        choices: list[list[Bound]] = []
        edge = False
        for conditions in self.conditions(u):
            bounds, holds = [], 0
            for one in conditions:
                slopes = (one.slopes * own) @ free
                length = float(np.linalg.norm(slopes))
                if length > FREE * float(np.abs(one.slopes * own).sum()):
                    bounds.append((slopes / length, -one.top / length, one.key))
                elif one.top <= -VANISHING * one.size:  # it never holds
                    break
                else:
                    holds += one.bottom > VANISHING * one.size  # else zero: others decide
            else:
                if bounds:
                    choices.append(_different(bounds))
                elif holds:  # it always holds: a transition leads away
                    return []
                else:
                    edge = True
        found, u = [], u / self.scale
        for chosen in product(*choices):
            rows = _different(chosen)
            slopes = np.array([row for row, _, _ in rows]).reshape(len(rows), free.shape[1])
            room = np.array([limit for _, limit, _ in rows])
            found.append(_Faces(u, ways, slopes, room, tuple(key for _, _, key in rows), edge))
        return found


def _free(matrix: FloatArray) -> FloatArray:
    """The directions (n, d) that a matrix takes to zero."""
    _, sizes, across = np.linalg.svd(matrix)
    return across[int((sizes > FREE * max(float(sizes[0]), FREE)).sum()) :].T


def _different(bounds: Sequence[Bound]) -> list[Bound]:
    """Bounds, of equal ones the first."""
    found: list[Bound] = []
    for row, limit, key in bounds:
        if all(np.abs(row - a).max() >= FREE or abs(limit - b) > FREE * max(1.0, abs(b)) for a, b, _ in found):
            found.append((row, limit, key))
    return found


def _joined(parts: list[Polytope]) -> list[EquilibriumSet]:
    """Polytopes that touch as one set each."""
    groups: list[list[Polytope]] = []
    for part in parts:
        near = [group for group in groups if any(_touch(part, other) for other in group)]
        groups = [group for group in groups if not any(group is one for one in near)]
        groups.append([*(other for group in near for other in group), part])
    return [_set_of(group) for group in groups]


def _touch(a: Polytope, b: Polytope) -> bool:
    off = TOUCHING * a.scale
    if not ((a.lower <= b.upper + off).all() and (b.lower <= a.upper + off).all()):
        return False
    for one, other in ((a, b), (b, a)):  # most share a corner
        if one.extremes and other.holds(np.array([end.u for end in one.extremes]), TOUCHING).any():
            return True
    return a.distance(b) <= TOUCHING


def _set_of(parts: list[Polytope]) -> EquilibriumSet:
    scale = parts[0].scale
    kept: list[Polytope] = []  # none within another, as slipping that has just stopped is within sticking
    for part in sorted(parts, key=lambda one: (-one.ways.shape[1], one.edge)):
        corners = np.array([one.u for one in part.extremes])
        if not (len(corners) and any(other.holds(corners, TOUCHING).all() for other in kept)):
            kept.append(part)
    lower, upper = np.min([one.lower for one in kept], axis=0), np.max([one.upper for one in kept], axis=0)
    ends = [end for one in kept for end in one.extremes]
    sides = [(k, sign) for k, sign in sorted({end.side for end in ends}) if np.isfinite((lower, upper)[sign > 0][k])]
    chosen = []
    for side in sides:
        k, sign = side
        best = min(ends, key=lambda end: (-round(sign * end.u[k] / scale[k], 9), end.side != side))
        chosen.append(replace(best, side=side))
    return EquilibriumSet(tuple(kept), tuple(chosen), lower, upper)
