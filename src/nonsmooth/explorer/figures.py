"""The Bokeh figures of the page, and how results are put into them. They are drawn once; then only data change."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from bokeh.models import (
    BoxAnnotation,
    ColumnDataSource,
    CustomJSTickFormatter,
    GlyphRenderer,
    HoverTool,
    Range1d,
    Span,
)
from bokeh.plotting import figure
from bokeh.themes import Theme

from nonsmooth.explorer.labels import axis_label, number, power_of
from nonsmooth.explorer.raster import Layer, drawn
from nonsmooth.plot.labels import column, words_of_flags
from nonsmooth.plot.segments import pieces_by_mode, with_gaps
from nonsmooth.plot.style import COLORS

__all__ = ["CLOUDS", "MOST", "TIP", "Diagram", "History", "Panel", "Portrait", "Section", "extent", "theme"]

_MODES = [COLORS[name] for name in ("first", "second", "third", "fourth")]
_MANY_MODES = 8
MOST = 64  # section points that are told apart one by one
_HEIGHT = 400  # of an image before the page has said how large it is
_NO_IMAGE = {
    "image": [np.zeros((1, 1), np.uint32)], "x": [0.0], "y": [0.0], "dw": [1.0], "dh": [1.0], "stage": [""], "of": [""],
}  # fmt: skip
#: Tooltip with the words of the point below the mouse.
TIP = '<div style="font:13px system-ui">@words</div>'
_TICKS = "return Number((tick * Math.pow(10, -power)).toPrecision(8)).toString().replace('-', '\\u2212')"
#: Names of a cloud in the legend of a diagram, with their colours and the height of a dot.
CLOUDS = {
    "first look": ("#7F7F7F", 2), "up": (COLORS["pale"], 4), "down": (COLORS["second"], 2),
    "rest": (COLORS["first"], 2), "many": (COLORS["third"], 2),
}  # fmt: skip


def theme(dark: bool, large: bool) -> Theme:
    """Colours and sizes of all figures."""
    paper, ink, faint, line = (
        ("#171B20", "#E8E8E8", "#2C3239", "#8A929B") if dark else ("#FFFFFF", "#1B1F24", "#E4E7EB", "#6B7280")
    )
    size = 20 if large else 13
    return Theme(json={"attrs": {
        "Plot": {"background_fill_color": paper, "border_fill_color": None, "outline_line_color": line},
        "Grid": {"grid_line_color": faint},
        "Axis": {
            "axis_line_color": line, "major_tick_line_color": line, "minor_tick_line_color": None,
            "axis_label_text_color": ink, "axis_label_text_font_style": "normal",
            "axis_label_text_font_size": f"{size + 2}px", "axis_label_text_font": "system-ui, sans-serif",
            "major_label_text_color": ink, "major_label_text_font_size": f"{size}px",
            "major_label_text_font": "system-ui, sans-serif", "axis_label_standoff": 6,
        },
    }})  # fmt: skip


@dataclass
class _Axis:
    """An axis with a quantity in the unit whose prefix suits what it shows."""

    axis: Any
    range: Any

    def name(self, latex: str, unit: str) -> None:
        power = power_of(unit, self.range.start, self.range.end)
        self.axis.axis_label = axis_label(latex, unit, power)
        self.axis.formatter.args = {"power": power}


class Panel:
    """A figure without title, with zoom, axes that have units, and ranges that the page sets."""

    def __init__(self, name: str, tools: str = "pan,box_zoom,wheel_zoom,reset", **options: Any) -> None:
        self.plot: Any = figure(
            name=name, tools=tools, toolbar_location="right", sizing_mode="stretch_both", min_border=4,
            x_range=Range1d(0, 1), y_range=Range1d(0, 1), **options,
        )  # fmt: skip
        self.plot.toolbar.logo = None
        self.plot.toolbar.autohide = True
        for axis in self.plot.axis[:] if "y_axis_type" not in options else self.plot.xaxis:
            axis.formatter = CustomJSTickFormatter(args={"power": 0}, code=_TICKS)
        self.x = _Axis(self.plot.xaxis[0], self.plot.x_range)
        self.y = _Axis(self.plot.yaxis[0], self.plot.y_range)
        self.beside: tuple[Any, Any] = ([], [])  # what else the axes must show

    def clear(self) -> None:
        """Show nothing, as when another model was chosen."""
        for renderer in self.plot.renderers:
            if isinstance(renderer, GlyphRenderer):
                source = renderer.data_source
                source.data = {key: source.data[key][:0] for key in source.data}
        for axis in (self.x, self.y):
            axis.axis.axis_label = None

    def show(self, x: tuple[float, float] | None = None, y: tuple[float, float] | None = None) -> None:
        """Set the ranges, also those that a reset comes back to."""
        for one, ends in ((self.plot.x_range, x), (self.plot.y_range, y)):
            if ends is not None:
                one.update(start=ends[0], end=ends[1], reset_start=ends[0], reset_end=ends[1])


def extent(values: Any, margin: float = 0.06) -> tuple[float, float]:
    """Ends of an axis that shows all values."""
    finite = np.asarray(values, dtype=float)
    finite = finite[np.isfinite(finite)]
    if not finite.size:
        return 0.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    room = margin * (high - low) or 0.1 * abs(high) or 1e-6
    return low - room, high + room


class Diagram(Panel):
    """Section points over a parameter, as an image; a line marks the parameter's value."""

    def __init__(self) -> None:
        super().__init__("diagram")
        self.image = ColumnDataSource(name="diagram image", data=_NO_IMAGE)
        self.plot.image_rgba("image", "x", "y", "dw", "dh", source=self.image)
        keys = ("value", "low", "high", "words", "period", "status")
        self.columns = ColumnDataSource(name="columns", data={key: [] for key in keys})
        bars = self.plot.segment(
            "value", "low", "value", "high", source=self.columns, line_alpha=0.0, line_width=4, hover_line_alpha=0.25,
            hover_line_color=COLORS["muted"],
        )  # fmt: skip
        self.plot.add_tools(HoverTool(
            renderers=[bars], mode="vline", line_policy="interp", attachment="right",
            tooltips=TIP, point_policy="follow_mouse",
        ))  # fmt: skip
        self.here = Span(dimension="height", line_color=COLORS["third"], line_width=1.5, line_dash="dashed")
        self.plot.add_layout(self.here)
        self.result: Any = None
        self.stage = self._cloud = ""
        self.pixels = _HEIGHT
        self._fitted: tuple[str, str] | None = None

    def put(self, result: Any, stage: str, state: Any, of: str, unit: str) -> None:
        """Draw a sweep; ``stage`` is "first look" or "judged", ``of`` says of which request."""
        self.result, self.stage = result, stage
        self._cloud = json.loads(of).get("direction", "")  # the state may have another one by now
        self.redraw(state, of)
        if stage != "judged":
            return
        values = result[state.over].values
        flat = [name for name in ("direction", "start") if name in result["period_number"].dims]
        periods = result["period_number"].transpose(state.over, *flat).values.reshape(len(values), -1)
        names = words_of(result["status"])
        words = []
        for value, some, told in zip(
            values, periods, names.reshape(len(values), -1) if flat else names[:, None], strict=True
        ):
            found = " / ".join(dict.fromkeys(
                f"period {p}" if p else ("no period" if w in ("ok", "not_periodic") else w.replace("_", " "))
                for p, w in zip(some, told, strict=True)
            ))  # fmt: skip
            words.append(f"{number(float(value), unit)}: {found}")
        low, high = self.plot.y_range.start, self.plot.y_range.end
        self.columns.data = {
            "value": values, "low": np.full(len(values), low - 10 * (high - low)),
            "high": np.full(len(values), high + 10 * (high - low)), "words": words,
            "period": periods[:, 0], "status": [str(row) for row in names.reshape(len(values), -1)[:, 0]],
        }  # fmt: skip

    def clear(self) -> None:
        """Show nothing, as when another model or parameter was chosen."""
        super().clear()
        self.result, self.stage, self._fitted = None, "", None
        self.image.data = _NO_IMAGE

    def redraw(self, state: Any, of: str | None = None) -> None:
        """Draw the points anew, as at another zoom."""
        if self.result is None:
            return
        points = column(self.result, "section", state.shown)
        values = self.result[state.over].values
        key = (state.model, state.over + state.shown)
        finite = points.values[np.isfinite(points.values)]
        if finite.size and (key != self._fitted or not self._fits(finite)):
            # a few points far out, of columns that have not settled, do not decide the axis
            low, high = np.quantile(finite, [0.001, 0.999])
            self.show(y=extent([low, high], 0.08))
            self._fitted = key
        low, high = self.plot.y_range.start, self.plot.y_range.end
        step = (values[-1] - values[0]) / max(len(values) - 1, 1) or 1.0
        old = self.image.data
        self.image.data = {
            "image": [drawn(self._layers(points, state), low, high, self.pixels)],
            "x": [values[0] - step / 2], "y": [low], "dw": [step * len(values)], "dh": [high - low],
            "stage": [self.stage], "of": [old["of"][0] if of is None else of],
        }  # fmt: skip

    def _fits(self, points: Any) -> bool:
        """Return True if the present axis shows the points and they fill it well."""
        low, high = np.quantile(points, [0.001, 0.999])
        start, end = self.plot.y_range.start, self.plot.y_range.end
        return bool(start <= low and high <= end and high - low > 0.55 * (end - start))

    def _layers(self, points: Any, state: Any) -> list[Layer]:
        over = state.over

        def flat(cloud: Any) -> Any:
            return cloud.transpose(over, ...).values.reshape(cloud.sizes[over], -1)

        if self.stage != "judged":
            return [(flat(points), *CLOUDS["first look"])]
        if "direction" in points.dims:
            words = [str(word) for word in points["direction"].values]
            return [(flat(points.isel(direction=k)), *CLOUDS[word]) for k, word in enumerate(words)]
        return [(flat(points), *CLOUDS[self._cloud])]

    def nearest(self, x: float, y: float, state: Any) -> tuple[float, tuple[float, ...] | None]:
        """The column next to a place, and the section point of it next to that place."""
        if self.result is None:
            return x, None
        one = self.result.sel({state.over: x}, method="nearest")
        points = one["section"].transpose(..., "state").values.reshape(-1, one.sizes["state"])
        shown = column(one, "section", state.shown).values.reshape(-1)
        if not np.isfinite(shown).any():
            return float(one[state.over]), None
        if "iterate" in one.dims and one["section"].dims[-2] != "iterate":
            points = one["section"].transpose(..., "iterate", "state").values.reshape(-1, one.sizes["state"])
            shown = column(one, "section", state.shown).transpose(..., "iterate").values.reshape(-1)
        at = points[np.nanargmin(np.abs(shown - y))]
        return float(one[state.over]), tuple(float(value) for value in at)


