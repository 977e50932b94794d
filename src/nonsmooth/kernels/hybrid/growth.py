"""Observer of small changes along a trajectory of the exact flow: what Lyapunov exponents are.

A segment multiplies the frame by exp(A tau), from the tables of the segment itself; transitions by their saltation
(``frame.saltation``). The frame is made orthonormal again after each, and what is divided out is multiplied up.
"""

from math import fabs, inf, sqrt

from numba import types

from nonsmooth.kernels.compile.cache import inline, kernel, once
from nonsmooth.kernels.hybrid.codes import OK, PAUSED
from nonsmooth.kernels.hybrid.loop import leave, march
from nonsmooth.kernels.hybrid.places import DONE, JUMPS, MODE, NO_END, PERIODS, RETURNS, TIME, WAITED
from nonsmooth.kernels.hybrid.records import GOAL, GROWTH, MOTION, NET, SECTION
from nonsmooth.kernels.linear.bands import carry
from nonsmooth.kernels.linear.stepper import STEPPER
from nonsmooth.kernels.linear.tables import BANDED, DEGREE, HARMONICS, NODES, STATES, WAVE, M
from nonsmooth.kernels.linear.values import slope_of
from nonsmooth.kernels.tangent.frame import log_determinant, multiply, saltation, straighten

OPEN_RUN, CLOSED = 0, 2


@once
def open_window(i, form, section, seen, tables, work):
    """Units of time count from here (``RETURNS`` of them; where in the period the run began: ``WAITED``), and periods
    with them."""
    work.memo[PERIODS] = 0.0
    work.memo[WAITED] = work.memo[TIME]
    for c in range(STATES):
        seen.lengths[c] = 1.0


@once
def reached(goal, work):
    """Return whether the run is over."""
    return work.tally[RETURNS] >= goal.keep


@once
def room(seen, work):
    """Nothing is logged."""
    return OK


@once
def remaining(section, goal, work):
    """Time to the end of the unit (rounding may have passed it)."""
    return max((work.tally[RETURNS] + 1) * goal.unit - work.memo[DONE], 0.0)


@once
def observe(i, step, stop, triggered, form, net, section, goal, seen, tables, work):
    """Carry the frame over the segment: X = exp(A tau), from the nearest node and the Taylor rows of the states.

    (Of many states with few entries by its columns' own series.)"""
    prop, tay, X, scale = tables.prop, tables.tay, seen.step, seen.scale
    mode, n_i = work.tally[MODE], work.zero.shape[0]
    for r in range(STATES):
        seen.sums[0] += tables.field[mode, r, r] * step
    if BANDED:
        if tables.lines[mode, 0, 0] > 0:
            carry(tables, work, mode, step / tables.info[mode, 0], scale, seen.frame)
            return OPEN_RUN
    spacing, full = tables.info[mode, 1], step == tables.info[mode, 0]
    node = NODES if full else min(int(step / spacing + 0.5), NODES)
    local = step - node * spacing
    for r in range(STATES):
        for c in range(STATES):
            X[r, c] = prop[mode, node, c, r] if full else 0.0
    if not full:
        for r in range(STATES):
            for q in range(STATES):
                a = 0.0
                for k in range(DEGREE, -1, -1):
                    a = a * local + tay[mode, n_i + r, q, k]
                for c in range(STATES):
                    X[r, c] += a * prop[mode, node, c, q]
    for r in range(STATES):
        for c in range(STATES):
            X[r, c] *= scale[c] / scale[r]
    multiply(X, seen.frame, STATES, STATES, seen.scratch)
    return OPEN_RUN


@once
def mark(i, wrapped, ended, crossed, step, form, goal, seen, work):
    """The time at the end of a segment, on the clock of the forcing: sums of steps would drift away from it."""
    tally, memo, T = work.tally, work.memo, form.period[i]
    if ended:
        tally[RETURNS] += 1
        tally[JUMPS] = 0
        memo[DONE] = tally[RETURNS] * goal.unit
    else:
        memo[DONE] = memo[PERIODS] * T + memo[TIME] - memo[WAITED] if T < NO_END else memo[DONE] + step
    if not crossed:
        unit = tally[RETURNS] - 1 if ended else tally[RETURNS]
        straighten(seen.frame, STATES, STATES, seen.lengths, False, ended, seen.growth[unit])


@inline
def slope_along(field, mode, w, out):
    """The vector field at w."""
    for r in range(STATES):
        total = 0.0
        for j in range(M):
            total += field[mode, r, j] * w[j]
        out[r] = total


@once
def approach(mode, fired, seen, tables, work):
    """Derivative of the instant of a crossing in the state, and how steeply the surface is met."""
    t_z, S, f = seen.t_z, seen.step, seen.fields
    slope_along(tables.field, mode, work.w, f[0])
    for r in range(STATES):
        t_z[r] = 0.0
        for c in range(STATES):
            S[r, c] = 1.0 if r == c else 0.0
    if fired >= 0:
        rate = slope_of(tables, mode, fired, work.w)
        across, speed = 0.0, 0.0
        for j in range(STATES):
            h = tables.fun[mode, fired, j]
            t_z[j] = -h / rate
            across += h * h
            speed += f[0, j] * f[0, j]
        if across * speed > 0.0:
            seen.sums[3] = min(seen.sums[3], fabs(rate) / sqrt(across * speed))


@once
def cross(i, t, mode, jumps, form, net, section, goal, seen, tables, work):
    """Saltation of a transition, from the mode in which it was taken to ``mode``."""
    before, f, R = work.wp, seen.fields, seen.reset
    slope_along(tables.field, work.tally[MODE], before, f[0])
    slope_along(tables.field, mode, work.w, f[1])
    for r in range(STATES):
        f[2, r] = 0.0
        for c in range(STATES):
            R[r, c] = 1.0 if r == c else 0.0
        if net.transitions[t, 1] != 0:
            m = net.transitions[t, 3]
            for c in range(STATES):
                R[r, c] = form.ra[i, m, r, c]
            for h in range(HARMONICS):
                f[2, r] += work.rates[h] * (
                    form.rs[i, m, h, r] * before[WAVE + 2 * h] - form.rc[i, m, h, r] * before[WAVE + 1 + 2 * h]
                )
    saltation(R, f[2], f[0], f[1], seen.t_z, STATES, seen.step, seen.matrix)


@once
def depart(jumps, seen, work):
    """The transitions of one instant act on the frame."""
    S, scale = seen.step, seen.scale
    for r in range(STATES):
        for c in range(STATES):
            S[r, c] *= scale[c] / scale[r]
    size = log_determinant(S, STATES, seen.matrix)
    seen.sums[1] += size
    seen.sums[2] += jumps
    multiply(S, seen.frame, STATES, STATES, seen.scratch)
    straighten(seen.frame, STATES, STATES, seen.lengths, size == -inf, False, seen.growth[work.tally[RETURNS]])


@kernel(types.int64(types.int64, STEPPER[0], NET, SECTION, GOAL, MOTION, GROWTH, STEPPER[1], STEPPER[2]))
def grow(i, form, net, section, goal, motion, seen, tables, work):
    """Point i for ``goal.keep`` units of time with the frame. Returns a status: PAUSED asks to be called again."""
    code = march(i, form, net, section, goal, motion, seen, tables, work)
    if code != PAUSED:
        leave(i, form, motion, work)
    return code
