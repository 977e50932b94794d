"""The recording in the views, in one neutral colour: a thin line under the motion, rings about section points."""

from __future__ import annotations

import numpy as np

from nonsmooth.explorer.figures import GREY, MOST
from nonsmooth.explorer.views.view import Request, Requests, Results, View


class RecordingOverlay(View):
    """A recorded motion in four figures."""

    name = "recording"

    def requests(self, base: Requests) -> Requests:
        """The distance of the recording from the motion, once that is there."""
        asked = self.sheet.bench.request(base["orbit"], base["motion"]["period"]) if "motion" in base else None
        return {} if asked is None else {"recording": asked}

    def build(self) -> None:
        """Put lines and rings into the figures of the other views."""
        figures = {name: self.sheet.views[name].figure for name in ("portrait", "history", "diagram", "section")}
        places = {"curve": "portrait", **{name: name for name in figures}}
        self._sources = {key: figures[name].source("x", "y", name=f"recorded {key}") for key, name in places.items()}
        for key in ("curve", "history"):
            self.ink(
                GREY,
                figures[places[key]].plot.line(
                    "x", "y", source=self._sources[key], line_width=1, line_alpha=0.6, level="underlay"
                ),
            )
        self._rings = [
            figures[key].plot.scatter(
                "x",
                "y",
                source=self._sources[key],
                fill_color=None,
                line_width=1.2,
                line_alpha=0.7,
                level="annotation" if key == "diagram" else "underlay",
            )
            for key in ("diagram", "portrait", "section")
        ]
        self.ink(GREY, *self._rings)
        self._figures = figures

    def show(self, job: Request, found: Results) -> None:
        """Hand what was found to the bench, and draw the motion anew beside it."""
        self.sheet.bench.put(found["laid"])
        self._redraw_all()

    def _redraw_all(self) -> None:
        self.redraw()
        for name in ("portrait", "history", "section", "readout"):
            self.sheet.views[name].redraw()

    def redraw(self) -> None:
        """Draw the recording where the page shows the states that it holds."""
        state = self.state
        found = self.sheet.bench.laid or {"curve": {}, "section": {}, "history": {}}
        points = found["section"].get(state.shown, np.empty(0))
        here = {"here": np.full(len(points), state.values[state.over]), state.shown: points}
        for key, columns, x, y in (
            ("curve", found["curve"], state.x, state.y),
            ("history", found["history"], "time", state.x),
            ("portrait", found["section"], state.x, state.y),
            ("section", found["section"], state.x, state.y),
            ("diagram", here, "here", state.shown),
        ):
            there = x in columns and y in columns
            drawn = (columns[x], columns[y]) if there else (np.empty(0), np.empty(0))
            self._sources[key].data = dict(zip("xy", drawn, strict=True))
        for renderer in self._rings:
            renderer.glyph.size = 10 if len(points) <= MOST else 3
        curve, history = (self._sources[key].data for key in ("curve", "history"))
        for name in ("portrait", "section"):
            self._figures[name].beside = curve["x"], curve["y"]
        self._figures["history"].beside = [], history["y"]

    def place(self) -> None:
        """Take away what was laid over another setup or model."""
        if self.sheet.bench.laid is None and any(len(one.data["x"]) for one in self._sources.values()):
            self._redraw_all()

    def clear(self) -> None:
        """Find the channels of the next model's states."""
        self.sheet.bench.arrange()
