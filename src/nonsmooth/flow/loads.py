r"""Loads of elements on a motion: impulses, impact speeds and energies of impacts; work per period.

At a crossing :math:`u^+ - u^- = \sum_i D_i \Lambda_i` over the rigid contacts that are closed; where several bear, the
impulses are the ones :math:`\Lambda \ge 0` of least norm. Forces do work between crossings: it is integrated by Gauss's
rule over pieces in which the motion is smooth, of samples that the engine takes there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import BoolArray
from nonsmooth.flow.engines.engine import FloatArray, State, TrajectoryLog
from nonsmooth.flow.outputs import output_values
from nonsmooth.kernels.hybrid import codes
from nonsmooth.system.symbolic.numeric import numeric

if TYPE_CHECKING:
    from nonsmooth.flow.engines.loop import Engine
    from nonsmooth.system.derived.loads import Load, Loads
    from nonsmooth.system.description import Description
    from nonsmooth.system.system import System

ZERO = 1e-11  # of the largest value of a speed on the motion: a smaller change is no impact
CLOSED = 1e-7  # of the largest states of a gap: below it a contact is closed
ALONE = 1e-6  # of a change of speeds: what impulses leave of it; more is a reset of another kind
NODES = 16  # of Gauss's rule on one piece
PIECES = 8  # of one return, at least
FINEST = 64  # times as many, at most
TAIL = 1e-10  # of the largest power: the last coefficients of a piece's polynomial

Quantities = dict[str, tuple[str, str]]  # long name and unit of each quantity


@dataclass(frozen=True, eq=False)
class Meter:
    """The loads of a system as functions of numbers."""

    description: Description
    loads: Loads

    @cached_property
    def elements(self) -> list[Load]:
        """The elements whose rate is the same in all modes of the system without them."""
        return [load for load in self.loads.elements if load.rate is not None]

    @cached_property
    def striking(self) -> list[int]:
        """The numbers of those that have impacts, and of the friction in them."""
        return [k for k, load in enumerate(self.elements) if load.element.strikes or load.rubs]

    @cached_property
    def gaps(self) -> list[Any]:
        """The gaps of those; of a friction that of its contact."""
        where = {load.name: load.where for load in self.elements}
        return [where[load.rubs or load.name] for load in (self.elements[k] for k in self.striking)]

    @cached_property
    def rubs(self) -> FloatArray:
        """Marks of those that are frictions."""
        return np.array([bool(self.elements[k].rubs) for k in self.striking], dtype=bool)

    @cached_property
    def units(self) -> dict[str, list[str]]:
        """Units of force, rate, impulse and energy by element."""
        found = self.loads.units(self.description.symbol_units)
        return {name: [unit or "1" for unit in units] for name, units in found.items()}

    @cached_property
    def at_crossings(self) -> Quantities:
        """Quantities of each crossing."""
        found = {}
        for k in self.striking:
            name = self.elements[k].name
            _, rate, impulse, energy = self.units[name]
            found[f"{name}_impulse"] = f"impulse of {name}", impulse
            speed = "slip speed before the impact" if self.elements[k].rubs else "approach speed"
            found[f"{name}_impact_speed"] = f"{speed} of {name} (NaN: no impact)", rate
            found[f"{name}_energy_lost"] = f"energy lost by the impact of {name}", energy
        return found

    @cached_property
    def per_period(self) -> Quantities:
        """Quantities of each motion."""
        found = {}
        for k, load in enumerate(self.elements):
            force, rate, impulse, energy = self.units[load.name]
            for end in ("maximum", "minimum"):
                found[f"{load.name}_force_{end}"] = f"{end} of {load.name}_force", force
            if k in self.striking:
                found[f"{load.name}_impact_speed_maximum"] = f"largest approach speed of {load.name}", rate
                found[f"{load.name}_impacts"] = f"impacts of {load.name} per return", "1"
                found[f"{load.name}_impulse"] = f"impulse of {load.name} per return", impulse
            found[f"{load.name}_energy"] = f"energy that {load.name} takes from the masses per return", energy
        for name in self.loads.powers:
            words = "that the masses lose to" if name in ("damping", "stiffness") else "done on the masses by"
            found[f"work_of_{name}"] = f"work {words} {name} per return", self.loads.energy or "1"
        return found

    # Values of expressions

    @cached_property
    def _function(self) -> Callable[..., FloatArray]:
        """Gaps of striking elements, rates, speeds w.v, directions, powers."""
        t = self.description.traced
        every = (
            *self.gaps,
            *(load.rate for load in self.elements),
            *(load.moved(t.u) for load in self.elements),
            *(self.elements[k].direction.get(i, 0) for k in self.striking for i in range(len(t.u))),
            *self.loads.powers.values(),
        )
        return numeric(t, every)

    def values(
        self, parameters: FloatArray, time: FloatArray, u: FloatArray, memory: FloatArray
    ) -> tuple[FloatArray, ...]:
        """Those at N instants, the instants first; ``parameters`` are one row, or one for each instant."""
        count, n, states = len(self.elements), len(self.striking), len(self.description.traced.u)
        found = self._function(parameters, time, np.nan_to_num(u), memory)
        gap, rate, moved, direction, power = np.split(found, np.cumsum([n, count, count, n * states]), axis=1)
        return gap, rate, moved, direction.reshape(len(found), n, states), power

    @cached_property
    def places(self) -> list[list[int]]:
        """The states in each gap."""
        u = self.description.traced.u
        return [[i for i, one in enumerate(u) if gap.has(one)] for gap in self.gaps]

    def constraints(self, mode: str, values: FloatArray, time: float, u: FloatArray, memory: FloatArray) -> FloatArray:
        """The derivatives in the states of what the elements keep at zero in a mode, (constraints, n)."""
        t = self.description.traced
        held = [load for load in self.loads.held(mode) if load.rate is not None]
        kept = tuple(e for load in held for e in dict.fromkeys((load.rate, load.where)))
        found: FloatArray = numeric(t, kept, t.u)(values, time, u, memory)[:, 1:]
        return found

    # Impacts

    def impacts(
        self,
        parameters: FloatArray,
        time: FloatArray,
        before: FloatArray,
        after: FloatArray,
        memory: FloatArray,
        size: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Impulses, approach speeds (NaN where there is no impact), energies lost and energies taken from the masses,
        each (C, striking elements); ``size`` are the largest states on the motion."""
        gap, rate, moved, D, _ = self.values(parameters, time, before, memory)
        _, rate_after, moved_after, _, _ = self.values(parameters, time, after, memory)
        speeds = (D != 0.0).any(axis=(0, 1))
        change = np.where(speeds, np.nan_to_num(after - before), 0.0)
        closed = gap <= CLOSED * np.array([size[some].max(initial=0.0) for some in self.places])
        jumps = (np.abs(change) > ZERO * size).any(axis=1)
        impulses = np.zeros(gap.shape)
        lone = jumps & (closed.sum(axis=1) == 1) & ~closed[:, self.rubs].any(axis=1)
        at, which = np.nonzero(closed & lone[:, None])
        impulses[at, which] = _single(D[at, which], change[at])
        for c in np.flatnonzero(jumps & closed.any(axis=1) & ~lone):
            some = np.flatnonzero(closed[c])
            rubs = some[self.rubs[some]]
            found = _least(np.concatenate([D[c, some], -D[c, rubs]]).T, change[c])  # a friction's has either sign
            impulses[c, some] = found[: len(some)]
            impulses[c, rubs] -= found[len(some) :]
        impulses[(np.abs(impulses[:, :, None] * D) <= ZERO * size).all(axis=2)] = 0.0
        one = self.striking
        approach = np.where(self.rubs, np.abs(rate[:, one]), np.maximum(-rate[:, one], 0.0))
        approach[approach <= ZERO * np.where(D != 0.0, size, 0.0).max(axis=2)] = 0.0  # of what rests
        speed = np.where(impulses != 0.0, approach, np.nan)
        lost, taken = (-0.5 * impulses * (a + b)[:, one] for a, b in ((rate, rate_after), (moved, moved_after)))
        return impulses, speed, lost + 0.0, taken + 0.0

    # Work

    def over(
        self, engine: Engine, values: FloatArray, state: State, duration: float, returns: int
    ) -> dict[str, float] | None:
        """Loads of a motion over some returns to its section, per return; None where it could not be followed.

        The window begins between two crossings, not at the section, so that none is counted at both of its ends."""
        traced, tables = engine.traced, engine.prepare(np.asarray(values, dtype=float)[None, :])

        def marched(begun: State, until: float, samples: FloatArray | None = None) -> TrajectoryLog:
            log = engine.record(tables, begun, until, np.empty(0) if samples is None else samples)
            if log.status not in (codes.OK, codes.NOT_GUARANTEED):
                raise _Failed
            return log

        def parts(begin: float, log: TrajectoryLog) -> FloatArray:
            return np.unique(np.concatenate([[begin], log.crossing_time, [begin + duration]]))

        def now(place: State) -> float:
            return float(place.clock[0] + (place.clock[1] * tables.period[0] if place.clock[1] else 0.0))

        try:
            state = state.copy()
            begin = now(state)
            edges = parts(begin, marched(state.copy(), begin + duration))
            longest = int(np.diff(edges).argmax())
            marched(state, float(0.5 * (edges[longest] + edges[longest + 1])))
            begin = now(state)
            edges = parts(begin, marched(state.copy(), begin + duration))
            x, weight, back = _rule()
            tail = TAIL if engine.name == "exact" else max(TAIL, 10.0 * getattr(engine, "rtol", TAIL))
            piece = duration / (returns * PIECES)
            while True:
                ends = _cut(edges, piece)
                half = 0.5 * np.diff(ends)
                time = (ends[:-1, None] + half[:, None] * (x + 1.0)).ravel()
                log = marched(state.copy(), begin + duration, time)
                _, _, moved, _, power = self.values(values, time, log.sample_u, log.sample_memory)
                outputs = output_values(traced, values, time, log.sample_u, log.sample_memory, log.sample_mode)
                names = list(traced.output_names)
                force = outputs[:, [names.index(f"{load.name}_force") for load in self.elements]]
                seen = np.hstack([force, -force * moved, power]).reshape(len(half), NODES, -1)
                tails = np.abs(np.einsum("kx,pxi->pki", back[-2:], seen)).max(axis=1, initial=0.0)
                fine = tails <= tail * np.abs(seen).max(axis=(0, 1), initial=0.0)
                if fine.all() or piece * FINEST * returns * PIECES < duration:
                    break
                piece /= 2.0
        except _Failed:
            return None
        count = len(self.elements)
        total = np.einsum("p,x,pxi->i", half, weight, seen[..., count:]) / returns
        highest, lowest = (_highest(sign * seen[..., :count], back, fine[:, :count]) for sign in (1, -1))
        size = np.nanmax(np.abs(np.vstack([log.sample_u, log.u_before, log.u_after])), axis=0)
        impulses, speed, _, taken = self.impacts(
            values, log.crossing_time, log.u_before, log.u_after, log.memory_after, size
        )
        found = {}
        for k, load in enumerate(self.elements):
            found[f"{load.name}_force_maximum"], found[f"{load.name}_force_minimum"] = highest[k], 0.0 - lowest[k]
            if k in self.striking:
                j = self.striking.index(k)
                struck = speed[~np.isnan(speed[:, j]), j]
                found[f"{load.name}_impact_speed_maximum"] = struck.max(initial=0.0)
                found[f"{load.name}_impacts"] = np.count_nonzero(struck) / returns
                found[f"{load.name}_impulse"] = impulses[:, j].sum() / returns
                total[k] += taken[:, j].sum() / returns
            found[f"{load.name}_energy"] = total[k]
        found |= {f"work_of_{name}": w for name, w in zip(self.loads.powers, total[len(self.elements) :], strict=True)}
        return {name: float(value) for name, value in found.items()}


