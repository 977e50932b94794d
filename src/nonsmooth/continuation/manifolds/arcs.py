"""Growing one side of a manifold: images of a fundamental segment, made as fine as asked for where they are seen.

The images are points of the stroboscopic section at phase 0; ``view`` takes them to the phase at which they are looked
at (the flow takes manifolds of one phase to those of another). Fineness is judged there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray

Step = Callable[[FloatArray, FloatArray], FloatArray]  # (points, guesses) -> images or preimages
View = Callable[[FloatArray], FloatArray]
BEGIN = 9  # points of the first segment
FINEST = 1e-3  # of the distance: neighbours nearer than this are never parted
NARROW = 1e-12  # in s: a gap that remains is a jump of the section map
SHORT = 1e-3  # of the distance: segments shorter than this, and shrinking, add nothing
MOST_LEVELS = 2000


class Arc:
    """One side of the manifold of one point of the orbit, in scaled states.

    Parameters
    ----------
    step, view : functions
        Images of points; how they are looked at.
    reach, near, turn : float
        The length asked for, the largest distance of neighbours and the largest angle between them.
    most : int
        The largest number of points.
    """

    def __init__(self, step: Step, view: View, reach: float, near: float, turn: float, most: int) -> None:
        self.step, self.view = step, view
        self.reach, self.near, self.turn, self.most = reach, near, turn, most
        self.parts: list[tuple[Any, ...]] = []  # of each image: its points, their arc length, image and piece
        self.length, self.pieces, self.ending = 0.0, 0, "length"

    def grow(self, u: FloatArray, q: FloatArray) -> Arc:
        """Images of the segment from q, beside the orbit's point u, to its image, until the length is reached."""
        end = self.step(q[None, :], q[None, :])[0]
        if not np.isfinite(end).all():
            self.ending = "lost"
            return self
        self.s = np.linspace(0.0, 1.0, BEGIN)  # of the points on the first segment
        self.levels = self._on_segment(self.s, q, end)[None]  # they and their images so far
        self.seen = self.view(self.levels[0])  # the last of them
        begin = self.length = float(np.linalg.norm(self.seen[0] - self.view(u[None, :])[0]))
        last = np.inf
        for k in range(MOST_LEVELS):
            if k:
                x = self.levels[-1]
                self.levels = np.concatenate([self.levels, self.step(x, x + (x[-1] - x[0]))[None]])
                self.seen = self.view(self.levels[-1])
            if not self._refined():  # as far as it is fine
                self._emit(k, int(np.flatnonzero(self._bad())[0]) + 1)
                self.ending = "points"
                return self
            here = self._emit(k, len(self.s))
            if self.ending != "length" or self.length >= self.reach:
                return self
            if here < SHORT * self.near and here < last and k > 0 and self.length > 10 * begin:
                self.ending = "closed"
                return self
            last = here
            self._thin()
        self.ending = "images"
        return self

    def _on_segment(self, s: FloatArray, q: FloatArray, end: FloatArray) -> FloatArray:
        return np.asarray((1.0 - s)[:, None] * q + s[:, None] * end)

    def _chords(self) -> tuple[FloatArray, FloatArray]:
        """Distances of neighbours, and the angles between them."""
        chord = np.diff(self.seen, axis=0)
        d = np.linalg.norm(chord, axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            along = chord / d[:, None]
            return d, np.arccos(np.clip((along[1:] * along[:-1]).sum(axis=1), -1.0, 1.0))

    def _bad(self) -> NDArray[np.bool_]:
        """Gaps between neighbours that want another point; none beyond the length that is left."""
        d, angle = self._chords()
        wide = np.logical_not(d <= self.near)  # NaN is wide: the edge of what has an image
        lost = np.asarray(~np.isfinite(self.seen).all(axis=1))
        wide[lost[:-1] & lost[1:]] = False
        sharp, far = angle > self.turn, d > FINEST * self.near
        wide[:-1] |= sharp & far[:-1]
        wide[1:] |= sharp & far[1:]
        reached = np.concatenate([[0.0], np.cumsum(np.nan_to_num(d))])[:-1]
        return np.asarray(wide & (np.diff(self.s) > NARROW) & (reached <= self.reach - self.length))

    def _refined(self) -> bool:
        """Put new points on the first segment, and their images, until the last is as fine as asked for."""
        room = self.most - sum(len(part[0]) for part in self.parts)
        for _ in range(60):
            at = np.flatnonzero(self._bad())
            if not len(at):
                break
            if len(self.s) + len(at) > max(room, BEGIN) + BEGIN:
                return False
            new = 0.5 * (self.s[at] + self.s[at + 1])
            grown = [self._on_segment(new, *self.levels[0][[0, -1]])]
            for old in self.levels[1:]:
                between = 0.5 * (old[at] + old[at + 1])
                between = np.where(np.isfinite(between), between, np.where(np.isfinite(old[at]), old[at], old[at + 1]))
                grown.append(self.step(grown[-1], between))
            self.s = np.insert(self.s, at + 1, new)
            self.levels = np.insert(self.levels, at + 1, grown, axis=1)
            self.seen = np.insert(self.seen, at + 1, self.view(grown[-1]), axis=0)
        return True

    def _emit(self, k: int, fine: int) -> float:
        """Add the fine part of an image, up to the length asked for or the first point that is lost; its length."""
        x, s = self.seen[:fine], self.s[:fine]
        lost = np.flatnonzero(~np.isfinite(x).all(axis=1))
        if len(lost):
            x, self.ending = x[: lost[0]], "lost"
        d = np.linalg.norm(np.diff(x, axis=0), axis=1)
        jump = (d > 4.0 * self.near) & (np.diff(s)[: len(d)] <= 4.0 * NARROW)
        d[jump] = 0.0
        run = self.length + np.concatenate([[0.0], np.cumsum(d)])[: len(x)]
        piece = self.pieces + np.concatenate([[0], np.cumsum(jump)])[: len(x)].astype(np.int64)
        over = np.flatnonzero(run >= self.reach)
        if len(over):
            self.ending = "length"
            last = int(over[0]) + 1
            x, run, piece = x[:last], run[:last], piece[:last]
        new = slice(1 if self.parts else 0, None)  # the first point is the last of the image before
        self.parts.append((x[new], run[new], np.full(len(x[new]), k), piece[new]))
        if len(x):
            self.length, self.pieces = float(run[-1]), int(piece[-1])
        return float(d.sum())

    def _thin(self) -> None:
        """Leave out every other point where the last image stays fine without it."""
        d, angle = self._chords()
        spare = np.zeros(len(self.s), dtype=bool)
        spare[1:-1] = (d[1:] + d[:-1] < 0.2 * self.near) & (angle < 0.2 * self.turn)
        spare[::2] = False
        if len(self.s) - int(spare.sum()) >= BEGIN:
            self.s, self.levels = self.s[~spare], self.levels[:, ~spare]
