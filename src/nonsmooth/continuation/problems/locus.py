r"""Curves of special points in two parameters.

The equations of the orbit, F(X, p_1, p_2) = 0, and one more, psi = 0:

========================  ====================================================
fold                      det F_X (scaled)
flip                      det(M + I)
neimark_sacker            :math:`\prod_{i<j} (\mu_i \mu_j - 1)`
grazing                   largest local maximum of the margin that is touched;
                          where motion turns in a crossing, its value there
========================  ====================================================

psi is differentiated by differences, in the unknowns and in both parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.curve import Point
from nonsmooth.continuation.problems.multipliers import product_of_pairs, without_own
from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits, size_of
from nonsmooth.continuation.problems.path import Path
from nonsmooth.continuation.problems.shooting import Shooting, Solved
from nonsmooth.continuation.problems.solve import determinant
from nonsmooth.system.system import System

STEP = 1e-6  # of central differences, in scaled unknowns
JUMP = 100.0  # times the largest slope: more is no derivative
KEPT = 1e-3  # in scaled unknowns: so far the gradient of psi serves Newton's method
CLOSE = 2e-12
AT = 1e-4  # of the period: a maximum as near to a crossing may be that crossing
ALIKE = 1e-9  # of a gradient: what two differ by
NIL = 1e-10  # of the largest margin: a touch as near as this is one


class Touched(NamedTuple):
    """The touch of a grazing curve."""

    conditions: list[int]  # the transitions that need what is touched
    row: int  # of the transition table: what is touched
    when: float  # in periods
    turn: tuple[int, int] | None  # transition and row of the crossing in which motion turns, and the touch with it


class Locus(Orbits):
    """A curve of special points of one kind, of orbits with one signature.

    Parameters
    ----------
    shooting : Shooting
        With two active parameters.
    kind : str
        One of those above.
    size, period, widths
        Sizes of the states, the times and the two parameters.
    """

    tolerance = 1e-11  # the gradient of psi is not exact: no step is followed by one of its square

    def __init__(self, shooting: Shooting, kind: str, size: FloatArray, period: float, widths: Sequence[float]) -> None:
        super().__init__(shooting, size, period, widths)
        self.kind = kind
        self._eye = np.eye(shooting.n)
        self._unit = 1.0  # of psi
        self._gradient: tuple[FloatArray, FloatArray] | None = None  # the last one, and its place
        self._touched: Touched | None = None

    def psi(self, solved: Solved) -> float:
        """The number that vanishes on the locus."""
        if self.kind == "fold":
            n = self.shooting.size
            sign, size = determinant(solved.jacobian[:, :n] * self.rows[:, None] * self.scale[:n])
            return sign * float(np.exp(size)) / self._unit
        if self.kind == "grazing":
            turns = self._touched is not None and self._touched.turn is not None
            path = None if turns else self.walk.along(solved, self.shooting.split(solved.X)[1])
            if path is None and not turns:
                return np.nan
            visits, touched = self._touch(path, solved)
            if touched.turn is not None or path is None:
                (indicator, sign), i = self.walk.net.rows[touched.row, :2], visits[0]
                at = int(indicator), int(self.shooting.modes[i]), float(solved.times[i + 1]), solved.segments.z[i]
                return float(sign * self.shooting.flow.indicator(solved.values, *at).h) / self._unit
            margins = path.inner[np.ix_(visits, touched.conditions)]
            if len(visits) > 1:  # at the section itself no maximum shows within them
                margins = np.vstack([margins, path.section[touched.conditions]])
            largest = float(margins.max())
            if np.isneginf(largest) and (path.which[np.ix_(visits, touched.conditions)] >= 0).any():
                return 0.0  # a maximum so near to zero that it has no sign
            return largest / self._unit
        M = solved.monodromy
        if self.kind == "flip":
            return float(np.linalg.det(M + self._eye))
        return product_of_pairs(without_own(solved.multipliers, self.shooting.forced))

    def calibrate(self, Y: FloatArray) -> None:
        """Choose the unit of psi so that its gradient is of order one."""
        self._unit = 1.0
        self.psi(self.evaluate(Y))  # what is touched is seen at the point itself
        size = float(np.abs(self.gradient(Y)).max())
        self._unit = size if np.isfinite(size) and size > 0 else 1.0

    def gradient(self, Y: FloatArray) -> FloatArray:
        """d psi / dY by central differences; by that to one side where psi jumps on the other: of a motion that a
        crossing parts beside the touch there may be no maximum."""

        def psi(Y: FloatArray) -> float:
            return self.psi(self.shooting.evaluate(Y * self.scale, self.kind != "grazing"))

        here, off = psi(Y), STEP * np.eye(self.n)
        sides = np.array([[psi(Y + one) - here, here - psi(Y - one)] for one in off]) / STEP
        low, high = np.sort(np.abs(sides)).T
        nearer = np.where(np.abs(sides[:, 0]) == low, *sides.T)
        return np.where(high <= JUMP * low.max(), sides.mean(axis=1), nearer)

    def fill(self, solved: Solved, matrix: FloatArray) -> None:
        """Put the Jacobian and the gradient of psi into ``matrix``; one that was taken near by serves."""
        super().fill(solved, matrix)
        Y = solved.X / self.scale
        if self._gradient is None or not np.abs(Y - self._gradient[1]).max() < KEPT:
            self._gradient = self.gradient(Y), Y
        matrix[-1] = self._gradient[0]

    def residual(self, solved: Solved) -> FloatArray:
        """The scaled residual, and psi."""
        return np.append(super().residual(solved), self.psi(solved))

    def point(self, solved: Solved, Y: FloatArray, border: FloatArray, iterations: int = 0) -> OrbitPoint | None:
        """A solved point, its tangent by a gradient of its own."""
        self._gradient = None
        return super().point(solved, Y, border, iterations)

    def nearest(self, Y: FloatArray, value: float) -> OrbitPoint | None:
        """The locus at a special point: the shortest correction, and a tangent of either sense."""
        self.calibrate(Y)
        found = self.correct(Y, np.zeros(self.n), 0.0, tolerance=CLOSE, most=3 * self.most, singular=True)
        if found is None:
            return None
        null = self.null_vectors(found[0], 1e-9)
        return self.point(found[0], found[1], null[-1]) if len(null) == 1 else None

    @classmethod
    def through(
        cls, system: System, kind: str, at: Any, period_number: int, names: tuple[str, str], widths: Sequence[float]
    ) -> OrbitPoint | None:
        """The point at a special point as it is kept, on its curve in two parameters."""
        shooting = Shooting(system, at.signature, period_number, names)
        size = size_of(at.maximum, at.minimum, system)
        X = np.append(at.X[: shooting.size], [system.values[name] for name in names])
        shooting.prepare(X, size)
        locus = cls(shooting, kind, size, at.period, widths)
        return locus.nearest(X / locus.scale, at.value)

    def _like(self, shooting: Shooting, size: FloatArray) -> Locus:
        """The locus of orbits that are read from another section."""
        locus = Locus(shooting, self.kind, size, self.period, self.widths)
        locus._touched = self._touched
        return locus

    def described(self, point: Point) -> OrbitPoint | None:
        """The orbit; on a grazing curve its touch is expected here from now on."""
        found = super().described(point)
        if found is not None and self.kind == "grazing":
            self._touched = self._touch(found.path, found.solved)[1]
        return found

    def _touch(self, path: Path | None, solved: Solved) -> tuple[list[int], Touched]:
        """The visits in which the touch of a grazing curve lies, two where the section parts one, with it: of all that
        need what is touched the maximum nearest in time to where it was, or the crossing in which motion turns."""
        touched, period, last = self._touched, solved.times[-1], self.shooting.m
        if touched is None:
            self._touched = touched = self._first_touch(path, solved)
        if touched.turn is not None or path is None:
            same = [i for i, v in enumerate(self.shooting.signature.visits) if (v.transition, v.row) == touched.turn]
            whens = solved.times[1:][same] / period
            at = int(np.abs((whens - touched.when + 0.5) % 1.0 - 0.5).argmin())
            return [same[at]], touched._replace(when=float(whens[at]))
        place = path.place[:, touched.conditions] / period
        nowhere = path.which[:, touched.conditions] < 0
        apart = np.where(nowhere, np.inf, np.abs((place - touched.when + 0.5) % 1.0 - 0.5))
        visit, k = divmod(int(apart.argmin()), len(touched.conditions))
        both = self.shooting.forced and 0 < last and visit in (0, last)
        return [0, last] if both else [visit], touched._replace(when=float(place[visit, k]))

    def _first_touch(self, path: Any, solved: Solved) -> Touched:
        """The nearest touch of a path. Motion turns in a crossing beside it whose indicator is the rate of what is
        touched: no maximum lies within a visit there."""
        net, visits, flow = self.walk.net, self.shooting.signature.visits, self.shooting.flow
        (visit, _), row = path.touched, int(path.which[path.touched])
        needed = (net.rows[:, :2] == net.rows[row, :2]).all(axis=1)
        conditions = [k for k, (a, b) in enumerate(pairwise(net.row_start)) if needed[a:b].any()]
        when, turn = float(path.place[path.touched]), None
        for i in {visit - 1, visit} & {*self.walk.conditional.tolist()}:
            v, t, z = visits[i], float(solved.times[i + 1]), solved.segments.z[i]
            if abs(t - when) < AT * solved.times[-1]:
                rate = flow.indicator(solved.values, int(net.rows[row, 0]), v.mode, t, z)
                fired = flow.jump(solved.values, v.transition, t, z, v.row)
                a, b = np.append(rate.L_z, rate.L_t), np.append(fired.h_z, fired.h_t)
                if np.abs(a * (b @ b) - b * (a @ b)).max() <= ALIKE * np.abs(a).max() * (b @ b):
                    turn = v.transition, v.row
        return Touched(conditions, row, when / float(solved.times[-1]), turn)

    def renewed(self, point: OrbitPoint) -> OrbitPoint | None:
        """The phase condition put through the last point; the units stay, psi was calibrated in them."""
        return None if self.shooting.reference is None else super().renewed(point)

    def word(self) -> Any:
        """The kind."""
        return self.kind

    def margins(self, point: OrbitPoint) -> FloatArray:
        """Margins of the path to its boundaries; on a grazing curve by touches of other surfaces than its own."""
        path = point.path
        if self.kind == "grazing":
            visits, (conditions, _, _, turn) = self._touch(path, point.solved)
            inner = path.inner.copy()
            inner[np.ix_(visits, conditions)] = -np.inf
            # Touches that come with it, half a period on where motion is symmetric, are as nil as its own.
            inner[np.abs(inner) <= NIL * np.abs(inner).max(initial=0.0, where=np.isfinite(inner))] = -np.inf
            if turn is not None:  # reached as the visit ends, and as the next one begins
                i, others, landed = visits[0], path.others.copy(), path.landed.copy()
                inner[i + 1, conditions] = -np.inf
                others[i] = -np.inf if path.other[i] in conditions else others[i]
                landed[i + 1] = -np.inf if path.landing[i + 1] in conditions else landed[i + 1]
                path = replace(path, others=others, landed=landed)
            path = replace(path, touch=float(inner.max(initial=-np.inf)))
        return path.margins
