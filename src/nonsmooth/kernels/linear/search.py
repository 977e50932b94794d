"""Crossings on one step of the exact flow.

On a step the flow is known in closed form, so a functional g is known with its slope at any of 33 nodes
(``linear.values``). A crossing is *excluded* where the cubic Hermite interpolant, raised to Bernstein degree 4 and
widened by the bound K on the fourth derivative (K h^4 / 144), keeps its sign; it is *found* where the coefficients
change sign exactly once; else the piece is halved, and at one node spacing the polynomial's own extrema decide. This
finds double roots (grazing) and several crossings in one step, and stays sharp when the step starts on the surface.

``scr`` holds Taylor polynomials in rows: one per condition under search; in ``dense`` and ``refine`` one per state,
then the condition's.
"""

from math import fabs

from nonsmooth.kernels.compile.cache import device, inline
from nonsmooth.kernels.linear.limits import THROUGHOUT
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
)
from nonsmooth.kernels.linear.tables import DEGREE, NODES, states_of, width_of
from nonsmooth.kernels.linear.values import (
    NODE,
    at_ends,
    at_node,
    bound_at,
    compose,
    dense,
    rounding,
    slope_of,
    to_node,
    value_of,
)

WIDTH = DEGREE + 1
# Further places in ``work.found``: the functional that crossed last; whether all conditions are positive at a piece's
# end; the sign of the section's functional where the leg begins.
FUNCTIONAL, HELD, SIDE = 0, 2, 3


@inline
def holds_throughout(work, rows, r):
    """Return whether row r is not strict (``>= 0``), and its indicator zero throughout."""
    f = rows[r, 0]
    return rows[r, 2] == 0 and f < work.zero.shape[0] and work.zero[f] == THROUGHOUT


@inline
def refine(tables, work, mode, f, sign, zero, guess):
    """The upward root of a functional near a good guess, on its polynomial beside the nearest node; -1: not found.

    Halley's method: of third order, so that two steps mostly do. What has not converged is not found."""
    n = states_of(tables.field)
    spacing, scr = tables.info[mode, 1], work.scr
    tau = guess
    result = -1.0
    for _ in range(4):
        node = min(max(int(tau / spacing + 0.5), 0), NODES)
        at_node(tables, work, mode, node)
        compose(tables, mode, f, work.wn, scr, n)
        if node == 0 and zero != 0:
            for k in range(zero):
                scr[n, k] = 0.0
        local = tau - node * spacing
        converged = False
        slope = 1.0
        for _k in range(10):
            if not (fabs(local) <= 0.75 * spacing):
                break
            value = horner(scr, n, local)
            slope = slope_at(scr, n, local)
            half = 0.5 * curvature_at(scr, n, local)
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
    to_node(tables, work.row, mode, node, work.w, wn)
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
            if holds_throughout(work, rows, r):
                continue
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
    n, m = states_of(tables.field), width_of(tables.field)
    w, zero, spacing = work.w, work.zero, tables.info[mode, 1]
    soon = False
    for r in range(lo, hi):
        f = rows[r, 0]
        if f < zero.shape[0] and zero[f] == 1:
            bend = tables.tay[mode, f, n, 2]
            for j in range(m):
                if j != n:
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
            to_node(tables, work.row, mode, node, w, wp)
            to_node(tables, work.row, mode, last, w, wq)
        n_open = 0
        n_once = 0
        once = lo
        a0 = a1 = r0 = r1 = 0.0
        never = True  # nor what holds throughout, from when it was taken
        for r in range(lo, hi):
            if holds_throughout(work, rows, r):
                continue
            never = False
            f = rows[r, 0]
            sign = float(rows[r, 1])
            g0, s0, g1, s1 = at_ends(tables, mode, f, w if size == NODES else wp, w1 if size == NODES else wq)
            g0, s0, g1, s1 = sign * g0, sign * s0, sign * g1, sign * s1
            if node == 0 and f < zero.shape[0] and zero[f] != 0:
                g0 = 0.0
                if zero[f] >= 2:
                    s0 = 0.0
            kind = classify(g0, s0, g1, s1, h, bound_at(tables, work.row, mode, f, w))
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
                            if not holds_throughout(work, rows, r):
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
