"""Jobs of a linear system brought to their attractors in one compiled call, and their exponents.

What is wanted of a job next is decided in ``settle``; the loop here runs it, because in Python the steps between the
runs cost more than the motion itself. The sections are stroboscopic.
"""

from math import nan

from numba import types

from .cache import device, kernel
from .codes import OK
from .exponent import separate
from .judge import multiplier
from .linear_chain import chain
from .linear_tables import STATES
from .settle import END, FRESH, JOBS, PROBE, RULES, begin_job, next_run

_i, _f = types.int64, types.float64
_f1, _f2, _f3, _f4, _i1, _i2 = _f[::1], _f[:, ::1], _f[:, :, ::1], _f[:, :, :, ::1], _i[::1], _i[:, ::1]

LINEAR = types.Tuple((
    _f4, _f3, _f4, _f4, _i1, _f1, _f1, _f3, _f2, _f3, _f3, _f4, _f3, _f4, _f4, _f4, _f3, _f4, _f4,
))  # fmt: skip
NET = types.Tuple((_i2, _i2, _i1, _i1, _i1, _f1))
BUFFERS = types.Tuple((_f3, _f2, _f2, _f2, _f2, _f2, _f2, _i1, _i1, _f1, _f2, _i2, _i1))
SCRATCH = types.Tuple((_f4, _f3, _f3, _f4, _f3, _f2, _f2, _f2, _f2, _f1, _f1, _i1))
MOTION = types.Tuple((_f1, _f1, _i1))
FLOW = types.Tuple((LINEAR, NET, _f, _f, _f1, SCRATCH, _f2))
WORK = types.Tuple((_f2, _f3))
RESULTS = types.Tuple((_f1, _f1, _f2, _f2, _f2, _i1))


@device
def go(i, motion, flow, plan, transient, keep, out):
    """Run parameter row i on from ``motion`` (u, clock, counters), which is left where it ends. Returns the status."""
    linear, net, phase, t_max, limit, scratch, rest = flow
    motion[1][2] = 0.0  # the time stands as it is: the kernel must not scale it to another period
    head = (i, i + 1, 1, rest)
    tail = (phase, plan, t_max, transient, keep, limit)
    chain(*(head + motion + linear + net + tail + out + scratch))
    return out[12][i]


@device
def put(motion, i, u, phase, mode, flow):
    """A state at a phase of the forcing of parameter row i."""
    T = flow[0][6][i]
    for k in range(STATES):
        motion[0][k] = u[k]
    motion[1][0] = phase * T if T < 1e300 else 0.0
    motion[1][1] = 0.0
    motion[2][0] = mode


@device
def copy(motion, moved):
    """``moved`` becomes ``motion``."""
    for k in range(STATES):
        moved[0][k] = motion[0][k]
    for k in range(3):
        moved[1][k] = motion[1][k]
    for k in range(4):
        moved[2][k] = motion[2][k]


@device
def probe(i, p, size, rules, motion, moved, flow, plan, quiet, cycle, work):
    """Largest modulus of the multipliers of the p-th return map where the job stands; nan: unknown.

    The neighbours first: ``cycle`` is left with the whole cycle of the job itself."""
    images, matrices = work
    for leg in range(STATES, -1, -1):
        copy(motion, moved)
        if leg > 0:
            moved[0][leg - 1] += rules.nudge * size[leg - 1]
            code = go(i, moved, flow, quiet, p - 1, 1, cycle)
        else:
            code = go(i, moved, flow, plan, 0, p, cycle)
        if code != OK:
            return nan
        for k in range(STATES):
            images[leg, k] = moved[0][k]
    return multiplier(images, size, rules.nudge, matrices)


@kernel(types.void(
    _i1, _f2, _f1, _i1, _i, _i, RULES, JOBS, FLOW, _i1, _i1, BUFFERS, BUFFERS, MOTION, MOTION, WORK, RESULTS
))  # fmt: skip
def settle_many(
    rows, starts, phases, modes, carried, extremes, rules, jobs, flow, plan, quiet, kept, cycle, motion, moved, work,
    results,
):  # fmt: skip
    """Job j: parameter row rows[j], from starts[j] at phases[j] of the forcing in the mode modes[j].

    With ``carried`` = 1 a job goes on from where the one before it ended (from its own start where that failed).
    ``quiet`` is ``plan`` without extremes. ``results``: crossings and contacts per return, maxima, minima (over one
    whole cycle where there is one, else over as many returns as are kept), last section point, mode there."""
    crossings, contacts, maximum, minimum, last, mode = results
    whole = plan if extremes != 0 else quiet
    good = False
    for j in range(rows.shape[0]):
        i = rows[j]
        if good and carried != 0:
            put(motion, i, motion[0], flow[2], motion[2][0], flow)
        begin_job(jobs, j, rules, 1 if good and carried != 0 else 0)
        while jobs.wanted[j] != END:
            code, mu = OK, nan
            if jobs.wanted[j] == PROBE:
                p, size = jobs.period_number[j], jobs.size[j]
                mu = probe(i, p, size, rules, motion, moved, flow, whole, quiet, cycle, work)
            else:
                if jobs.wanted[j] == FRESH:
                    put(motion, i, starts[j], phases[j], modes[j], flow)
                    motion[2][1] = -1
                code = go(i, motion, flow, quiet, jobs.transient[j], rules.keep, kept)
                if code == OK:  # true extremes are dear: one return with them gives the motion's size
                    code = go(i, motion, flow, plan, 0, rules.beyond, cycle)
            next_run(jobs, j, rules, code, kept[0][i], cycle[1][i], cycle[2][i], mu, motion[0])
        mode[j] = motion[2][0]
        for k in range(STATES):
            last[j, k] = motion[0][k]
        p = jobs.period_number[j]
        good = p > 0 or code == OK
        if not good:
            continue
        out, n = (cycle, p) if p > 0 else (kept, rules.keep)
        crossings[j] = out[7][i] / n
        contacts[j] = out[8][i] / n
        if extremes == 0:
            continue
        if p == 0:
            copy(motion, moved)
            code = go(i, moved, flow, plan, 0, n, kept)
            if code != OK:
                jobs.status[j] = code
                continue
        for k in range(STATES):
            maximum[j, k] = out[1][i, k]
            minimum[j, k] = out[2][i, k]


@device
def part(begin, end, batch, i, size, motion, moved, offset, sums, flow, quiet, out):
    """Returns begin <= n < end of a run and of its neighbour; gives a status. See ``exponent``."""
    for n in range(begin, end):
        copy(motion, moved)
        for k in range(STATES):
            moved[0][k] += offset[k]
        for one in range(2):
            code = go(i, motion if one == 0 else moved, flow, quiet, 0, 1, out)
            if code != OK:
                return code
        separate(n, batch, flow[0][6][i], motion[0], moved[0], size, offset, sums)
    return OK


@kernel(types.void(_i1, _f2, _i1, _i, _i, _f1, FLOW, _i1, BUFFERS, MOTION, MOTION, _f2, _f2, _i1))
def separate_many(rows, starts, modes, returns, batch, size, flow, quiet, out, motion, moved, offsets, sums, status):
    """Growth of the distance of two neighbours over ``returns`` section returns, taken into sums[j], for each job.

    Job j begins on the section at starts[j] in the mode modes[j], its neighbour beside it by offsets[j]."""
    for j in range(rows.shape[0]):
        put(motion, rows[j], starts[j], flow[2], modes[j], flow)
        status[j] = part(0, returns, batch, rows[j], size, motion, moved, offsets[j], sums[j], flow, quiet, out)
