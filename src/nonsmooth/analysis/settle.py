"""Bring a trajectory to its attractor at one parameter value, and say what was reached.

The state is run through the transient, its section points are judged (``classify``), and a point that is still
settling is run on, or pushed off an unstable orbit on which a carried state may sit for ever.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.analysis.classify import TOLERANCE, Verdict, judge
from nonsmooth.analysis.settled import LEAST, least_sizes, size_of
from nonsmooth.flow.engine import Chain, Engine, FloatArray, SectionPlan, State
from nonsmooth.flow.methods import RTOL
from nonsmooth.flow.poincare import result_status
from nonsmooth.kernels import codes

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["Attractors", "tolerance_of", "warn_if_small"]

RESTING = 5e-7  # in units of the scales: smaller values of a state are rounding beside the others
NOTHING = 1e-15  # and beside none
LONGER = (1, 2, 4)  # further transients for a point that is still settling, in units of the first
KICK = 1e-3  # what pushes a state off an unstable orbit, in units of the motion's size
NUDGE = 1e-6  # finite differences of the return map, in units of the motion's size
ROUNDS = 8  # of a cycle, over which the contraction on a Poincare section is measured
FAILED = (codes.DIVERGED, codes.CHATTER, codes.TOO_MANY_CROSSINGS, codes.NO_CONVERGENCE, codes.BEYOND_STOP)


def warn_if_small(system: System, *sizes: FloatArray) -> None:
    """Warn of states that never leave the size below which a motion counts as rest.

    Parameters
    ----------
    *sizes : array (..., n)
        Values of the states: starts, extremes.
    """
    scale = system.scale_vector()
    largest = np.max([np.nanmax(np.abs(one).reshape(-1, len(scale)), axis=0, initial=0.0) for one in sizes], axis=0)
    small = np.flatnonzero((largest > RESTING * scale) & (largest < LEAST * scale))
    if not small.size and (largest < LEAST * scale).all():  # nothing moves much: not at rest beside a motion
        small = np.flatnonzero(largest > NOTHING * scale)
    if small.size:
        names = list(system.states)
        told = ", ".join(f"{names[j]!r}: {largest[j]:.2g}" for j in small)
        warnings.warn(
            f"{system.name!r}: these states stay below {LEAST:g} of their scale, where a motion counts as rest, so "
            f"attractors may not be told apart or found; give System(scale={{{told}}})",
            stacklevel=3,
        )


@dataclass(frozen=True)
class Attractors:
    """An engine with its tables for all points, the section, and how long to wait."""

    engine: Engine
    tables: Any
    plan: SectionPlan
    transient: int
    keep: int
    max_period: int
    tolerance: float
    scale: FloatArray
    longer: tuple[int, ...] = LONGER

    def over(self, tables: Any) -> Attractors:
        """The same over other tables of the engine."""
        return replace(self, tables=tables)

    def settle(self, i: int, state: State, out: Chain, fresh: Callable[[], State]) -> Verdict:
        """Run point i on from ``state`` (left where the run ends) and judge it; ``fresh`` makes a start."""
        state.settled = False  # a parameter has changed under it: what holds already is taken first
        self._chain(i, state, self.transient, self.keep, out)
        if out.status[i] == codes.BEYOND_STOP:  # a carried state that a moved stop has overtaken
            other = fresh()
            _replace(state, other)
            self._chain(i, state, self.transient, self.keep, out)
        if out.status[i] in FAILED:
            return Verdict(0, np.nan, result_status(out.status[i]))
        verdict = self._judge(i, state, out)
        for factor in self.longer:
            if verdict.status != codes.SLOW:
                break
            if verdict.unstable:
                kicked = state.copy()
                # where Runge-Kutta errors set the least size, a kick by that size would be a new motion
                kicked.u += KICK * size_of(out.maximum[i], out.minimum[i], LEAST * self.scale)
                kicked.settled = False
                _replace(state, kicked)
            self._chain(i, state, factor * max(self.transient, 1), self.keep, out)
            if out.status[i] in FAILED:
                return Verdict(0, np.nan, result_status(out.status[i]))
            verdict = self._judge(i, state, out)
        if out.status[i] == codes.NOT_GUARANTEED and verdict.status == codes.OK:
            return replace(verdict, status=codes.NOT_GUARANTEED)
        return verdict

    def look(self, i: int, state: State, transient: int, out: Chain) -> Verdict | None:
        """Judge point i after ``transient`` returns more, once; None where the run failed."""
        state.settled = False
        self._chain(i, state, transient, self.keep, out)
        return None if out.status[i] in FAILED else self._judge(i, state, out)

    def _chain(self, i: int, state: State, transient: int, keep: int, out: Chain) -> None:
        self.engine.chain(self.tables, i, i + 1, state, None, self.plan, transient, keep, out)

    def _probe(self, i: int, state: State, transient: int, keep: int, out: Chain) -> None:
        plan = replace(self.plan, extremes=False, every=1)
        self.engine.chain(self.tables, i, i + 1, state, None, plan, transient, keep, out)

    def _size(self, i: int, out: Chain) -> FloatArray:
        """Half the range of each state, and no less than a part of its scale: a motion that dies out comes to rest."""
        return size_of(out.maximum[i], out.minimum[i], *least_sizes(self.engine.name, self.scale))

    def _judge(self, i: int, state: State, out: Chain) -> Verdict:
        size = self._size(i, out)
        measure = self._multiplier if self.plan.indicator < 0 else self._contraction
        return judge(
            out.section[i], size, self.max_period, lambda p: measure(i, p, state, size, out), self.tolerance
        )

    def _multiplier(self, i: int, p: int, state: State, size: FloatArray, out: Chain) -> float:
        """Largest |multiplier| of the p-th return map of a stroboscopic section, by differences at the last point."""
        n = len(size)
        # at rest a Runge-Kutta pair errs by atol: a nudge must stand well above that for its growth to mean something
        clear = min(1e3 * self.tolerance, 1e-4) if self.engine.name == "rkf45" else NUDGE
        nudge = max(NUDGE, 1e2 * self.tolerance, clear) * size
        probe = _rows_of(out, i, 1)
        images = []
        for j in range(-1, n):
            moved = state.copy()
            if j >= 0:
                moved.u[j] += nudge[j]
                moved.settled = False
            self._probe(i, moved, p - 1, 1, probe)
            if probe.status[i] in FAILED:
                return np.nan
            images.append(probe.section[i, 0].copy())
        matrix = np.array([(images[j + 1] - images[0]) / nudge[j] for j in range(n)]).T
        scaled = matrix * size[None, :] / size[:, None]
        return float(np.abs(np.linalg.eigvals(scaled)).max())

    def _contraction(self, i: int, p: int, state: State, size: FloatArray, out: Chain) -> float:
        """The factor by which a nudged state nears the cycle on a Poincare section per p returns.

        A nudge moves the state off the surface, which may shift the count of returns by one; so the distance to the
        whole cycle is measured, at all of its returns, over several rounds."""
        cycle = out.section[i, -p:] / size
        if self.plan.every > 1:
            p *= self.plan.every
            own = _rows_of(out, i, p)
            self._probe(i, state.copy(), 0, p, own)
            cycle = own.section[i] / size
        keep = ROUNDS * p + 2
        moved = state.copy()
        moved.u += max(NUDGE, 1e2 * self.tolerance) * size
        moved.settled = False
        probe = _rows_of(out, i, keep)
        self._probe(i, moved, 0, keep, probe)
        if probe.status[i] in FAILED:
            return np.nan
        points = probe.section[i] / size
        gap = np.abs(points[:, None, :] - cycle[None, :, :]).max(axis=2).min(axis=1)
        first, last = gap[1 : p + 1].max(), gap[-p:].max()
        if last <= self.tolerance:
            return 0.5
        return float((last / first) ** (1.0 / (ROUNDS - 1)))


def tolerance_of(engine: Engine, rtol: float | None) -> float:
    """What counts as a return, in units of the motion's size: no less than the engine's own tolerance shows."""
    return TOLERANCE if engine.name == "exact" else max(TOLERANCE, 10.0 * (RTOL if rtol is None else rtol))


def _rows_of(out: Chain, i: int, keep: int) -> Chain:
    """Buffers in which row i can be written."""
    n, n_indicators, n_outputs = out.maximum.shape[1], out.indicator_max.shape[1], out.output_max.shape[1]
    return Chain.empty(i + 1, keep, n, n_indicators, n_outputs)


def _replace(state: State, other: State) -> None:
    """Make ``state`` a copy of ``other``, in place."""
    state.u[:], state.memory[:], state.clock[:], state.counters[:] = other.u, other.memory, other.clock, other.counters
    state.settled = other.settled
