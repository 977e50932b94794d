"""Jobs of a linear system brought to their attractors in one compiled call, and their exponents.

What is wanted of a job next is decided in ``settle``; the loop here runs it, because in Python the steps between the
runs cost more than the motion itself. The sections are stroboscopic.
"""

from math import nan

from numba import types

from nonsmooth.kernels.compile.cache import device, kernel
from nonsmooth.kernels.hybrid.codes import INTERRUPTED, OK
from nonsmooth.kernels.hybrid.places import BEGUN
from nonsmooth.kernels.hybrid.records import FLOW, KEPT, MOTION, Goal, Section
from nonsmooth.kernels.hybrid.sections import chain
from nonsmooth.kernels.judging.exponent import separate
from nonsmooth.kernels.judging.judge import multiplier
from nonsmooth.kernels.judging.settle import END, FRESH, JOBS, PROBE, RULES, begin_job, next_run
from nonsmooth.kernels.linear.tables import STATES

_i, _f = types.int64, types.float64
_f1, _f2, _f3, _i1 = _f[::1], _f[:, ::1], _f[:, :, ::1], _i[::1]

BEGIN = types.Tuple((_i1, _f2, _f1, _i1))
PLANS = types.UniTuple(_i1, 2)
KEPTS = types.UniTuple(KEPT, 2)
MOTIONS = types.UniTuple(MOTION, 2)
PROBES = types.Tuple((_f2, _f3))
RESULTS = types.Tuple((_f1, _f1, _f2, _f2, _f2, _i1))


@device
def go(i, motion, flow, plan, transient, keep, out):
    """Run parameter row i on from ``motion``, which is left where it ends. Returns the status."""
    motion.clock[2] = 0.0  # the time stands as it is: the kernel must not scale it to another period
    section = Section(plan[0], plan[1], plan[2], plan[3], plan[4], plan[5], flow.phase, flow.t_max)
    goal = Goal(transient, keep, 0.0, 0.0, flow.limit, flow.patience)
    while chain(i, i + 1, flow.starts, flow.form, flow.net, section, goal, motion, out, flow.tables, flow.work) == i:
        if flow.stop[0] != 0:
            flow.work.tally[BEGUN] = 0
            return INTERRUPTED
    return out.status[i]


@device
def put(motion, i, u, phase, mode, flow):
    """A state at a phase of the forcing of parameter row i."""
    T = flow.form.period[i]
    for k in range(STATES):
        motion.u[k] = u[k]
    motion.clock[0] = phase * T if T < 1e300 else 0.0
    motion.clock[1] = 0.0
    motion.counters[0] = mode


@device
def copy(motion, moved):
    """``moved`` becomes ``motion``."""
    for k in range(STATES):
        moved.u[k] = motion.u[k]
    for k in range(motion.memory.shape[0]):
        moved.memory[k] = motion.memory[k]
    for k in range(3):
        moved.clock[k] = motion.clock[k]
    for k in range(4):
        moved.counters[k] = motion.counters[k]


@device
def probe(i, p, size, rules, motion, moved, flow, plan, quiet, cycle, work):
    """Largest modulus of the multipliers of the p-th return map where the job stands; nan: unknown.

    The neighbours first: ``cycle`` is left with the whole cycle of the job itself."""
    images, matrices = work
    for leg in range(STATES, -1, -1):
        copy(motion, moved)
        if leg > 0:
            moved.u[leg - 1] += rules.difference * size[leg - 1]
            code = go(i, moved, flow, quiet, p - 1, 1, cycle)
        else:
            code = go(i, moved, flow, plan, 0, p, cycle)
        if code != OK:
            return nan
        for k in range(STATES):
            images[leg, k] = moved.u[k]
    return multiplier(images, size, rules.difference, matrices)


