"""The variational flow of systems whose modes are made when they are visited: rows of numbers in place of formulas.

The rows of a mode and of a transition at given parameters, with their derivatives in the active ones (by the same
algebra, :meth:`nonsmooth.system.derived.patterns.Patterns.rows_at`), are packed into one array, which the kernels read
as the constants of a model (:mod:`nonsmooth.kernels.tangent.rows`): nothing is compiled for such a system.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.flow.saltation import Touch
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.system.derived.deciding import decide
from nonsmooth.system.derived.instants import RowNumbers
from nonsmooth.system.derived.patterns import STEP, Change, Patterns, Row, Rows

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced

__all__ = ["PatternFlow", "pattern_flow"]

NONE = np.zeros(0)
OFF = 1e-5  # of a parameter, for the differences by which an impact with friction depends on it
KEPT = 4  # parameter points whose rows are kept by a thread


class PatternFlow(VariationalFlow):
    """Segments and jumps of the modes and transitions that were visited so far."""

    def __init__(self, patterns: Patterns, active: tuple[str, ...], scale: FloatArray) -> None:
        self.patterns = patterns
        super().__init__(patterns.seen(), active, scale)

    def known(self) -> Traced:
        return self.patterns.seen()

    def path(self) -> tuple[Any, int]:
        return self.model.path, self.model.n_scratch

    def _compiled(self) -> tuple[Any, Sequence[int]]:
        return _model(self.n_u, len(self.patterns.form.multiples), len(self.traced.mode_names)), range(
            len(self.traced.transitions)
        )

    def on_path(self, values: FloatArray, modes: Any) -> FloatArray:
        return self._packed(values).array(modes, watched=True)

    def _ready(self, values: FloatArray, modes: Any) -> tuple[FloatArray, Any]:
        return NONE, self.scratch()._replace(q=self._packed(values).array(modes))

    def _ready_to_jump(self, values: FloatArray, k: int, t: float, z: FloatArray) -> tuple[FloatArray, Any]:
        return NONE, self.scratch()._replace(q=self._packed(values).of_jump(k, t, z))

    def _packed(self, values: FloatArray) -> Packed:
        kept = self._local.__dict__.setdefault("packed", {})
        key = np.asarray(values).tobytes()
        if key not in kept:
            last = next(reversed(kept.values()), None)
            while len(kept) >= KEPT:
                del kept[next(iter(kept))]
            kept[key] = Packed(self.patterns, self.traced, np.array(values), self.places, last)
        found: Packed = kept[key]
        return found

    def indicator(self, values: Any, i: int, mode: int, t: float, z: Any) -> Touch:
        packed = self._packed(values)
        every = packed.every
        rows = [every[0].row(mode, i), *(one.row(mode, i) for one in every[1:])]
        slopes = [one.rows.along(row, one.flow(mode)) for one, row in zip(every, rows, strict=True)]
        own, at = every[0], packed.at(t, z)
        second = own.rows.along(slopes[0], own.flow(mode))
        return Touch(*at.taken(rows), *at.taken(slopes), float(second.values @ at.w))


@dataclass
class Calculus:
    """Rows at one parameter point, of which those that were looked at are kept."""

    patterns: Patterns
    rows: Rows
    fields: dict[int, FloatArray] = field(default_factory=dict)
    conditions: dict[tuple[int, int], dict[int, FloatArray]] = field(default_factory=dict)

    def flow(self, mode: int) -> FloatArray:
        """The field of a mode."""
        if mode not in self.fields:
            self.fields[mode] = self.rows.flow(self.patterns.mode, self.patterns.visited[mode])[0]
            self.rows.forget()
        return self.fields[mode]

    def of_element(self, mode: int, k: int) -> dict[int, FloatArray]:
        """The conditions of an element in a mode."""
        if (mode, k) not in self.conditions:
            self.conditions[mode, k] = self.patterns.ways_of(self.rows, self.patterns.visited[mode], k)[1]
            self.rows.forget()
        return self.conditions[mode, k]

    def row(self, mode: int, slot: int) -> Row:
        """One condition in a mode; those of forces that several share are told by the first of them."""
        owner = self.patterns.owners[slot]
        for k in (owner, *range(len(self.rows.parts))):
            if slot in (found := self.of_element(mode, k)):
                return Row(found[slot], self.rows.n)
        return Row(np.full(self.rows.field.shape[1], np.nan, dtype=self.rows.field.dtype), self.rows.n)

    def watched(self, mode: int) -> FloatArray:
        """All conditions of a mode."""
        every = np.zeros((len(self.patterns.slots), self.rows.field.shape[1]))
        every[:, self.rows.n] = np.nan
        for k in range(len(self.rows.parts)):
            for slot, values in self.of_element(mode, k).items():
                every[slot] = values
        return every

    def map(self, mode: int, change: Change | None) -> FloatArray:
        """What a transition does to the states, but for an impact that rubs."""
        if change is None:
            return self.rows.identity()
        if change.way < 0:
            found: FloatArray = self.rows.impact(change.elements, self.patterns.mode)
            return found
        k, pattern = change.elements[0], self.patterns.visited[mode]
        states: FloatArray = self.rows.leaving(k, self.patterns.mode, pattern)[change.way].states
        self.rows.forget()
        return states

    def rubbed(self, mode: int, change: Change, w: FloatArray) -> FloatArray:
        """What an impact that rubs does to the states: its impulses are homogeneous functions of the rates."""
        numbers = RowNumbers(self.rows, self.patterns.mode, w.copy())
        found = decide(numbers, self.patterns.visited[mode], change.elements).rubbed
        if found is None:
            return self.rows.identity()
        some, slopes = found
        ways = np.array([self.rows.parts[k].direction for k in some]).T
        rates = np.array([self.rows.rate(k, self.patterns.mode).values for k in some])
        moved: FloatArray = self.rows.identity() + ways @ slopes @ rates
        return moved


@dataclass
class At:
    """The vector w of rows at an instant, and its derivatives in time and in the active parameters."""

    n: int
    w: FloatArray
    w_t: FloatArray
    w_p: list[FloatArray]

    def taken(self, rows: list[Row]) -> tuple[float, FloatArray, float, FloatArray]:
        """Value and derivatives (states, time, parameters) of a row; behind it those with its derivatives."""
        row, *derived = (one.values for one in rows)
        of_p = [d.imag / STEP @ self.w + row @ w_p for d, w_p in zip(derived, self.w_p, strict=True)]
        return float(row @ self.w), row[: self.n].copy(), float(row @ self.w_t), np.array(of_p)


class Packed:
    """A system at one parameter point, as the kernels read it."""

    def __init__(
        self, patterns: Patterns, traced: Traced, values: FloatArray, places: tuple[int, ...], last: Packed | None
    ) -> None:
        self.patterns, self.traced, self.values, self.places = patterns, traced, values, places
        self.every = [Calculus(patterns, patterns.rows_at(values, place)) for place in (None, *places)]
        self.n = self.every[0].rows.n
        rates = [self.every[0].rows.rates, *(one.rows.rates.imag / STEP for one in self.every[1:])]
        self.rates = np.array(rates).reshape(1 + len(places), -1)
        self.wanted: set[int] = set() if last is None else set(last.wanted)
        self.watched: set[int] = set()
        self.jumps: dict[int, FloatArray] = {}
        self.q = NONE

    def of_jump(self, k: int, t: float, z: FloatArray) -> FloatArray:
        """The numbers of a transition and of the modes beside it; those of an impact that rubs are of the instant."""
        jump, change = self.traced.transitions[k], self.patterns.changes[k]
        if k not in self.jumps or (change is not None and change.rubs):
            conditions = [[one.row(jump.source, row.indicator).values for row in jump.rows] for one in self.every]
            shown = np.array([conditions[0], *(np.imag(of_p) / STEP for of_p in conditions[1:])])
            self.jumps[k] = np.concatenate([[len(jump.rows)], self._map(k, t, z).ravel(), np.real(shown).ravel()])
        return self._array({jump.source, jump.target}, (), (k,))

    def at(self, t: float, z: FloatArray) -> At:
        """The vector of rows at an instant."""
        n, rates = self.n, self.rates[0]
        w = self.every[0].rows.augmented(np.asarray(z, dtype=float)[:n], t)

        def turned(speeds: FloatArray) -> FloatArray:
            found = np.zeros_like(w)
            found[n + 1 :: 2], found[n + 2 :: 2] = -speeds * w[n + 2 :: 2], speeds * w[n + 1 :: 2]
            return found

        return At(n, w, turned(rates), [turned(t * of_p) for of_p in self.rates[1:]])

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
            maps = [one.map(mode, change) for one in self.every]
            return np.array([maps[0], *(np.imag(one) / STEP for one in maps[1:])])
        w, maps = self.at(t, z).w, []
        for place in self.places:
            by = OFF * max(abs(self.values[place]), OFF)
            sides = []
            for side in (by, -by):
                values = self.values.copy()
                values[place] += side
                sides.append(Calculus(self.patterns, self.patterns.rows_at(values)).rubbed(mode, change, w))
            maps.append((sides[0] - sides[1]) / (2 * by))
        return np.array([self.every[0].rubbed(mode, change, w), *maps])

    def _array(self, modes: Iterable[int], watched: Iterable[int], taken: Iterable[int]) -> FloatArray:
        count, jumps = len(self.traced.mode_names), len(self.traced.transitions)
        sizes = [self.n, self.rates.shape[1], len(self.places), len(self.patterns.slots), count]
        place = len(sizes) + self.rates.size + 2 * count + jumps
        places = np.full(2 * count, -1.0), np.full(jumps, -1.0)
        blocks: list[FloatArray] = []

        def put(kind: int, k: int, *some: FloatArray) -> None:
            nonlocal place
            places[kind][k] = place
            blocks.extend(some)
            place += sum(map(len, some))

        for mode in sorted(modes):
            own, *of_p = (one.flow(mode) for one in self.every)
            put(0, mode, own.ravel(), *((one.imag / STEP).ravel() for one in of_p))
        for mode in sorted(watched):
            put(0, count + mode, self.every[0].watched(mode).ravel())
        for k in taken:
            put(1, k, self.jumps[k])
        return np.concatenate([np.array(sizes, dtype=float), self.rates.ravel(), *places, *blocks])


@dataclass(frozen=True)
class RowsModel:
    """The functions of ``kernels.tangent.rows``, as those of a model (``codegen.variations.VariationalModel``)."""

    jet: Any
    field: Any
    switch: Any
    path: Any
    entries: Any
    kinds: Any
    n_scratch: int


def _model(n: int, harmonics: int, modes: int) -> RowsModel:
    from nonsmooth.kernels.compile.cache import compiled
    from nonsmooth.kernels.tangent import rows

    jet, field, switch, path = map(compiled, (rows.jet, rows.field, rows.switch, rows.path))
    entries = np.repeat(np.arange(n, dtype=np.int64)[:, None], 2, axis=1)
    return RowsModel(
        jet, field, switch, path, entries, np.ones((modes, n), dtype=np.int64), max(1, 2 * harmonics)
    )


@lru_cache(maxsize=32)
def pattern_flow(patterns: Patterns, names: tuple[str, ...], scale: tuple[float, ...]) -> PatternFlow:
    """The flow of a system's patterns; made once for the same names."""
    return PatternFlow(patterns, names, np.array(scale))
