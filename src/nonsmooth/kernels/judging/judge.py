"""Judgements of runs: period numbers that are known, not assumed, for any number of states; exponents.

Section points s_0, s_1, ... after a transient look periodic long before they are, most of all near a flip, where
they approach like |mu|^k with mu close to -1. Here period p is granted only with a certificate: the return after
p sections is small, r_p = |s_{k+p} - s_k| <= tolerance; the multipliers of the p-th return map, by finite
differences, lie inside |mu| < 1 - MARGIN; and the orbit, which is then at most r_p / (1 - |mu|) away, is farther
from each shorter period than that. What does not qualify but is nearly periodic is slow.

This is text of the processor and of GPUs alike. ``points`` (keep, n or more) are section points in their order;
distances are in the max norm, in units of ``size`` (n), the size of the motion in each state.

Ten batches of returns give the exponent and its error; a quarter of one before them is left out, in which the
direction turns in. This is text of the processor and of GPUs alike.
"""

from math import exp, fabs, hypot, log, nan, sqrt

from numba import types

from nonsmooth.kernels.compile.cache import device, kernel
from nonsmooth.kernels.hybrid.codes import NOT_PERIODIC, OK, SLOW

_i, _f = types.int64, types.float64
_f1, _f2, _f3 = _f[::1], _f[:, ::1], _f[:, :, ::1]

NEARLY = 1e-3  # a smallest return below this is a motion that may still settle
SHRINKING = 3e-2  # and so is one below this whose returns all shrink: near a flip they do so ever more slowly
STRETCH = 32  # returns looked at for that: chaos comes near a cycle, but not steadily
MARGIN = 2e-3  # multipliers nearer to the unit circle than this settle nothing within a transient
APART = 10.0  # how much farther a shorter period must be than the orbit is uncertain
ROUNDS = 8  # of a cycle, over which the contraction on a Poincare section is measured
ULPS = 4e-16  # of a value: the rounding of a sum
ALONG = 1e-4  # of a difference: what is held on a moving belt repeats no better
SQUARINGS = 32  # of a matrix, which give the logarithm of its spectral radius to 2^-32 of that of its condition


@device
def size_of(top, bottom, least, rounded):
    """Size of the motion in a state: half its range, no less than ``least``, nor than ``rounded`` of a large value.

    A pressure that rests at 1e5 Pa returns to 1e-11 Pa at best: rounding must not be taken for a motion."""
    return max(0.5 * (top - bottom), least, rounded * max(fabs(top), fabs(bottom)))


@device
def distance(some, a, others, b, size):
    """Scaled distance between point a of some and point b of others."""
    worst = 0.0
    for k in range(size.shape[0]):
        d = fabs(some[a, k] - others[b, k]) / size[k]
        if not d <= worst:
            worst = d
    return worst


@device
def find_returns(points, size, longest, returns):
    """returns[p - 1]: the largest return over the last p points, p = 1 ... longest."""
    keep = points.shape[0]
    for p in range(1, longest + 1):
        worst = 0.0
        for k in range(max(keep - p, p), keep):
            d = distance(points, k, points, k - p, size)
            if not d <= worst:
                worst = d
        returns[p - 1] = worst


@device
def shrinks(points, size, longest):
    """Return whether for some p every one of the last returns is small and less than that p before."""
    keep = points.shape[0]
    for p in range(1, longest + 1):
        n = min(keep - p, STRETCH + p)
        if n < 2 * p + 8:
            continue
        good = True
        for k in range(keep - n, keep):
            d = distance(points, k, points, k - p, size)
            if not d < SHRINKING or (k >= keep - n + p and not d < distance(points, k - p, points, k - 2 * p, size)):
                good = False
                break
        if good:
            return True
    return False


@device
def candidate(points, size, max_period, tolerance, returns):
    """(period number, status, residual) by the section points alone.

    The status is OK where there is a period whose multipliers are still to be seen; elsewhere the period number is 0.
    ``returns`` (max_period) is filled."""
    longest = min(max_period, points.shape[0] - 1)
    find_returns(points, size, longest, returns)
    least = nan
    p = 0
    for k in range(longest):
        if not returns[k] < 1e300:
            return 0, SLOW, nan
        if k == 0 or returns[k] < least:
            least = returns[k]
        if p == 0 and returns[k] <= tolerance:
            p = k + 1
    if p > 0:
        return p, OK, returns[p - 1]
    settling = not least >= NEARLY or shrinks(points, size, longest)
    return 0, SLOW if settling else NOT_PERIODIC, least


