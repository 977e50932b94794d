"""Trajectories of planar systems on a GPU, one per thread, and their growth by two neighbours, a pair per thread.

This file is text of a generated module (``cuda.module``), behind the planar files of the CPU. ``advance`` is the one
heavy kernel: it marches every trajectory by its own number of section returns. What becomes of the
returns is decided outside, so that all threads do the same thing at the same time, finished trajectories are left out
of the next launch, and a launch stays short.

``neighbours`` follows a run and a neighbour over some section returns, and goes on from where the launch before left
them, so that a launch stays short.
"""

from numba import float64, int64

from nonsmooth.kernels.cuda.arrays import N_FUNCTIONALS
from nonsmooth.kernels.cuda.tables import tabled
from nonsmooth.kernels.cuda.target import cuda, device, entry, local
from nonsmooth.kernels.hybrid.codes import BEGUN, OK, RETURNS_OF_SECTION
from nonsmooth.kernels.hybrid.kept import Kept, Section
from nonsmooth.kernels.hybrid.loop import leave, march
from nonsmooth.kernels.hybrid.records import Goal, Motion, Net, Seen
from nonsmooth.kernels.hybrid.sections import window_of
from nonsmooth.kernels.judging.judge import separate
from nonsmooth.kernels.linear.extremes import finish


@device
def go(motion, form, net, phase, limit, plan, transient, keep, out, scratch):
    """Run the one parameter row on from a motion, which is left where it ends. Returns the status."""
    tables, work = scratch
    section = Section(phase, plan[0], plan[1], plan[2], plan[3], plan[4], 1e300, plan[5], 1)
    goal = Goal(RETURNS_OF_SECTION, transient, keep, 0.0, 0.0, limit, 1 << 62)
    code = march(0, form, net, section, goal, motion, Seen(out, (), ()), tables, work)
    work.tally[BEGUN] = 0
    motion.counters[1] = 0
    finish(form, tables, work, out)
    out.status[0] = code
    if code == OK:
        leave(0, form, motion, work)
    return code


@entry
def advance(jobs, rows, point, net, place, counts, plans, way, phase, limit, out, other):
    """Thread k: march the state of job j = jobs[k] under parameter row rows[j] by transient[j] section returns, then
    keep[j] more into row j of ``out``. (One number for all jobs where these arrays are short.)

    ``place``: states, clocks, counters of all; ``counts``: transient, keep; ``plans``: plan, after; ``way``: ``legs``
    and ``apart``. With more ``legs`` the tables serve again, under the plan ``after``: ``apart`` = 0, for one more
    return, into row j of ``other``; else for as many returns of the states j + apart, j + 2 apart, ..., the last of
    each into that row of ``other``. A state is left at its last return; statuses stand in the buffers, and what comes
    behind one that failed is left out."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    u, clock, counters = place
    transient, keep = counts
    legs, apart = way
    linear, scratch = tabled(point, rows[j])
    n_transient = transient[min(j, transient.shape[0] - 1)]
    n_keep = keep[min(j, keep.shape[0] - 1)]
    for leg in range(legs):
        row = j + leg * apart
        if leg > 0:
            n_transient, n_keep = n_transient + n_keep - 1 if apart > 0 else 0, 1
        motion = Motion(u[row], u[row, 0:0], clock[row], counters[row])
        plan, into = (plans[1], other) if leg > 0 else (plans[0], out)
        window = window_of(Kept(*into), row)
        code = go(motion, linear, Net(*net), phase, limit, plan, n_transient, n_keep, window, scratch)
        if code != OK:
            break


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
