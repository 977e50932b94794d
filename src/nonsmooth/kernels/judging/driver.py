"""Jobs brought to their attractors, and their exponents by two neighbours, with the march of any engine on any section.

What is wanted of a job next is decided in ``settle``; the loops here run it, because in Python the steps between the
runs cost more than the motion itself. The march is called by its address (``hybrid.run``). Where it pauses, so do the
loops: called again with the same arguments they go on. All that they know stands in ``at``.
"""

from math import nan
from typing import Any, NamedTuple

from numba import types

from nonsmooth.kernels.compile.cache import device, kernel
from nonsmooth.kernels.compile.pointers import function_at
from nonsmooth.kernels.hybrid.codes import BEGUN, NO_CONVERGENCE, NO_END, NOT_GUARANTEED, OK, PAUSED
from nonsmooth.kernels.hybrid.records import (
    BEGIN,
    END,
    EVERY,
    EXTREMES,
    KEEP,
    KEPT,
    MOTION,
    PHASE,
    ROW,
    TRANSIENT,
    type_of,
)
from nonsmooth.kernels.judging.judge import ROUNDS, contraction, multiplier, separate
from nonsmooth.kernels.judging.settle import END as SETTLED
from nonsmooth.kernels.judging.settle import FRESH, JOBS, PROBE, RULES, begin_job, next_run

_i, _f = types.int64, types.float64
_f1, _f2, _f3, _i1 = _f[::1], _f[:, ::1], _f[:, :, ::1], _i[::1]

run_at = function_at(types.FunctionType(types.int64(*[types.int64] * 5)))

# Places in ``at``: the job, the one before which to stop, what is run of it now, the code of its last kept window (or
# the number of returns of a pair), whether the motion stands where the job before ended.
JOB, STOP, STAGE, CODE, GOOD = range(5)
# Stages: the kept window; what follows it; extremes where there is no cycle; the cycle, and that many neighbours.
NEXT, MAIN, BEYOND, EXTENT, CYCLE = range(5)
OWN, OTHER = 1, 2  # of a pair; beyond that: once more


class Runs(NamedTuple):
    """The march of an engine for a trajectory and one beside it, which share what is ordered."""

    function: Any  # (1,) address of ``hybrid.run.run``
    blocks: Any  # addresses: system, log, growth; kept, calls, cycle, window
    orders: Any  # (N_ORDERS,) of both calls
    reals: Any
    every: Any  # so many passes of the section are a return
    extremes: Any  # 1: those of the kept returns are wanted
    tally: Any  # counts of the work
    periods: Any  # (P,) of the forcing
    memory: Any  # (n_memory,) at a fresh start
    stop: Any  # (1,) not zero: the work is not wanted any more
    motion: Any
    beside: Any
    kept: Any  # room for the kept returns
    cycle: Any  # for one cycle
    window: Any  # and for a neighbour


RUNS = type_of(Runs, *[_i1] * 3, _f1, _i, _i, _i1, _f1, _f1, _i1, MOTION, MOTION, KEPT, KEPT, KEPT)
STARTS = types.Tuple((_i1, _f2, _f1, _i1, _i1))
PROBES = types.Tuple((_f2, _f3))
RESULTS = types.Tuple((_f1, _f1, _f2, _f2, _f2, _i1))


@device
def go(i, beside, room, row, extremes, transient, keep, settled, runs):
    """Run parameter row i on from a motion, which is left where it ends. Returns a code; PAUSED: call it again.

    ``room``: 0, 1, 2 for ``kept`` (its ``row``), ``cycle``, ``window``; ``settled`` = 0: transitions that hold there
    already are taken first."""
    orders, blocks, run = runs.orders, runs.blocks, run_at(runs.function[0])
    if runs.tally[BEGUN] == 0:
        orders[BEGIN], orders[END], orders[EXTREMES], orders[TRANSIENT] = i, i + 1, extremes, transient
        orders[KEEP], orders[ROW], orders[EVERY] = keep, row, runs.every if room == 0 else 1
        motion = runs.beside if beside else runs.motion
        motion.counters[1] = settled
        motion.clock[2] = 0.0  # the time stands as it is: the march must not scale it to another period
    if run(blocks[0], blocks[5 if beside else 4], blocks[3 if room == 0 else 5 + room], blocks[1], blocks[2]) == PAUSED:
        return PAUSED
    return runs.kept.status[row] if room == 0 else (runs.cycle if room == 1 else runs.window).status[0]


