"""Growth of small changes along trajectories on a GPU, one per thread: text of a generated module.

``neighbours`` follows a run and a neighbour over some section returns, ``frames`` a run with its frame over some units
of time; both go on from where the launch before left them, so that a launch stays short.
"""

from numba import float64, int64

from .cuda_planar import N_INDICATORS, N_OUTPUTS
from .cuda_tables import tabled
from .cuda_target import cuda, entry, local
from .planar_settle import part
from .planar_spectrum import spectrum

UNITS = 128  # of time in one launch of ``frames``, at most


@local
def single():
    """What ``chain`` leaves behind, for one return of one trajectory."""
    section = cuda.local.array((1, 1, 2), float64)
    top = cuda.local.array((1, 2), float64)
    bottom = cuda.local.array((1, 2), float64)
    i_top = cuda.local.array((1, N_INDICATORS), float64)
    i_bottom = cuda.local.array((1, N_INDICATORS), float64)
    o_top = cuda.local.array((1, N_OUTPUTS), float64)
    o_bottom = cuda.local.array((1, N_OUTPUTS), float64)
    crossings = cuda.local.array(1, int64)
    contacts = cuda.local.array(1, int64)
    elapsed = cuda.local.array(1, float64)
    times = cuda.local.array((1, 1), float64)
    modes = cuda.local.array((1, 1), int64)
    status = cuda.local.array(1, int64)
    return section, top, bottom, i_top, i_bottom, o_top, o_bottom, crossings, contacts, elapsed, times, modes, status


@entry
def neighbours(
    jobs, rows, packed, multiples, built, net, u, clock, counters, begin, end, batch, size, offsets, sums, plan, phase,
    limit, status,
):  # fmt: skip
    """Returns begin <= n < end of each job and its neighbour: see ``part``."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    linear, scratch = tabled(packed, multiples, built, rows[j])
    moved = (cuda.local.array(2, float64), cuda.local.array(3, float64), cuda.local.array(4, int64))
    flow = (linear, net, phase, 1e300, limit, scratch, u[j : j + 1])
    status[j] = part(
        begin, end, batch, 0, size, (u[j], clock[j], counters[j]), moved, offsets[j], sums[j], flow, plan, single()
    )


@entry
def frames(
    jobs, rows, packed, multiples, built, net, u, clock, counters, count, units, limit, scale, Q, growth, sums, status
):  # fmt: skip
    """``count`` units of time of each job with its frame: see ``spectrum``. ``growth[j]`` gains the logarithms."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    linear, scratch = tabled(packed, multiples, built, rows[j])
    X = cuda.local.array((4, 2), float64)
    logarithms = cuda.local.array((UNITS, 2), float64)
    lengths = cuda.local.array(2, float64)
    t_z = cuda.local.array(2, float64)
    for n in range(count):
        logarithms[n, 0] = 0.0
        logarithms[n, 1] = 0.0
    head = (0, u[j], clock[j], counters[j])
    own = (Q[j], X, logarithms, lengths, t_z, sums[j])
    status[j] = spectrum(*(head + linear + net + (count, units[rows[j]], limit, scale) + own + scratch))
    for n in range(count):
        growth[j, 0] += logarithms[n, 0]
        growth[j, 1] += logarithms[n, 1]
