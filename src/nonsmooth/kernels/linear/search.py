"""Crossings, extremes and dense values on one step of the exact flow.

On a step the flow is known in closed form, so a functional g (an indicator, a state, an output) is known with
its slope at any of 33 nodes for a dozen multiplications, and as a Taylor polynomial of degree 7 beside a node
(remainder below 1e-16 of the amplitude over 3/4 of a node spacing of 0.05 rad, 4e-18 over half of it). A crossing is
*excluded* where the cubic Hermite interpolant, raised to Bernstein degree 4 and widened by the bound K on the
fourth derivative (K h^4 / 144), keeps its sign; it is *found* where the coefficients change sign exactly once; else
the piece is halved, and at one node spacing the polynomial's own extrema decide. This finds double roots (grazing)
and several crossings in one step, and stays sharp when the step starts on the surface.

``scr`` holds Taylor polynomials in rows: one per condition under search; in ``dense`` and ``refine`` one per state,
then the condition's.
"""

from math import fabs

from nonsmooth.kernels.compile.cache import device, inline
from nonsmooth.kernels.compile.lanes import dot, spread, sum_columns, sum_rows, sum_some_rows
from nonsmooth.kernels.linear.polynomial import (
    NEVER,
    ONCE,
    OPEN,
    classify,
    cubic_root,
    curvature_at,
    horner,
    next_upward,
    slope_at,
)  # fmt: skip
from nonsmooth.kernels.linear.tables import DEGREE, HARMONICS, MANY, NODES, ONE, STATES, WAVE, M

EPS = 2.3e-16
WIDTH = DEGREE + 1
FEW = 8  # states of a condition that are summed one by one
# Places in ``work.found``: the functional that crossed last; the node whose w stands in ``work.wn``, with the Taylor
# coefficients of the states in the first rows of ``work.scr`` (-2 - node: without them, -1: none); whether all
# conditions are positive at a piece's end; the sign of the section's functional where the leg begins.
FUNCTIONAL, NODE, HELD, SIDE = 0, 1, 2, 3


@inline
def sum_few(total, tables, mode, f, at, w):
    """``total`` and the states' part of a functional's value (at = 0) or slope (M): one by one where they are few."""
    fun, some = tables.fun, tables.some
    count = some[mode, f, 1, 0]
    if count > FEW:
        return dot(total, fun[mode, f], at, w, STATES)
    for q in range(1, count + 1):
        j = some[mode, f, 1, q]
        total += fun[mode, f, at + j] * w[j]
    return total


@inline
def value_of(tables, mode, f, w):
    """Functional f at w. (Here and below the states come last: they are known later than the harmonics.)"""
    fun = tables.fun
    total = fun[mode, f, ONE]
    for j in range(WAVE, M):
        total += fun[mode, f, j] * w[j]
    if STATES >= MANY:
        return sum_few(total, tables, mode, f, 0, w)
    for j in range(STATES - 1, -1, -1):
        total += fun[mode, f, j] * w[j]
    return total


@inline
def slope_of(tables, mode, f, w):
    """Slope of functional f along the mode at w."""
    fun = tables.fun
    total = fun[mode, f, M + ONE]
    for j in range(WAVE, M):
        total += fun[mode, f, M + j] * w[j]
    if STATES >= MANY:
        return sum_few(total, tables, mode, f, M, w)
    for j in range(STATES - 1, -1, -1):
        total += fun[mode, f, M + j] * w[j]
    return total


@inline
def bound_at(tables, mode, f, w):
    """Bound on the fourth derivative of functional f on the step that starts at w."""
    fun, info = tables.fun, tables.info
    total = fun[mode, f, 2 * M + STATES]
    if STATES >= MANY:
        return spread(total, fun[mode, f], 2 * M, w, info[mode], STATES)
    for j in range(STATES - 1, -1, -1):
        total += fun[mode, f, 2 * M + j] * fabs(w[j] - info[mode, 2 + j])
    return total


