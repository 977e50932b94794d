"""Crossings, extremes and dense values on one step of the planar exact flow.

On a step the flow is known in closed form, so a functional g (an indicator, a state, an output) is known with
its slope at any of 33 nodes for a dozen multiplications, and as a Taylor polynomial of degree 9 beside a node
(remainder below 1e-18 of the amplitude over a node spacing of 0.04 rad). A crossing is *excluded* where the cubic
Hermite interpolant, raised to Bernstein degree 4 and widened by the bound K on the fourth derivative
(K h^4 / 144), keeps its sign; it is *found* where the coefficients change sign exactly once; else the piece is
halved, and at one node spacing the polynomial's own extrema decide. This finds double roots (grazing) and several
crossings in one step, and stays sharp when the step starts on the surface.

``scr`` holds Taylor coefficients in rows: x, v, then the harmonics, then one row per condition under search.
"""

from math import fabs

from .cache import device, inline
from .planar_tables import HARMONICS, NODES, M

DEGREE = 9
WIDTH = DEGREE + 1
ROW = 2 + 2 * HARMONICS  # first row of scr for a condition
NEVER, ALWAYS, ONCE, OPEN = -1, 1, 2, 0
THIRD = 1.0 / 3.0
INVERSE = (1.0, 1.0 / 2, 1.0 / 3, 1.0 / 4, 1.0 / 5, 1.0 / 6, 1.0 / 7, 1.0 / 8, 1.0 / 9)


@inline
def value_of(fun, mode, f, w):
    """Functional f at w."""
    total = fun[mode, f, 0] * w[0] + fun[mode, f, 1] * w[1] + fun[mode, f, 2]
    for j in range(3, M):
        total += fun[mode, f, j] * w[j]
    return total


@inline
def slope_of(fun, mode, f, w):
    """Slope of functional f along the mode at w."""
    total = fun[mode, f, M] * w[0] + fun[mode, f, M + 1] * w[1] + fun[mode, f, M + 2]
    for j in range(3, M):
        total += fun[mode, f, M + j] * w[j]
    return total


@inline
def bound_at(fun, info, mode, f, w):
    """Bound on the fourth derivative of functional f on the step that starts at w."""
    dx = fabs(w[0] - info[mode, 2])
    dv = fabs(w[1] - info[mode, 3])
    return fun[mode, f, 2 * M] * dx + fun[mode, f, 2 * M + 1] * dv + fun[mode, f, 2 * M + 2]


@inline
def to_node(prop, rot, mode, node, w, out):
    """w at a node of the step, from w at its start."""
    x = prop[mode, node, 0, 0] * w[0] + prop[mode, node, 0, 1] * w[1] + prop[mode, node, 0, 2]
    v = prop[mode, node, 1, 0] * w[0] + prop[mode, node, 1, 1] * w[1] + prop[mode, node, 1, 2]
    for j in range(3, M):
        x += prop[mode, node, 0, j] * w[j]
        v += prop[mode, node, 1, j] * w[j]
    for h in range(HARMONICS):
        c = rot[mode, node, 2 * h]
        s = rot[mode, node, 2 * h + 1]
        out[3 + 2 * h] = w[3 + 2 * h] * c - w[4 + 2 * h] * s
        out[4 + 2 * h] = w[4 + 2 * h] * c + w[3 + 2 * h] * s
    out[0] = x
    out[1] = v
    out[2] = 1.0


@device
def place(prop, rot, field, mode, rates, w, node, wn, scr, mark):
    """Taylor coefficients of x, v and the harmonics at a node of the step, into the first rows of scr."""
    to_node(prop, rot, mode, node, w, wn)
    for j in range(3, M):
        scr[j - 1, 0] = wn[j]
    for k in range(DEGREE):
        inverse = INVERSE[k]
        for h in range(HARMONICS):
            rate = rates[h] * inverse
            scr[2 + 2 * h, k + 1] = -rate * scr[3 + 2 * h, k]
            scr[3 + 2 * h, k + 1] = rate * scr[2 + 2 * h, k]
    a00 = field[mode, 0, 0]
    a01 = field[mode, 0, 1]
    a10 = field[mode, 1, 0]
    a11 = field[mode, 1, 1]
    x = wn[0]
    v = wn[1]
    scr[0, 0] = x
    scr[1, 0] = v
    for k in range(DEGREE):
        dx = a00 * x + a01 * v
        dv = a10 * x + a11 * v
        if k == 0:
            dx += field[mode, 0, 2]
            dv += field[mode, 1, 2]
        for j in range(3, M):
            dx += field[mode, 0, j] * scr[j - 1, k]
            dv += field[mode, 1, j] * scr[j - 1, k]
        x = dx * INVERSE[k]
        v = dv * INVERSE[k]
        scr[0, k + 1] = x
        scr[1, k + 1] = v
    mark[0] = node