@device
def put(i, place, phase, mode, runs):
    """A state at a phase of the forcing of parameter row i; memory and time in the period where the place says them."""
    motion, T = runs.motion, runs.periods[i]
    n, whole = motion.u.shape[0], motion.u.shape[0] + motion.memory.shape[0]
    for k in range(n):
        motion.u[k] = place[k]
    for k in range(n, whole):
        motion.memory[k - n] = place[k] if place.shape[0] > k else runs.memory[k - n]
    motion.clock[0] = (place[whole] if place.shape[0] > whole else phase * T) if T < NO_END else 0.0
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
def probe(i, row, leg, p, size, rules, extremes, strobed, runs):
    """Run the cycle of p returns where a job stands (``leg`` 0), or a neighbour of it; on a surface one neighbour."""
    if runs.tally[BEGUN] == 0:
        copy(runs)
        for k in range(size.shape[0]):
            if leg > 0 and (k == leg - 1 or not strobed):
                runs.beside.u[k] += rules.difference * size[k]
    if leg == 0:
        return go(i, True, 1, 0, extremes, 0, p * runs.every, 1, runs)
    if strobed:
        return go(i, True, 2, 0, 0, p - 1, 1, 0, runs)
    return go(i, True, 2, 0, 0, 0, ROUNDS * p * runs.every + 2, 0, runs)


@device
def slowest(row, p, size, rules, strobed, runs, work):
    """The largest modulus of the multipliers of p returns, from the cycle and its neighbours (``probe``)."""
    images, matrices = work
    if strobed:
        return multiplier(images, runs.motion.u, size, rules.difference, matrices)
    passes = p * runs.every
    points = runs.kept.section[row] if runs.every == 1 else runs.cycle.section[0, :passes]
    return contraction(points, runs.window.section[0], size, passes, rules.tolerance)


@kernel(types.int64(STARTS, _f, _i, _i, RULES, JOBS, RUNS, _i1, PROBES, RESULTS))
def settle_many(starts, phase, carried, extremes, rules, jobs, runs, at, work, results):
    """Job j: parameter row rows[j], from places[j] at phases[j] of the forcing in the mode modes[j] (``starts``); its
    kept returns stand in row into[j].

    With ``carried`` = 1 a job goes on from where the one before it ended (from its own start where that failed; with 2
    then from where it was), at the section's phase, or at its own where that is negative: a surface. ``results``:
    crossings and contacts per return, maxima, minima (over a whole cycle where there is one, else over as many returns
    as are kept), the place at the end, mode there."""
    rows, places, phases, modes, into = starts
    crossings, contacts, maximum, minimum, last, mode = results
    motion, strobed = runs.motion, phase >= 0.0
    n, whole = motion.u.shape[0], motion.u.shape[0] + motion.memory.shape[0]
    while at[JOB] < at[STOP]:
        if runs.stop[0] != 0:
            return PAUSED
        j, stage = at[JOB], at[STAGE]
        i, row, T = rows[j], into[j], runs.periods[rows[j]]
        if stage == NEXT:
            goes_on = at[GOOD] != 0 and carried != 0
            if goes_on and T < NO_END:
                if strobed:
                    motion.clock[0] = phase * T
                elif motion.clock[2] > 0.0:
                    motion.clock[0] *= T / motion.clock[2]
                motion.clock[1] = 0.0
            begin_job(jobs, j, rules, 1 if goes_on else 0)
            stage = MAIN
        p, leg = jobs.period_number[j], stage - CYCLE
        at[STAGE] = stage
        if stage == MAIN:
            if jobs.wanted[j] == FRESH and runs.tally[BEGUN] == 0:
                put(i, places[j], phases[j], modes[j], runs)
            code = go(i, False, 0, row, runs.extremes, jobs.transient[j], rules.keep, jobs.settled[j], runs)
        elif stage == BEYOND:  # true extremes are dear: one return gives the motion's size
            code = go(i, False, 1, 0, 1, 0, rules.beyond, 1, runs)
        elif stage == EXTENT:
            if runs.tally[BEGUN] == 0:
                copy(runs)
            code = go(i, True, 0, row, 1, 0, rules.keep, 1, runs)
        else:
            code = probe(i, row, leg, p, jobs.size[j], rules, extremes, strobed, runs)
        if code == PAUSED:
            return PAUSED
        good = code == OK or code == NOT_GUARANTEED
        if stage == MAIN or (stage == BEYOND and at[CODE] == OK):
            at[CODE] = code
        if stage == MAIN and good and rules.beyond > 0:
            at[STAGE] = BEYOND
            continue
        if stage >= CYCLE and good:
            for k in range(n):
                work[0][leg if strobed else 0, k] = runs.beside.u[k]
            if leg > 0:
                at[STAGE] = stage - 1
                continue
        if stage != EXTENT:
            mu = slowest(row, p, jobs.size[j], rules, strobed, runs, work) if stage == CYCLE and good else nan
            code = at[CODE]
            room, line = (runs.cycle, 0) if rules.beyond > 0 else (runs.kept, row)
            next_run(jobs, j, rules, code, runs.kept.section[row], room.high[line], room.low[line], mu, motion.u)
            p = jobs.period_number[j]
            if jobs.wanted[j] != SETTLED:
                at[STAGE] = MAIN
                if jobs.wanted[j] == PROBE:
                    at[STAGE] = CYCLE + (n if strobed else 1)
                continue
            good = p > 0 or code == OK or code == NOT_GUARANTEED
            at[GOOD] = 1 if good or carried == 2 else 0
            mode[j] = motion.counters[0]
            for k in range(n):
                last[j, k] = motion.u[k]
            for k in range(n, whole):
                last[j, k] = motion.memory[k - n]
            if last.shape[1] > whole:
                last[j, whole] = motion.clock[0]
            if jobs.status[j] == NO_CONVERGENCE:  # it meets the section no more: where it rests
                mode[j] = runs.kept.section_mode[row, 0]
                for k in range(n):
                    last[j, k] = runs.kept.section[row, 0, k]
            if good and p == 0 and extremes != 0 and runs.extremes == 0:
                at[STAGE] = EXTENT
                continue
        elif not good:
            jobs.status[j] = code
        at[STAGE] = NEXT
        at[JOB] = j + 1
        if good:
            room, line, count = (runs.cycle, 0, p) if p > 0 else (runs.kept, row, rules.keep)
            crossings[j] = room.crossings[line] / count
            contacts[j] = room.contacts[line] / count
            if extremes != 0:
                for k in range(n):
                    maximum[j, k] = room.high[line, k]
                    minimum[j, k] = room.low[line, k]
    return OK


