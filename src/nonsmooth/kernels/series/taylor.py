"""Length of a Taylor step and evaluation of its polynomials.

The order follows from the tolerance, p = ceil(1 - ln(rtol) / 2), and the length from the last two coefficients
(Jorba and Zou, Exp. Math. 14 (2005) 99-117): a term c_p h^p may be
a tenth of rtol times the size of its row, so that the error of a whole run stays near rtol.
"""

from math import exp, fabs, inf, log

from nonsmooth.kernels.compile.cache import device, inline


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
