"""Certified signs, first crossings and largest values of one polynomial on the unit interval.

A step of a series method is a polynomial in the local time, a(x) = a_0 + a_1 x + ... + a_m x^m with x = tau / h in
[0, 1]. Two things are asked of it: "is it certainly <= 0 (> 0) throughout?", answered cheaply for almost every step,
and "where does it first change sign?", answered rigorously by Bernstein coefficients: a polynomial has at most as
many zeros in an interval as its Bernstein coefficients there have sign changes (Descartes), and as many of one kind.
Intervals with several changes are halved until each holds one zero or one extremum; an extremum found by Newton
decides a graze by its sign, down to rounding.

Every function takes its scratch as an argument. ``stack`` needs ``stack_size(m)`` numbers.
"""

from math import fabs

import numpy as np

from nonsmooth.kernels.compile.cache import device, inline

UP, DOWN = np.int64(1), np.int64(-1)  # of this type, so that Numba compiles one version, not one per number
NONE = 2.0  # "no crossing on [0, 1]"
DEPTH = 44  # halvings; below, neighbouring doubles cannot be told apart any more
WIDEST = 40  # highest degree + 1
EPS = 2.3e-16
HALVINGS = 60  # of a bracket: nothing in it can be told apart then

_INVERSE_BINOMIAL = np.zeros((WIDEST, WIDEST))
for _m in range(WIDEST):
    _c = 1.0
    for _k in range(_m + 1):
        _INVERSE_BINOMIAL[_m, _k] = 1.0 / _c
        _c = _c * (_m - _k) / (_k + 1)


def stack_size(m: int) -> int:
    """Length of the scratch that the searches need for polynomials of degree up to m."""
    return (DEPTH + 2) * (m + 4)


@device
def load(C, row, sign, m, powers, a):
    """a_k = sign C[row, k] powers[k]: the row on the unit interval; at least degree 4, filled with zeros."""
    for k in range(m + 1):
        a[k] = sign * C[row, k] * powers[k]
    for k in range(m + 1, 5):
        a[k] = 0.0
    return m if m > 4 else 4


@device
def strip(a, m):
    """Divide by the power of x that a polynomial with leading zeros contains: same signs for x > 0, sharper tests.

    Returns the new degree; -1 where all coefficients vanish."""
    if a[0] != 0.0:
        return m
    z = 1
    while z <= m and a[z] == 0.0:
        z += 1
    if z > m:
        return -1
    for k in range(m + 1 - z):
        a[k] = a[k + z]
    m -= z
    for k in range(m + 1, 5):
        a[k] = 0.0
    return m if m > 4 else 4


@device
def bounds(a, m):
    """Certified (lower, upper) bound on [0, 1]: Bernstein coefficients of the first five terms, the rest by size."""
    rest = 0.0
    for k in range(5, m + 1):
        rest += fabs(a[k])
    b1 = a[0] + 0.25 * a[1]
    b2 = a[0] + 0.5 * a[1] + a[2] / 6.0
    b3 = a[0] + 0.75 * a[1] + 0.5 * a[2] + 0.25 * a[3]
    b4 = a[0] + a[1] + a[2] + a[3] + a[4]
    return min(a[0], b1, b2, b3, b4) - rest, max(a[0], b1, b2, b3, b4) + rest


@inline
def row_bounds(C, row, sign, m, powers):
    """``load`` and ``bounds`` in one pass that stores nothing. Returns (a_0, lower, upper)."""
    even, odd = 0.0, 0.0
    k = 5
    while k < m:
        odd += fabs(C[row, k]) * powers[k]
        even += fabs(C[row, k + 1]) * powers[k + 1]
        k += 2
    if k == m:
        odd += fabs(C[row, k]) * powers[k]
    rest = odd + even
    a0 = sign * C[row, 0]
    a1, a2, a3, a4 = sign * C[row, 1] * powers[1], 0.0, 0.0, 0.0
    if m >= 4:
        a2, a3, a4 = sign * C[row, 2] * powers[2], sign * C[row, 3] * powers[3], sign * C[row, 4] * powers[4]
    else:
        a2 = sign * C[row, 2] * powers[2]
        if m == 3:
            a3 = sign * C[row, 3] * powers[3]
    b1 = a0 + 0.25 * a1
    b2 = a0 + 0.5 * a1 + a2 / 6.0
    b3 = a0 + 0.75 * a1 + 0.5 * a2 + 0.25 * a3
    b4 = a0 + a1 + a2 + a3 + a4
    return a0, min(a0, b1, b2, b3, b4) - rest, max(a0, b1, b2, b3, b4) + rest


