"""The path of an orbit between its transitions: extremes, clearances, and whether it obeys every boundary."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray, IntArray
from nonsmooth.continuation.problems.signature import AT_ONCE
from nonsmooth.system.symbolic.traced import FOUND

if TYPE_CHECKING:
    from nonsmooth.continuation.problems.shooting import Shooting, Solved
    from nonsmooth.system.symbolic.traced import Traced

ORDER = 20
RTOL = 1e-15
ROUNDING = 1e-13  # of an indicator's size
LEAST = 1e-18  # of an indicator's size: a maximum nearer to zero has no sign
BEGUN = 1e-10  # of the period
SHORT = 1e-6  # of the period
#: Of the period: a visit as short as rounding, and one at the section, where a crossing has just passed it, has no
#: length, not a negative one.
NOTHING, PASSED = 1e-13, 1e-10
SOLVED = 1e-6  # of its size: as near to a boundary just crossed as an orbit is solved for


@dataclass
class Path:
    """Extremes and margins along an orbit; see ``kernels.orbit_path`` for the arrays over (visit, transition)."""

    maximum: FloatArray  # (n_u,)
    minimum: FloatArray
    inner: FloatArray  # (m + 1, n_transitions)
    place: FloatArray
    which: NDArray[np.int64]
    touch: float  # largest of inner: below 0 the nearest approach to a transition that does not happen
    touched: tuple[int, int]  # its (visit, transition), or that of a touch so near to zero that it has no sign
    own: FloatArray  # (m,) at each transition, the least of its other rows: 0 at a corner of its condition
    others: FloatArray  # (m,) at each transition, the largest margin of the other transitions: 0 at a corner
    other: NDArray[np.int64]  # (m,) which one
    slope: FloatArray  # (m,) how fast the indicator that fires rises: 0 where the orbit only touches
    tau: FloatArray  # (m + 1,) lengths of the visits; inf where it is fixed by the forcing
    landed: FloatArray  # (m + 1,) where each visit begins, the largest margin of its transitions: 0 on a boundary
    landing: NDArray[np.int64]  # (m + 1,) which transition
    section: FloatArray  # (n_transitions,) the margins at the section

    @cached_property
    def margins(self) -> FloatArray:
        """Six numbers that are positive (or inf) on an orbit of the system; one turns negative beyond a boundary.

        The shortest visit, the slowest crossing, the other rows of the conditions that fire, the nearest touch, the
        conditions that do not fire, those that hold where a visit begins (behind a reset); see ``boundaries``.
        """
        return np.array(
            [
                self.tau.min(),
                self.slope.min(initial=np.inf),
                self.own.min(initial=np.inf),
                -self.touch,
                -self.others.max(initial=-np.inf),
                -self.landed.max(),
            ]
        )

    @property
    def virtual(self) -> bool:
        """True where the path goes through a boundary that it should obey."""
        return bool((self.margins < 0.0).any())


class Walk:
    """Walks along orbits of one system with one signature."""

    def __init__(self, shooting: Shooting) -> None:
        from nonsmooth.flow.engines.loop import pack_net
        from nonsmooth.kernels.compile.pointers import addresses

        self.shooting, system = shooting, shooting.system
        traced: Traced = system.traced
        self.net, (jet, n_scratch) = pack_net(traced), shooting.flow.path()
        self.functions = addresses(jet)
        jumps, visits, self.modes = traced.transitions, shooting.signature.visits, shooting.modes
        n, m = shooting.flow.n_moving, shooting.m + 1  # with the memory that the jet moves as states
        both = [_in_net(traced, self.net, v.transition, v.row) for v in visits]
        self.fired, self.fired_row = np.array(both, dtype=np.int64).T.copy()
        self.lacking = np.zeros((len(traced.mode_names), n), dtype=np.int64)
        self.lacking[:, : len(traced.u)] = traced.lacking
        self.weight = shooting.flow.scale[:n] * 1e-3
        rows = n + len(traced.indicators) + len(traced.outputs)
        self.scratch = (
            np.zeros((rows, ORDER + 1)),
            np.zeros((rows, ORDER + 1)),
            np.zeros((n_scratch, ORDER + 1)),
            np.zeros(n),
            np.zeros(n),
            np.zeros(len(traced.indicators)),
        )
        self.shape, self.states = (m, len(jumps)), len(traced.u)
        sources = np.array([jump.source for jump in jumps], dtype=np.int64)
        fires = np.array([jump.fires for jump in jumps], dtype=bool) & (self.net.at < 0)
        self.armed = (sources == self.modes[:, None]) & fires
        surface, conditions = _surfaces(traced)
        self.surfaces = [{one[0] for one in rows} for rows in conditions]
        #: The surface by which each visit ends; None where it is none, or holds at once.
        self.fires_by = [
            conditions[k][r - self.net.row_start[k]][0] if r >= 0 else None
            for k, r in zip(self.fired, self.fired_row, strict=True)
        ]
        self.elsewhere = self.armed.copy()  # transitions that could fire at the end of a visit but do not
        for i, (k, r) in enumerate(zip(self.fired, self.fired_row, strict=True)):
            if k >= 0:  # of those behind it none is taken that holds wherever it does, or by the condition that fires
                own, fires_by = set(conditions[k]), conditions[k][r - self.net.row_start[k]] if r >= 0 else None
                taken = [bool(other) and (set(other) <= own or fires_by in other) for other in conditions[k:]]
                self.elsewhere[i, k] = False
                self.elsewhere[i, k:] &= ~np.array(taken, dtype=bool)
            if traced.asks and r >= 0:  # what several decide fires with what one does, of its own or of their condition
                fired = surface[self.net.rows[r, 0]]
                self.elsewhere[i] &= [all(surface[one.indicator] != fired for one in j.rows) for j in jumps]
            if traced.patterns is not None and (r >= 0 or visits[i].row == AT_ONCE):
                self.elsewhere[i] = False  # no expression tells which conditions are one: a run sees what else happens
        self.conditional = np.flatnonzero(self.fired_row[:-1] >= 0)
        #: Of a visit that ends with one of several transitions that are alike: all that decide whether one is taken.
        self.deciding: dict[int, list[tuple[int, bool]]] = {}
        for i in map(int, self.conditional):
            k, among = self.fired[i], np.flatnonzero(self.armed[i]) if traced.patterns is None else ()
            alike = traced.alike(k, row := self.fired_row[i] - self.net.row_start[k])
            if len(alike) > 1:
                fires = jumps[k].rows[row]
                by = [j for j in {*alike, *among} if j in alike or fires in jumps[j].rows]
                self.deciding[i] = [(j, j in alike) for j in sorted(by) if alike[0] <= j <= alike[-1]]
                self.elsewhere[i, alike] = False
        self.at_once = np.array([*shooting.at_once, False], dtype=bool)  # visits of no length
        fixed = [shooting.forced]
        for visit in visits[:-1]:  # at a phase that does not depend on the parameters
            fixed.append(fixed[-1] if visit.row == AT_ONCE else isinstance(jumps[visit.transition].at, int | float))
        ends = np.array([*fixed, shooting.forced], dtype=bool)
        # Visits whose length cannot vanish
        self.fixed = (ends[:-1] & ends[1:]) | self.at_once if m > 1 else np.array([True])
        self.crossed = np.zeros((m, len(traced.indicators)), dtype=bool)  # indicators zero where a visit begins
        for i in [*range(1, m), 0, *range(1, m)]:  # the section parts a visit
            if self.at_once[i - 1]:
                self.crossed[i] = self.crossed[i - 1]
            elif self.fired_row[i - 1] >= 0:
                self.crossed[i] = surface == surface[self.net.rows[self.fired_row[i - 1], 0]]
            if visits[i - 1].transition < 0 or jumps[visits[i - 1].transition].reset is None:
                for one in np.flatnonzero(self.crossed[i - 1] & ~self.crossed[i]):
                    self.crossed[i, one] = _stands(traced, int(self.modes[i - 1]), int(one))
        for i in map(int, np.flatnonzero(shooting.divided)):  # the exit lies in the surface of the entry
            self.crossed[i, self.net.rows[self.fired_row[i], 0]] = True
        # Of conditions that hold together the first is taken; what was crossed at the instant is zero.
        for i in range(m):
            if self.at_once[i]:
                self.elsewhere[i, self.fired[i] :] = False
                self.elsewhere[i] &= [not any(self.crossed[i, one.indicator] for one in jump.rows) for jump in jumps]
        self.inside = self.conditional, self.fired[self.conditional]
        # No corner to watch: the other rows vanish with it, or belong to what stands in the table for an answer.
        answers = [jumps[self.fired[i]].rows != jumps[visits[i].transition].rows for i in self.conditional]
        self.alone = np.array(shooting.alone, dtype=bool)[self.conditional] | np.array(answers, dtype=bool)
        self.instants = np.flatnonzero(self.at_once)
        self.answered = [v.transition >= 0 and jumps[v.transition].kind == FOUND for v in visits]
        self.every = np.arange(m)
        self.nothing = np.where((self.every == 0) | (self.every == m - 1), PASSED, NOTHING)

    def along(self, solved: Solved, states: FloatArray) -> Path | None:
        """Walk along the visits of a solved orbit; ``states`` (m + 1, n_z) begin them.

        None where the states grow without bound."""
        from nonsmooth.kernels.tangent.orbit_path import Margins, Visits, follow

        m, n_t = self.shape
        extremes = np.empty((2, len(self.weight)))
        inner, place, begin, size, end = np.empty((5, m, n_t))
        begin_row, which = np.empty((2, m, n_t), dtype=np.int64)
        slope = np.empty((m, 2))
        tau = solved.times[1:] - solved.times[:-1]
        tau[self.at_once | ((tau < 0.0) & (tau > -self.nothing * float(solved.times[-1])))] = 0.0
        q = self.shooting.flow.on_path(solved.values, self.modes)
        *room, sizes = self.scratch
        status = follow(
            self.functions,
            ORDER,
            RTOL,
            self.weight,
            self.lacking,
            self.net,
            q,
            Visits(self.modes, solved.times[:-1], tau, np.ascontiguousarray(states), self.fired, self.fired_row),
            (*room, np.zeros(len(q) + states.shape[1]), sizes),
            extremes,
            Margins(inner, place, which, begin, begin_row, size, end, slope),
        )
        if status:
            return None
        # Beside a boundary that has just been crossed only what is solved for tells which side is meant.
        together, zeros = self._of_one_instant(tau, float(solved.times[-1]))
        crossed = zeros[self.every[:, None], self.net.rows[begin_row, 0]] if zeros.size else False
        zero = np.abs(begin) <= np.where(crossed, SOLVED, ROUNDING) * size
        # Where several rows vanish as a visit begins, a lift-off, rounding of one is no maximum of another.
        begun = place - solved.times[:-1, None] <= BEGUN * float(solved.times[-1])
        inner[begun & zero & (np.abs(inner) <= ROUNDING * size)] = -np.inf
        # In a flight as short as those before rest an indicator does not rise above what it is solved for.
        flown = tau < SHORT * float(solved.times[-1])
        inner[flown[:, None] & (np.abs(inner) <= ROUNDING * size.max(axis=0))] = -np.inf
        without_sign = np.abs(inner) < LEAST * np.where(np.isfinite(size), size, 0.0)
        inner[without_sign] = -np.inf
        if m == 1:  # the section is a place within the only visit
            higher = begin > inner
            inner[higher], place[higher], which[higher] = begin[higher], 0.0, begin_row[higher]
        at = int(np.where(without_sign, 0.0, inner).argmax()) if n_t else 0
        touched = (at // n_t, at % n_t) if n_t else (0, 0)
        own = end[self.inside]
        for i, deciding in self.deciding.items():
            taken, barred = -np.inf, np.inf
            for k, alike in deciding:
                if alike:
                    taken = max(taken, min(end[i, k], barred))
                else:
                    barred = min(barred, -end[i, k])
            own[np.searchsorted(self.conditional, i)] = taken
        own[self.alone] = np.inf
        if n_t and m > 1:  # of one instant are those whose condition vanishes there; one that holds was passed
            meets = together[:-1] & (end[:-1] <= SOLVED * size.max(axis=0))
            rest = np.where(self.elsewhere[:-1] & ~meets, end[:-1], -np.inf)
            other = rest.argmax(axis=1)
            others = rest[self.every[:-1], other]
        else:
            other, others = np.zeros(m - 1, dtype=np.int64), np.full(m - 1, -np.inf)
        watched = m > 1 and len(self.net.rows) > 2  # the section is passed, nothing has led there
        held = self._held(begin, zero | (together & (tau == 0.0)[:, None])) if watched else np.full((m, 1), -np.inf)
        landing = held.argmax(axis=1)
        extremes[~np.isfinite(extremes)] = np.nan  # states that no visit has
        return Path(
            extremes[0, : self.states],
            extremes[1, : self.states],
            inner,
            place,
            which,
            float(inner.max(initial=-np.inf)),
            touched,
            own,
            others,
            other,
            slope[self.conditional, 0],
            np.where(self.fixed, np.inf, tau),
            held[self.every, landing],
            landing,
            begin[0],
        )

    def _of_one_instant(self, tau: FloatArray, period: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Transitions (m, n_t) that fire at the instant at which a visit ends, each by itself, since visits behind or
        before have no length: two masses side by side are struck. And the indicators (m, n_indicators) that are zero
        where visits begin."""
        together, zeros = np.zeros_like(self.armed), self.crossed
        still = (np.abs(tau) <= self.nothing * period) & (self.fired_row >= 0)
        still[0] = False
        if not still.any():
            return together, zeros
        zeros, first = zeros.copy(), 0
        for i in range(1, len(still)):
            if still[i]:
                zeros[i + 1] |= zeros[i]
                fired = set(self.fires_by[first : i + 1])
                together[first : i + 1] = [not fired.isdisjoint(one) for one in self.surfaces]
            else:
                first = i
        return together, zeros

    def _held(self, begin: FloatArray, zero: NDArray[np.bool_]) -> FloatArray:
        """Margins where the visits begin; -inf for those that are ``zero`` there."""
        held = np.where(self.armed & ~zero, begin, -np.inf)
        held[0] = -np.inf
        for i in self.instants:  # what happens at once must hold; the others: ``elsewhere``; of an answer what follows
            k = self.fired[i]
            held[i] = -np.inf
            if self.net.row_start[k] < self.net.row_start[k + 1] and not self.answered[i]:
                held[i, k] = 0.0 if zero[i, k] else -begin[i, k]
        return held

    def clearance(self, path: Path, indicators: int) -> FloatArray:
        """Per indicator the least distance left to a transition that did not happen; NaN where none came near."""
        found = np.full(indicators, np.nan)
        for visit, k in np.argwhere(np.isfinite(path.inner)):
            i = int(self.net.rows[path.which[visit, k], 0])
            distance = -path.inner[visit, k]
            if not found[i] <= distance:
                found[i] = distance
        return found