class _Failed(Exception):
    """A motion that could not be followed."""


def _cut(edges: FloatArray, longest: float) -> FloatArray:
    """The edges with more of them, so that no piece between two is longer."""
    pieces = [(a, b) for a, b in pairwise(edges) if b - a > 1e-13 * (edges[-1] - edges[0])]
    cuts = [np.linspace(a, b, int(np.ceil((b - a) / longest)) + 1)[:-1] for a, b in pieces]
    return np.append(np.concatenate(cuts), edges[-1])


@lru_cache(maxsize=1)
def _rule() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Gauss's nodes and weights, and the matrix from values there to coefficients of Legendre polynomials."""
    x, weight = np.polynomial.legendre.leggauss(NODES)
    every = np.polynomial.legendre.legvander(x, NODES - 1)
    return x, weight, (np.arange(NODES)[:, None] + 0.5) * every.T * weight


def _highest(values: FloatArray, back: FloatArray, fine: BoolArray) -> list[float]:
    """The maxima of functions (pieces, nodes, i): by their polynomials on pieces (pieces, i) that these describe; on
    others, where one would overshoot at a kink, the largest sample."""
    from numpy.polynomial import Legendre

    found = []
    for own, smooth in zip(np.moveaxis(values, 2, 0), fine.T, strict=True):
        rows = own @ back.T
        left, right = rows[:, ::2].sum(axis=1) - rows[:, 1::2].sum(axis=1), rows.sum(axis=1)
        every = np.column_stack([np.where(smooth, left, own[:, 0]), own, np.where(smooth, right, own[:, -1])])
        highest, tops = float(every.max()), every.max(axis=1)
        between = np.abs(np.diff(every, axis=1)).max(axis=1)  # by which it may rise between two samples
        for at in np.flatnonzero(smooth & (tops + between > highest)):
            some = Legendre(np.where(np.abs(rows[at]) > 1e-14 * np.abs(rows[at]).max(), rows[at], 0.0)).trim()
            turns = some.deriv().roots() if some.degree() > 1 else np.zeros(0)
            inside = turns.real[(np.abs(turns.imag) < 1e-8) & (np.abs(turns.real) <= 1.0)]
            highest = float(some(inside).max(initial=highest))
        found.append(highest)
    return found


