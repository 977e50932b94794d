"""Arguments of the kernels by name, each concept's arrays in one named tuple, and blocks of memory where they stand.

``type_of`` gives the Numba type of a record; the names of types are those of the records in capitals.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numba import types

from nonsmooth.kernels.compile.cache import device, kernel
from nonsmooth.kernels.compile.pointers import stored
from nonsmooth.kernels.hybrid.kept import Kept

_i, _f = types.int64, types.float64
_f1, _f2, _f3, _f4, _i1, _i2 = _f[::1], _f[:, ::1], _f[:, :, ::1], _f[:, :, :, ::1], _i[::1], _i[:, ::1]


def type_of(record: Any, *kinds: Any) -> Any:
    """The Numba type of a named tuple whose fields have these types."""
    if len(set(kinds)) == 1:
        return types.NamedUniTuple(kinds[0], len(kinds), record)
    return types.NamedTuple(kinds, record)


class Form(NamedTuple):
    """A linear system at P parameter points: modes, indicators, outputs and resets with their harmonics."""

    A: Any  # (P, modes, n, n)
    b: Any  # (P, modes, n)
    c: Any  # (P, modes, harmonics, n): of the cosines
    s: Any  # (P, modes, harmonics, n): of the sines
    multiples: Any  # (harmonics,) of the base frequency
    omega: Any  # (P,)
    period: Any  # (P,), inf where nothing depends on time
    ia: Any  # (P, indicators, n)
    ib: Any  # (P, indicators)
    ic: Any  # (P, indicators, harmonics)
    is_: Any
    oa: Any  # (P, outputs, modes, n)
    ob: Any  # (P, outputs, modes)
    oc: Any  # (P, outputs, modes, harmonics)
    os: Any
    ra: Any  # (P, maps, n, n)
    rb: Any  # (P, maps, n)
    rc: Any  # (P, maps, harmonics, n)
    rs: Any
    lacking: Any  # (modes, n) 1: memory, or a state that the mode does not have


class Tables(NamedTuple):
    """The result of ``linear.tables.build`` for one point of a ``Form``; shapes are there."""

    prop: Any
    rot: Any
    fun: Any
    tay: Any
    field: Any
    info: Any
    some: Any
    bands: Any
    lines: Any


class Net(NamedTuple):
    """The transition table of a linear system."""

    transitions: Any  # (transitions, 5): target (-1: its tables do not stand yet, or it is asked), what it changes (0,
    # ``places.RESET``, ...), contact or ``DEAD_END``, its map among those of the form, ``places.ALONE``, ...
    rows: Any  # (rows + 2, 3): functional, sign, strict; the last two belong to the section (rising, falling)
    row_start: Any  # (transitions + 1,)
    mode_start: Any  # (modes + 1,)
    mode_list: Any  # outgoing transitions of each mode in declared order
    at: Any  # (transitions,) phase of a transition at a time, or -1
    changed: Any  # (maps, n + 1) how many states a map changes, and which
    meets: Any  # (functionals) that are asked for together with others where they vanish, those of each mode in turn
    meets_start: Any  # (modes + 1,)
    together: Any  # (modes,) the transition that is asked then, or -1


@device
def asked_before(net, mode, j, f, sign):
    """Return whether a transition of the mode before the j-th in its list has this condition too."""
    found = False
    for k in range(net.mode_start[mode], j):
        for r in range(net.row_start[net.mode_list[k]], net.row_start[net.mode_list[k] + 1]):
            found = found or (net.rows[r, 0] == f and net.rows[r, 1] == sign)
    return found


class Work(NamedTuple):
    """Working memory of one running trajectory of a linear system. Vectors are w = (u, 1, cos, sin, ...)."""

    w: Any  # where the present leg begins
    w1: Any  # at the end of its whole step
    wn: Any  # at the node last used
    wp: Any
    wq: Any
    end: Any  # at the end of the leg
    there: Any  # at the crossing just found
    before: Any  # just before a transition; where sections are phases the place noted
    row: Any  # rows of the generator's powers
    scr: Any  # (rows + n + 1, 8) Taylor polynomials
    points: Any  # (4,) critical points
    rates: Any  # (harmonics,)
    zero: Any  # (indicators,) how many of value, slope and further derivatives are zero just now
    found: Any  # (4,) see ``linear.search``
    visited: Any  # (modes,) by the start rule
    twin: Any  # (indicators,) the state that an indicator is but for a constant, or -1
    built: Any  # (2,) the point for which the tables stand there already, plus one; the modes that stand before them
    tally: Any  # counts of the run, at the places of ``hybrid.codes``
    memo: Any  # and times


class Generated(NamedTuple):
    """A system by its generated functions at P parameter points, and the method by which it is marched."""

    functions: Any  # addresses of field, jet, values and jump (see ``generated``)
    points: Any  # (P, parameters)
    period: Any  # (P,), inf where nothing depends on time
    lacking: Any  # (modes, n) 1: a state that the mode has not
    kinds: Any  # (rows,) of the jets: 1 a polynomial, 2 one that may not be asked for, 0 a corner, -1 - s: state s
    weight: Any  # (n,) atol / rtol
    absolute: Any  # (n,) atol
    rtol: Any
    step: Any  # a fixed one, or 0
    method: Any  # of ``hybrid.codes``
    order: Any
    locate: Any  # 0: transitions are judged at the ends of steps
    checked: Any  # 1: polynomials are held against the equations
    corners: Any  # 1: some output has corners
    guards: Any  # rows behind the outputs where a polynomial may miss something
    indicators: Any
    outputs: Any


class SeriesWork(NamedTuple):
    """Working memory of one running trajectory of the series stepper."""

    w: Any  # (n,) where the present leg begins
    end: Any  # at its end
    before: (
        Any  # just before a transition; where sections are phases the place noted, in the series with memory behind it
    )
    wp: Any
    dense: Any
    q: Any  # parameters, then memory
    q_new: Any
    C: Any  # (rows, order + 1) polynomials of the step
    W: Any  # scratch of the jets
    J0: Any  # jets at its two ends
    J1: Any
    K: Any  # eight vectors: the stages of a Runge-Kutta step
    powers: Any
    a: Any  # one polynomial
    d: Any
    vals: Any
    near: Any
    scale: Any  # (indicators,) size so far
    measured: Any  # (indicators,) of one that is zero: its rounding; -1 of one that is not
    side: Any  # (indicators,) sign at the beginning of the step
    side_next: Any  # and at its end
    rise: Any  # (rows,) sign of the slope at the end of the step before
    usual: Any  # (modes,) length of the last step
    dwell: Any  # (modes,) time spent there the last time
    visited: Any  # (modes,) by the start rule
    stack: Any
    found: Any
    rest: Any  # (n,) about which it has stayed
    tally: Any
    memo: Any


class Motion(NamedTuple):
    """A trajectory's place: left at its end by every kernel."""

    u: Any  # (n,)
    memory: Any  # (n_memory,)
    clock: Any  # (3,) time since the period began, periods done, the period in which that time was measured
    counters: Any  # (4,) mode, and for others what they count