@inline
def compose(fun, mode, f, scr, row):
    """Taylor coefficients of functional f from those of w, into a row of scr."""
    for k in range(WIDTH):
        total = fun[mode, f, 0] * scr[0, k] + fun[mode, f, 1] * scr[1, k]
        for j in range(3, M):
            total += fun[mode, f, j] * scr[j - 1, k]
        scr[row, k] = total
    scr[row, 0] += fun[mode, f, 2]


@inline
def horner(scr, row, tau):
    total = scr[row, DEGREE]
    for k in range(DEGREE - 1, -1, -1):
        total = total * tau + scr[row, k]
    return total


@inline
def slope_at(scr, row, tau):
    """Slope of a row's polynomial."""
    total = DEGREE * scr[row, DEGREE]
    for k in range(DEGREE - 1, 0, -1):
        total = total * tau + k * scr[row, k]
    return total


@inline
def curvature_at(scr, row, tau):
    """Second derivative of a row's polynomial."""
    total = DEGREE * (DEGREE - 1) * scr[row, DEGREE]
    for k in range(DEGREE - 1, 1, -1):
        total = total * tau + k * (k - 1) * scr[row, k]
    return total


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
    """Root of ``derivative(order)`` where it changes sign on [lo, hi]: Newton, kept inside the bracket."""
    rising = derivative(scr, row, order, hi) > 0.0
    tau = 0.5 * (lo + hi)
    for _ in range(80):
        value = derivative(scr, row, order, tau)
        if value == 0.0:
            return tau
        if (value > 0.0) == rising:
            hi = tau
        else:
            lo = tau
        slope = derivative(scr, row, order + 1, tau) if order < 2 else 0.0
        nxt = tau - value / slope if slope != 0.0 else lo
        if not (lo < nxt < hi):
            nxt = 0.5 * (lo + hi)
        if nxt == tau or not (lo < nxt < hi):
            return nxt
        tau = nxt
    return tau


@device
def critical_points(scr, row, lo, hi, out):
    """Zeros of the polynomial's slope in (lo, hi), increasing; at most two per sign of its third derivative, which
    is taken to keep its sign over such a short piece."""
    d0 = curvature_at(scr, row, lo)
    d1 = curvature_at(scr, row, hi)
    pieces = 1
    middle = hi
    if (d0 < 0.0 and d1 > 0.0) or (d0 > 0.0 and d1 < 0.0):
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
    """What is certain about the sign of g on a piece of length h: NEVER > 0, ALWAYS > 0, upward ONCE, or OPEN."""
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
def cubic_root(g0, s0, g1, s1, h):
    """The upward root of the Hermite cubic, as a fraction of the piece (a first guess)."""
    rise = g1 - g0
    c1 = h * s0
    c2 = 3.0 * rise - h * (2.0 * s0 + s1)
    c3 = h * (s0 + s1) - 2.0 * rise
    lo = 0.0
    hi = 1.0
    x = g0 / (g0 - g1) if g0 < 0.0 else 0.5
    for _ in range(5):
        # with g0 = 0 the root at the start is divided out
        if g0 < 0.0:
            value = g0 + x * (c1 + x * (c2 + x * c3))
            slope = c1 + x * (2.0 * c2 + 3.0 * x * c3)
        else:
            value = c1 + x * (c2 + x * c3)
            slope = c2 + 2.0 * x * c3
        if value > 0.0:
            hi = x
        else:
            lo = x
        nxt = x - value / slope if slope > 0.0 else 0.5 * (lo + hi)
        if not (lo <= nxt <= hi):
            nxt = 0.5 * (lo + hi)
        change = fabs(nxt - x)
        x = nxt
        if change < 1e-2:
            break
    return x


