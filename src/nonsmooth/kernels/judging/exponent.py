"""The largest Lyapunov exponent by two neighbours, which are put back to a small distance after each section return.

Ten batches of returns give the exponent and its error; a quarter of one before them is left out, in which the
direction turns in. This is text of the processor and of GPUs alike.
"""

from math import log, sqrt

from numba import types

from nonsmooth.kernels.compile.cache import kernel

_i, _f = types.int64, types.float64
_f1 = _f[::1]

BATCHES = 10
DISTANCE = 1e-6  # where a neighbour begins, in units of the motion's size
# Sums of a run: growth and time in the present batch; batches, mean of their rates, squares of the deviations.
GROWTH_NOW, TIME_NOW, BATCHES_DONE, MEAN_RATE, SQUARED_RATES = range(5)
RATE_SUMS = 5


@kernel(types.void(_i, _i, _f, _f1, _f1, _f1, _f1, _f1))
def separate(n, batch, elapsed, u, other, size, offset, sums):
    """Take return n of a state and its neighbour, ``elapsed`` after the one before it, into the sums.

    ``offset`` (n) becomes where the neighbour begins next: DISTANCE of ``size`` away, in each state, in the mean."""
    first, apart = 0.0, 0.0
    for k in range(size.shape[0]):
        offset[k] = other[k] - u[k]
        first += DISTANCE * DISTANCE
        apart += (offset[k] / size[k]) ** 2
    first, apart = sqrt(first), sqrt(apart)
    for k in range(size.shape[0]):
        offset[k] = offset[k] * (first / apart) if apart > 0.0 else DISTANCE * size[k]
    if not apart > 0.0:  # fallen together: a direction that vanishes
        apart = 1e-16 * first
    if n < batch // 4:
        return
    sums[GROWTH_NOW] += log(apart / first)
    sums[TIME_NOW] += elapsed
    if (n - batch // 4) % batch == batch - 1:
        rate = sums[GROWTH_NOW] / sums[TIME_NOW]
        sums[GROWTH_NOW] = 0.0
        sums[TIME_NOW] = 0.0
        sums[BATCHES_DONE] += 1.0
        away = rate - sums[MEAN_RATE]
        sums[MEAN_RATE] += away / sums[BATCHES_DONE]
        sums[SQUARED_RATES] += away * (rate - sums[MEAN_RATE])
