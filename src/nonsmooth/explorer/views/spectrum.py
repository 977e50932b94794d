"""Spectrum of the orbit: amplitudes over multiples of the forcing frequency."""

from __future__ import annotations

from typing import Any

import numpy as np

from nonsmooth.explorer.figures import BLUE, Panel
from nonsmooth.explorer.labels import axis_label, number
from nonsmooth.explorer.views.view import Requests, View
from nonsmooth.plot.trajectories import lines_of

_LINES = 20  # multiples of the base frequency that are drawn


class AmplitudeSpectrum(View):
    """The amplitude of every harmonic and subharmonic of the state over time."""

    name = "spectrum"

    def requests(self, base: Requests) -> Requests:
        """One request, once the period number is known: that many periods have lines with no leakage."""
        return self.each(base["motion"]) if "motion" in base else {}

    def build(self) -> None:
        """Lines with a dot on each where the motion is periodic, a curve where it is not."""
        self.figure = Panel("spectrum", y_axis_type="log")
        self._source, plot = self.figure.source("x", "y", "low", "words", name="lines"), self.figure.plot
        self._curve = plot.line("x", "y", source=self._source, line_width=1.2)
        self._stems = plot.segment("x", "low", "x", "y", source=self._source)
        self._dots = plot.scatter("x", "y", source=self._source, size=6, line_color=None)
        self.ink(BLUE, self._curve, self._stems)
        self.ink(BLUE, self._dots, field="fill_color")
        self.figure.tell(self._curve, mode="vline", attachment="right", point_policy="snap_to_data")

    def draw(self, result: Any) -> None:
        """Draw the state of the phase plane's horizontal axis, as the time history does."""
        system, (latex, unit) = self.system, self.quantity(self.state.x)
        base, discrete = float(result["base_frequency"]), bool(result["period_number"])
        order, own, floor = lines_of(result, self.state.x, _LINES)
        x, y = order[own > floor], own[own > floor]
        hertz = result["base_frequency"].attrs["units"]
        words = [
            f"{a:.4g}{'' if system.is_map else f' · {number(a * base, hertz)}'}: {number(b, unit)}"
            for a, b in zip(x, y, strict=True)
        ]
        self._source.data = {"x": x, "y": y, "low": np.full(len(x), floor), "words": words}
        self._stems.visible = self._dots.visible = discrete
        self._curve.glyph.line_alpha = 0.0 if discrete else 1.0
        self.figure.show((0.0, float(x.max(initial=1.0)) * 1.02), (floor, 3 * (float(own.max(initial=0.0)) or 1.0)))
        times = "frequency / forcing frequency" if system.period() is not None else "frequency / that of the returns"
        self.figure.x.say("frequency per iterate" if system.is_map else times)
        self.figure.y.say(f"amplitude of {axis_label(latex, unit)}")