class Goal(NamedTuple):
    """When a run is over, and when it has failed or is to pause. A kernel takes of it what it has use for."""

    kind: Any  # ``places.RETURNS_OF_SECTION``, ``LOGGED`` or ``GROW``
    transient: Any  # section returns that are not kept
    keep: Any  # and that are; or units of time
    until: Any  # time
    unit: Any  # of time, after which logarithms of a frame are put away
    limit: Any  # (n,) sizes beyond which a state has diverged
    patience: Any  # steps after which it pauses, to be called again


class Log(NamedTuple):
    """The record of one trajectory; logs of crossings and touches grow on demand."""

    samples: Any  # instants asked for
    sample_u: Any
    sample_memory: Any
    sample_mode: Any
    sample_segment: Any
    crossing_time: Any
    crossing_transition: Any
    u_before: Any
    u_after: Any
    memory_after: Any
    touch_time: Any
    touch_indicator: Any
    touch_u: Any
    touch_gap: Any
    spare: Any  # touches that one leg may add
    changes: Any  # instants at which inputs change
    given: Any  # (changes, states that are inputs) their values from then on
    inputs: Any  # the first of these states


class Growth(NamedTuple):
    """A frame that follows a trajectory, and how it has grown."""

    scale: Any  # (n,) units of the states
    frame: Any  # (n, n) directions in these units, in columns
    growth: Any  # (units of time, n) logarithms
    lengths: Any  # (n,) not yet in ``growth``
    sums: Any  # integral of div f, sum of log|det S|, crossings, least |h'| / (|h_u| |u'|) of a crossing; in the series
    # also what rounding has added to the first, in the exact flow the segments since the frame was orthonormal; of the
    # crossings those at an instant of their own beside another's
    step: Any  # (n, n) the matrix of a leg or of the transitions of an instant
    reset: Any  # (n, n) the derivative of a transition's map
    matrix: Any  # (n, n) scratch
    fields: Any  # (4, n) vector field before and after, derivative of the map in time, field before the instant
    t_z: Any  # (n,) derivative of the instant of a transition in the state before all of that instant
    scratch: Any  # (n,)
    taken: Any  # (transitions,) how often; or none
    functions: Any  # addresses of what carries it (``tangent.following``), or none where the stepper does
    follower: Any  # and of the record that they are given
    u: Any  # the state to which they have carried it
    q: Any  # and parameters, then memory


