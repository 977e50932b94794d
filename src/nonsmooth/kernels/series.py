"""The hybrid loop of the series methods: steps, crossings, jumps, sections and records of one trajectory.

Every step is a polynomial in the local time for each row (states, indicators, outputs): the Taylor jet itself, or the
quintic of a Runge-Kutta-Fehlberg step. Crossings, sections, extremes, touches and samples are read off it. Steps end
exactly at stops: the phase of a section, the end of a period, time-triggered transitions, the end of the run.

The places in ``choice``, ``control``, ``tally`` and ``memo`` have names in ``series_places``; ``net`` is described in
``crossing``, ``work`` (scratch) in ``flow.series_tables``.
"""

from math import fabs, inf, sqrt
from math import log as ln

from numba import types
from numpy import float32

from . import series_places as place
from .cache import kernel
from .codes import DIVERGED, LOG_FULL, NO_CONVERGENCE, NOT_GUARANTEED, OK, PAUSED
from .crossing import NOISE, earliest, sides_at
from .polynomial import NONE, row_bounds
from .rkf45 import hermite, quiet, stages, transit
from .series_node import begin, clear, copy, count_pass, leap, meets_section, open_window, passes, rests
from .series_step import at_end, failed, judged_at_end, next_stop, planned_length, polished, triggered
from .taylor import dense_states, end_states, fill_powers
from .trust import trusted
from .watch import extend, extend_at_node, extend_corners, sample, touches, write_sample

__all__ = ["march"]

_i, _f = types.int64, types.float64
_f1, _f2, _f3, _i1, _i2 = _f[::1], _f[:, ::1], _f[:, :, ::1], _i[::1], _i[:, ::1]

FIELD = types.FunctionType(types.void(_i, _f, _f1, _f1, _f1))
JET = types.FunctionType(types.void(_i, _i, _f, _f1, _f1, _f2, _f2))
VALUES = types.FunctionType(types.void(_i, _f, _f1, _f1, _f1))
JUMP = types.FunctionType(types.void(_i, _f, _f1, _f1, _f1, _f1))

NET = types.Tuple((_i1, _i1, _i2, _i2, _f1))
WORK = types.Tuple((
    _f2, _f2, _f2, _f2, types.UniTuple(_f1, 8), _f1, _f1, _f1, _f1, _f1, _f1,
    _f1, _f1, _i1, _i1, _i1, _f1, _i1, _f1, _i1, _f1, _f1, _f1, _f1,
))  # fmt: skip
NORMS = types.UniTuple(_f1, 3)
LOG = types.Tuple((_f1, _f2, _f2, _f2))

_SIGNATURE = types.int64(
    FIELD, JET, VALUES, JUMP, NET, _i2, _i1, _i1, _f1, NORMS, _f1, _f1, _f1, _f1, _i1, WORK,
    _f2, _f2, _i1, _f1, LOG,
)  # fmt: skip


