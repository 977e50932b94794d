"""The same chart from a fraction of its points: refined along the boundaries of its regions.

A coarse grid is computed. A cell is *mixed* where labels known in or on it differ; mixed cells are halved, down to
single points, and since a halved cell brings labels to the edges of its neighbours, these follow. Cells without a
period (chaos holds windows) are halved to a few points as well. What is left takes the label of the nearest computed
point. How often that is wrong is measured on the chart itself: points drawn at random among those inferred are
computed too, in classes by their distance from the next other label and by whether a period was found; where a probe
disagrees, its cell is mixed and refined. The confidence of an inferred label is one minus that class's rate of error.

A label is the period number with the contacts per cycle, or the status where there is no period.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.campaign.run import run
from nonsmooth.campaign.work import check_room, empty_columns
from nonsmooth.diagrams.chart_work import ChartWork
from nonsmooth.flow.engines.engine import IntArray
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.progress import Progress
from nonsmooth.system.kinds import real_number

LEAST_POINTS = 4  # computed whatever the part
LARGEST_PART = 0.25  # of the points, where no number is given
FOR_THE_GRID = 1 / 3  # of the budget, at most, for the coarse grid
FOR_PROBES = 0.06  # of the budget, for each round of probes
LARGEST_TRUSTED = 4  # in cells up to this size an edge with equal ends is not halved
FINEST_EXPLORED = 4  # cells without a period are halved to this many points
DISTANCES = (1.5, 2.5, 4.5, 8.5, np.inf)  # classes of inferred points: pixels to the next other label
UNKNOWN = -1


def labels_of_points(arrays: Mapping[str, NDArray[Any]]) -> IntArray:
    """One integer per point: equal where period number, transitions per cycle and status are equal."""
    period = np.asarray(arrays["period_number"], dtype=np.int64)
    status = np.asarray(arrays["status"], dtype=np.int64)
    crossings = np.rint(np.nan_to_num(arrays["crossings_per_period"]) * np.maximum(period, 1)).astype(np.int64)
    good = period > 0
    return np.where(good, (period * 4096 + np.clip(crossings, 0, 4095)) * 16 + status, status)


def refined(
    work: ChartWork,
    part: bool | float,
    *,
    threads: int | None,
    progress: Progress,
    label: str,
    columns: dict[str, NDArray[Any]],
) -> dict[str, NDArray[Any]]:
    """Columns over all points, with ``confidence`` and ``computed``; ``columns`` hold what was computed by then.

    Parameters
    ----------
    part : bool or float
        The largest part of the points to compute; True: a quarter.

    Raises
    ------
    ValueError, TypeError
        A part that is no number or outside 0..1, or a chart whose points are not independent: carried states, several
        starts.
    """
    share = LARGEST_PART if isinstance(part, bool | np.bool_) else real_number(part, "refine")
    if not 0.0 < share <= 1.0:
        raise ValueError(
            f"refine = {part!r}: the part of the points to compute, above 0 and at most 1; True: a quarter"
        )
    if work.carried or len(work.starts) > 1:
        raise ValueError("refine needs points that stand alone: leave carry out and give one start")
    check_room(work, label)
    columns |= empty_columns(work)
    return _Refinement(work, share, partial(run, threads=threads, progress=progress, label=label), columns).result()


def confidence_of(
    classes: tuple[NDArray[Any], NDArray[Any]],
    computed: NDArray[np.bool_],
    rates: dict[tuple[int, int], tuple[int, int]],
) -> NDArray[np.float64]:
    """The chance that a label is right: (n + 1 - errors) / (n + 2) by the probes of its class, 1 if computed.

    A class is a pair of numbers for each point; ``rates`` has (errors, n) of those that were probed. Nothing is known
    of the others: 0.5."""
    confidence = np.where(computed, 1.0, 0.5)
    for place, (errors, n) in rates.items():
        confidence[(classes[0] == place[0]) & (classes[1] == place[1]) & ~computed] = 1.0 - (errors + 1) / (n + 2)
    return confidence


class _Refinement:
    """The plane as far as it is known."""

    def __init__(
        self,
        work: ChartWork,
        share: float,
        fill: Callable[..., object],
        columns: dict[str, NDArray[Any]],
    ) -> None:
        self.work, self.fill, self.columns = work, fill, columns
        self.shape = (len(next(iter(work.grid.values()))), len(list(work.grid.values())[1]))
        size = self.shape[0] * self.shape[1]
        self.budget = max(int(share * size), min(size, LEAST_POINTS))
        self.label = np.full(self.shape, UNKNOWN, dtype=np.int64)
        self.spent = 0
        self.rng = np.random.default_rng(0)

    def result(self) -> dict[str, NDArray[Any]]:
        step = self._coarse_step()
        self._compute(np.ix_(_lines(self.shape[0], step), _lines(self.shape[1], step)))
        rates: dict[tuple[int, int], tuple[int, int]] = {}
        for _ in range(4):
            self._halve(step)
            wrong = self._probe(rates)
            if not wrong:
                break
        self._halve(step)
        nearest, classes = self._inferred()
        computed, places = self.label != UNKNOWN, np.ravel_multi_index(tuple(nearest), self.shape).ravel()
        confidence = confidence_of(classes, computed, rates)
        for name in ("period_number", "status", "crossings_per_period", "contacts_per_period"):
            self.columns[name] = self.columns[name][places]
        return {**self.columns, "confidence": confidence.ravel(), "computed": computed.ravel().astype(np.int8)}

    def _coarse_step(self) -> int:
        step = 1
        while step < min(self.shape) and len(_lines(self.shape[0], step)) * len(_lines(self.shape[1], step)) > max(
            FOR_THE_GRID * self.budget, 4
        ):
            step *= 2
        return step

    def _compute(self, where: Any) -> None:
        """Compute what is not known among the places, as far as the budget goes."""
        wanted = np.zeros(self.shape, dtype=bool)
        wanted[where] = True
        places = np.flatnonzero(wanted & (self.label == UNKNOWN))
        left = self.budget - self.spent
        if len(places) > left:
            places = np.sort(self.rng.choice(places, max(left, 0), replace=False))
        if not len(places):
            return
        found: dict[str, NDArray[Any]] = {}
        work = replace(self.work, where=places)
        try:
            self.fill(work, columns=found)
        finally:
            for name, values in found.items():
                self.columns[name][places] = values
        self.label.ravel()[places] = labels_of_points(found)
        self.spent += len(places)

    def _halve(self, step: int) -> None:
        """Halve mixed cells of every size until none is left, the largest first."""
        while self.spent < self.budget:
            before = self.spent
            size = step
            while size > 1:
                while self.spent < self.budget:
                    spent = self.spent
                    self._compute(self._points_within(size))
                    if self.spent == spent:
                        break
                size //= 2
            if self.spent == before:
                return

    def _points_within(self, size: int) -> NDArray[np.bool_]:
        """The points that halve the mixed cells of one size."""
        rows, columns = (_lines(n, size) for n in self.shape)
        known = self.label != UNKNOWN
        low = _over_cells(np.where(known, self.label, np.iinfo(np.int64).max), rows, columns, np.minimum)
        high = _over_cells(np.where(known, self.label, -1), rows, columns, np.maximum)
        split = low < high  # a cell with nothing known in it lies within a larger one of one label
        if size > FINEST_EXPLORED:
            split |= low == codes.NOT_PERIODIC
        if not split.any():
            return np.zeros(self.shape, dtype=bool)
        middle_rows, middle_columns = (lines[:-1] + np.diff(lines) // 2 for lines in (rows, columns))
        wanted = np.zeros(self.shape, dtype=bool)
        wanted[np.ix_(middle_rows, middle_columns)] = split
        # the middle of an edge only where its ends differ, or where the cell is still large
        ends = self.label[tuple(self._nearest())][np.ix_(rows, columns)] if size <= LARGEST_TRUSTED else None
        for axis, edges in ((0, np.ix_(rows, middle_columns)), (1, np.ix_(middle_rows, columns))):
            beside = _beside(split, axis)
            if ends is not None:
                beside &= np.diff(ends, axis=1 - axis) != 0
            wanted[edges] |= beside
        return wanted

    def _nearest(self) -> NDArray[Any]:
        """The nearest known point of each place."""
        from scipy.ndimage import distance_transform_edt

        found: NDArray[Any] = distance_transform_edt(self.label == UNKNOWN, return_distances=False, return_indices=True)
        return found

    def _inferred(self) -> tuple[NDArray[Any], tuple[IntArray, IntArray]]:
        """The nearest known point of each place, and the class of each: distance to the next other label, period."""
        from scipy.ndimage import distance_transform_edt

        nearest = self._nearest()
        filled = self.label[tuple(nearest)]
        edge = np.zeros(self.shape, dtype=bool)
        for axis in (0, 1):
            edge |= _beside(np.diff(filled, axis=axis) != 0, axis)
        distance = distance_transform_edt(~edge) + 1.0 if edge.any() else np.full(self.shape, np.inf)
        return nearest, (np.searchsorted(DISTANCES, distance).astype(np.int64), (filled < 16).astype(np.int64))

    def _probe(self, rates: dict[tuple[int, int], tuple[int, int]]) -> int:
        """Compute a random sample of the inferred points; count the errors per class. Returns how many were wrong."""
        nearest, (near, without) = self._inferred()
        inferred = self.label == UNKNOWN
        classes = product(range(len(DISTANCES)), range(2))
        groups = {place: np.flatnonzero((near == place[0]) & (without == place[1]) & inferred) for place in classes}
        groups = {place: among for place, among in groups.items() if len(among)}
        guess = self.label[tuple(nearest)]
        wrong = 0
        each = max(int(FOR_PROBES * self.budget / max(len(groups), 1)), 1)
        rates.clear()  # what earlier probes found wrong has been refined since
        for place, among in groups.items():
            chosen = self.rng.choice(among, min(each, len(among), max(self.budget - self.spent, 0)), replace=False)
            if not len(chosen):
                continue
            self._compute(np.unravel_index(chosen, self.shape))
            errors = int((self.label.ravel()[chosen] != guess.ravel()[chosen]).sum())
            rates[place] = (errors, len(chosen))
            wrong += errors
        return wrong


def _lines(n: int, step: int) -> IntArray:
    """Places of the grid lines of one size, the last point always among them."""
    return np.unique(np.append(np.arange(0, n, step), n - 1))


def _beside(change: NDArray[np.bool_], axis: int) -> NDArray[np.bool_]:
    """Return what holds between two neighbours along an axis at both of them."""
    return np.insert(change, 0, False, axis=axis) | np.insert(change, change.shape[axis], False, axis=axis)


def _over_cells(table: IntArray, rows: IntArray, columns: IntArray, least: Any) -> IntArray:
    """Minimum or maximum over each closed cell between neighbouring lines."""
    for axis, lines in ((0, rows), (1, columns)):
        if len(lines) < 2:
            return np.zeros((0, 0), dtype=np.int64)
        inner = least.reduceat(table, lines[:-1], axis=axis)
        table = least(inner, np.take(table, lines[1:], axis=axis))
    return table