def words_of(status: Any) -> Any:
    """The names of statuses, with the dims of the statuses."""
    names = dict(zip(np.atleast_1d(status.attrs["flag_values"]).tolist(), words_of_flags(status), strict=True))
    return np.vectorize(lambda code: names.get(int(code), "?"), otypes=[object])(status.values)


class _Curves(Panel):
    """Lines in one colour per mode."""

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        self.sources = [ColumnDataSource(data={"x": [], "y": []}) for _ in range(_MANY_MODES)]
        self.lines = [
            self.plot.line("x", "y", source=source, line_color=_MODES[k % len(_MODES)], line_width=1.6)
            for k, source in enumerate(self.sources)
        ]

    def paint(self, dark: bool) -> None:
        """Take the colours that are told apart on a light or a dark ground."""
        self.lines[0].glyph.line_color = COLORS["pale" if dark else "first"]

    def _put(self, run: Any, xs: Any, ys: Any) -> None:
        mode, *cut = with_gaps(run, run["mode"].values.astype(float), xs, ys)
        pieces = pieces_by_mode(np.nan_to_num(mode, nan=-1).astype(int), *cut)
        for k, source in enumerate(self.sources):
            x, y = pieces[k] if k < len(pieces) else ([], [])
            source.data = {"x": x, "y": y}