def _single(D: FloatArray, change: FloatArray) -> FloatArray:
    """The impulses of one contact each, at many instants; zeros where the change of states is not along its own."""
    impulses = np.maximum((D * change).sum(axis=1) / np.maximum((D * D).sum(axis=1), 1e-300), 0.0)
    left = np.abs(change - impulses[:, None] * D).max(axis=1, initial=0.0)
    return np.where(left <= ALONE * np.abs(change).max(axis=1, initial=0.0), impulses, 0.0)


def _least(D: FloatArray, change: FloatArray) -> FloatArray:
    """The impulses, not negative and of least norm, that make a change of states; zeros where none do."""
    from scipy.optimize import nnls

    size = np.abs(D).max()
    impulses = nnls(np.vstack([D, 1e-7 * size * np.eye(D.shape[1])]), np.append(change, np.zeros(D.shape[1])))[0]
    bearing = impulses > 1e-6 * impulses.max(initial=0.0)
    exact = np.linalg.lstsq(D[:, bearing], change, rcond=1e-10)[0]
    if (exact >= 0.0).all():
        impulses = np.where(bearing, 0.0, impulses)
        impulses[bearing] = exact
    left = np.abs(change - D @ impulses).max()
    return impulses if left <= ALONE * np.abs(change).max() else np.zeros(D.shape[1])


