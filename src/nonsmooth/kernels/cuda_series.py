"""Trajectories by the series methods on a GPU, one per thread: text of a generated module.

This file stands behind the model's own functions and the series files of the CPU (``cuda_series_module``). ``advance``
runs ``march`` for every job until it has counted its section returns, or has made as many steps as a launch may; then
it is launched again for those that are under way, and goes on where it stopped, so that the cut changes no number.

Everything that is known of the system (its transitions, sizes, method and order) is a constant here, so that what it
does not need is never compiled. What ``march`` keeps between two launches is stored with the job as last index:
neighbouring threads then read neighbouring numbers.
"""

import numpy as np
from numba import float64, int64

from . import series_places as place
from .codes import PAUSED
from .cuda_target import cuda, entry, local
from .polynomial import stack_size
from .series import march
from .series_places import N_CHOICE, N_CONTROL, N_TALLY

# Set for each system and method.
METHOD, ORDER, CHECKED, CORNERS, NONLINEAR_ROWS, N_GUARDS = 0, 16, 0, 0, 0, 0
N_PARAMETERS, N_MEMORY, N_INDICATORS, N_OUTPUTS, N_SCRATCH_ROWS = 1, 0, 1, 0, 1
FIRST = np.array([0, 1])
OUTGOING = np.array([0])
TRANSITIONS = np.array([[0, 0, 0, 1, 0, 0]])
ROWS = np.array([[0, 1, 0]])
AT = np.array([-1.0])
LACKING = np.array([[0]])
KINDS = np.array([1])

# No array of a thread is empty.
N_U = LACKING.shape[1]
N_MODES = LACKING.shape[0]
N_ROWS = ROWS.shape[0]
ALL_ROWS = N_U + N_INDICATORS + N_OUTPUTS + N_GUARDS
SEEN_ROWS = N_U + N_INDICATORS + N_OUTPUTS
N_Q = max(N_PARAMETERS + N_MEMORY, 1)
N_SIDES = max(N_INDICATORS, 1)
N_VALUES = max(ALL_ROWS - N_U, 1)
WIDTH = max(ORDER, 6) + 1
STACK = stack_size(WIDTH)
N_MEMO = place.N_MEMO + N_U
N_WHOLE = N_TALLY + N_SIDES  # numbers kept between launches
N_REAL = N_MEMO + 2 * N_SIDES + 2 * N_MODES


@local
def arrays_of_thread():
    """Scratch memory of a thread, as ``march`` takes it."""
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
    u_new = cuda.local.array(N_U, float64)
    q_new = cuda.local.array(N_Q, float64)
    scale = cuda.local.array(N_SIDES, float64)
    measured = cuda.local.array(N_SIDES, float64)
    side = cuda.local.array(N_SIDES, int64)
    side_next = cuda.local.array(N_SIDES, int64)
    rise = cuda.local.array(N_ROWS, int64)
    usual = cuda.local.array(N_MODES, float64)
    visited = cuda.local.array(N_MODES, int64)
    stack = cuda.local.array(STACK, float64)
    found = cuda.local.array(2, int64)
    u_dense = cuda.local.array(N_U, float64)
    u_before = cuda.local.array(N_U, float64)
    dwell = cuda.local.array(N_MODES, float64)
    near = cuda.local.array(N_VALUES, float64)
    K = (K0, K1, K2, K3, K4, K5, K6, K7)
    return (
        C, W, J0, J1, K, powers, a, d, vals, u_new, q_new, scale, measured, side, side_next, rise, usual, visited,
        stack, found, u_dense, u_before, dwell, near,
    )  # fmt: skip


@local
def no_log():
    """The logs of a run that records nothing."""
    times = cuda.local.array(1, float64)
    samples = cuda.local.array((1, 1), float64)
    return times, samples, samples, samples