class Seen(NamedTuple):
    """Records that a run may leave behind; its goal says which."""

    kept: Any
    log: Any
    growth: Any


class Call(NamedTuple):
    """An order to a march, but for the system and the records that it leaves behind."""

    orders: Any  # whole numbers, at the places below
    reals: Any
    limit: Any  # (n,) sizes beyond which a state has diverged
    starts: Any  # (P, n + memory), or none: runs go on from ``motion``
    motion: Any


# Places in ``Call.orders`` and ``Call.reals``.
BEGIN, END, KIND, TRANSIENT, KEEP, PATIENCE_LEFT, INDICATOR, RISING, OF_MODE, AFTER, EVERY, EXTREMES, REPEATS, ROW = (
    range(14)
)
UNTIL, UNIT, PHASE, T_MAX = range(4)
N_ORDERS, N_REALS = 14, 4


FORM = type_of(Form, _f4, _f3, _f4, _f4, _i1, _f1, _f1, _f3, _f2, _f3, _f3, _f4, _f3, _f4, _f4, _f4, _f3, _f4, _f4, _i2)
TABLES = type_of(Tables, _f4, _f3, _f3, _f4, _f3, _f2, _i[:, :, :, ::1], _f3, _i[:, :, ::1])
NET = type_of(Net, _i2, _i2, _i1, _i1, _i1, _f1, _i2, _i1, _i1, _i1)
WORK = type_of(Work, *[_f1] * 8, _f2, _f2, _f1, _f1, *[_i1] * 6, _f1)
GENERATED = type_of(Generated, _i1, _f2, _f1, _i2, _i1, _f1, _f1, _f, _f, *[_i] * 8)
SERIES_WORK = type_of(
    SeriesWork,
    *[_f1] * 7,
    *[_f2] * 4,
    types.UniTuple(_f1, 8),
    *[_f1] * 7,
    *[_i1] * 3,
    _f1,
    _f1,
    _i1,
    _f1,
    _i1,
    _f1,
    _i1,
    _f1,
)
MOTION = type_of(Motion, _f1, _f1, _f1, _i1)
CALL = type_of(Call, _i1, _f1, _f1, _f2, MOTION)
KEPT = type_of(Kept, _f3, _f2, _f2, _i1, _i1, _f1, _f2, _i2, _i1)
LOG = type_of(Log, _f1, _f2, _f2, _i1, _i1, _f1, _i1, _f2, _f2, _f2, _f1, _i1, _f2, _f1, _i, _f1, _f2, _i)
GROWTH = type_of(Growth, _f1, _f2, _f2, _f1, _f1, *[_f2] * 4, _f1, _f1, _i1, _i1, _i, _f1, _f1)


_put_call, call_at = stored(CALL)
_put_kept, kept_at = stored(KEPT)
_put_log, log_at = stored(LOG)
_put_growth, growth_at = stored(GROWTH)


@kernel(types.void(types.int64, CALL))
def put_call(address, record):
    """Write what is asked of a march to an address."""
    _put_call(address, record)


@kernel(types.void(types.int64, KEPT))
def put_kept(address, record):
    """Write the arrays of kept returns to an address."""
    _put_kept(address, record)


@kernel(types.void(types.int64, LOG))
def put_log(address, record):
    """Write the arrays of a log to an address."""
    _put_log(address, record)


@kernel(types.void(types.int64, GROWTH))
def put_growth(address, record):
    """Write the arrays of a frame and its growth to an address."""
    _put_growth(address, record)
