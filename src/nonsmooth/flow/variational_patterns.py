"""The variational flow of systems whose modes are made when they are visited: rows of numbers in place of formulas.

The rows of a mode and of a transition at given parameters, with their derivatives in the active ones (by the same
algebra, :meth:`nonsmooth.system.derived.patterns.Patterns.rows_at`), are packed into one array, which the kernels read
as the constants of a model (:mod:`nonsmooth.kernels.tangent.rows`): nothing is compiled for such a system.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.flow.variational_rows import NONE, SIZES, RowsFlow
from nonsmooth.system.derived.deciding import decide
from nonsmooth.system.derived.instants import RowNumbers
from nonsmooth.system.derived.patterns import STEP, Patterns, Reset
from nonsmooth.system.derived.rows import Rows

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced

OFF = 1e-5  # of a parameter, for the differences by which an impact with friction depends on it


class PatternFlow(RowsFlow):
    """Segments and jumps of the modes and transitions that were visited so far."""

    def __init__(self, patterns: Patterns, active: tuple[str, ...], scale: FloatArray) -> None:
        self.patterns, self.harmonics = patterns, len(patterns.form.multiples)
        super().__init__(patterns.seen(), active, scale)

    def known(self) -> Traced:
        return self.patterns.seen()

    def look_at(self, modes: Any, values: FloatArray) -> None:
        new = {self.patterns.visited[mode] for mode in modes} - self.patterns.led
        if new:
            rows = self.patterns.rows_at(values)
            for pattern in sorted(new):
                self.patterns.look_at(rows, pattern)
        self.catch_up()

    def _at(self, values: FloatArray) -> Packed:
        last = next(reversed(self._local.rows.values()), None)
        return Packed(self.patterns, self.traced, values, self.places, last)

    def on_path(self, values: FloatArray, modes: Any) -> FloatArray:
        found: FloatArray = self.kept(values).array(modes, watched=True)
        return found

    def _ready(self, values: FloatArray, modes: Any) -> tuple[FloatArray, Any]:
        return NONE, self.scratch()._replace(q=self.kept(values).array(modes))

    def _ready_to_jump(self, values: FloatArray, k: int, t: float, z: FloatArray) -> tuple[FloatArray, Any]:
        return NONE, self.scratch()._replace(q=self.kept(values).of_jump(k, t, z))

    def _taken(self, at: Packed, i: int, mode: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        rows = parts([at.row(one, mode, i) for one in at.every])
        return rows, at.field(mode), at.rates


def parts(every: Sequence[FloatArray]) -> FloatArray:
    """Numbers, and their derivatives, which the imaginary parts of others carry."""
    return np.array([every[0], *(np.imag(one) / STEP for one in every[1:])])


class Packed:
    """A system at one parameter point, as the kernels read it."""

    def __init__(
        self, patterns: Patterns, traced: Traced, values: FloatArray, places: tuple[int, ...], last: Packed | None
    ) -> None:
        self.patterns, self.traced, self.values, self.places = patterns, traced, values, places
        self.every = [patterns.rows_at(values, place) for place in (None, *places)]
        self.n = self.every[0].n
        rates = [self.every[0].rates, *(one.rates.imag / STEP for one in self.every[1:])]
        self.rates = np.array(rates).reshape(1 + len(places), -1)
        self.wanted: set[int] = set() if last is None else set(last.wanted)
        self.watched: set[int] = set()
        self.fields: dict[int, FloatArray] = {}
        self.jumps: dict[int, tuple[FloatArray, FloatArray]] = {}
        self.q = NONE

    def field(self, mode: int) -> FloatArray:
        """The field of a mode, and its derivatives."""
        if mode not in self.fields:
            pattern = self.patterns.visited[mode]
            self.fields[mode] = parts([one.flow(self.patterns.mode, pattern)[0] for one in self.every])
        return self.fields[mode]

    def of_jump(self, k: int, t: float, z: FloatArray) -> FloatArray:
        """The numbers of a transition and of the modes beside it; those of an impact that rubs are of the instant."""
        jump, change = self.traced.transitions[k], self.patterns.changes[k]
        if k not in self.jumps or (change is not None and change.rubs):
            rows = [np.array([self.row(one, jump.source, row.indicator) for row in jump.rows]) for one in self.every]
            self.jumps[k] = parts(rows).reshape(len(self.every), -1), self._map(k, t, z)
        return self._array({jump.source, jump.target}, (), (k,))

    def array(self, modes: Any, watched: bool = False) -> FloatArray:
        """All numbers of some modes, with all their conditions where they are ``watched``, and of those asked for
        before."""
        some = set(map(int, modes))
        if not len(self.q) or not some <= self.wanted or (watched and not some <= self.watched):
            self.wanted |= some
            self.watched |= some if watched else set()
            self.q = self._array(self.wanted, self.watched, ())
        return self.q

    def _map(self, k: int, t: float, z: FloatArray) -> FloatArray:
        """The map of a transition, and its derivatives in the active parameters."""
        mode, change = self.traced.transitions[k].source, self.patterns.changes[k]
        if change is None or not change.rubs:
            return parts([self._states(one, mode, change) for one in self.every])
        w, maps = self.every[0].augmented(z, t), []
        for place in self.places:
            by = OFF * max(abs(self.values[place]), OFF)
            sides = []
            for side in (by, -by):
                values = self.values.copy()
                values[place] += side
                sides.append(self._rubbed(self.patterns.rows_at(values), mode, change, w))
            maps.append((sides[0] - sides[1]) / (2 * by))
        return np.array([self._rubbed(self.every[0], mode, change, w), *maps])

    def row(self, rows: Rows, mode: int, slot: int) -> FloatArray:
        """One condition in a mode; those of forces that several share are told by the first of them."""
        pattern, owner = self.patterns.visited[mode], self.patterns.owners[slot]
        for k in (owner, *range(len(rows.parts))):
            if slot in (found := self.patterns.ways_of(rows, pattern, k)[1]):
                return found[slot]
        return np.full(rows.field.shape[1], np.nan, dtype=rows.field.dtype)

    def _states(self, rows: Rows, mode: int, change: Reset | None) -> FloatArray:
        """The map of the states by a transition, but for an impact that rubs."""
        if change is None:
            return rows.identity()
        if change.way < 0:
            found: FloatArray = rows.impact(change.elements, self.patterns.mode)
            return found
        (k,), pattern = change.elements, self.patterns.visited[mode]
        states: FloatArray = self.patterns.ways_of(rows, pattern, k)[0][change.way].leaving.states
        return states

    def _rubbed(self, rows: Rows, mode: int, change: Reset, w: FloatArray) -> FloatArray:
        """The map of an impact that rubs at an instant: its impulses are homogeneous functions of the rates."""
        numbers = RowNumbers(rows, self.patterns.mode, w.copy())
        concerned = rows.with_group_of(max(change.elements[0], ~change.elements[0]))
        found = decide(numbers, self.patterns.visited[mode], change.elements, concerned).rubbed
        return rows.identity() if found is None else rows.rubbed(*found)

    def _array(self, modes: Iterable[int], watched: Iterable[int], taken: Iterable[int]) -> FloatArray:
        count, width = len(self.traced.mode_names), self.n + 1 + 2 * self.rates.shape[1]
        sizes = [self.n, self.rates.shape[1], len(self.places), len(self.patterns.slots), count, self.n * width]
        places = np.full(2 * count + len(self.traced.transitions), -1.0)
        place = SIZES + self.rates.size + len(places)
        blocks: list[FloatArray] = []

        def put(k: int, *some: FloatArray) -> None:
            nonlocal place
            places[k] = place
            blocks.extend(some)
            place += sum(map(len, some))

        for mode in sorted(modes):
            put(mode, self.field(mode).ravel())
        for mode in sorted(watched):
            put(count + mode, self.patterns.ways_out(self.every[0], self.patterns.visited[mode])[0].ravel())
        for k in taken:
            rows, maps = self.jumps[k]
            number = rows.shape[1] // width
            at = place + 4 + number
            begin = [number, rows.shape[1], self.n * width, at + rows.size, *(at + width * np.arange(number))]
            put(2 * count + k, np.array(begin, dtype=float), rows.ravel(), maps.ravel())
        return np.concatenate([np.array(sizes, dtype=float), self.rates.ravel(), places, *blocks])


@lru_cache(maxsize=32)
def pattern_flow(patterns: Patterns, names: tuple[str, ...], scale: tuple[float, ...]) -> PatternFlow:
    """The flow of a system's patterns; made once for the same names."""
    return PatternFlow(patterns, names, np.array(scale))
