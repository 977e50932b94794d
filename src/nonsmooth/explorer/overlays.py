"""The recording in the views, in one neutral colour: a thin line under the motion, rings about section points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from bokeh.models import ColumnDataSource

from nonsmooth.explorer.figures import MOST

if TYPE_CHECKING:
    from nonsmooth.explorer.figures import Diagram, History, Portrait, Section
    from nonsmooth.explorer.state import State

__all__ = ["INK", "PALE", "Overlay"]

INK, PALE = "#4A4A4A", "#D0D0D0"  # on a light, and on a dark ground


class Overlay:
    """A recorded motion in the four views."""

    def __init__(self, diagram: Diagram, portrait: Portrait, history: History, section: Section) -> None:
        self.figures = {"diagram": diagram, "portrait": portrait, "history": history, "section": section}
        keys = ("curve", "history", "portrait", "section", "diagram")
        self.sources = {key: ColumnDataSource(name=f"recorded {key}", data={"x": [], "y": []}) for key in keys}
        self._lines = [
            one.plot.line("x", "y", source=self.sources[key], line_width=1, line_alpha=0.6, level="underlay")
            for one, key in ((portrait, "curve"), (history, "history"))
        ]
        self._rings = [
            one.plot.scatter(
                "x", "y", source=self.sources[key], fill_color=None, line_width=1.2, line_alpha=0.7,
                level="annotation" if one is diagram else "underlay",
            )
            for key, one in self.figures.items() if key != "history"
        ]  # fmt: skip
        self.paint(dark=False)

    def paint(self, dark: bool) -> None:
        """Take the colour that shows on a light or a dark ground."""
        for renderer in (*self._lines, *self._rings):
            renderer.glyph.line_color = PALE if dark else INK

    @property
    def is_empty(self) -> bool:
        """Return whether nothing recorded is drawn."""
        return not any(len(source.data["x"]) for source in self.sources.values())

    def put(self, laid: Mapping[str, Any] | None, state: State) -> None:
        """Draw a recording where the page shows the states that it holds, and none where ``laid`` is None."""
        found = laid or {"curve": {}, "section": {}, "history": {}}
        self._put("curve", found["curve"], state.x, state.y)
        self._put("history", found["history"], "time", state.x)
        for key in ("portrait", "section"):
            self._put(key, found["section"], state.x, state.y)
        points = found["section"].get(state.shown, np.empty(0))
        here = {"here": np.full(len(points), state.values[state.over]), state.shown: points}
        self._put("diagram", here, "here", state.shown)
        few = len(points) <= MOST
        for renderer in self._rings:
            renderer.glyph.size = 10 if few else 3
        for key, one in (("curve", "portrait"), ("curve", "section")):
            self.figures[one].beside = self.sources[key].data["x"], self.sources[key].data["y"]
        self.figures["history"].beside = [], self.sources["history"].data["y"]

    def _put(self, key: str, columns: Mapping[str, Any], x: str, y: str) -> None:
        there = x in columns and y in columns
        self.sources[key].data = {"x": columns[x] if there else np.empty(0), "y": columns[y] if there else np.empty(0)}
