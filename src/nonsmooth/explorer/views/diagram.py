"""Section points over a parameter, as an image; a line marks the parameter's value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.explorer.figures import Panel, extent
from nonsmooth.explorer.labels import number
from nonsmooth.explorer.raster import Layer, drawn
from nonsmooth.explorer.requests import key_of
from nonsmooth.explorer.state import CHOICES
from nonsmooth.explorer.views.view import Request, View
from nonsmooth.plot.labels import in_words
from nonsmooth.plot.style import COLORS

if TYPE_CHECKING:
    from nonsmooth.explorer.state import State

__all__ = ["Diagram"]

_HEIGHT = 400  # pixels of an image before the page has said how large it is
#: Names of a cloud in the legend, with their colours and the height of a dot.
_CLOUDS = {
    "first look": ("#7F7F7F", 2), "up": (COLORS["pale"], 4), "down": (COLORS["second"], 2),
    "rest": (COLORS["first"], 2), "many": (COLORS["third"], 2),
}  # fmt: skip


class Diagram(View):
    """A first look, then the diagram with period numbers."""

    name = "diagram"

    def depends(self, old: tuple[str, str], new: tuple[str, str]) -> bool:
        """Return whether either changed."""
        return old != new

    def requests(self, base: Mapping[str, Request]) -> dict[str, Request]:
        """A sweep that nothing judges, and one with a direction."""
        sweep = base["first look"]
        return {"first look": sweep, "diagram": {**sweep, "view": "diagram", "direction": self.state.direction}}

    def build(self) -> None:
        """The image, and bars that tell the period numbers of a column."""
        self.figure = Panel("diagram")
        plot, empty = self.figure.plot, np.zeros((1, 1), np.uint32)
        ends: dict[str, Any] = {"x": [0.0], "y": [0.0], "dw": [1.0], "dh": [1.0]}
        self._image = self.figure.source(name="diagram image", image=[empty], **ends, stage=[""], of=[""])
        plot.image_rgba("image", "x", "y", "dw", "dh", source=self._image)
        self._columns = self.figure.source("value", "low", "high", "words", "period", "status", name="columns")
        bars = plot.segment(
            "value", "low", "value", "high", source=self._columns, line_alpha=0.0, line_width=4, hover_line_alpha=0.25,
            hover_line_color=COLORS["muted"],
        )  # fmt: skip
        self.figure.tell(bars, mode="vline", line_policy="interp", attachment="right", point_policy="follow_mouse")
        self._here = self.figure.mark()
        self._shown: dict[str, Any] = {}  # the request of what is drawn
        self._pixels = _HEIGHT
        self._fitted: tuple[str, ...] = ()
        plot.on_change("inner_height", lambda attr, old, new: self._resize(int(new)))

    def _resize(self, pixels: int) -> None:
        self._pixels = max(pixels, 50)
        self.redraw()

    def show(self, job: Request, found: Mapping[str, Any]) -> None:
        """Draw a sweep, and tell its period numbers where they were judged."""
        self._shown = job
        super().show(job, found)
        if job["view"] == "first look":
            return
        result, over = found["diagram"], self.state.over
        values, unit = result[over].values, self.quantity(over)[1]
        arrays = (result["period_number"], result["status"].copy(data=in_words(result["status"])))
        periods, names = (one.transpose(over, ...).values.reshape(len(values), -1) for one in arrays)
        words = []
        for value, some, told in zip(values, periods, names, strict=True):
            kinds = dict.fromkeys(
                f"period {p}" if p else ("no period" if w in ("ok", "not_periodic") else w.replace("_", " "))
                for p, w in zip(some, told, strict=True)
            )
            words.append(f"{number(float(value), unit)}: {' / '.join(kinds)}")
        low, high = self.figure.plot.y_range.start, self.figure.plot.y_range.end
        self._columns.data = {
            "value": values, "low": np.full(len(values), low - 10 * (high - low)),
            "high": np.full(len(values), high + 10 * (high - low)), "words": words,
            "period": periods[:, 0], "status": [str(row) for row in names[:, 0]],
        }  # fmt: skip

    def clear(self) -> None:
        """Show nothing, as when another model or parameter was chosen."""
        super().clear()
        self._shown, self._fitted = {}, ()

    def redraw(self) -> None:
        """Draw the points anew, as at another zoom."""
        result, state = self.results.get("diagram"), self.state
        if result is None:
            return
        points, values = result["section"].sel(state=state.shown), result[state.over].values
        finite = points.values[np.isfinite(points.values)]
        key = (state.model, state.over, state.shown)
        if finite.size and (key != self._fitted or not self._fits(finite)):
            # a few points far out, of columns that have not settled, do not decide the axis
            self.figure.show(y=extent(np.quantile(finite, [0.001, 0.999]), 0.08))
            self._fitted = key
        low, high = self.figure.plot.y_range.start, self.figure.plot.y_range.end
        step = (values[-1] - values[0]) / max(len(values) - 1, 1) or 1.0
        self._image.data = {
            "image": [drawn(self._layers(points), low, high, self._pixels)], "x": [values[0] - step / 2], "y": [low],
            "dw": [step * len(values)], "dh": [high - low], "of": [key_of(self._shown)],
            "stage": ["judged" if self._shown["view"] == "diagram" else "first look"],
        }  # fmt: skip
        self.name_axes(state.over, state.shown)

    def _fits(self, points: Any) -> bool:
        """Return True if the present axis shows the points and they fill it well."""
        low, high = np.quantile(points, [0.001, 0.999])
        start, end = self.figure.plot.y_range.start, self.figure.plot.y_range.end
        return bool(start <= low and high <= end and high - low > 0.55 * (end - start))

    def _clouds(self, direction: str) -> list[str]:
        """Names of the clouds that the diagram has, in a sweep of this direction."""
        if self._shown.get("view") != "diagram":
            return ["first look"]
        return ["up", "down"] if direction == "both" else [direction]

    def _layers(self, points: Any) -> list[Layer]:
        # the state may have another direction by now
        words = self._clouds(self._shown.get("direction", ""))
        each = [points.sel(direction=word) for word in words] if "direction" in points.dims else [points]
        over = self.state.over
        flat = (one.transpose(over, ...).values.reshape(one.sizes[over], -1) for one in each)
        return [(cloud, *_CLOUDS[word]) for cloud, word in zip(flat, words, strict=True)]

    def place(self) -> None:
        """Mark the value that the page is at, in the range that it has."""
        state, shown = self.state, self.figure.plot.x_range
        self._here.location = state.values[state.over]
        if (shown.start, shown.end) != (state.low, state.high):
            self.figure.show(x=(state.low, state.high))

    def legend(self) -> list[tuple[str, str]]:
        """Clouds in the direction of the page."""
        names = {"first look": "first look, from rest, not judged", **CHOICES["direction"]}
        return [(names[word], _CLOUDS[word][0]) for word in self._clouds(self.state.direction)]

    def tapped(self, x: float, y: float) -> State:
        """Go to the next column, and start at the section point of it next to the click."""
        state, result = self.state, self.results.get("diagram")
        if result is None:
            return state.with_value(state.over, x)
        one = result.sel({state.over: x}, method="nearest")
        points = one["section"].transpose(..., "iterate", "state").values.reshape(-1, one.sizes["state"])
        away = np.abs(points[:, list(self.system.states).index(state.shown)] - y)
        state = state.with_value(state.over, float(one[state.over]))
        if not np.isfinite(away).any():
            return state
        return replace(state, start=tuple(points[np.nanargmin(away)].tolist()))

    def zoomed(self, x: tuple[float, float], y: tuple[float, float]) -> State:
        """Compute the range that is seen."""
        self.redraw()
        return replace(self.state, low=x[0], high=x[1])