@inline
def refine(prop, rot, fun, field, info, mode, rates, w, f, sign, zero, guess, wn, scr, mark):
    """Newton on the polynomial of a functional from a good guess; -1 where it does not end on an upward root."""
    spacing = info[mode, 1]
    tau = guess
    for _ in range(4):
        node = min(max(int(tau / spacing), 0), NODES - 1)
        if mark[0] != node:
            place(prop, rot, field, mode, rates, w, node, wn, scr, mark)
        compose(fun, mode, f, scr, ROW)
        if node == 0 and zero != 0:
            scr[ROW, 0] = 0.0
        local = tau - node * spacing
        inside = True
        for _k in range(12):
            value = horner(scr, ROW, local)
            slope = slope_at(scr, ROW, local)
            if slope * sign <= 0.0:
                return -1.0
            change = value / slope
            local -= change
            if local < -0.5 * spacing or local > 1.5 * spacing:
                inside = False
                break
            if fabs(change) <= 1e-9 * spacing:
                break
        tau = node * spacing + local
        if tau < 0.0:
            return -1.0
        if inside:
            return tau
    return -1.0


@device
def finest(prop, rot, fun, field, info, mode, rates, w, rows, lo, hi, zero, node, wn, scr, mark, points, found):
    """First instant within one node spacing at which all rows lo..hi are positive, on their polynomials; -1: none."""
    spacing = info[mode, 1]
    if mark[0] != node:
        place(prop, rot, field, mode, rates, w, node, wn, scr, mark)
    for r in range(lo, hi):
        row = ROW + r - lo
        compose(fun, mode, rows[r, 0], scr, row)
        if rows[r, 1] < 0:
            for k in range(WIDTH):
                scr[row, k] = -scr[row, k]
        if node == 0 and rows[r, 0] < zero.shape[0] and zero[rows[r, 0]] != 0:
            scr[row, 0] = 0.0
    tau = 0.0
    current = -1
    for _ in range(8 * (hi - lo) + 8):
        moved = False
        for r in range(lo, hi):
            row = ROW + r - lo
            if r == current or horner(scr, row, tau) > 0.0:
                continue
            tau = next_upward(scr, row, tau, spacing, points)
            if tau < 0.0:
                return -1.0
            current = r
            moved = True
            break
        if not moved:
            found[0] = rows[max(current, lo), 0]
            return tau
    return -1.0


@inline
def search(prop, rot, fun, field, info, mode, rates, w, w1, rows, lo, hi, zero, r_max, wn, wp, wq, scr, mark, points, found):
    """First instant in [0, r_max] of the step at which all the rows lo..hi are positive; -1: none.

    ``w`` and ``w1`` stand at the ends of the whole step; ``found[0]`` is the functional that crossed last.
    """
    spacing = info[mode, 1]
    size = NODES
    node = 0
    while node < NODES and node * spacing <= r_max:
        end = node + size
        h = size * spacing
        if size < NODES:
            to_node(prop, rot, mode, node, w, wp)
            to_node(prop, rot, mode, end, w, wq)
        n_open = 0
        n_once = 0
        once = lo
        guess = 0.0
        never = False
        for r in range(lo, hi):
            f = rows[r, 0]
            sign = float(rows[r, 1])
            if size == NODES:
                g0 = sign * value_of(fun, mode, f, w)
                s0 = sign * slope_of(fun, mode, f, w)
                g1 = sign * value_of(fun, mode, f, w1)
                s1 = sign * slope_of(fun, mode, f, w1)
            else:
                g0 = sign * value_of(fun, mode, f, wp)
                s0 = sign * slope_of(fun, mode, f, wp)
                g1 = sign * value_of(fun, mode, f, wq)
                s1 = sign * slope_of(fun, mode, f, wq)
            if node == 0 and f < zero.shape[0] and zero[f] != 0:
                g0 = 0.0
            kind = classify(g0, s0, g1, s1, h, bound_at(fun, info, mode, f, w))
            if kind == NEVER:
                never = True
                break
            if kind == ONCE:
                n_once += 1
                once = r
                guess = node * spacing + h * cubic_root(g0, s0, g1, s1, h)
            elif kind == OPEN:
                n_open += 1
        if not never:
            if n_open == 0 and n_once == 0:
                found[0] = rows[lo, 0]
                return node * spacing
            if n_open == 0 and n_once == 1:
                f = rows[once, 0]
                flag = zero[f] if f < zero.shape[0] else 0
                tau = refine(
                    prop, rot, fun, field, info, mode, rates, w, f, float(rows[once, 1]), flag, guess, wn, scr, mark
                )
                if tau >= 0.0:
                    found[0] = f
                    return tau
            if size > 1:
                size //= 2
                continue
            tau = finest(
                prop, rot, fun, field, info, mode, rates, w, rows, lo, hi, zero, node, wn, scr, mark, points, found
            )
            if tau >= 0.0:
                return node * spacing + tau
        node = end
        while size < NODES // 2 and node % (2 * size) == 0:
            size *= 2
    return -1.0


