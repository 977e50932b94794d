"""The motion from the initial state: phase plane, history, section points, spectrum, and the line above the views."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from bokeh.models import BoxAnnotation, LinearColorMapper

from nonsmooth.explorer.figures import BLUE, MOST, Panel, extent
from nonsmooth.explorer.labels import axis_label, number, plain_of
from nonsmooth.explorer.views.view import Legend, Request, Requests, Results, View
from nonsmooth.plot import style
from nonsmooth.plot.labels import column
from nonsmooth.plot.style import COLORS
from nonsmooth.plot.trajectories import lines_of, pieces_by_mode, with_gaps
from nonsmooth.results.labels import in_words

if TYPE_CHECKING:
    from nonsmooth.explorer.state import PageState

_MODES = [BLUE, *((style.nth(k),) * 2 for k in range(1, 60))]  # more than are seen


class _Curves(View):
    """Lines in one colour per mode."""

    def build(self) -> None:
        self.figure = Panel(self.name)
        self.curves = self.figure.source("xs", "ys", "mode")
        mapper = LinearColorMapper(low=0, high=len(_MODES))
        color = {"field": "mode", "transform": mapper}
        self.lines = self.figure.plot.multi_line("xs", "ys", color=color, source=self.curves, line_width=1.6)
        self._inked.append((mapper, "palette", tuple(zip(*_MODES, strict=True))))

    def put(self, run: Any, xs: Any, ys: Any) -> None:
        """Draw a curve of a trajectory."""
        mode, *cut = with_gaps(run, run["mode"].values.astype(float), xs, ys)
        pieces = pieces_by_mode(np.nan_to_num(mode, nan=-1).astype(int), *cut)
        seen = [(k % len(_MODES), *piece) for k, piece in enumerate(pieces) if k in mode]
        self.curves.data = {key: [one[i] for one in seen] for i, key in enumerate(("mode", "xs", "ys"))}


class Portrait(_Curves):
    """The orbit in the plane of two states, with its section points and the contact zone."""

    name = "portrait"

    def requests(self, base: Requests) -> Requests:
        """The orbit, whatever the panel shows: other views need it."""
        return {"orbit": base["orbit"]}

    @property
    def shown(self) -> bool:
        """Return True: the orbit is always wanted."""
        return True

    def build(self) -> None:
        """Lines, the zone below them and points above."""
        super().build()
        self.zone = BoxAnnotation(
            fill_color=COLORS["zone"], fill_alpha=0.14, line_alpha=0, level="underlay", visible=False
        )
        self.figure.plot.add_layout(self.zone)
        self.points = self.figure.source("x", "y")
        self.figure.plot.scatter(
            "x", "y", source=self.points, size=7, fill_color=COLORS["zone"], line_color="#1B1F24", line_width=1.0
        )

    def show(self, job: Request, found: Results) -> None:
        """Its exponents are not known yet, nor those that were asked for before another orbit was shown."""
        self.sheet.views["readout"].results.clear()
        self.sheet.undo("readout")
        super().show(job, found)
        self.sheet.views["history"].redraw()

    def redraw(self) -> None:
        """Draw the trajectory; the axes stay where they are as long as they show it well."""
        if "run" not in self.results:
            return
        run, state, figure = self.results["run"], self.state, self.figure
        curves = [column(run, "u", name).values for name in (state.x, state.y)]
        self.put(run, *curves)
        self.lines.visible = not self.system.is_map  # of a map the iterates alone
        for axis, values, also in zip((figure.x, figure.y), curves, figure.beside, strict=True):
            axis.fit(np.concatenate([values, also]))
        self.name_axes(state.x, state.y)
        zone = self._zone()
        self.zone.update(left=zone, visible=zone is not None)

    def _zone(self) -> float | None:
        """The gap behind which contact lies, where an indicator is ``x`` less a parameter."""
        traced, names = self.system.traced, list(self.system.parameters)
        shown = traced.u[list(self.system.states).index(self.state.x)]
        edges = {shown - symbol: name for symbol, name in zip(traced.p, names, strict=True)}
        found = next((edges[indicator] for indicator in traced.indicators if indicator in edges), None)
        return None if found is None else float(self.state.values[found])

    def clear(self) -> None:
        """Show nothing, the contact zone included."""
        super().clear()
        self.zone.visible = False

    def tapped(self, x: float, y: float) -> PageState:
        """Start there."""
        return self.started(**{self.state.x: x, self.state.y: y})


class TimeHistory(_Curves):
    """A state over time, with its crossings."""

    name = "history"

    def build(self) -> None:
        """Lines, and rings at the crossings."""
        super().build()
        self.crossings = self.figure.source("x", "y")
        self.figure.plot.scatter("x", "y", source=self.crossings, size=5, fill_color=None, line_color=COLORS["muted"])

    def redraw(self) -> None:
        """Draw the last of the trajectory."""
        run = self.sheet.results.get("run")
        if run is None:
            return
        time, values = run["time"].values, column(run, "u", self.state.x).values
        self.put(run, time, values)
        self.crossings.data = {"x": run["crossing_time"].values, "y": run["u_before"].sel(state=self.state.x).values}
        ends = extent(np.concatenate([values, self.figure.beside[1]]))
        self.figure.show((float(time[0]), float(time[-1])), ends)
        self.figure.x.name("t", run["time"].attrs.get("units", "1"))
        self.figure.y.name(*self.quantity(self.state.x))

    def legend(self) -> Legend:
        """Modes that the motion visits, in the colours that they have in the phase plane too."""
        run = self.sheet.results.get("run")
        seen = [] if run is None else np.unique(run["mode"].values).tolist()
        if run is None or not 1 < len(seen) <= len(_MODES):
            return []
        words = dict(zip(run["mode"].values.tolist(), in_words(run["mode"]).tolist(), strict=True))
        return [(str(words[k]).replace("_", " "), _MODES[k % len(_MODES)][self.dark]) for k in seen if k >= 0]


class SectionPoints(View):
    """Section points in the phase plane."""

    name = "section"

    def requests(self, base: Requests) -> Requests:
        """Points at a phase of the orbit."""
        return self.each({**base["orbit"], "phase": self.state.phase})

    def build(self) -> None:
        """Points over the orbit."""
        self.figure = Panel("section")
        plot = self.figure.plot
        self.orbit = self.figure.source("x", "y")
        plot.line("x", "y", source=self.orbit, line_color=COLORS["muted"], line_alpha=0.6, line_width=1)
        self.points = self.figure.source("x", "y", name="section points")
        self.dots = plot.scatter("x", "y", source=self.points, size=4, line_color=None, fill_alpha=0.75)
        self.ink(BLUE, self.dots, field="fill_color")

    def draw(self, result: Any) -> None:
        """Draw the points: a few as large dots on the whole orbit, so that they move in it with the phase."""
        names, apart = (self.state.x, self.state.y), self.results["apart"]
        points = result["section"].sel(state=list(names)).values
        points = points[-len(apart) :][apart] if apart.sum() <= MOST else points
        few = len(points) <= MOST
        self.points.data = dict(zip("xy", points.T, strict=True))
        self.dots.glyph.update(size=9 if few else 2.5, fill_alpha=1.0 if few else 0.75)
        run = self.sheet.results.get("run") if few else None
        curves = [np.empty(0) if run is None else column(run, "u", name).values for name in names]
        self.orbit.data = dict(zip("xy", curves, strict=True))
        drawn = zip(points.T, curves, self.figure.beside, strict=True)
        self.figure.show(*(extent(np.concatenate(all_of_it), 0.08) for all_of_it in drawn))
        self.name_axes(*names)
        self.sheet.views["portrait"].points.data = dict(self.points.data)

    tapped = Portrait.tapped


class Mechanism(View):
    """The sketch of the masses, which moves with the motion."""

    name = "mechanism"

    def requests(self, base: Requests) -> Requests:
        """Pictures, multipliers or exponents, once the orbit is there."""
        return {} if "motion" not in base or self.system.is_map else self.each(base["motion"])

    def redraw(self) -> None:
        """Hand the pictures to the page; nothing of a system without masses on a line."""
        self.page.tell("sketch", self.results.get("sketch"))

    def clear(self) -> None:
        """Take the sketch away."""
        super().clear()
        self.redraw()


class Readout(View):
    """A motion in a few words and numbers, with what is known of its stability."""

    name = "readout"
    requests = Mechanism.requests

    def redraw(self) -> None:
        """Tell the period number, section points, contacts, extremes, and the largest multiplier or exponent."""
        results, x = self.sheet.results, self.state.x
        if "judged" not in results:
            return
        judged, section = results["judged"], results.get("section")
        period, status = int(judged["period_number"].values[0]), str(np.ravel(in_words(judged["status"]))[0])
        fields = [("motion", f"period {period}" if period else "no period found")]
        if status not in ("ok", "not_periodic"):
            fields.append(("status", status.replace("_", " ")))
        if section is not None:
            n = int(results["apart"].sum())
            fields.append(("section points", str(n) if n <= MOST else f"{section.sizes['iterate']}, no two alike"))
        contacts = float(judged["contacts_per_period"].values[0])
        if np.isfinite(contacts):
            fields.append(("contacts per period", f"{contacts:.3g}"))
        ends = [float(judged[name].sel(state=x).values[0]) for name in ("minimum", "maximum")]
        if np.isfinite(ends).all():
            latex, unit = self.quantity(x)
            fields.append((plain_of(latex), " … ".join(number(end, unit) for end in ends)))
        if "multipliers" in self.results:
            fields.append(("largest |multiplier|", f"{float(np.abs(self.results['multipliers']).max()):.4f}"))
        elif self.results:
            names = "exponents", "standard_error"
            largest, error = (float(self.results["exponents"][name].values.max()) for name in names)
            fields.append(("largest exponent", f"{number(largest)} ± {error:.1g}"))
        self.page.tell("readout", [*fields, *self.sheet.bench.readout()])

    def clear(self) -> None:
        """Tell nothing."""
        super().clear()
        self.page.tell("readout", [])


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
