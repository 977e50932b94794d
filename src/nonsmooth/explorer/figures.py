"""The Bokeh figures of the page: a panel with units, sources and marks. They are drawn once; then only data change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, CustomJSTickFormatter, HoverTool, NoOverlap, Range1d, Span
from bokeh.plotting import figure
from bokeh.themes import Theme
from scipy.ndimage import maximum_filter1d

from nonsmooth.arrays import FloatArray
from nonsmooth.explorer.labels import axis_label
from nonsmooth.plot.prefixes import PREFIXES, power_for
from nonsmooth.plot.style import COLORS

MOST = 64  # section points that are told apart one by one
#: Colours on a light, and on a dark ground.
BLUE, GREY, INK = (COLORS["first"], COLORS["pale"]), ("#4A4A4A", "#D0D0D0"), ("#1B1F24", "#E8E8E8")
#: Tooltip with the words of the point below the mouse.
_TIP = '<div style="font:13px system-ui">@words</div>'
_TICKS = "return Number((tick * Math.pow(10, -power)).toPrecision(8)).toString().replace('-', '\\u2212')"


def theme(dark: bool, large: bool) -> Theme:
    """Colours and sizes of all figures."""
    paper, ink, faint, line = (
        ("#171B20", "#E8E8E8", "#2C3239", "#8A929B") if dark else ("#FFFFFF", "#1B1F24", "#E4E7EB", "#6B7280")
    )
    size = 20 if large else 13

    def letters(of: str, pixels: int) -> dict[str, str]:
        looks = {"color": ink, "font": "system-ui, sans-serif", "font_style": "normal", "font_size": f"{pixels}px"}
        return {f"{of}text_{key}": one for key, one in looks.items()}

    return Theme(
        json={
            "attrs": {
                "Plot": {"background_fill_color": paper, "border_fill_color": None, "outline_line_color": line},
                "Grid": {"grid_line_color": faint},
                "BasicTicker": {"desired_num_ticks": 4 if large else 6},
                "Title": {**letters("", size + 2), "standoff": 4},
                "Axis": {
                    "axis_line_color": line,
                    "major_tick_line_color": line,
                    "minor_tick_line_color": None,
                    **letters("axis_label_", size + 2),
                    **letters("major_label_", size),
                    "axis_label_standoff": 6,
                },
            }
        }
    )


@dataclass
class _Axis:
    """An axis with a quantity in the unit whose prefix suits what it shows.

    The words of the ordinate stand level above the frame: beside it a frame that is lower than they are long cuts them.
    """

    axis: Any
    range: Any
    title: Any = None  # of the figure, for the ordinate

    def name(self, latex: str, unit: str, of: str = "") -> None:
        power = power_for(unit, max(abs(self.range.start), abs(self.range.end)))
        self.say(of + axis_label(latex, unit, power))
        text = "" if unit in ("", "1") else f" {PREFIXES[power]}{unit}"
        self.axis.formatter.args = {"power": power, "unit": text}

    def show(self, low: float, high: float) -> None:
        """Set the range, also that which a reset comes back to."""
        self.range.update(start=low, end=high, reset_start=low, reset_end=high)

    def fit(self, values: Any, margin: float = 0.06, anew: bool = False) -> None:
        """Show values with a margin; a range that shows them well stays, unless it is wanted ``anew``."""
        low, high = extent(values, margin)
        start, end, room = self.range.start, self.range.end, 0.05 * (high - low)
        if anew or not (start <= low + room and high - room <= end and high - low > 0.5 * (end - start)):
            self.show(low, high)

    def say(self, words: str | None) -> None:
        if self.title is None:
            self.axis.axis_label = words
        else:
            self.title.text = words or ""


class Panel:
    """A figure with zoom, axes that have units, and ranges that the page sets."""

    def __init__(self, name: str, **options: Any) -> None:
        self.plot: Any = figure(
            name=name,
            tools="pan,box_zoom,wheel_zoom,reset",
            toolbar_location="right",
            sizing_mode="stretch_both",
            min_border=4,
            x_range=Range1d(0, 1),
            y_range=Range1d(0, 1),
            **options,
        )
        self.plot.toolbar.logo = None
        self.plot.toolbar.autohide = True
        for axis in self.plot.axis[:] if "y_axis_type" not in options else self.plot.xaxis:
            axis.formatter = CustomJSTickFormatter(args={"power": 0}, code=_TICKS)
        for axis in self.plot.axis:
            axis.major_label_policy = NoOverlap(min_distance=6)
        self.x = _Axis(self.plot.xaxis[0], self.plot.x_range)
        self.y = _Axis(self.plot.yaxis[0], self.plot.y_range, self.plot.title)
        self.beside: tuple[Any, Any] = ([], [])  # what else the axes must show
        self._sources: list[tuple[ColumnDataSource, dict[str, Any]]] = []

    def source(self, *keys: str, name: str | None = None, **columns: Any) -> ColumnDataSource:
        """A source that :meth:`clear` brings back to what it holds now: empty ``keys`` and ``columns``."""
        data = {**{key: [] for key in keys}, **columns}
        self._sources.append((ColumnDataSource(name=name, data=data), data))
        return self._sources[-1][0]

    def tell(self, *renderers: Any, **options: Any) -> None:
        """Show the ``words`` of what lies below the mouse."""
        self.plot.add_tools(HoverTool(renderers=list(renderers), **{"tooltips": _TIP, **options}))

    def mark(self) -> Span:
        """A line at a value of the abscissa, which its ``location`` sets."""
        here = Span(dimension="height", line_color=COLORS["third"], line_width=1.5, line_dash="dashed")
        self.plot.add_layout(here)
        return here

    def clear(self) -> None:
        """Show nothing, as when another model was chosen."""
        for source, data in self._sources:
            source.data = dict(data)
        for axis in (self.x, self.y):
            axis.say(None)

    def show(self, x: tuple[float, float] | None = None, y: tuple[float, float] | None = None) -> None:
        """Set the ranges, also those that a reset comes back to."""
        for axis, ends in ((self.x, x), (self.y, y)):
            if ends is not None:
                axis.show(*ends)


def cells_of(x: Any, y: Any) -> dict[str, list[float]]:
    """Place and size of an image whose cells are about these values."""
    steps = [(one[-1] - one[0]) / max(len(one) - 1, 1) or 1.0 for one in (x, y)]
    places = {name: [one[0] - step / 2] for name, one, step in zip("xy", (x, y), steps, strict=True)}
    return places | {f"d{name}": [step * len(one)] for name, one, step in zip("wh", (x, y), steps, strict=True)}


def extent(values: Any, margin: float = 0.06) -> tuple[float, float]:
    """Ends of an axis that shows all values."""
    finite = np.asarray(values, dtype=float)
    finite = finite[np.isfinite(finite)]
    if not finite.size:
        return 0.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    room = margin * (high - low) or 0.1 * abs(high) or 1e-6
    return low - room, high + room


#: A cloud: points (columns, n), a colour "#RRGGBB", and the height of a dot in pixels.
Layer = tuple[FloatArray, str, int]
_ALPHA = np.array([0, 150, 205, 255], dtype=np.uint32)  # of 0, 1, 2 and more points in a pixel


def drawn(layers: list[Layer], low: float, high: float, height: int) -> Any:
    """Return an RGBA image (height, columns), rows from below, of point clouds laid over each other.

    A darker pixel holds more points: in chaos the image is the density.
    """
    columns = layers[0][0].shape[0] if layers else 1
    image = np.zeros((height, columns), dtype=np.uint32)
    if not high > low:
        return image
    for points, color, size in layers:
        rows = np.floor((points - low) / (high - low) * height)
        there = np.isfinite(rows) & (rows > -size) & (rows < height)
        column = np.broadcast_to(np.arange(columns)[:, None], points.shape)[there]
        counts = np.bincount(
            rows[there].astype(np.int64).clip(0) * columns + column, minlength=height * columns
        ).reshape(height, columns)
        thick = maximum_filter1d(counts, size, axis=0, mode="constant")
        red, green, blue = (int(color[i : i + 2], 16) for i in (1, 3, 5))
        shade = _ALPHA[np.minimum(thick, 3)] << 24 | np.uint32(blue << 16 | green << 8 | red)
        image = np.where(thick > 0, shade, image)
    return image.astype(np.uint32)