class Portrait(_Curves):
    """The orbit in the plane of two states, with its section points and the contact zone."""

    def __init__(self) -> None:
        super().__init__("portrait")
        self.zone = BoxAnnotation(
            fill_color=COLORS["zone"], fill_alpha=0.14, line_alpha=0, level="underlay", visible=False
        )
        self.plot.add_layout(self.zone)
        self.points = ColumnDataSource(data={"x": [], "y": []})
        self.dots = self.plot.scatter(
            "x", "y", source=self.points, size=7, fill_color=COLORS["zone"], line_color="#1B1F24", line_width=1.0
        )

    def put(self, run: Any, state: Any, symbols: Any, units: Any, zone: float | None, is_map: bool) -> None:
        """Draw a trajectory; the axes stay where they are as long as they show it well."""
        xs, ys = (column(run, "u", name).values for name in (state.x, state.y))
        self._put(run, xs, ys)
        for line in self.lines:  # of a map the iterates alone
            line.visible = not is_map
        for axis, values, also, name in ((self.x, xs, self.beside[0], state.x), (self.y, ys, self.beside[1], state.y)):
            ends = extent(np.concatenate([values, also]))
            own = axis.range.start, axis.range.end
            fits = own[0] <= ends[0] + 0.05 * (ends[1] - ends[0]) and ends[1] - 0.05 * (ends[1] - ends[0]) <= own[1]
            if not (fits and ends[1] - ends[0] > 0.5 * (own[1] - own[0])):
                axis.range.update(start=ends[0], end=ends[1], reset_start=ends[0], reset_end=ends[1])
            axis.name(symbols[name], units[name])
        self.zone.update(left=zone, visible=zone is not None)

    def clear(self) -> None:
        """Show nothing, the contact zone included."""
        super().clear()
        self.zone.visible = False

    def mark(self, points: Any) -> None:
        """Section points (n, 2)."""
        self.points.data = {"x": points[:, 0], "y": points[:, 1]}


