"""The section map of a system at many points at once, and its inverse by Newton's method.

The map takes states at phase 0 of the forcing some periods on, by the engine that runs every simulation. Its inverse
asks nothing of the transitions: where the map takes one point to one point, a preimage found is the only one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.flow.engines.engine import Section, State
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.kernels.hybrid import codes

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["SectionMap"]

RTOL = 1e-12  # where the flow is not exact
CHUNK = 128
STEP = 1e-7  # of the differences, in scaled states
REACH = 0.5  # the longest Newton step, in scaled states
SOLVED = 1e-11
ITERATIONS, SWEEPS = 25, 60


class SectionMap:
    """``periods`` forcing periods of ``system``, in states divided by ``size``; NaN where the motion fails.

    Parameters
    ----------
    system : System
    size : array (n,)
        What a scaled state of 1 is.
    periods : int
    """

    def __init__(self, system: System, size: FloatArray, periods: int) -> None:
        self.system, self.size, self.periods = system, size, periods
        self.engine = engine_for(system, rtol=RTOL)
        self.tables = self.engine.prepare(np.tile(system.parameter_vector(), (CHUNK, 1)))
        self.plan = Section(extremes=False)

    def at_phase(self, x: FloatArray, phase: float) -> FloatArray:
        """The scaled points x (m, n) of phase 0 at a later phase of the same period."""
        return x if phase == 0.0 else self._images(x, Section(phase=phase, extremes=False), 1)

    def forward(self, x: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Images (m, n) of the scaled points x (m, n)."""
        del near
        return self._images(x, self.plan, self.periods)

    def _images(self, x: FloatArray, plan: Section, returns: int) -> FloatArray:
        images = np.full_like(x, np.nan)
        starts = np.ascontiguousarray(x * self.size)
        for a in range(0, len(x), CHUNK):
            part = starts[a : a + CHUNK]
            safe = np.isfinite(part).all(axis=1)
            if not safe.any():
                continue
            given = np.ascontiguousarray(part[safe])
            out = self.engine.kept(len(given), 1)
            state = State(given[0].copy(), self.system.memory_vector())
            self.engine.chain(self.tables, 0, len(given), state, given, plan, returns - 1, 1, out)
            good = np.isin(out.status, (codes.OK, codes.NOT_GUARANTEED))
            images[a + np.flatnonzero(safe)[good]] = out.section[good, 0] / self.size
        return images

    def backward(self, w: FloatArray, near: FloatArray) -> FloatArray:
        """Preimages (m, n) of w (m, n), each near its guess; those not found are tried from found neighbours."""
        found = self._newton(w, near)
        for _ in range(SWEEPS):
            known = np.flatnonzero(np.isfinite(found).all(axis=1))
            todo = np.flatnonzero(~np.isfinite(found).all(axis=1))
            if not len(todo) or not len(known):
                break
            nearest = known[np.abs(todo[:, None] - known[None, :]).argmin(axis=1)]
            # One step on at either side of what is known: guesses from farther off are seldom good.
            close = todo[np.abs(todo - nearest) <= 4]
            if not len(close):
                break
            better = self._newton(w[close], found[nearest[np.isin(todo, close)]])
            if not np.isfinite(better).all(axis=1).any():
                break
            found[close] = better
        return found

    def _newton(self, w: FloatArray, guess: FloatArray) -> FloatArray:
        """Damped Newton, many points at once, with one-sided differences for the derivative."""
        m, n = w.shape
        x, done = guess.copy(), np.zeros(m, dtype=bool)
        r = self.forward(x) - w
        size = np.asarray(np.abs(r).max(axis=1, initial=0.0), dtype=np.float64)
        for _ in range(ITERATIONS):
            done |= size <= SOLVED * 0.01
            live = np.flatnonzero(~done & np.isfinite(size))
            if not len(live):
                break
            J = np.empty((len(live), n, n))
            for j in range(n):
                moved = x[live].copy()
                moved[:, j] += STEP
                J[:, :, j] = (self.forward(moved) - (r[live] + w[live])) / STEP
            sound = np.asarray(np.isfinite(J).all(axis=(1, 2)), dtype=bool)
            sound[sound] = np.abs(np.linalg.det(J[sound])) > 1e-14
            size[live[~sound]] = np.inf
            live, J = live[sound], J[sound]
            if not len(live):
                break
            step = np.asarray(-np.linalg.solve(J, r[live][:, :, None])[:, :, 0], dtype=np.float64)
            length = np.asarray(np.abs(step).max(axis=1), dtype=np.float64)
            step *= np.minimum(1.0, REACH / np.maximum(length, 1e-300))[:, None]
            self._advance(live, x, r, size, done, step, length, w)
        x[~done] = np.nan
        return x

    def _advance(
        self, live: NDArray[np.int64], x: FloatArray, r: FloatArray, size: FloatArray, done: NDArray[np.bool_],
        step: FloatArray, length: FloatArray, w: FloatArray,
    ) -> None:  # fmt: skip
        """Take the steps, halved until they bring the images nearer; a step of rounding's length ends a point."""
        part, waiting = 1.0, np.ones(len(live), dtype=bool)
        for _ in range(8):
            some = live[waiting]
            trial = x[some] + part * step[waiting]
            there = self.forward(trial) - w[some]
            new = np.abs(there).max(axis=1)
            nearer = new < size[some]
            x[some[nearer]], r[some[nearer]], size[some[nearer]] = trial[nearer], there[nearer], new[nearer]
            done[some[nearer & (length[waiting] <= SOLVED)]] = True
            places = np.flatnonzero(waiting)
            waiting[places[nearer]] = False
            if not waiting.any():
                return
            part *= 0.5
        stuck = live[waiting]
        # No nearer, and already as near as rounding allows: found.
        done[stuck[(size[stuck] <= 1e-10) & (length[waiting] <= 1e-8)]] = True
        size[stuck[~done[stuck]]] = np.inf
