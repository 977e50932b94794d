"""One march of a system, whatever it is for: the kernel of every engine.

This file is joined with a stepper, the loop and the observers. Arguments are addresses of blocks (``blocks``): a driver
that is compiled calls this kernel by its own address, so that it is compiled once.
"""

from math import fabs

from numba import types

from nonsmooth.kernels.compile.cache import kernel, once
from nonsmooth.kernels.compile.pointers import stored
from nonsmooth.kernels.hybrid.codes import (
    BEGUN,
    LOG_FULL,
    LOGGED,
    MODE,
    NO_CONVERGENCE,
    NO_END,
    NOT_GUARANTEED,
    OK,
    PAUSED,
    RETURNS_OF_SECTION,
    STARTS,
    TIME,
)
from nonsmooth.kernels.hybrid.kept import Section
from nonsmooth.kernels.hybrid.loop import leave, march
from nonsmooth.kernels.hybrid.record import last_samples
from nonsmooth.kernels.hybrid.records import (
    AFTER,
    BEGIN,
    END,
    EVERY,
    EXTREMES,
    INDICATOR,
    KEEP,
    KIND,
    NET,
    OF_MODE,
    PATIENCE_LEFT,
    PHASE,
    REPEATS,
    RISING,
    ROW,
    T_MAX,
    TRANSIENT,
    UNIT,
    UNTIL,
    Goal,
    Seen,
    call_at,
    growth_at,
    kept_at,
    log_at,
)
from nonsmooth.kernels.hybrid.sections import keep_point, window_of
from nonsmooth.kernels.linear.extremes import finish
from nonsmooth.kernels.linear.stepper import STEPPER

SYSTEM = types.Tuple((STEPPER[0], NET, *STEPPER[1:]))  # model, transition table, tables, work
_put_system, system_at = stored(SYSTEM)


@kernel(types.void(types.int64, SYSTEM))
def put_system(address, record):
    """Write a system to an address."""
    _put_system(address, record)


@once
def place_start(i, form, section, starts, motion):
    """Set the motion to row i of ``starts`` (states, memory), in the first mode; without any it goes on at equal phase
    of the forcing."""
    T, own = form.period[i], motion.u.shape[0]
    if starts.shape[0] > 0:
        for j in range(own):
            motion.u[j] = starts[i, j]
        for j in range(motion.memory.shape[0]):
            motion.memory[j] = starts[i, own + j]
        motion.counters[0], motion.counters[1] = 0, 0
        motion.clock[0], motion.clock[1], motion.clock[2] = 0.0, 0.0, 0.0
    elif motion.clock[2] > 0.0:
        motion.clock[0] = motion.clock[0] / motion.clock[2] * T
        if fabs(motion.clock[0] - section.phase * T) <= 1e-12 * T:  # else rounding would count it once more
            motion.clock[0] = section.phase * T
        motion.clock[2] = T if T < NO_END else 0.0


@kernel(types.int64(*[types.int64] * 5))
def run(system, call, kept, log, growth):
    """March the points ``BEGIN`` <= i < ``END`` of ``Call.orders`` one after the other, to the goal there.

    PAUSED and LOG_FULL ask to be called again: ``BEGIN`` is then the point that waits. For section returns each point
    goes on from where the last good one ended, or from its own start; one that fails leaves the motion where it was,
    and its status stands in its row of ``Kept`` (of its own number, or ``ROW``), with the place where it has found no
    return as its first point. Else the last point's is returned."""
    form, net, tables, work = system_at(system)
    orders, reals, limit, starts, motion = call_at(call)
    kind, code = orders[KIND], OK
    section = Section(
        reals[PHASE],
        orders[INDICATOR],
        orders[RISING],
        orders[OF_MODE],
        orders[AFTER],
        orders[EVERY],
        reals[T_MAX],
        orders[EXTREMES],
        orders[REPEATS],
    )
    goal = Goal(kind, orders[TRANSIENT], orders[KEEP], reals[UNTIL], reals[UNIT], limit, orders[PATIENCE_LEFT])
    for i in range(orders[BEGIN], orders[END]):
        if work.tally[BEGUN] == 0 and work.tally[STARTS] == 0 and kind == RETURNS_OF_SECTION:
            place_start(i, form, section, starts, motion)
        seen = Seen(window_of(kept_at(kept), i if orders[ROW] < 0 else orders[ROW]), log_at(log), growth_at(growth))
        code = march(i, form, net, section, goal, motion, seen, tables, work)
        if code == PAUSED or code == LOG_FULL:
            orders[BEGIN] = i
            return code
        work.tally[BEGUN] = 0
        good = True
        if kind == RETURNS_OF_SECTION:
            motion.counters[1] = 0
            finish(form, tables, work, seen.kept)
            seen.kept.status[0] = code
            good = code == OK or code == NOT_GUARANTEED
            if code == NO_CONVERGENCE and seen.kept.section.shape[0] > 0:  # where it rests
                keep_point(0, work.w, work.tally[MODE], work.memo[TIME], seen.kept)
            code = OK
        elif kind == LOGGED and code == OK:
            last_samples(goal.until, form, seen.log, work)
        if good:
            leave(i, form, motion, work)
    return code
