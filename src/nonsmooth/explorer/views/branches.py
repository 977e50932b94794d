"""Branches of periodic orbits over the bifurcation diagram: stable and unstable, with their special points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

import nonsmooth as ns
from nonsmooth.explorer.labels import number
from nonsmooth.explorer.views.view import Setting, View

if TYPE_CHECKING:
    from nonsmooth.explorer.session import Session
    from nonsmooth.explorer.state import State
    from nonsmooth.explorer.work import Heard
    from nonsmooth.system.system import System

__all__ = ["Branches"]

_BUDGET = 60.0  # seconds of processor time; what is found by then is shown


class Branches(View):
    """Lines over the diagram's points, from Newton's method and continuation."""

    name, title, panel = "branches", "", "upper"
    stages: ClassVar = {"branches": False}
    settings: ClassVar = {"branches.show": Setting(
        "branches", lambda system, state: "no", lambda system, state: {"no": "hidden", "yes": "shown"}
    )}  # fmt: skip

    saved = ("branches", "bifurcation_diagram")

    @staticmethod
    def depends(old: tuple[str, str], new: tuple[str, str]) -> bool:
        """Return whether either changed: branches lie over the diagram's parameter."""
        return old != new

    def shown(self, system: System, state: State) -> bool:
        """Return whether the diagram is shown, and its branches asked for."""
        return state.upper == "diagram" and self.value("show", system, state) == "yes"

    def requests(self, system: System, state: State, base: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """Branches over the diagram's range; those of a system without forcing begin at its cycle."""
        begin = {} if system.period() is not None or system.is_map else {"start": list(state.start)}
        return {"branches": {**base["first look"], **begin, "view": "branches", "columns": 0}}

    @staticmethod
    def compute(system: System, job: Mapping[str, Any], options: Mapping[str, Any], heard: Heard) -> dict[str, Any]:
        """A ``bifurcation_diagram``; of a system without forcing the branch of one cycle."""
        over, ends = job["over"], (job["low"], job["high"])
        if "start" not in job:
            return {"branches": ns.bifurcation_diagram(
                system, over, ends, start=list(job["begin"]), transient=job["transient"], budget=_BUDGET,
                progress=heard,
            )}  # fmt: skip
        orbit = ns.find_orbit(
            system, start=list(job["start"]), transient=job["transient"], budget=_BUDGET, progress=heard
        )
        return {"cycle": ns.continue_orbit(orbit, over, ends)}

    def build(self, page: Session) -> Any:
        """Put lines and marks into the diagram."""
        from bokeh.models import ColumnDataSource, HoverTool

        from nonsmooth.explorer.figures import TIP
        from nonsmooth.plot.branch import MARKS

        plot = page.sheet.diagram.plot
        self._lines = {
            line: ColumnDataSource(name=f"{words} branches", data={"x": [], "y": []})
            for line, words in {"-": "stable", "--": "unstable", ":": "virtual"}.items()
        }
        looks = {"-": ("solid", 1.8), "--": ("dashed", 1.3), ":": ("dotted", 1.3)}
        self._drawn = [
            plot.line("x", "y", source=source, line_dash=looks[line][0], line_width=looks[line][1])
            for line, source in self._lines.items()
        ]
        self._points = ColumnDataSource(data={"x": [], "y": [], "words": []})
        near = plot.scatter("x", "y", source=self._points, size=9, fill_alpha=0.0, line_alpha=0.0)
        plot.add_tools(HoverTool(renderers=[near], tooltips=TIP, attachment="left", limit=1))
        self._marks = ColumnDataSource(name="special points", data={"x": [], "y": [], "marker": [], "words": []})
        self._special = plot.scatter(
            "x", "y", marker="marker", source=self._marks, size=9, fill_color="#FFFFFF", line_width=1.4,
        )  # fmt: skip
        self._signs = dict(zip(MARKS, _SIGNS, strict=True))
        self.paint(False)

    def redraw(self, system: System, state: State) -> None:
        """Draw all section points of every branch over the parameter."""
        from nonsmooth.plot.bifurcation_diagram import one_branch
        from nonsmooth.plot.branch import lines_of, ordinates_of, with_breaks

        result = self.results.get("branches", self.results.get("cycle"))
        if result is None:
            return
        parameter = str(result.attrs["parameter"])
        unit = system.parameters[parameter].unit
        whole = "branch" in result
        count = result.sizes["branch_id"] if whole else 1
        lines: dict[str, list[Any]] = {line: [] for line in self._lines}
        points: dict[str, list[Any]] = {key: [] for key in self._points.data}
        marks: dict[str, list[Any]] = {key: [] for key in self._marks.data}
        for k in range(count):
            branch = one_branch(result, k) if whole else result
            values = branch[parameter].values
            period = branch.sizes.get("return", 1)
            places = [number(float(value), unit, 6) for value in values]
            orbits = [f"period {period}, {_multipliers(some)}" for some in branch["floquet_multipliers"].values]
            stable = branch["stable"].values
            told = [
                f"{place}: {'' if good else 'un'}stable, {orbit}"
                for place, good, orbit in zip(places, stable, orbits, strict=True)
            ]
            at = branch["special_point"].values.astype(int) if branch.sizes.get("special") else np.zeros(0, int)
            kinds = [str(kind) for kind in branch["special_kind"].values] if len(at) else []
            named = [
                f"{_WORDS.get(kind, kind.replace('_', ' '))} at {places[i]}: {orbits[i]}"
                for kind, i in zip(kinds, at, strict=True)
            ]
            for row in ordinates_of(branch, state.shown, "section"):
                for line, some in lines_of(branch):
                    lines[line] += [
                        np.append(with_breaks(values, some), np.nan), np.append(with_breaks(row, some), np.nan)
                    ]  # fmt: skip
                # of points at one place the first is told: the special ones
                for some, of in ((np.arange(len(values)), told), (at, named)):
                    points["x"][:0], points["y"][:0] = values[some].tolist(), row[some].tolist()
                    points["words"][:0] = of
                marks["x"].extend(values[at].tolist())
                marks["y"].extend(row[at].tolist())
                marks["marker"].extend(self._signs.get(kind, "asterisk") for kind in kinds)
                marks["words"].extend(named)
        for line, source in self._lines.items():
            source.data = {
                key: np.concatenate(lines[line][first::2]) if lines[line] else [] for first, key in enumerate("xy")
            }
        self._points.data, self._marks.data = points, marks

    def clear(self) -> None:
        """Show no branch."""
        super().clear()
        for source in (*self._lines.values(), self._points, self._marks):
            source.data = {key: [] for key in source.data}

    @staticmethod
    def axes(state: State) -> dict[str, str]:
        """The state of the ordinate."""
        return {"y": state.shown}

    def paint(self, dark: bool) -> None:
        """Draw in the ink of the page: the points below have the colours."""
        ink = "#E8E8E8" if dark else "#1B1F24"
        for line in self._drawn:
            line.glyph.line_color = ink
        self._special.glyph.update(line_color=ink, fill_color="#171B20" if dark else "#FFFFFF")


#: Markers of Bokeh for the kinds of special points, in the order of ``nonsmooth.plot.branch.MARKS``.
_SIGNS = ("circle", "square", "diamond", "triangle", "triangle_pin", "inverted_triangle", "x", "cross", "hex", "star")
_WORDS = {"neimark_sacker": "Neimark-Sacker bifurcation", "flip": "flip (period doubling)"}


def _multipliers(multipliers: Any) -> str:
    """The multipliers in words: all where there are up to three, else the largest."""
    some = sorted((complex(one) for one in multipliers if np.isfinite(one)), key=abs, reverse=True)
    if not some:
        return "no multipliers"
    told = ", ".join(
        f"{one.real:.3g}".replace("-", "\N{MINUS SIGN}") if abs(one.imag) < 1e-9 * (1 + abs(one.real))
        else f"{one.real:.3g} ± {abs(one.imag):.3g}i".replace("-", "\N{MINUS SIGN}")
        for one in some[:3] if one.imag >= -1e-9 * (1 + abs(one))
    )  # fmt: skip
    return f"multipliers {told}" + (" …" if len(some) > 3 else "")