@device
def dense(a, m, x):
    """a(x) by Horner's rule."""
    v = a[m]
    for k in range(m - 1, -1, -1):
        v = v * x + a[k]
    return v


@device
def shift(a, m, x, width, out):
    """out(y) = a(x + width y): the polynomial on another interval (out may be a)."""
    for k in range(m + 1):
        out[k] = a[k]
    for i in range(m):
        for k in range(m - 1, i - 1, -1):
            out[k] += x * out[k + 1]
    power = 1.0
    for k in range(1, m + 1):
        power *= width
        out[k] *= power


@device
def bernstein(a, m, b):
    """Bernstein coefficients b_0..b_m of a on [0, 1]."""
    for k in range(m + 1):
        b[k] = a[k] * _INVERSE_BINOMIAL[m, k]
    for i in range(1, m + 1):
        for k in range(m, i - 1, -1):
            b[k] += b[k - 1]


@device
def _halve(b, base, left, m):
    """De Casteljau at the middle: the left half goes to ``left``, the right one stays at ``base``."""
    for i in range(m + 1):
        b[left + i] = b[base]
        for k in range(m - i):
            b[base + k] = 0.5 * (b[base + k] + b[base + k + 1])


@device
def _zero(a, m, lo, hi, way):
    """The one zero in [lo, hi] of a, passed in the direction ``way``: Newton, kept inside its bracket.

    Where a hundred rounds do not get there, the bracket is halved to rounding."""
    f_lo, f_hi = dense(a, m, lo), dense(a, m, hi)
    x = 0.5 * (lo + hi)
    if f_lo * f_hi < 0.0:
        x = min(max(lo + (hi - lo) * f_lo / (f_lo - f_hi), lo), hi)
    for _ in range(100):
        f, d = a[m], 0.0
        for k in range(m - 1, -1, -1):
            d = d * x + f
            f = f * x + a[k]
        if f == 0.0:
            return x
        if f * way > 0.0:
            hi = x
        else:
            lo = x
        new = x - f / d if d != 0.0 else -1.0
        if not (lo <= new <= hi):
            new = 0.5 * (lo + hi)
        if fabs(new - x) <= 2.0 * EPS * new or new == lo == hi:
            return new
        x = new
    for _ in range(HALVINGS):
        x = 0.5 * (lo + hi)
        if dense(a, m, x) * way > 0.0:
            hi = x
        else:
            lo = x
    return x


@device
def _extremum(a, m, lo, hi, way):
    """The one extremum in [lo, hi]: a maximum for ``way`` = 1, a minimum for -1. Newton on the derivative.

    Its place is wrong by 1e-9 at most, its value by the square of that."""
    x = 0.5 * (lo + hi)
    if lo == 0.0 and hi == 1.0 and a[1] != a[1] + 2.0 * a[2]:
        x = min(max(-a[1] / (2.0 * a[2]), 0.0), 1.0)
    for _ in range(100):
        d, dd = m * a[m], 0.0
        for k in range(m - 1, 0, -1):
            dd = dd * x + d
            d = d * x + k * a[k]
        if d == 0.0:
            return x
        if d * way > 0.0:
            lo = x
        else:
            hi = x
        new = x - d / dd if dd != 0.0 else -1.0
        if not (lo <= new <= hi):
            new = 0.5 * (lo + hi)
        if fabs(new - x) <= 1e-9 or new == lo == hi:
            return new
        x = new
    for _ in range(HALVINGS):  # Newton's method did not get there
        x = 0.5 * (lo + hi)
        d = m * a[m]
        for k in range(m - 1, 0, -1):
            d = d * x + k * a[k]
        if d * way > 0.0:
            lo = x
        else:
            hi = x
    return x


@device
def _turns(b, base, m):
    """Sign changes of the differences of Bernstein coefficients (a bound on the extrema), and the first sign."""
    first, last, turns = 0, 0, 0
    for k in range(m):
        d = b[base + k + 1] - b[base + k]
        s = 1 if d > 0.0 else (-1 if d < 0.0 else 0)
        if s != 0:
            if last == 0:
                first = s
            elif s != last:
                turns += 1
            last = s
    return turns, first


@inline
def _sign(v):
    return 1 if v > 0.0 else -1


