"""Growth of a frame along trajectories on a GPU, one per thread: text of a generated module.

``frames`` follows a run with its frame over some units of time, and goes on from where the launch before left them, so
that a launch stays short.
"""

from numba import float64

from nonsmooth.kernels.cuda.tables import tabled
from nonsmooth.kernels.cuda.target import cuda, entry
from nonsmooth.kernels.hybrid.codes import GROW
from nonsmooth.kernels.hybrid.kept import Section
from nonsmooth.kernels.hybrid.loop import leave, march
from nonsmooth.kernels.hybrid.records import Goal, Growth, Motion, Net, Seen
from nonsmooth.kernels.linear.tables import STATES

UNITS = 128  # of time in one launch of ``frames``, at most


@entry
def frames(jobs, rows, point, net, place, count, units, limit, scale, found):
    """``count`` units of time of each job with its frame: see ``growth``.

    ``found``: frames, logarithms (which gain), sums, statuses of all jobs; ``place``: states, clocks, counters."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    u, clock, counters = place
    Q, growth, sums, status = found
    form, scratch = tabled(point, rows[j])
    logarithms = cuda.local.array((UNITS, STATES), float64)
    lengths = cuda.local.array(STATES, float64)
    step = cuda.local.array((STATES, STATES), float64)
    reset = cuda.local.array((STATES, STATES), float64)
    matrix = cuda.local.array((STATES, STATES), float64)
    fields = cuda.local.array((4, STATES), float64)
    t_z = cuda.local.array(STATES, float64)
    turned = cuda.local.array(STATES, float64)
    for n in range(count):
        for c in range(STATES):
            logarithms[n, c] = 0.0
    motion = Motion(u[j], u[j, 0:0], clock[j], counters[j])
    motion.counters[1] = 0
    none, nothing = counters[j, 0:0], u[j, 0:0]
    seen = Growth(
        scale,
        Q[j],
        logarithms,
        lengths,
        sums[j],
        step,
        reset,
        matrix,
        fields,
        t_z,
        turned,
        none,
        none,
        0,
        nothing,
        nothing,
    )
    goal = Goal(GROW, 0, count, 0.0, units[rows[j]], limit, 1 << 62)
    section = Section(0.0, -1, 0, -1, 0, 1, 0.0, 0, 0)
    status[j] = march(0, form, Net(*net), section, goal, motion, Seen((), (), seen), scratch[0], scratch[1])
    leave(0, form, motion, scratch[1])
    for n in range(count):
        for c in range(STATES):
            growth[j, c] += logarithms[n, c]