class History(_Curves):
    """A state over time, with its crossings."""

    def __init__(self) -> None:
        super().__init__("history")
        self.crossings = ColumnDataSource(data={"x": [], "y": []})
        self.plot.scatter("x", "y", source=self.crossings, size=5, fill_color=None, line_color=COLORS["muted"])

    def put(self, run: Any, state: Any, symbols: Any, units: Any) -> None:
        """Draw the last of a trajectory."""
        time = run["time"].values
        self._put(run, time, column(run, "u", state.x).values)
        at = [str(name) for name in run["state"].values].index(state.x)
        self.crossings.data = {"x": run["crossing_time"].values, "y": run["u_before"].values[:, at]}
        values = np.concatenate([column(run, "u", state.x).values, self.beside[1]])
        self.show((float(time[0]), float(time[-1])), extent(values))
        self.x.name("t", str(run["time"].attrs.get("units", "1")))
        self.y.name(symbols[state.x], units[state.x])


class Section(Panel):
    """Section points in the phase plane."""

    def __init__(self) -> None:
        super().__init__("section")
        self.orbit = ColumnDataSource(data={"x": [], "y": []})
        self.plot.line("x", "y", source=self.orbit, line_color=COLORS["muted"], line_alpha=0.6, line_width=1)
        self.points = ColumnDataSource(name="section points", data={"x": [], "y": []})
        self.dots = self.plot.scatter(
            "x", "y", source=self.points, size=4, line_color=None, fill_color=COLORS["first"], fill_alpha=0.75
        )

    def paint(self, dark: bool) -> None:
        """Take the colour that shows on a light or a dark ground."""
        self.dots.glyph.fill_color = COLORS["pale" if dark else "first"]

    def put(self, points: Any, run: Any, state: Any, symbols: Any, units: Any) -> None:
        """Draw points (n, 2): a few as large dots on the whole orbit, so that they move in it with the phase."""
        few = len(points) <= MOST
        self.points.data = {"x": points[:, 0], "y": points[:, 1]}
        self.dots.glyph.update(size=9 if few else 2.5, fill_alpha=1.0 if few else 0.75)
        curves = [] if run is None else [column(run, "u", name).values for name in (state.x, state.y)]
        self.orbit.data = {"x": curves[0], "y": curves[1]} if few and curves else {"x": [], "y": []}
        orbit = curves if few and curves else [np.empty(0), np.empty(0)]
        self.show(*(extent(np.concatenate([points[:, k], orbit[k], self.beside[k]]), 0.08) for k in (0, 1)))
        self.x.name(symbols[state.x], units[state.x])
        self.y.name(symbols[state.y], units[state.y])
