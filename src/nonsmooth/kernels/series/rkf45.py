"""Runge-Kutta-Fehlberg steps of order 4(5), with a quintic Hermite polynomial between them.

E. Fehlberg, NASA TR R-315 (1969). The fifth-order result is carried on (local extrapolation) unless the step is
fixed; then the fourth-order one is, so that the method shows the order its name says. Values, slopes and second
derivatives at both ends (jets of order 2) make every row of the step - states, indicators, outputs - a polynomial
of degree 5 whose error h^6 / 46080 is below the step's own.
"""

from math import fabs, inf, sqrt

from nonsmooth.kernels.compile.cache import device, inline, once


@inline
def stages(field, mode, t, u, q, h, n, K, fifth, absolute, rtol):
    """One step from u; K = (k1..k6, scratch, result) with k1 given. Returns the square of the error over
    the tolerance (mean over the states).

    The loops over the few states are written so that the compiler does not prepare them for many.
    """
    k1, k2, k3, k4, k5, k6, v, new = K
    i = 0
    while True:
        v[i] = u[i] + h * (0.25 * k1[i])
        i += 1
        if i >= n:
            break
    field(mode, t + 0.25 * h, v, q, k2)
    i = 0
    while True:
        v[i] = u[i] + h * (3.0 / 32.0 * k1[i] + 9.0 / 32.0 * k2[i])
        i += 1
        if i >= n:
            break
    field(mode, t + 0.375 * h, v, q, k3)
    i = 0
    while True:
        v[i] = u[i] + h * (1932.0 / 2197.0 * k1[i] - 7200.0 / 2197.0 * k2[i] + 7296.0 / 2197.0 * k3[i])
        i += 1
        if i >= n:
            break
    field(mode, t + 12.0 / 13.0 * h, v, q, k4)
    i = 0
    while True:
        v[i] = u[i] + h * (439.0 / 216.0 * k1[i] - 8.0 * k2[i] + 3680.0 / 513.0 * k3[i] - 845.0 / 4104.0 * k4[i])
        i += 1
        if i >= n:
            break
    field(mode, t + h, v, q, k5)
    i = 0
    while True:
        v[i] = u[i] + h * (
            -8.0 / 27.0 * k1[i] + 2.0 * k2[i] - 3544.0 / 2565.0 * k3[i] + 1859.0 / 4104.0 * k4[i] - 0.275 * k5[i]
        )
        i += 1
        if i >= n:
            break
    field(mode, t + 0.5 * h, v, q, k6)
    square, i = 0.0, 0
    while True:
        error = h * (
            1.0 / 360.0 * k1[i] - 128.0 / 4275.0 * k3[i] - 2197.0 / 75240.0 * k4[i] + 0.02 * k5[i] + 2.0 / 55.0 * k6[i]
        )
        end = u[i] + h * (25.0 / 216.0 * k1[i] + 1408.0 / 2565.0 * k3[i] + 2197.0 / 4104.0 * k4[i] - 0.2 * k5[i])
        if fifth:
            end += error
        new[i] = end
        ratio = error / (absolute[i] + rtol * max(fabs(u[i]), fabs(end)))
        square += ratio * ratio
        i += 1
        if i >= n:
            break
    return square / n


@device
def hermite(J0, J1, rows, h, C):
    """C[i, 0..5]: the quintic of every row from value, slope and second derivative at both ends of the step."""
    g = 1.0 / h
    for i in range(rows):
        a0, a1, a2 = J0[i, 0], h * J0[i, 1], h * h * J0[i, 2]
        d1, d2 = h * J1[i, 1], h * h * J1[i, 2]
        e0 = J1[i, 0] - a0 - a1 - a2
        e1 = d1 - a1 - 2.0 * a2
        e2 = d2 - a2
        C[i, 0], C[i, 1], C[i, 2] = a0, J0[i, 1], J0[i, 2]
        C[i, 3] = (10.0 * e0 - 4.0 * e1 + e2) * g * g * g
        C[i, 4] = (-15.0 * e0 + 7.0 * e1 - 2.0 * e2) * g * g * g * g
        C[i, 5] = (6.0 * e0 - 3.0 * e1 + e2) * g * g * g * g * g


@inline
def middle(J0, J1, row, h):
    """The value of a row's quintic in the middle of the step."""
    slopes, bends = J0[row, 1] - J1[row, 1], J0[row, 2] + J1[row, 2]
    return 0.5 * (J0[row, 0] + J1[row, 0]) + h * (5.0 / 32.0 * slopes + h / 32.0 * bends)


