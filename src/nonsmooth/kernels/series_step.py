"""Parts of the hybrid loop: where a step ends, how long it is, and how a crossing on it is placed."""

from math import fabs

from . import series_places as place
from .cache import device, inline
from .crossing import holds
from .rkf45 import first_step
from .taylor import dense_states, step_length

__all__ = ["at_end", "failed", "judged_at_end", "next_stop", "planned_length", "polished", "triggered"]


@inline
def next_stop(mode, t, base, period, phase, until, net):
    """The next time at which a step must end."""
    stop = period if until < 0.0 else min(period, until - base)
    if t < phase < stop:
        stop = phase
    transitions, at = net[2], net[4]
    for k in range(at.shape[0]):
        if at[k] >= 0.0 and transitions[k, 0] == mode and t < at[k] * period < stop:
            stop = at[k] * period
    return stop


@device
def triggered(mode, t, period, net):
    """The time-triggered transition out of ``mode`` at the time t of the period, or -1."""
    transitions, at = net[2], net[4]
    for k in range(at.shape[0]):
        if at[k] >= 0.0 and transitions[k, 0] == mode and at[k] * period == t:
            return k
    return -1


@device
def converged(C, m, n, n_indicators, h, scale):
    """Shorten an exact step until the series of nonlinear indicators has converged as well; 0 where it does not."""
    for _ in range(60):
        worst, power = 0.0, h ** (m - 1)
        for i in range(n_indicators):
            if scale[i] > 0.0:
                worst = max(worst, (fabs(C[n + i, m - 1]) * power + fabs(C[n + i, m]) * power * h) / scale[i])
        if not (worst > 1e-16):
            return h
        h *= 0.8
    return 0.0


@inline
def failed(u, n, largest):
    """Whether the state has left every bound."""
    for i in range(n):
        if not (fabs(u[i]) <= largest[i]):
            return True
    return False


@device
def polished(values, mode, t, q, C, m, n, row, h, tau, u_dense, vals):
    """A zero of the interpolated indicator ``row``, moved to the zero of the indicator of the dense state.

    Where Newton's method does not get there the interpolated one stands, which has the error of the step."""
    at = tau
    for _ in range(12):
        dense_states(C, m, n, at, u_dense)
        values(mode, t + at, u_dense, q, vals)
        slope = 0.0
        for k in range(m, 0, -1):
            slope = slope * at + k * C[n + row, k]
        if slope == 0.0:
            break
        move = vals[row] / slope
        if not (fabs(at - move - tau) <= 1e-3 * h and 0.0 <= at - move <= h):
            break
        at -= move
        if fabs(move) <= 1e-8 * h:  # the next move would be its square
            return at
    return tau


@device
def judged_at_end(mode, X, n, n_indicators, net, side, side_before):
    """Without location: the transition whose rows hold at the end of the step and did not at its beginning, or -1."""
    first, outgoing = net[0], net[1]
    for i in range(n_indicators):
        side_before[i] = side[i]
        side[i] = 1 if X[n + i, 0] > 0.0 else -1
    for j in range(first[mode], first[mode + 1]):
        if holds(outgoing[j], net, side) and not holds(outgoing[j], net, side_before):
            return outgoing[j]
    return -1


@device
def at_end(C, m, row, h):
    """Value and slope of a row at the end of a part of the step."""
    v, slope = C[row, m], 0.0
    for k in range(m - 1, -1, -1):
        slope = slope * h + v
        v = v * h + C[row, k]
    return v, slope


@inline
def planned_length(mode, method, J, u, n, n_indicators, order, fixed, usual, exact_steps, watch_rows, norms, scale,
                   log_rtol, rtol):  # fmt: skip
    """The length of the next step, before stops and crossings in sight shorten it."""
    if fixed > 0.0:
        return fixed
    if method == place.RKF45:
        return usual[mode] if usual[mode] > 0.0 else first_step(J, u, n, norms[1], rtol)
    if method == place.TAYLOR:
        return step_length(J, order, n, n_indicators, u, norms[0], scale, log_rtol)
    if watch_rows == 1:
        return converged(J, order, n, n_indicators, exact_steps[mode], scale)
    return exact_steps[mode]
