"""The tables of one parameter point: of each mode how it moves, and of each functional on it."""

from math import fabs, isnan, nan

from nonsmooth.kernels.compile.cache import device
from nonsmooth.kernels.linear.bands import BANDED, by_series, fill_bands
from nonsmooth.kernels.linear.tables import (
    DEGREE,
    STATES,
    bound_of,
    fill_mode,
    fill_propagators,
    fill_turns,
    find_equilibrium,
    sizes_at,
    states_of,
    times_generator,
    width_of,
)


@device
def fill_ways(i, given, mode, form, tables, rates, row):
    """Prepare the steps of a mode: a series over few entries, or propagators."""
    fill_turns(mode, rates, tables.info[mode, 1], tables.rot)
    if STATES == 0:
        if tables.field.shape[1] >= BANDED:
            fill_bands(mode, tables)
        if by_series(tables, mode):
            return
    find_equilibrium(form.A[i, given], form.b[i, given], row, tables.info[mode])
    fill_propagators(mode, tables.field, rates, tables.info[mode, 1], tables.prop, tables.rot, row)


@device
def fill_functional(mode, f, tables, rates, row):
    """Taylor rows, slope row and fourth-derivative bound of the functional whose value row stands in fun[mode, f]."""
    n, m = states_of(tables.field), width_of(tables.field)
    fun = tables.fun
    for j in range(m):
        row[0, j] = fun[mode, f, j]
    scale = 1.0
    for k in range(DEGREE + 1):
        for j in range(m):
            tables.tay[mode, f, j, k] = scale * row[k, j]
        times_generator(row, k, tables.field, mode, rates, 1.0)
        scale /= k + 1
    for j in range(m):
        fun[mode, f, m + j] = row[1, j]
    if STATES == 0:
        if by_series(tables, mode):  # bounds are those of the series
            return
    at = 2 * m
    bound_of(row, 4, mode, 1, tables, fun[mode, f], at)
    bound_of(row, 5, mode, 4, tables, fun[mode, f], at + n + 1)
    for j in range(n + 1):  # between two nodes the entries move by at most half a spacing times their slope
        fun[mode, f, at + j] += 0.7 * tables.info[mode, 1] * fun[mode, f, at + n + 1 + j]


@device
def list_columns(mode, f, tables):
    """List the columns of a functional's Taylor rows, and the states of its value and slope, that are not zero: few
    where a state moves with few others."""
    n, m = states_of(tables.field), width_of(tables.field)
    every, few = 0, 0
    for j in range(m):
        moved = False
        for k in range(DEGREE + 1):
            moved = moved or tables.tay[mode, f, j, k] != 0.0
        if moved:
            every += 1
            tables.some[mode, f, 0, every] = j
        if j < n and (tables.fun[mode, f, j] != 0.0 or tables.fun[mode, f, m + j] != 0.0):
            few += 1
            tables.some[mode, f, 1, few] = j
    tables.some[mode, f, 0, 0] = every
    tables.some[mode, f, 1, 0] = few


@device
def hide_lacking(form, tables, work):
    """No value for a state that a mode lacks, and for memory: NaN takes no part in extremes."""
    n = states_of(tables.field)
    n_i = work.zero.shape[0]
    for mode in range(form.lacking.shape[0]):
        for j in range(form.lacking.shape[1]):
            if form.lacking[mode, j] != 0:
                tables.fun[mode, n_i + j, n] = nan
                for f in range(n_i):
                    if work.twin[f] == j:
                        work.twin[f] = -1


@device
def build(i, form, tables, work):
    """Fill the tables for parameter point ``i``, where they do not stand there already.

    The modes of ``form`` go behind the first ``work.built[1]``, which stand."""
    n, m = states_of(tables.field), width_of(tables.field)
    harmonics = (m - n - 1) >> 1
    if work.built[0] == i + 1:
        return
    first = work.built[1]
    n_i, fun, rates, sizes = form.ia.shape[1], tables.fun, work.rates, sizes_at(n, m)
    for h in range(harmonics):
        rates[h] = form.multiples[h] * form.omega[i]
    for given in range(form.A.shape[1]):
        mode = first + given
        fill_mode(i, given, mode, form, tables, rates, work.row)
        fill_ways(i, given, mode, form, tables, rates, work.row)
        for f in range(fun.shape[1]):
            for j in range(m):
                fun[mode, f, j] = 0.0
            if f < n_i:
                for j in range(n):
                    fun[mode, f, j] = form.ia[i, f, j]
                fun[mode, f, n] = form.ib[i, f]
                for h in range(harmonics):
                    fun[mode, f, n + 1 + 2 * h] = form.ic[i, f, h]
                    fun[mode, f, n + 2 + 2 * h] = form.is_[i, f, h]
            elif f < n_i + n:
                fun[mode, f, f - n_i] = 1.0
            else:
                o = f - n_i - n
                for j in range(n):
                    fun[mode, f, j] = form.oa[i, o, given, j]
                fun[mode, f, n] = form.ob[i, o, given]
                for h in range(harmonics):
                    fun[mode, f, n + 1 + 2 * h] = form.oc[i, o, given, h]
                    fun[mode, f, n + 2 + 2 * h] = form.os[i, o, given, h]
            if isnan(fun[mode, f, n]):  # not asked for in this mode
                fun[mode, f, sizes] = -1.0
                continue
            fill_functional(mode, f, tables, rates, work.row)
            fun[mode, f, sizes], fun[mode, f, sizes + 1] = 0.0, 0.0
            for j in range(m):
                fun[mode, f, sizes] += fabs(fun[mode, f, j])
                fun[mode, f, sizes + 1] += fabs(fun[mode, f, m + j])
            if STATES == 0:
                list_columns(mode, f, tables)
    for f in range(n_i):
        work.twin[f] = twin_of(f, tables)
    hide_lacking(form, tables, work)
    work.built[0] = i + 1


@device
def twin_of(f, tables):
    """The state that indicator f is but for a constant, so that its extremes follow from the state's; -1: none."""
    n, m, fun = states_of(tables.field), width_of(tables.field), tables.fun
    twin = -1
    for k in range(n):
        same = fun[0, f, k] == 1.0
        for j in range(m):
            same = same and (j == k or j == n or fun[0, f, j] == 0.0)
        if same:
            twin = k
    return twin
