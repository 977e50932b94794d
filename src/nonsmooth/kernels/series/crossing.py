"""The first transition inside one step, and how conditions are judged just after a jump.

``net`` is ``records.Net``; its last two rows are a section's and not looked at here.

A transition fires where the least of its rows rises through zero. The sign of an indicator is remembered from step to
step (``side``: -1, 1, or 0 where nothing was established), so that no change falls between two steps.
"""

from math import fabs, inf, sqrt

from nonsmooth.kernels.compile.cache import device, inline
from nonsmooth.kernels.series.polynomial import NONE, UP, bounds, dense, first_crossing, load, row_bounds, shift, strip

NOISE = 3.6e-15  # 16 roundings: an indicator this small against its own scale is zero
OFF = 1e-7  # of the time and the states, to see of what size the terms of an indicator are


@device
def snap(C, m, n, n_indicators, h, scale, measured, near, side):
    """After-limits: set what is zero within rounding to zero in the jets of the indicators, and find their signs.

    ``side`` becomes the sign of the first coefficient that does not vanish (0: the indicator vanishes identically).
    ``measured`` is the size of indicators known to be zero here, their rounding error, seen; -1 of those known not to
    be. Others share its relative size: where a stick ends, the speed begins with a slope that is the indicator that
    ended it. ``near`` are the first coefficients with all that they are computed from off by about ``OFF``, which shows
    the size of their terms.
    """
    seen = 0.0
    for i in range(n_indicators):
        if scale[i] > 0.0:
            seen = max(seen, measured[i] / scale[i])
    for i in range(n_indicators):
        noise = max(NOISE * scale[i], 4.0 * measured[i], 16.0 * min(seen, 1e-12) * scale[i])
        sign, power = 0, 1.0
        for k in range(3):
            terms = fabs(near[n + i, k] - C[n + i, k]) * h**k / OFF
            noise = max(noise, NOISE * terms) if terms < inf else noise
        for k in range(m + 1):
            c = C[n + i, k]
            if fabs(c) * power > noise or (k == 0 and measured[i] < 0.0):
                sign = 1 if c > 0.0 else -1
                break
            C[n + i, k] = 0.0
            power *= h
        side[i] = sign


@inline
def rows_hold(k, net, side):
    """Return whether all rows of transition k hold by the signs ``side``."""
    for r in range(net.row_start[k], net.row_start[k + 1]):
        s = net.rows[r, 1] * side[net.rows[r, 0]]
        if s < 0 or (s == 0 and net.rows[r, 2] == 1):
            return False
    return net.row_start[k + 1] > net.row_start[k]


@inline
def _error(C, row, m, powers, tail, slack, scale):
    """Bound for what the polynomial lacks: its last terms, or the step's own error estimate; 0 where it is rounding."""
    error = tail * (fabs(C[row, m]) * powers[m] + 0.1 * fabs(C[row, m - 1]) * powers[m - 1]) + slack * scale
    return error if error > NOISE * scale else 0.0


@device
def _others_hold(r0, lo, hi, x, m, n, rows, work):
    """Return whether the other rows hold where row r0 crosses; one that vanishes there is judged by what follows."""
    C, powers, scale, a, d = work.C, work.powers, work.scale, work.a, work.d
    i0 = rows[r0, 0]
    m0 = load(C, n + i0, float(rows[r0, 1]), m, powers, a)
    shift(a, m0, x, 1.0, d)
    noise = NOISE * scale[i0]
    doubt = 1e-15 + noise / (fabs(d[1]) + sqrt(noise * (fabs(d[2]) + noise)) + 1e-300)  # of x itself
    for r in range(lo, hi):
        if r == r0:
            continue
        i = rows[r, 0]
        mr = load(C, n + i, float(rows[r, 1]), m, powers, a)
        v = dense(a, mr, x)
        noise = NOISE * scale[i]
        if v > 1.0e3 * noise + doubt * scale[i]:
            continue
        shift(a, mr, x, 1.0, d)
        if v > noise + doubt * fabs(d[1]):
            continue
        if v < -(noise + doubt * fabs(d[1])):
            return False
        sign = 0
        for k in range(1, mr + 1):
            if fabs(d[k]) > noise:
                sign = 1 if d[k] > 0.0 else -1
                break
        if sign < 0 or (sign == 0 and rows[r, 2] == 1):
            return False
    return True


