"""Spectrum of the orbit: amplitudes over multiples of the forcing frequency."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

import nonsmooth as ns
from nonsmooth.explorer.labels import number, symbols_of
from nonsmooth.explorer.views.view import View

if TYPE_CHECKING:
    from nonsmooth.explorer.session import Session
    from nonsmooth.explorer.state import State
    from nonsmooth.explorer.work import Heard
    from nonsmooth.system.system import System

__all__ = ["Spectrum"]

_LINES = 20  # multiples of the forcing frequency that are drawn
_PER_PERIOD = 512  # samples; the last multiple drawn is far below half their rate
_LONG = 256  # periods of a motion without a period number
_FLOOR = 1e-7  # of the largest line: below it rounding and the tolerance rule


class Spectrum(View):
    """The amplitude of every harmonic and subharmonic of the state over time."""

    name, title, panel = "spectrum", "Spectrum", "lower"
    stages: ClassVar = {"spectrum": True}

    def requests(self, system: System, state: State, base: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """One request, once the period number is known: that many periods have lines with no leakage."""
        if "motion" not in base:
            return {}
        return {"spectrum": {**base["motion"], "view": "spectrum"}}

    @staticmethod
    def compute(system: System, job: Mapping[str, Any], options: Mapping[str, Any], heard: Heard) -> dict[str, Any]:
        """Spectra of all states over ``frequency``; ``unit`` is the frequency of the forcing, or of the returns."""
        from nonsmooth.recordings.signals.spectrum import spectrum

        heard(0.0)
        periods = job["period"] or _LONG
        if system.is_map:
            rate, unit, count = 1.0, 1.0, 16 * _LONG
            found = ns.poincare(
                system, n=count, transient=job["transient"], start=list(job["start"]), **options
            )["section"].values  # fmt: skip
        else:
            if (period := system.period()) is not None:
                begin, length, unit = job["transient"] * period, periods * period, 1.0 / period
            else:  # of a cycle exactly one round; else what the other views show
                begin, length = job["begin"], job["span"] / (2 if job["period"] else 1)
                unit = periods / length if job["period"] else 1.0
            count = _PER_PERIOD * (periods if job["period"] else _LONG // 8)
            rate = count / length
            times = begin + np.arange(count) / rate
            run = ns.simulate(
                system, duration=length, transient=begin, start=list(job["start"]), samples=times, **options
            )  # fmt: skip
            at = np.searchsorted(run["time"].values, times).clip(0, run.sizes["time"] - 1)
            found = run["u"].values[at]
        window = "boxcar" if job["period"] and not system.is_map else "hann"
        lines = [spectrum(np.nan_to_num(column), rate, window=window)["amplitude"] for column in found.T]
        return {"amplitude": np.stack([one.values for one in lines]), "frequency": lines[0]["frequency"].values,
                "unit": unit, "discrete": window == "boxcar"}  # fmt: skip

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
        if not self.results:
            return
        from nonsmooth.explorer.labels import plain_of

        which, unit = list(system.states).index(state.x), float(self.results["unit"])
        order = self.results["frequency"] / unit
        own = self.results["amplitude"][which]
        some = (order > 1e-9) & (order <= _LINES)
        largest = float(own[some].max(initial=0.0)) or 1.0
        some &= own > _FLOOR * largest
        x, y = order[some], own[some]
        forced = system.period() is not None
        hertz = "" if system.is_map else "Hz"
        times = "frequency / forcing frequency" if forced else (
            "frequency / cycle frequency" if unit != 1.0 else "frequency (Hz)"
        )  # fmt: skip
        words = [
            f"{a:.4g}{f' · {number(a * unit, hertz)}' if unit != 1.0 else ''}: {number(b, system.states[state.x])}"
            for a, b in zip(x, y, strict=True)
        ]
        self._source.data = {"x": x, "y": y, "low": np.full(len(x), _FLOOR * largest), "words": words}
        self._stems.visible = self._dots.visible = bool(self.results["discrete"])
        self._curve.glyph.line_alpha = 0.0 if self.results["discrete"] else 1.0
        self._panel.show((0.0, float(order[some].max(initial=1.0)) * 1.02), (_FLOOR * largest, 3 * largest))
        self._panel.plot.xaxis[0].axis_label = "frequency per iterate" if system.is_map else times
        label = plain_of(symbols_of(system)[state.x])
        unit_of = system.states[state.x]
        self._panel.plot.yaxis[0].axis_label = f"amplitude of {label}" + (
            "" if unit_of in ("", "1") else f" ({unit_of})"
        )

    def clear(self) -> None:
        """Show no line."""
        super().clear()
        self._source.data = {key: [] for key in self._source.data}

    def paint(self, dark: bool) -> None:
        """Take the colour that shows on a light or a dark ground."""
        from nonsmooth.plot.style import COLORS

        shade = COLORS["pale" if dark else "first"]
        self._curve.glyph.line_color = self._stems.glyph.line_color = self._dots.glyph.fill_color = shade
