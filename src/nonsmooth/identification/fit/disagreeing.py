"""Windows of records that disagree with the rest: found with parameters of the others, left out, and named."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from nonsmooth.arrays import BoolArray, FloatArray
from nonsmooth.identification.fit.first_level import misfits, settle_first
from nonsmooth.identification.fit.first_windows import first_length
from nonsmooth.identification.fit.windows import Windows

_FAR = 8.0  # mean squared residual of a window over that of most, from which it disagrees
_MOST = 0.5  # of the windows: if more disagree, nothing says which are right
_LEAST = 3  # windows: a shorter part between two that disagree is left out with them


def without_disagreeing(problem: Windows, theta: FloatArray) -> tuple[Windows, list[str]]:
    """The problem with its records cut where short windows do not fit, its guess the parameters of those that do.

    Each part begins with a free start; unknowns of a run are those of all its parts. The sentences name what is left
    out.
    """
    now, theta, _, state = settle_first(problem, theta, first_length(problem), None, True)
    each = misfits(now, state)
    usual = max(float(np.median(each)), 1.0)
    bad = each > _FAR * usual
    if not bad.any() or np.mean(bad) > _MOST:
        many = f"{np.mean(bad):.0%} of short windows disagree with the rest: too many, and none was left out"
        return problem, [many] if bad.any() else []
    of_window = np.array([window.record for window in now.pieces])
    records, origin, modes = [], [], []
    said: list[str] = []
    for i, record in enumerate(problem.records):
        mine = np.flatnonzero(of_window == i)
        for first, last in _runs(_closed(bad[mine])):
            begin, end = now.pieces[mine[first]].time[0], now.pieces[mine[last]].time[-1]
            worst = float(np.sqrt(np.max(each[mine[first : last + 1]]) / usual))
            said.append(
                f"left out: run {record.name}, {begin:.6g} to {end:.6g}, whose residuals are up to {worst:.3g} times "
                "those of the rest"
            )
        for first, last in _runs(~_closed(bad[mine])):
            a = 0 if first == 0 else now.pieces[mine[first]].first
            b = len(record.time) if last == len(mine) - 1 else now.pieces[mine[last]].last
            name = record.name if b - a == len(record.time) else f"{record.name} from {record.time[a]:.6g}"
            records.append(replace(record, name=name, time=record.time[a:b], values=record.values[a:b]))
            origin.append(i)
            modes.append(problem.modes[i] if a == 0 else tuple(range(len(problem.system.modes))))
    u = problem.unknowns
    whose = [*origin, *range(len(problem.records), len(u.places))]
    unknowns = replace(u, guess=np.clip(theta, u.low, u.high), places=u.places[whose])
    return replace(problem, records=records, modes=modes, unknowns=unknowns), said


def _closed(bad: BoolArray) -> BoolArray:
    """The same, with short parts between two that disagree."""
    found = bad.copy()
    for first, last in _runs(~bad):
        if last - first + 1 < _LEAST and bad.any():
            found[first : last + 1] = True
    return found


def _runs(mask: BoolArray) -> Iterator[tuple[int, int]]:
    """First and last place of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    yield from ((int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True))
