"""Log of one trajectory: its samples, crossings and touches."""

from nonsmooth.kernels.compile.cache import inline, once
from nonsmooth.kernels.hybrid.codes import (
    CHANGES,
    CROSSINGS,
    DONE,
    JUMPS,
    LOG_FULL,
    MODE,
    MOST_AT_ONCE,
    NO_END,
    OK,
    PERIODS,
    SAMPLES,
    TIME,
    TOUCHES,
)
from nonsmooth.kernels.linear.stepper import memory_at, state_at
from nonsmooth.kernels.linear.touches import log_touches


@once
def base_of(i, form, work):
    """The time since the start of the forcing."""
    T = form.period[i]
    return work.memo[PERIODS] * T + work.memo[TIME] if T < NO_END else work.memo[TIME]


@once
def room_in_log(seen, work):
    """LOG_FULL asks for larger logs."""
    crossings = work.tally[CROSSINGS] + MOST_AT_ONCE > seen.crossing_time.shape[0]
    return LOG_FULL if crossings or work.tally[TOUCHES] + seen.spare > seen.touch_time.shape[0] else OK


@inline
def write_sample(n, u, form, seen, work):
    """The n-th sample."""
    own = seen.sample_u.shape[1]
    for j in range(own):
        seen.sample_u[n, j] = u[j]
    for j in range(seen.sample_memory.shape[1]):
        seen.sample_memory[n, j] = memory_at(j, own, form, work)
    seen.sample_mode[n] = work.tally[MODE]
    seen.sample_segment[n] = work.tally[CROSSINGS]


@once
def observe_samples(step, form, net, seen, tables, work):
    """Samples and touches on the segment."""
    tally, base = work.tally, work.memo[DONE]
    n = tally[SAMPLES]
    while n < seen.samples.shape[0] and seen.samples[n] - base < step:
        state_at(max(seen.samples[n] - base, 0.0), form, tables, work, work.wp)
        write_sample(n, work.wp, form, seen, work)
        n += 1
    tally[SAMPLES] = n
    log_touches(step, form, net, seen, tables, work)


@once
def next_end(goal, seen, work):
    """The time to which one goes before anything else: the end of the run, or the next change of its inputs."""
    k = work.tally[CHANGES]
    return min(seen.changes[k], goal.until) if k < seen.changes.shape[0] else goal.until


@once
def change_inputs(goal, seen, work):
    """Give the states that stand for inputs their values where these change by now; returns whether they do."""
    k, first = work.tally[CHANGES], seen.inputs
    if k >= seen.changes.shape[0] or work.memo[DONE] < seen.changes[k]:
        return False
    for j in range(seen.given.shape[1]):
        work.w[first + j] = seen.given[k, j]
    work.tally[CHANGES] = k + 1
    return True


@once
def mark_time(i, wrapped, ended, crossed, form, goal, seen, work):
    """The time at the end of a segment."""
    if wrapped or (not form.period[i] < NO_END and not crossed):
        work.tally[JUMPS] = 0
    work.memo[DONE] = next_end(goal, seen, work) if ended else base_of(i, form, work)


@once
def log_transition(t, form, seen, work):
    """Log a transition."""
    n, own = work.tally[CROSSINGS], seen.u_before.shape[1]
    seen.crossing_time[n] = work.memo[DONE]
    seen.crossing_transition[n] = t
    for j in range(own):
        seen.u_before[n, j] = work.wp[j]
        seen.u_after[n, j] = work.w[j]
    for j in range(seen.memory_after.shape[1]):
        seen.memory_after[n, j] = memory_at(j, own, form, work)
    work.tally[CROSSINGS] = n + 1


@once
def last_samples(until, form, seen, work):
    """Samples at the very end of a run."""
    n = work.tally[SAMPLES]
    while n < seen.samples.shape[0] and seen.samples[n] <= until:
        write_sample(n, work.w, form, seen, work)
        n += 1
    work.tally[SAMPLES] = n
