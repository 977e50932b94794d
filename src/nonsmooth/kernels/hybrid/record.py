"""Observer of one trajectory: its samples, crossings and touches."""

from numba import types

from nonsmooth.kernels.compile.cache import inline, kernel, once
from nonsmooth.kernels.hybrid.codes import LOG_FULL, OK, PAUSED
from nonsmooth.kernels.hybrid.loop import leave, march
from nonsmooth.kernels.hybrid.places import CROSSINGS, DONE, JUMPS, MODE, NO_END, PERIODS, SAMPLES, TIME, TOUCHES
from nonsmooth.kernels.hybrid.records import GOAL, LOG, MOTION, NET, SECTION
from nonsmooth.kernels.linear.stepper import STEPPER, memory_at, n_memory, n_states, state_at
from nonsmooth.kernels.linear.touches import log_touches

OPEN_RUN, CLOSED = 0, 2
SPARE = 64  # crossings that one leg may add to the log


@once
def base_of(i, form, work):
    """The time since the start of the forcing."""
    T = form.period[i]
    return work.memo[PERIODS] * T + work.memo[TIME] if T < NO_END else work.memo[TIME]


@once
def open_window(i, form, section, seen, tables, work):
    """The whole run is recorded, from its present time on."""
    work.memo[DONE] = base_of(i, form, work)


@once
def reached(goal, work):
    """Return whether the run is over."""
    return not work.memo[DONE] < goal.until


@once
def room(seen, work):
    """LOG_FULL asks for larger logs."""
    crossings = work.tally[CROSSINGS] + SPARE > seen.crossing_time.shape[0]
    return LOG_FULL if crossings or work.tally[TOUCHES] + seen.spare > seen.touch_time.shape[0] else OK


@once
def remaining(section, goal, work):
    """Time to the end of the run."""
    return goal.until - work.memo[DONE]


@once
def watched(section, goal, work):
    """Every step is seen."""
    return True


@once
def next_is_edge(section, goal, work):
    """There is no section."""
    return False


@inline
def write_sample(n, u, form, seen, work):
    """The n-th sample."""
    for j in range(n_states(work)):
        seen.sample_u[n, j] = u[j]
    for j in range(n_memory(form, work)):
        seen.sample_memory[n, j] = memory_at(j, form, work)
    seen.sample_mode[n] = work.tally[MODE]
    seen.sample_segment[n] = work.tally[CROSSINGS]


@once
def observe(i, step, stop, triggered, form, net, section, goal, seen, tables, work):
    """Samples and touches on the segment."""
    tally, base = work.tally, work.memo[DONE]
    n = tally[SAMPLES]
    while n < seen.samples.shape[0] and seen.samples[n] - base < step:
        state_at(max(seen.samples[n] - base, 0.0), form, tables, work, work.wp)
        write_sample(n, work.wp, form, seen, work)
        n += 1
    tally[SAMPLES] = n
    log_touches(step, form, net, seen, tables, work)
    return OPEN_RUN


@once
def mark(i, wrapped, ended, crossed, step, form, goal, seen, work):
    """The time at the end of a segment."""
    if wrapped or (not form.period[i] < NO_END and not crossed):
        work.tally[JUMPS] = 0
    work.memo[DONE] = goal.until if ended else base_of(i, form, work)


@once
def approach(mode, fired, seen, tables, work):
    """Nothing is asked of a crossing before it is made."""


@once
def cross(i, t, mode, jumps, form, net, section, goal, seen, tables, work):
    """Log a transition."""
    n = work.tally[CROSSINGS]
    seen.crossing_time[n] = work.memo[DONE]
    seen.crossing_transition[n] = t
    for j in range(n_states(work)):
        seen.u_before[n, j] = work.wp[j]
        seen.u_after[n, j] = work.w[j]
    for j in range(n_memory(form, work)):
        seen.memory_after[n, j] = memory_at(j, form, work)
    work.tally[CROSSINGS] = n + 1


@once
def depart(jumps, seen, work):
    """Nothing is asked of a crossing after it was made."""


@kernel(types.int64(STEPPER[0], NET, SECTION, GOAL, MOTION, LOG, STEPPER[1], STEPPER[2]))
def record(form, net, section, goal, motion, seen, tables, work):
    """March point 0 to the time ``goal.until``. Returns a status: LOG_FULL and PAUSED ask to be called again."""
    tally = work.tally
    code = march(0, form, net, section, goal, motion, seen, tables, work)
    if code in (LOG_FULL, PAUSED):
        return code
    n = tally[SAMPLES]
    while code == OK and n < seen.samples.shape[0] and seen.samples[n] <= goal.until:
        write_sample(n, work.w, form, seen, work)
        n += 1
    tally[SAMPLES] = n
    leave(0, form, motion, work)
    return code
