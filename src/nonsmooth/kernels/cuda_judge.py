"""What the returns of trajectories on a GPU say, one trajectory per thread: text of a generated module.

The rules are the CPU's (``planar_settle``); here they are asked in steps, because the runs in between are launches of
``advance``. Job j has row j in every array; a launch gets the list of the jobs that are still under way.
"""

from numba import float64

from .codes import OK, SLOW
from .cuda_target import cuda, entry
from .planar_settle import candidate, certain, modulus, size_of


@entry
def judge(
    jobs, keep, max_period, tolerance, least, section, top, bottom, sizes, period_number, status, residual, returns
):  # fmt: skip
    """Size of the motion from its extremes, and what the kept section points alone say of it."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    for c in range(2):
        sizes[j, c] = size_of(top[j, c], bottom[j, c], least[c])
    p, code, gap = candidate(section, j, keep, sizes[j], max_period, tolerance, returns[j])
    period_number[j] = p
    status[j] = code
    residual[j] = gap


@entry
def beside(jobs, keep, nudge, phase, periods, rows, section, modes, sizes, period_number, u, clock, counters):
    """Two neighbours (states j and J + j) of the section point whose p-th return is the last one kept."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    base = keep - 1 - period_number[j]
    for c in range(2):
        row = j + c * period_number.shape[0]
        for d in range(2):
            u[row, d] = section[j, base, d]
        u[row, c] += nudge * sizes[j, c]
        clock[row, 0] = phase * periods[rows[j]]
        clock[row, 1] = 0.0
        counters[row, 0] = modes[j, base]


@entry
def decide(jobs, keep, nudge, section, sizes, u, codes, period_number, status, residual, multiplier, returns):
    """The multiplier from where the neighbours have come, and whether the period number stands with it."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    beyond = j + period_number.shape[0]
    images = cuda.local.array((3, 2), float64)
    for d in range(2):
        images[0, d] = section[j, keep - 1, d] / sizes[j, d]
        images[1, d] = u[j, d] / sizes[j, d]
        images[2, d] = u[beyond, d] / sizes[j, d]
    mu = -1.0
    if codes[j] == OK and codes[beyond] == OK:
        mu = modulus(images, nudge)
    multiplier[j] = mu
    if not certain(period_number[j], mu, residual[j], returns[j]):
        period_number[j] = 0
        status[j] = SLOW
