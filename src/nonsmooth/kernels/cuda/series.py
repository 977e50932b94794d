"""Trajectories by the series methods on a GPU, one per thread: text of a generated module.

This file stands behind the model's own functions and the series files of the CPU (``cuda.module``). ``advance``
runs ``march`` for every job until it has counted its section returns, or has made as many steps as a launch may; then
it is launched again for those that are under way, and goes on where it stopped, so that the cut changes no number.

Everything that is known of the system (its transitions, sizes, method and order) is a constant here, so that what it
does not need is never compiled. What ``march`` keeps between two launches is stored with the job as last index:
neighbouring threads then read neighbouring numbers.
"""

import numpy as np
from numba import float64, int64

from nonsmooth.kernels.cuda.target import cuda, entry, local, once
from nonsmooth.kernels.hybrid.codes import (
    BEGUN,
    N_SERIES_MEMO,
    N_SERIES_TALLY,
    NOTED_AT,
    OPEN_STEP,
    PAUSED,
    READY,
    RETURNS_OF_SECTION,
    ZERO_ROW,
)
from nonsmooth.kernels.hybrid.kept import Kept, Section
from nonsmooth.kernels.hybrid.loop import leave, march
from nonsmooth.kernels.hybrid.records import Generated, Goal, Motion, Net, Seen, SeriesWork
from nonsmooth.kernels.hybrid.sections import window_of
from nonsmooth.kernels.series.polynomial import stack_size

# Set for each system and method.
METHOD, ORDER, CHECKED, CORNERS, N_GUARDS = 0, 16, 0, 0, 0
N_PARAMETERS, N_MEMORY, N_INDICATORS, N_OUTPUTS, N_SCRATCH_ROWS = 1, 0, 1, 0, 1
TRANSITIONS = np.array([[0, 0, 0]])
ROWS = np.array([[0, 1, 0]])
ROW_START = np.array([0, 1])
MODE_START = np.array([0, 1])
MODE_LIST = np.array([0])
AT = np.array([-1.0])
LACKING = np.array([[0]])
KINDS = np.array([1])

# No array of a thread is empty.
N_U = LACKING.shape[1]
N_MODES = LACKING.shape[0]
N_ROWS = ROWS.shape[0]
ALL_ROWS = N_U + N_INDICATORS + N_OUTPUTS + N_GUARDS
N_Q = max(N_PARAMETERS + N_MEMORY, 1)
N_PLACE = N_U + N_MEMORY
N_SIDES = max(N_INDICATORS, 1)
N_VALUES = max(ALL_ROWS - N_U, 1)
WIDTH = max(ORDER, 6) + 1
STACK = stack_size(WIDTH)
N_WHOLE = N_SERIES_TALLY + N_SIDES  # numbers kept between launches
N_REAL = N_SERIES_MEMO + 2 * N_SIDES + 2 * N_MODES + N_U


@local
def arrays_of_thread():
    """Working memory of a thread, as ``march`` takes it."""
    C = cuda.local.array((ALL_ROWS, WIDTH), float64)
    W = cuda.local.array((N_SCRATCH_ROWS, WIDTH), float64)
    J0 = cuda.local.array((ALL_ROWS, WIDTH), float64)
    J1 = cuda.local.array((ALL_ROWS, WIDTH), float64)
    K0 = cuda.local.array(N_U, float64)
    K1 = cuda.local.array(N_U, float64)
    K2 = cuda.local.array(N_U, float64)
    K3 = cuda.local.array(N_U, float64)
    K4 = cuda.local.array(N_U, float64)
    K5 = cuda.local.array(N_U, float64)
    K6 = cuda.local.array(N_U, float64)
    K7 = cuda.local.array(N_U, float64)
    powers = cuda.local.array(WIDTH, float64)
    a = cuda.local.array(WIDTH, float64)
    d = cuda.local.array(WIDTH, float64)
    vals = cuda.local.array(N_VALUES, float64)
    q_new = cuda.local.array(N_Q, float64)
    scale = cuda.local.array(N_SIDES, float64)
    measured = cuda.local.array(N_SIDES, float64)
    side = cuda.local.array(N_SIDES, int64)
    side_next = cuda.local.array(N_SIDES, int64)
    rise = cuda.local.array(N_ROWS, int64)
    usual = cuda.local.array(N_MODES, float64)
    dwell = cuda.local.array(N_MODES, float64)
    visited = cuda.local.array(N_MODES, int64)
    stack = cuda.local.array(STACK, float64)
    found = cuda.local.array(2, int64)
    rest = cuda.local.array(N_U, float64)
    w = cuda.local.array(N_U, float64)
    end = cuda.local.array(N_U, float64)
    before = cuda.local.array(N_PLACE, float64)
    wp = cuda.local.array(N_U, float64)
    dense_ = cuda.local.array(N_U, float64)
    q = cuda.local.array(N_Q, float64)
    near = cuda.local.array(N_VALUES, float64)
    tally = cuda.local.array(N_SERIES_TALLY, int64)
    memo = cuda.local.array(N_SERIES_MEMO, float64)
    return SeriesWork(
        w,
        end,
        before,
        wp,
        dense_,
        q,
        q_new,
        C,
        W,
        J0,
        J1,
        (K0, K1, K2, K3, K4, K5, K6, K7),
        powers,
        a,
        d,
        vals,
        near,
        scale,
        measured,
        side,
        side_next,
        rise,
        usual,
        dwell,
        visited,
        stack,
        found,
        rest,
        tally,
        memo,
    )


