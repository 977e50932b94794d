"""Views of a page and the results in them: how an answer of the worker comes into them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from nonsmooth.explorer.bench import Bench
from nonsmooth.explorer.kinds import KINDS, ORDER
from nonsmooth.explorer.views import VIEWS

if TYPE_CHECKING:
    from nonsmooth.explorer.schedule import Asked
    from nonsmooth.explorer.session import Session

__all__ = ["Sheet"]


class Sheet:
    """Views and results of a page."""

    def __init__(self, page: Session) -> None:
        self.page, self.bench = page, Bench(page)
        self.views: dict[str, Any] = {}
        for one in VIEWS:
            self.views[one.name] = one(self)
        self.views = {name: self.views[name] for name in KINDS}
        self._of = page.subject  # of what is drawn
        self._axes = page.state.x, page.state.y, page.state.shown

    @property
    def results(self) -> dict[str, Any]:
        """What all views hold, by name."""
        return {name: result for view in self.views.values() for name, result in view.results.items()}

    @property
    def plots(self) -> list[Any]:
        """The figures of the page."""
        return [view.figure.plot for view in self.views.values() if view.figure is not None]

    def paint(self, dark: bool) -> None:
        """Take the colours that show on a light or a dark ground."""
        for view in self.views.values():
            view.paint(dark)

    def show(self, request: Asked, found: Mapping[str, Any]) -> None:
        """Draw an answer, where the page still shows what it is of."""
        view = self.views[ORDER[request.view]]
        if not view.depends(request.of, self.page.subject):
            view.show(json.loads(request.key), found)
            self.views["readout"].redraw()
            self.page.tell_ui()

    def forget(self, stage: str) -> None:
        """Take back what is said of a motion that could not be computed; its note says why."""
        if stage == "orbit":
            for name in ("portrait", "section", "readout"):
                self.views[name].results.clear()
            self._undo("portrait", "section", "readout", "recording")
            self.page.tell("readout", [])

    def _undo(self, *views: str) -> None:
        """Ask for the results of views again."""
        for name in views:
            for stage in (*KINDS[name].quick, *KINDS[name].slow):
                self.page.work.done.pop(stage, None)

    def follow(self) -> None:
        """Take away what is not of the page's model, and draw the rest as the page's state has it."""
        state, subject = self.page.state, self.page.subject
        old, self._of = self._of, subject
        for name, view in self.views.items():
            if view.depends(old, subject):
                view.clear()
                self._undo(name)
        axes = state.x, state.y, state.shown
        if (old, self._axes) != (subject, axes):
            self._axes = axes
            for view in self.views.values():
                view.redraw()
        for view in self.views.values():
            view.place()
