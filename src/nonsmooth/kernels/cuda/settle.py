"""Decisions about jobs on a GPU between their runs, one job per thread: text of a generated module.

It is the processor's text (``settle``, ``judge``, ``exponent``); the runs in between are launches of ``advance``. Job j
has row j in every array; a launch gets the list of the jobs that it concerns.
"""

from math import nan

from numba import float64

from nonsmooth.kernels.cuda.target import cuda, entry
from nonsmooth.kernels.hybrid.codes import NOT_GUARANTEED, OK
from nonsmooth.kernels.judging.judge import contraction, multiplier, separate
from nonsmooth.kernels.judging.settle import Jobs, Rules, next_run

N_STATES = 2  # set for each system
LEGS = N_STATES + 1  # a trajectory and its neighbours


@entry
def beside(jobs, apart, only, factor, offsets, states, others):
    """Row j + apart of others is now the state of job j, moved by factor * offsets[j] (in one state, or in all: -1)."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    row = j + apart
    u, memory, clock, counters = states
    other_u, other_memory, other_clock, other_counters = others
    for d in range(u.shape[1]):
        moved = factor * offsets[j, d] if only < 0 or d == only else 0.0
        other_u[row, d] = u[j, d] + moved
    for d in range(memory.shape[1]):
        other_memory[row, d] = memory[j, d]
    for d in range(clock.shape[1]):
        other_clock[row, d] = clock[j, d]
    for d in range(counters.shape[1]):
        other_counters[row, d] = counters[j, d]


@entry
def measure(jobs, apart, difference, sizes, starts, u, codes_of_job, codes, mu):
    """mu[j]: the largest multiplier, from where job j (row j of u, from its start) and its neighbours (j + apart, ...)
    have come."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    images = cuda.local.array((LEGS, N_STATES), float64)
    matrices = cuda.local.array((2, N_STATES, N_STATES), float64)
    good = True
    for leg in range(LEGS):
        row = j + leg * apart
        code = codes_of_job[j] if leg == 0 else codes[row]
        good = good and (code == OK or code == NOT_GUARANTEED)
        for d in range(N_STATES):
            images[leg, d] = u[row, d]
    mu[j] = multiplier(images, starts[j], sizes[j], difference, matrices) if good else nan


@entry
def contract(jobs, p, tolerance, sizes, section, run, codes, mu):
    """mu[j]: the factor by which the run beside job j nears its cycle on a Poincare section."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    good = codes[j] == OK or codes[j] == NOT_GUARANTEED
    mu[j] = contraction(section[j], run[j], sizes[j], p, tolerance) if good else nan


@entry
def decide(jobs, given, known, codes, codes_after, section, top, bottom, mu, u):
    """Set what each job is to do next; ``given`` and ``known`` are ``Rules`` and ``Jobs``."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    code = codes[j] if codes[j] != OK else codes_after[j]
    next_run(Jobs(*known), j, Rules(*given), code, section[j], top[j], bottom[j], mu[j], u[j])


@entry
def separated(jobs, n, batch, elapsed, u, others, sizes, offsets, sums):
    """Return n of each job and of its neighbour, taken into sums[j]: see ``separate``."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    separate(n, batch, elapsed[j], u[j], others[j], sizes[j], offsets[j], sums[j])
