"""One page: what it shows, what is still to be computed for it, and what a person does to it."""

from __future__ import annotations

import base64
import json
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from importlib.resources import files
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl

from bokeh.events import DoubleTap, RangesUpdate, Reset, Tap
from bokeh.models import TextInput
from jinja2 import DictLoader, Environment

from nonsmooth.explorer.building import KINDS, LINK, Workshop
from nonsmooth.explorer.catalogue import Catalogue, presets_of, slider_range, text_of
from nonsmooth.explorer.export import KINDS as FILES
from nonsmooth.explorer.export import exported
from nonsmooth.explorer.figures import theme
from nonsmooth.explorer.kinds import KINDS as VIEWS
from nonsmooth.explorer.kinds import PANELS
from nonsmooth.explorer.schedule import Schedule, key_of
from nonsmooth.explorer.sheet import Sheet
from nonsmooth.explorer.sketch import equations_of
from nonsmooth.explorer.state import History, PageState, changed

if TYPE_CHECKING:
    from nonsmooth.explorer.views.view import View
    from nonsmooth.system.system import System

#: To the browser, each one line of JSON; what comes from it is ``act``.
CHANNELS = ("ui", "readout", "busy", "notes", "file", "recording", "building", "sketch", "equations")
MOST_TABS = 8  # that compute at a time
#: Files that make the page; what a part of the page does comes before the page itself.
TEXTS = (
    "page.html",
    "recording.html",
    "building.html",
    "page.css",
    "recording.js",
    "building.js",
    "tour.js",
    "sketch.js",
    "page.js",
)