@inline
def dense(prop, rot, field, info, mode, rates, w, tau, wn, scr, mark, out):
    """w at any instant of the step."""
    spacing = info[mode, 1]
    node = min(max(int(tau / spacing), 0), NODES - 1)
    if mark[0] >= 0 and -0.5 * spacing <= tau - mark[0] * spacing <= 1.5 * spacing:
        node = mark[0]
    else:
        place(prop, rot, field, mode, rates, w, node, wn, scr, mark)
    local = tau - node * spacing
    out[0] = horner(scr, 0, local)
    out[1] = horner(scr, 1, local)
    out[2] = 1.0
    for j in range(3, M):
        out[j] = horner(scr, j - 1, local)


@device
def locate_maximum(prop, rot, fun, field, info, mode, rates, w, f, sign, a, b, best, wn, wp, wq, scr, mark, points):
    """The larger of ``best`` and the maximum of sign * functional over [a, b] of the step, piece by piece."""
    spacing = info[mode, 1]
    size = NODES // 8
    bound = bound_at(fun, info, mode, f, w)
    for node in range(0, NODES, size):
        lo = max(a - node * spacing, 0.0)
        hi = min(b - node * spacing, size * spacing)
        if lo > hi:
            continue
        to_node(prop, rot, mode, node, w, wp)
        to_node(prop, rot, mode, node + size, w, wq)
        g0 = sign * value_of(fun, mode, f, wp) - best
        g1 = sign * value_of(fun, mode, f, wq) - best
        s0 = sign * slope_of(fun, mode, f, wp)
        s1 = sign * slope_of(fun, mode, f, wq)
        if classify(g0, s0, g1, s1, size * spacing, bound) == NEVER:
            continue
        if mark[0] != node:
            place(prop, rot, field, mode, rates, w, node, wn, scr, mark)
        compose(fun, mode, f, scr, ROW)
        n = critical_points(scr, ROW, lo, hi, points)
        best = max(best, sign * horner(scr, ROW, lo), sign * horner(scr, ROW, hi))
        for k in range(n):
            best = max(best, sign * horner(scr, ROW, points[k]))
    return best


@inline
def raise_maximum(prop, rot, fun, field, info, mode, rates, w, w1, f, sign, a, b, best, wn, wp, wq, scr, mark, points):
    """The larger of ``best`` and the maximum of sign * functional over [a, b] of the step; cheap where it is not raised."""
    g0 = sign * value_of(fun, mode, f, w) - best
    g1 = sign * value_of(fun, mode, f, w1) - best
    s0 = sign * slope_of(fun, mode, f, w)
    s1 = sign * slope_of(fun, mode, f, w1)
    if classify(g0, s0, g1, s1, info[mode, 0], bound_at(fun, info, mode, f, w)) == NEVER:
        return best
    return locate_maximum(
        prop, rot, fun, field, info, mode, rates, w, f, sign, a, b, best, wn, wp, wq, scr, mark, points
    )