@inline
def _certain(J0, J1, row, sign, h, error):
    """-1: sign * row certainly <= 0 on the step, 1: certainly > 0, 0: undecided (Bernstein form of the quintic)."""
    b0, b5 = sign * J0[row, 0], sign * J1[row, 0]
    s0, s1 = 0.2 * h * sign * J0[row, 1], 0.2 * h * sign * J1[row, 1]
    c0, c1 = 0.1 * h * h * sign * J0[row, 2], 0.1 * h * h * sign * J1[row, 2]
    b1, b4 = b0 + s0, b5 - s1
    b2, b3 = b0 + 2.0 * s0 + c0, b5 - 2.0 * s1 + c1
    if b0 <= 0.0 and max(b1, b2, b3, b4, b5) + error <= 0.0:
        return -1
    if min(b0, b1, b2, b3, b4, b5) - error > 0.0:
        return 1
    return 0


@once
def quiet(mode, n, h, slack, net, section, work):
    """Return whether nothing can happen on the step, seen from the jets at its two ends alone (most steps)."""
    rows, J0, J1, side, side_next, scale = net.rows, work.J0, work.J1, work.side, work.side_next, work.scale
    for j in range(net.mode_start[mode], net.mode_start[mode + 1]):
        k = net.mode_list[j]
        dead, opened = False, False
        for r in range(net.row_start[k], net.row_start[k + 1]):
            i, sign = rows[r, 0], rows[r, 1]
            certain = _certain(J0, J1, n + i, float(sign), h, slack * scale[i])
            if certain < 0 and (rows[r, 2] == 1 or J0[n + i, 0] != 0.0 or J1[n + i, 0] != 0.0):
                side_next[i] = -sign
                dead = True
                break
            if certain > 0 and sign * side[i] >= 0:
                side_next[i] = sign
            else:
                opened = True
        if opened and not dead:
            return False
    s = section.indicator
    if s >= 0 and (section.mode < 0 or section.mode == mode):
        low = _certain(J0, J1, n + s, 1.0, h, 0.0)
        if low == 0 or low * side[s] < 0:
            return False
        side_next[s] = low
    return True


@device
def first_step(J, u, n, absolute, rtol):
    """A length for the very first step: the second derivative's part of it is small."""
    slope, bend, size = 0.0, 0.0, 0.0
    for i in range(n):
        w = 1.0 / (absolute[i] + rtol * fabs(u[i]))
        size = max(size, fabs(u[i]) * w)
        slope = max(slope, fabs(J[i, 1]) * w)
        bend = max(bend, fabs(J[i, 2]) * w)
    h = inf
    if bend > 0.0:
        h = bend**-0.5 * rtol**-0.3
    if slope > 0.0:
        h = min(h, 0.1 * rtol**0.2 * max(size, 1.0 / rtol) / slope)
    return h


@inline
def time_to_transition(mode, J, n, net, h):
    """Estimated time to the next transition, from the parabolas of its rows (inf: none within h).

    A step is not planned far beyond it: the bands of a smoothed system are crossed in one step each."""
    rows = net.rows
    best = inf
    for j in range(net.mode_start[mode], net.mode_start[mode + 1]):
        k = net.mode_list[j]
        last = 0.0 if net.row_start[k + 1] > net.row_start[k] else inf
        for r in range(net.row_start[k], net.row_start[k + 1]):
            row, sign = n + rows[r, 0], rows[r, 1]
            g, s, c = sign * J[row, 0], sign * J[row, 1], sign * J[row, 2]
            if g > 0.0:
                continue
            if g + h * (max(s, 0.0) + h * max(c, 0.0)) <= 0.0:
                last = inf
                break
            at = inf
            if g == 0.0:
                if s < 0.0 < c:
                    at = -s / c
            else:
                square = s * s - 4.0 * c * g
                if square >= 0.0:
                    z = -0.5 * (s + (sqrt(square) if s >= 0.0 else -sqrt(square)))
                    if c != 0.0 and z / c > 0.0:
                        at = z / c
                    if z != 0.0 and 0.0 < g / z < at:
                        at = g / z
            last = max(last, at)
            if last >= best:
                break
        best = min(best, last)
    return best if best > 0.0 else inf
