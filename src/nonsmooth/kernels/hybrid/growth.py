"""Growth of small changes along a trajectory: what Lyapunov exponents are.

A frame is carried over each segment and each transition by the stepper's own ``growth``. It is made orthonormal again
after each, and what is divided out is multiplied up.
"""

from math import inf

from nonsmooth.kernels.compile.cache import once
from nonsmooth.kernels.hybrid.codes import DONE, JUMPS, NO_END, PERIODS, RETURNS, TIME, WAITED
from nonsmooth.kernels.linear.growth import anchor_frame, frame_has_moved, shape_of
from nonsmooth.kernels.tangent.frame import log_determinant, multiply, straighten


@once
def open_frame(seen, work):
    """Units of time count from here (``RETURNS`` of them; where in the period the run began: ``WAITED``), and periods
    with them."""
    work.memo[PERIODS] = 0.0
    work.memo[WAITED] = work.memo[TIME]
    for c in range(shape_of(seen)[1]):
        seen.lengths[c] = 1.0
    anchor_frame(seen, work)


@once
def mark_unit(i, ended, crossed, step, form, goal, seen, work):
    """The time at the end of a segment, on the clock of the forcing: sums of steps would drift away from it."""
    n, columns = shape_of(seen)
    tally, memo, T = work.tally, work.memo, form.period[i]
    if frame_has_moved(ended, crossed, form, goal, seen, work) and not crossed:
        straighten(seen.frame, n, columns, seen.lengths, False, ended, seen.growth[tally[RETURNS]], seen.scratch)
    if ended:
        tally[RETURNS] += 1
        tally[JUMPS] = 0
        memo[DONE] = tally[RETURNS] * goal.unit
    else:
        memo[DONE] = memo[PERIODS] * T + memo[TIME] - memo[WAITED] if T < NO_END else memo[DONE] + step


@once
def leave_transitions(jumps, seen, work):
    """The transitions of one instant act on the frame."""
    n, columns = shape_of(seen)
    S, scale = seen.step, seen.scale
    for r in range(n):
        for c in range(n):
            S[r, c] *= scale[c] / scale[r]
    size = log_determinant(S, n, seen.matrix)
    seen.sums[1] += size
    seen.sums[2] += jumps
    multiply(S, seen.frame, n, columns, seen.matrix)
    growth = seen.growth[work.tally[RETURNS]]
    straighten(seen.frame, n, columns, seen.lengths, size == -inf, False, growth, seen.scratch)
    anchor_frame(seen, work)