@inline
def rounding(tables, mode, f, at, w):
    """Below this the row fun[mode, f, at:] is zero within rounding at w."""
    total = 0.0
    if STATES >= MANY:
        for q in range(1, tables.some[mode, f, 1, 0] + 1):
            j = tables.some[mode, f, 1, q]
            total += fabs(tables.fun[mode, f, at + j] * w[j])
        for j in range(STATES, M):
            total += fabs(tables.fun[mode, f, at + j] * w[j])
    else:
        for j in range(M):
            total += fabs(tables.fun[mode, f, at + j] * w[j])
    return 16.0 * EPS * total


@inline
def to_node(tables, mode, node, w, out):
    """w at a node of the step, from w at its start."""
    rot = tables.rot
    for h in range(HARMONICS):
        c = rot[mode, node, 2 * h]
        s = rot[mode, node, 2 * h + 1]
        out[WAVE + 2 * h] = w[WAVE + 2 * h] * c - w[WAVE + 1 + 2 * h] * s
        out[WAVE + 1 + 2 * h] = w[WAVE + 1 + 2 * h] * c + w[WAVE + 2 * h] * s
    sum_columns(out, tables.prop, mode, node, w, STATES, M)
    out[ONE] = 1.0


@inline
def compose(tables, mode, f, wn, scr, row):
    """Taylor coefficients of functional f at a node where w is ``wn``, into a row of scr."""
    if STATES >= MANY:
        sum_some_rows(scr, row, tables.tay, mode, f, wn, tables.some[mode, f, 0])
    else:
        sum_rows(scr, row, tables.tay, mode, f, wn, STATES, M)


@inline
def at_node(tables, work, mode, node):
    """w at a node of the step, into ``work.wn``."""
    found = work.found
    if found[NODE] != node and found[NODE] != -2 - node:
        to_node(tables, mode, node, work.w, work.wn)
        found[NODE] = -2 - node


@inline
def place(tables, work, mode, node):
    """w at a node of the step, and there the Taylor coefficients of the states (the first rows of scr)."""
    if work.found[NODE] != node:
        at_node(tables, work, mode, node)
        for r in range(STATES):
            compose(tables, mode, work.zero.shape[0] + r, work.wn, work.scr, r)
        work.found[NODE] = node


@inline
def turn(angle, c, s):
    """Cosine and sine of a phase whose cosine and sine are c and s, after a small angle (below 0.1)."""
    a2 = angle * angle
    ca = 1.0 - a2 * (0.5 - a2 * (1.0 / 24 - a2 * (1.0 / 720 - a2 * (1.0 / 40320))))
    sa = angle * (1.0 - a2 * (1.0 / 6 - a2 * (1.0 / 120 - a2 * (1.0 / 5040 - a2 * (1.0 / 362880)))))
    return c * ca - s * sa, s * ca + c * sa


@inline
def dense(tables, work, mode, tau, out):
    """w at any instant of the step."""
    spacing = tables.info[mode, 1]
    wn, scr, rates = work.wn, work.scr, work.rates
    node = work.found[NODE] if work.found[NODE] >= 0 else -2 - work.found[NODE]
    if node < 0 or fabs(tau - node * spacing) > 0.75 * spacing:
        node = min(int(tau / spacing + 0.5), NODES)
    place(tables, work, mode, node)
    local = tau - node * spacing
    for r in range(STATES):
        out[r] = horner(scr, r, local)
    out[ONE] = 1.0
    for h in range(HARMONICS):
        c, s = turn(rates[h] * local, wn[WAVE + 2 * h], wn[WAVE + 1 + 2 * h])
        out[WAVE + 2 * h] = c
        out[WAVE + 1 + 2 * h] = s


