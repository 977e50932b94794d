"""Jobs brought to their attractors in one compiled call, and their exponents, with the march of any engine.

What is wanted of a job next is decided in ``settle``; the loop here runs it, because in Python the steps between the
runs cost more than the motion itself. The march is called by its address (``hybrid.run``). The sections are
stroboscopic.
"""

from math import nan
from typing import Any, NamedTuple

from numba import types

from nonsmooth.kernels.compile.cache import device, kernel
from nonsmooth.kernels.compile.pointers import function_at
from nonsmooth.kernels.hybrid.codes import INTERRUPTED, NOT_GUARANTEED, OK, PAUSED
from nonsmooth.kernels.hybrid.places import BEGUN
from nonsmooth.kernels.hybrid.records import BEGIN, END, EXTREMES, KEEP, KEPT, MOTION, TRANSIENT, type_of
from nonsmooth.kernels.judging.exponent import separate
from nonsmooth.kernels.judging.judge import multiplier
from nonsmooth.kernels.judging.settle import END as SETTLED
from nonsmooth.kernels.judging.settle import FRESH, JOBS, PROBE, RULES, begin_job, next_run

_i, _f = types.int64, types.float64
_f1, _f2, _f3, _i1 = _f[::1], _f[:, ::1], _f[:, :, ::1], _i[::1]

run_at = function_at(types.FunctionType(types.int64(*[types.int64] * 5)))


class Runs(NamedTuple):
    """The march of an engine for a trajectory and one beside it, which share what is ordered."""

    function: Any  # (1,) address of ``hybrid.run.run``
    blocks: Any  # addresses: system, call of the trajectory and of the one beside, kept returns, one cycle, log, growth
    orders: Any  # (N_ORDERS,) of both calls
    tally: Any  # counts of the work
    periods: Any  # (P,) of the forcing
    memory: Any  # (n_memory,) at a fresh start
    stop: Any  # (1,) not zero: the work is not wanted any more
    motion: Any
    beside: Any
    kept: Any  # room for the kept returns
    cycle: Any  # and for one cycle


RUNS = type_of(Runs, *[_i1] * 4, _f1, _f1, _i1, MOTION, MOTION, KEPT, KEPT)
STARTS = types.Tuple((_i1, _f2, _f1, _i1))
PROBES = types.Tuple((_f2, _f3))
RESULTS = types.Tuple((_f1, _f1, _f2, _f2, _f2, _i1))


@device
def go(i, beside, cycle, extremes, transient, keep, settled, runs):
    """Run parameter row i on from a motion, which is left where it ends. Returns the status.

    ``settled`` = 0: transitions that hold there already are taken first."""
    orders, blocks, run = runs.orders, runs.blocks, run_at(runs.function[0])
    orders[BEGIN], orders[END], orders[EXTREMES], orders[TRANSIENT], orders[KEEP] = i, i + 1, extremes, transient, keep
    motion = runs.beside if beside else runs.motion
    motion.counters[1] = settled
    motion.clock[2] = 0.0  # the time stands as it is: the march must not scale it to another period
    while run(blocks[0], blocks[2 if beside else 1], blocks[4 if cycle else 3], blocks[5], blocks[6]) == PAUSED:
        if runs.stop[0] != 0:
            runs.tally[BEGUN] = 0
            return INTERRUPTED
    return runs.cycle.status[i] if cycle else runs.kept.status[i]


@device
def put(i, place, phase, mode, runs):
    """A state (and memory, where the place says it) at a phase of the forcing of parameter row i."""
    motion, T = runs.motion, runs.periods[i]
    n = motion.u.shape[0]
    for k in range(n):
        motion.u[k] = place[k]
    for k in range(motion.memory.shape[0]):
        motion.memory[k] = place[n + k] if place.shape[0] > n + k else runs.memory[k]
    motion.clock[0] = phase * T if T < 1e300 else 0.0
    motion.clock[1] = 0.0
    motion.counters[0] = mode


@device
def copy(runs):
    """The motion beside becomes the motion."""
    motion, moved = runs.motion, runs.beside
    for k in range(motion.u.shape[0]):
        moved.u[k] = motion.u[k]
    for k in range(motion.memory.shape[0]):
        moved.memory[k] = motion.memory[k]
    for k in range(3):
        moved.clock[k] = motion.clock[k]
    for k in range(4):
        moved.counters[k] = motion.counters[k]


