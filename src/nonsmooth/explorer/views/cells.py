"""Classes over a plane as an image: its colours, the words of the cell below the mouse, and a mark."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Cells"]

_NOTHING = -1e300  # Bokeh writes NaN itself, and asks no formatter
_PLACE = "return Number((value / Math.pow(10, power)).toPrecision(5)).toString().replace('-', '\\u2212') + unit;"


class Cells:
    """An image in whose cells a number stands for a class.

    Parameters
    ----------
    name : str
        Of the figure; its source is called ``name cells``.
    """

    def __init__(self, name: str) -> None:
        from bokeh.models import ColumnDataSource, CustomJSHover, HoverTool, LinearColorMapper

        from nonsmooth.explorer.figures import Panel
        from nonsmooth.plot.style import COLORS

        self.panel = Panel(name)
        plot = self.panel.plot
        empty = np.full((1, 1), -1.0)
        self.source = ColumnDataSource(
            name=f"{name} cells",
            data={"image": [empty], "more": [empty], "x": [0.0], "y": [0.0], "dw": [1.0], "dh": [1.0], "stage": [""]},
        )  # fmt: skip
        self.mapper = LinearColorMapper(palette=["#FFFFFF"], low=-0.5, high=0.5, nan_color="rgba(0,0,0,0)")
        image = plot.image(
            "image", "x", "y", "dw", "dh", source=self.source, color_mapper=self.mapper, level="image"
        )
        places = {
            axis: CustomJSHover(args={"power": 0, "unit": ""}, code=f"value = special_vars.{axis}; {_PLACE}")
            for axis in "xy"
        }
        self._places = places
        self._words = CustomJSHover(args={"words": [""]}, code="return words[value] ?? '';")
        self._more = CustomJSHover(
            args={"before": "", "after": ""}, code="return value > -1e299 ? before + value.toPrecision(3)"
            ".replace('-', '\\u2212') + after : '';",
        )  # fmt: skip
        plot.add_tools(HoverTool(
            renderers=[image], point_policy="follow_mouse",
            tooltips='<div style="font:13px system-ui">$x{custom}, $y{custom}: @image{custom}@more{custom}</div>',
            formatters={"$x": places["x"], "$y": places["y"], "@image": self._words, "@more": self._more},
        ))  # fmt: skip
        plot.grid.visible = False
        self.points = ColumnDataSource(name=f"{name} points", data={"x": [], "y": [], "marker": []})
        plot.scatter("x", "y", marker="marker", source=self.points, size=8, fill_color="#FFFFFF", line_color="#1B1F24")
        self.here = ColumnDataSource(name=f"{name} here", data={"x": [], "y": []})
        for color, width in (("#FFFFFF", 5), (COLORS["section"], 2)):  # seen on every colour
            plot.scatter("x", "y", marker="cross", source=self.here, size=18, line_color=color, line_width=width)

    def put(
        self, x: NDArray[np.float64], y: NDArray[np.float64], classes: NDArray[Any], entries: Sequence[tuple[str, str]],
        stage: str, more: NDArray[np.float64] | None = None, around: tuple[str, str] = ("", ""),
    ) -> None:  # fmt: skip
        """Draw classes (y, x), numbers of ``entries`` (words, colour); ``more`` is told with texts ``around`` it."""
        self.mapper.update(palette=[color for _, color in entries], low=-0.5, high=len(entries) - 0.5)
        self._words.args = {"words": [words for words, _ in entries]}
        self._more.args = dict(zip(("before", "after"), around, strict=True))
        steps = [(one[-1] - one[0]) / max(len(one) - 1, 1) for one in (x, y)]
        self.source.data = {
            "image": [classes.astype(np.float64)],
            "more": [np.full(classes.shape, _NOTHING) if more is None else np.nan_to_num(more, nan=_NOTHING)],
            "x": [x[0] - steps[0] / 2], "y": [y[0] - steps[1] / 2], "dw": [steps[0] * len(x)],
            "dh": [steps[1] * len(y)], "stage": [stage],
        }  # fmt: skip

    def name_axes(self, symbols: Mapping[str, str], x: tuple[str, str], y: tuple[str, str]) -> None:
        """Axes with (name, unit) of each, whose prefix the words below the mouse have too."""
        from nonsmooth.explorer.labels import PREFIXES, power_of

        for key, axis, (name, unit) in (("x", self.panel.x, x), ("y", self.panel.y, y)):
            axis.name(symbols[name], unit)
            power = power_of(unit, axis.range.start, axis.range.end)
            text = "" if unit in ("", "1") else f" {PREFIXES[power]}{unit}"
            self._places[key].args = {"power": power, "unit": text}

    def clear(self) -> None:
        """Show nothing."""
        empty = np.full((1, 1), np.nan)
        self.source.data = {**self.source.data, "image": [empty], "more": [empty], "stage": [""]}
        for source in (self.points, self.here):
            source.data = {key: [] for key in source.data}