@entry
def advance(
    jobs, rows, points, periods, exact_steps, norms, plan, settings, u, memory, clock, counters, settled, transient,
    keep, fresh, pause, whole, real, section, maximum, minimum, crossings, contacts, elapsed, status,
):  # fmt: skip
    """Thread k: march the state of job j = jobs[k] at parameter point rows[j] by transient[j] section returns, then
    keep[j] more, whose points and extremes are kept (one number for all jobs where these arrays are short).

    ``fresh`` = 1 begins a run, 0 goes on with one whose status is PAUSED. ``plan``: indicator, rising, mode, after,
    every; ``settings``: rtol, fixed step, phase of the section, longest wait for a return."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    i = rows[j]
    work = arrays_of_thread()
    choice = cuda.local.array(N_CHOICE, int64)
    control = cuda.local.array(N_CONTROL, float64)
    tally = cuda.local.array(N_TALLY, int64)
    memo = cuda.local.array(N_MEMO, float64)
    state = cuda.local.array(N_U, float64)
    q = cuda.local.array(N_Q, float64)
    time = cuda.local.array(3, float64)
    window = cuda.local.array((2, SEEN_ROWS), float64)
    for n in range(N_CHOICE):
        choice[n] = 0
    choice[place.METHOD], choice[place.ORDER], choice[place.LOCATE], choice[place.CHECKED] = METHOD, ORDER, 1, CHECKED
    choice[place.CORNERS], choice[place.NONLINEAR_ROWS], choice[place.N_GUARDS] = CORNERS, NONLINEAR_ROWS, N_GUARDS
    choice[place.N_PARAMETERS], choice[place.N_INDICATORS] = N_PARAMETERS, N_INDICATORS
    choice[place.N_OUTPUTS] = N_OUTPUTS
    choice[place.SECTION], choice[place.RISING], choice[place.SECTION_MODE] = plan[0], plan[1], plan[2]
    choice[place.AFTER], choice[place.EVERY], choice[place.PAUSE] = plan[3], plan[4], pause
    choice[place.TRANSIENT] = transient[min(j, transient.shape[0] - 1)]
    choice[place.KEEP] = keep[min(j, keep.shape[0] - 1)]
    control[place.RTOL], control[place.STEP], control[place.PERIOD] = settings[0], settings[1], periods[i]
    control[place.PHASE] = settings[2] * periods[i] if plan[0] < 0 else -1.0
    control[place.T_MAX], control[place.UNTIL] = settings[3], -1.0
    for n in range(N_U):
        state[n] = u[j, n]
    for n in range(N_PARAMETERS):
        q[n] = points[n, i]
    for n in range(N_MEMORY):
        q[N_PARAMETERS + n] = memory[j, n]
    for n in range(3):
        time[n] = clock[j, n]
    scale, measured, side, usual, dwell = work[11], work[12], work[13], work[16], work[22]
    if fresh == 1:
        for n in range(N_TALLY):
            tally[n] = 0
        for n in range(N_MEMO):
            memo[n] = 0.0
        tally[place.SETTLED] = settled[j]
    else:
        choice[place.PAUSE] += whole[place.STEPS, j]
        for n in range(N_TALLY):
            tally[n] = whole[n, j]
        for n in range(N_MEMO):
            memo[n] = real[n, j]
        for n in range(N_SIDES):
            side[n] = whole[N_TALLY + n, j]
            scale[n] = real[N_MEMO + n, j]
            measured[n] = real[N_MEMO + N_SIDES + n, j]
        for n in range(N_MODES):
            usual[n] = real[N_MEMO + 2 * N_SIDES + n, j]
            dwell[n] = real[N_MEMO + 2 * N_SIDES + N_MODES + n, j]
        for n in range(SEEN_ROWS):
            window[0, n] = maximum[j, n]
            window[1, n] = minimum[j, n]
    code = march(
        field, jet, values, jump,  # noqa: F821 - of the model, whose text stands before this one
        (FIRST, OUTGOING, TRANSITIONS, ROWS, AT), LACKING, KINDS, choice, control, norms,
        exact_steps[i], state, q, time, counters[j], work, section[j], window, tally, memo, no_log(),
    )  # fmt: skip
    for n in range(N_U):
        u[j, n] = state[n]
    for n in range(N_MEMORY):
        memory[j, n] = q[N_PARAMETERS + n]
    for n in range(3):
        clock[j, n] = time[n]
    for n in range(SEEN_ROWS):
        maximum[j, n] = window[0, n]
        minimum[j, n] = window[1, n]
    if code == PAUSED:
        for n in range(N_TALLY):
            whole[n, j] = tally[n]
        for n in range(N_MEMO):
            real[n, j] = memo[n]
        for n in range(N_SIDES):
            whole[N_TALLY + n, j] = side[n]
            real[N_MEMO + n, j] = scale[n]
            real[N_MEMO + N_SIDES + n, j] = measured[n]
        for n in range(N_MODES):
            real[N_MEMO + 2 * N_SIDES + n, j] = usual[n]
            real[N_MEMO + 2 * N_SIDES + N_MODES + n, j] = dwell[n]
    crossings[j] = tally[place.KEPT_CROSSINGS]
    contacts[j] = tally[place.KEPT_CONTACTS]
    elapsed[j] = memo[place.ELAPSED]
    status[j] = code
