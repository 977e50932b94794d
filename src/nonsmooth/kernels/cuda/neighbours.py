"""Growth by two neighbours on a GPU, one pair per thread: text of a generated module.

``neighbours`` follows a run and a neighbour over some section returns, and goes on from where the launch before left
them, so that a launch stays short.
"""

from numba import float64, int64

from nonsmooth.kernels.cuda.advance import go
from nonsmooth.kernels.cuda.arrays import N_FUNCTIONALS
from nonsmooth.kernels.cuda.tables import tabled
from nonsmooth.kernels.cuda.target import cuda, entry, local
from nonsmooth.kernels.hybrid.codes import OK
from nonsmooth.kernels.hybrid.kept import Kept
from nonsmooth.kernels.hybrid.records import Motion, Net
from nonsmooth.kernels.judging.judge import separate


@local
def single():
    """Room for the results of ``go``, for one return of one trajectory."""
    section = cuda.local.array((1, 2), float64)
    high = cuda.local.array(N_FUNCTIONALS, float64)
    low = cuda.local.array(N_FUNCTIONALS, float64)
    crossings = cuda.local.array(1, int64)
    contacts = cuda.local.array(1, int64)
    elapsed = cuda.local.array(1, float64)
    times = cuda.local.array(1, float64)
    modes = cuda.local.array(1, int64)
    status = cuda.local.array(1, int64)
    return Kept(section, high, low, crossings, contacts, elapsed, times, modes, status)


@entry
def neighbours(jobs, rows, point, net, place, span, sizes, pair, plan, phase, limit, status):
    """Returns begin <= n < end of each job and its neighbour (``span``: begin, end, batch): see ``exponent``."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    u, clock, counters = place
    begin, end, batch = span
    offsets, sums = pair
    linear, scratch = tabled(point, rows[j])
    motion = Motion(u[j], u[j, 0:0], clock[j], counters[j])
    moved = Motion(cuda.local.array(2, float64), u[j, 0:0], cuda.local.array(3, float64), cuda.local.array(4, int64))
    out, code = single(), OK
    for n in range(begin, end):
        for d in range(2):
            moved.u[d] = motion.u[d] + offsets[j, d]
        for d in range(3):
            moved.clock[d] = motion.clock[d]
        for d in range(4):
            moved.counters[d] = motion.counters[d]
        for one in range(2):
            which = motion if one == 0 else moved
            code = go(which, linear, Net(*net), phase, limit, plan, 0, 1, out, scratch)
            if code != OK:
                break
        if code != OK:
            break
        separate(n, batch, linear.period[0], motion.u, moved.u, sizes[j], offsets[j], sums[j])
    status[j] = code