@kernel(types.void(BEGIN, _i, _i, RULES, JOBS, FLOW, PLANS, KEPTS, MOTIONS, PROBES, RESULTS))
def settle_many(begin, carried, extremes, rules, jobs, flow, plans, keeps, motions, work, results):
    """Job j: parameter row rows[j], from starts[j] at phases[j] of the forcing in the mode modes[j] (``begin``).

    With ``carried`` = 1 a job goes on from where the one before it ended (from its own start where that failed).
    ``plans``: with and without extremes; ``keeps``: room for the kept returns and for one cycle; ``motions``: of the
    job and of its neighbours. ``results``: crossings and contacts per return, maxima, minima (over one whole cycle
    where there is one, else over as many returns as are kept), last section point, mode there."""
    rows, starts, phases, modes = begin
    plan, quiet = plans
    kept, cycle = keeps
    motion, moved = motions
    crossings, contacts, maximum, minimum, last, mode = results
    whole = plan if extremes != 0 else quiet
    good = False
    for j in range(rows.shape[0]):
        if flow.stop[0] != 0:
            break
        i = rows[j]
        if good and carried != 0:
            put(motion, i, motion.u, flow.phase, motion.counters[0], flow)
        begin_job(jobs, j, rules, 1 if good and carried != 0 else 0)
        while jobs.wanted[j] != END:
            code, mu = OK, nan
            if jobs.wanted[j] == PROBE:
                p, size = jobs.period_number[j], jobs.size[j]
                mu = probe(i, p, size, rules, motion, moved, flow, whole, quiet, cycle, work)
            else:
                if jobs.wanted[j] == FRESH:
                    put(motion, i, starts[j], phases[j], modes[j], flow)
                    motion.counters[1] = -1
                code = go(i, motion, flow, quiet, jobs.transient[j], rules.keep, kept)
                if code == OK:  # true extremes are dear: one return with them gives the motion's size
                    code = go(i, motion, flow, plan, 0, rules.beyond, cycle)
            next_run(jobs, j, rules, code, kept.section[i], cycle.maximum[i], cycle.minimum[i], mu, motion.u)
        mode[j] = motion.counters[0]
        for k in range(STATES):
            last[j, k] = motion.u[k]
        p = jobs.period_number[j]
        good = p > 0 or code == OK
        if not good:
            continue
        out, n = (cycle, p) if p > 0 else (kept, rules.keep)
        crossings[j] = out.crossings[i] / n
        contacts[j] = out.contacts[i] / n
        if extremes == 0:
            continue
        if p == 0:
            copy(motion, moved)
            code = go(i, moved, flow, plan, 0, n, kept)
            if code != OK:
                jobs.status[j] = code
                continue
        for k in range(STATES):
            maximum[j, k] = out.maximum[i, k]
            minimum[j, k] = out.minimum[i, k]


@device
def follow_pair(begin, end, batch, i, size, motion, moved, offset, sums, flow, quiet, out):
    """Returns begin <= n < end of a run and of its neighbour; gives a status. See ``exponent``."""
    for n in range(begin, end):
        copy(motion, moved)
        for k in range(STATES):
            moved.u[k] += offset[k]
        for one in range(2):
            code = go(i, motion if one == 0 else moved, flow, quiet, 0, 1, out)
            if code != OK:
                return code
        separate(n, batch, flow.form.period[i], motion.u, moved.u, size, offset, sums)
    return OK


@kernel(types.void(BEGIN, _i, _i, _f1, FLOW, _i1, KEPT, MOTIONS, _f2, _f2, _i1))
def separate_many(begin, returns, batch, size, flow, quiet, out, motions, offsets, sums, status):
    """Growth of the distance of two neighbours over ``returns`` section returns, taken into sums[j], for each job.

    Job j begins at starts[j] at phases[j] in the mode modes[j], its neighbour beside it by offsets[j]."""
    rows, starts, phases, modes = begin
    motion, moved = motions
    for j in range(rows.shape[0]):
        put(motion, rows[j], starts[j], phases[j], modes[j], flow)
        status[j] = follow_pair(0, returns, batch, rows[j], size, motion, moved, offsets[j], sums[j], flow, quiet, out)
