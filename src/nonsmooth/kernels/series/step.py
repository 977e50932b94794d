"""A step of the series methods: its length, its polynomials, and the first transition on it."""

from math import fabs, inf, sqrt
from math import log as ln

from numpy import float32

import nonsmooth.kernels.hybrid.codes as place
from nonsmooth.kernels.compile.cache import device, inline, local, once
from nonsmooth.kernels.hybrid.codes import MODE, NO_END, TIME, WAITED
from nonsmooth.kernels.series.crossing import earliest, rows_hold
from nonsmooth.kernels.series.generated import field_of, jet_of, values_of
from nonsmooth.kernels.series.polynomial import NONE
from nonsmooth.kernels.series.rkf45 import first_step, hermite, middle, quiet, stages, time_to_transition
from nonsmooth.kernels.series.taylor import dense_states, fill_powers, step_length, trusted

BETWEEN = 1e3  # times the tolerance: so far conditions may be off between the ends of a step, of their terms
LEAST_STEP = 1e-3  # of a step's own length: what indicators do in less may be rounding, and so no crossing


@inline
def degree_of(form):
    """The degree of a step's polynomials."""
    return 5 if form.method == place.RKF45 else form.order


@local
def jets_of(form, work):
    """The jets at the present instant."""
    return work.J0 if form.method == place.RKF45 else work.C


@device
def polished(form, work, row, t, h, tau):
    """A zero of the interpolated indicator ``row``, moved to the zero of the indicator of the dense state.

    ``t`` and ``h`` are begin and length of the step. Where Newton's method does not get there the interpolated one
    stands, which has the error of the step."""
    C, n = work.C, work.w.shape[0]
    values = values_of(form)
    m = degree_of(form)
    at = tau
    for _ in range(12):
        dense_states(C, m, n, at, work.dense)
        values(work.tally[MODE], t + at, work.dense, work.q, work.vals)
        slope = 0.0
        for k in range(m, 0, -1):
            slope = slope * at + k * C[n + row, k]
        if slope == 0.0:
            break
        move = work.vals[row] / slope
        if not (fabs(at - move - tau) <= 1e-3 * h and 0.0 <= at - move <= h):
            break
        at -= move
        if fabs(move) <= 1e-8 * h:  # the next move would be its square
            return at
    return tau


@once
def judged_at_end(mode, X, n, n_indicators, net, work):
    """Without location: the transition whose rows hold at the end of the step and did not at its beginning, or -1."""
    side, side_before = work.side, work.side_next
    for i in range(n_indicators):
        side_before[i] = side[i]
        side[i] = 1 if X[n + i, 0] > 0.0 else (-1 if X[n + i, 0] < 0.0 else 0)
    for j in range(net.mode_start[mode], net.mode_start[mode + 1]):
        k = net.mode_list[j]
        if rows_hold(k, net, side) and not rows_hold(k, net, side_before):
            return k
    return -1


@device
def at_end(C, m, row, h):
    """Value and slope of a row at the end of a part of the step."""
    v, slope = C[row, m], 0.0
    for k in range(m - 1, -1, -1):
        slope = slope * h + v
        v = v * h + C[row, k]
    return v, slope


@once
def planned_length(mode, form, J, log_rtol, work):
    """The length of the next step, before stops and crossings in sight shorten it."""
    n = work.w.shape[0]
    if form.step > 0.0:
        return form.step
    if form.method == place.RKF45:
        return work.usual[mode] if work.usual[mode] > 0.0 else first_step(J, work.w, n, form.absolute, form.rtol)
    return step_length(J, form.order, n, form.indicators, work.w, form.weight, work.scale, log_rtol)


@inline
def log_tolerance(form):
    """Logarithm of what the last terms of a series may be."""
    return ln(max(0.1 * form.rtol, 1e-16))


@once
def length_of_step(i, form, net, work, r_max):
    """The length of the next step, before crossings in sight shorten it; -1: there is none."""
    tally, memo, rkf, J = work.tally, work.memo, form.method == place.RKF45, jets_of(form, work)
    n, mode, t = work.w.shape[0], tally[MODE], memo[TIME]
    if tally[place.READY] == 0:
        jet = jet_of(form)
        jet(mode, 2 if rkf else form.order, t, work.w, work.q, J, work.W)
        for j in range(form.indicators):
            work.scale[j] = max(work.scale[j], fabs(J[n + j, 0]))
        if tally[place.ZERO_ROW] >= 0:
            J[n + tally[place.ZERO_ROW], 0] = 0.0
            work.side[tally[place.ZERO_ROW]] = 0
            tally[place.ZERO_ROW] = -1
        tally[place.READY] = 1
    h = planned_length(mode, form, J, log_tolerance(form), work)
    if not (h > 1e-16 * t):
        return -1.0
    if form.period[i] < NO_END:
        h = min(h, form.period[i])
    elif h >= NO_END and r_max >= NO_END:  # a polynomial solution: any length is right
        h = max(1.0, memo[WAITED])
    memo[place.PLANNED] = h
    if rkf and form.step <= 0.0 and work.dwell[mode] < 2.0 * h:  # a mode that was left soon the last time
        h = max(LEAST_STEP * h, min(h, 1.1 * time_to_transition(mode, work.J0, n, net, h)))
    tally[place.LANDING] = 0
    if h >= r_max * (1.0 - 1e-13):
        h = r_max
        tally[place.LANDING] = 1
    elif form.step <= 0.0 and h > 0.5 * r_max:
        h = 0.5 * r_max
    return h


