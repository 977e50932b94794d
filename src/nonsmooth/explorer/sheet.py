"""Figures of a page and the results in them: how an answer of the worker comes into them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from nonsmooth.explorer.bench import Bench
from nonsmooth.explorer.figures import MOST, Diagram, History, Portrait, Section
from nonsmooth.explorer.labels import symbols_of
from nonsmooth.explorer.overlays import Overlay
from nonsmooth.explorer.readout import distinct, readout
from nonsmooth.explorer.views import VIEWS, View

if TYPE_CHECKING:
    from nonsmooth.explorer.schedule import Asked
    from nonsmooth.explorer.session import Session
    from nonsmooth.explorer.state import State
    from nonsmooth.system.system import System

__all__ = ["Sheet"]


class Sheet:
    """Figures and results of a page."""

    def __init__(self, page: Session) -> None:
        self.page = page
        self.results: dict[str, Any] = {}
        self.diagram, self.portrait = Diagram(), Portrait()
        self.history, self.section = History(), Section()
        self.views: list[View] = [view() for view in VIEWS]
        self.overlay = Overlay(self.diagram, self.portrait, self.history, self.section)
        self.bench = Bench(page)
        self._of = page.subject  # of what is drawn
        self._axes = page.state.x, page.state.y, page.state.shown

    @property
    def plots(self) -> list[Any]:
        """The four figures that every page has."""
        return [one.plot for one in (self.diagram, self.portrait, self.history, self.section)]

    def paint(self, dark: bool) -> None:
        """Take the colours that show on a light or a dark ground."""
        for one in (self.portrait, self.history, self.section, self.overlay):
            one.paint(dark)
        for view in self.views:
            view.paint(dark)

    # --- answers

    def show(self, request: Asked, found: Mapping[str, Any]) -> None:
        """Draw an answer, where the page still shows what it is of."""
        state, system, view = self.page.state, self.page.system, request.view
        if request.of[0] != state.model:
            return
        if view in ("first look", "diagram"):
            self._show_diagram(request, found["diagram"])
        elif view == "orbit":
            self.results.pop("stability", None)
            self.results.update(found)
            self._show_orbit(state, system)
        elif view == "section":
            self.results["section"] = found["section"]
            self._show_section(state, system)
        elif view == "recording":
            self.bench.put(found)
            self._show_recording()
        elif view == "stability":
            self.results["stability"] = found
            self._tell_readout()
        else:
            for one in self.views:
                if view in one.stages and not one.depends(request.of, self.page.subject):
                    one.show(json.loads(request.key), found, system, state)
                    if one.saved is not None and one.saved[0] in found:
                        self.results[one.name] = found[one.saved[0]]
            self.page.tell_ui()

    def forget(self, view: str) -> None:
        """Take back what is said of a motion that could not be computed; its note says why."""
        if view == "orbit":
            for key in ("judged", "run", "section", "stability"):
                self.results.pop(key, None)
            for key in ("orbit", "section", "stability", "recording"):
                self.page.work.done.pop(key, None)
            self.page.tell("readout", [])

    def _show_diagram(self, request: Asked, result: Any) -> None:
        state = self.page.state
        if request.of[1] != state.over:
            return
        self.results["diagram"] = result
        stage = "judged" if request.view == "diagram" else "first look"
        self.diagram.put(result, stage, state, request.key, self.page.system.parameters[state.over].unit)
        self._name_diagram()
        self.page.tell_ui()

    def _name_diagram(self) -> None:
        state, system = self.page.state, self.page.system
        symbols = symbols_of(system)
        self.diagram.x.name(symbols[state.over], system.parameters[state.over].unit)
        self.diagram.y.name(symbols[state.shown], system.states[state.shown])

    def _show_orbit(self, state: State, system: System) -> None:
        run, symbols = self.results["run"], symbols_of(system)
        self.portrait.put(run, state, symbols, system.states, _zone(system, state), system.is_map)
        self.history.put(run, state, symbols, system.states)
        self._tell_readout()

    def _show_section(self, state: State, system: System) -> None:
        result = self.results["section"]
        names = [str(name) for name in result["state"].values]
        points = result["section"].values[:, [names.index(state.x), names.index(state.y)]]
        apart = distinct(result["section"].values)
        points = points[-len(apart) :][apart] if apart.sum() <= MOST else points
        self.section.put(points, self.results.get("run"), state, symbols_of(system), system.states)
        self.portrait.mark(points)
        self._tell_readout()

    def _show_motion(self) -> None:
        if "run" in self.results:
            self._show_orbit(self.page.state, self.page.system)
        if "section" in self.results:
            self._show_section(self.page.state, self.page.system)

    def _show_recording(self) -> None:
        self.overlay.put(self.bench.laid, self.page.state)
        self._show_motion()

    def _tell_readout(self) -> None:
        if "judged" in self.results:
            told = readout(self.page.system, self.page.state, self.results)
            self.page.tell("readout", [*told, *self.bench.readout()])

    # --- the state of the page

    def follow(self) -> None:
        """Take away what is not of the page's model, and draw the rest as the page's state has it."""
        state, system = self.page.state, self.page.system
        if self._of != self.page.subject:
            self._clear()
        if self._axes != (state.x, state.y, state.shown):
            self._axes = state.x, state.y, state.shown
            if self.diagram.result is not None:
                self.diagram.redraw(state)
                self._name_diagram()
            for one in self.views:
                one.redraw(system, state)
            self._show_recording()
        if self.bench.laid is None and not self.overlay.is_empty:
            self._show_recording()
        self.diagram.here.location = state.values[state.over]
        for one in self.views:
            one.place(system, state)
        if (self.diagram.plot.x_range.start, self.diagram.plot.x_range.end) != (state.low, state.high):
            self.diagram.show(x=(state.low, state.high))

    def _clear(self) -> None:
        done, subject = self.page.work.done, self.page.subject
        self.diagram.clear()
        self.results.pop("diagram", None)
        if self._of[0] != subject[0]:
            self.results.clear()
            done.clear()
            for panel in (self.portrait, self.history, self.section):
                panel.clear()
            self.page.tell("readout", [])
            self.bench.arrange()
        for view in ("first look", "diagram"):
            done.pop(view, None)
        for one in self.views:
            if one.depends(self._of, subject):
                one.clear()
                for stage in one.stages:
                    done.pop(stage, None)
        self.overlay.put(self.bench.laid, self.page.state)
        self._of = subject


def _zone(system: System, state: State) -> float | None:
    """The gap behind which contact lies, where an indicator is ``x`` less a parameter."""
    names = list(system.parameters)
    shown = system.traced.u[list(system.states).index(state.x)]
    for indicator in system.traced.indicators:
        for k, symbol in enumerate(system.traced.p):
            if indicator == shown - symbol:
                return float(state.values[names[k]])
    return None
