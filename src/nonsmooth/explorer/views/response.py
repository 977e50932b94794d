"""Frequency response: the amplitude over the forcing frequency, up and down."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

import nonsmooth as ns
from nonsmooth.explorer.labels import number, plain_of, symbols_of
from nonsmooth.explorer.views.view import Setting, View

if TYPE_CHECKING:
    from nonsmooth.explorer.session import Session
    from nonsmooth.explorer.state import State
    from nonsmooth.explorer.work import Heard
    from nonsmooth.system.system import System

__all__ = ["Response"]

_POINTS = {"first response": 81, "response": 401}


@lru_cache(maxsize=64)
def _frequency(system: System) -> str:
    """The parameter that changes the period of the forcing; the first one where none does."""
    if (period := system.period()) is not None:
        for name, value in system.values.items():
            if system.with_parameters({name: 1.01 * value}).period() != period:
                return str(name)
    return str(next(iter(system.parameters)))


def _end(factor: float, field: str) -> Any:
    def default(system: System, state: State) -> float:
        """Around the value, by powers of two of the model's own: the range stays while the parameter is moved."""
        name = Response.value("over", system, state)
        if name == state.over:
            return float(getattr(state, field))
        own, value = float(system.values[name]), state.values[name]
        if own * value <= 0:
            return float(value + (factor - 1.0) * (abs(value) or 1.0))
        return factor * own * 2.0 ** round(math.log2(value / own))

    return default


