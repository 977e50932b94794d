"""Views of a page and the results in them: how an answer of the worker comes into them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from nonsmooth.explorer.bench import Bench
from nonsmooth.explorer.catalogue import GIVEN, presets_of, slider_range
from nonsmooth.explorer.kinds import KINDS, ORDER, SETTINGS, setting
from nonsmooth.explorer.labels import html_of, plain_of, rows_of, symbols_of
from nonsmooth.explorer.state import CHOICES, to_query
from nonsmooth.explorer.views.motion import AmplitudeSpectrum, Mechanism, Portrait, Readout, SectionPoints, TimeHistory
from nonsmooth.explorer.views.over_parameters import Branches, Diagram, Response
from nonsmooth.explorer.views.planes import Basins, Chart
from nonsmooth.explorer.views.recording import RecordingOverlay

if TYPE_CHECKING:
    from nonsmooth.explorer.schedule import Asked
    from nonsmooth.explorer.session import Page

#: Drawing of each of ``KINDS``; what draws into another's figure comes behind it.
_VIEWS = (
    Portrait,
    Diagram,
    SectionPoints,
    Readout,
    TimeHistory,
    Branches,
    Response,
    Chart,
    Basins,
    AmplitudeSpectrum,
    Mechanism,
    RecordingOverlay,
)


class Sheet:
    """Views and results of a page."""

    def __init__(self, page: Page) -> None:
        self.page, self.bench = page, Bench(page)
        self.views: dict[str, Any] = {}
        for one in _VIEWS:
            self.views[one.name] = one(self)
        self.views = {name: self.views[name] for name in KINDS}
        self._of = page.subject  # of what is drawn
        self._axes = page.state.x, page.state.y, page.state.shown

    @property
    def results(self) -> dict[str, Any]:
        """Results of all views, by name."""
        return {name: result for view in self.views.values() for name, result in view.results.items()}

    def paint(self, dark: bool) -> None:
        """Take the colours that show on a light or a dark ground."""
        for view in self.views.values():
            view.paint(dark)

    def keep(self, request: Asked, found: Mapping[str, Any]) -> bool:
        """Keep an answer, from which the next request may follow; False where the page shows something else now."""
        view = self.views[ORDER[request.view]]
        kept = not view.depends(request.of, self.page.subject)
        if kept:
            view.results.update(found)
        return kept

    def show(self, request: Asked, found: Mapping[str, Any]) -> None:
        """Draw an answer that was kept."""
        self.views[ORDER[request.view]].show(json.loads(request.key), found)
        self.views["readout"].redraw()
        self.page.tell_ui()

    def forget(self, stage: str) -> None:
        """Take back what is said of a motion that could not be computed; its note says why."""
        if stage == "orbit":
            for name in ("portrait", "section", "readout"):
                self.views[name].results.clear()
            self.undo("portrait", "section", "readout", "recording")
            self.page.tell("readout", [])

    def undo(self, *views: str) -> None:
        """Ask for the results of views again."""
        for name in views:
            for stage in KINDS[name].stages:
                self.page.work.done.pop(stage, None)

    def follow(self) -> None:
        """Take away what is not of the page's model, and draw the rest as the page's state has it."""
        state, subject = self.page.state, self.page.subject
        old, self._of = self._of, subject
        for name, view in self.views.items():
            if view.depends(old, subject):
                view.clear()
                self.undo(name)
        axes = state.x, state.y, state.shown
        if (old, self._axes) != (subject, axes):
            self._axes = axes
            for view in self.views.values():
                view.redraw()
        for view in self.views.values():
            view.place()

    def controls(self, models: Iterable[str]) -> dict[str, Any]:
        """Content of the page's controls: models, parameters with the ends of their sliders, values and choices of all
        fields, legends."""
        system, state = self.page.system, self.page.state
        settings = {name: one for name, one in SETTINGS.items() if one.label}
        symbols, rows = symbols_of(system), []
        plain = {name: plain_of(symbol) for name, symbol in symbols.items()}
        values = {key: value for key, value in vars(state).items() if key not in ("values", "settings", "start")}
        values |= {f"p.{name}": value for name, value in state.values.items()}
        values |= {f"start.{name}": value for name, value in zip(system.states, state.start, strict=True)}
        values |= {name: setting(name, system, state) for name in settings}
        choices: dict[str, Mapping[str, str]] = {
            **CHOICES,
            "over": {name: plain[name] for name in system.parameters},
            **{axis: {name: plain[name] for name in system.states} for axis in ("x", "y", "shown")},
            **{name: one.choices(system, state) for name, one in settings.items() if one.choices is not None},
        }
        for owner in (self.bench, self.page.workshop):
            more, words = owner.fields()
            values |= more
            choices |= words
        for name, parameter in system.parameters.items():
            also = (state.values[name], *((state.low, state.high) if name == state.over else ()))
            low, high = slider_range(float(system.values[name]), also)
            rows.append(
                {"name": name, "html": html_of(symbols[name]), "unit": parameter.unit, "low": low, "high": high}
            )
        return {
            "models": {name: "your system" if name == GIVEN else name.replace("_", " ") for name in models},
            "presets": list(presets_of(state.model)),
            "parameters": rows,
            "states": rows_of(system),
            "choices": {name: list(words.items()) for name, words in choices.items()},
            "state": values,
            "query": to_query(state),
            "forced": system.period() is not None,
            "legends": {name: view.legend() for name, view in self.views.items()},
        }
