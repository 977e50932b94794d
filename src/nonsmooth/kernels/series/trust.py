"""The length on which the polynomial of a Taylor step can be trusted: it is compared with the equations themselves.

p solves u' = f(t, u) on the step as far as p'(tau) = f(t + tau, p(tau)). The difference is taken at the end of the step
and wherever the argument of a function that may hide something (see ``flow.engines.layers``) vanishes or is
stationary, and held against the tolerance; rows of indicators are held against their own values. Where they disagree
the polynomial knows nothing of what it meets there, and the step is to end before.
"""

from math import fabs, inf

import numpy as np

from nonsmooth.kernels.compile.cache import device, once
from nonsmooth.kernels.hybrid.codes import MODE, TIME
from nonsmooth.kernels.series.crossing import NOISE
from nonsmooth.kernels.series.generated import field_of, values_of
from nonsmooth.kernels.series.polynomial import NONE, first_crossing, load, row_bounds, shift, strip

EITHER = np.int64(0)  # way and sign for ``first_crossing``, of the type it was compiled for
SHORTER = 0.8  # a step ends at this fraction of the time to a place where the polynomial is wrong
MOST = 4000  # such fractions in a row: more than there are powers of two
POINTS = 64  # zeros, and extremes, of one guard on one step


@once
def trusted(form, work, h, part):
    """The largest length tried, at most ``part`` of the step h, on which the polynomials agree with the equations."""
    C, m, a, d, stack, found = work.C, form.order, work.a, work.d, work.stack, work.found
    first_guard = C.shape[0] - form.guards
    powers, n_guards = work.powers, form.guards
    far = part
    for row in range(first_guard, first_guard + n_guards):
        _, low, high = row_bounds(C, row, 1.0, m, powers)
        for stationary in range(2):
            if stationary == 0:
                if low > 0.0 or high < 0.0:
                    continue
                degree = load(C, row, 1.0, m, powers, a)
            else:
                degree = slopes(C, row, m, powers, a)
            cursor = 0.0
            for _ in range(POINTS):
                degree_left = remainder_of(a, degree, cursor, d)
                if degree_left < 0:
                    break
                x = first_crossing(d, degree_left, EITHER, EITHER, 0.0, stack, found)
                if x == NONE:
                    break
                cursor += x * (1.0 - cursor)
                if cursor * h >= far:
                    break
                if misfits(form, work, cursor * h, far):
                    far = SHORTER * cursor * h
                    break
    for _ in range(MOST):
        if not misfits(form, work, far, far):
            return far
        far *= SHORTER
    return 0.0


@device
def slopes(C, row, m, powers, a):
    """The derivative of a row on the unit interval; its degree is at least 4, filled with zeros."""
    for k in range(m):
        a[k] = (k + 1) * C[row, k + 1] * powers[k + 1]
    for k in range(m, 5):
        a[k] = 0.0
    return m - 1 if m > 5 else 4


@device
def remainder_of(a, m, cursor, d):
    """a on what remains of the unit interval behind a zero at ``cursor``, divided by its leading powers; the degree."""
    if cursor >= 1.0:
        return -1
    if cursor > 0.0:
        shift(a, m, cursor, 1.0 - cursor, d)
        d[0] = 0.0
    else:
        for k in range(m + 1):
            d[k] = a[k]
    return strip(d, m)


@device
def misfits(form, work, tau, length):
    """Return whether field or indicators at the local time tau differ from the polynomials by more than the tolerance.

    A difference of the slopes counts as if it lasted for ``length``. One that is not larger than what rounding of the
    state and the time does to the equations does not count."""
    mode, t, u, q, n, C, m = work.tally[MODE], work.memo[TIME], work.w, work.q, work.w.shape[0], work.C, form.order
    n_indicators, weight, rtol, scale, vals, vals_near = (
        form.indicators,
        form.weight,
        form.rtol,
        work.scale,
        work.vals,
        work.near,
    )
    at, slope, f, f_near, noise = work.K[0], work.K[1], work.K[2], work.K[3], work.K[4]
    field = field_of(form)
    values = values_of(form)
    for i in range(n):
        v, s = C[i, m], 0.0
        for k in range(m - 1, -1, -1):
            s = s * tau + v
            v = v * tau + C[i, k]
        at[i], slope[i] = v, s
    field(mode, t + tau, at, q, f)
    doubtful = False
    for i in range(n):
        doubtful = doubtful or not (fabs(slope[i] - f[i]) * length <= rtol * (fabs(u[i]) + weight[i]))
    if n_indicators > 0:
        values(mode, t + tau, at, q, vals)
        for i in range(n_indicators):
            doubtful = doubtful or not (fabs(row_at(C, n + i, m, tau) - vals[i]) <= (rtol + NOISE) * scale[i])
    if not doubtful:
        return False
    # Rare from here on. What the beginning already differs by is rounding, as is what neighbouring numbers do.
    field(mode, t, u, q, f_near)
    for i in range(n):
        noise[i] = fabs(f_near[i] - C[i, 1]) + NOISE * fabs(f[i])
    for j in range(n + 1):
        kept = at[j] if j < n else 0.0
        if j < n:
            at[j] += NOISE * (fabs(kept) + fabs(u[j]))
        field(mode, t + tau if j < n else (t + tau) * (1.0 + NOISE), at, q, f_near)
        if j < n:
            at[j] = kept
        for i in range(n):
            noise[i] += fabs(f_near[i] - f[i])
    for i in range(n):
        allowed = rtol * (fabs(u[i]) + weight[i]) + noise[i] * length
        if not (fabs(slope[i] - f[i]) * length <= allowed < inf):
            return True
    for i in range(n_indicators):
        values(mode, t, u, q, vals_near)
        doubt = fabs(vals_near[i] - C[n + i, 0]) + (rtol + NOISE) * scale[i]
        for j in range(n):
            kept = at[j]
            at[j] += NOISE * (fabs(kept) + fabs(u[j]))
            values(mode, t + tau, at, q, vals_near)
            at[j] = kept
            doubt += fabs(vals_near[i] - vals[i])
        if not (fabs(row_at(C, n + i, m, tau) - vals[i]) <= doubt < inf):
            return True
    return False


@device
def row_at(C, row, m, tau):
    """A row of polynomials at the local time tau."""
    v = C[row, m]
    for k in range(m - 1, -1, -1):
        v = v * tau + C[row, k]
    return v