class Response(View):
    """Half the peak-to-peak value of a state over a parameter, in most models the forcing frequency."""

    name, title, panel = "response", "Frequency response", "upper"
    stages: ClassVar = {"first response": True, "response": False}
    settings: ClassVar = {
        "response.over": Setting(
            "over", lambda system, state: _frequency(system),
            lambda system, state: {name: plain_of(symbols_of(system)[name]) for name in system.parameters},
            also=("response.low", "response.high"),
        ),
        "response.low": Setting("from", _end(0.5, "low")), "response.high": Setting("to", _end(1.5, "high")),
    }  # fmt: skip
    saved = ("response", "frequency_response")

    def requests(self, system: System, state: State, base: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """Few frequencies, then many."""
        over, low, high = (self.value(name, system, state) for name in ("over", "low", "high"))
        sweep = base["first look"]
        low, high = sorted((low, high))
        job = {**sweep, "values": {**state.values, over: low}, "over": over, "low": low, "high": high}
        return {stage: {**job, "view": stage, "columns": n} for stage, n in _POINTS.items()}

    @staticmethod
    def compute(system: System, job: Mapping[str, Any], options: Mapping[str, Any], heard: Heard) -> dict[str, Any]:
        """A ``frequency_response``."""
        from nonsmooth.explorer.work import section_of

        return {"response": ns.frequency_response(
            system, np.linspace(job["low"], job["high"], job["columns"]), parameter=job["over"],
            start=list(job["begin"]), section=section_of(system), transient=job["transient"], keep=job["keep"],
            progress=heard, **options,
        )}  # fmt: skip

    def build(self, page: Session) -> Any:
        """Up solid, down dashed, and a line at the parameter's value."""
        from bokeh.models import ColumnDataSource, HoverTool, Span

        from nonsmooth.explorer.figures import TIP, Panel
        from nonsmooth.explorer.overlays import INK
        from nonsmooth.plot.style import COLORS

        self._panel = Panel("response")
        plot = self._panel.plot
        self._curves = {
            word: ColumnDataSource(name=f"response {word}", data={"x": [], "y": [], "words": []})
            for word in ("up", "down")
        }
        lines = [
            plot.line("x", "y", source=self._curves["up"], line_color=COLORS["first"], line_width=2),
            plot.line("x", "y", source=self._curves["down"], line_color=COLORS["second"], line_dash="dashed",
                      line_width=2),
        ]  # fmt: skip
        self._up = lines[0]
        plot.add_tools(HoverTool(renderers=lines, mode="vline", tooltips=TIP))
        self._here = Span(dimension="height", line_color=COLORS["third"], line_width=1.5, line_dash="dashed")
        plot.add_layout(self._here)
        self._bench = page.sheet.bench
        self._measured = ColumnDataSource(name="recorded response", data={"x": [], "y": []})
        self._rings = plot.scatter(
            "x", "y", source=self._measured, size=8, fill_color=None, line_color=INK, line_width=1.3
        )
        return plot

    def redraw(self, system: System, state: State) -> None:
        """Draw the amplitude of the state that the diagram shows."""
        result = self.results.get("response")
        if result is None:
            return
        over = str(result["maximum"].dims[0])
        unit, units = system.parameters[over].unit, system.states[state.shown]
        values = result[over].values
        for word, source in self._curves.items():
            one = result.sel(direction=word)
            amplitude = one["amplitude"].sel(state=state.shown).values
            source.data = {"x": values, "y": amplitude, "words": [
                f"{word}, {number(float(value), unit)}: {number(float(height), units)}, "
                + (f"period {period}" if period else "no period")
                for value, height, period in zip(values, amplitude, one["period_number"].values, strict=True)
            ]}  # fmt: skip
        self._panel.show((float(values[0]), float(values[-1])))
        self._fit()
        symbols = symbols_of(system)
        self._panel.x.name(symbols[over], unit)
        self._panel.y.name(symbols[state.shown], units)
        self._panel.plot.yaxis[0].axis_label = f"amplitude of {self._panel.plot.yaxis[0].axis_label}"
        self.place(system, state)

    def place(self, system: System, state: State) -> None:
        """Mark the value that the page is at."""
        over = self.value("over", system, state)
        self._here.location = state.values[over]
        measured = self._bench.response(over, state.shown)
        if not all(np.array_equal(self._measured.data[key], one) for key, one in zip("xy", measured, strict=True)):
            self._measured.data = dict(zip("xy", measured, strict=True))
            self._fit()

    def _fit(self) -> None:
        """Show all amplitudes, those of a recording too."""
        from nonsmooth.explorer.figures import extent

        drawn = [source.data["y"] for source in (*self._curves.values(), self._measured)]
        self._panel.show(y=(0.0, extent(np.concatenate(drawn))[1]))

    def clear(self) -> None:
        """Show no curve."""
        super().clear()
        for source in self._curves.values():
            source.data = {key: [] for key in source.data}

    def paint(self, dark: bool) -> None:
        """Take the colours that show on a light or a dark ground."""
        from nonsmooth.explorer.overlays import INK, PALE
        from nonsmooth.plot.style import COLORS

        self._up.glyph.line_color = COLORS["pale" if dark else "first"]
        self._rings.glyph.line_color = PALE if dark else INK

    def legend(self, system: System, state: State) -> list[tuple[str, str]]:
        """Directions of the sweep."""
        from nonsmooth.plot.style import COLORS

        return [("up", COLORS["first"]), ("down, dashed", COLORS["second"])]

    @staticmethod
    def axes(state: State) -> dict[str, str]:
        """The state of the ordinate."""
        return {"y": state.shown}

    def tapped(self, x: float, y: float, system: System, state: State) -> State:
        """Go to the nearest frequency, on the curve that is nearer to the click."""
        result = self.results.get("response")
        if result is None:
            return state
        over = str(result["maximum"].dims[0])
        one = result.sel({over: x}, method="nearest")
        away = np.abs(one["amplitude"].sel(state=state.shown).values - y)
        at = one["section"].transpose("direction", "iterate", "state").values[np.nan_to_num(away, nan=np.inf).argmin()]
        state = state.with_value(over, float(one[over]))
        if not np.isfinite(at[-1]).all():
            return state
        return replace(state, start=tuple(float(value) for value in at[-1]))

    def zoomed(self, x: tuple[float, float], y: tuple[float, float], system: System, state: State) -> State:
        """Compute the range that is seen."""
        return state.with_settings(response__low=x[0], response__high=x[1])

    def unzoomed(self, system: System, state: State) -> State:
        """Return to the first range."""
        return state.with_settings(response__low=None, response__high=None)