@lru_cache(maxsize=16)
def _surfaces(traced: Traced) -> tuple[IntArray, list[list[tuple[int, int, bool]]]]:
    """For each indicator the first one that vanishes where it does, by their expressions where they have any; and the
    conditions of all transitions by these."""
    first, same = dict[Any, tuple[int, int]](), list[tuple[int, int]]()
    for i, one in enumerate(traced.indicators):
        if getattr(one, "free_symbols", ()):
            same.append(first.setdefault(one, (i, 1)))
            first.setdefault(-one, (i, -1))
        else:
            same.append((i, 1))
    rows = [
        [(same[one.indicator][0], one.sign * same[one.indicator][1], one.strict) for one in jump.rows]
        for jump in traced.transitions
    ]
    return np.array([at for at, _ in same], dtype=np.int64), rows


@lru_cache(maxsize=4096)
def _stands(traced: Traced, mode: int, indicator: int) -> bool:
    """Return whether an indicator keeps its value in a mode, whatever the state: a slider at its bound, a mass held."""
    h = traced.indicators[indicator]
    if traced.patterns is not None or traced.t in h.free_symbols:
        return False
    rates = zip(traced.u, traced.fields[mode], strict=True)
    return bool(sum((h.diff(u) * rate for u, rate in rates if u in h.free_symbols), 0 * h).expand() == 0)


def _in_net(traced: Traced, net: Any, k: int, row: int) -> tuple[int, int]:
    """A transition and the row of it that is zero, as the transition table has them: a question for its answer. (Where
    no row is zero and several elements were asked, no condition of the table had to hold.)"""
    jump = traced.transitions[k] if k >= 0 else None
    if jump is not None and jump.kind == FOUND:
        for j, other in enumerate(traced.transitions):
            same = jump.rows[row] in other.rows if row >= 0 else jump.rows == other.rows
            if other.source == jump.source and other.fires and same:
                return j, int(net.row_start[j]) + other.rows.index(jump.rows[row]) if row >= 0 else -1
    return k, -1 if row < 0 else int(net.row_start[k]) + row
