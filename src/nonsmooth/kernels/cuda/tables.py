"""The tables of parameter points on a GPU: built once, kept as columns, read by every launch.

This file is text of a generated module (``cuda.module``). A thread copies the column of its point into its own
arrays, because arrays of constant shape are what its code is compiled for. Neighbouring threads read neighbouring
numbers; where all have one point, as for basins, a read serves a whole warp.
"""

from nonsmooth.kernels.cuda.arrays import N_INDICATORS, N_MODES, arrays_of_thread
from nonsmooth.kernels.cuda.target import cuda, device, entry, local
from nonsmooth.kernels.linear.build import build, twin_of
from nonsmooth.kernels.linear.tables import HARMONICS


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
    at = move(tables.rot, built, 0, i, into)
    at = move(tables.fun, built, at, i, into)
    at = move(tables.field, built, at, i, into)
    for mode in range(N_MODES):
        at = move(tables.prop[mode], built, at, i, into)
        at = move(tables.tay[mode], built, at, i, into)
        for k in range(4):
            if into:
                built[at, i] = tables.info[mode, k]
            else:
                tables.info[mode, k] = built[at, i]
            at += 1


@entry
def tabulate(jobs, point):
    """Build the tables of the parameter points ``jobs``."""
    k = cuda.grid(1)
    if k >= jobs.shape[0]:
        return
    i = jobs[k]
    packed, multiples, built = point
    form, scratch = arrays_of_thread(packed, multiples, i)
    fill(0, form, scratch[0], scratch[1])
    move_tables(scratch[0], built, i, True)


fill = build


@device
def stand(i, form, tables, work):
    """In place of ``build``: where a run would build tables, they stand already; what else it prepares."""
    for h in range(HARMONICS):
        work.rates[h] = form.multiples[h] * form.omega[0]
    for f in range(N_INDICATORS):
        work.twin[f] = twin_of(f, tables)


build = stand  # what the joined text's other functions find under this name


@local
def tabled(point, i):
    """Parameter row i and scratch memory with its tables in it, as ``chain`` takes them: (form, (tables, work))."""
    packed, multiples, built = point
    form, scratch = arrays_of_thread(packed, multiples, i)
    move_tables(scratch[0], built, i, False)
    return form, scratch
