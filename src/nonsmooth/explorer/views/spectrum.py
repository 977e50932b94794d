"""Spectrum of the orbit: amplitudes over multiples of the forcing frequency."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

import nonsmooth as ns
from nonsmooth.explorer.labels import number, plain_of, symbols_of
from nonsmooth.explorer.views.view import View
from nonsmooth.plot.amplitude_spectrum import FLOOR

if TYPE_CHECKING:
    from nonsmooth.explorer.session import Session
    from nonsmooth.explorer.state import State
    from nonsmooth.explorer.work import Heard
    from nonsmooth.system.system import System

__all__ = ["Spectrum"]

_LINES = 20  # multiples of the base frequency that are drawn


class Spectrum(View):
    """The amplitude of every harmonic and subharmonic of the state over time."""

    name, title, panel = "spectrum", "Spectrum", "lower"
    stages: ClassVar = {"spectrum": True}
    saved: ClassVar = ("spectrum", "amplitude_spectrum")

    def requests(self, system: System, state: State, base: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """One request, once the period number is known: that many periods have lines with no leakage."""
        if "motion" not in base:
            return {}
        return {"spectrum": {**base["motion"], "view": "spectrum"}}

    @staticmethod
    def compute(system: System, job: Mapping[str, Any], options: Mapping[str, Any], heard: Heard) -> dict[str, Any]:
        """An ``amplitude_spectrum``."""
        from nonsmooth.explorer.work import section_of

        return {"spectrum": ns.amplitude_spectrum(
            system, start=list(job["start"]), section=section_of(system), transient=job["transient"], progress=heard,
            **options,
        )}  # fmt: skip

    def build(self, page: Session) -> Any:
        """Lines with a dot on each where the motion is periodic, a curve where it is not."""
        from bokeh.models import ColumnDataSource, HoverTool

        from nonsmooth.explorer.figures import TIP, Panel
        from nonsmooth.plot.style import COLORS

        self._panel = Panel("spectrum", y_axis_type="log")
        self._source = ColumnDataSource(name="lines", data={"x": [], "y": [], "low": [], "words": []})
        plot = self._panel.plot
        self._curve = plot.line("x", "y", source=self._source, line_color=COLORS["first"], line_width=1.2)
        self._stems = plot.segment("x", "low", "x", "y", source=self._source, line_color=COLORS["first"])
        self._dots = plot.scatter("x", "y", source=self._source, size=6, fill_color=COLORS["first"], line_color=None)
        self._panel.plot.add_tools(HoverTool(
            renderers=[self._curve], mode="vline", tooltips=TIP, attachment="right", point_policy="snap_to_data",
        ))  # fmt: skip
        return plot

    def redraw(self, system: System, state: State) -> None:
        """Draw the state of the phase plane's horizontal axis, as the time history does."""
        result = self.results.get("spectrum")
        if result is None:
            return
        base, discrete = float(result["base_frequency"]), bool(result["period_number"])
        order, own = result["order"].values, result["amplitude"].sel(state=state.x).values
        some = (order > 1e-9) & (order <= _LINES)
        largest = float(own[some].max(initial=0.0)) or 1.0
        some &= own > FLOOR * largest
        x, y = order[some], own[some]
        hertz = result["base_frequency"].attrs["units"]
        times = "frequency / forcing frequency" if system.period() is not None else "frequency / that of the returns"
        words = [
            f"{a:.4g}{'' if system.is_map else f' · {number(a * base, hertz)}'}: {number(b, system.states[state.x])}"
            for a, b in zip(x, y, strict=True)
        ]
        self._source.data = {"x": x, "y": y, "low": np.full(len(x), FLOOR * largest), "words": words}
        self._stems.visible = self._dots.visible = discrete
        self._curve.glyph.line_alpha = 0.0 if discrete else 1.0
        self._panel.show((0.0, float(order[some].max(initial=1.0)) * 1.02), (FLOOR * largest, 3 * largest))
        self._panel.plot.xaxis[0].axis_label = "frequency per iterate" if system.is_map else times
        label = plain_of(symbols_of(system)[state.x])
        unit_of = system.states[state.x]
        self._panel.plot.yaxis[0].axis_label = f"amplitude of {label}" + (
            "" if unit_of in ("", "1") else f" ({unit_of})"
        )

    @staticmethod
    def axes(state: State) -> dict[str, str]:
        """The state of the ordinate."""
        return {"y": state.x}

    def clear(self) -> None:
        """Show no line."""
        super().clear()
        self._source.data = {key: [] for key in self._source.data}

    def paint(self, dark: bool) -> None:
        """Take the colour that shows on a light or a dark ground."""
        from nonsmooth.plot.style import COLORS

        shade = COLORS["pale" if dark else "first"]
        self._curve.glyph.line_color = self._stems.glyph.line_color = self._dots.glyph.fill_color = shade
