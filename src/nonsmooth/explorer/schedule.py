"""Work of one page: the worker is asked for what is missing, the quick first; what nobody waits for is cancelled."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from nonsmooth.explorer.kinds import KINDS, ORDER, QUICK
from nonsmooth.explorer.worker import DEAF, Answer, Worker

if TYPE_CHECKING:
    from nonsmooth.explorer.session import Page

_PATIENCE = 1.0  # seconds after which short work is cancelled like any other
_VAIN = 3  # times in a row that the worker ended before it could take work; then it is not started again
_NOT_STARTED = (
    f"The process that computes cannot be started: {_VAIN} times in a row it ended at once. The terminal of nonsmooth "
    "explore shows its error; mend that, and load this page again: its address holds what you set."
)


def key_of(request: Mapping[str, Any]) -> str:
    """Text by which two requests are the same; a recording stands in it as its ``key``."""
    return json.dumps(request, sort_keys=True, default=lambda one: one.key)


@dataclass
class Asked:
    """A request that the worker has."""

    number: int
    view: str
    key: str
    of: tuple[str, str]  # the model, and the parameter of the diagram
    since: float
    cancelled: float | None = None


class Schedule:
    """Requests of one page (a :class:`nonsmooth.explorer.session.Page`) and their answers."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.done: dict[str, str] = {}  # of each view the key of the request whose answer is shown
        self._failed: dict[str, str] = {}
        self._crashed: dict[str, int] = {}
        self._said: dict[str, tuple[str, str]] = {}  # of a view the key of a request and the sentence on it
        self._vain = 0
        self._running: Asked | None = None
        self._count = 0
        self.worker: Worker | None = None  # a request that opens no page starts no process
        self._hear: Callable[[Answer], None] | None = None

    def begin(self, hear: Callable[[Answer], None]) -> bool:
        """Start the worker; False where it has been started."""
        if self._hear is not None:
            return False
        self._hear, self.worker = hear, Worker.idle(hear)
        return True

    def close(self) -> None:
        """Leave the worker to another page."""
        if self.worker is not None:
            self.worker.close()
        self.worker = None

    def go_on(self) -> None:
        """Ask for what is missing; say so where nothing is."""
        if not self.ask():
            self.page.tell("busy", {"view": ""})

    def ask(self) -> bool:
        """Ask for what is missing, the quick first; cancel what nobody waits for any more. False: nothing is."""
        if self.worker is None:
            return True
        if self._vain == _VAIN:
            self.page.notes["page"] = _NOT_STARTED
            self.page.tell("notes", self.page.notes)
            return False
        wanted = {view: (spec, key_of(spec)) for view, spec in self.page.wanted().items()}
        self._tell_notes({view: key for view, (_, key) in wanted.items()})
        missing = [
            view
            for view in ORDER
            if view in wanted and wanted[view][1] not in (self.done.get(view), self._failed.get(view))
        ]
        now, running, order = time.monotonic(), self._running, [*ORDER]
        if running is not None:
            stale = running.view not in wanted or wanted[running.view][1] != running.key
            quick = running.view in QUICK and now - running.since < _PATIENCE
            overtaken = bool(missing) and order.index(missing[0]) < order.index(running.view)
            if (stale or overtaken) and not quick and running.cancelled is None:
                running.cancelled = now
                self.worker.cancel(running.number)
            return True
        if not missing:
            return False
        view = missing[0]
        self._count += 1
        self._running = Asked(self._count, view, wanted[view][1], self.page.subject, now)
        self.worker.ask(self._count, wanted[view][0])
        starting = not self.done and not self._failed
        self.page.tell("busy", {"view": view, "fraction": 0, "long": starting or view not in QUICK})
        return True

    def _tell_notes(self, wanted: Mapping[str, str]) -> None:
        """A sentence on a request is shown as long as that request is the one of the page."""
        for view, (key, sentence) in self._said.items():
            place = ORDER[view]
            if wanted.get(view) == key:
                self.page.notes[place] = sentence
            elif self.page.notes.get(place) == sentence:
                del self.page.notes[place]
        self.page.tell("notes", self.page.notes)

    def watch(self) -> None:
        """End a worker that does not hear that its work is cancelled."""
        running = self._running
        if running is None or self.worker is None:
            return
        if running.cancelled is None:
            self.go_on()
        elif time.monotonic() - running.cancelled > DEAF:
            self.worker.end()

    def take(self, answer: Answer) -> None:
        """Receive an answer of the worker."""
        kind, count, content = answer
        running = self._running
        if kind == "ended":
            self._restart(content)
            return
        if kind == "ready":
            self._vain = 0
            return
        if running is None or count != running.number:
            return
        if kind in ("progress", "compiling"):
            fraction = round(float(content), 3) if kind == "progress" else 0
            busy = {"view": running.view, "fraction": fraction, "long": True, "compiling": kind == "compiling"}
            self.page.tell("busy", busy)
            return
        self._running = None
        if kind == "error":
            self._failed[running.view] = running.key
            self._said[running.view] = running.key, str(content)
            self.page.sheet.forget(running.view)
        elif kind == "done":
            found, warned = content
            stages = KINDS[ORDER[running.view]].stages
            for finer in stages[stages.index(running.view) + 1 :]:  # of other values: it is drawn over
                self.done.pop(finer, None)
            self.done[running.view] = running.key
            self._failed.pop(running.view, None)
            if warned:
                self._said[running.view] = running.key, warned[0]
            if self.page.sheet.keep(running, found):
                self.ask()  # the worker computes while this is drawn
                self.page.sheet.show(running, found)
        self.go_on()

    def _restart(self, code: int) -> None:
        running, self._running = self._running, None
        if self.worker is None or self._hear is None:  # the page has gone
            return
        self._vain += 1
        if self._vain < _VAIN:
            self.worker = Worker.idle(self._hear)
        if running is not None:
            known = self._crashed[running.key] = self._crashed.get(running.key, 0) + 1
            if known > 1 and running.cancelled is None:
                self._failed[running.view] = running.key
        if running is None or running.cancelled is None:
            self.page.notes["page"] = (
                f"The process that computes ended unexpectedly (code {code}). Another one was started; "
                "nothing that you set is lost."
            )
        self.page.tell("notes", self.page.notes)
        self.go_on()
