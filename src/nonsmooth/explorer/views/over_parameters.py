"""Views over a parameter: section points as an image, branches over them, and the amplitude of the response."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.explorer.figures import BLUE, GREY, INK, Layer, Panel, cells_of, drawn, extent
from nonsmooth.explorer.labels import number
from nonsmooth.explorer.schedule import key_of
from nonsmooth.explorer.state import CHOICES
from nonsmooth.explorer.views.view import Ends, Legend, Request, Requests, Results, View
from nonsmooth.plot.branches import MARKERS, lines_of, ordinates_of, with_breaks, words_of_kind
from nonsmooth.plot.style import COLORS
from nonsmooth.plot.sweeps import one_branch
from nonsmooth.results.labels import in_words

if TYPE_CHECKING:
    from nonsmooth.explorer.state import PageState

_HEIGHT = 400  # pixels of an image before the page has said how large it is
#: Of a sweep up and down, on a light and a dark ground, in every view.
_DIRECTIONS = {"up": BLUE, "down": (COLORS["second"],) * 2}
#: Clouds of the diagram: their colours, and the height of a dot.
_CLOUDS = {
    "first look": (("#7F7F7F",) * 2, 2),
    "up": (BLUE, 4),
    "down": (_DIRECTIONS["down"], 2),
    "rest": (BLUE, 2),
    "many": ((COLORS["third"],) * 2, 2),
}


class Diagram(View):
    """A first look, then the diagram with period numbers."""

    name, over = "diagram", True

    def requests(self, base: Requests) -> Requests:
        """A sweep that nothing judges, and one with a direction."""
        sweep = base["first look"]
        return {"first look": sweep, "diagram": {**sweep, "view": "diagram", "direction": self.state.direction}}

    def build(self) -> None:
        """The image, and bars that tell the period numbers of a column."""
        self.figure = Panel("diagram")
        plot, empty = self.figure.plot, np.zeros((1, 1), np.uint32)
        self._image = self.figure.source(
            name="diagram image", image=[empty], x=[0.0], y=[0.0], dw=[1.0], dh=[1.0], stage=[""], of=[""]
        )
        plot.image_rgba("image", "x", "y", "dw", "dh", source=self._image)
        self._columns = self.figure.source("value", "low", "high", "words", "period", "status", name="columns")
        bars = plot.segment(
            "value",
            "low",
            "value",
            "high",
            source=self._columns,
            line_alpha=0.0,
            line_width=4,
            hover_line_alpha=0.25,
            hover_line_color=COLORS["muted"],
        )
        self.figure.tell(bars, mode="vline", line_policy="interp", attachment="right", point_policy="follow_mouse")
        self._here = self.figure.mark()
        self._shown: dict[str, Any] = {}  # the request of what is drawn
        self._pixels = _HEIGHT
        self._fitted: tuple[str, ...] = ()
        plot.on_change("inner_height", lambda attr, old, new: self._resize(int(new)))

    def _resize(self, pixels: int) -> None:
        self._pixels = max(pixels, 50)
        self.redraw()

    def show(self, job: Request, found: Results) -> None:
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
            "value": values,
            "low": np.full(len(values), low - 10 * (high - low)),
            "high": np.full(len(values), high + 10 * (high - low)),
            "words": words,
            "period": periods[:, 0],
            "status": [str(row) for row in names[:, 0]],
        }

    def clear(self) -> None:
        """Show nothing, as when another model or parameter was chosen."""
        super().clear()
        self._shown, self._fitted = {}, ()

    def paint(self, dark: bool) -> None:
        """Draw the image in the colours of the ground."""
        super().paint(dark)
        self.redraw()

    def draw(self, result: Any) -> None:
        """Draw the points anew, as at another zoom."""
        state = self.state
        points, values = result["section"].sel(state=state.shown), result[state.over].values
        finite = points.values[np.isfinite(points.values)]
        key = (state.model, state.over, state.shown)
        if finite.size:  # a few points far out, of columns that have not settled, do not decide the axis
            self.figure.y.fit(np.quantile(finite, [0.001, 0.999]), 0.08, key != self._fitted)
            self._fitted = key
        low, high = self.figure.plot.y_range.start, self.figure.plot.y_range.end
        self._image.data = {
            "image": [drawn(self._layers(points), low, high, self._pixels)],
            **cells_of(values, values),
            "y": [low],
            "dh": [high - low],
            "of": [key_of(self._shown)],
            "stage": ["judged" if self._shown["view"] == "diagram" else "first look"],
        }
        self.name_axes(state.over, state.shown)

    def _clouds(self, direction: str) -> list[str]:
        """Names of the clouds that the diagram has, in a sweep of this direction."""
        if self._shown.get("view") != "diagram":
            return ["first look"]
        return ["up", "down"] if direction == "both" else [direction]

    def _layers(self, points: Any) -> list[Layer]:
        # the state may have another direction by now
        words = self._clouds(self._shown.get("direction", ""))
        each = [points.sel(direction=word) for word in words] if "direction" in points.dims else [points]
        over, layers = self.state.over, list[Layer]()
        for word, one in zip(words, each, strict=True):
            colors, size = _CLOUDS[word]
            layers.append((one.transpose(over, ...).values.reshape(one.sizes[over], -1), colors[self.dark], size))
        return layers

    def place(self) -> None:
        """Mark the value that the page is at, in the range that it has."""
        state, shown = self.state, self.figure.plot.x_range
        self._here.location = state.values[state.over]
        if (shown.start, shown.end) != (state.low, state.high):
            self.figure.show(x=(state.low, state.high))

    def legend(self) -> Legend:
        """Clouds in the direction of the page, and the signs of the branches over them."""
        names = {"first look": "quick preview", **CHOICES["direction"]}
        clouds = [(names[word], _CLOUDS[word][0][self.dark]) for word in self._clouds(self.state.direction)]
        return [*clouds, *self.sheet.views["branches"].signs()]

    def tapped(self, x: float, y: float) -> PageState:
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

    def zoomed(self, x: Ends, y: Ends) -> PageState:
        """Compute the range that is seen."""
        self.redraw()
        return replace(self.state, low=x[0], high=x[1])


#: Lines by their stability: name, dash and width.
_LINES = {"-": ("stable", "solid", 1.8), "--": ("unstable", "dashed", 1.3), ":": ("virtual", "dotted", 1.3)}
_STROKES = {"-": "━", "--": "╍", ":": "┈"}  # in the legend
#: Bokeh's names of the pictures' markers, and the letter that shows each in the legend.
_SHAPES = [
    "circle",
    "square",
    "diamond",
    "triangle",
    "triangle_pin",
    "inverted_triangle",
    "x",
    "cross",
    "hex",
    "star",
    "asterisk",
]
_SIGNS = dict(zip("osD^<vXPHp*", zip(_SHAPES, "○□◇△▲▽×+⬡☆∗", strict=True), strict=True))
_WORDS = {"neimark_sacker": "Neimark-Sacker bifurcation", "flip": "flip (period doubling)"}


class Branches(View):
    """Lines over the diagram's points, from Newton's method and continuation."""

    name, over = "branches", True

    @property
    def shown(self) -> bool:
        """Return whether the diagram is shown, and its branches asked for."""
        return self.sheet.views["diagram"].shown and bool(self.setting("show") == "yes")

    def requests(self, base: Requests) -> Requests:
        """Branches over the diagram's range; those of a system without forcing begin at its cycle."""
        cycle = self.system.period() is None and not self.system.is_map
        begin = {"start": list(self.state.start)} if cycle else {}
        return self.each({**base["first look"], **begin, "columns": 0})

    def build(self) -> None:
        """Put lines and marks into the diagram."""
        self._kinds: dict[str, None] = {}  # of the special points that are drawn
        figure = self.sheet.views["diagram"].figure
        self._lines = {line: figure.source("x", "y", name=f"{one[0]} branches") for line, one in _LINES.items()}
        self._drawn = [
            figure.plot.line("x", "y", source=self._lines[line], line_dash=dash, line_width=width)
            for line, (_, dash, width) in _LINES.items()
        ]
        self.ink(INK, *self._drawn)
        self._points = figure.source("x", "y", "words")
        near = figure.plot.scatter("x", "y", source=self._points, size=9, fill_alpha=0.0, line_alpha=0.0)
        figure.tell(near, attachment="left", limit=1)
        self._marks = figure.source("x", "y", "words", "marker", name="special points")
        special = figure.plot.scatter("x", "y", marker="marker", source=self._marks, size=9, line_width=1.4)
        self.ink(INK, special)
        self.ink(("#FFFFFF", "#171B20"), special, field="fill_color")
        self._drawn += [near, special]

    def place(self) -> None:
        """Show them where the page does."""
        for renderer in self._drawn:
            renderer.visible = self.setting("show") == "yes"

    def redraw(self) -> None:
        """Draw all section points of every branch over the parameter."""
        result = self.results.get("branches", self.results.get("cycle"))
        if result is None:
            return
        parameter = result.attrs["parameter"]
        unit = self.quantity(parameter)[1]
        lines: dict[str, list[Any]] = {line: [np.empty((2, 0))] for line in self._lines}
        points: list[tuple[Any, ...]] = []
        special: list[tuple[Any, ...]] = []
        self._kinds = {}
        whole = "branch" in result
        for branch in [one_branch(result, k) for k in range(result.sizes["branch_id"])] if whole else [result]:
            values, period = branch[parameter].values, branch.sizes.get("return", 1)
            places = [number(float(value), unit, 6) for value in values]
            orbits = [f"period {period}, {_multipliers(some)}" for some in branch["floquet_multipliers"].values]
            told = [
                f"{place}: {'' if good else 'un'}stable, {orbit}"
                for place, good, orbit in zip(places, branch["stable"].values, orbits, strict=True)
            ]
            there = branch.sizes.get("special", 0)
            marks = [*zip(branch["special_point"].values, branch["special_kind"].values, strict=True)] if there else []
            self._kinds |= {str(kind): None for _, kind in marks}
            for row in ordinates_of(branch, self.state.shown, "section"):
                for line, some in lines_of(branch):
                    lines[line] += [[with_breaks(values, some), with_breaks(row, some)], [[np.nan], [np.nan]]]
                points += zip(values, row, told, strict=True)
                for at, kind in marks:
                    words = f"{_WORDS.get(kind, words_of_kind(kind))} at {places[at]}: {orbits[at]}"
                    special.append((values[at], row[at], words, _sign(kind)[0]))
        for line, source in self._lines.items():
            source.data = dict(zip("xy", np.concatenate(lines[line], axis=1), strict=True))
        # of points at one place the first is told: the special ones
        for source, rows in ((self._points, [one[:3] for one in special] + points), (self._marks, special)):
            source.data = {key: [row[k] for row in rows] for k, key in enumerate(source.data)}

    def signs(self) -> Legend:
        """Lines and marks that are drawn, each with the sign that shows it."""
        if self.setting("show") != "yes":
            return []
        lines = [(_LINES[line][0], _STROKES[line]) for line, source in self._lines.items() if len(source.data["x"])]
        marks = [(words_of_kind(kind), _sign(kind)[1]) for kind in self._kinds]
        return [(words, INK[self.dark], sign) for words, sign in lines + marks]

    def clear(self) -> None:
        """Show no branch."""
        super().clear()
        self._kinds = {}
        for source in (*self._lines.values(), self._points, self._marks):
            source.data = {key: [] for key in source.data}


