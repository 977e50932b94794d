"""Steps of a frame of small changes along the series methods, by Taylor series of its own (``tangent.following``).

The frame lies behind: it is carried from where the trajectory was (``seen.u``, ``seen.q``) over several of its segments
at once, by steps as long as its own series allow. Where nothing can happen to a motion the two are one."""

from math import nan

from numba import types

import nonsmooth.kernels.hybrid.codes as place
from nonsmooth.kernels.compile.cache import inline, once
from nonsmooth.kernels.compile.pointers import function_at
from nonsmooth.kernels.hybrid.codes import MODE, RETURNS, TIME, UNBROKEN
from nonsmooth.kernels.series.taylor import copied

_i, _f = types.int64, types.float64
frame_along_at = function_at(types.FunctionType(_f(_i, _i, _f, _f, _f, _i)))
frame_across_at = function_at(types.FunctionType(types.void(_i, _i, _f, _i)))

BEHIND = 4.0  # steps of the frame's own series after which it is carried on


@inline
def shape_of(seen):
    """The number of states and memory, and that of directions."""
    return seen.frame.shape


@once
def anchor_frame(seen, work):
    """Begin the frame where the trajectory is."""
    copied(work.w, seen.u)
    for j in range(seen.q.shape[0]):
        seen.q[j] = work.q[j]
    work.memo[place.ANCHOR], work.memo[place.GONE] = work.memo[TIME], 0.0


@once
def catch_up(seen, work):
    """Carry the frame to where the trajectory is. Returns False where its series do not converge."""
    memo = work.memo
    along = frame_along_at(seen.functions[0])
    reach = along(
        seen.follower,
        work.tally[MODE],
        memo[place.ANCHOR],
        memo[place.GONE],
        memo[place.REACH],
        work.tally[RETURNS],
    )
    memo[place.REACH] = reach
    return reach >= 0.0


@once
def carry_frame(step, goal, seen, tables, work):
    """Note the time of the segment; where the motion is moved by the frame's series, move it."""
    work.memo[place.GONE] += step
    if goal.transient == UNBROKEN:
        good = catch_up(seen, work)
        copied(seen.u, work.end)
        if not good:
            work.end[0] = nan


@once
def frame_has_moved(ended, crossed, form, goal, seen, work):
    """Carry the frame on where it lies far behind, or at the end of a unit of time."""
    memo = work.memo
    if goal.transient != UNBROKEN:
        if not ended and (crossed or not (form.checked == 1 or memo[place.GONE] >= BEHIND * memo[place.REACH])):
            return False
        if not crossed and not catch_up(seen, work):
            work.w[0] = nan
    if not crossed:
        anchor_frame(seen, work)
    return ended


@once
def approach_transition(mode, fired, seen, tables, work):
    """Carry the frame to the transitions of an instant."""
    if not catch_up(seen, work):
        work.w[0] = nan
    anchor_frame(seen, work)


@once
def saltate(i, t, jumps, mode, form, net, seen, tables, work):
    """Saltation of a transition."""
    if t < seen.taken.shape[0]:  # others are new, and nobody knows their derivatives yet
        seen.taken[t] += 1
        across = frame_across_at(seen.functions[1])
        across(seen.follower, t, work.memo[TIME], jumps)
