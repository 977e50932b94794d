r"""Pseudo-arclength continuation of the motions on which the control force vanishes.

Unknowns are the parameter :math:`\lambda` of the drive and all harmonics of the reference; the equations say that the
motion is its own reference, :math:`c_h = x_h`: the controller has nothing to do. The derivatives of the mismatch
:math:`c_h - x_h` by :math:`\lambda` and :math:`c_1` are measured once, by three displaced references. For the other
harmonics, which a damped controller moves little, the first guess is that the motion does not follow its reference, so
that the first correction is the fixed-point iteration of Sieber and Krauskopf. Every further measurement corrects the
derivatives by Broyden's update.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, field

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.control.holding import Held, Holder
from nonsmooth.errors import SolveError

PROBE = 0.02  # displacement of a reference for a derivative, over the size of the motion
LONGEST = 0.1  # correction of the first point in one go
SEEN = 1e-3  # the least displacement that says something about derivatives, over the size of the motion
NOISE = 1.5  # of the effort over that of noise alone, at convergence


@dataclass(frozen=True)
class MeasuredPoint:
    """A converged point: the unknowns (scaled), what was measured, and how it came about."""

    y: FloatArray  # parameter, c_0, real parts of c_1 ... c_H, imaginary parts
    mismatch: FloatArray
    held: Held
    measurements: int
    first_effort: float
    J: FloatArray  # (n, n + 1)


@dataclass
class Continuation:
    """A continuation: the scales of its unknowns, and the derivatives as they are known."""

    holder: Holder
    setting: Callable[[float], tuple[float, float]]  # parameter to frequency and amplitude
    of: Callable[[Held], float]  # the parameter that was really set
    scale: float  # of the parameter
    size: float  # of the motion
    tolerance: float
    most: int = 8  # measurements for one point
    J: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        n = 2 * self.holder.harmonics + 1
        self.J = np.hstack([np.zeros((n, 1)), np.eye(n)])
        first = [0, 2, 2 + self.holder.harmonics]
        self.plane = np.zeros((3, n + 1))  # of the parameter and the first harmonic
        self.plane[range(3), first] = 1.0

    def measure(self, y: FloatArray) -> tuple[FloatArray, FloatArray, Held]:
        """The place really measured at, the mismatch there, and the motion."""
        held = self.holder.hold(*self.setting(y[0] * self.scale), self._series(y))
        place = y.copy()
        place[0] = self.of(held) / self.scale
        return place, y[1:] - self.unknowns(held.position.c), held

    def converged(self, held: Held) -> bool:
        """Return whether the motion repeats and the control force has fallen to its noise, or below the tolerance."""
        least = self.tolerance * self.holder.stiffness(held.frequency) * self.size
        return held.repeats and held.effort <= max(NOISE * held.effort_noise, least)

    def start(self, free: Held) -> MeasuredPoint:
        """The first point, at a stable motion that was measured without control; measures the derivatives."""
        y = np.concatenate([[self.of(free) / self.scale], self.unknowns(free.position.c)])
        y, here, held = self.measure(y)
        if not held.repeats:
            raise SolveError(
                "the first motion repeats with each turn of the drive, and no longer does when it is held to itself: "
                "the controller shakes it; lower its gains, or read more often",
                status="not_periodic",
            )
        first = held.effort
        self._probe(y, here, PROBE)
        found = self._correct(y, self.plane[0], y, LONGEST, (y, here))
        return found or MeasuredPoint(y, here, held, 1, first, self.J.copy())

    def points(
        self, first: MeasuredPoint, step: float, inside: Callable[[float], bool], rising: bool
    ) -> Generator[MeasuredPoint, None, str]:
        """Points along the branch, until the parameter leaves its range or no step is small enough; returns which."""
        last = first
        tangent = self._tangent(1.0 if rising else -1.0)
        length = 0.5 * step
        while length > step / 20:
            target = last.y + length * tangent
            if not inside(target[0] * self.scale):
                return "range"
            found = self._next(last, target, tangent, length)
            if found is None:
                length *= 0.5
                self.measure(last.y)  # back to what was held
                continue
            yield found
            secant = found.y - last.y
            tangent = secant / np.linalg.norm(self.plane @ secant)
            last = found
            length = min(step, length * (1.5 if found.measurements <= 4 else 0.8))
        return "lost"

    def _next(
        self, last: MeasuredPoint, target: FloatArray, tangent: FloatArray, length: float
    ) -> MeasuredPoint | None:
        """The point on a plane through the target: first across the branch, then, past a corner, across the motion."""
        across = self.plane @ tangent
        found = self._correct(target, across @ self.plane, target, length, (last.y, last.mismatch))
        if found is not None:
            return found
        # At a corner, as where a contact begins, the branch may turn back in the parameter at once. The motion goes on.
        self.measure(last.y)
        place, here, _ = self.measure(target)
        self._probe(place, here, min(PROBE, 0.25 * length))
        across[0] = 0.0
        return self._correct(target, across @ self.plane, target, length, (place, here))

    def _probe(self, y: FloatArray, here: FloatArray, far: float) -> None:
        """Measure the derivatives by the parameter and the first harmonic at a place whose mismatch is known."""
        for row in self.plane:
            place, there, _ = self.measure(y + far * row)
            self.J[:, int(np.argmax(row))] = (there - here) / ((place - y) @ row)

    def _tangent(self, sign: float) -> FloatArray:
        """Direction of the branch, from the derivatives."""
        tangent = np.concatenate([[sign], np.linalg.solve(self.J[:, 1:], -sign * self.J[:, 0])])
        return np.asarray(tangent / np.linalg.norm(self.plane @ tangent))

    def _correct(
        self,
        y: FloatArray,
        across: FloatArray,
        target: FloatArray,
        longest: float,
        before: tuple[FloatArray, FloatArray],
    ) -> MeasuredPoint | None:
        """Measure and correct, on the plane through ``target`` across a direction, until the control force vanishes.

        No correction is longer than ``longest``; ``before`` is another place with its mismatch.
        """
        first = float("nan")
        for k in range(self.most):
            y, mismatch, held = self.measure(y)
            first = first if k else held.effort
            moved, change = y - before[0], mismatch - before[1]
            if (size := float(moved @ moved)) > SEEN**2:
                self.J += np.outer(change - self.J @ moved, moved) / size
            before = (y, mismatch)
            if self.converged(held):
                return MeasuredPoint(y, mismatch, held, k + 1, first, self.J.copy())
            system = np.vstack([self.J, across])
            move = np.linalg.lstsq(system, np.append(-mismatch, across @ (target - y)), rcond=None)[0]
            y = y + move * min(1.0, longest / max(float(np.linalg.norm(self.plane @ move)), 1e-300))
        return None

    def unknowns(self, c: ComplexArray) -> FloatArray:
        """A series as part of the unknowns."""
        return np.concatenate([c.real, c[1:].imag]) / self.size

    def _series(self, y: FloatArray) -> ComplexArray:
        c = y[1 : self.holder.harmonics + 2].astype(complex)
        c[1:] += 1j * y[self.holder.harmonics + 2 :]
        return np.asarray(self.size * c)
