"""The least value of a convex quadratic function between bounds, by active sets: forces of contacts and frictions."""

from math import fabs, inf, sqrt

from numba import types

from nonsmooth.kernels.compile.cache import device, kernel

_i, _f1, _f2, _i1 = types.int64, types.float64[::1], types.float64[:, ::1], types.int64[::1]

FAR = 1e30  # beyond all bounds
RANK = 1e-10  # of its own diagonal: a pivot below it is dependent on those before
LEFT = 1e-9  # of the slopes: what may be left of one that dependent forces cannot change
ROUNDING = 1e-13


@kernel(_i(_f2, _f1, _f1, _f1, _f1, _i1, _i1, _f2, _f1))
def least(G, a, low, high, x, free, order, factor, step):
    """Minimise x' G x / 2 + a' x for low <= x <= high, with G symmetric and not negative; 0 where it was found.

    G may be singular: then x is one solution of several with the same a + G x. 1: no set of forces at their bounds was
    the last; 2: without a bound the function has no least value."""
    size = a.shape[0]
    for i in range(size):
        x[i] = min(max(0.0, low[i]), high[i])
        free[i] = low[i] == -inf and high[i] == inf
    for _ in range(50 * size + 50):
        while _descend(G, a, x, free, order, factor, step):
            part, first = 1.0, -1
            for i in range(size):
                if free[i] and not low[i] <= x[i] + step[i] <= high[i]:
                    reach = ((high[i] if step[i] > 0.0 else low[i]) - x[i]) / step[i]
                    if first < 0 or reach < part:
                        part, first = reach, i
            for i in range(size):
                if free[i]:
                    if fabs(step[i]) > FAR and first < 0:
                        return 2
                    x[i] += part * step[i]
            if first < 0:
                break
            x[first] = high[first] if step[first] > 0.0 else low[first]
            free[first] = 0
        chosen, most = -1, 0.0
        for i in range(size):
            slope, terms = a[i], fabs(a[i])
            for j in range(size):
                slope += G[i, j] * x[j]
                terms += fabs(G[i, j] * x[j])
            wish = (slope < -ROUNDING * terms and x[i] < high[i]) or (slope > ROUNDING * terms and x[i] > low[i])
            if not free[i] and wish and fabs(slope) / sqrt(max(G[i, i], 1e-300)) > most:
                chosen, most = i, fabs(slope) / sqrt(max(G[i, i], 1e-300))
        if chosen < 0:
            return 0
        free[chosen] = 1
    return 1


@device
def _descend(G, a, x, free, order, factor, step):
    """Put the step to the least value among the free forces into ``step``; False where none is free.

    Where dependent forces can change the value without end, it leads FAR along them."""
    size, count, largest = a.shape[0], 0, 0.0
    for i in range(size):
        step[i] = 0.0
        if free[i]:
            order[count] = i
            count += 1
    for k in range(count):
        i = order[k]
        slope = a[i]
        for j in range(size):
            slope += G[i, j] * x[j]
        largest = max(largest, fabs(slope), fabs(a[i]))
        for m in range(count):
            factor[k, m] = G[i, order[m]]
        factor[k, size] = -slope
    rank = 0
    while rank < count:
        best, most = rank, -inf
        for k in range(rank, count):
            own = factor[k, k] / max(G[order[k], order[k]], 1e-300)
            if own > most:
                best, most = k, own
        if most <= RANK:
            break
        order[rank], order[best] = order[best], order[rank]
        for m in range(count):
            factor[rank, m], factor[best, m] = factor[best, m], factor[rank, m]
        factor[rank, size], factor[best, size] = factor[best, size], factor[rank, size]
        for k in range(count):
            factor[k, rank], factor[k, best] = factor[k, best], factor[k, rank]
        for k in range(rank + 1, count):
            share = factor[k, rank] / factor[rank, rank]
            for m in range(rank, count):
                factor[k, m] -= share * factor[rank, m]
            factor[k, size] -= share * factor[rank, size]
        rank += 1
    endless, most = -1, LEFT * largest
    for k in range(rank, count):
        if fabs(factor[k, size]) > most:
            endless, most = k, fabs(factor[k, size])
    if endless >= 0:
        step[order[endless]] = 4.0 * FAR * factor[endless, size]
        for k in range(rank):
            factor[k, size] = -factor[k, endless] * step[order[endless]]
    for k in range(rank - 1, -1, -1):
        total = factor[k, size]
        for m in range(k + 1, rank):
            total -= factor[k, m] * step[order[m]]
        step[order[k]] = total / factor[k, k]
    return count > 0
