"""Classes over a plane as an image: its colours, the words of the cell below the mouse, and a mark."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from bokeh.models import CustomJSHover, LinearColorMapper

from nonsmooth.explorer.figures import Panel
from nonsmooth.explorer.labels import PREFIXES, power_of
from nonsmooth.explorer.views.view import View
from nonsmooth.plot.style import COLORS

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Cells"]

_NOTHING = -1e300  # Bokeh writes NaN itself, and asks no formatter
_PLACE = "return Number((value / Math.pow(10, power)).toPrecision(5)).toString().replace('-', '\\u2212') + unit;"
_MORE = "return value > -1e299 ? before + value.toPrecision(3).replace('-', '\\u2212') + after : '';"


class Cells(View):
    """An image in whose cells a number stands for a class, with marks over it."""


    def build(self) -> None:
        """The image, its words, marks, and the place of the page."""
        self.figure = Panel(self.name)
        plot, empty = self.figure.plot, np.full((1, 1), np.nan)
        ends: dict[str, Any] = {"x": [0.0], "y": [0.0], "dw": [1.0], "dh": [1.0]}
        self._image = self.figure.source(name=f"{self.name} cells", image=[empty], more=[empty], **ends, stage=[""])
        self._mapper = LinearColorMapper(palette=["#FFFFFF"], low=-0.5, high=0.5, nan_color="rgba(0,0,0,0)")
        image = plot.image(
            "image", "x", "y", "dw", "dh", source=self._image, color_mapper=self._mapper, level="image"
        )
        self._places = {
            axis: CustomJSHover(args={"power": 0, "unit": ""}, code=f"value = special_vars.{axis}; {_PLACE}")
            for axis in "xy"
        }
        self._words = CustomJSHover(args={"words": [""]}, code="return words[value] ?? '';")
        self._more = CustomJSHover(args={"before": "", "after": ""}, code=_MORE)
        self.figure.tell(
            image, point_policy="follow_mouse",
            tooltips='<div style="font:13px system-ui">$x{custom}, $y{custom}: @image{custom}@more{custom}</div>',
            formatters={"$x": self._places["x"], "$y": self._places["y"], "@image": self._words, "@more": self._more},
        )  # fmt: skip
        plot.grid.visible = False
        self.points = self.figure.source("x", "y", "marker", name=f"{self.name} points")
        plot.scatter("x", "y", marker="marker", source=self.points, size=8, fill_color="#FFFFFF", line_color="#1B1F24")
        self.here = self.figure.source("x", "y", name=f"{self.name} here")
        for color, width in (("#FFFFFF", 5), (COLORS["section"], 2)):  # seen on every colour
            plot.scatter("x", "y", marker="cross", source=self.here, size=18, line_color=color, line_width=width)

    def put(
        self, x: NDArray[np.float64], y: NDArray[np.float64], classes: NDArray[Any], entries: Sequence[tuple[str, str]],
        stage: str, more: NDArray[np.float64] | None = None, unit: str = "1",
    ) -> None:  # fmt: skip
        """Draw classes (y, x), numbers of ``entries`` (words, colour); ``more`` are exponents in a unit."""
        self._mapper.update(palette=[color for _, color in entries], low=-0.5, high=len(entries) - 0.5)
        self._words.args = {"words": [words for words, _ in entries]}
        self._more.args = {"before": ", exponent near ", "after": "" if unit == "1" else f" {unit}"}
        steps = [(one[-1] - one[0]) / max(len(one) - 1, 1) for one in (x, y)]
        self._image.data = {
            "image": [classes.astype(np.float64)],
            "more": [np.full(classes.shape, _NOTHING) if more is None else np.nan_to_num(more, nan=_NOTHING)],
            "x": [x[0] - steps[0] / 2], "y": [y[0] - steps[1] / 2], "dw": [steps[0] * len(x)],
            "dh": [steps[1] * len(y)], "stage": [stage],
        }  # fmt: skip

    def name_axes(self, x: str, y: str) -> None:
        """Label the axes, in the prefixes that the words below the mouse have too."""
        super().name_axes(x, y)
        for key, axis, name in (("x", self.figure.x, x), ("y", self.figure.y, y)):
            unit = self.quantity(name)[1]
            power = power_of(unit, axis.range.start, axis.range.end)
            text = "" if unit in ("", "1") else f" {PREFIXES[power]}{unit}"
            self._places[key].args = {"power": power, "unit": text}
