"""The error for a single run that did not come to its end; warnings of motions too small for the scales of a system."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import BoolArray, FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.flow.loads import meter_of
from nonsmooth.kernels.hybrid import codes
from nonsmooth.system.derived.elements.element import SMALL
from nonsmooth.system.symbolic.numeric import numeric

if TYPE_CHECKING:
    from nonsmooth.flow.engines.engine import TrajectoryLog
    from nonsmooth.system.symbolic.traced import TracedTransition
    from nonsmooth.system.system import System


BEYOND_STOP = (
    "the start lies beyond a stop: a transition with a reset holds there already; "
    "start on the admissible side of its indicator"
)


CONTACTS = {
    "not_unique": "the laws of contact and friction allow several motions from here (Painleve's paradox, or impacts at "
    "one instant of which one rubs). Lower the friction, replace a rigid stop by an elastic one, or start elsewhere.",
    "no_motion": "no motion satisfies the laws of contact and friction here (Painleve's paradox). Lower the friction, "
    "or replace a rigid contact by an elastic one.",
}


def solve_error(
    code: int, because: str = "", *, begun: tuple[System, FloatArray] | None = None, **where: Any
) -> SolveError:
    """The error for a kernel's code; ``begun`` are the system and the state where the run began, to name a stop that it
    was beyond; ``where`` (time, state, mode) as :class:`SolveError` takes it."""
    from nonsmooth.results.labels import by_code

    if code == codes.BEYOND_STOP:
        named = "" if begun is None else _beyond_stop(*begun, where.get("time", 0.0))
        return SolveError(named or BEYOND_STOP, status="beyond_stop", **where)
    status = by_code(code)
    return SolveError(because or status.sentence, status=status.name, **where)


def refuse_beyond_stops(system: System, starts: FloatArray) -> None:
    """Raise SolveError for a start, at t = 0, that lies beyond a rigid stop by more than rounding leaves."""
    for u in starts:
        if named := _beyond_stop(system, u, 0.0, SMALL):
            where = dict(zip(system.states, map(float, u), strict=True))
            raise SolveError(named, status="beyond_stop", time=0.0, state=where)


def beyond_stops(system: System, points: FloatArray, starts: FloatArray, time: Any = 0.0) -> BoolArray:
    """Marks of starts (J, n), at parameter points (J, n_parameters), that lie beyond a rigid stop by more than rounding
    leaves."""
    gaps, scales = _gaps(system, points, starts, time)
    return np.asarray((gaps < -SMALL * scales).any(axis=1))


def _gaps(system: System, points: FloatArray, starts: FloatArray, time: Any) -> tuple[FloatArray, FloatArray]:
    """The gaps (J, stops) of starts at rigid stops, and the scales (stops,) of these."""
    meter = meter_of(system)
    if meter is None:
        return np.zeros((len(starts), 0)), np.zeros(0)
    gaps = meter.values(points, np.broadcast_to(time, len(starts)), starts, system.memory_vector())[0]
    return gaps, np.array([system.scale_vector()[some].max(initial=0.0) for some in meter.places])


def _beyond_stop(system: System, u: FloatArray, time: float, least: float = 0.0) -> str:
    """A sentence that names the rigid stop beyond which a state lies, by more than ``least`` of its scale; nothing
    where it lies beyond none."""
    gaps, scales = _gaps(system, system.parameter_vector(), np.asarray(u, dtype=float)[None], time)
    meter = meter_of(system)
    if meter is None or not (gaps < -least * scales).any():
        return ""
    load = meter.elements[meter.striking[int(gaps.argmin())]]
    sides = (
        ""
        if "at=" not in load.text
        else ("; side=1, where none is given, is a stop above the motion, side=-1 one below it")
    )
    return (
        f"the start lies beyond a stop: {load.name!r}, {load.text}, has a gap of {gaps.min():.6g} there{sides}. Start "
        "on its other side, or correct its position or side"
    )


def _not_unique(system: System, jump: TracedTransition) -> str:
    """A sentence where sliding ended without a unique way on; else nothing."""
    modes, declared = system.modes, len(system.declared.mode_names)
    if system.traced.ends(jump):
        where = (
            "a second surface, from which several ways lead on (off both surfaces, or along one of them)"
            if len(jump.rows) > 1
            else "a point where the surface stops attracting from both sides at once (a two-fold)"
        )
        return (
            f"Sliding in mode {modes[jump.source]!r} reached {where}: motion from there is not unique. Change the "
            "model there, or start elsewhere."
        )
    if max(jump.source, jump.target) >= declared:
        return (
            f"{modes[jump.source]!r} and {modes[jump.target]!r} lead to where a second surface attracts too, and "
            "the vector fields beside these surfaces do not determine one field on both (it depends on the order in "
            "which they are combined). Write the motion on both surfaces as a mode of its own."
        )
    return ""


def reason_of(system: System, log: TrajectoryLog) -> str:
    """A sentence where the last reset of a failed run left the state on its way on through the surface, where sliding
    had no unique way on, or where states are so large that impacts are not told from rest; else nothing.

    An impact turns the rate of its indicator round. With the wrong sign it does not, and follows itself without end.
    """
    ended = codes.CHATTER, codes.TOO_MANY_CROSSINGS, codes.NOT_UNIQUE, codes.NO_MOTION
    if log.status not in ended or not len(log.crossing_time):
        return ""
    t, jump = system.traced, system.transitions[int(log.crossing_transition[-1])]
    if jump.kind in CONTACTS:
        return f"Elements {jump.label}: {CONTACTS[jump.kind]}"
    if system.surfaces and (lost := _not_unique(system, jump)):
        return lost
    if jump.reset is None or jump.source != jump.target:
        return ""
    ends = np.array([log.u_before[-1], log.u_after[-1]])
    rates = numeric(t, tuple(system.derivatives.lie(row.indicator, jump.source, 1) for row in jump.rows))
    found = rates(system.parameter_vector(), log.crossing_time[-1], ends, log.memory_after[-1])
    before, after = found * [row.sign for row in jump.rows]
    on = (before > 0.0) & (after > 1e-6 * before)
    if on.any() and not ((before > 0.0) & ~on).any():  # a condition beside the one that is turned round may go on
        k = int(on.argmax())
        return (
            f"The reset of {jump.label} leaves the state on its way on through the surface: "
            f"d({system.indicators[jump.rows[k].indicator]})/dt is {found[0, k]:.4g} before it and {found[1, k]:.4g} "
            "after it. Give the velocity that it returns the other sign; a push that leads on through its surface "
            "takes two modes, one on each side."
        )
    largest = np.nanmax(np.abs(np.concatenate([log.u_before, log.u_after])), axis=0, initial=0.0)
    states = zip(system.states, largest, system.scale_vector(), strict=True)
    large = {name: float(f"{u:.2g}") for name, u, scale in states if u > LARGE * scale}
    if large and meter_of(system) is not None:
        return (
            "Impacts are told from rest by the scales of the states, 1 where none is given. These states are more than "
            f"{LARGE:g} times as large: give scale={large}."
        )
    return ""


LARGE = 100.0  # units of its scale: rounding of such a state is seen beside the least speed of an impact
LEAST = 1e-3  # the least size of a motion, in units of the states' scales
RESTING = 5e-7  # in the same units: a smaller state is rounding beside a motion
NOTHING = 1e-15  # and where nothing moves more


def warn_if_small(system: System, *sizes: FloatArray) -> None:
    """Warn of states that never leave the size below which a motion counts as rest.

    Parameters
    ----------
    *sizes : array (..., n)
        Values of the states on attractors: starts, extremes.
    """
    _warn(system, sizes, RESTING, "where a motion counts as rest, so attractors may not be told apart or found")


def warn_if_slow(system: System, *sizes: FloatArray) -> None:
    """Warn of a run of a system with elements in which no state leaves that size: rest at a contact is told by scales.

    Parameters
    ----------
    *sizes : array (..., n)
        Values of the states on the run.
    """
    loads = system._description.loads
    if loads is not None and loads.elements:
        _warn(system, sizes, np.inf, "by which impacts are told from rest and contact from none, so both may be wrong")


def _warn(system: System, sizes: tuple[FloatArray, ...], resting: float, what: str) -> None:
    """Warn of small states, in a sentence; beside larger ones only of those above ``resting``."""
    scale = system.scale_vector()
    largest = np.max([np.nanmax(np.abs(one).reshape(-1, len(scale)), axis=0, initial=0.0) for one in sizes], axis=0)
    low = largest < LEAST * scale
    small = np.flatnonzero(low & (largest > (NOTHING if low.all() else resting) * scale))
    if small.size:
        names = list(system.states)
        told = ", ".join(f"{names[j]!r}: {largest[j]:.2g}" for j in small)
        warnings.warn(
            f"{system.name!r}: these states stay below {LEAST:g} of their scale, {what}; give System(scale={{{told}}})",
            stacklevel=5,
        )
