"""The arrays of a thread on a GPU: its parameter row and its scratch memory, in arrays of constant shape.

This file is text of a generated module (``cuda.module``), behind the planar files of the CPU. ``packed`` holds the
parameter rows as columns, so that neighbouring threads read neighbouring numbers; what a thread works with lies in its
local memory, which the GPU interleaves in the same way.
"""

from numba import float64, int64

from nonsmooth.kernels.cuda.target import cuda, device, local
from nonsmooth.kernels.hybrid.codes import N_MEMO, N_TALLY
from nonsmooth.kernels.hybrid.records import Form, Tables, Work
from nonsmooth.kernels.linear.search import WIDTH
from nonsmooth.kernels.linear.tables import HARMONICS, NODES, TERMS

# Set for each system; none is below 1, so that no array is empty.
N_MODES = 2
N_INDICATORS = 2
N_OUTPUTS = 1
N_TRANSITIONS = 2
N_ROWS = 5
M = 3 + 2 * HARMONICS
N_HARMONICS = HARMONICS if HARMONICS > 0 else 1
N_FUNCTIONALS = N_INDICATORS + 2 + N_OUTPUTS
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
    """The parameter row i and the scratch memory of a thread, as ``chain`` takes them: (form, (tables, work))."""
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
    prop = cuda.local.array((N_MODES, N_NODES, M, 2), float64)
    rot = cuda.local.array((N_MODES, N_NODES, N_TURNS), float64)
    fun = cuda.local.array((N_MODES, N_FUNCTIONALS, N_SUMS), float64)
    tay = cuda.local.array((N_MODES, N_FUNCTIONALS, M, WIDTH), float64)
    field = cuda.local.array((N_MODES, 2, M), float64)
    info = cuda.local.array((N_MODES, 4), float64)
    some = cuda.local.array((1, 1, 1, 1), int64)
    bands = cuda.local.array((1, 1, 1), float64)
    lines = cuda.local.array((1, 1, 1), int64)
    row = cuda.local.array((N_TERMS, M), float64)
    w = cuda.local.array(M, float64)
    w1 = cuda.local.array(M, float64)
    wn = cuda.local.array(M, float64)
    wp = cuda.local.array(M, float64)
    wq = cuda.local.array(M, float64)
    end = cuda.local.array(M, float64)
    there = cuda.local.array(M, float64)
    before = cuda.local.array(M, float64)
    scr = cuda.local.array((N_POLYNOMIALS, WIDTH), float64)
    points = cuda.local.array(4, float64)
    rates = cuda.local.array(N_HARMONICS, float64)
    zero = cuda.local.array(N_INDICATORS, int64)
    found = cuda.local.array(4, int64)
    visited = cuda.local.array(N_MODES, int64)
    twin = cuda.local.array(N_INDICATORS, int64)
    built = cuda.local.array(2, int64)
    tally = cuda.local.array(N_TALLY, int64)
    memo = cuda.local.array(N_MEMO, float64)
    built[0], built[1] = 0, 0
    tally[0] = 0
    lacking = cuda.local.array((1, 1), int64)
    lacking[0, 0] = 0
    form = Form(A, b, c, s, multiples, omega, period, ia, ib, ic, is_, oa, ob, oc, os_, ra, rb, rc, rs, lacking)
    work = Work(
        w,
        w1,
        wn,
        wp,
        wq,
        end,
        there,
        before,
        row,
        scr,
        points,
        rates,
        zero,
        found,
        visited,
        twin,
        built,
        tally,
        memo,
    )
    return form, (Tables(prop, rot, fun, tay, field, info, some, bands, lines), work)
