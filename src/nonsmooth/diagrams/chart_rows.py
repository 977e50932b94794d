"""Rows of a chart along which the state is carried: one after the other on a processor, side by side on a GPU.

The points of a row must follow each other. A GPU takes the first points of all rows together, then the second ones, and
so on: it is as fast as there are rows (times starts).
"""

from __future__ import annotations

import numpy as np

from nonsmooth.attractors.settled import Settled, usable
from nonsmooth.attractors.settler import Settler
from nonsmooth.flow.engines.engine import FloatArray
from nonsmooth.kernels.hybrid import codes


def along_rows(settler: Settler, points: FloatArray, length: int, starts: FloatArray) -> Settled:
    """Each row of ``length`` points from each start, the state carried along it.

    Parameters
    ----------
    points : array (rows * length, n_parameters)
    starts : array (S, n)

    Returns
    -------
    Settled
        In the order (point, start).
    """
    if settler.device == "cuda":
        return side_by_side(settler, points, length, starts)
    parts = []
    for first in range(0, len(points), length):
        rows = np.arange(first, first + length)
        for start in starts:
            parts.append(settler.run(points, rows, np.tile(start, (length, 1)), carried=True))
    order = np.arange(len(points) * len(starts)).reshape(-1, len(starts), length)
    return Settled.joined(parts)[order.transpose(0, 2, 1).ravel()]


def side_by_side(settler: Settler, points: FloatArray, length: int, starts: FloatArray) -> Settled:
    """The same, all rows together from point to point, by the exact flow of planar systems.

    A run goes on from where the one at the point before has ended; from its start where that one failed, or where a
    stop has moved over its state."""
    n_rows, n_starts = len(points) // length, len(starts)
    begin = np.tile(starts, (n_rows, 1))
    first = np.repeat(np.arange(n_rows) * length, n_starts)
    goes_on = np.zeros(len(first), dtype=bool)
    parts: list[Settled] = []
    for column in range(length):
        rows, found = first + column, Settled.empty(len(first), starts.shape[1])
        which = np.flatnonzero(goes_on)
        if len(which):
            last, mode = parts[-1].last[which], parts[-1].mode[which]
            carried = settler.run(points, rows[which], last, modes=mode, begin=settler.section_phase)
            found.put(which, carried)
            goes_on[which] = carried.status != codes.NO_CONVERGENCE  # with this flow: a start beyond a stop
        which = np.flatnonzero(~goes_on)
        if len(which):
            found.put(which, settler.run(points, rows[which], begin[which]))
        parts.append(found)
        goes_on = usable(found.status)
    order = np.arange(len(points) * n_starts).reshape(length, n_rows, n_starts)
    return Settled.joined(parts)[order.transpose(1, 0, 2).ravel()]
