"""The variational flow of systems whose modes are linear or made when visited: rows of numbers in place of formulas.

The rows of modes, conditions and transitions over w = (u, memory, 1, cos k_1 w t, sin k_1 w t, ...), with their
derivatives in the active parameters, stand in one array, which the kernels read as the constants of a model
(:mod:`nonsmooth.kernels.tangent.rows`): nothing is compiled for such a system.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.flow.saltation import Touch
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.system.codegen.linear import apart, linear_form
from nonsmooth.system.codegen.variations import VariationalModel
from nonsmooth.system.derived.deciding import decide
from nonsmooth.system.derived.instants import RowNumbers
from nonsmooth.system.derived.leads import Reset
from nonsmooth.system.derived.patterns import STEP, Patterns
from nonsmooth.system.derived.rows import Rows

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced


NONE = np.zeros(0)
KEPT = 4  # parameter points whose rows are kept by a thread
SIZES = 6  # numbers at the head


class RowsFlow(VariationalFlow):
    """Segments and jumps by rows of numbers."""

    harmonics: int

    @abstractmethod
    def _at(self, values: FloatArray) -> Any:
        """The rows at parameters."""

    @abstractmethod
    def _taken(self, at: Any, i: int, mode: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Of a condition in a mode, of the mode's field and of the harmonics' rates: the rows, and in the order of the
        active parameters their derivatives: (1 + n_active, M), (1 + n_active, n, M), (1 + n_active, harmonics)."""

    def _compiled(self) -> tuple[Any, Sequence[int]]:
        from nonsmooth.kernels.compile.cache import compiled
        from nonsmooth.kernels.tangent import rows

        n, modes = self.n, len(self.traced.mode_names)
        jet, field, switch, path = map(compiled, (rows.jet, rows.field, rows.switch, rows.path))
        entries = np.repeat(np.arange(n, dtype=np.int64)[:, None], 2, axis=1)  # the diagonal, of which the sum is asked
        kinds = np.ones((modes, n), dtype=np.int64)
        n_scratch = 2 * self.harmonics + max(1, self.n_active)
        model = VariationalModel(jet, field, switch, entries, kinds, n_scratch, path)
        return model, range(len(self.traced.transitions))

    @property
    def n_moving(self) -> int:
        return self.n

    def path(self) -> tuple[Any, int]:
        return self.model.path, self.model.n_scratch

    def kept(self, values: FloatArray) -> Any:
        """The rows at parameters: those of the last few are kept."""
        return self._known(values)[0]

    def _known(self, values: FloatArray) -> tuple[Any, dict[tuple[int, int], Any]]:
        """The rows at parameters, and what is known of conditions in modes there."""
        kept = self._local.__dict__.setdefault("rows", {})
        key = np.asarray(values, dtype=float).tobytes()
        if key not in kept:
            found = self._at(np.array(values, dtype=float))
            while len(kept) >= KEPT:
                del kept[next(iter(kept))]
            kept[key] = found, {}
        known: tuple[Any, dict[tuple[int, int], Any]] = kept[key]
        return known

    def indicator(self, values: Any, i: int, mode: int, t: float, z: Any) -> Touch:
        found: list[Any] = []
        for h, h_z, h_t, h_p in zip(*self._of_points(values, i, mode, np.array([t]), np.array([z])), strict=True):
            found += [float(h[0]), h_z.copy(), float(h_t[0]), h_p[0]]
        return Touch(*found)

    def rates(self, values: Any, i: int, mode: int, order: int, t: FloatArray, z: FloatArray) -> tuple[FloatArray, ...]:
        h, h_z, h_t, h_p = (one[order] for one in self._of_points(values, i, mode, t, z))
        return h, np.broadcast_to(h_z, z.shape), h_t, h_p

    def _of_points(self, values: Any, i: int, mode: int, t: FloatArray, z: FloatArray) -> tuple[FloatArray, ...]:
        """A condition and its two derivatives along a mode's flow at some points: their values (3, points), gradients
        (3, n) at all of them, derivatives in time (3, points) and in the active parameters (3, points, n_active)."""
        at, known = self._known(values)
        if (i, mode) not in known:
            known[i, mode] = self._along(*self._taken(at, i, mode))
        every, turning, rates = known[i, mode]
        n, angles = self.n, np.multiply.outer(t, rates)
        w = np.ones((len(t), every.shape[-1]))
        w[:, :n], w[:, n + 1 :: 2], w[:, n + 2 :: 2] = z, np.cos(angles), np.sin(angles)
        own, changing = every @ w.T, turning @ w.T
        slopes = own[:, 1:] + t * changing[:, 1:]
        return own[:, 0], every[:, 0, :n], changing[:, 0], slopes.swapaxes(1, 2)

    def _along(self, rows: FloatArray, fields: FloatArray, rates: FloatArray) -> tuple[FloatArray, ...]:
        """The rows of a condition and of its two derivatives along the flow, and those derivatives in the active
        parameters, (3, 1 + n_active, M); how they change as the harmonics turn; the rates of these."""
        n, orders = self.n, [rows]

        def turned(row: FloatArray, speeds: FloatArray) -> FloatArray:
            """The row of the change of a row whose harmonics turn; of each row, or at each of several speeds."""
            found = np.zeros((*(row.shape if row.ndim > 1 else speeds.shape)[:-1], row.shape[-1]))
            found[..., n + 1 :: 2] = speeds * row[..., n + 2 :: 2]
            found[..., n + 2 :: 2] = -speeds * row[..., n + 1 :: 2]
            return found

        for _ in range(2):
            last = orders[-1]
            slopes = last[:, :n] @ fields[0] + turned(last, rates[0])
            slopes[1:] += last[0, :n] @ fields[1:] + turned(last[0], rates[1:])
            orders.append(slopes)
        return np.array(orders), np.array([turned(one[0], rates) for one in orders]), rates[0]