@inline
def refine(tables, work, mode, f, sign, zero, guess):
    """The upward root of a functional near a good guess, on its polynomial beside the nearest node; -1: not found.

    Halley's method: of third order, so that two steps mostly do. What has not converged is not found."""
    spacing, scr = tables.info[mode, 1], work.scr
    tau = guess
    result = -1.0
    for _ in range(4):
        node = min(max(int(tau / spacing + 0.5), 0), NODES)
        at_node(tables, work, mode, node)
        compose(tables, mode, f, work.wn, scr, STATES)
        if node == 0 and zero != 0:
            for k in range(zero):
                scr[STATES, k] = 0.0
        local = tau - node * spacing
        converged = False
        slope = 1.0
        for _k in range(10):
            if not (fabs(local) <= 0.75 * spacing):
                break
            value = horner(scr, STATES, local)
            slope = slope_at(scr, STATES, local)
            half = 0.5 * curvature_at(scr, STATES, local)
            change = value * slope / (slope * slope - value * half)
            local -= change
            # the next change would be the cube of this one, over the square of the time scale
            if fabs(change) <= 1e-4 * spacing and fabs(change * half) <= 4e-6 * fabs(slope):
                converged = True
                break
        tau = node * spacing + local
        if converged:
            if slope * sign > 0.0 and tau >= 0.0:
                result = tau
            break
        if not (0.0 <= tau <= NODES * spacing):
            break
    return result


@device
def rises_with(tables, work, mode, f, row, tau):
    """Return whether the functional in a row of scr is zero at tau within rounding and rises.

    Where conditions become true together rounding says of each that it does so just behind the other."""
    near = fabs(horner(work.scr, row, tau)) <= rounding(tables, mode, f, 0, work.wn)
    return near and slope_at(work.scr, row, tau) > 0.0


@device
def finest(tables, work, mode, rows, lo, hi, node, up):
    """First instant within one node spacing at which all rows lo..hi become positive, on their polynomials; -1: none.

    ``up``: they are positive at its start already, so one has to fall first."""
    spacing = tables.info[mode, 1]
    wn, scr, points, zero, found = work.wn, work.scr, work.points, work.zero, work.found
    to_node(tables, mode, node, work.w, wn)
    found[NODE] = -1
    for r in range(lo, hi):
        row = r - lo
        compose(tables, mode, rows[r, 0], wn, scr, row)
        if rows[r, 1] < 0:
            for k in range(WIDTH):
                scr[row, k] = -scr[row, k]
        if node == 0 and rows[r, 0] < zero.shape[0] and zero[rows[r, 0]] != 0:
            for k in range(zero[rows[r, 0]]):
                scr[row, k] = 0.0
    tau = 0.0
    current = -1
    if up:
        fall = 2.0 * spacing
        for r in range(lo, hi):
            row = r - lo
            for k in range(WIDTH):
                scr[row, k] = -scr[row, k]
            first = next_upward(scr, row, 0.0, spacing, points)
            for k in range(WIDTH):
                scr[row, k] = -scr[row, k]
            if first >= 0.0 and first < fall:
                fall = first
                current = -2 - r
        found[HELD] = 1
        if current == -1:
            return -1.0
        tau = fall
    for _ in range(8 * (hi - lo) + 8):
        moved = False
        for r in range(lo, hi):
            row = r - lo
            if current != -2 - r and (r == current or horner(scr, row, tau) > 0.0):
                continue
            if current >= lo and rises_with(tables, work, mode, rows[r, 0], row, tau):
                continue
            found[HELD] = 0
            tau = next_upward(scr, row, tau, spacing, points)
            if tau < 0.0:
                return -1.0
            current = r
            moved = True
            break
        if not moved:
            found[FUNCTIONAL] = rows[max(current, lo), 0]
            return tau
    return -1.0


@inline
def returns_at_once(tables, work, mode, rows, lo, hi):
    """Return whether a condition that begins on its surface comes back to it within one node spacing, as in chatter."""
    w, zero, spacing = work.w, work.zero, tables.info[mode, 1]
    soon = False
    for r in range(lo, hi):
        f = rows[r, 0]
        if f < zero.shape[0] and zero[f] == 1:
            bend = tables.tay[mode, f, ONE, 2]
            for j in range(M):
                if j != ONE:
                    bend += tables.tay[mode, f, j, 2] * w[j]
            slope = slope_of(tables, mode, f, w)
            soon = soon or (slope * bend < 0.0 and fabs(slope) < fabs(bend) * spacing)
    return soon


