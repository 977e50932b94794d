"""The stepper of the series methods at one instant: parameters, jets and after-limits, conditions, jumps."""

from math import fabs, inf

import nonsmooth.kernels.hybrid.codes as place
from nonsmooth.kernels.compile.cache import device, inline, once
from nonsmooth.kernels.hybrid.codes import MODE, TIME
from nonsmooth.kernels.series.crossing import NOISE, OFF, rows_hold, snap
from nonsmooth.kernels.series.generated import jet_of, jump_of, values_of
from nonsmooth.kernels.series.rkf45 import first_step
from nonsmooth.kernels.series.step import jets_of, log_tolerance
from nonsmooth.kernels.series.taylor import step_length

TOGETHER = 1e-11  # of its scale: an indicator so near to zero vanishes at the instant of another
ON_SURFACE = 1e-13  # of its scale: an indicator that stays smaller over a step has not left its surface


@once
def prepare(i, form, motion, tables, work):
    """Parameters of point i, and where the motion is."""
    n_p = form.points.shape[1]
    for j in range(n_p):
        work.q[j] = form.points[i, j]
    for j in range(motion.memory.shape[0]):
        work.q[n_p + j] = motion.memory[j]
    for j in range(motion.u.shape[0]):
        work.w[j] = motion.u[j]
    for j in range(form.indicators):
        work.scale[j], work.measured[j], work.side[j] = 0.0, 0.0, 0
    for j in range(work.rise.shape[0]):
        work.rise[j] = 0
    for j in range(work.usual.shape[0]):
        work.usual[j], work.dwell[j] = 0.0, 0.0
    work.tally[place.ZERO_ROW] = -1


@device
def look(i, form, tables, work, mode):
    """Jets and after-limits at a start or after a jump."""
    t, u, q, scale = work.memo[TIME], work.w, work.q, work.scale
    n, n_indicators = u.shape[0], form.indicators
    X = jets_of(form, work)
    m = 4 if form.method == place.RKF45 else form.order
    jet = jet_of(form)
    for j in range(n):  # no two by the same, so that no terms stay equal
        work.end[j] = u[j] * (1.0 + OFF * (1.0 + j / n) * (1 - 2 * (j % 2)))
    jet(mode, 2, t * (1.0 + 0.7 * OFF), work.end, q, work.J1, work.W)
    jet(mode, m, t, u, q, X, work.W)
    h = work.usual[mode]
    if form.step > 0.0:
        h = form.step
    elif form.method == place.RKF45:
        if h <= 0.0:
            h = first_step(X, u, n, form.absolute, form.rtol)
    else:
        h = step_length(X, m, n, n_indicators, u, form.weight, scale, log_tolerance(form))
    if not (h < inf):
        h = 1.0
    for j in range(n_indicators):
        if scale[j] == 0.0:  # the slope of a speed is mere rounding where a stick ends
            scale[j] = max(fabs(X[n + j, 0]), fabs(X[n + j, 1]) * h, fabs(X[n + j, 2]) * h * h)
    snap(X, m, n, n_indicators, h, scale, work.measured, work.J1, work.side)
    for j in range(n_indicators):
        scale[j] = max(scale[j], fabs(X[n + j, 0]))
    work.tally[place.READY] = 1


@once
def start_on_section(form, section, tables, work):
    """A start on the section is no return, nor is a carried state left there."""
    J = jets_of(form, work)
    s = section.indicator
    work.tally[place.STAYS] = 1 if work.side[s] == 0 else 0
    if fabs(J[work.w.shape[0] + s, 0]) <= 1e-9 * work.scale[s]:
        J[work.w.shape[0] + s, 0] = 0.0
        work.side[s] = 0


@inline
def holds(t, mode, tables, net, work):
    """Return whether all rows of transition t hold just after the present instant."""
    return rows_hold(t, net, work.side)


@once
def lies_beyond(t, form, net, work):
    """Return whether no indicator of transition t is zero at the present instant."""
    J = jets_of(form, work)
    beyond = True
    for r in range(net.row_start[t], net.row_start[t + 1]):
        beyond = beyond and J[work.w.shape[0] + net.rows[r, 0], 0] != 0.0
    return beyond


@once
def take(i, t, fired, form, tables, net, work):
    """Take transition t (its indicator ``fired`` has just crossed; -1: none). Returns the new mode.

    ``work.wp`` keeps the state just before."""
    w, q, time = work.w, work.q, work.memo[TIME]
    if fired >= 0:
        values = values_of(form)
        values(work.tally[MODE], time, w, q, work.vals)
        work.measured[fired] = fabs(work.vals[fired])
    jump = jump_of(form)
    jump(net.transitions[t, 3], time, w, q, work.end, work.q_new)
    for j in range(w.shape[0]):
        work.wp[j] = w[j]
        w[j] = work.end[j]
    for j in range(q.shape[0]):
        q[j] = work.q_new[j]
    mode = net.transitions[t, 0]
    look(i, form, tables, work, mode)
    if net.meets.shape[0] > 0:
        J = work.J0 if form.method == place.RKF45 else work.C
        for j in range(form.indicators):
            work.vals[j] = J[w.shape[0] + j, 0]
    if fired >= 0 and work.usual[mode] <= 0.0:
        work.usual[mode] = work.memo[place.PLANNED]
    for j in range(work.rise.shape[0]):
        work.rise[j] = 0
    return mode


@once
def meets_another(mode, fired, own, net, tables, work):
    """Return whether an indicator vanishes at the present instant that is asked for with others, but for the one that
    fired and that of the transition which is to be taken (``own``)."""
    found = False
    for k in range(net.meets_start[mode], net.meets_start[mode + 1]):
        f = net.meets[k]
        if f != fired and f != own and fabs(work.vals[f]) <= TOGETHER * work.scale[f]:
            found = True
            break
    return found


@once
def met(t, fired, form, net, section, tables, work):
    """Return whether a transition at this instant also passes the section: its indicator was zero before the jump.

    The direction may be that of the arrival or, where the indicator stays zero, of the departure (an impact does
    both). A motion that comes along the surface, as one that slides, does not pass it."""
    J = jets_of(form, work)
    row = work.w.shape[0] + section.indicator
    noise, way = NOISE * work.scale[section.indicator], section.rising
    slope = work.memo[place.SLOPE_BEFORE]
    along = fabs(slope) * work.memo[place.LENGTH] <= ON_SURFACE * work.scale[section.indicator]
    if fabs(work.memo[place.VALUE_BEFORE]) > noise or along or work.tally[place.STAYS] == 1:
        return 0
    if way == 0 or slope * way > 0.0:
        return 1
    return 1 if fabs(J[row, 0]) <= noise and work.side[section.indicator] * way > 0 else 0
