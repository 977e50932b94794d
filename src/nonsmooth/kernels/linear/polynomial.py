"""Sign, roots and extrema of the short polynomials on a step of the exact flow.

``classify`` and ``cubic_root`` see a piece through values and slopes at its ends; the others work on Taylor
coefficients of degree 7 (``linear_tables.DEGREE``, written out here) in a row of ``scr``.
"""

from math import fabs

from nonsmooth.kernels.compile.cache import device, inline

NEVER, ALWAYS, ONCE, OPEN = -1, 1, 2, 0
THIRD = 1.0 / 3.0


@inline
def horner(scr, row, tau):
    """A row's polynomial: in pairs (Estrin), a shorter chain of operations than Horner's rule; likewise below."""
    t2 = tau * tau
    low = (scr[row, 0] + scr[row, 1] * tau) + t2 * (scr[row, 2] + scr[row, 3] * tau)
    high = (scr[row, 4] + scr[row, 5] * tau) + t2 * (scr[row, 6] + scr[row, 7] * tau)
    return low + t2 * t2 * high


@inline
def slope_at(scr, row, tau):
    """Slope of a row's polynomial."""
    t2 = tau * tau
    low = (scr[row, 1] + 2.0 * scr[row, 2] * tau) + t2 * (3.0 * scr[row, 3] + 4.0 * scr[row, 4] * tau)
    high = (5.0 * scr[row, 5] + 6.0 * scr[row, 6] * tau) + t2 * (7.0 * scr[row, 7])
    return low + t2 * t2 * high


@inline
def curvature_at(scr, row, tau):
    """Second derivative of a row's polynomial."""
    t2 = tau * tau
    low = (2.0 * scr[row, 2] + 6.0 * scr[row, 3] * tau) + t2 * (12.0 * scr[row, 4] + 20.0 * scr[row, 5] * tau)
    return low + t2 * t2 * (30.0 * scr[row, 6] + 42.0 * scr[row, 7] * tau)


@device
def derivative(scr, row, order, tau):
    """The polynomial of a row (order 0), its slope (1) or its second derivative (2)."""
    if order == 0:
        return horner(scr, row, tau)
    if order == 1:
        return slope_at(scr, row, tau)
    return curvature_at(scr, row, tau)


@device
def bracketed(scr, row, order, lo, hi):
    """Root of ``derivative(order)`` where it changes sign on [lo, hi]: Newton, kept inside the bracket.

    Where a change is not below half of the one before the bracket is halved instead: the bound is never reached."""
    rising = derivative(scr, row, order, hi) > 0.0
    tau = 0.5 * (lo + hi)
    last = hi - lo
    for _ in range(200):
        value = derivative(scr, row, order, tau)
        if value == 0.0:
            return tau
        if (value > 0.0) == rising:
            hi = tau
        else:
            lo = tau
        slope = derivative(scr, row, order + 1, tau) if order < 2 else 0.0
        nxt = tau - value / slope if slope != 0.0 else lo
        if not (lo < nxt < hi and 2.0 * fabs(nxt - tau) <= last):
            nxt = 0.5 * (lo + hi)
        last = fabs(nxt - tau)
        if nxt == tau or not (lo < nxt < hi):
            return nxt
        tau = nxt
    return tau


@device
def critical_points(scr, row, lo, hi, out):
    """Zeros of the polynomial's slope in (lo, hi), increasing; at most two per sign of its third derivative, which
    is taken to keep its sign over such a short piece."""
    d0, d1 = curvature_at(scr, row, lo), curvature_at(scr, row, hi)
    s0, s1 = slope_at(scr, row, lo), slope_at(scr, row, hi)
    pieces = 1
    middle = hi
    if s0 * s1 >= 0.0:
        if not ((d0 < 0.0 and d1 > 0.0) or (d0 > 0.0 and d1 < 0.0)):
            return 0
        meet = s0 + d0 * (s1 - s0 - d1 * (hi - lo)) / (d0 - d1)  # the slope goes no further than its tangents
        if meet * s0 > 0.0 and meet * s1 > 0.0:
            return 0
        middle = bracketed(scr, row, 2, lo, hi)
        pieces = 2
    n = 0
    left = lo
    for piece in range(pieces):
        right = middle if piece == 0 else hi
        s0 = slope_at(scr, row, left)
        s1 = slope_at(scr, row, right)
        if (s0 < 0.0 and s1 > 0.0) or (s0 > 0.0 and s1 < 0.0):
            out[n] = bracketed(scr, row, 1, left, right)
            n += 1
        left = right
    return n