@device
def _fires(lo, hi, m, n, rows, tail, slack, work):
    """Find where the conjunction of rows lo..hi-1 first becomes true on the step, and the row that makes it so."""
    C, powers, scale, a, found = work.C, work.powers, work.scale, work.a, work.found
    cursor, begun = 0.0, False
    for _ in range(64):
        best, best_row = NONE, lo
        for r in range(lo, hi):
            i, sign = rows[r, 0], rows[r, 1]
            mr = load(C, n + i, float(sign), m, powers, a)
            error = _error(C, n + i, m, powers, tail, slack, scale[i])
            before = 0 if begun else sign * work.side[i]
            if begun:
                shift(a, mr, cursor, 1.0 - cursor, a)
                if fabs(a[0]) <= NOISE * scale[i]:
                    a[0] = 0.0
            mr = strip(a, mr)
            if mr < 0:
                continue
            x = first_crossing(a, mr, UP, before, error, work.stack, found)
            work.side_next[i] = sign * found[1]
            if x != NONE and cursor + x * (1.0 - cursor) < best:
                best, best_row = cursor + x * (1.0 - cursor), r
        if best == NONE:
            return NONE, -1
        if hi - lo == 1 or _others_hold(best_row, lo, hi, best, m, n, rows, work):
            return best, best_row
        if best >= 1.0:
            work.side_next[rows[best_row, 0]] = rows[best_row, 1]
            return NONE, -1
        cursor, begun = best, True
    found[0] = 1  # too many crossings on one step: it is halved, or said to be not guaranteed
    return NONE, -1


@inline
def earliest(mode, m, n, net, tail, slack, work):
    """(x, transition, row): the first transition out of ``mode`` on the step, at the fraction x of it; x = NONE: none.

    The step's polynomials of degree m stand in ``work.C``, in its rows from n on. A transition is out of the question
    as soon as one of its rows is certainly <= 0 throughout. Where two fire together, the one declared first is taken.
    """
    C, powers, a, rows = work.C, work.powers, work.a, net.rows
    best, which, hit = NONE, -1, -1
    for j in range(net.mode_start[mode], net.mode_start[mode + 1]):
        k = net.mode_list[j]
        lo, hi = net.row_start[k], net.row_start[k + 1]
        dead, opened, row = False, 0, lo
        for r in range(lo, hi):
            i, sign = rows[r, 0], rows[r, 1]
            a0, low, high = row_bounds(C, n + i, float(sign), m, powers)
            error = _error(C, n + i, m, powers, tail, slack, work.scale[i])
            if a0 == 0.0:  # after a jump: decided by the coefficients that follow
                mr = strip(a, load(C, n + i, float(sign), m, powers, a))
                if mr < 0:
                    if rows[r, 2] == 1:
                        dead = True
                        break
                    continue
                low, high = bounds(a, mr)
            if high + error <= 0.0:
                work.side_next[i] = -sign
                dead = True
                break
            if low - error > 0.0 and sign * work.side[i] >= 0:
                work.side_next[i] = sign
            else:
                opened, row = opened + 1, r
        if dead or opened == 0:
            continue
        if opened == 1:  # the others hold throughout: it fires at the first rise of this one
            lo, hi = row, row + 1
        x, r = _fires(lo, hi, m, n, rows, tail, slack, work)
        if x < best * (1.0 - 1e-14):
            best, which, hit = x, k, r
    return best, which, hit


@device
def section_crossing(C, row, m, way, before, cursor, powers, scale, a, stack, found):
    """The next x > cursor (fraction of the step) where a row changes sign in the direction ``way``, or NONE."""
    mr = load(C, row, 1.0, m, powers, a)
    if cursor > 0.0:
        shift(a, mr, cursor, 1.0 - cursor, a)
        if fabs(a[0]) <= NOISE * scale:
            a[0] = 0.0
        before = 0
    mr = strip(a, mr)
    if mr < 0:
        found[1] = 0
        return NONE
    x = first_crossing(a, mr, way, before, 0.0, stack, found)
    return NONE if x == NONE else cursor + x * (1.0 - cursor)


@device
def sides_at(C, m, n, n_indicators, x, powers, scale, a, side):
    """Signs of the indicators just before x: where a step is cut although no transition fires there."""
    for i in range(n_indicators):
        mr = load(C, n + i, 1.0, m, powers, a)
        v, slope = a[mr], 0.0
        for k in range(mr - 1, -1, -1):
            slope = slope * x + v
            v = v * x + a[k]
        if fabs(v) <= NOISE * scale[i]:
            v = -slope
        side[i] = 1 if v > 0.0 else (-1 if v < 0.0 else 0)
