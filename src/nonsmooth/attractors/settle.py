"""Bring a trajectory to its attractor at one parameter value, and say what was reached.

The state is run through the transient and its section points are judged (``kernels.judge``); a point that is still
settling is run on, or perturbed on an unstable orbit on which a carried state may sit for ever (``kernels.settle``).
Here this is done with any engine, one point after the other.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.attractors.settled import LEAST, ROUNDED, least_sizes
from nonsmooth.flow.arguments import whole_number
from nonsmooth.flow.engines.engine import Chain, Engine, FloatArray, SectionPlan, State
from nonsmooth.flow.engines.methods import RTOL
from nonsmooth.flow.poincare import result_status
from nonsmooth.kernels.hybrid import codes

if TYPE_CHECKING:
    from nonsmooth.kernels.judging.settle import Rules
    from nonsmooth.system.system import System

__all__ = ["ATTEMPTS", "Attractors", "Verdict", "longest_period", "rules_of", "tolerance_of", "warn_if_small"]

RESTING = 5e-7  # in units of the scales: smaller values of a state are rounding beside the others
NOTHING = 1e-15  # and beside none
LONGEST = 16  # period number looked for where none is given and as many points are kept
TOLERANCE = 1e-9  # of a return, in units of the motion's size
DIFFERENCE = 1e-6  # finite differences of the return map, in units of the motion's size
ATTEMPTS = 3  # further transients for a point that is still settling: of 1, 2 and 4 times the first
GOOD = (codes.OK, codes.NOT_GUARANTEED)


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
class Verdict:
    """Period number (0: none), the scaled return it rests on, the largest modulus of its multipliers, and the status.

    ``multiplier`` is NaN where it was not looked at, or is unknown; ``returns`` counts the section returns run."""

    period_number: int
    residual: float
    multiplier: float
    status: int
    returns: int


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
    first_look: int = 0  # returns after which a point is judged for the first time; 0: when the transient has ended
    attempts: int = ATTEMPTS

    def over(self, tables: Any) -> Attractors:
        """The same over other tables of the engine."""
        return replace(self, tables=tables)

    @cached_property
    def rules(self) -> Rules:
        return rules_of(
            self.engine.name, self.transient, self.keep, self.max_period, self.tolerance, self.scale,
            self.first_look, self.attempts,
        )  # fmt: skip

    def settle(self, i: int, state: State, out: Chain, fresh: Callable[[], State]) -> Verdict:
        """Run point i on from ``state`` (left where the run ends) and judge it; ``fresh`` makes a start."""
        from nonsmooth.kernels.judging.settle import END, FRESH, PROBE, begin_job, new_jobs, next_run

        jobs, rules = new_jobs(1, len(self.scale), self.max_period), self.rules
        begin_job(jobs, 0, rules, 1)
        measure = self._multiplier if self.plan.indicator < 0 else self._contraction
        while jobs.wanted[0] != END:
            mu = np.nan
            if jobs.wanted[0] == PROBE:
                mu = measure(i, int(jobs.period_number[0]), state, jobs.size[0], out)
            else:
                if jobs.wanted[0] == FRESH:
                    _replace(state, fresh())
                state.settled = bool(jobs.settled[0])
                self._run(i, state, self.plan, int(jobs.transient[0]), self.keep, out)
            code = int(out.status[i])
            next_run(jobs, 0, rules, code, out.section[i], out.maximum[i], out.minimum[i], mu, state.u)
        return Verdict(
            int(jobs.period_number[0]), float(jobs.residual[0]), float(jobs.multiplier[0]),
            result_status(int(jobs.status[0])), int(jobs.spent[0]),
        )  # fmt: skip

    def pass_by(self, i: int, state: State, out: Chain) -> Verdict:
        """Run point i on from ``state`` through one transient and the kept returns, without judging them."""
        self._run(i, state, self.plan, self.transient, self.keep, out)
        return Verdict(0, np.nan, np.nan, result_status(int(out.status[i])), self.transient + self.keep)

    def _run(self, i: int, state: State, plan: SectionPlan, transient: int, keep: int, out: Chain) -> None:
        self.engine.chain(self.tables, i, i + 1, state, None, plan, transient, keep, out)

    def _beside(self, i: int, state: State, offset: FloatArray, transient: int, keep: int, out: Chain) -> Chain | None:
        """Traces in row i of a run that begins beside a state; None where it failed."""
        moved, plan = state.copy(), replace(self.plan, extremes=False, every=1)
        moved.u += offset
        moved.settled = moved.settled and not offset.any()
        n, n_indicators, n_outputs = out.maximum.shape[1], out.indicator_max.shape[1], out.output_max.shape[1]
        probe = Chain.empty(i + 1, keep, n, n_indicators, n_outputs)
        self._run(i, moved, plan, transient, keep, probe)
        return probe if probe.status[i] in GOOD else None

    def _multiplier(self, i: int, p: int, state: State, size: FloatArray, out: Chain) -> float:
        """Largest |multiplier| of the p-th return map of a stroboscopic section, by differences at the last point."""
        from nonsmooth.kernels.judging.judge import multiplier

        n, difference = len(size), self.rules.difference
        images = np.zeros((n + 1, n))
        for j in range(n + 1):
            probe = self._beside(i, state, difference * size * (np.arange(n) == j - 1), p - 1, 1, out)
            if probe is None:
                return np.nan
            images[j] = probe.section[i, 0]
        return float(multiplier(images, size, difference, np.zeros((2, n, n))))

    def _contraction(self, i: int, p: int, state: State, size: FloatArray, out: Chain) -> float:
        """The factor by which a perturbed state nears the cycle on a Poincare section per p returns."""
        from nonsmooth.kernels.judging.judge import ROUNDS, contraction

        cycle, p = out, p * self.plan.every
        if self.plan.every > 1:
            own = self._beside(i, state, np.zeros(len(size)), 0, p, out)
            if own is None:
                return np.nan
            cycle = own
        run = self._beside(i, state, self.rules.difference * size, 0, ROUNDS * p + 2, out)
        return np.nan if run is None else float(contraction(cycle.section[i], run.section[i], size, p, self.tolerance))


def rules_of(
    method: str, transient: int, keep: int, max_period: int, tolerance: float, scale: FloatArray, first_look: int = 0,
    attempts: int = ATTEMPTS, beyond: int = 0,
) -> Rules:  # fmt: skip
    """The rules of judgement and of the cycle for a method; see :class:`nonsmooth.kernels.judging.settle.Rules`."""
    from nonsmooth.kernels.judging.settle import Rules

    # at rest a Runge-Kutta pair errs by atol: a difference must stand well above that for its growth to mean something
    clear = min(1e3 * tolerance, 1e-4) if method == "rkf45" else DIFFERENCE
    least, rounded = least_sizes(method, scale)
    return Rules(
        transient, keep, max_period, first_look, attempts, beyond, tolerance, max(DIFFERENCE, 1e2 * tolerance, clear),
        least, rounded, LEAST * scale, ROUNDED,
    )  # fmt: skip


def tolerance_of(engine: Engine, rtol: float | None) -> float:
    """Tolerance of a return, in units of the motion's size: no less than the engine's own tolerance shows."""
    return TOLERANCE if engine.name == "exact" else max(TOLERANCE, 10.0 * getattr(engine, "rtol", RTOL))


def longest_period(keep: int, max_period: object) -> int:
    """``max_period`` as a whole number that ``keep`` section points can show; where None, up to 16.

    Raises
    ------
    ValueError, TypeError
        One that is not, or not a whole number from 1.
    """
    if max_period is None:
        return min(LONGEST, keep - 1)
    longest = whole_number(max_period, "max_period", 1)
    if longest >= keep:
        raise ValueError(
            f"max_period = {longest}: {keep} kept section points show periods up to {keep - 1} only; raise keep above "
            "max_period, or lower max_period"
        )
    return longest


def _replace(state: State, other: State) -> None:
    """Make ``state`` a copy of ``other``, in place."""
    state.u[:], state.memory[:], state.clock[:], state.counters[:] = other.u, other.memory, other.clock, other.counters
    state.settled = other.settled
