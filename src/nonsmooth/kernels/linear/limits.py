"""Just after an instant: which conditions hold there, by limits, and where a transition puts the motion."""

from math import fabs

from nonsmooth.kernels.compile.cache import device, inline, once
from nonsmooth.kernels.hybrid.codes import ANOTHER, LONGEST_STEP, MODE, TIME
from nonsmooth.kernels.linear.sums import at, dot
from nonsmooth.kernels.linear.tables import STATES, sizes_at, states_of, width_of
from nonsmooth.kernels.linear.values import EPS, noise, rounding, slope_of, value_of

TOGETHER = 1e-11 / (16.0 * EPS)  # in units of rounding: of one instant
THROUGHOUT = 5  # in ``work.zero``: the indicator and all its derivatives vanish


@inline
def flat(tables, mode, f, w, work):
    """Return whether the slope of functional f is zero within rounding at w, and of the step that led there."""
    n, m = states_of(tables.field), width_of(tables.field)
    slope = fabs(slope_of(tables, mode, f, w))
    near = rounding(tables, mode, f, m, w)
    if slope > near and slope < 1e-9:
        bend = 0.0
        for j in range(m):
            bend += fabs(tables.tay[mode, f, j, 2]) * (fabs(w[j]) if j <= n else 1.0)
        step = tables.info[mode, 0] if m > n + 1 else min(tables.info[mode, 0], work.memo[TIME])
        near += 8.0 * EPS * step * bend
    return slope <= near


@device
def vanishing(tables, mode, f, w):
    """(k, sign): the first derivative of functional f from the second on that is not zero within rounding at w.

    Of those up to the fourth; (THROUGHOUT, 0) where they vanish all. A harmonic's rounding is that of its phase,
    whatever its value: a force that presses may be nothing else."""
    n, m = states_of(tables.field), width_of(tables.field)
    tay = tables.tay
    for k in range(2, 5):
        total = tay[mode, f, n, k]
        size = fabs(total)
        for j in range(m):
            if j != n:
                total += tay[mode, f, j, k] * w[j]
                size += fabs(tay[mode, f, j, k]) * (fabs(w[j]) if j <= n else 1.0)
        if fabs(total) > 64.0 * EPS * size:
            return k, 1 if total > 0.0 else -1
    return THROUGHOUT, 0


@inline
def mark_zeros(tables, work, mode, fired):
    """Of each indicator, how many of its value, slope and further derivatives vanish within rounding at w.

    The value of ``fired`` does, behind ``ANOTHER`` transition of the instant that of all that were zero there, unless
    it has moved from ``work.wp``, as behind a reset, or is another quantity here. How large rounding is depends on the
    mode: by that alone two modes could send the motion back and forth. Two where a stick ends, three where a contact
    lifts off: what is rounding there must not decide. At a crossing w carries the rounding of the step that led there:
    it decides where an indicator has no constant part, such as that of a stop at x = 0."""
    n, m = states_of(tables.field), width_of(tables.field)
    w, zero, fun, memo, sizes = work.w, work.zero, tables.fun, work.memo, sizes_at(n, m)
    step = max(memo[LONGEST_STEP], tables.info[mode, 0])
    memo[LONGEST_STEP] = step
    largest = 1.0
    for r in range(n):
        largest = max(largest, fabs(w[r]))
    most = 17.0 * EPS * largest  # noise is below this with every state as large as the largest
    for f in range(zero.shape[0]):
        known, found = f == fired or (fired == ANOTHER and zero[f] != 0), False
        if known or fun[mode, f, sizes] >= 0.0:  # else it is not asked for in this mode
            value = fabs(value_of(tables, mode, f, w))
            found = known and value <= 2.0 * fabs(value_of(tables, work.tally[MODE], f, work.wp))
            if not found and value <= most * (fun[mode, f, sizes] + 0.25 * step * fun[mode, f, sizes + 1]):
                found = value <= noise(tables, mode, f, step, w)
        zero[f] = 1 if found else 0
        if found and flat(tables, mode, f, w, work):
            zero[f], _ = vanishing(tables, mode, f, w)


