"""Growing one side of a manifold: images of a fundamental segment, made as fine as asked for where they are seen.

The images are points of the stroboscopic section at phase 0; ``view`` takes them to the phase at which they are looked
at (the flow takes manifolds of one phase to those of another). Fineness is judged there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray

__all__ = ["BEGIN", "Arc", "grow"]

Step = Callable[[FloatArray, FloatArray], FloatArray]  # (points, guesses) -> images or preimages
View = Callable[[FloatArray], FloatArray]
BEGIN = 9  # points of the first segment
FINEST = 1e-3  # of the distance: neighbours nearer than this are never parted
NARROW = 1e-12  # in s: a gap that remains is a jump of the section map
SHORT = 1e-3  # of the distance: segments shorter than this, and shrinking, add nothing
MOST_LEVELS = 2000


@dataclass
class Arc:
    """One side of the manifold of one point of the orbit, in scaled states."""

    points: list[FloatArray] = field(default_factory=list)
    iterate: list[NDArray[np.int64]] = field(default_factory=list)
    piece: list[NDArray[np.int64]] = field(default_factory=list)
    length: float = 0.0
    count: int = 0
    pieces: int = 0
    ending: str = "length"


def grow(
    step: Step, view: View, u: FloatArray, q: FloatArray, reach: float, near: float, turn: float, most: int
) -> Arc:
    """One side: images of the fundamental segment from q until the length is reached, as ``view`` shows them."""
    arc = Arc()
    end = step(q[None, :], q[None, :])[0]
    if not np.isfinite(end).all():
        arc.ending = "lost"
        return arc
    s = np.linspace(0.0, 1.0, BEGIN)
    levels = [(1.0 - s)[:, None] * q + s[:, None] * end]
    seen = view(levels[0])
    begin = float(np.linalg.norm(seen[0] - view(u[None, :])[0]))
    arc.length, last = begin, np.inf
    for k in range(MOST_LEVELS):
        if k:
            guess = levels[-1] + (levels[-1][-1] - levels[-1][0])
            levels.append(step(levels[-1], guess))
            seen = view(levels[-1])
        left = reach - arc.length
        s, levels, seen, whole = _refine(step, view, s, levels, seen, left, near, turn, most - arc.count)
        if not whole:  # as far as it is fine
            fine = int(np.flatnonzero(_bad(seen, s, left, near, turn))[0]) + 1
            _emit(arc, seen[:fine], s[:fine], k, reach, near)
            arc.ending = "points"
            return arc
        here = _emit(arc, seen, s, k, reach, near)
        if arc.ending != "length" or arc.length >= reach:
            return arc
        if here < SHORT * near and here < last and k > 0 and arc.length > 10 * begin:
            arc.ending = "closed"
            return arc
        last = here
        s, levels = _thin(s, levels, seen, near, turn)
    arc.ending = "images"
    return arc


def _bad(x: FloatArray, s: FloatArray, left: float, near: float, turn: float) -> NDArray[np.bool_]:
    """Gaps between neighbours that want another point; none beyond the length that is left."""
    d, angle = _chords(x)
    wide: NDArray[np.bool_] = np.logical_not(d <= near)  # NaN is wide: the edge of what has an image
    lost: NDArray[np.bool_] = np.asarray(~np.isfinite(x).all(axis=1), dtype=np.bool_)
    wide[lost[:-1] & lost[1:]] = False
    sharp = angle > turn
    far = d > FINEST * near
    wide[:-1] |= sharp & far[:-1]
    wide[1:] |= sharp & far[1:]
    reached = np.concatenate([[0.0], np.cumsum(np.nan_to_num(d))])[:-1]
    return np.asarray(wide & (np.diff(s) > NARROW) & (reached <= left))


def _chords(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distances of neighbours, and the angles between them."""
    chord = np.diff(x, axis=0)
    d = np.linalg.norm(chord, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        along = chord / d[:, None]
        return d, np.arccos(np.clip((along[1:] * along[:-1]).sum(axis=1), -1.0, 1.0))


def _refine(
    step: Step, view: View, s: FloatArray, levels: list[FloatArray], seen: FloatArray, left: float, near: float,
    turn: float, room: int,
) -> tuple[FloatArray, list[FloatArray], FloatArray, bool]:  # fmt: skip
    """New points on the first segment, mapped up to the last image, until that is as fine as asked for."""
    for _ in range(60):
        at = np.flatnonzero(_bad(seen, s, left, near, turn))
        if not len(at):
            break
        if len(s) + len(at) > max(room, BEGIN) + BEGIN:
            return s, levels, seen, False
        new = 0.5 * (s[at] + s[at + 1])
        q, end = levels[0][0], levels[0][-1]
        x = (1.0 - new)[:, None] * q + new[:, None] * end
        s = np.insert(s, at + 1, new)
        grown = [np.insert(levels[0], at + 1, x, axis=0)]
        for old in levels[1:]:
            between = 0.5 * (old[at] + old[at + 1])
            between = np.where(np.isfinite(between), between, np.where(np.isfinite(old[at]), old[at], old[at + 1]))
            x = step(x, between)
            grown.append(np.insert(old, at + 1, x, axis=0))
        levels = grown
        seen = np.insert(seen, at + 1, view(x), axis=0)
    return s, levels, seen, True


def _emit(arc: Arc, x: FloatArray, s: FloatArray, k: int, reach: float, near: float) -> float:
    """Add an image to the arc, up to the length asked for or the first point that is lost; its length."""
    lost = np.flatnonzero(~np.isfinite(x).all(axis=1))
    if len(lost):
        x, arc.ending = x[: lost[0]], "lost"
    d = np.linalg.norm(np.diff(x, axis=0), axis=1)
    jump = (d > 4.0 * near) & (np.diff(s)[: len(d)] <= 4.0 * NARROW)
    d[jump] = 0.0
    run = arc.length + np.concatenate([[0.0], np.cumsum(d)])
    over = np.flatnonzero(run >= reach)
    last = int(over[0]) + 1 if len(over) else len(x)
    if len(over):
        arc.ending = "length"
    begin = 0 if not arc.points else 1  # the first point is the last of the image before
    pieces = arc.pieces + np.concatenate([[0], np.cumsum(jump)]).astype(np.int64)
    arc.points.append(x[begin:last])
    arc.iterate.append(np.full(max(last - begin, 0), k, dtype=np.int64))
    arc.piece.append(pieces[begin:last])
    arc.count += max(last - begin, 0)
    if last:
        arc.length, arc.pieces = float(run[last - 1]), int(pieces[last - 1])
    return float(d.sum())


def _thin(
    s: FloatArray, levels: list[FloatArray], x: FloatArray, near: float, turn: float
) -> tuple[FloatArray, list[FloatArray]]:
    """Leave out every other point where the last image stays fine without it."""
    d, angle = _chords(x)
    spare = np.zeros(len(s), dtype=bool)
    spare[1:-1] = (d[1:] + d[:-1] < 0.2 * near) & (angle < 0.2 * turn)
    spare[::2] = False
    if len(s) - int(spare.sum()) < BEGIN:
        return s, levels
    return s[~spare], [level[~spare] for level in levels]