class LinearFlow(RowsFlow):
    """The flow of a system whose modes, indicators and resets are affine, by its linear form.

    In its array the fields of all modes stand behind each other, then their derivatives in each parameter; so do the
    conditions and the maps of all transitions."""

    def _take(self, traced: Traced) -> None:
        plain, stands = traced.without_answers()
        form = linear_form(plain)  # that of the exact flow
        assert form is not None
        self.form, self.harmonics = form, len(form.multiples)
        self._lay_out(traced, stands, len(plain.transitions))
        super()._take(traced)

    def _lay_out(self, t: Traced, stands: Sequence[int], maps: int) -> None:
        """Make the array without its numbers, and find what stands where; ``stands``: the map of each transition."""
        n, h, a = self.n, self.harmonics, self.n_active
        modes, jumps, conditions, width = len(t.mode_names), len(t.transitions), len(t.indicators), n + 1 + 2 * h
        sizes = modes * n * width, conditions * width, maps * n * width
        places, head = np.zeros(2 * modes + jumps), SIZES + h * (1 + a)
        fields = head + len(places)
        self.begin = fields, fields + (1 + a) * sizes[0], fields + (1 + a) * (sizes[0] + sizes[1])
        self.sizes, at = sizes, fields + (1 + a) * sum(sizes)
        places[:modes] = fields + np.arange(modes) * n * width
        places[modes : 2 * modes] = self.begin[1]
        self.sliding = [mode for mode, kept in enumerate(t.along) if kept]  # along surfaces, which say nothing there
        for mode in self.sliding:
            places[modes + mode], at = at, at + sizes[1]
        lists: list[float] = []
        self.gone = np.zeros((maps, n), dtype=bool)  # states that the mode behind has not
        for k, (jump, own) in enumerate(zip(t.transitions, stands, strict=True)):
            places[2 * modes + k] = at + len(lists)
            rows = [self.begin[1] + row.indicator * width for row in jump.rows]
            lists += [len(rows), sizes[1], sizes[2], self.begin[2] + own * n * width, *rows]
            self.gone[own, : self.n_u] = t.lacking[jump.target]
        self.empty = np.concatenate([np.zeros(head), places, np.zeros(at - fields), lists])
        self.empty[:SIZES] = n, h, a, conditions, modes, sizes[0]

    def _views(self, q: FloatArray, d: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Fields, conditions and maps in the array, or their derivatives in a parameter."""
        width = self.n + 1 + 2 * self.harmonics
        fields, conditions, maps = (
            q[at + d * size : at + (d + 1) * size] for at, size in zip(self.begin, self.sizes, strict=True)
        )
        return fields.reshape(-1, self.n, width), conditions.reshape(-1, width), maps.reshape(-1, self.n, width)

    def _buffer(self) -> tuple[FloatArray, list[dict[str, FloatArray]]]:
        """The thread's array, and the tables of the linear form in it: its entries, their derivatives."""
        found: tuple[FloatArray, list[dict[str, FloatArray]]] | None = getattr(self._local, "buffer", None)
        if found is None:
            q, n, tables = self.empty.copy(), self.n, []
            for d in range(1 + self.n_active):
                fields, conditions, maps = self._views(q, d)
                tables.append(
                    {
                        "omega": np.zeros(1),
                        **_tables("Abcs", fields, n),
                        **_tables(("ra", "rb", "rc", "rs"), maps, n),
                        **dict(zip(("ia", "ib", "ic", "is_"), apart(conditions[None], n), strict=True)),
                    }
                )
            found = self._local.buffer = q, tables
        return found

    def _at(self, values: FloatArray) -> FloatArray:
        again = hasattr(self._local, "buffer")
        (q, tables), h = self._buffer(), self.harmonics
        for d, (place, into) in enumerate(zip((None, *self.places), tables, strict=True)):
            self.form.fill(values, place, into, again)
            if h:
                q[SIZES + d * h : SIZES + (d + 1) * h] = into["omega"] * self.form.multiples
            if self.gone.any():
                self._views(q, d)[2][self.gone] = 0.0
        for mode in self.sliding:
            at = int(q[SIZES + h * (1 + self.n_active) + len(self.traced.mode_names) + mode])
            watched = q[at : at + self.sizes[1]].reshape(-1, self.n + 1 + 2 * h)
            watched[:] = self._views(q, 0)[1]
            watched[list(self.traced.along[mode])] = 0.0
        return q.copy()

    def on_path(self, values: FloatArray, modes: Any) -> FloatArray:
        found: FloatArray = self.kept(values)
        return found

    def _ready(
        self, values: FloatArray, modes: Any = (), jump: tuple[int, float, FloatArray] | None = None
    ) -> tuple[FloatArray, Any]:
        return NONE, self.scratch()._replace(q=self.kept(values))

    def _taken(self, at: FloatArray, i: int, mode: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        every = [self._views(at, d) for d in range(1 + self.n_active)]
        rates = at[SIZES : SIZES + self.harmonics * (1 + self.n_active)].reshape(1 + self.n_active, -1)
        return np.array([one[1][i] for one in every]), np.array([one[0][mode] for one in every]), rates


def _tables(names: Sequence[str], rows: FloatArray, n: int) -> dict[str, FloatArray]:
    """Views on rows (..., n, M) as tables of a linear form, with a leading dim and the harmonics before the rows."""
    states, constants, *waves = apart(rows[None], n)
    return dict(zip(names, (states, constants, *(np.swapaxes(one, -1, -2) for one in waves)), strict=True))


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
        last, _ = next(reversed(self._local.rows.values()), (None, None))
        return Packed(self.patterns, self.traced, values, self.places, last)

    def on_path(self, values: FloatArray, modes: Any) -> FloatArray:
        found: FloatArray = self.kept(values).array(modes, watched=True)
        return found

    def _ready(
        self, values: FloatArray, modes: Any = (), jump: tuple[int, float, FloatArray] | None = None
    ) -> tuple[FloatArray, Any]:
        kept = self.kept(values)
        return NONE, self.scratch()._replace(q=kept.array(modes) if jump is None else kept.of_jump(*jump))

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
        concerned = rows.with_group_of(max(change.elements[0], ~change.elements[0]), self.patterns.mode)
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