@device
def first_crossing(a, m, way, before, error, stack, found):
    """The first x in [0, 1] where a changes sign in the direction ``way`` (1 up, -1 down, 0 either), or NONE.

    ``before`` is the sign that a had just before x = 0 (0: none, then the first sign inside counts). With it a change
    that falls between two steps, where rounding separates one polynomial's end from the next one's beginning, is
    found, at x = 0. ``found[0]`` becomes 1 where a graze is nearer to zero than ``error``; ``found[1]`` is the sign
    at the end of what was searched.
    """
    end, bend = a[0] + a[1], 0.0
    for k in range(2, m + 1):
        end += a[k]
        bend += k * fabs(a[k])
    if fabs(a[1]) > bend:  # monotone: most crossings
        first = _sign(a[0]) if a[0] != 0.0 else _sign(a[1])
        last = _sign(end) if end != 0.0 else first
        if before != 0 and first != before and (way == 0 or first == way):
            found[1] = first
            return 0.0
        found[1] = last
        return _zero(a, m, 0.0, 1.0, float(last)) if last != first and (way == 0 or last == way) else NONE
    bernstein(a, m, stack)
    stride = m + 3
    stack[m + 1], stack[m + 2] = 0.0, 1.0
    top = 0
    while top >= 0:
        base = top * stride
        lo, width = stack[base + m + 1], stack[base + m + 2]
        first, last, changes = 0, 0, 0
        for k in range(m + 1):
            b = stack[base + k]
            s = 1 if b > 0.0 else (-1 if b < 0.0 else 0)
            if s != 0:
                if last == 0:
                    first = s
                elif s != last:
                    changes += 1
                last = s
        if first == 0:
            top -= 1
            continue
        if before != 0 and first != before and (way == 0 or first == way):
            found[1] = first
            return lo
        before = first
        if changes == 1:
            if way == 0 or last == way:
                found[1] = last
                return _zero(a, m, lo, lo + width, float(last))
            before = last
            top -= 1
            continue
        if changes == 0:
            top -= 1
            continue
        turns, slope = _turns(stack, base, m)
        if turns == 1 and changes == 2:
            x = _extremum(a, m, lo, lo + width, float(slope))
            v = dense(a, m, x)
            if fabs(v) <= error:
                found[0] = 1
            if v * first < 0.0:
                if way == 0 or way == -first:
                    found[1] = -first
                    return _zero(a, m, lo, x, float(-first))
                found[1] = first
                return _zero(a, m, x, lo + width, float(first))
            top -= 1
        elif top + 1 >= DEPTH:
            if first != last and (way == 0 or last == way):
                found[1] = last
                return lo + 0.5 * width
            before = last
            top -= 1
        else:
            left = base + stride
            _halve(stack, base, left, m)
            stack[base + m + 1], stack[base + m + 2] = lo + 0.5 * width, 0.5 * width
            stack[left + m + 1], stack[left + m + 2] = lo, 0.5 * width
            top += 1
    found[1] = before
    return NONE


@device
def largest(a, m, current, stack):
    """The larger of ``current`` and the maximum of a on [0, 1]."""
    end = 0.0
    for k in range(m, -1, -1):
        end += a[k]
    current = max(current, a[0], end)
    slope, bend, twist = 2.0 * a[2], 2.0 * fabs(a[2]), 0.0
    for k in range(3, m + 1):
        slope += k * a[k]
        bend += k * fabs(a[k])
        twist += k * (k - 1) * fabs(a[k])
    if fabs(a[1]) >= bend:  # monotone
        return current
    if 2.0 * a[2] + twist < 0.0:  # concave: one maximum, inside where the slope changes its sign
        if a[1] > 0.0 and a[1] + slope < 0.0:
            current = max(current, dense(a, m, _extremum(a, m, 0.0, 1.0, 1.0)))
        return current
    if bounds(a, m)[1] <= current:
        return current
    bernstein(a, m, stack)
    stride = m + 3
    stack[m + 1], stack[m + 2] = 0.0, 1.0
    top = 0
    while top >= 0:
        base = top * stride
        lo, width = stack[base + m + 1], stack[base + m + 2]
        current = max(current, stack[base], stack[base + m])
        high = current
        for k in range(m + 1):
            high = max(high, stack[base + k])
        if high - current <= 4.0 * EPS * fabs(high) or top + 1 >= DEPTH:
            top -= 1
            continue
        turns, slope = _turns(stack, base, m)
        if turns <= 1:
            if turns == 1 and slope > 0:
                current = max(current, dense(a, m, _extremum(a, m, lo, lo + width, 1.0)))
            top -= 1
        else:
            left = base + stride
            _halve(stack, base, left, m)
            stack[base + m + 1], stack[base + m + 2] = lo + 0.5 * width, 0.5 * width
            stack[left + m + 1], stack[left + m + 2] = lo, 0.5 * width
            top += 1
    return current
