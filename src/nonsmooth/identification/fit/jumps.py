"""Readings beside a transition at which they jump: a speed at an impact, a state that is reset, another law of a force.

A sample on the other side of the model's transition than the reading's own leaves a residual as large as the jump, and
the sum of squares has a cliff there. So samples beside such a transition are those of the motion that takes it a little
later, or has taken it a little before, split where the readings fit best: the sum of squares and its derivatives go on
through each sample.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nonsmooth.arrays import BoolArray, FloatArray, IntArray
from nonsmooth.flow.sampled import SampledRun, held
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.kernels.hybrid import codes

Sides = tuple[tuple[FloatArray, IntArray], tuple[FloatArray, IntArray]]  # states and modes before and after transitions


def sided(
    flow: VariationalFlow,
    values: FloatArray,
    motion: SampledRun,
    reach: float,
    jumps: Callable[[FloatArray, Sides], BoolArray],
    misfit: Callable[[SampledRun], FloatArray],
) -> SampledRun:
    """The motion with its samples no farther than ``reach`` from a transition on the side that they fit.

    ``jumps`` marks the transitions at which a reading jumps, by their times and sides; ``misfit`` has the sum of
    squares of each sample (N,)."""
    flow.catch_up()
    log, t, known = motion.log, motion.time, flow.traced.transitions
    first = np.flatnonzero(np.diff(log.crossing_time, prepend=-np.inf) > 0)  # of those at one instant
    last, every = np.append(first[1:], len(log.crossing_time)) - 1, log.crossing_time[first]
    memories = np.vstack([motion.start[1][None, flow.n_u :], log.memory_after])
    before = np.array([known[k].source for k in log.crossing_transition[first].tolist()])
    after = np.array([known[k].target for k in log.crossing_transition[last].tolist()])
    sides = (
        (np.hstack([held(log.u_before)[first], memories[first]]), before),
        (np.hstack([held(log.u_after)[last], memories[last + 1]]), after),
    )
    which = np.flatnonzero(jumps(every, sides))
    if not len(which):
        return motion
    low, high = np.searchsorted(t, every[which] - reach), np.searchsorted(t, every[which] + reach, "right")
    of = np.repeat(which, high - low)
    at = np.arange(len(of)) - np.repeat(np.cumsum(high - low) - high, high - low)
    behind, changes = t[at] >= every[of], motion.changes[0]
    bounds, ends = np.union1d(every, changes), np.sort([t[at], every[of]], axis=0)
    here = np.isin(t[at], changes) & (t[at] != every[of])  # inputs change at the sample, not on the way to it
    between = np.searchsorted(bounds, ends[1], "right") - np.searchsorted(bounds, ends[0]) - here
    at, of, behind, here = (column[between == 1] for column in (at, of, behind, here))
    time, moved = every[of], np.where(behind, -1 - here, 1)
    (z, mode), (z_after, mode_after) = ((states[of], modes[of]) for states, modes in sides)
    z, mode = np.where(behind[:, None], z, z_after), np.where(behind, mode, mode_after)
    legs = flow.segments(values, mode, time, t[at] - time, z)
    told = (legs.status == codes.OK) & np.isfinite(legs.z).all(axis=1)
    at, of, moved = at[told], of[told], moved[told]
    other = replace(motion, z=motion.z.copy(), mode=motion.mode.copy(), moved=np.zeros(len(t), dtype=np.int64))
    assert isinstance(other.moved, np.ndarray)
    other.z[at], other.mode[at], other.moved[at] = legs.z[told], mode[told], moved
    gain = misfit(motion) - misfit(other)
    for group in {*zip(of.tolist(), np.sign(moved).tolist(), strict=True)}:
        mine = at[(of == group[0]) & (np.sign(moved) == group[1])][:: -group[1]]  # from the transition on
        total = np.cumsum(gain[mine])
        back = mine[np.argmax(total) + 1 if total.max() > 0 else 0 :]  # beyond the split that fits best
        other.z[back], other.mode[back], other.moved[back] = motion.z[back], motion.mode[back], 0
    return other
