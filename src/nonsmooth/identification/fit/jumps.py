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
from nonsmooth.flow.sampled import SampledRun
from nonsmooth.flow.sensitivity import CHANGE, apart
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
    modes, starts, times, transitions, before = apart(flow, motion.log, motion.begun, motion.begin, motion.changes)
    bounds, mode = np.array(times[1:]), np.array(modes)
    hit = np.array([j for j, chain in enumerate(transitions) if chain != (CHANGE,)], dtype=np.int64)
    ends = np.array([before[j] for j in hit]), np.array([starts[j + 1] for j in hit])
    seen = jumps(bounds[hit], ((ends[0], mode[hit]), (ends[1], mode[hit + 1])))
    if not seen.any():
        return motion
    t, hit, (old, new) = motion.time, hit[seen], (states[seen] for states in ends)
    low, high = np.searchsorted(t, bounds[hit] - reach), np.searchsorted(t, bounds[hit] + reach, "right")
    of = np.repeat(np.arange(len(hit)), high - low)
    at = np.arange(len(of)) - np.repeat(np.cumsum(high - low) - high, high - low)
    # A sample stands in the segment before or behind the transition, an instant at its end included.
    here, ending = (np.searchsorted(bounds, t[at], side) for side in ("right", "left"))
    early, late = here == hit[of], (here > hit[of]) & (ending <= hit[of] + 1)
    of, at, here, early = (column[early | late] for column in (of, at, here, early))
    to, time = hit[of] + early, bounds[hit[of]]
    legs = flow.segments(values, mode[to], time, t[at] - time, np.where(early[:, None], new[of], old[of]))
    told = (legs.status == codes.OK) & np.isfinite(legs.z).all(axis=1)
    of, at, early, to, here = (column[told] for column in (of, at, early, to, here))
    moved = np.zeros(len(t), dtype=np.int64)
    moved[at] = to - here
    other = replace(motion, z=motion.z.copy(), mode=motion.mode.copy(), moved=moved)
    other.z[at], other.mode[at] = legs.z[told], mode[to]
    gain = misfit(motion) - misfit(other)
    for which, side in {*zip(of.tolist(), early.tolist(), strict=True)}:
        mine = at[(of == which) & (early == side)][:: -1 if side else 1]  # from the transition on
        total = np.cumsum(gain[mine])
        back = mine[np.argmax(total) + 1 if total.max() > 0 else 0 :]  # beyond the split that fits best
        other.z[back], other.mode[back], moved[back] = motion.z[back], motion.mode[back], 0
    return other
