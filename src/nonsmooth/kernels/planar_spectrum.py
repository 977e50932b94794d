"""Growth of small changes along a trajectory of a planar system, by the exact flow: what Lyapunov exponents are.

The march is that of the record, without its log. A leg multiplies the frame Q by exp(A tau), from the tables of the
leg itself; a crossing by its saltation matrix S = R_u + (R_u f- + R_t - f+) t_u, t_u = -h_u / h'. After each leg the
frame is made orthonormal again, and the lengths that are divided out are multiplied up.
"""

from math import fabs, isfinite, log, sqrt

from .cache import device, inline, kernel
from .codes import CHATTER, DIVERGED, OK, TOO_MANY_CROSSINGS
from .linear_layout import _INTEGERS, _LINEAR, _MATRIX, _NET, _SCRATCH, _VECTOR, BURST, MOST_CROSSINGS, SHORT
from .linear_march import bounded, jump, leg, mark_zeros, next_holding, set_phase, settle, trigger, wrap_phase
from .linear_search import slope_of
from .linear_tables import HARMONICS, NODES, M, build

LOST = 1e-13  # a determinant below this part of the product of the rows' sizes is that of a singular matrix


@inline
def exponential(tau, prop, tay, info, mode, n_i, X):
    """X = exp(A tau) for 0 <= tau <= the step, from the node nearest to tau and the Taylor rows of the states."""
    spacing = info[mode, 1]
    node = min(int(tau / spacing + 0.5), NODES)
    local = tau - node * spacing
    for r in range(2):
        a = 0.0
        b = 0.0
        for k in range(7, -1, -1):
            a = a * local + tay[mode, n_i + r, 0, k]
            b = b * local + tay[mode, n_i + r, 1, k]
        for c in range(2):
            X[r, c] = a * prop[mode, node, c, 0] + b * prop[mode, node, c, 1]


@inline
def apply(X, Q):
    """Q = X Q."""
    for c in range(2):
        a = X[0, 0] * Q[0, c] + X[0, 1] * Q[1, c]
        Q[1, c] = X[1, 0] * Q[0, c] + X[1, 1] * Q[1, c]
        Q[0, c] = a


@inline
def orthonormal(Q, lengths, scale):
    """Make the columns of Q orthonormal in units of ``scale``; ``lengths`` are multiplied by what they had become."""
    a0 = Q[0, 0] / scale[0]
    a1 = Q[1, 0] / scale[1]
    b0 = Q[0, 1] / scale[0]
    b1 = Q[1, 1] / scale[1]
    length = sqrt(a0 * a0 + a1 * a1)
    if length > 0.0:
        area = fabs(a0 * b1 - a1 * b0) / length
        a0 /= length
        a1 /= length
    else:
        area = 0.0
        a0, a1 = 1.0, 0.0
    lengths[0] *= length
    lengths[1] *= area
    Q[0, 0] = a0 * scale[0]
    Q[1, 0] = a1 * scale[1]
    Q[0, 1] = -a1 * scale[0]
    Q[1, 1] = a0 * scale[1]


@inline
def put_away(lengths, growth, index):
    """Move the logarithms of the lengths to ``growth``; a length of zero is lost for good: minus infinity."""
    for c in range(2):
        growth[index, c] += log(lengths[c])
        lengths[c] = 1.0


@device
def saltation(i, t, before, after, field, mode, new_mode, transitions, ra, rc, rs, rates, t_z, S, first):
    """One more transition of an instant: S = its derivative times S, ``first`` that of the first one, from I.

    ``before``, ``after``: w at both sides. ``t_z`` is the derivative of the instant in the state before the first."""
    for r in range(2):
        slip = 0.0
        for j in range(M):
            slip -= field[new_mode, r, j] * after[j]
        a = 1.0 if r == 0 else 0.0
        b = 1.0 - a
        if transitions[t, 1] != 0:
            a = ra[i, t, r, 0]
            b = ra[i, t, r, 1]
            for h in range(HARMONICS):
                slip += rates[h] * (rs[i, t, h, r] * before[3 + 2 * h] - rc[i, t, h, r] * before[4 + 2 * h])
        for j in range(M):
            slip += (a * field[mode, 0, j] + b * field[mode, 1, j]) * before[j]
        for c in range(2):
            if first:
                S[2 + r, c] = (a if c == 0 else b) + slip * t_z[c]
            else:
                S[2 + r, c] = a * S[0, c] + b * S[1, c] + slip * t_z[c]
    for r in range(2):
        for c in range(2):
            S[r, c] = S[2 + r, c]


