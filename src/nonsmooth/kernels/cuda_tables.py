"""The tables of parameter points on a GPU: built once, kept as columns, read by every launch.

This file is text of a generated module (``cuda_module``). A thread copies the column of its point into its own
arrays, because arrays of constant shape are what its code is compiled for. Neighbouring threads read neighbouring
numbers; where all have one point, as for basins, a read serves a whole warp.
"""

from .cuda_planar import N_MODES, arrays_of_thread
from .cuda_target import cuda, device, entry, local
from .linear_tables import HARMONICS, build


@device
def move(array, built, at, i, into):
    """Between all of array[:, :, :] and column i of ``built`` from row ``at`` on; returns the row behind.

    One flat loop: nested ones would be written out, which makes a hundred kilobytes of code."""
    n, m = array.shape[2], array.shape[1] * array.shape[2]
    size = array.shape[0] * m
    for e in range(size):
        if into:
            built[at + e, i] = array[e // m, e % m // n, e % n]
        else:
            array[e // m, e % m // n, e % n] = built[at + e, i]
    return at + size


@device
def move_tables(tables, built, i, into):
    """Between a thread's tables and their column."""
    prop, rot, fun, tay, field, info = tables
    at = move(rot, built, 0, i, into)
    at = move(fun, built, at, i, into)
    at = move(field, built, at, i, into)
    for mode in range(N_MODES):
        at = move(prop[mode], built, at, i, into)
        at = move(tay[mode], built, at, i, into)
        for k in range(4):
            if into:
                built[at, i] = info[mode, k]
            else:
                info[mode, k] = built[at, i]
            at += 1


@entry
def tabulate(jobs, packed, multiples, built):
    """Build the tables of the parameter points ``jobs``."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    i = jobs[k]
    linear, scratch = arrays_of_thread(packed, multiples, i)
    A, b, c, s, _, omega, period, ia, ib, ic, is_, oa, ob, oc, os_ = linear[:15]
    prop, rot, fun, tay, field, info, row = scratch[:7]
    rates = scratch[10]
    for h in range(HARMONICS):
        rates[h] = multiples[h] * omega[0]
    fill(0, A, b, c, s, rates, period[0], ia, ib, ic, is_, oa, ob, oc, os_, prop, rot, fun, tay, field, info, row)
    move_tables(scratch[:6], built, i, True)


fill = build


@device
def stands(*_):
    """In place of ``build``: where ``chain`` and ``spectrum`` would build tables, they stand already."""


build = stands  # what the joined text's other functions find under this name


@local
def tabled(packed, multiples, built, i):
    """Parameter row i and scratch memory with its tables in it, as ``chain`` takes them: (linear, scratch)."""
    linear, scratch = arrays_of_thread(packed, multiples, i)
    move_tables(scratch[:6], built, i, False)
    return linear, scratch