@device
def next_upward(scr, row, lo, hi, points):
    """First tau >= lo at which the polynomial goes from <= 0 to > 0, or -1."""
    n = critical_points(scr, row, lo, hi, points)
    left = lo
    g_left = horner(scr, row, lo)
    for piece in range(n + 1):
        right = points[piece] if piece < n else hi
        g_right = horner(scr, row, right)
        if g_left <= 0.0 and g_right > 0.0:
            return bracketed(scr, row, 0, left, right) if g_left < 0.0 else left
        left = right
        g_left = g_right
    return -1.0


@inline
def classify(g0, s0, g1, s1, h, bound):
    """The certain answer about the sign of g on a piece of length h: NEVER > 0, ALWAYS > 0, upward ONCE, or OPEN."""
    b1 = g0 + h * s0 * THIRD
    b2 = g1 - h * s1 * THIRD
    c1 = g0 + 3.0 * b1
    c2 = 0.5 * (b1 + b2)
    c3 = 3.0 * b2 + g1
    h2 = h * h
    wide = bound * h2 * h2 * (1.0 / 144.0)
    kind = OPEN
    if g0 <= 0.0:
        if g1 <= 0.0:
            if c1 <= 0.0 and c2 + wide <= 0.0 and c3 <= 0.0:
                kind = NEVER
        elif c1 > 0.0:
            if c2 - wide > 0.0 and c3 > 0.0:
                kind = ONCE if g0 < 0.0 else ALWAYS
        elif c2 + wide <= 0.0 or c3 > 0.0:
            kind = ONCE
    elif c1 >= 0.0 and c2 - wide >= 0.0 and c3 >= 0.0 and g1 >= 0.0:
        kind = ALWAYS
    return kind


@inline
def monotone(g0, s0, g1, s1, h, bound):
    """Return whether g certainly rises, or falls, all along a piece of length h.

    The slope of the Hermite cubic is off by at most sqrt(3) K h^3 / 216 (Birkhoff and Priver, 1967)."""
    middle = 3.0 * (g1 - g0) / h - s0 - s1
    wide = 0.00801876 * bound * h * h * h
    return min(min(s0, s1), middle) > wide or max(max(s0, s1), middle) < -wide


@inline
def cubic_root(g0, s0, g1, s1, h):
    """The upward root of the Hermite cubic, as a fraction of the piece (a first guess)."""
    rise = g1 - g0
    c1 = h * s0
    c2 = 3.0 * rise - h * (2.0 * s0 + s1)
    c3 = h * (s0 + s1) - 2.0 * rise
    # with g0 = 0 the root at the start is divided out
    q0 = g0
    q1 = c1
    q2 = c2
    q3 = c3
    x = 0.5
    if g0 < 0.0:
        x = g0 / (g0 - g1)
    else:
        q0, q1, q2, q3 = c1, c2, c3, 0.0
    for _ in range(3):  # Halley's method
        value = q0 + x * (q1 + x * (q2 + x * q3))
        slope = q1 + x * (2.0 * q2 + 3.0 * x * q3)
        if slope <= 0.0:
            break
        change = value * slope / (slope * slope - value * (q2 + 3.0 * x * q3))
        x = min(max(x - change, 0.0), 1.0)
        if fabs(change) < 0.1:
            break
    return x
