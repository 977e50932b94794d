"""Trajectories of planar systems on a GPU, one per thread.

This file is text of a generated module (``cuda_module``), behind the planar files of the CPU. ``advance`` is the one
heavy kernel: it marches every trajectory by its own number of section returns with ``chain``. What becomes of the
returns is decided outside, so that all threads do the same thing at the same time, finished trajectories are left out
of the next launch, and a launch stays short.

A thread copies its parameter row into arrays of constant shape and builds its tables anew in each launch, which costs
as much as some 18 forcing periods. ``packed`` holds the rows as columns, so that neighbouring threads read neighbouring
numbers; what a thread works with lies in its local memory, which the GPU interleaves in the same way.
"""

from numba import float64, int64

from .codes import OK
from .cuda_target import cuda, device, entry, local
from .planar_search import WIDTH
from .planar_settle import go
from .planar_tables import HARMONICS, NODES, TERMS, M

# Set for each system; none is below 1, so that no array is empty.
N_MODES = 2
N_INDICATORS = 2
N_OUTPUTS = 1
N_TRANSITIONS = 2
N_ROWS = 5
N_HARMONICS = HARMONICS if HARMONICS > 0 else 1
N_FUNCTIONALS = N_INDICATORS + 2 + N_OUTPUTS
N_INTEGERS = 2 * N_INDICATORS + 5
N_NODES = NODES + 1
N_TURNS = 2 * HARMONICS + 1
N_SUMS = 2 * M + 6
N_TERMS = TERMS + 1
N_POLYNOMIALS = N_ROWS + 3


@device
def unpack2(target, packed, i, at):
    """target[0, :] from column i of ``packed``; returns the place behind it."""
    for a in range(target.shape[1]):
        target[0, a] = packed[at, i]
        at += 1
    return at


@device
def unpack3(target, packed, i, at):
    """target[0, :, :] from column i of ``packed``; returns the place behind it."""
    for a in range(target.shape[1]):
        for b in range(target.shape[2]):
            target[0, a, b] = packed[at, i]
            at += 1
    return at


@device
def unpack4(target, packed, i, at):
    """target[0, :, :, :] from column i of ``packed``; returns the place behind it."""
    for a in range(target.shape[1]):
        for b in range(target.shape[2]):
            for c in range(target.shape[3]):
                target[0, a, b, c] = packed[at, i]
                at += 1
    return at