@inline
def search(tables, work, mode, rows, lo, hi, held, r_max):
    """First instant in [0, r_max] of the step at which all the rows lo..hi become positive; -1: none.

    ``held``: they were positive when the step began, so one has to fall first. Not so for transitions: the
    after-limits saw a condition that did not hold, and one that holds now has become true at the start.
    ``work.w`` and ``w1`` stand at the ends of the whole step; ``there`` receives w at the crossing.
    """
    spacing = tables.info[mode, 1]
    w, w1, wp, wq, end, zero, found = work.w, work.w1, work.wp, work.wq, work.there, work.zero, work.found
    size = 1 if returns_at_once(tables, work, mode, rows, lo, hi) else NODES
    node = 0
    up = held
    while node < NODES and node * spacing <= r_max:
        last = node + size
        h = size * spacing
        if size < NODES:
            to_node(tables, mode, node, w, wp)
            to_node(tables, mode, last, w, wq)
        n_open = 0
        n_once = 0
        once = lo
        a0 = a1 = r0 = r1 = 0.0
        never = False
        for r in range(lo, hi):
            f = rows[r, 0]
            sign = float(rows[r, 1])
            if size == NODES:
                g0 = sign * value_of(tables, mode, f, w)
                s0 = sign * slope_of(tables, mode, f, w)
                g1 = sign * value_of(tables, mode, f, w1)
                s1 = sign * slope_of(tables, mode, f, w1)
            else:
                g0 = sign * value_of(tables, mode, f, wp)
                s0 = sign * slope_of(tables, mode, f, wp)
                g1 = sign * value_of(tables, mode, f, wq)
                s1 = sign * slope_of(tables, mode, f, wq)
            if node == 0 and f < zero.shape[0] and zero[f] != 0:
                g0 = 0.0
                if zero[f] >= 2:
                    s0 = 0.0
            kind = classify(g0, s0, g1, s1, h, bound_at(tables, mode, f, w))
            if kind == NEVER:
                never = True
                break
            if kind == ONCE:
                n_once += 1
                if n_once == 1:
                    once = r
                    a0, r0, a1, r1 = g0, s0, g1, s1
            elif kind == OPEN:
                n_open += 1
        if not never:
            if n_open == 0 and n_once == 0:
                if not up:
                    found[FUNCTIONAL] = rows[lo, 0]
                    dense(tables, work, mode, node * spacing, end)
                    return node * spacing
                node = last
                while size < NODES // 2 and node % (2 * size) == 0:
                    size *= 2
                continue
            if n_open == 0:
                # every row crosses at most once: all are positive from the last of these crossings on
                tau = node * spacing + h * cubic_root(a0, r0, a1, r1, h)
                row = once
                for _ in range(n_once):
                    f = rows[row, 0]
                    flag = zero[f] if f < zero.shape[0] else 0
                    tau = refine(tables, work, mode, f, float(rows[row, 1]), flag, tau)
                    # the root of another piece is not the one that is certain here
                    if not ((node - 1e-6) * spacing <= tau <= (last + 1e-6) * spacing):
                        tau = -1.0
                        break
                    if tau > r_max:  # none of the rows matters that cross still later
                        return -1.0
                    found[FUNCTIONAL] = f
                    dense(tables, work, mode, tau, end)
                    behind = -1
                    for r in range(lo, hi):
                        if r != row and rows[r, 1] * value_of(tables, mode, rows[r, 0], end) <= 0.0:
                            behind = r
                    if behind < 0:
                        break
                    row = behind
                if tau >= 0.0:
                    return tau
            if size > 1:
                size //= 2
                continue
            tau = finest(tables, work, mode, rows, lo, hi, node, up)
            if tau >= 0.0:
                tau += node * spacing
                if tau > r_max:
                    return -1.0
                dense(tables, work, mode, tau, end)
                return tau
            up = found[HELD] != 0
        else:
            up = False
        node = last
        while size < NODES // 2 and node % (2 * size) == 0:
            size *= 2
    return -1.0