@kernel(types.int64(STARTS, _i, _i, _f2, RUNS, _i1, _f2, _f2, _i1))
def separate_many(starts, returns, batch, sizes, runs, at, offsets, sums, status):
    """Growth of the distance of two neighbours over ``returns`` section returns, taken into sums[j], for each job.

    Job j begins at places[j] at phases[j] in the mode modes[j], its neighbour beside it by offsets[j]. Where the place
    has a time in the period, returns are counted at that phase: neighbours are compared at equal phase. On a surface a
    neighbour just before it has a return too many."""
    rows, places, phases, modes, _ = starts
    motion, beside, elapsed = runs.motion, runs.beside, runs.cycle.elapsed
    while at[JOB] < at[STOP]:
        if runs.stop[0] != 0:
            return PAUSED
        j, stage = at[JOB], at[STAGE]
        i, T = rows[j], runs.periods[rows[j]]
        if stage == NEXT:
            put(i, places[j], phases[j], modes[j], runs)
            if places.shape[1] > motion.u.shape[0] + motion.memory.shape[0]:
                runs.reals[PHASE] = motion.clock[0] / T % 1.0
            at[CODE], stage = 0, OWN
        if stage == OWN and runs.tally[BEGUN] == 0:
            copy(runs)
            for k in range(sizes.shape[1]):
                beside.u[k] += offsets[j, k]
        at[STAGE] = stage
        code = go(i, stage >= OTHER, 0, 0, 0, 0, 1, 1 if stage == OWN and at[CODE] > 0 else 0, runs)
        if code == PAUSED:
            return PAUSED
        status[j] = code
        at[STAGE] = NEXT
        if code != OK and code != NOT_GUARANTEED:
            at[JOB] = j + 1
            continue
        if stage == OWN:
            elapsed[0] = T if T < NO_END else runs.kept.elapsed[0]
            at[STAGE] = OTHER
            continue
        if stage == OTHER and runs.kept.elapsed[0] < 0.5 * elapsed[0]:
            at[STAGE] = OTHER + 1
            continue
        separate(at[CODE], batch, elapsed[0], motion.u, beside.u, sizes[j], offsets[j], sums[j])
        at[CODE] += 1
        at[STAGE] = OWN
        if at[CODE] == returns:
            at[STAGE], at[JOB] = NEXT, j + 1
    return OK
