"""The one compiled entry to the series methods: points run one after the other, or one recorded trajectory."""

from numba import types

from .cache import kernel
from .codes import NOT_GUARANTEED, OK
from .series import march
from .series_node import clear, copy
from .series_places import (
    ELAPSED, KEEP, KEPT_CONTACTS, KEPT_CROSSINGS, N_INDICATORS, N_OUTPUTS, N_PARAMETERS, PERIOD, PHASE,
    RECORD, SECTION, SETTLED, STEPS,
)  # fmt: skip

__all__ = ["run"]

_i, _f = types.int64, types.float64
_f1, _f2, _f3, _i1, _i2 = _f[::1], _f[:, ::1], _f[:, :, ::1], _i[::1], _i[:, ::1]

FIELD = types.FunctionType(types.void(_i, _f, _f1, _f1, _f1))
JET = types.FunctionType(types.void(_i, _i, _f, _f1, _f1, _f2, _f2))
VALUES = types.FunctionType(types.void(_i, _f, _f1, _f1, _f1))
JUMP = types.FunctionType(types.void(_i, _f, _f1, _f1, _f1, _f1))

NET = types.Tuple((_i1, _i1, _i2, _i2, _f1))
WORK = types.Tuple((
    _f2, _f2, _f2, _f2, types.UniTuple(_f1, 8), _f1, _f1, _f1, _f1, _f1, _f1,
    _f1, _f1, _i1, _i1, _i1, _f1, _i1, _f1, _i1, _f1, _f1,
))  # fmt: skip
NORMS = types.UniTuple(_f1, 3)
RESULT = types.Tuple((_f3, _f2, _f2, _f2, _f2, _f2, _f2, _i1, _i1, _f1, _f2, _i2, _i1))
LOG = types.Tuple((_f1, _f2, _f2, _f2))
GOOD = types.Tuple((_f1, _f1, _f1, _i1))

_SIGNATURE = types.int64(
    FIELD, JET, VALUES, JUMP, NET, _i2, _i1, _i1, _f1, NORMS, _f2, _f1, _f2, _f2, _i, _i,
    _f1, _f1, _f1, _i1, WORK, _f2, _f2, _i1, _f1, RESULT, LOG, GOOD,
)  # fmt: skip


@kernel(_SIGNATURE)
def run(
    field, jet, values, jump, net, lacking, smooth, choice, control, norms, points, periods, exact_steps, starts,
    first, last, u, q, clock, counters, work, sections, extremes, tally, memo, result, log, good,
):  # fmt: skip
    """Points ``first <= i < last``; with ``choice[RECORD]`` point 0 alone, which may return LOG_FULL to be called again.

    ``starts`` (P, n), or no rows: the state (u, memory in q, clock, counters) is carried from point to point.
    """
    times, samples, crossings, touch_log = log
    section, maximum, minimum, i_max, i_min, o_max, o_min, n_crossings, contacts, elapsed, s_time, s_mode, statuses = (
        result
    )
    record = choice[RECORD] == 1
    n_parameters = choice[N_PARAMETERS]
    n, n_indicators, n_outputs = u.shape[0], choice[N_INDICATORS], choice[N_OUTPUTS]
    settled, phase = tally[SETTLED], control[PHASE]
    good_u, good_q, good_clock, good_counters = good
    copy(u, good_u)
    copy(q, good_q)
    copy(clock, good_clock)
    copy(counters, good_counters)
    steps = 0
    for i in range(first, last):
        if starts.shape[0] > 0:
            for j in range(n):
                u[j] = starts[i, j]
            for j in range(n_parameters, q.shape[0]):
                q[j] = 0.0
            clear(clock)
            counters[0] = 0
            counters[1] = -1
        for j in range(n_parameters):
            q[j] = points[i, j]
        control[PERIOD] = periods[i]
        if not record:
            control[PHASE] = phase * periods[i] if choice[SECTION] < 0 else -1.0
            clear(tally)
            tally[SETTLED] = settled if i == first else 0
            clear(memo)
        status = march(
            field, jet, values, jump, net, lacking, smooth, choice, control, norms, exact_steps[i], u, q, clock,
            counters, work, sections, extremes, tally, memo, times, samples, crossings, touch_log,
        )  # fmt: skip
        if record:
            return status
        steps += tally[STEPS]
        statuses[i] = status
        if status == OK or status == NOT_GUARANTEED:
            for k in range(choice[KEEP]):
                for j in range(n):
                    section[i, k, j] = sections[k, j]
                s_time[i, k] = sections[k, n]
                s_mode[i, k] = int(sections[k, n + 1])
            for j in range(n):
                maximum[i, j], minimum[i, j] = extremes[0, j], extremes[1, j]
            for j in range(n_indicators):
                i_max[i, j], i_min[i, j] = extremes[0, n + j], extremes[1, n + j]
            for j in range(n_outputs):
                o_max[i, j], o_min[i, j] = extremes[0, n + n_indicators + j], extremes[1, n + n_indicators + j]
            n_crossings[i] = tally[KEPT_CROSSINGS]
            contacts[i] = tally[KEPT_CONTACTS]
            elapsed[i] = memo[ELAPSED]
            copy(u, good_u)
            copy(q, good_q)
            copy(clock, good_clock)
            copy(counters, good_counters)
        elif starts.shape[0] == 0:
            copy(good_u, u)
            copy(good_q, q)
            copy(good_clock, clock)
            copy(good_counters, counters)
    control[PHASE] = phase
    tally[STEPS] = steps
    return OK
