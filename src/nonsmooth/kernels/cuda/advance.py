"""Trajectories of planar systems on a GPU, one per thread.

This file is text of a generated module (``cuda.module``), behind the planar files of the CPU. ``advance`` is the one
heavy kernel: it marches every trajectory by its own number of section returns. What becomes of the
returns is decided outside, so that all threads do the same thing at the same time, finished trajectories are left out
of the next launch, and a launch stays short.
"""

from nonsmooth.kernels.cuda.tables import tabled
from nonsmooth.kernels.cuda.target import cuda, device, entry
from nonsmooth.kernels.hybrid.codes import BEGUN, OK, RETURNS_OF_SECTION
from nonsmooth.kernels.hybrid.kept import Kept, Section
from nonsmooth.kernels.hybrid.loop import leave, march
from nonsmooth.kernels.hybrid.records import Goal, Motion, Net, Seen
from nonsmooth.kernels.hybrid.sections import window_of
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
