"""The points of a chart as chunks of work, and its rows along which the state is carried.

The points of such a row must follow each other. A GPU takes the first points of all rows together, then the second
ones, and so on: it is as fast as there are rows (times starts).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from nonsmooth.attractors.basins_attractors import find_attractors
from nonsmooth.attractors.basins_found import NONE
from nonsmooth.attractors.basins_newton import STEP
from nonsmooth.attractors.settled import Settled, usable
from nonsmooth.attractors.settler import Settler
from nonsmooth.campaign.work import CHUNK, ColumnType
from nonsmooth.flow.engines.engine import FloatArray, IntArray
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.judging.judge import ALONG

SIDE_BY_SIDE = 1 << 21  # places of one chunk of carried rows on a GPU, at most: a gigabyte while it is computed
SAME = 1e-6  # extremes that agree to this part of the motion's size belong to one attractor
POINT = 1e-5  # and section points that agree to this part


@dataclass(frozen=True)
class ChartWork:
    """Points of a plane of two parameters, in rows along the second one (``carried``: runs go along these rows).

    Parameters
    ----------
    grid : mapping
        The two parameters' values, the rows' one last, in the order in which a carried state meets them.
    where : array of int, optional
        Flat places in the plane, where not all are wanted.
    lyapunov : int
        Returns over which the exponent is measured; 0: not wanted.
    loads : tuple of str
        Names of the loads of elements, where they are wanted.
    modes : array (S,)
        Modes at the starts (``Settler.told``).
    """

    settler: Settler
    grid: Mapping[str, FloatArray]
    starts: FloatArray  # (S, n + memory)
    modes: Any
    carried: bool = False
    lyapunov: int = 0
    loads: tuple[str, ...] = ()
    where: IntArray | None = None
    chunk: int = CHUNK
    described: Mapping[str, Any] = field(default_factory=dict)

    @property
    def _shape(self) -> tuple[int, int]:
        first, second = (len(values) for values in self.grid.values())
        return first, second

    @property
    def _size(self) -> int:
        first, second = self._shape
        return first * second if self.where is None else len(self.where)

    @property
    def _step(self) -> int:
        row = self._shape[1]
        least = max(1, self.chunk // len(self.starts))
        if self.carried:  # whole rows; on a GPU many, side by side
            return (min(least, max(1, SIDE_BY_SIDE // row)) if self.device == "cuda" else -(-least // row)) * row
        return least

    @property
    def device(self) -> str:
        return self.settler.device

    def columns(self) -> dict[str, ColumnType]:
        many = () if len(self.starts) == 1 else (len(self.starts),)
        n = len(self.settler.system.states)
        found = {
            "period_number": ColumnType("i2", many),
            "status": ColumnType("i1", many, codes.INTERRUPTED),
            "crossings_per_period": ColumnType("f8", many),
            "contacts_per_period": ColumnType("f8", many),
        }
        if self.settler.extremes:
            found |= {"maximum": ColumnType("f8", (*many, n)), "minimum": ColumnType("f8", (*many, n))}
        if self.lyapunov:
            found |= {"lyapunov": ColumnType("f8", many), "lyapunov_error": ColumnType("f8", many)}
        found |= {name: ColumnType("f8", many) for name in self.loads}
        if many:
            found["n_attractors"] = ColumnType("i2")
        return found

    def n_chunks(self) -> int:
        return -(-self._size // self._step)

    def bounds(self, chunk: int) -> tuple[int, int]:
        return chunk * self._step, min((chunk + 1) * self._step, self._size)

    def describe(self) -> dict[str, Any]:
        return dict(self.described)

    def load(self) -> None:
        self.settler.load()

    def compute(self, chunk: int) -> dict[str, Any]:
        """Every run of the places of one chunk."""
        first, last = self.bounds(chunk)
        places = np.arange(first, last) if self.where is None else self.where[first:last]
        row, column = np.divmod(places, self._shape[1])
        (a, values_a), (b, values_b) = self.grid.items()
        points = self.settler.system.parameter_points({a: values_a[row], b: values_b[column]})
        n_places, n_starts = len(places), len(self.starts)
        rows = np.repeat(np.arange(n_places), n_starts)
        modes = self.settler.retold(self.modes)
        if self.carried:
            found = along_rows(self.settler, points, self._shape[1], self.starts, modes)
        else:
            found = self.settler.run(points, rows, np.tile(self.starts, (n_places, 1)), modes=np.tile(modes, n_places))
        arrays = {
            "period_number": found.period_number,
            "status": found.status,
            "crossings_per_period": found.crossings,
            "contacts_per_period": found.contacts,
            "maximum": found.maximum,
            "minimum": found.minimum,
        }
        if self.loads:
            arrays |= self.settler.loads(points, rows, found)
        if self.lyapunov:
            good = np.flatnonzero(usable(found.status))
            exponent, error = np.full(len(found.status), np.nan), np.full(len(found.status), np.nan)
            exponent[good], error[good] = self.settler.exponents(
                points,
                rows[good],
                found.last[good],
                found.mode[good],
                self.lyapunov,
                found.maximum[good],
                found.minimum[good],
            )
            arrays |= {"lyapunov": exponent, "lyapunov_error": error}
        kept = {
            name: arrays[name].reshape(n_places, *item.shape) for name, item in self.columns().items() if name in arrays
        }
        if n_starts > 1:
            kept["n_attractors"] = attractors_among(found, n_places, n_starts, self.settler, points)
        return kept


def along_rows(settler: Settler, points: FloatArray, length: int, starts: FloatArray, modes: IntArray) -> Settled:
    """Each row of ``length`` points from each start, the state carried along it.

    Parameters
    ----------
    points : array (rows * length, n_parameters)
    starts : array (S, n + memory)
    modes : array (S,)

    Returns
    -------
    Settled
        In the order (point, start).
    """
    if settler.device == "cuda":
        return side_by_side(settler, points, length, starts, modes)
    parts = []
    for first in range(0, len(points), length):
        rows = np.arange(first, first + length)
        for start, mode in zip(starts, modes, strict=True):
            begun = np.tile(start, (length, 1))
            parts.append(settler.run(points, rows, begun, carried=True, modes=np.tile(mode, length)))
    order = np.arange(len(points) * len(starts)).reshape(-1, len(starts), length)
    return Settled.joined(parts)[order.transpose(0, 2, 1).ravel()]


def side_by_side(settler: Settler, points: FloatArray, length: int, starts: FloatArray, modes: IntArray) -> Settled:
    """The same, all rows together from point to point, by the exact flow of planar systems.

    A run goes on from where the one at the point before has ended; from its start where that one failed, or where a
    stop has moved over its state."""
    n_rows, n_starts = len(points) // length, len(starts)
    begin, own = np.tile(starts, (n_rows, 1)), np.tile(modes, n_rows)
    first = np.repeat(np.arange(n_rows) * length, n_starts)
    goes_on = np.zeros(len(first), dtype=bool)
    parts: list[Settled] = []
    for column in range(length):
        rows, found = first + column, Settled.empty(len(first), len(settler.system.states), settler.width)
        which = np.flatnonzero(goes_on)
        if len(which):
            last, mode = parts[-1].last[which], parts[-1].mode[which]
            carried = settler.run(points, rows[which], last, modes=mode, begin=settler.section_phase)
            found.put(which, carried)
            goes_on[which] = carried.status != codes.NO_CONVERGENCE  # with this flow: a start beyond a stop
        which = np.flatnonzero(~goes_on)
        if len(which):
            found.put(which, settler.run(points, rows[which], begin[which], modes=own[which]))
        parts.append(found)
        goes_on = usable(found.status)
    order = np.arange(len(points) * n_starts).reshape(length, n_rows, n_starts)
    return Settled.joined(parts)[order.transpose(1, 0, 2).ravel()]


def attractors_among(found: Settled, n_places: int, n_starts: int, settler: Settler, points: FloatArray) -> IntArray:
    """Distinct attractors among the starts of each place; what has no period is one.

    Cycles are told apart by period number and extremes, which do not depend on where in the cycle a run ended. Where
    both agree but the last section points do not, the section points of a whole cycle decide: cycles that differ by a
    shift in time have equal extremes. Cycles that are as wide, but elsewhere in what friction holds, are counted as in
    basins. What is still settling, or failed, is none.
    """
    period = found.period_number.reshape(n_places, n_starts)
    wandering = found.status.reshape(n_places, n_starts) == codes.NOT_PERIODIC
    extremes = np.stack([found.maximum, found.minimum], axis=1).reshape(n_places, n_starts, 2, -1)
    moved = extremes[:, :, 0] - extremes[:, :, 1]
    size = np.fmax(moved, settler.least_at(extremes[:, :, 0], extremes[:, :, 1]))
    n = size.shape[2]
    last, mode = found.last.reshape(n_places, n_starts, -1)[..., :n], found.mode.reshape(n_places, n_starts)
    count, held = wandering.any(axis=1).astype(np.int64), np.zeros(n_places, dtype=bool)
    every, whole = settler.plan.every, replace(settler, plan=settler.plan._replace(every=1))
    for k in range(n_starts):
        new = period[:, k] > 0
        for j in range(k):
            same = new & (period[:, j] == period[:, k])
            elsewhere: Any = (np.abs(extremes[:, k] - extremes[:, j]) > SAME * size[:, k, None]).any(axis=1)
            alike = same & ~elsewhere.any(axis=1)
            apart = np.abs(last[:, k] - last[:, j]) > POINT * size[:, k]
            apart = apart.any(axis=1) | (mode[:, k] != mode[:, j])
            as_wide = same & ~alike & ~(np.abs(moved[:, k] - moved[:, j]) > SAME * size[:, k]).any(axis=1)
            for i in np.flatnonzero(as_wide & ~held) if settler.plan.indicator < 0 else ():
                beside, off = found.last[i * n_starts + j].copy(), STEP * size[i, j]
                beside[:n] += np.where(elsewhere[i], off, 0.0)
                run = settler.trace(points[i : i + 1], beside, int(mode[i, j]), 0, int(period[i, j]))
                back = np.abs(run.points[-1:] - beside[:n]) <= ALONG * off
                held[i] = len(back) and back[0, elsewhere[i]].all()
            for i in np.flatnonzero(alike & apart):
                run = whole.trace(
                    points[i : i + 1], found.last[i * n_starts + j], int(mode[i, j]), 0, every * int(period[i, j])
                )
                at = (np.abs(run.points - last[i, k]) <= POINT * size[i, k]).all(axis=1) & (run.modes == mode[i, k])
                alike[i] = at.any() or not len(run.points)
            new &= ~alike
        count += new
    for i in np.flatnonzero(held):
        labels = find_attractors(settler, points[i : i + 1], found[i * n_starts : (i + 1) * n_starts], NONE)[1]
        count[i] = wandering[i].any() + len(set(labels[labels >= 0]))
    return count