@inline
def pass_on(tables, work, mode):
    """Of what was known to be zero just before the present instant, keep what is so throughout."""
    zero = work.zero
    for f in range(zero.shape[0]):
        stays = zero[f] == THROUGHOUT
        if stays:
            stays = fabs(value_of(tables, mode, f, work.w)) <= noise(tables, mode, f, tables.info[mode, 0], work.w)
            stays = stays and flat(tables, mode, f, work.w, work) and vanishing(tables, mode, f, work.w)[1] == 0
        zero[f] = THROUGHOUT if stays else 0


@inline
def sign_after(tables, work, mode, f):
    """Sign (-1, 0, 1) of functional f just after w along the mode: its value's, or its first non-zero derivative's."""
    w, zero = work.w, work.zero
    if f >= zero.shape[0] or zero[f] == 0:
        return 1 if value_of(tables, mode, f, w) > 0.0 else -1
    if zero[f] == 1:
        return 1 if slope_of(tables, mode, f, w) > 0.0 else -1
    _, sign = vanishing(tables, mode, f, w)
    return sign


@inline
def holds(t, mode, tables, net, work):
    """Return whether all rows of transition t hold just after the present instant."""
    rows = net.rows
    lo = net.row_start[t]
    hi = net.row_start[t + 1]
    holds = lo < hi
    for r in range(lo, hi):
        sign = sign_after(tables, work, mode, rows[r, 0]) * rows[r, 1]
        if sign < 0 or (sign == 0 and rows[r, 2] != 0):
            holds = False
            break
    return holds


@once
def meets_another(mode, fired, own, net, tables, work):
    """Return whether a functional vanishes at the present instant that is asked for with others, but for the one that
    fired and that of the transition which is to be taken (``own``)."""
    found, w, step = False, work.w, tables.info[mode, 0]
    for k in range(net.meets_start[mode], net.meets_start[mode + 1]):
        f = net.meets[k]
        if f != fired and f != own:
            if fabs(value_of(tables, mode, f, w)) <= TOGETHER * noise(tables, mode, f, step, w):
                found = True
                break
    return found


@once
def lies_beyond(t, form, net, work):
    """Return whether no indicator of transition t is zero at the present instant."""
    beyond = True
    for r in range(net.row_start[t], net.row_start[t + 1]):
        beyond = beyond and work.zero[net.rows[r, 0]] == 0
    return beyond


@inline
def look(i, form, tables, work, mode):
    """Prepare to judge the conditions just after the present instant."""
    mark_zeros(tables, work, mode, -1)


@inline
def mapped(n, i, map_, r, form, w):
    """State r of n behind a map."""
    total = form.rb[i, map_, r]
    if STATES == 0:
        total += dot(at(form.ra, ((i * form.ra.shape[1] + map_) * n + r) * n), at(w, 0), n)
    else:
        for j in range(n):
            total += form.ra[i, map_, r, j] * w[j]
    for h in range(form.rc.shape[2]):
        total += form.rc[i, map_, h, r] * w[n + 1 + 2 * h] + form.rs[i, map_, h, r] * w[n + 2 + 2 * h]
    return total


@inline
def apply_map(i, t, form, net, tables, work):
    """The states behind transition t, into w; where they may be many only those that it changes are looked at."""
    n, w, wn, map_ = states_of(tables.field), work.w, work.wn, net.transitions[t, 3]
    if STATES == 0:
        for q in range(1, net.changed[map_, 0] + 1):
            wn[net.changed[map_, q]] = mapped(n, i, map_, net.changed[map_, q], form, w)
        for q in range(1, net.changed[map_, 0] + 1):
            w[net.changed[map_, q]] = wn[net.changed[map_, q]]
    else:
        for r in range(n):
            wn[r] = mapped(n, i, map_, r, form, w)
        for r in range(n):
            w[r] = wn[r]


@inline
def take(i, t, fired, form, tables, net, work):
    """Take transition t (its functional ``fired`` has just crossed; -1: a time trigger). Returns the new mode.

    ``work.wp`` keeps w just before."""
    w, wp = work.w, work.wp
    for j in range(width_of(tables.field)):
        wp[j] = w[j]
    if net.transitions[t, 1] != 0:
        apply_map(i, t, form, net, tables, work)
    mark_zeros(tables, work, net.transitions[t, 0], fired)
    return net.transitions[t, 0]
