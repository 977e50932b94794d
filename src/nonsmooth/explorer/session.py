"""One page: what it shows, what is still to be computed for it, and what a person does to it."""

from __future__ import annotations

import base64
import json
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from importlib.resources import files
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl

from bokeh.events import DoubleTap, RangesUpdate, Reset, Tap
from bokeh.models import TextInput
from jinja2 import DictLoader, Environment

from nonsmooth.explorer.bench import Bench
from nonsmooth.explorer.building import KINDS, LINK
from nonsmooth.explorer.controls import controls
from nonsmooth.explorer.export import exported
from nonsmooth.explorer.figures import MOST, Diagram, History, Portrait, Section, theme
from nonsmooth.explorer.labels import symbols_of
from nonsmooth.explorer.overlays import Overlay
from nonsmooth.explorer.presets import GIVEN, PAPER, first_state, presets_of, slider_range
from nonsmooth.explorer.readout import distinct, readout
from nonsmooth.explorer.requests import key_of, motion_of, requests_of, stability_request
from nonsmooth.explorer.schedule import Asked, Schedule
from nonsmooth.explorer.state import History as Past
from nonsmooth.explorer.state import State, changed, from_query
from nonsmooth.explorer.views import PANELS, VIEWS, View
from nonsmooth.explorer.worker import Answer
from nonsmooth.explorer.workshop import Workshop

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["Session", "models_of"]

#: To the browser, each one line of JSON; what comes from it is ``act``.
CHANNELS = ("ui", "readout", "busy", "notes", "file", "recording", "building")
#: Files that make the page; what a part of the page does comes before the page itself.
TEXTS = (
    "page.html", "recording.html", "building.html", "page.css", "recording.js", "building.js", "tour.js", "page.js",
)  # fmt: skip
Models = Mapping[str, Callable[[], "System"]]


def models_of(system: System | None) -> Models:
    """The models that a page offers, by name: the one given first, then those of ``nonsmooth.models``."""
    from nonsmooth import models

    found: dict[str, Callable[[], System]] = {name: getattr(models, name) for name in models.names()}
    return found if system is None else {GIVEN: lambda: system, **found}


