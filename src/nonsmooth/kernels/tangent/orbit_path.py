"""Extremes within the segments of a periodic orbit, and how near each condition came.

A visit is followed in its own mode with every transition ignored, so that an orbit can be followed a little way
beyond a stop. For each transition out of the mode the margin is the least of its signed indicators: it fires where the
margin rises through zero. A local maximum of the margin below zero is a touch that leaves a clearance; above zero the
path has gone through a boundary that it should have obeyed.
"""

from math import exp, fabs, inf
from math import log as ln
from typing import Any, NamedTuple

from numba import types

from nonsmooth.kernels.compile.cache import device, inline, kernel
from nonsmooth.kernels.compile.pointers import function_at
from nonsmooth.kernels.hybrid.codes import DIVERGED, NO_CONVERGENCE, OK
from nonsmooth.kernels.hybrid.records import NET, type_of
from nonsmooth.kernels.series.crossing import OFF
from nonsmooth.kernels.series.taylor import dense_states, step_length

PARTS = 8  # of a step of the series: an extremum shows as a change of the slope's sign over one part
BISECTIONS = 60
ROUNDING = 1e-13  # of an indicator's size
BEGUN = 1e-6  # of a step: the square root of rounding
STILL = 1e-9  # of a slope's terms: an orbit is solved for no better, and where motion turns the slope is zero
MOST_STEPS = 100_000
FIRST = 4  # terms of a row by which its size is told

_i, _f = types.int64, types.float64
_f1, _f2, _i1, _i2 = _f[::1], _f[:, ::1], _i[::1], _i[:, ::1]
jet_at = function_at(types.FunctionType(types.void(_i, _i, _f, _f1, _f1, _f2, _f2)))


@inline
def value_and_slope(C, m, row, x):
    """A row of the jet and its derivative at the local time x."""
    v, s = C[row, m], 0.0
    for k in range(m - 1, -1, -1):
        s = s * x + v
        v = v * x + C[row, k]
    return v, s


@device
def margin(C, m, n, net, k, x, skipped):
    """(least signed indicator of transition k, its slope, its row) at the local time x; row ``skipped`` is left out.

    Of rows that are equal to rounding the one that rises last counts: it is the one that would fire."""
    least, slope, which = inf, 0.0, -1
    rows = net.rows
    for r in range(net.row_start[k], net.row_start[k + 1]):
        if r == skipped:
            continue
        v, s = value_and_slope(C, m, n + rows[r, 0], x)
        v, s = rows[r, 1] * v, rows[r, 1] * s
        if v < least:
            least, slope, which = v, s, r
    return least, slope, which


@device
def size_of(C, m, row, h):
    """The largest term of a row of the jet over the local time h."""
    size, power = fabs(C[row, 0]), 1.0
    for p in range(1, m + 1):
        power *= h
        size = max(size, fabs(C[row, p]) * power)
    return size


@device
def still(C, m, row, slope, h):
    """Return whether the slope of a row is zero beside its largest term over the local time h."""
    size, power = 0.0, 1.0
    for p in range(1, m + 1):
        size = max(size, p * fabs(C[row, p]) * power)
        power *= h
    return fabs(slope) < STILL * size


@device
def reach_of(C, m, first, log_rtol):
    """The time over which rows from ``first`` on are told: their last two terms are rtol of one of the first, whatever
    the scale of a row; inf: constants."""
    power = inf
    for i in range(first, C.shape[0]):
        for last in range(m - 1, m + 1):
            most = -inf
            for k in range(FIRST):
                if C[i, k] != 0.0 and C[i, last] != 0.0:
                    most = max(most, (log_rtol + ln(fabs(C[i, k] / C[i, last]))) / (last - k))
            if most > -inf:
                power = min(power, most)
    return inf if power > 300.0 else exp(power)


