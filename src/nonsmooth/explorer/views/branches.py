"""Branches of periodic orbits over the bifurcation diagram: stable and unstable, with their special points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nonsmooth.explorer.figures import INK
from nonsmooth.explorer.labels import number
from nonsmooth.explorer.views.view import Request, View
from nonsmooth.plot.branches import MARKS, lines_of, ordinates_of, with_breaks
from nonsmooth.plot.sweeps import one_branch

__all__ = ["Branches"]

#: Lines by their stability: name, dash and width.
_LINES = {"-": ("stable", "solid", 1.8), "--": ("unstable", "dashed", 1.3), ":": ("virtual", "dotted", 1.3)}
#: Markers of Bokeh for the kinds of special points.
_SIGNS = dict(zip(MARKS, (
    "circle", "square", "diamond", "triangle", "triangle_pin", "inverted_triangle", "x", "cross", "hex", "star",
), strict=True))  # fmt: skip
_WORDS = {"neimark_sacker": "Neimark-Sacker bifurcation", "flip": "flip (period doubling)"}


class Branches(View):
    """Lines over the diagram's points, from Newton's method and continuation."""

    name = "branches"

    def depends(self, old: tuple[str, str], new: tuple[str, str]) -> bool:
        """Return whether either changed: branches lie over the diagram's parameter."""
        return old != new

    @property
    def shown(self) -> bool:
        """Return whether the diagram is shown, and its branches asked for."""
        return self.sheet.views["diagram"].shown and bool(self.setting("show") == "yes")

    def requests(self, base: Mapping[str, Request]) -> dict[str, Request]:
        """Branches over the diagram's range; those of a system without forcing begin at its cycle."""
        cycle = self.system.period() is None and not self.system.is_map
        begin = {"start": list(self.state.start)} if cycle else {}
        return self.each({**base["first look"], **begin, "columns": 0})

    def build(self) -> None:
        """Put lines and marks into the diagram."""
        figure = self.sheet.views["diagram"].figure
        self._lines = {line: figure.source("x", "y", name=f"{one[0]} branches") for line, one in _LINES.items()}
        for line, (_, dash, width) in _LINES.items():
            self.ink(INK, figure.plot.line("x", "y", source=self._lines[line], line_dash=dash, line_width=width))
        self._points = figure.source("x", "y", "words")
        near = figure.plot.scatter("x", "y", source=self._points, size=9, fill_alpha=0.0, line_alpha=0.0)
        figure.tell(near, attachment="left", limit=1)
        self._marks = figure.source("x", "y", "marker", "words", name="special points")
        special = figure.plot.scatter("x", "y", marker="marker", source=self._marks, size=9, line_width=1.4)
        self.ink(INK, special)
        self.ink(("#FFFFFF", "#171B20"), special, field="fill_color")

    def redraw(self) -> None:
        """Draw all section points of every branch over the parameter."""
        result = self.results.get("branches", self.results.get("cycle"))
        if result is None:
            return
        parameter = str(result.attrs["parameter"])
        unit = self.quantity(parameter)[1]
        lines: dict[str, list[Any]] = {line: [np.empty((2, 0))] for line in self._lines}
        points: dict[str, list[Any]] = {key: [] for key in self._points.data}
        marks: dict[str, list[Any]] = {key: [] for key in self._marks.data}
        whole = "branch" in result
        for branch in [one_branch(result, k) for k in range(result.sizes["branch_id"])] if whole else [result]:
            values, period = branch[parameter].values, branch.sizes.get("return", 1)
            places = [number(float(value), unit, 6) for value in values]
            orbits = [f"period {period}, {_multipliers(some)}" for some in branch["floquet_multipliers"].values]
            told = [
                f"{place}: {'' if good else 'un'}stable, {orbit}"
                for place, good, orbit in zip(places, branch["stable"].values, orbits, strict=True)
            ]
            at = branch["special_point"].values.astype(int) if branch.sizes.get("special") else np.zeros(0, int)
            kinds = [str(kind) for kind in branch["special_kind"].values] if len(at) else []
            named = [
                f"{_WORDS.get(kind, kind.replace('_', ' '))} at {places[i]}: {orbits[i]}"
                for kind, i in zip(kinds, at, strict=True)
            ]
            for row in ordinates_of(branch, self.state.shown, "section"):
                for line, some in lines_of(branch):
                    lines[line] += [[with_breaks(values, some), with_breaks(row, some)], [[np.nan], [np.nan]]]
                # of points at one place the first is told: the special ones
                for some, of in ((np.arange(len(values)), told), (at, named)):
                    for key, more in (("x", values[some].tolist()), ("y", row[some].tolist()), ("words", of)):
                        points[key][:0] = more
                signs = [_SIGNS.get(kind, "asterisk") for kind in kinds]
                new = {"x": values[at].tolist(), "y": row[at].tolist(), "marker": signs, "words": named}
                for key, more in new.items():
                    marks[key] += more
        for line, source in self._lines.items():
            source.data = dict(zip("xy", np.concatenate(lines[line], axis=1), strict=True))
        self._points.data, self._marks.data = points, marks

    def clear(self) -> None:
        """Show no branch."""
        super().clear()
        for source in (*self._lines.values(), self._points, self._marks):
            source.data = {key: [] for key in source.data}


def _multipliers(multipliers: Any) -> str:
    """The multipliers in words: all where there are up to three, else the largest."""
    some = sorted((complex(one) for one in multipliers if np.isfinite(one)), key=abs, reverse=True)
    if not some:
        return "no multipliers"
    told = ", ".join(
        f"{one.real:.3g}" if abs(one.imag) < 1e-9 * (1 + abs(one.real)) else f"{one.real:.3g} ± {abs(one.imag):.3g}i"
        for one in some[:3] if one.imag >= -1e-9 * (1 + abs(one))
    )  # fmt: skip
    return f"multipliers {told}".replace("-", "\N{MINUS SIGN}") + (" …" if len(some) > 3 else "")
