"""The section map of a system at many points at once, and its inverse by Newton's method.

The map takes states at phase 0 of the forcing some periods on, by the engine that runs every simulation. Its inverse
asks nothing of the transitions: where the map takes one point to one point, a preimage found is the only one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.kept import Section

if TYPE_CHECKING:
    from nonsmooth.system.system import System

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
        images, safe = np.full_like(x, np.nan), np.flatnonzero(np.isfinite(x).all(axis=1))
        for a in range(0, len(safe), CHUNK):
            at = safe[a : a + CHUNK]
            given, out = np.ascontiguousarray(x[at] * self.size), self.engine.kept(len(at), 1)
            state = State(given[0].copy(), self.system.memory_vector())
            self.engine.chain(self.tables, 0, len(at), state, given, plan, returns - 1, 1, out)
            good = np.isin(out.status, (codes.OK, codes.NOT_GUARANTEED))
            images[at[good]] = out.section[good, 0] / self.size
        return images

    def backward(self, w: FloatArray, near: FloatArray) -> FloatArray:
        """Preimages (m, n) of w (m, n), each near its guess; those not found are tried from found neighbours."""
        found = self._newton(w, near)
        for _ in range(SWEEPS):
            missing = ~np.isfinite(found).all(axis=1)
            known, todo = np.flatnonzero(~missing), np.flatnonzero(missing)
            if not len(todo) or not len(known):
                break
            nearest = known[np.abs(todo[:, None] - known[None, :]).argmin(axis=1)]
            # One step on at either side of what is known: guesses from farther off are seldom good.
            near = np.abs(todo - nearest) <= 4
            better = self._newton(w[todo[near]], found[nearest[near]])
            if not np.isfinite(better).all(axis=1).any():
                break
            found[todo[near]] = better
        return found

    def _newton(self, w: FloatArray, guess: FloatArray) -> FloatArray:
        """Damped Newton, many points at once, with one-sided differences for the derivative; NaN where it fails."""
        x, r = guess.copy(), self.forward(guess) - w
        size = np.abs(r).max(axis=1, initial=0.0)
        found: NDArray[np.bool_] = np.zeros(len(w), dtype=bool)
        for _ in range(ITERATIONS):
            found |= size <= SOLVED * 0.01
            live = np.flatnonzero(~found & np.isfinite(size))
            if not len(live):
                break
            ahead = [self.forward(x[live] + STEP * one) for one in np.eye(w.shape[1])]
            J = (np.stack(ahead, axis=2) - (r + w)[live, :, None]) / STEP
            sound: NDArray[np.bool_] = np.asarray(np.isfinite(J).all(axis=(1, 2)))
            sound[sound] = np.abs(np.linalg.det(J[sound])) > 1e-14
            size[live[~sound]] = np.inf
            live = live[sound]
            step = -np.linalg.solve(J[sound], r[live][:, :, None])[:, :, 0]
            length = np.abs(step).max(axis=1)
            step *= np.minimum(1.0, REACH / np.maximum(length, 1e-300))[:, None]
            left = np.arange(len(live))
            for part in 0.5 ** np.arange(8):  # halved until they bring the images nearer
                at = live[left]
                trial = x[at] + part * step[left]
                there = self.forward(trial) - w[at]
                new = np.abs(there).max(axis=1, initial=0.0)
                nearer = new < size[at]
                x[at[nearer]], r[at[nearer]], size[at[nearer]] = trial[nearer], there[nearer], new[nearer]
                found[at[nearer & (length[left] <= SOLVED)]] = True  # a step of rounding's length ends a point
                left = left[~nearer]
                if not len(left):
                    break
            at = live[left]  # no nearer: found where that is as near as rounding allows
            found[at[(size[at] <= 1e-10) & (length[left] <= 1e-8)]] = True
            size[at[~found[at]]] = np.inf
        x[~found] = np.nan
        return x