@once
def between(mode, t, h, n, form, work):
    """The square of the largest error of the indicators' quintics in the middle of a step, over the tolerance.

    What time itself moves, a load on a mass that sticks or a wall, is not seen by the states' error."""
    J0, J1, dense, vals, worst, j = work.J0, work.J1, work.dense, work.vals, 0.0, 0
    while True:
        dense[j] = middle(J0, J1, j, h)
        j += 1
        if j >= n:
            break
    values = values_of(form)
    values(mode, t + 0.5 * h, dense, work.q, vals)
    for i in range(form.indicators):
        row = n + i
        if J0[row, 0] != 0.0 or J0[row, 1] != 0.0 or J1[row, 0] != 0.0:  # else not asked, or kept at zero
            size = max(
                work.scale[i], fabs(J1[row, 0]), h * fabs(J0[row, 1]), h * fabs(J1[row, 1]), h * h * fabs(J0[row, 2])
            )
            size *= BETWEEN * form.rtol
            worst = max(worst, fabs(vals[i] - middle(J0, J1, row, h)) / size if size > 0.0 else 0.0)
    return worst * worst


@once
def runge_kutta(form, work, h, shortest):
    """A Runge-Kutta step of length h or less, whose error is small enough: (length, error); a length of -1: none."""
    mode, t, n, error, K = work.tally[MODE], work.memo[TIME], work.w.shape[0], 0.0, work.K
    field = field_of(form)
    j = 0
    while True:
        K[0][j] = work.J0[j, 1]
        j += 1
        if j >= n:
            break
    jet = jet_of(form)
    aside = inf
    while True:
        error = stages(field, mode, t, work.w, work.q, h, n, K, form.step <= 0.0, form.absolute, form.rtol)
        if form.step > 0.0 or error <= 1.0:
            jet(mode, 2, t + h, K[7], work.q, work.J1, work.W)
            missed = between(mode, t, h, n, form, work) if form.step <= 0.0 else 0.0
            # What does not fall with the step is rounding, and so is what happens in one as short as the clock's own.
            if not 1.0 < missed < 0.5 * aside or h <= 1e6 * shortest:
                return h, max(error, missed) if missed <= 1.0 else error
            error = aside = missed
        h *= max(0.2, 0.9 * error**-0.1) if error < inf else 0.1
        work.memo[place.PLANNED], work.tally[place.LANDING] = h, 0
        if not (h > shortest):
            return -1.0, error


@inline
def forget_signs(n, side):
    """No signs are known. (Written so that the compiler does not prepare the loop for many.)"""
    j = 0
    while n > 0:
        side[j] = 0
        j += 1
        if j >= n:
            break


@once
def make_step(i, form, net, section, wanted, work, r_max):
    """A step and its first transition, into ``work``; False where there is none (the motion has left every bound)."""
    tally, memo, rkf = work.tally, work.memo, form.method == place.RKF45
    mode, t, n, fixed = tally[MODE], memo[TIME], work.w.shape[0], form.step
    degree, n_i = degree_of(form), form.indicators
    checked = form.checked == 1 and not rkf and fixed <= 0.0
    tail = 0.0 if rkf else 1.0
    h = length_of_step(i, form, net, work, r_max)
    pending, hit, x, calm, halvings, error, sure = -1, -1, NONE, False, 0, 0.0, 0.0
    if h < 0.0:
        return False
    least = 1e-16 * t + 1e-30 * h
    for j in range(n_i):
        work.measured[j] = 0.0  # what an instant has shown of rounding is for all that follows at that instant
    while True:
        if rkf:
            h, error = runge_kutta(form, work, h, 1e-16 * t)
            if h < 0.0:
                return False
        forget_signs(n_i, work.side_next)
        slack = form.rtol if rkf and fixed <= 0.0 else 0.0
        if rkf:
            calm = form.locate == 0 or quiet(mode, n, h, slack, net, section, work)
            if calm and not wanted:
                break
            hermite(work.J0, work.J1, work.C.shape[0] - form.guards, h, work.C)
            slack *= sqrt(error)
        fill_powers(h, degree, work.powers)
        if calm:
            break
        if form.locate == 1:
            work.found[0] = 0
            forget_signs(n_i, work.side_next)
            x, pending, hit = earliest(mode, degree, n, net, tail, slack, work)
            if work.found[0] == 1 and fixed <= 0.0 and halvings < place.HALVINGS:
                h *= 0.5  # a graze nearer than the polynomial is sure of
                tally[place.LANDING] = 0
                halvings += 1
                continue
            if work.found[0] == 1:
                tally[place.DOUBTFUL] = 1
        if not checked or h <= sure:
            break
        whole = x * h if pending >= 0 else h
        sure = trusted(form, work, h, whole)
        if sure >= whole:
            break
        h, tally[place.LANDING] = sure, 0
        if not (h > least):
            return False
    part = h
    if pending >= 0:
        part = x * h
        tally[place.LANDING] = 0
        part = polished(form, work, net.rows[hit, 0], t, h, part)
    if rkf:
        growth = min(5.0, 0.9 * float32(error) ** float32(-0.1)) if error > 1e-30 else 5.0
        work.usual[mode] = growth * h if growth < 1.0 else max(memo[place.PLANNED], growth * h)
    tally[place.PENDING], tally[place.HIT] = pending, net.rows[hit, 0] if pending >= 0 else -1
    tally[place.CALM] = 1 if calm else 0
    memo[place.BASE], memo[place.LENGTH], memo[place.PART], memo[place.CURSOR] = t, h, part, 0.0
    tally[place.STEPS] += 1
    return True
