"""Frequency response: the amplitude over the forcing frequency, up and down."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.explorer.figures import BLUE, GREY, Panel, extent
from nonsmooth.explorer.labels import number
from nonsmooth.explorer.views.view import Request, View
from nonsmooth.plot.style import COLORS

if TYPE_CHECKING:
    from nonsmooth.explorer.state import State

__all__ = ["Response"]

_POINTS = {"first response": 81, "response": 401}


class Response(View):
    """Half the peak-to-peak value of a state over a parameter, in most models the forcing frequency."""

    name = "response"

    def requests(self, base: Mapping[str, Request]) -> dict[str, Request]:
        """Few frequencies, then many."""
        over, *ends = (self.setting(name) for name in ("over", "low", "high"))
        job = {**base["first look"], "over": over, "low": min(ends), "high": max(ends)}
        job["values"] = {**self.state.values, over: min(ends)}
        return {stage: {**one, "columns": _POINTS[stage]} for stage, one in self.each(job).items()}

    def build(self) -> None:
        """Up solid, down dashed, and a line at the parameter's value."""
        self.figure = Panel("response")
        plot = self.figure.plot
        self._curves = {word: self.figure.source("x", "y", "words", name=f"response {word}") for word in ("up", "down")}
        self._up, down = (plot.line("x", "y", source=source, line_width=2) for source in self._curves.values())
        down.glyph.update(line_color=COLORS["second"], line_dash="dashed")
        self.figure.tell(self._up, down, mode="vline")
        self._here = self.figure.mark()
        self._measured = self.figure.source("x", "y", name="recorded response")
        rings = plot.scatter("x", "y", source=self._measured, size=8, fill_color=None, line_width=1.3)
        self.ink(BLUE, self._up)
        self.ink(GREY, rings)

    def redraw(self) -> None:
        """Draw the amplitude of the state that the diagram shows."""
        result, shown = self.results.get("response"), self.state.shown
        if result is None:
            return
        over = str(result["maximum"].dims[0])
        values, (_, unit), (_, units) = result[over].values, self.quantity(over), self.quantity(shown)
        for word, source in self._curves.items():
            one = result.sel(direction=word)
            amplitude = one["amplitude"].sel(state=shown).values
            words = [
                f"{word}, {number(float(value), unit)}: {number(float(height), units)}, "
                + (f"period {period}" if period else "no period")
                for value, height, period in zip(values, amplitude, one["period_number"].values, strict=True)
            ]
            source.data = {"x": values, "y": amplitude, "words": words}
        self.figure.show((float(values[0]), float(values[-1])))
        self._fit()
        self.name_axes(over, shown)
        self.figure.y.axis.axis_label = f"amplitude of {self.figure.y.axis.axis_label}"
        self.place()

    def place(self) -> None:
        """Mark the value that the page is at."""
        over = self.setting("over")
        self._here.location = self.state.values[over]
        measured = dict(zip("xy", self.sheet.bench.response(over, self.state.shown), strict=True))
        if not all(np.array_equal(self._measured.data[key], one) for key, one in measured.items()):
            self._measured.data = measured
            self._fit()

    def _fit(self) -> None:
        """Show all amplitudes, those of a recording too."""
        drawn = [source.data["y"] for source in (*self._curves.values(), self._measured)]
        self.figure.show(y=(0.0, extent(np.concatenate(drawn))[1]))

    def legend(self) -> list[tuple[str, str]]:
        """Directions of the sweep."""
        return [("up", COLORS["first"]), ("down, dashed", COLORS["second"])]

    def tapped(self, x: float, y: float) -> State:
        """Go to the nearest frequency, on the curve that is nearer to the click."""
        state, result = self.state, self.results.get("response")
        if result is None:
            return state
        over = str(result["maximum"].dims[0])
        one = result.sel({over: x}, method="nearest")
        away = np.abs(one["amplitude"].sel(state=state.shown).values - y)
        at = one["section"].transpose("direction", "iterate", "state").values[np.nan_to_num(away, nan=np.inf).argmin()]
        state = state.with_value(over, float(one[over]))
        return replace(state, start=tuple(at[-1].tolist())) if np.isfinite(at[-1]).all() else state

    def zoomed(self, x: tuple[float, float], y: tuple[float, float]) -> State:
        """Compute the range that is seen."""
        return self.state.with_settings(response__low=x[0], response__high=x[1])

    def unzoomed(self) -> State:
        """Return to the first range."""
        return self.state.with_settings(response__low=None, response__high=None)
