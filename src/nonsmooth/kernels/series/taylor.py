"""Taylor steps: their length, how far their polynomials can be trusted against the equations, and their evaluation.

The order follows from the tolerance, p = ceil(1 - ln(rtol) / 2), and the length from the last two coefficients
(Jorba and Zou, Exp. Math. 14 (2005) 99-117): a term c_p h^p may be
a tenth of rtol times the size of its row, so that the error of a whole run stays near rtol.

p solves u' = f(t, u) on the step as far as p'(tau) = f(t + tau, p(tau)). The difference is taken at the end of the step
and wherever the argument of a function that may hide something (see ``flow.engines.layers``) vanishes or is
stationary, and held against the tolerance; rows of indicators are held against their own values. Where they disagree
the polynomial knows nothing of what it meets there, and the step is to end before.
"""

from math import exp, fabs, inf, log

import numpy as np

from nonsmooth.kernels.compile.cache import device, inline, once
from nonsmooth.kernels.hybrid.codes import MODE, TIME
from nonsmooth.kernels.series.crossing import NOISE
from nonsmooth.kernels.series.generated import field_of, values_of
from nonsmooth.kernels.series.polynomial import NONE, first_crossing, load, row_bounds, shift, strip


@inline
def step_length(C, order, n, n_indicators, u, weight, scale, log_rtol):
    """h such that the last two terms are rtol (|u_i| + weight_i), for an indicator rtol times its own scale.

    Where both vanish (cos(t^2) has gaps), all coefficients are asked: h = rtol^(1/p) / max_k |c_k|^(1/k); ``inf`` where
    none is left (a constant), NaN where they are not finite.
    """
    last, before = 0.0, 0.0
    for i in range(n):
        w = 1.0 / (fabs(u[i]) + weight[i])
        last = max(last, fabs(C[i, order]) * w)
        before = max(before, fabs(C[i, order - 1]) * w)
        if not (last < inf and before < inf):
            return float("nan")
    for i in range(n_indicators):
        if scale[i] > 0.0:
            w = 1.0 / scale[i]
            last = max(last, fabs(C[n + i, order]) * w)
            before = max(before, fabs(C[n + i, order - 1]) * w)
    if last == 0.0 and before == 0.0:
        return step_over_gaps(C, order, n, n_indicators, u, weight, scale, log_rtol)
    power = inf
    if last > 0.0:
        power = (log_rtol - log(last)) / order
    if before > 0.0 and order > 1:
        power = min(power, (log_rtol - log(before)) / (order - 1))
    return inf if power > 300.0 else exp(power)


@device
def step_over_gaps(C, order, n, n_indicators, u, weight, scale, log_rtol):
    """A step from the growth of all coefficients: for series whose last terms vanish."""
    growth = 0.0
    for i in range(n + n_indicators):
        w = 0.0
        if i < n:
            w = 1.0 / (fabs(u[i]) + weight[i])
        elif scale[i - n] > 0.0:
            w = 1.0 / scale[i - n]
        for k in range(1, order - 1):
            size = w * fabs(C[i, k])
            if size > 0.0:
                growth = max(growth, exp(log(size) / k))
    return exp(log_rtol / order) / growth if growth > 0.0 else inf


@inline
def copied(source, target):
    """target = source, element by element: so written that the compiler does not prepare it for many."""
    j = 0
    while True:
        target[j] = source[j]
        j += 1
        if j >= target.shape[0]:
            break


@inline
def fill_powers(h, m, powers):
    """powers[k] = h^k, k = 0..m."""
    p0, p1, p2, p3 = 1.0, h, h * h, h * h * h
    h4 = p2 * p2
    k = 0
    while k + 3 <= m:  # four short chains of products instead of a long one
        powers[k], powers[k + 1], powers[k + 2], powers[k + 3] = p0, p1, p2, p3
        p0, p1, p2, p3 = p0 * h4, p1 * h4, p2 * h4, p3 * h4
        k += 4
    if k <= m:
        powers[k] = p0
    if k + 1 <= m:
        powers[k + 1] = p1
    if k + 2 <= m:
        powers[k + 2] = p2


@inline
def end_states(C, m, n, powers, out):
    """States at the end of the interval whose powers are given; the small terms are added first."""
    for i in range(n):
        even, odd = 0.0, 0.0
        k = m - m % 2
        if k < m:
            odd = C[i, m] * powers[m]
        while k >= 2:
            even += C[i, k] * powers[k]
            odd += C[i, k - 1] * powers[k - 1]
            k -= 2
        out[i] = C[i, 0] + (odd + even)


@device
def dense_states(C, m, n, tau, out):
    """States at the local time tau of the step."""
    for i in range(n):
        v = C[i, m]
        for k in range(m - 1, -1, -1):
            v = v * tau + C[i, k]
        out[i] = v


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
            at[j] += NOISE * (fabs(kept) + fabs(u[j])) + noise[j] * length
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
