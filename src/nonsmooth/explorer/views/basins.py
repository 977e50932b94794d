"""Basins of attraction in the phase plane: the attractor reached from each initial state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

import nonsmooth as ns
from nonsmooth.explorer.labels import symbols_of
from nonsmooth.explorer.views.cells import Cells
from nonsmooth.explorer.views.view import Setting, View

if TYPE_CHECKING:
    from nonsmooth.explorer.session import Session
    from nonsmooth.explorer.state import State
    from nonsmooth.explorer.work import Heard
    from nonsmooth.system.system import System

__all__ = ["Basins"]

_SIZES = {"first basins": 24, "basins": 72, "fine basins": 180}
_NEAR = 0.1  # of the window: attractors of two pictures that are this near are one
_MARKS = ("circle", "square", "triangle", "diamond", "inverted_triangle", "hex", "star")
_ENDS = ("left", "right", "bottom", "top")


class Basins(View):
    """Initial states in the colour of their attractor, with the attractors' section points; a click starts there."""

    name, title, panel = "basins", "Basins", "plane"
    stages: ClassVar = {"first basins": True, "basins": False, "fine basins": False}
    settings: ClassVar = {f"basins.{end}": Setting("", lambda system, state: None) for end in _ENDS}
    saved = ("basins", "basins")

    def requests(self, system: System, state: State, base: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """Each finer than the one before it; initial values of states outside the plane are the page's."""
        fixed = {
            name: value for name, value in zip(system.states, state.start, strict=True)
            if name not in (state.x, state.y)
        }  # fmt: skip
        job = {
            **{key: base["orbit"][key] for key in ("text", "values", "method", "eta", "transient")},
            "x": state.x, "y": state.y, "fixed": fixed, "begin": base["first look"]["begin"],
            "window": [self.value(end, system, state) for end in _ENDS],
        }  # fmt: skip
        return {stage: {**job, "view": stage} for stage in _SIZES}

    @staticmethod
    def compute(system: System, job: Mapping[str, Any], options: Mapping[str, Any], heard: Heard) -> dict[str, Any]:
        """``basins`` of the window; where none is given, of one around the motion from rest."""
        from nonsmooth.explorer.work import section_of

        names, window = (job["x"], job["y"]), job["window"]
        if names[0] == names[1]:
            raise ValueError("both axes of the phase plane show one state; choose two for its basins")
        section = section_of(system)
        if None in window:
            window = _around(system, names, job, section, options)
        n = _SIZES[job["view"]]
        grid = {name: np.linspace(window[2 * k], window[2 * k + 1], n) for k, name in enumerate(names)}
        return {"basins": ns.basins(
            system, grid, fixed=job["fixed"] or None, section=section, transient=job["transient"], progress=heard,
            **options,
        )}  # fmt: skip

    def build(self, page: Session) -> Any:
        """The image of the labels."""
        self._cells = Cells("basins")
        self._known: list[tuple[int, Any]] = []
        return self._cells.panel.plot

    def show(self, job: Mapping[str, Any], found: Mapping[str, Any], system: System, state: State) -> None:
        """Attractors keep their colours from one picture to the next."""
        if (job["x"], job["y"]) == (state.x, state.y):
            self._stage = job["view"]
            super().show(job, found, system, state)

    def redraw(self, system: System, state: State) -> None:
        """Draw labels and section points; nothing where the phase plane has other axes by now."""
        from nonsmooth.plot import palette
        from nonsmooth.plot.basins import names_of

        result = self.results.get("basins")
        if result is None:
            return
        first, second = (str(dim) for dim in result["label"].dims)
        if (first, second) != (state.x, state.y):
            self.clear()
            return
        x, y = result[first].values, result[second].values
        at = [[str(name) for name in result["state"].values].index(name) for name in (first, second)]
        points, of = result["section_points"].values[:, at], result["point_attractor"].values
        size = np.array([np.ptp(x), np.ptp(y)])
        numbers = self._numbers([
            (int(period), points[of == k] / size) for k, period in enumerate(result["period_number"].values)
        ])  # fmt: skip
        labels = result["label"].transpose(second, first).values
        names, shares = names_of(result), result["fraction"].values
        entries = [("diverged", palette.DIVERGED), ("none reached", palette.UNKNOWN), *(
            (f"{name}: {100 * share:.3g} %", palette.attractor_color(number))
            for name, share, number in zip(names, shares, numbers, strict=True)
        )]  # fmt: skip
        self._cells.put(x, y, np.maximum(labels, -2) + 2, entries, self._stage)
        self._entries = [entries[k] for k in np.unique(np.maximum(labels, -2) + 2)]
        marks = [_MARKS[numbers[k] % len(_MARKS)] if result["period_number"].values[k] else "dot" for k in of]
        self._cells.points.data = {"x": points[:, 0], "y": points[:, 1], "marker": marks}
        half = [0.5 * np.ptp(one) / max(len(one) - 1, 1) for one in (x, y)]
        self._cells.panel.show(
            (float(x[0] - half[0]), float(x[-1] + half[0])), (float(y[0] - half[1]), float(y[-1] + half[1]))
        )
        units = system.states
        self._cells.name_axes(symbols_of(system), (first, units[first]), (second, units[second]))
        self.place(system, state)

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

    def place(self, system: System, state: State) -> None:
        """Mark the initial state."""
        if "basins" in self.results:
            start = dict(zip(system.states, state.start, strict=True))
            self._cells.here.data = {"x": [start[state.x]], "y": [start[state.y]]}

    def clear(self) -> None:
        """Show nothing."""
        super().clear()
        self._cells.clear()
        self._known = []

    def legend(self, system: System, state: State) -> list[tuple[str, str]]:
        """Attractors with their shares."""
        return self._entries if "basins" in self.results else []

    def tapped(self, x: float, y: float, system: System, state: State) -> State:
        """Start there."""
        start = dict(zip(system.states, state.start, strict=True)) | {state.x: x, state.y: y}
        return replace(state, start=tuple(start.values()))

    def zoomed(self, x: tuple[float, float], y: tuple[float, float], system: System, state: State) -> State:
        """Compute the window that is seen."""
        return state.with_settings(**{f"basins__{end}": value for end, value in zip(_ENDS, (*x, *y), strict=True)})

    def unzoomed(self, system: System, state: State) -> State:
        """Return to the first window."""
        return state.with_settings(**{f"basins__{end}": None for end in _ENDS})


def _around(
    system: Any, names: tuple[str, str], job: Mapping[str, Any], section: Any, options: Mapping[str, Any]
) -> list[float]:
    """A window about the motion from rest, with room as wide as it is on each side, its ends rounded."""
    name = next(iter(system.parameters))
    run = ns.sweep(
        system, name, [system.values[name]], direction=None, start=list(job["begin"]), section=section,
        transient=job["transient"], keep=40, judge=False, progress=False, **options,
    )  # fmt: skip
    ends: list[float] = []
    for state in names:
        low, high = (float(run[which].sel(state=state).values.ravel()[0]) for which in ("minimum", "maximum"))
        if not (np.isfinite([low, high]).all() and high > low):
            scale = float(np.asarray(system.scale_vector())[list(system.states).index(state)])
            low, high = -scale, scale
        step = 10.0 ** math.floor(math.log10(high - low)) / 2  # so that it stays while a parameter is moved
        ends += [math.floor((2 * low - high) / step) * step, math.ceil((2 * high - low) / step) * step]
    return ends
