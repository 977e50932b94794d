"""Methods of the series stepper, its places in ``work.tally`` and ``work.memo`` behind those of ``hybrid.places``."""

from nonsmooth.kernels.hybrid.codes import N_MEMO as FIRST_TIME
from nonsmooth.kernels.hybrid.codes import N_TALLY as FIRST_COUNT

TAYLOR, RKF45 = 0, 1
METHODS = {"taylor": TAYLOR, "rkf45": RKF45}

# The jets at the present instant stand in their place; a polynomial of which only a part has been gone; the transition
# on it, and its row that crosses; it ends at a stop; nothing happens on it; the indicator that vanishes where the next
# one begins; a graze was left undecided; the motion stays on the section's surface; steps near one place; steps in all
READY, OPEN_STEP, PENDING, HIT, LANDING, CALM, ZERO_ROW, DOUBTFUL, STAYS, RESTING, STEPS = range(
    FIRST_COUNT, FIRST_COUNT + 11
)
N_SERIES_TALLY = FIRST_COUNT + 11

# Time at which the polynomial begins; its length, and that of its part that is used; the part of it that is gone, and
# will be at the end of the leg; the length that was planned; value and slope of the section's indicator at its end; the
# longest time between two crossings; where a frame was carried to, the time since, and how far its series reach
(
    BASE,
    LENGTH,
    PART,
    CURSOR,
    AHEAD,
    PLANNED,
    VALUE_BEFORE,
    SLOPE_BEFORE,
    LONGEST,
    ANCHOR,
    GONE,
    REACH,
) = range(FIRST_TIME, FIRST_TIME + 12)
N_SERIES_MEMO = FIRST_TIME + 12

AT_REST = 1000  # steps in a row near one place, before a state without forcing counts as an equilibrium
HALVINGS = 8  # of a step whose polynomial leaves a graze undecided