@device
def probe(i, p, size, rules, extremes, runs, work):
    """Largest modulus of the multipliers of the p-th return map where the job stands; nan: unknown.

    The neighbours first: ``cycle`` is left with the whole cycle of the job itself."""
    images, matrices = work
    n = size.shape[0]
    for leg in range(n, -1, -1):
        copy(runs)
        if leg > 0:
            runs.beside.u[leg - 1] += rules.difference * size[leg - 1]
            code = go(i, True, True, 0, p - 1, 1, 0, runs)
        else:
            code = go(i, True, True, extremes, 0, p, 1, runs)
        if code != OK and code != NOT_GUARANTEED:
            return nan
        for k in range(n):
            images[leg, k] = runs.beside.u[k]
    return multiplier(images, size, rules.difference, matrices)


@kernel(types.void(STARTS, _f, _i, _i, RULES, JOBS, RUNS, PROBES, RESULTS))
def settle_many(starts, phase, carried, extremes, rules, jobs, runs, work, results):
    """Job j: parameter row rows[j], from places[j] at phases[j] of the forcing in the mode modes[j] (``starts``).

    With ``carried`` = 1 a job goes on at the section's phase from where the one before it ended (from its own start
    where that failed). ``results``: crossings and contacts per return, maxima, minima (over one whole cycle where there
    is one, else over as many returns as are kept), last section point with memory, mode there."""
    rows, places, phases, modes = starts
    crossings, contacts, maximum, minimum, last, mode = results
    motion, n = runs.motion, runs.motion.u.shape[0]
    good = False
    for j in range(rows.shape[0]):
        if runs.stop[0] != 0:
            break
        i = rows[j]
        if good and carried != 0:
            motion.clock[0] = phase * runs.periods[i] if runs.periods[i] < 1e300 else 0.0
            motion.clock[1] = 0.0
        begin_job(jobs, j, rules, 1 if good and carried != 0 else 0)
        code = OK
        while jobs.wanted[j] != SETTLED:
            mu = nan
            if jobs.wanted[j] == PROBE:
                mu = probe(i, jobs.period_number[j], jobs.size[j], rules, extremes, runs, work)
            else:
                if jobs.wanted[j] == FRESH:
                    put(i, places[j], phases[j], modes[j], runs)
                code = go(i, False, False, 0, jobs.transient[j], rules.keep, jobs.settled[j], runs)
                if code == OK or code == NOT_GUARANTEED:  # true extremes are dear: one return gives the motion's size
                    after = go(i, False, True, 1, 0, rules.beyond, 1, runs)
                    code = after if code == OK else code
            kept, cycle = runs.kept, runs.cycle
            next_run(jobs, j, rules, code, kept.section[i], cycle.maximum[i], cycle.minimum[i], mu, motion.u)
        mode[j] = motion.counters[0]
        for k in range(n):
            last[j, k] = motion.u[k]
        for k in range(motion.memory.shape[0]):
            last[j, n + k] = motion.memory[k]
        p = jobs.period_number[j]
        good = p > 0 or code == OK or code == NOT_GUARANTEED
        if not good:
            continue
        if p == 0 and extremes != 0:
            copy(runs)
            code = go(i, True, False, 1, 0, rules.keep, 1, runs)
            if code != OK and code != NOT_GUARANTEED:
                jobs.status[j] = code
                continue
        out, count = (runs.cycle, p) if p > 0 else (runs.kept, rules.keep)
        crossings[j] = out.crossings[i] / count
        contacts[j] = out.contacts[i] / count
        if extremes != 0:
            for k in range(n):
                maximum[j, k] = out.maximum[i, k]
                minimum[j, k] = out.minimum[i, k]


@device
def follow_pair(begin, end, batch, i, size, offset, sums, runs):
    """Returns begin <= n < end of a run and of its neighbour; gives a status. See ``exponent``."""
    for n in range(begin, end):
        copy(runs)
        for k in range(size.shape[0]):
            runs.beside.u[k] += offset[k]
        for one in range(2):
            code = go(i, one == 1, False, 0, 0, 1, 0, runs)
            if code != OK and code != NOT_GUARANTEED:
                return code
        separate(n, batch, runs.periods[i], runs.motion.u, runs.beside.u, size, offset, sums)
    return OK


@kernel(types.void(STARTS, _i, _i, _f1, RUNS, _f2, _f2, _i1))
def separate_many(starts, returns, batch, size, runs, offsets, sums, status):
    """Growth of the distance of two neighbours over ``returns`` section returns, taken into sums[j], for each job.

    Job j begins at places[j] at phases[j] in the mode modes[j], its neighbour beside it by offsets[j]."""
    rows, places, phases, modes = starts
    for j in range(rows.shape[0]):
        put(rows[j], places[j], phases[j], modes[j], runs)
        status[j] = follow_pair(0, returns, batch, rows[j], size, offsets[j], sums[j], runs)
