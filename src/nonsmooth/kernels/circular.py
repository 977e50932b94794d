"""Cosine and sine for the inner loops: inlined, a third of a library call's time.

A field with harmonic forcing spends half of its time in ``cos``, because a call into the C library keeps the
compiler from overlapping it with anything. The argument is reduced by pi/2 in two pieces (Cody & Waite, *Software
Manual for the Elementary Functions*, 1980): the first has 33 bits, so that its product with a number of quarter turns
below 2^20 is exact. What is left, at most pi/4, goes into the Taylor polynomials, whose first omitted terms are below
5e-17. Beyond 1e5 rad, and for what is not finite, the C library is asked.
"""

from math import cos, fabs, floor, sin

from nonsmooth.kernels.compile.cache import inline

TWO_OVER_PI = 0.6366197723675814
QUARTER = float.fromhex("0x1.921fb544p+0")  # the first 33 bits of pi/2
REST = float.fromhex("0x1.0b4611a626331p-34")  # pi/2 - QUARTER
LARGEST = 1e5


@inline
def _cosine_near_zero(r):
    z = r * r
    z2 = z * z
    low = (1.0 - 0.5 * z) + z2 * (1.0 / 24 - z * (1.0 / 720))
    high = (1.0 / 40320 - z * (1.0 / 3628800)) + z2 * (
        1.0 / 479001600 - z * (1.0 / 87178291200) + z2 * (1.0 / 20922789888000)
    )
    return low + z2 * z2 * high


@inline
def _sine_near_zero(r):
    z = r * r
    z2 = z * z
    low = (1.0 / 6 - z * (1.0 / 120)) + z2 * (1.0 / 5040 - z * (1.0 / 362880))
    high = (1.0 / 39916800 - z * (1.0 / 6227020800)) + z2 * (1.0 / 1307674368000)
    return r - r * z * (low + z2 * z2 * high)


@inline
def cosine(x):
    """cos x, to about 1e-16."""
    if not fabs(x) < LARGEST:
        return cos(x)
    turns = floor(x * TWO_OVER_PI + 0.5)
    r = (x - turns * QUARTER) - turns * REST
    k = int(turns)
    y = _sine_near_zero(r) if k & 1 else _cosine_near_zero(r)
    return -y if (k + 1) & 2 else y


@inline
def sine(x):
    """sin x, to about 1e-16."""
    if not fabs(x) < LARGEST:
        return sin(x)
    turns = floor(x * TWO_OVER_PI + 0.5)
    r = (x - turns * QUARTER) - turns * REST
    k = int(turns)
    y = _cosine_near_zero(r) if k & 1 else _sine_near_zero(r)
    return -y if k & 2 else y
