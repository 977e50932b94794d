"""Classes over a plane as an image: a chart of period numbers over two parameters, basins of attraction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from bokeh.models import CustomJSHover, LinearColorMapper

from nonsmooth.arrays import FloatArray
from nonsmooth.explorer.catalogue import first_state
from nonsmooth.explorer.figures import Panel, cells_of
from nonsmooth.explorer.views.motion import Portrait
from nonsmooth.explorer.views.view import Ends, Legend, Request, Requests, Results, View
from nonsmooth.plot import style
from nonsmooth.plot.planes import classes_of, legend_of, names_of
from nonsmooth.plot.style import COLORS

if TYPE_CHECKING:
    from nonsmooth.explorer.state import PageState

_NOTHING = -1e300  # Bokeh writes NaN itself, and asks no formatter
_PLACE = "return Number((value / Math.pow(10, power)).toPrecision(5)).toString().replace('-', '\\u2212') + unit;"
_MORE = "return value > -1e299 ? before + value.toPrecision(3).replace('-', '\\u2212') + after : '';"


class CellImage(View):
    """An image in whose cells a number stands for a class, with marks over it."""

    def build(self) -> None:
        """The image, its words, marks, and the place of the page."""
        self.figure = Panel(self.name)
        plot, empty = self.figure.plot, np.full((1, 1), np.nan)
        self._image = self.figure.source(
            name=f"{self.name} cells", image=[empty], more=[empty], x=[0.0], y=[0.0], dw=[1.0], dh=[1.0], stage=[""]
        )
        self._legend: Legend = []
        self._mapper = LinearColorMapper(palette=["#FFFFFF"], low=-0.5, high=0.5, nan_color="rgba(0,0,0,0)")
        image = plot.image("image", "x", "y", "dw", "dh", source=self._image, color_mapper=self._mapper, level="image")
        self._places = {
            axis: CustomJSHover(args={"power": 0, "unit": ""}, code=f"value = special_vars.{axis}; {_PLACE}")
            for axis in "xy"
        }
        self._words = CustomJSHover(args={"words": [""]}, code="return words[value] ?? '';")
        self._more = CustomJSHover(args={"before": "", "after": ""}, code=_MORE)
        self.figure.tell(
            image,
            point_policy="follow_mouse",
            tooltips='<div style="font:13px system-ui">$x{custom}, $y{custom}: @image{custom}@more{custom}</div>',
            formatters={"$x": self._places["x"], "$y": self._places["y"], "@image": self._words, "@more": self._more},
        )
        plot.grid.visible = False
        self.points = self.figure.source("x", "y", "marker", name=f"{self.name} points")
        plot.scatter("x", "y", marker="marker", source=self.points, size=8, fill_color="#FFFFFF", line_color="#1B1F24")
        self.here = self.figure.source("x", "y", name=f"{self.name} here")
        for color, width in (("#FFFFFF", 5), (COLORS["section"], 2)):  # seen on every colour
            plot.scatter("x", "y", marker="cross", source=self.here, size=18, line_color=color, line_width=width)

    def put(
        self,
        x: FloatArray,
        y: FloatArray,
        classes: Any,
        entries: Sequence[tuple[str, str]],
        stage: str,
        more: FloatArray | None = None,
        unit: str = "1",
    ) -> None:
        """Draw classes (y, x), numbers of ``entries`` (words, colour); ``more`` are exponents in a unit."""
        self._mapper.update(palette=[color for _, color in entries], low=-0.5, high=len(entries) - 0.5)
        self._words.args = {"words": [words for words, _ in entries]}
        self._more.args = {"before": ", exponent near ", "after": "" if unit == "1" else f" {unit}"}
        self._image.data = {
            "image": [classes.astype(np.float64)],
            "more": [np.full(classes.shape, _NOTHING) if more is None else np.nan_to_num(more, nan=_NOTHING)],
            **cells_of(x, y),
            "stage": [stage],
        }

    def legend(self) -> Legend:
        """The classes that the picture has."""
        return self._legend if self.name in self.results else []

    def name_axes(self, x: str, y: str, of: str = "") -> None:
        """Label the axes, in the prefixes that the words below the mouse have too."""
        super().name_axes(x, y, of)
        for key, axis in (("x", self.figure.x), ("y", self.figure.y)):
            self._places[key].args = dict(axis.axis.formatter.args)


class Chart(CellImage):
    """Period numbers over the diagram's parameter and a second one, from the initial state at rest."""

    name, over, ends = "chart", True, ("low", "high")

    def requests(self, base: Requests) -> Requests:
        """Each finer than the one before it, and exponents on a grid of their own."""
        across, low, high = (self.setting(name) for name in ("across", "low", "high"))
        sweep = base["first look"]
        values = {name: low if name == across else value for name, value in sweep["values"].items()}
        ends = {"bottom": min(low, high), "top": max(low, high)}
        return self.each({**sweep, "values": values, "across": across, **ends, "columns": 0})

    def build(self) -> None:
        """The image of the classes."""
        super().build()
        self._subject: dict[str, Any] = {}  # of which request the results are

    def show(self, job: Request, found: Results) -> None:
        """Exponents of another range are of no use."""
        subject = {key: value for key, value in job.items() if key != "view"}
        if subject != self._subject:
            self.results, self._subject = dict(found), subject
        if job["view"] != "exponents":
            self._stage = job["view"]
        super().show(job, found)

    def draw(self, result: Any) -> None:
        """Draw the period numbers, and tell the exponents of the nearest points where they are known."""
        over, across = (str(dim) for dim in result["status"].dims[:2])
        x, y = result[over].values, result[across].values
        classes, entries = classes_of(result.transpose(across, over, ...))
        more, unit = None, "1"
        if "exponents" in self.results:
            known = self.results["exponents"]["lyapunov"]
            more = known.sel({over: x, across: y}, method="nearest").transpose(across, over).values
            unit = known.attrs.get("units", "1")
        self.put(x, y, classes, entries, self._stage, more, unit)
        self._legend = [*legend_of(classes, entries)]
        self.figure.show((self.state.low, self.state.high), (float(y[0]), float(y[-1])))
        self.name_axes(over, across)
        self.place()

    def place(self) -> None:
        """Mark the parameters that the page is at."""
        values, across = self.state.values, self.setting("across")
        if "chart" in self.results and across in values:
            self.here.data = {"x": [values[self.state.over]], "y": [values[across]]}

    def tapped(self, x: float, y: float) -> PageState:
        """Go to the nearest point of the chart, and start where its runs started."""
        state, result = self.state, self.results.get("chart")
        if result is None:
            return state
        for dim, value in zip(result["status"].dims[:2], (x, y), strict=True):
            state = state.with_value(str(dim), float(result[dim].sel({dim: value}, method="nearest")))
        return replace(state, start=first_state(state.model, self.system).start)

    def zoomed(self, x: Ends, y: Ends) -> PageState:
        """Compute the range that is seen; the diagram's range is the same."""
        return replace(self.state, low=x[0], high=x[1]).with_settings({"chart.low": y[0], "chart.high": y[1]})


