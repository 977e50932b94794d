"""The stepper of the series methods: segments on polynomials in the local time, and landing.

Every step is a polynomial for each row (states, indicators, outputs): the Taylor jet itself, or the quintic of a
Runge-Kutta-Fehlberg step. Crossings, sections, extremes, touches and samples are read off it. A step ends exactly at
stops: the phase of a section, the end of a period, time-triggered transitions, the end of the run. A segment is a step,
or its part up to a pass of a section on a surface: behind it the same polynomial goes on. Jumps and after-limits stand
in ``series.instant``.
"""

from math import fabs

from numba import types

import nonsmooth.kernels.hybrid.codes as place
from nonsmooth.kernels.compile.cache import once
from nonsmooth.kernels.hybrid.codes import FIRED, GROW, MODE, NO_END, RETURNS, TIME, TRIES, UNBROKEN
from nonsmooth.kernels.hybrid.records import GENERATED, SERIES_WORK
from nonsmooth.kernels.series.crossing import section_crossing, sides_at
from nonsmooth.kernels.series.generated import jet_of, values_of
from nonsmooth.kernels.series.instant import ON_SURFACE
from nonsmooth.kernels.series.polynomial import NONE, row_bounds
from nonsmooth.kernels.series.step import at_end, degree_of, jets_of, judged_at_end, make_step, polished
from nonsmooth.kernels.series.taylor import copied, dense_states, end_states, fill_powers

STEPPER = GENERATED, types.Tuple(()), SERIES_WORK  # the types of this stepper's records: model, tables, work


@once
def next_stop(i, form, net, section, goal, work):
    """The time at which a step must end, and the transition that is triggered there (-1: none)."""
    period, t, mode = form.period[i], work.memo[TIME], work.tally[MODE]
    timed = False
    for k in range(net.at.shape[0]):
        timed = timed or net.at[k] >= 0.0
    if not period < NO_END or (  # returns of the transient are only counted, so no step needs to end there
        section.indicator < 0 and section.phase >= 0.0 and not timed and work.tally[RETURNS] + 1 < goal.transient
    ):
        return NO_END, -1
    stop, which = period, -1
    if section.indicator < 0 and t < section.phase * period < stop:
        stop = section.phase * period
    for k in range(net.mode_start[mode], net.mode_start[mode + 1]):
        one = net.mode_list[k]
        if net.at[one] >= 0.0:
            at = net.at[one] * period
            if at <= t:
                at += period
            if at < stop or (at <= stop and which < 0):
                stop, which = at, one
    return stop, which


@once
def steps_at_a_stride(i, form, net, section):
    """Every step is a segment."""
    return False


@once
def stride(tables, net, work, mode, s, whole, target, period, returns, most, patience):
    """Every step is a segment."""
    return s, whole, returns, 0, patience


@once
def next_pass(form, section, work):
    """Local time of the next pass of a section on the step, before its transition (-1: none), and the direction."""
    tally, memo, s = work.tally, work.memo, section.indicator
    mode, n = tally[MODE], work.w.shape[0]
    if s < 0 or tally[place.CALM] == 1 or tally[place.STAYS] == 1 or not (section.mode < 0 or section.mode == mode):
        return -1.0, 0
    degree = degree_of(form)
    h, part, cursor = memo[place.LENGTH], memo[place.PART], memo[place.CURSOR]
    if cursor == 0.0:
        _, low, high = row_bounds(work.C, n + s, 1.0, degree, work.powers)
        if max(high, -low) <= ON_SURFACE * work.scale[s]:
            work.side_next[s] = 0
            return -1.0, 0
        if (low > 0.0 and work.side[s] >= 0) or (high < 0.0 and work.side[s] <= 0):
            work.side_next[s] = 1 if low > 0.0 else -1
            return -1.0, 0
    x = section_crossing(
        work.C,
        n + s,
        degree,
        section.rising,
        work.side[s] if cursor == 0.0 else 0,
        cursor,
        work.powers,
        work.scale[s],
        work.a,
        work.stack,
        work.found,
    )
    sense = work.found[1]
    work.side_next[s] = sense
    if x == NONE or (tally[place.PENDING] >= 0 and x * h >= part * (1.0 - 1e-10)):
        return -1.0, 0
    memo[place.AHEAD] = x
    return polished(form, work, s, memo[place.BASE], h, x * h), 1 if sense >= 0 else -1


@once
def leg(i, form, net, section, goal, tables, work, r_max, ready, first):
    """March to the next pass of a section, transition or end of a step, not beyond r_max; ``work.end`` is the state
    there. Returns (time marched, transition or -1, False, section direction or 0); a negative time: it diverges."""
    if goal.kind == GROW and goal.transient == UNBROKEN:  # a frame that follows fills in the end
        return r_max, -1, False, 0
    tally, memo, C, n = work.tally, work.memo, work.C, work.w.shape[0]
    wanted = watched(section, goal, work)
    if tally[place.OPEN_STEP] == 0:
        if not make_step(i, form, net, section, wanted, work, r_max):
            return -1.0, -1, False, 0
    tally[place.OPEN_STEP] = 0
    rkf, degree = form.method == place.RKF45, degree_of(form)
    h, part, gone = memo[place.LENGTH], memo[place.PART], memo[place.CURSOR] * memo[place.LENGTH]
    tau, sense = next_pass(form, section, work)
    if tau >= 0.0:
        if next_is_edge(section, goal, work):  # the kept window begins or ends here: so does a step
            sides_at(C, degree, n, form.indicators, tau / h, work.powers, work.scale, work.a, work.side)
            fill_powers(tau, degree, work.powers)
            tally[place.ZERO_ROW] = section.indicator
            memo[place.PART] = tau
        else:
            tally[place.OPEN_STEP] = 1
        dense_states(C, degree, n, tau, work.end)
        return tau - gone, -1, False, sense
    pending = tally[place.PENDING]
    tally[FIRED] = tally[place.HIT]
    if pending >= 0:
        if part != h:
            fill_powers(part, degree, work.powers)
        if section.indicator >= 0:
            memo[place.VALUE_BEFORE], memo[place.SLOPE_BEFORE] = at_end(C, degree, n + section.indicator, part)
    if rkf and pending < 0:
        copied(work.K[7], work.end)
    else:
        end_states(C, degree, n, work.powers, work.end)
    return r_max if tally[place.LANDING] == 1 else part - gone, pending, False, 0