@device
def extremum(C, m, row, a, b, sign):
    """Local time of the extremum of a row between a and b, where sign * slope is positive at a and negative at b."""
    for _ in range(BISECTIONS):
        c = 0.5 * (a + b)
        s = 0.0
        for k in range(m, 0, -1):
            s = s * c + k * C[row, k]
        if sign * s > 0.0:
            a = c
        else:
            b = c
    return 0.5 * (a + b)


class Visits(NamedTuple):
    """The m visits of an orbit; those of no or negative length are passed over."""

    modes: Any  # (m,)
    t0: Any  # (m,) when each begins
    tau: Any  # (m,) how long it lasts
    z: Any  # (m, n + n_memory) where it begins
    fired: Any  # (m,) the transition that ends it
    fired_row: Any  # (m,) and the row of the net that is zero there; -1: the section


class Margins(NamedTuple):
    """Results for m segments and all transitions."""

    inner: Any  # (m, transitions) largest local maximum of the margin inside the visit (-inf: none)
    place: Any  # its time
    which: Any  # and the row it stands in
    begin: Any  # the margin at the beginning of the visit
    begin_row: Any  # the row it stands in
    begin_size: Any  # and the size of that row's terms, and of what they are computed from
    end: Any  # the margin at the end, without the row that fires there
    slope: Any  # (m, 2) of the signed indicator that is zero at the end: time derivative just before it, and value


VISITS = type_of(Visits, _i1, _f1, _f1, _f2, _i1, _i1)
MARGINS = type_of(Margins, _f2, _f2, _i2, _f2, _i2, _f2, _f2, _f2)
SCRATCH = types.Tuple((_f2, _f2, _f2, _f1, _f1, _f1, _f1))


