"""The vector field of one mode as functions of numbers, from expressions or from rows of numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from itertools import product
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.system.derived.patterns import STEP
from nonsmooth.system.symbolic.numeric import numeric

if TYPE_CHECKING:
    from nonsmooth.system.derived.rows import Rows
    from nonsmooth.system.symbolic.traced import Traced

MOST = 4096  # modes that are made so that all of them can be looked at


class ModeField:
    """The vector field of one mode and the indicators, with their derivatives, as functions of numbers.

    ``own`` are the mode's states, others stay zero; ``places`` the parameters in which derivatives are wanted."""

    def __init__(self, traced: Traced, mode: int, places: Sequence[int] = ()) -> None:
        self.traced, self.mode, self.places = traced, mode, tuple(places)
        self.own = [i for i in range(len(traced.u)) if not traced.lacking[mode][i]]
        self._f, self._u = (tuple(some[i] for i in self.own) for some in (traced.fields[mode], traced.u))

    @cached_property
    def _formulas(self) -> Callable[..., FloatArray]:
        return numeric(self.traced, self._f, (*self._u, *(self.traced.p[k] for k in self.places)))

    @cached_property
    def linear(self) -> bool:
        """Return whether the field is linear in the states."""
        return not any(e.diff(s).free_symbols & {*self.traced.u} for e in self._f for s in self._u)

    @cached_property
    def affine(self) -> bool:
        """Return whether the indicators are affine too."""
        u = self.traced.u
        return self.linear and not any(e.diff(s).free_symbols & {*u} for e in self.traced.indicators for s in u)

    def evaluate(
        self, u: FloatArray, values: FloatArray, memory: FloatArray, t: Any = 0.0
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """f (n,), its Jacobian (n, n) and its derivatives in the parameters (n, n_places), of the mode's own states; at
        several times each with a leading dim."""
        found, n = self._formulas(values, t, u, memory), 1 + len(self.own)
        return found[..., 0], found[..., 1:n], found[..., n:]

    def indicators(
        self, u: FloatArray, values: FloatArray, memory: FloatArray, t: Any = 0.0
    ) -> tuple[FloatArray, FloatArray]:
        """Indicators (n_indicators,) and their gradients (n_indicators, n_u); at several times with a leading dim."""
        found = numeric(self.traced, self.traced.indicators, self.traced.u)(values, t, u, memory)
        return found[..., 0], found[..., 1:]

    def margins(self, h: FloatArray, edge: FloatArray | float = 0.0) -> FloatArray:
        """Margins by which conditions of transitions hold (n_transitions,), -inf for those that are not of the mode.

        Rows nearer to zero than ``edge`` hold where another one of their condition does: a speed and an acceleration
        vanish at every equilibrium, and what lies behind a stop is none."""
        h = np.where(np.abs(h) <= edge, 0.0, h)
        found = np.full(len(self.traced.transitions), -np.inf)
        for k, jump in enumerate(self.traced.transitions):
            if jump.source == self.mode and jump.rows and jump.fires:
                rows = [row.sign * float(h[row.indicator]) for row in jump.rows]
                found[k] = min((x for x in rows if x), default=0.0)
        return found


class _Numbers(ModeField):
    """The same from rows of numbers, of a mode that is made when it is visited."""

    linear = affine = True

    def __init__(self, traced: Traced, mode: int, places: Sequence[int] = ()) -> None:
        super().__init__(traced, mode, places)
        assert traced.patterns is not None
        self.patterns, self.pattern = traced.patterns, traced.patterns.visited[mode]

    def evaluate(
        self, u: FloatArray, values: FloatArray, memory: FloatArray, t: Any = 0.0
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        field, w = self._field(values), self.patterns.rows_at(values).augmented(u, t)
        slopes = [w @ self._field(values, place).imag.T / STEP for place in self.places]
        J = np.broadcast_to(field[:, : len(u)], (*np.shape(t), len(u), len(u)))
        return w @ field.T, J, np.stack(slopes, axis=-1) if slopes else np.zeros((*np.shape(t), len(u), 0))

    def indicators(
        self, u: FloatArray, values: FloatArray, memory: FloatArray, t: Any = 0.0
    ) -> tuple[FloatArray, FloatArray]:
        here = self.patterns.rows_at(values)
        rows = np.nan_to_num(self.patterns.ways_out(here, self.pattern)[0])  # NaN: not asked for
        slopes = np.broadcast_to(rows[:, : len(u)], (*np.shape(t), len(rows), len(u)))
        return here.augmented(u, t) @ rows.T, slopes

    def _field(self, values: FloatArray, place: int | None = None) -> FloatArray:
        return self.patterns.rows_at(values, place).flow(self.patterns.mode, self.pattern)[0]


@lru_cache(maxsize=256)
def mode_field(traced: Traced, mode: int, places: tuple[int, ...] = ()) -> ModeField:
    """The functions of a mode, made once."""
    return (ModeField if traced.patterns is None else _Numbers)(traced, mode, places)


def every_mode(traced: Traced, values: FloatArray) -> range | None:
    """The numbers of all modes, where those that are made when they are visited are made for it; None where they are
    more than ``MOST``."""
    if (patterns := traced.patterns) is None:
        return range(len(traced.mode_names))
    make, counts = patterns.make, [len(part.element.phases) for part in patterns.make.parts]
    if prod(counts) > MOST:
        return None
    rows = patterns.rows_at(values)
    for pattern in sorted({*product(*map(range, counts))} - patterns.led):
        if make.may_hold(make.held(pattern), patterns.mode):
            patterns.look_at(rows, pattern)
    return range(len(patterns.visited))


def held_places(traced: Traced, mode: int, values: FloatArray) -> tuple[Rows, list[FloatArray]] | None:
    """The places and rates that the held elements of a mode keep at zero, as rows; None where elements decide alone."""
    patterns = traced.patterns or (traced.decider.rows if traced.decider is not None else None)
    if patterns is None:
        return None
    pattern = patterns.visited[mode] if traced.decider is None else traced.decider.modes[mode][1]
    rows = patterns.rows_at(values)
    held = rows.held(pattern)
    return rows, [np.array([rows.parts[k].where.values, rows.rate(k, patterns.mode).values]) for k in held]
