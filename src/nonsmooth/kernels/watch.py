"""What is observed while a step's polynomials are at hand: extremes, touches and samples."""

from math import inf

from .cache import device, inline
from .crossing import NOISE
from .polynomial import DOWN, NONE, dense, first_crossing, largest, load, row_bounds, shift, strip
from .taylor import dense_states

__all__ = ["extend", "extend_at_node", "extend_corners", "forget", "sample", "touches", "write_sample"]


@device
def forget(extremes):
    """Begin a new window: extremes[0] are the maxima of all rows, extremes[1] the minima."""
    for i in range(extremes.shape[1]):
        extremes[0, i] = -inf
        extremes[1, i] = inf


@device
def extend_at_node(values, rows, lacking, mode, n, extremes):
    """Take in the values of all rows at one instant (column 0 of ``values``)."""
    for i in range(rows):
        if i < n and lacking[mode, i] == 1:
            continue
        v = values[i, 0]
        if v > extremes[0, i]:
            extremes[0, i] = v
        if v < extremes[1, i]:
            extremes[1, i] = v


@inline
def extend(C, m, rows, powers, lacking, mode, n, kinds, extremes, a, stack):
    """Take in the true extremes of all rows over the step; rows that cannot exceed the old ones cost a bound.

    ``kinds``: 1 a row with a polynomial, 0 an output with a corner, -1 a row that repeats a state."""
    for i in range(rows):
        if kinds[i] != 1 or (i < n and lacking[mode, i] == 1):
            continue
        _, low, high = row_bounds(C, i, 1.0, m, powers)
        if high > extremes[0, i]:
            extremes[0, i] = largest(a, load(C, i, 1.0, m, powers, a), extremes[0, i], stack)
        if low < extremes[1, i]:
            extremes[1, i] = -largest(a, load(C, i, -1.0, m, powers, a), -extremes[1, i], stack)


@device
def extend_corners(values, mode, t, h, C, m, n, q, kinds, extremes, u, out):
    """Outputs with a corner have no polynomial: sampled four times on the step."""
    for j in range(1, 5):
        dense_states(C, m, n, 0.25 * j * h, u)
        values(mode, t + 0.25 * j * h, u, q, out)
        for row in range(n, kinds.shape[0]):
            if kinds[row] == 0:
                extremes[0, row] = max(extremes[0, row], out[row - n])
                extremes[1, row] = min(extremes[1, row], out[row - n])


@device
def touches(mode, t, h, C, m, n, powers, net, scale, rise, a, d, stack, found, u, log, count):
    """Log every local maximum <= 0 of an armed row: time, indicator, clearance, states. Returns the new count.

    ``rise`` is the sign of each row's slope at the end of the previous step (0: just after a jump)."""
    first, outgoing, transitions, rows, _ = net
    begin = first[mode]
    for j in range(begin, first[mode + 1]):
        for r in range(transitions[outgoing[j], 2], transitions[outgoing[j], 3]):
            i, sign = rows[r, 0], rows[r, 1]
            known = False  # the same row may stand in several transitions
            for jj in range(begin, j):
                for rr in range(transitions[outgoing[jj], 2], transitions[outgoing[jj], 3]):
                    known = known or (rows[rr, 0] == i and rows[rr, 1] == sign)
            if known:
                continue
            mr = load(C, n + i, float(sign), m, powers, a)
            cursor, before, begun = 0.0, rise[r], False
            for _ in range(mr):
                for k in range(mr):
                    d[k] = (k + 1) * a[k + 1]
                for k in range(mr, 5):
                    d[k] = 0.0
                md = mr - 1 if mr > 5 else 4
                if begun:
                    before = 0
                    if cursor > 0.0:
                        shift(d, md, cursor, 1.0 - cursor, d)
                        d[0] = 0.0
                md = strip(d, md)
                if md < 0:
                    rise[r] = 0
                    break
                x = first_crossing(d, md, DOWN, before, 0.0, stack, found)
                rise[r] = found[1]
                if x == NONE:
                    break
                cursor, begun = cursor + x * (1.0 - cursor), True
                v = dense(a, mr, cursor)
                if v <= NOISE * scale[i] and count < log.shape[0]:
                    dense_states(C, m, n, cursor * h, u)
                    log[count, 0], log[count, 1], log[count, 2] = t + cursor * h, i, max(-v, 0.0)
                    for k in range(n):
                        log[count, 3 + k] = u[k]
                    count += 1
                if cursor >= 1.0:
                    break
    return count


@device
def sample(times, written, base, t, h, C, m, n, q, n_parameters, mode, segment, u, out):
    """Write the samples on the step [t, t + h): states, memory, mode, segment. Returns how many there are now."""
    while written < times.shape[0]:
        tau = (times[written] - base) - t
        if tau >= h * (1.0 - 4e-16):  # the end belongs to what follows: a sample at a crossing is the limit after it
            break
        dense_states(C, m, n, max(tau, 0.0), u)
        write_sample(out, written, u, n, q, n_parameters, mode, segment)
        written += 1
    return written


@device
def write_sample(out, row, u, n, q, n_parameters, mode, segment):
    """One row of samples: states, memory, mode, segment."""
    for i in range(n):
        out[row, i] = u[i]
    memory = q.shape[0] - n_parameters
    for i in range(memory):
        out[row, n + i] = q[n_parameters + i]
    out[row, n + memory] = mode
    out[row, n + memory + 1] = segment