def _sign(kind: str) -> tuple[str, str]:
    return _SIGNS[MARKERS.get(kind, "*")]


def _multipliers(multipliers: Any) -> str:
    """The multipliers in words: all where there are up to three, else the largest."""
    some = sorted((complex(one) for one in multipliers if np.isfinite(one)), key=abs, reverse=True)
    if not some:
        return "no multipliers"
    told = ", ".join(
        f"{one.real:.3g}" if abs(one.imag) < 1e-9 * (1 + abs(one.real)) else f"{one.real:.3g} ± {abs(one.imag):.3g}i"
        for one in some[:3]
        if one.imag >= -1e-9 * (1 + abs(one))
    )
    return f"multipliers {told}".replace("-", "\N{MINUS SIGN}") + (" …" if len(some) > 3 else "")


_POINTS = {"first response": 81, "response": 401}


class Response(View):
    """Half the peak-to-peak value of a state over a parameter, in most models the forcing frequency."""

    name, ends = "response", ("low", "high")

    def requests(self, base: Requests) -> Requests:
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
        up, down = (plot.line("x", "y", source=source, line_width=2) for source in self._curves.values())
        down.glyph.line_dash = "dashed"
        self.figure.tell(up, down, mode="vline")
        self._here = self.figure.mark()
        self._measured = self.figure.source("x", "y", name="recorded response")
        rings = plot.scatter("x", "y", source=self._measured, size=8, fill_color=None, line_width=1.3)
        self.ink(_DIRECTIONS["up"], up)
        self.ink(_DIRECTIONS["down"], down)
        self.ink(GREY, rings)

    def draw(self, result: Any) -> None:
        """Draw the amplitude of the state that the diagram shows."""
        shown = self.state.shown
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
        self.name_axes(over, shown, "amplitude of ")
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

    def legend(self) -> Legend:
        """Directions of the sweep."""
        return [(words, _DIRECTIONS[words.split(",")[0]][self.dark]) for words in ("up", "down, dashed")]

    def tapped(self, x: float, y: float) -> PageState:
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

    def zoomed(self, x: Ends, y: Ends) -> PageState:
        """Compute the range that is seen."""
        return self.state.with_settings({"response.low": x[0], "response.high": x[1]})
