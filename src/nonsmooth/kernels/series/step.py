"""Parts of a step of the series methods: how long it is, and how a crossing on it is placed."""

from math import fabs

import nonsmooth.kernels.series.places as place
from nonsmooth.kernels.compile.cache import device, once
from nonsmooth.kernels.hybrid.places import MODE
from nonsmooth.kernels.series.crossing import rows_hold
from nonsmooth.kernels.series.generated import values_of
from nonsmooth.kernels.series.rkf45 import first_step
from nonsmooth.kernels.series.taylor import dense_states, step_length

__all__ = ["METHOD", "at_end", "judged_at_end", "planned_length", "polished"]

# Of ``series.places``: set where the text is joined, so that each method has a kernel of its own.
METHOD = 0


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


@device
def polished(form, work, row, t, h, tau):
    """A zero of the interpolated indicator ``row``, moved to the zero of the indicator of the dense state.

    ``t`` and ``h`` are begin and length of the step. Where Newton's method does not get there the interpolated one
    stands, which has the error of the step."""
    C, n = work.C, work.w.shape[0]
    values = values_of(form)
    m = 5 if METHOD == place.RKF45 else form.order
    at = tau
    for _ in range(12):
        dense_states(C, m, n, at, work.dense)
        values(work.tally[MODE], t + at, work.dense, work.q, work.vals)
        slope = 0.0
        for k in range(m, 0, -1):
            slope = slope * at + k * C[n + row, k]
        if slope == 0.0:
            break
        move = work.vals[row] / slope
        if not (fabs(at - move - tau) <= 1e-3 * h and 0.0 <= at - move <= h):
            break
        at -= move
        if fabs(move) <= 1e-8 * h:  # the next move would be its square
            return at
    return tau


@once
def judged_at_end(mode, X, n, n_indicators, net, work):
    """Without location: the transition whose rows hold at the end of the step and did not at its beginning, or -1."""
    side, side_before = work.side, work.side_next
    for i in range(n_indicators):
        side_before[i] = side[i]
        side[i] = 1 if X[n + i, 0] > 0.0 else -1
    for j in range(net.mode_start[mode], net.mode_start[mode + 1]):
        k = net.mode_list[j]
        if rows_hold(k, net, side) and not rows_hold(k, net, side_before):
            return k
    return -1


@device
def at_end(C, m, row, h):
    """Value and slope of a row at the end of a part of the step."""
    v, slope = C[row, m], 0.0
    for k in range(m - 1, -1, -1):
        slope = slope * h + v
        v = v * h + C[row, k]
    return v, slope


@once
def planned_length(i, mode, form, J, log_rtol, work):
    """The length of the next step, before stops and crossings in sight shorten it."""
    n = work.w.shape[0]
    if form.step > 0.0:
        return form.step
    if METHOD == place.RKF45:
        return work.usual[mode] if work.usual[mode] > 0.0 else first_step(J, work.w, n, form.absolute, form.rtol)
    if METHOD == place.TAYLOR:
        return step_length(J, form.order, n, form.indicators, work.w, form.weight, work.scale, log_rtol)
    if form.nonlinear_rows == 1:
        return converged(J, form.order, n, form.indicators, form.exact_steps[i, mode], work.scale)
    return form.exact_steps[i, mode]