@device
def certain(p, mu, residual, returns):
    """Return whether the period number p stands with the multiplier mu: it contracts, and no shorter one is as near."""
    if not mu < 1.0 - MARGIN:
        return False
    away = residual / (1.0 - mu)
    for d in range(1, p):
        if p % d == 0 and returns[d - 1] <= APART * away:
            return False
    return True


@device
def spectral_radius(A, B):
    """Largest modulus of the eigenvalues of A (n, n), which is overwritten as B (n, n) is; nan where A is not finite.

    Of two states in closed form; of others as the limit of |A^m|^(1/m), m = 1, 2, 4, ..., with |A| divided out. That
    is less exact than the QR algorithm for a k-fold defective eigenvalue (1e-3 for k = 3), but no less than the
    differences which the matrix comes from."""
    n = A.shape[0]
    if n == 2:
        half = 0.5 * (A[0, 0] + A[1, 1])
        square = 0.25 * (A[0, 0] - A[1, 1]) * (A[0, 0] - A[1, 1]) + A[0, 1] * A[1, 0]
        if square >= 0.0:
            return fabs(half) + sqrt(square)
        return hypot(half, sqrt(-square))
    logarithm, weight = 0.0, 1.0
    for _ in range(SQUARINGS):
        norm = 0.0
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += fabs(A[i, j])
            if not total <= norm:
                norm = total
        if norm == 0.0:
            return 0.0
        if not norm < 1e300:
            return nan
        logarithm += weight * log(norm)
        weight *= 0.5
        for i in range(n):
            for j in range(n):
                B[i, j] = A[i, j] / norm
        for i in range(n):
            for j in range(n):
                total = 0.0
                for k in range(n):
                    total += B[i, k] * B[k, j]
                A[i, j] = total
    return exp(logarithm)


@kernel(types.float64(_f2, _f1, _f1, _f, _f3))
def multiplier(images, start, size, difference, work):
    """Largest modulus of the multipliers of the map whose images (n + 1, n) of a point and its neighbours these are.

    Neighbour j is ``difference`` * size[j] away in state j; ``work`` (2, n, n) is scratch. A state that repeats its
    start, beside it too, is held, as by friction: along it lie others of a set, and its 1 is no multiplier. Friction
    takes a speed for each place it holds: where fewer states forget where they began, damping is missing."""
    n, held, forgotten = size.shape[0], 0, 0
    A, B = work[0], work[1]
    for k in range(n):
        most, nudge = 0.0, difference * size[k]
        for j in range(n):
            A[k, j] = (images[j + 1, k] - images[0, k]) / nudge
            most = max(most, fabs(A[k, j]))
        forgotten += most <= ALONG
        off, beside = fabs(images[0, k] - start[k]), fabs(images[k + 1, k] - start[k] - nudge)
        near = max(off, beside) <= ULPS * fabs(start[k]) + ALONG * nudge
        held += near
        B[k, 0] = 2.0 if off == 0.0 and beside <= ULPS * (fabs(start[k]) + nudge) else 1.0 if near else 0.0
    for j in range(n):
        if B[j, 0] == 2.0 or (B[j, 0] == 1.0 and held <= forgotten):
            for k in range(n):
                A[j, k] = 0.0
                A[k, j] = 0.0
    return spectral_radius(A, B)


@kernel(types.float64(_f2, _f2, _f1, _i, _f))
def contraction(points, run, size, p, tolerance):
    """The factor by which a run nears the cycle of the last p of some points, per p returns, on a Poincare section.

    The run begins beside the cycle, off the surface, which may shift the count of its returns by one; so the distance
    to the whole cycle is measured, at its first p returns and its last, ROUNDS * p + 2 being all."""
    keep, last_point = ROUNDS * p + 2, points.shape[0]
    first, last = 0.0, 0.0
    for k in range(1, keep):
        if p < k < keep - p:
            continue
        gap = 1e300
        for c in range(last_point - p, last_point):
            gap = min(gap, distance(run, k, points, c, size))
        if k <= p:
            first = max(first, gap)
        else:
            last = max(last, gap)
    if last <= tolerance:
        return 0.5
    if first == 0.0:
        return nan
    return (last / first) ** (p / (keep - p - 1.0))


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