@local
def arrays_of_thread(packed, multiples, i):
    """The parameter row i and the scratch memory of a thread, as ``chain`` takes them: (linear, scratch)."""
    A = cuda.local.array((1, N_MODES, 2, 2), float64)
    b = cuda.local.array((1, N_MODES, 2), float64)
    c = cuda.local.array((1, N_MODES, N_HARMONICS, 2), float64)
    s = cuda.local.array((1, N_MODES, N_HARMONICS, 2), float64)
    omega = cuda.local.array(1, float64)
    period = cuda.local.array(1, float64)
    ia = cuda.local.array((1, N_INDICATORS, 2), float64)
    ib = cuda.local.array((1, N_INDICATORS), float64)
    ic = cuda.local.array((1, N_INDICATORS, N_HARMONICS), float64)
    is_ = cuda.local.array((1, N_INDICATORS, N_HARMONICS), float64)
    oa = cuda.local.array((1, N_OUTPUTS, N_MODES, 2), float64)
    ob = cuda.local.array((1, N_OUTPUTS, N_MODES), float64)
    oc = cuda.local.array((1, N_OUTPUTS, N_MODES, N_HARMONICS), float64)
    os_ = cuda.local.array((1, N_OUTPUTS, N_MODES, N_HARMONICS), float64)
    ra = cuda.local.array((1, N_TRANSITIONS, 2, 2), float64)
    rb = cuda.local.array((1, N_TRANSITIONS, 2), float64)
    rc = cuda.local.array((1, N_TRANSITIONS, N_HARMONICS, 2), float64)
    rs = cuda.local.array((1, N_TRANSITIONS, N_HARMONICS, 2), float64)
    omega[0] = packed[0, i]
    period[0] = packed[1, i]
    at = unpack4(A, packed, i, 2)
    at = unpack3(b, packed, i, at)
    at = unpack4(c, packed, i, at)
    at = unpack4(s, packed, i, at)
    at = unpack3(ia, packed, i, at)
    at = unpack2(ib, packed, i, at)
    at = unpack3(ic, packed, i, at)
    at = unpack3(is_, packed, i, at)
    at = unpack4(oa, packed, i, at)
    at = unpack3(ob, packed, i, at)
    at = unpack4(oc, packed, i, at)
    at = unpack4(os_, packed, i, at)
    at = unpack4(ra, packed, i, at)
    at = unpack3(rb, packed, i, at)
    at = unpack4(rc, packed, i, at)
    at = unpack4(rs, packed, i, at)
    prop = cuda.local.array((N_MODES, N_NODES, 2, M), float64)
    rot = cuda.local.array((N_MODES, N_NODES, N_TURNS), float64)
    fun = cuda.local.array((N_MODES, N_FUNCTIONALS, N_SUMS), float64)
    tay = cuda.local.array((N_MODES, N_FUNCTIONALS, M, WIDTH), float64)
    field = cuda.local.array((N_MODES, 2, M), float64)
    info = cuda.local.array((N_MODES, 4), float64)
    row = cuda.local.array((N_TERMS, M), float64)
    vectors = cuda.local.array((7, M), float64)
    scr = cuda.local.array((N_POLYNOMIALS, WIDTH), float64)
    points = cuda.local.array(4, float64)
    rates = cuda.local.array(N_HARMONICS, float64)
    integers = cuda.local.array(N_INTEGERS, int64)
    for n in range(N_INTEGERS):
        integers[n] = 0
    linear = (A, b, c, s, multiples, omega, period, ia, ib, ic, is_, oa, ob, oc, os_, ra, rb, rc, rs)
    return linear, (prop, rot, fun, tay, field, info, row, vectors, scr, points, rates, integers)


@device
def row_of(buffers, row):
    """What ``chain`` writes for one trajectory, from the buffers of all."""
    section, maximum, minimum, i_max, i_min, o_max, o_min, crossings, contacts, elapsed, times, modes, status = buffers
    return (
        section[row : row + 1], maximum[row : row + 1], minimum[row : row + 1], i_max[row : row + 1],
        i_min[row : row + 1], o_max[row : row + 1], o_min[row : row + 1], crossings[row : row + 1],
        contacts[row : row + 1], elapsed[row : row + 1], times[row : row + 1], modes[row : row + 1],
        status[row : row + 1],
    )  # fmt: skip


@entry
def advance(
    jobs, rows, packed, multiples, net, u, clock, counters, transient, keep, plan, full, legs, apart, phase, limit, out,
    other,
):  # fmt: skip
    """Thread k: march the state of job j = jobs[k] under parameter row rows[j] by transient[j] section returns, then
    keep[j] more into row j of ``out``. (One number for all jobs where these arrays are short.)

    With two legs the tables serve twice: ``apart`` = 0, one more return with extremes (the plan ``full``), into row j
    of ``other``; else the same for the state j + apart, into that row of ``other``. A state is left at its last
    return; statuses stand in the buffers, and the second leg is left out where the first one failed."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    j = jobs[k]
    linear, scratch = arrays_of_thread(packed, multiples, rows[j])
    n_transient = transient[min(j, transient.shape[0] - 1)]
    n_keep = keep[min(j, keep.shape[0] - 1)]
    for leg in range(legs):
        row = j + leg * apart
        again = leg > 0 and apart == 0
        code = go(
            0, u[row], clock[row], counters[row], linear, net, full if again else plan, phase, 1e300,
            0 if again else n_transient, 1 if again else n_keep, limit, row_of(other if leg > 0 else out, row), scratch,
            u[row : row + 1],
        )  # fmt: skip
        if code != OK:
            break