@once
def time_scale(i, since, form, tables, work):
    """The time beside which crossings are close to each other: a tenth of the period, or of the longest dwell."""
    work.memo[place.LONGEST] = max(work.memo[place.LONGEST], since if since < NO_END else 0.0)
    return 0.1 * (form.period[i] if form.period[i] < NO_END else work.memo[place.LONGEST])


@once
def arrive_at(t, since, full, wrapped, form, net, tables, work):
    """State and signs at the end of a segment. Returns its transition, where that is judged there only."""
    tally, rkf, n = work.tally, form.method == place.RKF45, work.w.shape[0]
    copied(work.end, work.w)
    if tally[place.OPEN_STEP] == 1:
        work.memo[place.CURSOR] = work.memo[place.AHEAD]
        return t
    tally[place.READY] = 0
    if tally[place.ZERO_ROW] >= 0:
        return t
    if t >= 0:
        work.dwell[tally[MODE]] = since
        if net.meets.shape[0] > 0:
            values = values_of(form)
            values(tally[MODE], work.memo[TIME], work.w, work.q, work.vals)
    if tally[place.PENDING] >= 0:
        return t
    if rkf:
        J0, J1 = work.J0, work.J1
        j = 0
        while True:
            J0[j, 0], J0[j, 1], J0[j, 2] = J1[j, 0], J1[j, 1], J1[j, 2]
            j += 1
            if j >= J0.shape[0]:
                break
        tally[place.READY] = 1
    if form.locate == 1:
        j = 0
        while j < form.indicators:
            work.side[j] = work.side_next[j]
            if rkf and fabs(work.J1[n + j, 0]) > work.scale[j]:
                work.scale[j] = fabs(work.J1[n + j, 0])
            j += 1
        return t
    if tally[place.READY] == 0:
        jet = jet_of(form)
        jet(tally[MODE], form.order, work.memo[TIME], work.w, work.q, work.C, work.W)
        tally[place.READY] = 1
    J = jets_of(form, work)
    judged = judged_at_end(tally[MODE], J, n, form.indicators, net, work)
    if judged < 0:
        return t
    tally[FIRED] = -1
    return judged


# --------------------------------------------------------------------------------------------------------------
# For the loop and its observers


@once
def touch_section(section, work):
    """Signs are kept by the segment."""


@once
def note_side(t, sense, section, tables, work):
    """Note behind a transition whether the motion stays on the section's surface; signs are kept by the segment."""
    if t >= 0:
        work.tally[place.STAYS] = 1 if work.side[section.indicator] == 0 else 0


@once
def at_rest(form, section, goal, tables, work):
    """Return whether a state without forcing no longer moves, so that no section is met again: ``AT_REST`` steps in a
    row, and no return among them, have left it where it was within a hundred tolerances."""
    tally, mode = work.tally, work.tally[MODE]
    if form.period[0] < NO_END:
        return False
    moved = 0.0
    for j in range(work.w.shape[0]):
        if form.lacking[mode, j] == 0:
            moved = max(moved, fabs(work.w[j] - work.rest[j]) / (fabs(work.w[j]) + form.weight[j]))
    tally[place.RESTING] += 1
    if not (moved <= 1e2 * form.rtol) or tally[TRIES] <= 1:
        tally[place.RESTING] = 0
        for j in range(work.w.shape[0]):
            work.rest[j] = work.w[j]
    return tally[place.RESTING] > place.AT_REST


@once
def state_at(tau, form, tables, work, out):
    """The state at any instant of the segment."""
    degree = degree_of(form)
    if tau >= work.memo[place.PART]:
        for j in range(work.w.shape[0]):
            out[j] = work.end[j]
    else:
        dense_states(work.C, degree, work.w.shape[0], tau, out)


@once
def memory_at(k, own, form, work):
    """The k-th value in memory."""
    return work.q[form.points.shape[1] + k]


@once
def put_state(motion, work):
    """Write state and memory to the motion."""
    first = work.q.shape[0] - motion.memory.shape[0]
    for j in range(motion.u.shape[0]):
        motion.u[j] = work.w[j]
    for j in range(motion.memory.shape[0]):
        motion.memory[j] = work.q[first + j]


@once
def bounded(work, limit):
    """Finite and below the limits of divergence."""
    for j in range(work.w.shape[0]):
        if not (fabs(work.w[j]) <= limit[j]):
            return False
    return True


@once
def may_pause(work):
    """All that is known stands in the arrays."""
    return True


@once
def doubtful(work):
    """Return whether a graze was left undecided."""
    return work.tally[place.DOUBTFUL] == 1