@kernel(
    "int64(int64, " + _VECTOR * 2 + _INTEGERS + _LINEAR + _NET + "int64, float64, " + _VECTOR * 2
    + _MATRIX * 3 + _VECTOR * 3 + _SCRATCH + ")"
)  # fmt: skip
def spectrum(
    i, u, clock, counters,
    A, b, c, s_, multiples, omega, period, ia, ib, ic, is_, oa, ob, oc, os_, ra, rb, rc, rs,
    transitions, rows, row_start, mode_start, mode_list, at,
    count, unit, limit, scale,
    Q, X, growth, lengths, t_z, sums,
    prop, rot, fun, tay, field, info, row, vectors, scr, points, rates, integers,
):  # fmt: skip
    """March ``count`` units of time (the period, where there is one) with the frame Q. Returns a status.

    ``growth`` (count, 2): logarithms by unit of time. ``sums``: integral of div f, sum of log|det S|, crossings, and
    the least |h'| / (|h_u| |u'|) of a crossing. X and t_z are scratch: (4, 2) and (2,)."""
    n_i = ia.shape[1]
    w, w1, wn, wp, wq, end, there = (
        vectors[0], vectors[1], vectors[2], vectors[3], vectors[4], vectors[5], vectors[6],
    )  # fmt: skip
    zero = integers[0:n_i]
    found = integers[n_i : n_i + 4]
    T = period[i]
    for h in range(HARMONICS):
        rates[h] = multiples[h] * omega[i]
    if integers[2 * n_i + 4] != i + 1:
        build(i, A, b, c, s_, rates, T, ia, ib, ic, is_, oa, ob, oc, os_, prop, rot, fun, tay, field, info, row)
        integers[2 * n_i + 4] = i + 1
    s = clock[0]
    whole = 0.0
    mode = counters[0]
    w[0] = u[0]
    w[1] = u[1]
    w[2] = 1.0
    set_phase(w, s, rates)
    mark_zeros(fun, info, mode, w, zero)
    mode, code = settle(fun, tay, info, mode, w, transitions, rows, row_start, mode_start, mode_list, zero)
    lengths[0] = 1.0
    lengths[1] = 1.0
    done = 0.0
    index = 0
    here = 0
    burst = 0
    since = 1e300
    while code == OK and index < count:
        wait, timed = trigger(mode, s, T, mode_start, mode_list, at)
        rest = (index + 1) * unit - done
        step, t, full, _ = leg(
            prop, rot, fun, tay, info, mode, n_i, rates, w, min(wait, rest), rows, row_start, mode_start, mode_list,
            -1, 0, -1, zero, w1, wn, wp, wq, scr, points, end, there, found, False,
        )  # fmt: skip
        if t < 0 and timed >= 0 and step >= wait:
            t = timed
            found[0] = -1
        if full:
            for r in range(2):
                X[r, 0] = prop[mode, NODES, 0, r]
                X[r, 1] = prop[mode, NODES, 1, r]
        else:
            exponential(step, prop, tay, info, mode, n_i, X)
        apply(X, Q)
        sums[0] += (field[mode, 0, 0] + field[mode, 1, 1]) * step
        short = since + step < SHORT * info[mode, 0]
        since = 0.0 if t >= 0 else since + step
        for j in range(M):
            w[j] = w1[j] if full else end[j]
        s += step
        if s >= T:
            s -= T
            whole += 1.0
            wrap_phase(w, s, mode, info, rot, rates)
        ended = step >= rest and t < 0
        # on the clock of the forcing: sums of steps would drift away from it
        done = (index + 1) * unit if ended else (whole * T + s - clock[0] if T < 1e300 else done + step)
        for f in range(n_i):
            zero[f] = 0
        if t >= 0:
            fired = found[0]
            t_z[0] = 0.0
            t_z[1] = 0.0
            if fired >= 0:
                rate = slope_of(fun, mode, fired, w)
                h0 = fun[mode, fired, 0]
                h1 = fun[mode, fired, 1]
                t_z[0] = -h0 / rate
                t_z[1] = -h1 / rate
                v0 = 0.0
                v1 = 0.0
                for j in range(M):
                    v0 += field[mode, 0, j] * w[j]
                    v1 += field[mode, 1, j] * w[j]
                size = sqrt((h0 * h0 + h1 * h1) * (v0 * v0 + v1 * v1))
                if size > 0.0:
                    sums[3] = min(sums[3], fabs(rate) / size)
            jumps = 0
            while t >= 0:
                if jumps > mode_start.shape[0]:
                    code = CHATTER
                    break
                for j in range(M):
                    wp[j] = w[j]
                new = jump(i, t, fired if jumps == 0 else -1, fun, info, w, wn, transitions, ra, rb, rc, rs, zero)
                saltation(i, t, wp, w, field, mode, new, transitions, ra, rc, rs, rates, t_z, X, jumps == 0)
                mode = new
                jumps += 1
                t = next_holding(fun, tay, mode, w, rows, row_start, mode_start, mode_list, zero)
            apply(X, Q)
            det = X[0, 0] * X[1, 1] - X[0, 1] * X[1, 0]
            size = (fabs(X[0, 0]) + fabs(X[0, 1])) * (fabs(X[1, 0]) + fabs(X[1, 1]))
            if fabs(det) <= LOST * size:
                det = 0.0
            sums[1] += log(fabs(det))
            sums[2] += jumps
            orthonormal(Q, lengths, scale)
            if det == 0.0:
                lengths[1] = 0.0
            here += jumps
            burst = burst + 1 if short else 0
            if burst > BURST:
                code = CHATTER
            elif here > MOST_CROSSINGS:
                code = TOO_MANY_CROSSINGS
        else:
            orthonormal(Q, lengths, scale)
        if not bounded(w, limit):
            code = DIVERGED
        if ended or not (1e-100 < lengths[0] < 1e100 and 1e-100 < lengths[1]):
            put_away(lengths, growth, index)
        if ended:
            index += 1
            here = 0
    u[0] = w[0]
    u[1] = w[1]
    clock[0] = s
    clock[1] += whole
    counters[0] = mode
    if code == OK and not isfinite(w[0]):
        code = DIVERGED
    return code