@kernel(types.int64(_i1, _i, _f, _f1, _i2, NET, _f1, VISITS, SCRATCH, _f2, MARGINS))
def follow(functions, order, rtol, weight, lacking, net, values, visits, work, extremes, margins):
    """Follow all visits of an orbit.

    ``functions`` holds the address of the model's jet (``pointers.addresses``), ``work`` room for two jets, scratch,
    two lots of states, parameters with memory, sizes of indicators. ``extremes`` (2, n) become the largest and smallest
    value of each state; ``margins`` are written."""
    jet, rows = jet_at(functions[0]), net.rows
    modes, t0, tau, z, fired, fired_row = visits
    inner, place, which, begin, begin_row, begin_size, end, slope = margins
    C, near, W, u, beside, q, scale = work
    n, n_p = weight.shape[0], values.shape[0]
    log_rtol = ln(rtol)
    for i in range(n_p):
        q[i] = values[i]
    for i in range(n):
        extremes[0, i], extremes[1, i] = -inf, inf
    for leg in range(modes.shape[0]):
        mode, t, left = modes[leg], t0[leg], tau[leg]
        for i in range(n):
            u[i] = z[leg, i]
        for i in range(n, z.shape[1]):
            q[n_p + i - n] = z[leg, i]
        for k in range(net.at.shape[0]):
            inner[leg, k], place[leg, k], which[leg, k], end[leg, k] = -inf, 0.0, -1, -inf
            begin[leg, k], begin_row[leg, k], begin_size[leg, k] = -inf, -1, 0.0
        slope[leg, 0], slope[leg, 1] = 0.0, 0.0
        steps = 0
        while True:
            if left <= 0.0 and (steps > 0 or left < 0.0):
                break
            jet(mode, order, t, u, q, C, W)
            # An indicator is zero where a visit begins, so its size says nothing; where a mass sticks it alone moves.
            reach = min(step_length(C, order, n, 0, u, weight, scale, log_rtol), reach_of(C, order, n, log_rtol))
            if reach == inf:
                reach = max(left, 0.0)
            h = min(reach, left)
            if not (h >= 0.0):
                return DIVERGED
            steps += 1
            if steps > MOST_STEPS:
                return NO_CONVERGENCE
            if steps == 1:  # a speed that was held is a difference of zero: what it is computed from shows its rounding
                for i in range(n):  # no two by the same, so that no terms stay equal
                    beside[i] = u[i] * (1.0 + OFF * (1 + i))
                jet(mode, 2, t * (1.0 + 0.5 * OFF), beside, q, near, W)
            width = h / PARTS
            # Extremes of the states
            for i in range(n):
                if lacking[mode, i] == 1:
                    continue
                a, before = 0.0, C[i, 1]
                extremes[0, i], extremes[1, i] = max(extremes[0, i], u[i]), min(extremes[1, i], u[i])
                for part in range(1, PARTS + 1):
                    b = h if part == PARTS else part * width
                    v, s = value_and_slope(C, order, i, b)
                    if before * s < 0.0:
                        sign = 1.0 if before > 0.0 else -1.0
                        v, _ = value_and_slope(C, order, i, extremum(C, order, i, a, b, sign))
                    extremes[0, i], extremes[1, i] = max(extremes[0, i], v), min(extremes[1, i], v)
                    a, before = b, s
            # Margins of the transitions out of this mode
            for j in range(net.mode_start[mode], net.mode_start[mode + 1]):
                k = net.mode_list[j]
                if net.row_start[k + 1] == net.row_start[k]:
                    continue  # at a time, not by a condition
                a = 0.0
                begun, rising, row = margin(C, order, n, net, k, 0.0, -1)
                if steps == 1:
                    begin[leg, k], begin_row[leg, k] = begun, row
                    r = n + rows[row, 0]
                    begin_size[leg, k] = max(size_of(C, order, r, reach), fabs(near[r, 0] - C[r, 0]) / OFF)
                    if still(C, order, r, rising, min(reach, tau[leg])):  # a maximum there belongs to the visit before
                        rising = 0.0
                for part in range(1, PARTS + 1):
                    b = h if part == PARTS else part * width
                    _, s, row = margin(C, order, n, net, k, b, -1)
                    if part == PARTS and h == left and k != fired[leg]:
                        s = 0.0 if still(C, order, n + rows[row, 0], s, min(reach, tau[leg])) else s
                    if rising > 0.0 and s <= 0.0:
                        lo, hi = a, b
                        for _ in range(BISECTIONS):
                            c = 0.5 * (lo + hi)
                            _, sc, _ = margin(C, order, n, net, k, c, -1)
                            if sc > 0.0:
                                lo = c
                            else:
                                hi = c
                        v, _, row = margin(C, order, n, net, k, lo, -1)
                        # A visit may begin where the margin and its slope are zero: rounding is no maximum.
                        zero = steps == 1 and a == 0.0 and fabs(begun) <= ROUNDING * begin_size[leg, k]
                        begins = zero and lo <= BEGUN * reach
                        if not begins and v > inner[leg, k]:
                            inner[leg, k], place[leg, k], which[leg, k] = v, t + lo, row
                    a, rising = b, s
            left -= h
            if left <= 0.0:
                for j in range(net.mode_start[mode], net.mode_start[mode + 1]):
                    k = net.mode_list[j]
                    if net.row_start[k + 1] == net.row_start[k]:
                        continue
                    skipped = -1
                    for r in range(net.row_start[k], net.row_start[k + 1]):
                        f = fired_row[leg]
                        if f >= 0 and rows[r, 0] == rows[f, 0] and rows[r, 1] == rows[f, 1]:
                            skipped = r
                    v, _, _ = margin(C, order, n, net, k, h, skipped)
                    end[leg, k] = v
                if fired_row[leg] >= 0:
                    r = fired_row[leg]
                    v, s = value_and_slope(C, order, n + rows[r, 0], h)
                    slope[leg, 0], slope[leg, 1] = rows[r, 1] * s, rows[r, 1] * v
            dense_states(C, order, n, h, u)
            t += h
    return OK