@once
def may_pause(work):
    """In place of the CPU's: only between two steps, so that no polynomial is kept between launches."""
    tally = work.tally
    return tally[READY] == 0 and tally[ZERO_ROW] < 0 and tally[OPEN_STEP] == 0


@entry
def advance(jobs, rows, point, norms, plan, settings, place, counts, way, between, out):
    """Thread k: march the state of job j = jobs[k] at parameter point rows[j] by transient[j] section returns, then
    keep[j] more, whose points and extremes are kept (one number for all jobs where these arrays are short).

    ``way``: fresh, pause; fresh = 1 begins a run, 0 goes on with one whose status is PAUSED. ``point``: parameters,
    periods of all; ``place``: states, memory, clocks, counters; ``counts``: settled, transient, keep;
    ``between``: what is kept between launches; ``out``: as in ``Kept``. ``plan``: indicator, rising, mode, after,
    every; ``settings``: rtol, fixed step, phase of the section, longest wait for a return."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    i = rows[j]
    points, periods = point
    u, memory, clock, counters = place
    settled, transient, keep = counts
    fresh, pause = way
    whole, real = between
    work = arrays_of_thread()
    tally, memo = work.tally, work.memo
    own = cuda.local.array((1, N_Q), float64)
    for n in range(N_PARAMETERS):
        own[0, n] = points[n, i]
    if fresh == 1:
        tally[BEGUN] = 0
        counters[j, 1] = settled[j]
    else:
        for n in range(N_SERIES_TALLY):
            tally[n] = whole[n, j]
        for n in range(N_SERIES_MEMO):
            memo[n] = real[n, j]
        tally[NOTED_AT] = 0  # that place is not kept between launches
        first = N_SERIES_MEMO
        for n in range(N_SIDES):
            work.side[n] = whole[N_SERIES_TALLY + n, j]
            work.scale[n] = real[first + n, j]
            work.measured[n] = real[first + N_SIDES + n, j]
        first += 2 * N_SIDES
        for n in range(N_MODES):
            work.usual[n] = real[first + n, j]
            work.dwell[n] = real[first + N_MODES + n, j]
        first += 2 * N_MODES
        for n in range(N_U):
            work.rest[n] = real[first + n, j]
            work.w[n] = u[j, n]
        for n in range(N_PARAMETERS):
            work.q[n] = own[0, n]
        for n in range(N_MEMORY):
            work.q[N_PARAMETERS + n] = memory[j, n]
    form = Generated(
        periods,
        own[:, :N_PARAMETERS],
        periods[i : i + 1],
        LACKING,
        KINDS,
        norms[0],
        norms[1],
        settings[0],
        settings[1],
        METHOD,
        ORDER,
        1,
        CHECKED,
        CORNERS,
        N_GUARDS,
        N_INDICATORS,
        N_OUTPUTS,
    )
    at = Section(
        settings[2] if plan[0] < 0 else -1.0, plan[0], plan[1], plan[2], plan[3], plan[4], settings[3], 1, plan[0] < 0
    )
    returns = transient[min(j, transient.shape[0] - 1)], keep[min(j, keep.shape[0] - 1)]
    goal = Goal(RETURNS_OF_SECTION, returns[0], returns[1], 0.0, 0.0, norms[2], pause)
    motion = Motion(u[j], memory[j, :N_MEMORY], clock[j], counters[j])
    window = window_of(Kept(*out), j)
    none = MODE_LIST  # series ask nothing of the last ones
    net = Net(TRANSITIONS, ROWS, ROW_START, MODE_START, MODE_LIST, AT, TRANSITIONS, none, none, none)
    code = march(0, form, net, at, goal, motion, Seen(window, (), ()), (), work)
    window.status[0] = code
    if code != PAUSED:
        leave(0, form, motion, work)
        return
    for n in range(N_U):
        u[j, n] = work.w[n]
        real[N_REAL - N_U + n, j] = work.rest[n]
    for n in range(N_MEMORY):
        memory[j, n] = work.q[N_PARAMETERS + n]
    for n in range(N_SERIES_TALLY):
        whole[n, j] = tally[n]
    for n in range(N_SERIES_MEMO):
        real[n, j] = memo[n]
    first = N_SERIES_MEMO
    for n in range(N_SIDES):
        whole[N_SERIES_TALLY + n, j] = work.side[n]
        real[first + n, j] = work.scale[n]
        real[first + N_SIDES + n, j] = work.measured[n]
    first += 2 * N_SIDES
    for n in range(N_MODES):
        real[first + n, j] = work.usual[n]
        real[first + N_MODES + n, j] = work.dwell[n]
