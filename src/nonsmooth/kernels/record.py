"""Observer of one trajectory: its samples, crossings and touches."""

from numba import types

from .cache import device, inline, kernel
from .codes import LOG_FULL, OK, PAUSED
from .hybrid import leave, march
from .linear_polynomial import critical_points, curvature_at, horner
from .linear_search import compose, dense, to_node
from .linear_tables import NODES, STATES
from .records import FORM, GOAL, LOG, MOTION, NET, SECTION, TABLES, WORK
from .run_places import CROSSINGS, DONE, JUMPS, MODE, PERIODS, SAMPLES, TIME, TOUCHES

OPEN_RUN, CLOSED = 0, 2
SPARE = 64  # places in the logs that one leg may need


@inline
def base_of(i, form, work):
    """The time since the start of the forcing."""
    T = form.period[i]
    return work.memo[PERIODS] * T + work.memo[TIME] if T < 1e300 else work.memo[TIME]


@inline
def open_window(i, form, section, seen, tables, work):
    """The whole run is recorded, from its present time on."""
    work.memo[DONE] = base_of(i, form, work)


@inline
def reached(goal, work):
    """Whether the run is over."""
    return not work.memo[DONE] < goal.until


@inline
def room(seen, work):
    """LOG_FULL asks for larger logs."""
    crossings = work.tally[CROSSINGS] + SPARE > seen.crossing_time.shape[0]
    return LOG_FULL if crossings or work.tally[TOUCHES] + SPARE > seen.touch_time.shape[0] else OK


@inline
def remaining(goal, work):
    """Time to the end of the run."""
    return goal.until - work.memo[DONE]


@inline
def may_stride(i, form, net, section):
    """Every step is seen."""
    return False


@inline
def hurry(i, form, net, section, goal, seen, tables, work, patience):
    """Every step is seen."""
    return False, False, patience


@inline
def write_sample(n, u, seen, work):
    """The n-th sample."""
    for j in range(STATES):
        seen.sample_u[n, j] = u[j]
    seen.sample_mode[n] = work.tally[MODE]
    seen.sample_segment[n] = work.tally[CROSSINGS]


@inline
def observe(i, step, full, triggered, form, net, section, goal, seen, tables, work):
    """Samples and touches on the leg."""
    tally, base = work.tally, work.memo[DONE]
    n = tally[SAMPLES]
    while n < seen.samples.shape[0] and seen.samples[n] - base < step:
        dense(tables, work, tally[MODE], max(seen.samples[n] - base, 0.0), work.wp)
        write_sample(n, work.wp, seen, work)
        n += 1
    tally[SAMPLES] = n
    log_touches(step, base, tally[MODE], net, seen, tables, work)
    return OPEN_RUN


@device
def log_touches(step, base, mode, net, seen, tables, work):
    """Append the local maxima of the mode's armed rows that stay <= 0 within (0, step) of a leg."""
    wn, scr, points = work.wn, work.scr, work.points
    spacing, n = tables.info[mode, 1], work.tally[TOUCHES]
    for j in range(net.mode_start[mode], net.mode_start[mode + 1]):
        t = net.mode_list[j]
        for r in range(net.row_start[t], net.row_start[t + 1]):
            f = net.rows[r, 0]
            sign = float(net.rows[r, 1])
            for node in range(1, NODES, 2):  # pieces of two spacings, with their polynomial in the middle
                if (node - 1) * spacing >= step or n + 1 >= seen.touch_time.shape[0]:
                    break
                to_node(tables, mode, node, work.w, wn)
                compose(tables, mode, f, wn, scr, 0)
                count = critical_points(scr, 0, -spacing, spacing, points)
                for k in range(count):
                    local = points[k]
                    value = sign * horner(scr, 0, local)
                    tau = node * spacing + local
                    if tau <= 0.0 or tau >= step or value > 0.0 or sign * curvature_at(scr, 0, local) > 0.0:
                        continue
                    seen.touch_time[n] = base + tau
                    seen.touch_indicator[n] = f
                    seen.touch_gap[n] = -value
                    for s in range(STATES):
                        compose(tables, mode, work.zero.shape[0] + s, wn, scr, 1)
                        seen.touch_u[n, s] = horner(scr, 1, local)
                    n += 1
    work.tally[TOUCHES] = n


@inline
def mark(i, wrapped, ended, crossed, step, form, goal, seen, work):
    """The time at the end of a leg."""
    if wrapped or (form.period[i] > 1e300 and not crossed):
        work.tally[JUMPS] = 0
    work.memo[DONE] = goal.until if ended else base_of(i, form, work)


@inline
def approach(mode, fired, seen, tables, work):
    """Nothing is asked of a crossing before it is made."""


@inline
def cross(i, t, mode, jumps, form, net, goal, seen, tables, work):
    """Log a transition."""
    n = work.tally[CROSSINGS]
    seen.crossing_time[n] = work.memo[DONE]
    seen.crossing_transition[n] = t
    for j in range(STATES):
        seen.u_before[n, j] = work.wp[j]
        seen.u_after[n, j] = work.w[j]
    work.tally[CROSSINGS] = n + 1


@inline
def depart(jumps, seen, work):
    """Nothing is asked of a crossing after it was made."""


@inline
def arrive(i, code, source, t, sense, state, form, section, goal, seen, tables, work):
    """No section is looked for."""
    return code


@kernel(types.int64(FORM, NET, SECTION, GOAL, MOTION, LOG, TABLES, WORK))
def record(form, net, section, goal, motion, seen, tables, work):
    """March point 0 to the time ``goal.until``. Returns a status: LOG_FULL and PAUSED ask to be called again."""
    tally = work.tally
    code = march(0, form, net, section, goal, motion, seen, tables, work)
    if code in (LOG_FULL, PAUSED):
        return code
    n = tally[SAMPLES]
    while code == OK and n < seen.samples.shape[0] and seen.samples[n] <= goal.until:
        write_sample(n, work.w, seen, work)
        n += 1
    tally[SAMPLES] = n
    leave(0, form, motion, work)
    return code