_NEAR = 0.1  # of the window: attractors of two pictures that are this near are one
_MARKS = ("circle", "square", "triangle", "diamond", "inverted_triangle", "hex", "star")


class Basins(CellImage):
    """Initial states in the colour of their attractor, with the attractors' section points; a click starts there."""

    name, ends = "basins", ("left", "right", "bottom", "top")

    def requests(self, base: Requests) -> Requests:
        """Each finer than the one before it; initial values of states outside the plane are the page's."""
        state = self.state
        return self.each(
            {
                **{key: base["orbit"][key] for key in ("text", "values", "method", "eta", "transient")},
                "x": state.x,
                "y": state.y,
                "begin": base["first look"]["begin"],
                "fixed": {name: value for name, value in self.start.items() if name not in (state.x, state.y)},
                "window": [self.setting(end) for end in self.ends],
            }
        )

    def build(self) -> None:
        """The image of the labels."""
        super().build()
        self._known: list[tuple[int, Any]] = []

    def show(self, job: Request, found: Results) -> None:
        """Attractors keep their colours from one picture to the next."""
        if (job["x"], job["y"]) == (self.state.x, self.state.y):
            self._stage = job["view"]
            super().show(job, found)

    def draw(self, result: Any) -> None:
        """Draw labels and section points; nothing where the phase plane has other axes by now."""
        first, second = (str(dim) for dim in result["label"].dims)
        if (first, second) != (self.state.x, self.state.y):
            self.clear()
            return
        x, y = result[first].values, result[second].values
        points, of = result["section_points"].sel(state=[first, second]).values, result["point_attractor"].values
        size, periods = np.array([np.ptp(x), np.ptp(y)]), result["period_number"].values
        numbers = self._numbers([(int(period), points[of == k] / size) for k, period in enumerate(periods)])
        entries = [
            ("diverged", style.DIVERGED),
            ("none reached", style.UNKNOWN),
            *(
                (f"{name}: {100 * share:.3g} %", style.attractor_color(number))
                for name, share, number in zip(names_of(result), result["fraction"].values, numbers, strict=True)
            ),
        ]
        classes = np.maximum(result["label"].transpose(second, first).values, -2) + 2
        self.put(x, y, classes, entries, self._stage)
        self._legend = [entries[k] for k in np.unique(classes)]
        marks = [_MARKS[numbers[k] % len(_MARKS)] if periods[k] else "dot" for k in of]
        self.points.data = {"x": points[:, 0], "y": points[:, 1], "marker": marks}
        drawn = self._image.data
        self.figure.show(*((drawn[at][0], drawn[at][0] + drawn[size][0]) for at, size in (("x", "dw"), ("y", "dh"))))
        self.name_axes(first, second)
        self.place()

    def _numbers(self, found: list[tuple[int, Any]]) -> list[int]:
        """Numbers for colours and marks: that of the nearest attractor of the picture before, else a free one."""
        numbers: list[int] = []
        for period, points in found:
            away = [
                np.inf
                if period != old or k in numbers or not len(points) or not len(there)
                else float(np.linalg.norm(points.mean(axis=0) - there.mean(axis=0)))
                for k, (old, there) in enumerate(self._known)
            ]
            free = (k for k in range(len(self._known) + len(found) + 1) if k not in numbers and k >= len(self._known))
            best = int(np.argmin(away)) if away and min(away) < _NEAR else next(free)
            numbers.append(best)
        known = dict(enumerate(self._known)) | dict(zip(numbers, found, strict=True))
        self._known = [known[k] for k in sorted(known)]
        return numbers

    def place(self) -> None:
        """Mark the initial state."""
        if "basins" in self.results:
            self.here.data = {"x": [self.start[self.state.x]], "y": [self.start[self.state.y]]}

    def clear(self) -> None:
        """Show nothing."""
        super().clear()
        self._known = []

    tapped = Portrait.tapped

    def zoomed(self, x: Ends, y: Ends) -> PageState:
        """Compute the window that is seen."""
        return self.state.with_settings(
            {f"basins.{end}": value for end, value in zip(self.ends, (*x, *y), strict=True)}
        )
