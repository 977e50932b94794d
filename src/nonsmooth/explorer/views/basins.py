"""Basins of attraction in the phase plane: the attractor reached from each initial state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.explorer.views.cells import Cells
from nonsmooth.explorer.views.motion import Portrait
from nonsmooth.explorer.views.view import Request
from nonsmooth.plot import palette
from nonsmooth.plot.planes import names_of

if TYPE_CHECKING:
    from nonsmooth.explorer.state import State

__all__ = ["Basins"]

_NEAR = 0.1  # of the window: attractors of two pictures that are this near are one
_MARKS = ("circle", "square", "triangle", "diamond", "inverted_triangle", "hex", "star")
_ENDS = ("left", "right", "bottom", "top")


class Basins(Cells):
    """Initial states in the colour of their attractor, with the attractors' section points; a click starts there."""

    name = "basins"

    def requests(self, base: Mapping[str, Request]) -> dict[str, Request]:
        """Each finer than the one before it; initial values of states outside the plane are the page's."""
        state = self.state
        start = zip(self.system.states, state.start, strict=True)
        return self.each({
            **{key: base["orbit"][key] for key in ("text", "values", "method", "eta", "transient")},
            "x": state.x, "y": state.y, "begin": base["first look"]["begin"],
            "fixed": {name: value for name, value in start if name not in (state.x, state.y)},
            "window": [self.setting(end) for end in _ENDS],
        })  # fmt: skip

    def build(self) -> None:
        """The image of the labels."""
        super().build()
        self._known: list[tuple[int, Any]] = []

    def show(self, job: Request, found: Mapping[str, Any]) -> None:
        """Attractors keep their colours from one picture to the next."""
        if (job["x"], job["y"]) == (self.state.x, self.state.y):
            self._stage = job["view"]
            super().show(job, found)

    def redraw(self) -> None:
        """Draw labels and section points; nothing where the phase plane has other axes by now."""
        result = self.results.get("basins")
        if result is None:
            return
        first, second = (str(dim) for dim in result["label"].dims)
        if (first, second) != (self.state.x, self.state.y):
            self.clear()
            return
        x, y = result[first].values, result[second].values
        points, of = result["section_points"].sel(state=[first, second]).values, result["point_attractor"].values
        size, periods = np.array([np.ptp(x), np.ptp(y)]), result["period_number"].values
        numbers = self._numbers([(int(period), points[of == k] / size) for k, period in enumerate(periods)])
        entries = [("diverged", palette.DIVERGED), ("none reached", palette.UNKNOWN), *(
            (f"{name}: {100 * share:.3g} %", palette.attractor_color(number))
            for name, share, number in zip(names_of(result), result["fraction"].values, numbers, strict=True)
        )]  # fmt: skip
        classes = np.maximum(result["label"].transpose(second, first).values, -2) + 2
        self.put(x, y, classes, entries, self._stage)
        self._legend = [entries[k] for k in np.unique(classes)]
        marks = [_MARKS[numbers[k] % len(_MARKS)] if periods[k] else "dot" for k in of]
        self.points.data = {"x": points[:, 0], "y": points[:, 1], "marker": marks}
        half = [0.5 * np.ptp(one) / max(len(one) - 1, 1) for one in (x, y)]
        ends = ((float(one[0] - h), float(one[-1] + h)) for one, h in zip((x, y), half, strict=True))
        self.figure.show(*ends)
        self.name_axes(first, second)
        self.place()

    def _numbers(self, found: list[tuple[int, Any]]) -> list[int]:
        """Numbers for colours and marks: that of the nearest attractor of the picture before, else a free one."""
        numbers: list[int] = []
        for period, points in found:
            away = [
                np.inf if period != old or k in numbers or not len(points) or not len(there)
                else float(np.linalg.norm(points.mean(axis=0) - there.mean(axis=0)))
                for k, (old, there) in enumerate(self._known)
            ]  # fmt: skip
            free = (k for k in range(len(self._known) + len(found) + 1) if k not in numbers and k >= len(self._known))
            best = int(np.argmin(away)) if away and min(away) < _NEAR else next(free)
            numbers.append(best)
        known = dict(enumerate(self._known)) | dict(zip(numbers, found, strict=True))
        self._known = [known[k] for k in sorted(known)] if len(known) <= 9 else found
        return numbers if len(known) <= 9 else list(range(len(found)))

    def place(self) -> None:
        """Mark the initial state."""
        if "basins" in self.results:
            start = dict(zip(self.system.states, self.state.start, strict=True))
            self.here.data = {"x": [start[self.state.x]], "y": [start[self.state.y]]}

    def clear(self) -> None:
        """Show nothing."""
        super().clear()
        self._known = []

    def legend(self) -> list[tuple[str, str]]:
        """Attractors with their shares."""
        return self._legend if "basins" in self.results else []

    tapped = Portrait.tapped

    def zoomed(self, x: tuple[float, float], y: tuple[float, float]) -> State:
        """Compute the window that is seen."""
        return self.state.with_settings(**{f"basins__{end}": value for end, value in zip(_ENDS, (*x, *y), strict=True)})

    def unzoomed(self) -> State:
        """Return to the first window."""
        return self.state.with_settings(**{f"basins__{end}": None for end in _ENDS})
