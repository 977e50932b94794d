"""Sums over as many states as a system has, for the text in which their number varies: given addresses, so that each
loop stands once in the code and is not held up by arrays that might overlap.

Places are counted in numbers of eight bytes. ``some`` lists places: how many, then which.
"""

from math import fabs

from nonsmooth.kernels.compile.cache import device, inline, summed
from nonsmooth.kernels.compile.lanes import (
    FOUR,
    apart,
    four_at,
    number_at,
    plus,
    sum_columns,
    times,
    whole_at,
    write_four,
    write_number,
)

INVERSE = tuple(1.0 / k for k in range(1, 32))
FEW = 8  # states of a condition that are summed one by one


@inline
def at(array, place):
    """The address of a place in the memory of an array."""
    return array.ctypes.data + 8 * place


@device
def propagated(table, filled, w, n, m, out):
    """out[:n]: the columns of a propagator, ``filled`` up to whole vectors, times w."""
    apart()
    sum_columns(table, filled, w, n, m, out)


@device
def composed(table, some, w, out):
    """out[:8] = sum_j table[j, :8] w[j] over the places j in ``some``."""
    apart()
    for begin in range(0, 8, FOUR):
        total = times(0.0, four_at(table, begin))
        for q in range(1, whole_at(some, 0) + 1):
            j = whole_at(some, q)
            total = plus(total, number_at(w, j), four_at(table, 8 * j + begin))
        write_four(out, begin, total)


@summed
def whole_row(row, w, n):
    """sum_j row[j] w[j] for j < n."""
    total = 0.0
    for j in range(n):
        total += number_at(row, j) * number_at(w, j)
    return total


@device
def dot(row, w, n):
    """sum_j row[j] w[j] for j < n."""
    apart()
    return whole_row(row, w, n)


@device
def row_of(row, some, w, n, m):
    """row[n] + sum_j row[j] w[j] over the harmonics and the states in ``some``: one by one where they are few."""
    apart()
    total = number_at(row, n)
    for j in range(n + 1, m):
        total += number_at(row, j) * number_at(w, j)
    count = whole_at(some, 0)
    if count > FEW:
        return total + whole_row(row, w, n)
    for q in range(1, count + 1):
        j = whole_at(some, q)
        total += number_at(row, j) * number_at(w, j)
    return total


@inline
def ends_of(row, some, w, w1, n, m):
    """Value and slope rows of a functional, which stand behind each other, at w and at w1."""
    if whole_at(some, 0) > FEW:
        slope = row + 8 * m
        return (
            row_of(row, some, w, n, m),
            row_of(slope, some, w, n, m),
            row_of(row, some, w1, n, m),
            row_of(slope, some, w1, n, m),
        )
    g0, s0 = number_at(row, n), number_at(row, m + n)
    g1, s1 = g0, s0
    for j in range(n + 1, m):
        a, b, x, y = number_at(row, j), number_at(row, m + j), number_at(w, j), number_at(w1, j)
        g0, s0, g1, s1 = g0 + a * x, s0 + b * x, g1 + a * y, s1 + b * y
    for q in range(1, whole_at(some, 0) + 1):
        j = whole_at(some, q)
        a, b, x, y = number_at(row, j), number_at(row, m + j), number_at(w, j), number_at(w1, j)
        g0, s0, g1, s1 = g0 + a * x, s0 + b * x, g1 + a * y, s1 + b * y
    return g0, s0, g1, s1


@device
def add_products(out, factors, row, first, last):
    """out[r] += factors[r] row[r] for first <= r < last."""
    apart()
    for r in range(first, last):
        write_number(out, r, number_at(out, r) + number_at(factors, r) * number_at(row, r))


@device
def sum_terms(out, rows, width, first, last, x, m):
    """out[j] = sum_k x^(k - first) / (k - first)! rows[k, j] for first <= k <= last and j < m, by Horner's rule.

    Up to three numbers behind the m-th are written as well, and read behind a row."""
    apart()
    for j in range(0, m, 2 * FOUR):
        a, b = four_at(rows, last * width + j), four_at(rows, last * width + j + FOUR)
        for k in range(last - 1, first - 1, -1):
            part, place = x * INVERSE[k - first], k * width + j
            a = plus(four_at(rows, place), part, a)
            b = plus(four_at(rows, place + FOUR), part, b)
        write_four(out, j, a)
        if j + FOUR < m:
            write_four(out, j + FOUR, b)


@device
def sum_sizes(out, rows, width, first, last, m):
    """The same of the terms' sizes at x = 1."""
    apart()
    for j in range(m):
        write_number(out, j, fabs(number_at(rows, last * width + j)))
    for k in range(last - 1, first - 1, -1):
        for j in range(m):
            write_number(out, j, number_at(out, j) * INVERSE[k - first] + fabs(number_at(rows, k * width + j)))


@summed
def spread(total, row, w, about, n):
    """total + sum_j row[j] |w[j] - about[j]| for j < n."""
    for j in range(n):
        total += number_at(row, j) * fabs(number_at(w, j) - number_at(about, j))
    return total


@device
def wide_spread(row, w, about, n):
    """row[n] + sum_j row[j] |w[j] - about[j]| for many j < n."""
    apart()
    return spread(number_at(row, n), row, w, about, n)


@inline
def spread_of(row, w, about, n):
    """row[n] + sum_j row[j] |w[j] - about[j]| for j < n."""
    if n > FEW:
        return wide_spread(row, w, about, n)
    total = number_at(row, n)
    for j in range(n):
        total += number_at(row, j) * fabs(number_at(w, j) - number_at(about, j))
    return total


@summed
def sizes(total, row, w, first, last):
    """total + sum_j |row[j] w[j]| for first <= j < last."""
    for j in range(first, last):
        total += fabs(number_at(row, j) * number_at(w, j))
    return total


@device
def sizes_of(row, some, w, n, first, m):
    """sum_j |row[j] w[j]| over first <= j < m behind the states, and the states in ``some``."""
    apart()
    total = sizes(0.0, row, w, first, m)
    count = whole_at(some, 0)
    if count > FEW:
        return sizes(total, row, w, 0, n)
    for q in range(1, count + 1):
        j = whole_at(some, q)
        total += fabs(number_at(row, j) * number_at(w, j))
    return total