class Page:
    """The page of one browser tab.

    Parameters
    ----------
    document : bokeh Document
    catalogue : Catalogue
        The models that it offers.
    query : str
        The view to begin with, where the page's own address holds none.
    tabs : list of Page
        The pages that are open, for each to say how many share the machine.
    """

    def __init__(self, document: Any, catalogue: Catalogue, query: str, tabs: list[Page]) -> None:
        self.document, self.catalogue, self.tabs = document, catalogue, tabs
        self.dark = self.large = False
        self._saved = 0
        self._heard = 0  # number of the page's last message
        self.notes: dict[str, str] = {}
        self._refused: dict[str, tuple[PageState, str]] = {}  # of a note on a wrong value the state that stayed
        self._say = {name: TextInput(name=name) for name in CHANNELS}
        self._act = TextInput(name="act")
        self.past = History(self._first(query))
        self.sheet = Sheet(self)
        self.bench, self.workshop = self.sheet.bench, Workshop(self)
        self._build()
        self.work = Schedule(self)
        document.on_session_destroyed(lambda context: self._close())
        self.refresh()

    @property
    def state(self) -> PageState:
        """The state that the page shows."""
        return self.past.state

    @property
    def subject(self) -> tuple[str, str]:
        """The model, and the parameter of the diagram."""
        return self.state.model, self.state.over

    @property
    def system(self) -> System:
        """The system at its own parameters."""
        return self.catalogue.system(self.state.model)

    @property
    def text(self) -> str:
        """The system's text, as the worker takes it."""
        return text_of(self.system)

    def _first(self, query: str) -> PageState:
        context = self.document.session_context
        request = getattr(context, "request", None)
        arguments = getattr(request, "arguments", None) or {}
        pairs = [
            (name, value.decode(errors="replace"))
            for name, values in arguments.items()
            if name != "token"
            for value in values
        ]
        try:
            return self.catalogue.state_of(pairs or parse_qsl(query))
        except ValueError as error:
            self.notes["page"] = f"The address could not be read, so the page shows its first view: {error}"
            return self.catalogue.state_of(parse_qsl(query))

    def _build(self) -> None:
        document = self.document
        document.title = "nonsmooth explorer"
        folder = files("nonsmooth.explorer")
        texts = {name: folder.joinpath(name).read_text(encoding="utf-8") for name in TEXTS}
        document.template = Environment(loader=DictLoader(texts)).get_template("page.html")
        program = "\n".join(text for name, text in texts.items() if name.endswith(".js"))
        document.template_variables.update(
            link=LINK,
            kinds=KINDS,
            style=texts["page.css"],
            program=program,
            panels=PANELS,
            views=VIEWS,
            files=FILES,
            channels=("act", *CHANNELS),
        )
        # a second click soon after the first is a double one, wherever it lies
        acts = {Tap: self._tap, DoubleTap: self._tap, RangesUpdate: self._zoom, Reset: self._reset_view}
        with document.models.freeze():  # else Bokeh looks through all models again for each root
            for view in self.sheet.views.values():
                if view.figure is not None:
                    for kind, act in acts.items():
                        view.figure.plot.on_event(kind, partial(act, view))
                    document.add_root(view.figure.plot)  # events are heard of what had a callback by now
            for channel in (self._act, *self._say.values()):
                document.add_root(channel)
        document.theme = theme(self.dark, self.large)
        self._act.on_change("value", lambda attr, old, new: self._told(new))

    def _begin(self) -> None:
        """The page is there: work begins, where not too many others are at it; once it has gone its session ends."""
        if (served := self.document.session_context) is not None:
            served.session.request_expiration()
        if self.work.worker is None and len(self.tabs) >= MOST_TABS:
            self.notes["page"] = (
                f"{MOST_TABS} tabs of this explorer compute already, each in a process of some 300 MB. Close one of "
                "them; this one begins with the next change that you make here."
            )
        elif self.work.begin(partial(self.later, self.work.take)):
            self.tabs.append(self)
            self._tell_tabs()
            self.document.add_periodic_callback(self.work.watch, 500)

    def later(self, act: Callable[..., None], *given: Any) -> None:
        """Call a function in the thread that the page belongs to, from any other one, as that of a worker's pipe."""
        with suppress(AttributeError):  # the tab has been closed, and its document taken apart
            self.document.add_next_tick_callback(partial(act, *given))

    def _tell_tabs(self) -> None:
        for one in self.tabs:
            one.later(one.tell_ui)

    def _close(self) -> None:
        if self in self.tabs:
            self.tabs.remove(self)
            self._tell_tabs()
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
                "set": self._set,
                "model": lambda _, value: self.show_model(value),
                "preset": self._preset,
                "end": lambda *_: self.past.end_step(),
                "undo": lambda *_: self.past.undo(),
                "look": self._look,
                "redo": lambda *_: self.past.redo(),
                "reset": lambda *_: self.show_model(self.state.model),
                "begin": lambda *_: None,
                "save": self._save,
                **self.bench.actions,
                **self.workshop.actions,
            }
            if action not in known:
                raise ValueError(f"the page asked for {str(action)[:40]!r}, which does not exist")
            self.notes.pop("page", None)
            self.notes.pop(name, None)
            known[action](name, value)
        except (ValueError, TypeError, LookupError) as error:
            place = str(message.get("name") or "page") if isinstance(message, dict) else "page"
            self.notes[place] = str(error)
            self._refused[place] = self.state, str(error)
        self._begin()
        self.refresh()

    def _set(self, name: str, value: Any) -> None:
        owners: dict[str, Any] = {"recording": self.bench, "fit": self.bench, "build": self.workshop}
        if owner := owners.get(name.partition(".")[0]):
            owner.set(name, value)
        else:
            self.past.put(self._arranged(name, changed(self.state, name, value, list(self.system.states))), name)

    def _arranged(self, name: str, state: PageState) -> PageState:
        """Another parameter of the diagram takes a range of its own; a range keeps its order."""
        if name == "over":
            value = state.values[state.over]
            low, high = (0.6 * value, 1.4 * value) if value > 0 else slider_range(value)
            return replace(state, low=low, high=high)
        if state.low == state.high:
            raise ValueError("the two ends of the range are equal; give two different numbers")
        return replace(state, low=min(state.low, state.high), high=max(state.low, state.high))

    def show_model(self, value: str) -> None:
        """Go on to a model, at its own parameters."""
        self.past.put(self.catalogue.first_state(value))

    def _preset(self, name: str, value: Any) -> None:
        known = presets_of(self.state.model)
        if value not in known:
            raise ValueError(f"{str(value)[:40]!r} is no figure of this model; there are: {', '.join(known)}")
        self.past.put(known[value])

    def _save(self, name: str, value: Any) -> None:
        """Make a file of a view in a thread, and hand it to the browser."""
        view, kind = str(value["view"]), str(value["kind"])
        results, state = dict(self.sheet.results), self.state

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

    def _look(self, name: str, value: Any) -> None:
        self.dark, self.large = bool(value["dark"]), bool(value["large"])
        self.document.theme = theme(self.dark, self.large)
        self.sheet.paint(self.dark)

    def _tap(self, view: View, event: Any) -> None:
        self.past.put(view.tapped(float(event.x), float(event.y)))
        self.refresh()

    def _zoom(self, view: View, event: Any) -> None:
        if event.x1 > event.x0 and event.y1 > event.y0:
            x, y = (float(event.x0), float(event.x1)), (float(event.y0), float(event.y1))
            self.past.put(view.zoomed(x, y), f"zoom {view.name}")
        self.refresh()

    def _reset_view(self, view: View, event: Any) -> None:
        self.past.put(view.unzoomed())
        self.refresh()

    # --- what is to be computed

    def wanted(self) -> dict[str, dict[str, Any]]:
        """The request of every view that is shown, for the state of the page."""
        state, done, results = self.state, self.work.done, self.sheet.results
        begin = list(self.catalogue.first_state(state.model).start)
        common = {
            "text": self.text,
            "values": dict(state.values),
            "method": state.method,
            "transient": state.transient,
            "eta": state.eta if state.method == "smoothed" else 0.0,
            "keep": state.keep,
        }
        orbit: dict[str, Any] = {**common, "view": "orbit", "start": list(state.start)}
        base: dict[str, dict[str, Any]] = {
            "orbit": orbit,
            "first look": {
                **common,
                "view": "first look",
                "values": {**state.values, state.over: state.low},
                "over": state.over,
                "low": state.low,
                "high": state.high,
                "columns": state.columns,
                "begin": begin,
            },
        }
        if "judged" in results and done.get("orbit") == key_of(orbit):  # its period number, and the time of its record
            time, period = results["run"]["time"].values, int(results["judged"]["period_number"].values[0])
            base["motion"] = {**orbit, "period": period, "span": float(time[-1] - time[0])}
        found: dict[str, dict[str, Any]] = {}
        for view in self.sheet.views.values():
            asked = view.requests(base) if view.shown else {}
            for stage in [*asked][-1:]:  # of what is there in its finest form nothing coarser is asked for
                found |= {stage: asked[stage]} if done.get(stage) == key_of(asked[stage]) else asked
        return found

    # --- what the browser hears

    def tell(self, channel: str, content: Any) -> None:
        """Send one of the channels its content, where that has changed."""
        text = json.dumps(content)
        if self._say[channel].value != text:
            self._say[channel].value = text

    def tell_ui(self) -> None:
        """The controls as the state has them."""
        found = self.sheet.controls(self.catalogue)
        look = {"dark": self.dark, "large": self.large}
        self.tell("ui", {**found, **look, "heard": self._heard, "can": self.past.can, "tabs": len(self.tabs)})

    def refresh(self) -> None:
        """The page as the state has it, and work for what that lacks."""
        for place, (state, sentence) in list(self._refused.items()):
            if state != self.state:  # values are good again
                del self._refused[place]
                if self.notes.get(place) == sentence:
                    del self.notes[place]
        self.sheet.follow()
        self.tell("notes", self.notes)
        self.work.go_on()  # before the page hears that its message has been taken in
        self.bench.tell()
        self.workshop.tell()
        self.tell("equations", equations_of(self.system))
        self.tell_ui()
