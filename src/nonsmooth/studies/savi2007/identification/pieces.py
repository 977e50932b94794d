"""Pieces of motion, each with its own free start: their residuals and derivatives, for fits by multiple shooting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.identification.pieces import State
from nonsmooth.identification.uncertainty import correlation_times

__all__ = ["Build", "Piece", "Problem", "start_state"]

#: From the parameters of a piece to the vectors ``oscillator``, ``drive``, ``contact`` of `motion.march`.
Build = Callable[[FloatArray], tuple[Any, Any, Any]]


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of a record and the parameters that act on it.

    Attributes
    ----------
    time, x, phase : array (n,)
        Samples (s, m) and the crank's mean angle (rad; zeros where nothing turns).
    which : array of int
        Indices of its parameters in the common vector; ``build`` gets them in this order.
    build : callable
    start : array (2,)
        First guess of x and v at the first sample.
    touching : bool
        Whether it begins in contact.
    label : str
        The run it comes from.
    origin : float
        Its first sample's time in that run (s): ``time`` begins at zero.
    coarse : array (n,), optional
        The crank's angle as every other turn of it tells it.
    """

    time: FloatArray
    x: FloatArray
    phase: FloatArray
    which: NDArray[np.intp]
    build: Build
    start: FloatArray
    touching: bool = False
    label: str = ""
    origin: float = 0.0
    coarse: FloatArray | None = None

    n_free = 2  # numbers of its start

    def by_instant(self, rows: FloatArray) -> FloatArray:
        """Sums of rows over the readings of each instant: there is one."""
        return rows

    def correlation(self, r: FloatArray) -> float:
        """Samples that share one independent error."""
        return correlation_times(r)


def start_state(time: FloatArray, x: FloatArray, n: int = 7) -> FloatArray:
    """Position and velocity at the first sample, from a parabola through the first few."""
    n = min(n, len(time))
    slope, order = time[:n] - time[0], min(2, n - 1)
    coefficients = np.polynomial.polynomial.polyfit(slope, x[:n], order)
    return np.array([coefficients[0], coefficients[1] if order else 0.0])


@dataclass(frozen=True, eq=False)
class Problem:
    """The pieces, sizes for the derivatives, and the length of a count (m)."""

    pieces: list[Piece]
    steps: FloatArray
    resolution: float

    def motion(self, piece: Piece, local: FloatArray, start: FloatArray) -> FloatArray:
        """x and v (n, 2) of a piece at these parameters and this start."""
        from nonsmooth.studies.savi2007.identification.motion import march

        oscillator, drive, contact = (np.asarray(part, dtype=np.float64) for part in piece.build(local))
        out = np.empty((len(piece.time), 2))
        march(piece.time, piece.phase, start[0], start[1], piece.touching, oscillator, drive, contact, out)
        return out

    def residuals(self, theta: FloatArray, starts: FloatArray) -> State:
        """Motions and residuals of all pieces, without derivatives."""
        fitted = [self.motion(p, theta[p.which], s) for p, s in zip(self.pieces, starts, strict=True)]
        return State(fitted, [p.x - f[:, 0] for p, f in zip(self.pieces, fitted, strict=True)], [], [])

    def derivatives(self, theta: FloatArray, starts: FloatArray) -> State:
        """The same with derivatives, by central differences."""
        state = self.residuals(theta, starts)
        for i, piece in enumerate(self.pieces):
            here = theta[piece.which]
            columns = []
            for k, index in enumerate(piece.which):
                moved = [here.copy(), here.copy()]
                moved[0][k] += self.steps[index]
                moved[1][k] -= self.steps[index]
                both = [self.motion(piece, m, starts[i])[:, 0] for m in moved]
                columns.append((both[0] - both[1]) / (2 * self.steps[index]))
            state.in_parameters.append(np.array(columns).T.reshape(len(piece.time), len(piece.which)))
            columns = []
            for k, step in enumerate((3e-8, 1e-7)):
                ahead, behind = starts[i].copy(), starts[i].copy()
                ahead[k] += step
                behind[k] -= step
                columns.append(
                    (self.motion(piece, here, ahead)[:, 0] - self.motion(piece, here, behind)[:, 0]) / (2 * step)
                )
            state.in_start.append(np.array(columns).T)
        return state

    def weights(self, state: State, spread: float) -> list[FloatArray]:
        """One over each reading's standard deviation; ``spread`` is that of its instant (s)."""
        variance = self.resolution**2 / 12
        return [1.0 / np.sqrt(variance + (spread * f[:, 1]) ** 2) for f in state.fitted]