def meter_of(system: System) -> Meter | None:
    """The meter of a system, made once for all its copies; None where it has no elements and is not mechanical."""
    d = system._description
    if d.loads is None:
        return None
    if "meter" not in d.variants:
        d.variants["meter"] = Meter(d, d.loads)
    found: Meter = d.variants["meter"]
    return found


def within_held(system: System, mode: int, values: FloatArray, z: FloatArray) -> FloatArray:
    """The projection onto the small changes of a state at phase 0, and of the memory, that what holds there allows.

    A held contact takes each neighbour to its place in a finite time; at which rate the equations bring rounding errors
    back to it means nothing."""
    meter, n, allowed = meter_of(system), len(system.states), np.eye(len(z))
    if meter is not None:
        rows = meter.constraints(system.modes[mode], values, 0.0, z[:n], z[n:])
        allowed[:n, :n] -= np.linalg.pinv(rows, rcond=1e-7) @ rows
    return allowed


def checked_loads(system: System, wanted: bool, verb: str) -> Quantities:
    """The quantities of a system whose loads are wanted; none where they are not.

    Raises
    ------
    ValueError
        A system that has none.
    """
    if not wanted:
        return {}
    meter = meter_of(system)
    if meter is None or not meter.per_period:
        raise ValueError(
            f"{verb}: loads are those of elements, and {system.name!r} has none with forces on speeds; give "
            "System(elements=...) or make it by ns.mechanical, or leave loads out"
        )
    return meter.per_period