class Session:
    """The page of one browser tab.

    Parameters
    ----------
    document : bokeh Document
    models : mapping
        See :func:`models_of`.
    query : str
        The view to begin with, where the page's own address holds none.
    """

    def __init__(self, document: Any, models: Models, query: str = "") -> None:
        self.document, self.models = document, dict(models)
        self.dark = self.large = False
        self._systems: dict[str, System] = {}
        self._texts: dict[str, str] = {}
        self._saved = 0
        self._heard = 0  # number of the page's last message
        self.notes: dict[str, str] = {}
        self.results: dict[str, Any] = {}
        self.diagram, self.portrait = Diagram(), Portrait()
        self.history, self.section = History(), Section()
        self.views: list[View] = [view() for view in VIEWS]
        self.overlay, self.bench = Overlay(self.diagram, self.portrait, self.history, self.section), Bench(self)
        self.workshop = Workshop(self)
        self._say = {name: TextInput(name=name) for name in CHANNELS}
        self._act = TextInput(name="act")
        self.past = Past(self._first(query))
        self._of = self.subject  # of what is drawn
        self._axes = self.state.x, self.state.y, self.state.shown
        self._build()
        self.work = Schedule(self)
        document.on_session_destroyed(lambda context: self._close())
        self.refresh()

    @staticmethod
    def check(models: Models, query: str) -> None:
        """Refuse a query that does not fit the models, before anything is served."""
        _state_of(models, {}, parse_qsl(query))

    @property
    def state(self) -> State:
        """The state that the page shows."""
        return self.past.state

    @property
    def system(self) -> System:
        """The system at its own parameters."""
        return _system(self.models, self._systems, self.state.model)

    @property
    def text(self) -> str:
        """The system's text, as the worker takes it."""
        if self.state.model not in self._texts:
            self._texts[self.state.model] = self.system.to_text()
        return self._texts[self.state.model]

    def _period_number(self) -> int:
        return int(self.results["judged"]["period_number"].values[0])

    def _first(self, query: str) -> State:
        context = self.document.session_context
        request = getattr(context, "request", None)
        arguments = getattr(request, "arguments", None) or {}
        pairs = [
            (name, value.decode(errors="replace")) for name, values in arguments.items() if name != "token"
            for value in values
        ]  # fmt: skip
        try:
            return _state_of(self.models, self._systems, pairs or parse_qsl(query))
        except ValueError as error:
            self.notes["page"] = f"The address could not be read, so the page shows its first view: {error}"
            return _state_of(self.models, self._systems, parse_qsl(query))

    def _build(self) -> None:
        document = self.document
        document.title = "nonsmooth explorer"
        folder = files("nonsmooth.explorer")
        texts = {name: folder.joinpath(name).read_text(encoding="utf-8") for name in TEXTS}
        document.template = Environment(loader=DictLoader(texts)).get_template("page.html")
        document.template_variables.update(link=LINK, kinds=KINDS)
        document.template_variables["style"] = texts["page.css"]
        document.template_variables["program"] = "\n".join(text for name, text in texts.items() if name.endswith(".js"))
        document.template_variables["panels"] = PANELS
        document.template_variables["views"] = VIEWS
        self._on_click(self.diagram.plot, self._tap_diagram)
        self.diagram.plot.on_event(RangesUpdate, self._zoom_diagram)
        self.diagram.plot.on_change("inner_height", lambda attr, old, new: self._resized(int(new)))
        for one in (self.portrait, self.section):
            self._on_click(one.plot, self._tap_plane)
        own = []
        for view in self.views:
            plot = view.build(self)
            if plot is not None:
                own.append(plot)
                self._on_click(plot, partial(self._tap_view, view))
                plot.on_event(RangesUpdate, partial(self._zoom_view, view))
                plot.on_event(Reset, partial(self._reset_view, view))
        for plot in (*(one.plot for one in (self.diagram, self.portrait, self.history, self.section)), *own):
            document.add_root(plot)  # events are heard of what had a callback by now
        for channel in (self._act, *self._say.values()):
            document.add_root(channel)
        document.theme = theme(self.dark, self.large)
        self._act.on_change("value", lambda attr, old, new: self._told(new))

    @staticmethod
    def _on_click(plot: Any, act: Callable[[Any], None]) -> None:
        """Hear clicks; a second one soon after the first is a double click to Bokeh, wherever it lies."""
        for kind in (Tap, DoubleTap):
            plot.on_event(kind, act)

    def _begin(self, name: str, value: Any) -> None:
        """The page is there: work can begin."""
        if self.work.begin(self._hear):
            self.document.add_periodic_callback(self.work.watch, 500)

    def _hear(self, answer: Answer) -> None:
        """Hand an answer over, from the thread that listens to the worker's pipe."""
        self.later(self.work.take, answer)

    def later(self, act: Callable[..., None], *given: Any) -> None:
        """Call a function in the thread that the page belongs to, from any other one."""
        with suppress(AttributeError):  # the tab has been closed, and its document taken apart
            self.document.add_next_tick_callback(partial(act, *given))

    def _close(self) -> None:
        self.work.close()
        self.bench.close()

    # --- what a person does

    def _told(self, text: str) -> None:
        """A message of the page: plain JSON, checked field by field; nothing of it is executed."""
        message: Any = None
        try:
            message = json.loads(text)
            self._heard = message["n"]
            action, name, value = message["do"], str(message.get("name", "")), message.get("value")
            known: dict[str, Callable[[str, Any], object]] = {
                "set": self._set, "model": self._model, "preset": self._preset, "end": self._end_step,
                "undo": lambda *_: self.past.undo(), "redo": lambda *_: self.past.redo(), "look": self._look,
                "reset": self._reset, "begin": self._begin, "save": self._save, **self.bench.actions,
                **self.workshop.actions,
            }  # fmt: skip
            if action not in known:
                raise ValueError(f"the page asked for {str(action)[:40]!r}, which does not exist")
            self.notes.pop("page", None)
            self.notes.pop(name, None)
            known[action](name, value)
        except (ValueError, TypeError, KeyError) as error:
            place = str(message.get("name") or "page") if isinstance(message, dict) else "page"
            self.notes[place] = str(error)
        self.refresh()

    def _set(self, name: str, value: Any) -> None:
        self.past.put(self._arranged(name, changed(self.state, name, value, list(self.system.states))), name)

    def _arranged(self, name: str, state: State) -> State:
        """Another parameter of the diagram takes a range of its own; a range keeps its order."""
        if name == "over":
            value = state.values[state.over]
            low, high = (0.6 * value, 1.4 * value) if value > 0 else slider_range(value)
            return replace(state, low=low, high=high)
        if state.low == state.high:
            raise ValueError("the two ends of the range are equal; give two different numbers")
        return replace(state, low=min(state.low, state.high), high=max(state.low, state.high))

    def _model(self, name: str, value: Any) -> None:
        if value not in self.models:
            raise ValueError(f"{str(value)[:40]!r} is no model of this page")
        self.show_model(value)

    def add_model(self, name: str, system: System) -> str:
        """Offer a model that was made in the page; returns its name."""
        self.models[name] = lambda: system
        return name

    def show_model(self, value: str) -> None:
        """Go on to a model, at its own parameters."""
        self.past.put(first_state(value, _system(self.models, self._systems, value)))

    def _preset(self, name: str, value: Any) -> None:
        known = presets_of(self.state)
        if value not in known:
            raise ValueError(f"{str(value)[:40]!r} is no figure of this model; there are: {', '.join(known)}")
        self.past.put(known[value])

    def _save(self, name: str, value: Any) -> None:
        """Make a file of a view in a thread, and hand it to the browser."""
        view, kind = str(value["view"]), str(value["kind"])
        results, state = dict(self.results), self.state

        def make() -> None:
            told: dict[str, Any]
            try:
                file, content = exported(view, kind, results, state)
                told = {"name": file, "content": base64.b64encode(content).decode()}
            except Exception as error:
                told = {"wrong": str(error)}
            self.later(self._hand_over, told)

        threading.Thread(target=make, daemon=True).start()

    def _hand_over(self, told: dict[str, Any]) -> None:
        self._saved += 1
        if "wrong" in told:
            self.notes["page"] = told["wrong"]
            self.tell("notes", self.notes)
        else:
            self.tell("file", {**told, "n": self._saved})

    def _reset(self, name: str, value: Any) -> None:
        self.past.put(first_state(self.state.model, self.system))

    def _end_step(self, name: str, value: Any) -> None:
        self.past.end_step()

    def _look(self, name: str, value: Any) -> None:
        self.dark, self.large = bool(value["dark"]), bool(value["large"])
        self.document.theme = theme(self.dark, self.large)
        for one in (self.portrait, self.history, self.section, self.overlay):
            one.paint(self.dark)
        for view in self.views:
            view.paint(self.dark)

    def _tap_diagram(self, event: Any) -> None:
        value, start = self.diagram.nearest(event.x, event.y, self.state)
        state = self.state.with_value(self.state.over, value)
        self.past.put(state if start is None else replace(state, start=start))
        self.refresh()

    def _tap_plane(self, event: Any) -> None:
        start = dict(zip(self.system.states, self.state.start, strict=True))
        start[self.state.x], start[self.state.y] = float(event.x), float(event.y)
        self.past.put(replace(self.state, start=tuple(start.values())))
        self.refresh()

    def _resized(self, pixels: int) -> None:
        self.diagram.pixels = max(pixels, 50)
        self.diagram.redraw(self.state)

    def _zoom_diagram(self, event: Any) -> None:
        if event.x1 > event.x0:
            self.past.put(replace(self.state, low=float(event.x0), high=float(event.x1)), "zoom")
        self.diagram.redraw(self.state)
        self.refresh()

    def _tap_view(self, view: View, event: Any) -> None:
        self.past.put(view.tapped(float(event.x), float(event.y), self.system, self.state))
        self.refresh()

    def _zoom_view(self, view: View, event: Any) -> None:
        if event.x1 > event.x0 and event.y1 > event.y0:
            x, y = (float(event.x0), float(event.x1)), (float(event.y0), float(event.y1))
            self.past.put(view.zoomed(x, y, self.system, self.state), f"zoom {view.name}")
        self.refresh()

    def _reset_view(self, view: View, event: Any) -> None:
        self.past.put(view.unzoomed(self.system, self.state))
        self.refresh()

    # --- what is to be computed

    def wanted(self) -> dict[str, dict[str, Any]]:
        """The request of every view that is shown, for the state of the page."""
        state = self.state
        found = requests_of(self.system, self.text, state)
        known = "judged" in self.results and self.work.done.get("orbit") == key_of(found["orbit"])
        base = dict(found)
        if known:
            base["motion"] = motion_of(found["orbit"], self.results)
        if known and not self.system.is_map:
            found["stability"] = stability_request(found["orbit"], self.results)
        if known and (request := self.bench.request(found["orbit"], self._period_number())) is not None:
            found["recording"] = request
        if self.work.done.get("diagram") == key_of(found["diagram"]):
            del found["first look"]
        if state.upper != "diagram":
            found = {view: request for view, request in found.items() if view not in ("first look", "diagram")}
        for view in self.views:
            asked = view.requests(self.system, state, base) if view.shown(self.system, state) else {}
            for stage in [*asked][-1:]:
                found |= {stage: asked[stage]} if self.work.done.get(stage) == key_of(asked[stage]) else asked
        return found

    # --- what is shown

    @property
    def subject(self) -> tuple[str, str]:
        """The model, and the parameter of the diagram."""
        return self.state.model, self.state.over

    def show(self, request: Asked, found: Mapping[str, Any]) -> None:
        """Draw an answer, where the page still shows what it is of."""
        state, system = self.state, self.system
        view = request.view
        if request.of[0] != state.model:
            return
        if view in ("first look", "diagram"):
            result = found["diagram"]
            if request.of[1] != state.over:
                return
            stage = "judged" if view == "diagram" else "first look"
            self.results["diagram"] = result
            self.diagram.put(result, stage, state, request.key, system.parameters[state.over].unit)
            self._axes_of_diagram()
            self._tell_ui()
        elif view == "orbit":
            self.results.pop("stability", None)
            self.results.update(found)
            self._show_orbit()
        elif view == "section":
            self.results["section"] = found["section"]
            self._show_section()
        elif view == "recording":
            self.bench.put(found)
            self._show_recording()
        elif view == "stability":
            self.results["stability"] = found
            self._tell_readout()
        else:
            for one in self.views:
                if view in one.stages and not one.depends(request.of, self.subject):
                    one.show(json.loads(request.key), found, system, state)
                    if one.saved is not None and one.saved[0] in found:
                        self.results[one.name] = found[one.saved[0]]
            self._tell_ui()

    def failed(self, view: str) -> None:
        """Take back what is said of a motion that could not be computed; its note says why."""
        if view == "orbit":
            for key in ("judged", "run", "section", "stability"):
                self.results.pop(key, None)
            for key in ("orbit", "section", "stability", "recording"):
                self.work.done.pop(key, None)
            self.tell("readout", [])

    def _axes_of_diagram(self) -> None:
        state, system, symbols = self.state, self.system, symbols_of(self.system)
        self.diagram.x.name(symbols[state.over], system.parameters[state.over].unit)
        self.diagram.y.name(symbols[state.shown], system.states[state.shown])

    def _show_orbit(self) -> None:
        state, system, symbols = self.state, self.system, symbols_of(self.system)
        run = self.results["run"]
        self.portrait.put(run, state, symbols, system.states, self._zone(), system.is_map)
        self.history.put(run, state, symbols, system.states)
        self._tell_readout()

    def _show_section(self) -> None:
        state, result = self.state, self.results["section"]
        names = [str(name) for name in result["state"].values]
        points = result["section"].values[:, [names.index(state.x), names.index(state.y)]]
        apart = distinct(result["section"].values)
        points = points[-len(apart) :][apart] if apart.sum() <= MOST else points
        self.section.put(points, self.results.get("run"), state, symbols_of(self.system), self.system.states)
        self.portrait.mark(points)
        self._tell_readout()

    def _show_recording(self) -> None:
        self.overlay.put(self.bench.laid, self.state)
        if "run" in self.results:
            self._show_orbit()
        if "section" in self.results:
            self._show_section()

    def _zone(self) -> float | None:
        """The gap behind which contact lies, where an indicator is ``x`` less a parameter."""
        traced = self.system.traced
        names = list(self.system.parameters)
        state = traced.u[list(self.system.states).index(self.state.x)]
        for indicator in traced.indicators:
            for k, symbol in enumerate(traced.p):
                if indicator == state - symbol:
                    return float(self.state.values[names[k]])
        return None

    def tell(self, channel: str, content: Any) -> None:
        text = json.dumps(content)
        if self._say[channel].value != text:
            self._say[channel].value = text

    def _tell_readout(self) -> None:
        if "judged" in self.results:
            self.tell("readout", [*readout(self.system, self.state, self.results), *self.bench.readout()])

    def _tell_ui(self) -> None:
        found = controls(self.system, self.state, self.models, self.diagram.stage, self.views)
        look = {"dark": self.dark, "large": self.large}
        self.tell("ui", {**found, **look, "heard": self._heard, "can": self.past.can})

    def refresh(self) -> None:
        """The page as the state has it, and work for what that lacks."""
        state, system = self.state, self.system
        if self._of != self.subject:
            self.diagram.clear()
            self.results.pop("diagram", None)
            if self._of[0] != state.model:
                self.results.clear()
                self.work.done.clear()
                self.bench.arrange()
            for view in ("first look", "diagram"):
                self.work.done.pop(view, None)
            for one in self.views:
                if one.depends(self._of, self.subject):
                    one.clear()
                    for stage in one.stages:
                        self.work.done.pop(stage, None)
            self._of = self.subject
        if self._axes != (state.x, state.y, state.shown):
            self._axes = state.x, state.y, state.shown
            if self.diagram.result is not None:
                self.diagram.redraw(state)
                self._axes_of_diagram()
            if "run" in self.results:
                self._show_orbit()
            if "section" in self.results:
                self._show_section()
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
        self.tell("notes", self.notes)
        self.work.go_on()  # before the page hears that its message has been taken in
        self.bench.tell()
        self.workshop.tell()
        self._tell_ui()


def _system(models: Models, known: dict[str, System], name: str) -> System:
    if name not in known:
        known[name] = models[name]()
    return known[name]


def _state_of(models: Models, known: dict[str, System], pairs: Sequence[tuple[str, str]]) -> State:
    """The state that a page's address describes; the first model's first view where it says nothing."""
    default = GIVEN if GIVEN in models else PAPER
    name = next((value for key, value in pairs if key == "model"), default)
    if name not in models:
        raise ValueError(f"{name[:60]!r} is no model of this page; there are: {', '.join(models)}")
    system = _system(models, known, name)
    state = first_state(name, system)
    if name == PAPER and not pairs:
        state = presets_of(state)["Fig. 11"]
    return from_query(pairs, state, list(system.states))