@kernel(_SIGNATURE)
def march(
    field, jet, values, jump, net, lacking, kinds, choice, control, norms, exact_steps, u, q, clock, counters, work,
    sections, extremes, tally, memo, log,
):  # fmt: skip
    """Run one trajectory until its section returns are counted, or its time is reached. Returns a status.

    LOG_FULL asks for larger logs, PAUSED for nothing, and to be called again with the same arrays."""
    times, samples, crossings, touch_log = log
    C, W, J0, J1, K, powers, a, d, vals, u_new, q_new = work[:11]
    scale, measured, side, side_next, rise, usual, visited, stack, found, u_dense, u_before, dwell, near = work[11:]
    parts = (C, W, J0, scale, measured, side, usual, vals, u_new, q_new, visited)  # for what happens at an instant
    n, n_indicators, order, method = u.shape[0], choice[place.N_INDICATORS], choice[place.ORDER], choice[place.METHOD]
    rows, n_modes = n + n_indicators + choice[place.N_OUTPUTS], lacking.shape[0]
    rkf, record, section = method == place.RKF45, choice[place.RECORD] == 1, choice[place.SECTION]
    degree = 5 if rkf else order
    J = J0 if rkf else C  # the jets at the beginning of a step
    rtol, fixed, period = control[place.RTOL], control[place.STEP], control[place.PERIOD]
    phase, until, t_max = control[place.PHASE], control[place.UNTIL], control[place.T_MAX]
    checked = choice[place.CHECKED] == 1 and method == place.TAYLOR and fixed <= 0.0
    log_rtol, tail, forced = ln(max(0.1 * rtol, 1e-16)), (1.0 if method == place.TAYLOR else 0.0), period < inf
    mode, t, status, zero_row, take = counters[0], clock[0], OK, -1, False
    timed = False
    for k in range(net[4].shape[0]):
        timed = timed or net[4][k] >= 0.0

    if tally[place.BEGUN] == 0:
        tally[place.BEGUN] = 1
        for i in range(n_indicators):
            scale[i], measured[i], side[i] = 0.0, 0.0, 0
        clear(rise)
        clear(usual)
        clear(dwell)
        mode, status = begin(
            jet, jump, mode, t, u, q, tally[place.SETTLED], choice, norms, log_rtol, rtol, fixed, exact_steps, net,
            parts,
        )  # fmt: skip
        tally[place.READY] = 1
        if section >= 0:  # a start on the section is no return, nor is a carried state left there
            if fabs(J[n + section, 0]) <= 1e-9 * scale[section]:
                J[n + section, 0] = 0.0
                side[section] = 0
        if not record and choice[place.TRANSIENT] == 0:
            open_window(tally, memo, clock, t, extremes)
            take = True
    ready = tally[place.READY] == 1

    while status == OK:
        if record and (
            crossings.shape[0] - tally[place.CROSSINGS] < n_modes + 4
            or touch_log.shape[0] - tally[place.TOUCHES] < (net[3].shape[0] + 1) * (degree + 1)
        ):
            status = LOG_FULL
            break
        if not ready:
            if tally[place.STEPS] >= choice[place.PAUSE] and zero_row < 0 and not take:  # all it knows is in the arrays
                status = PAUSED
                break
            jet(mode, 2 if rkf else order, t, u, q, J, W)
            for i in range(n_indicators):
                scale[i] = max(scale[i], fabs(J[n + i, 0]))
            if zero_row >= 0:
                J[n + zero_row, 0] = 0.0
                side[zero_row] = 0
                zero_row = -1
            ready = True
        if take:
            extend_at_node(J, rows, lacking, mode, n, extremes)
            take = False
        watched = record or tally[place.WINDOW] == 1

        # --- the length of the step
        base = clock[1] * period if forced else 0.0
        # Returns of the transient are only counted, so no step needs to end there.
        through = phase >= 0.0 and not timed and tally[place.RETURNS] + 1 < choice[place.TRANSIENT]
        stop = inf if through else next_stop(mode, t, base, period, phase, until, net)
        remaining = stop - t
        h = planned_length(
            mode, method, J, u, n, n_indicators, order, fixed, usual, exact_steps, choice[place.NONLINEAR_ROWS], norms,
            scale, log_rtol, rtol,
        )  # fmt: skip
        if not (h > 1e-16 * t):
            status = DIVERGED
            break
        if not record and tally[place.STEPS_IN_RETURN] > place.MOST_STEPS:
            status = NO_CONVERGENCE
            break
        if section >= 0:
            waited = memo[place.SINCE_RETURN]
            if waited >= t_max * (1.0 - 1e-12) or waited > 1e100:
                status = NO_CONVERGENCE
                break
            if not forced and not record and rests(u, n, lacking, mode, norms[0], rtol, tally, memo):
                status = NO_CONVERGENCE
                break
            h = min(h, t_max - waited)
        if through:
            h = min(h, period)
        elif h == inf and remaining == inf:  # a polynomial solution: any length is right
            h = max(1.0, memo[place.SINCE_RETURN])
        planned = h
        if rkf and fixed <= 0.0 and dwell[mode] < 2.0 * h:  # a mode that was left soon the last time
            h = min(h, 1.1 * transit(mode, J0, n, net, h))
        landing = h >= remaining * (1.0 - 1e-13)
        if landing:
            h = remaining
        elif fixed <= 0.0 and h > 0.5 * remaining:
            h = 0.5 * remaining

        # --- the step, and the first transition on it
        pending, hit, x, calm, halvings, error, sure = -1, -1, NONE, False, 0, 0.0, 0.0
        while True:
            if rkf:
                k1 = K[0]
                for i in range(n):
                    k1[i] = J0[i, 1]
                error = stages(field, mode, t, u, q, h, n, K, fixed <= 0.0, norms[1], rtol)
                if fixed <= 0.0 and not (error <= 1.0):
                    h *= max(0.2, 0.9 * error**-0.1) if error < inf else 0.1
                    planned, landing = h, False
                    if not (h > 1e-16 * t):
                        status = DIVERGED
                        break
                    continue
                jet(mode, 2, t + h, K[7], q, J1, W)
            for i in range(n_indicators):
                side_next[i] = 0
            slack = rtol if rkf and fixed <= 0.0 else 0.0
            if rkf:
                calm = choice[place.LOCATE] == 0 or quiet(
                    mode, J0, J1, n, h, net, side, side_next, scale, slack, section, choice[place.SECTION_MODE]
                )
                if calm and not watched:
                    break
                hermite(J0, J1, rows, h, C)
                slack *= sqrt(error)
            fill_powers(h, degree, powers)
            if calm:
                break
            if choice[place.LOCATE] == 1:
                found[0] = 0
                for i in range(n_indicators):
                    side_next[i] = 0
                x, pending, hit = earliest(
                    mode, C, degree, n, powers, net, side, side_next, scale, tail, slack, a, d, stack, found
                )
                if found[0] == 1 and fixed <= 0.0 and halvings < place.HALVINGS:
                    h *= 0.5  # a graze nearer than the polynomial is sure of
                    landing = False
                    halvings += 1
                    continue
                if found[0] == 1:
                    tally[place.DOUBTFUL] = 1
            if not checked or h <= sure:
                break
            whole = x * h if pending >= 0 else h
            sure = trusted(
                field, values, mode, t, u, q, C, order, h, whole, n_indicators, rows, choice[place.N_GUARDS], powers,
                norms[0], scale, rtol, a, d, stack, found, K, vals, near,
            )  # fmt: skip
            if sure >= whole:
                break
            h, landing = sure, False
            if not (h > 1e-16 * t):
                status = DIVERGED
                break
        if status != OK:
            break
        if rkf:
            growth = min(5.0, 0.9 * float32(error) ** float32(-0.1)) if error > 1e-30 else 5.0
            usual[mode] = growth * h if growth < 1.0 else max(planned, growth * h)
        part = h
        if pending >= 0:
            part = x * h
            if rkf:
                part = polished(values, mode, t, q, C, degree, n, net[3][hit, 0], h, part, u_dense, vals)

        # --- passes of a Poincare section before that
        edge = False
        if section >= 0 and not calm and (choice[place.SECTION_MODE] < 0 or choice[place.SECTION_MODE] == mode):
            _, low, high = row_bounds(C, n + section, 1.0, degree, powers)
            if (low > 0.0 and side[section] >= 0) or (high < 0.0 and side[section] <= 0):
                side_next[section] = 1 if low > 0.0 else -1
            else:
                tau = passes(
                    values, mode, t, h, part, pending, clock, period, C, degree, n, q, rkf, choice, side, side_next,
                    powers, scale, a, stack, found, u_dense, vals, sections, extremes, tally, memo,
                )  # fmt: skip
                if tau >= 0.0:
                    edge, pending, part = True, -1, tau

        # --- what is observed on the step, then its end
        cut = edge or pending >= 0
        if watched:
            if part != h:
                fill_powers(part, degree, powers)
            if record:
                tally[place.SAMPLES] = sample(
                    times, tally[place.SAMPLES], base, t, part, C, degree, n, q, choice[place.N_PARAMETERS], mode,
                    tally[place.SEGMENT], u_dense, samples,
                )  # fmt: skip
                tally[place.TOUCHES] = touches(
                    mode, t + base, part, C, degree, n, powers, net, scale, rise, a, d, stack, found, u_dense,
                    touch_log, tally[place.TOUCHES],
                )  # fmt: skip
            else:
                extend(C, degree, rows, powers, lacking, mode, n, kinds, extremes, a, stack)
                if choice[place.CORNERS] == 1:
                    extend_corners(values, mode, t, part, C, degree, n, q, kinds, extremes, u_dense, vals)
        slope_before, value_before = 0.0, 0.0
        if pending >= 0 and section >= 0:
            value_before, slope_before = at_end(C, degree, n + section, part)
        if rkf and not cut:
            new = K[7]
            for i in range(n):
                u[i] = new[i]
        elif cut and not watched:
            dense_states(C, degree, n, part, u)
        else:
            end_states(C, degree, n, powers, u)
        if edge:
            sides_at(C, degree, n, n_indicators, 1.0 if watched else part / h, powers, scale, a, side)
        landing = landing and not cut
        if through:
            passed = t < phase <= t + part
            t += part
            if t >= period:
                clock[1] += 1.0
                t -= period
                passed = passed or phase <= t
            if passed:
                count_pass(choice, tally, memo, clock, t, period, mode, u, sections, extremes)
        else:
            t = stop if landing else t + part
        memo[place.SINCE_RETURN] += part
        memo[place.SINCE_CROSSING] += part
        tally[place.STEPS] += 1
        tally[place.STEPS_IN_RETURN] += 1
        if failed(u, n, norms[2]):
            status = DIVERGED
            break

        # --- the instant at its end
        mode_before = mode
        ready = False
        arrived = landing and record and stop == until - base
        if not cut:
            if rkf:
                for i in range(rows if watched or landing else n + n_indicators):
                    J0[i, 0], J0[i, 1], J0[i, 2] = J1[i, 0], J1[i, 1], J1[i, 2]
                ready = True
            if choice[place.LOCATE] == 1:
                for i in range(n_indicators):
                    side[i] = side_next[i]
                    if rkf:
                        scale[i] = max(scale[i], fabs(J1[n + i, 0]))
            else:
                if not ready:
                    jet(mode, order, t, u, q, C, W)
                    ready = True
                pending = judged_at_end(mode, J, n, n_indicators, net, side, side_next)
        if landing and stop == period:
            clock[1] += 1.0
            t = 0.0
            if record:
                tally[place.JUMPS] = 0
        if landing and pending < 0:
            pending = triggered(mode, t, period, net)
        if pending >= 0:
            copy(u, u_before)
            counters[1] = hit
            dwell[mode] = memo[place.SINCE_CROSSING]
            mode, status = leap(
                jet, values, jump, pending, hit, mode, t, clock, u, q, choice, norms, log_rtol, rtol, fixed, period,
                exact_steps, lacking, net, parts, extremes, tally, memo, crossings,
            )  # fmt: skip
            if hit >= 0 and usual[mode] <= 0.0:
                usual[mode] = planned
            clear(rise)
            ready = True
            if record and not forced:
                tally[place.JUMPS] = 0
            if status != OK:
                break
        passed = edge or (landing and t == phase)
        if pending >= 0 and section >= 0 and hit >= 0:
            meets = meets_section(
                choice, value_before, slope_before, J[n + section, 0], J[n + section, 1], NOISE * scale[section]
            )
            passed = meets and (
                choice[place.SECTION_MODE] < 0
                or choice[place.SECTION_MODE] == (mode if choice[place.AFTER] == 1 else mode_before)
            )
        if passed:
            after = choice[place.AFTER] == 1 or pending < 0
            seen = count_pass(
                choice, tally, memo, clock, t, period, mode if after else mode_before, u if after else u_before,
                sections, extremes,
            )  # fmt: skip
            if edge:
                zero_row = section
            if seen == 2:
                break
            take = seen == 1
        if arrived:
            while tally[place.SAMPLES] < times.shape[0] and times[tally[place.SAMPLES]] <= until:
                write_sample(
                    samples, tally[place.SAMPLES], u, n, q, choice[place.N_PARAMETERS], mode, tally[place.SEGMENT]
                )
                tally[place.SAMPLES] += 1
            break

    counters[0], clock[0] = mode, t
    tally[place.READY] = 1 if ready else 0
    if status == OK and tally[place.DOUBTFUL] == 1:
        status = NOT_GUARANTEED
    return status
