"""A page with what a browser knows of it, in this process: acts and channels, and work done where it is asked for.

The oscillator of the paper with its support out of reach: x = X cos(omega t + phase), with the X of linear resonance.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from bokeh.document import Document

import nonsmooth as ns
from nonsmooth.explorer.catalogue import Catalogue
from nonsmooth.explorer.session import Page
from nonsmooth.explorer.work import compute

OWN = ns.models.discontinuous_support(g=1.0)
P = OWN.values
X = P["rho"] / np.hypot(2 * P["k"] - P["m"] * P["omega"] ** 2, P["c"] * P["omega"])
V, T = X * P["omega"], 2 * np.pi / P["omega"]


def amplitude(omega: Any, rho: float = P["rho"]) -> Any:
    return rho / np.hypot(2 * P["k"] - P["m"] * omega**2, P["c"] * omega)


class Here:
    """A worker that computes in this process, once it is told to."""

    def __init__(self) -> None:
        self.asked: list[tuple[int, dict[str, Any]]] = []
        self.did: list[str] = []

    def ask(self, number: int, asked: dict[str, Any]) -> None:
        self.asked.append((number, asked))

    def cancel(self, number: int) -> None:
        self.asked = [one for one in self.asked if one[0] != number]

    def close(self) -> None:
        self.asked = []


class Tab:
    """A page with what a browser knows of it."""

    def __init__(self, query: str) -> None:
        self.page = Page(Document(), Catalogue.of(OWN), query, [])
        self.n = 0
        self.act("begin")

    def act(self, do: str, name: str = "", value: Any = None, behind: str = "") -> None:
        """A message of the page; then all work that it makes, or that up to one request."""
        self.n += 1
        message = json.dumps({"n": self.n, "do": do, "name": name, "value": value})
        self.page.document.get_model_by_name("act").value = message
        self.finish(behind)

    def finish(self, behind: str = "") -> None:
        worker: Any = self.page.work.worker
        while worker.asked:
            number, asked = worker.asked.pop(0)
            worker.did.append(asked["view"])
            self.page.work.take(("done", number, (compute(asked, lambda done: True), [])))
            if asked["view"] == behind:
                return

    def event(self, kind: Any, view: str, **values: float) -> None:
        plot = self.page.sheet.views[view].figure.plot
        self.page.document.callbacks.trigger_event(kind(plot, **values))
        self.finish()

    def heard(self, channel: str) -> Any:
        return json.loads(self.page.document.get_model_by_name(channel).value)

    def data(self, source: str) -> dict[str, Any]:
        return dict(self.page.document.get_model_by_name(source).data)

    def ends(self, view: str) -> list[float]:
        plot = self.page.sheet.views[view].figure.plot
        return [plot.x_range.start, plot.x_range.end, plot.y_range.start, plot.y_range.end]


def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let pages compute here, little of everything."""
    monkeypatch.setattr("nonsmooth.explorer.schedule.Worker.idle", lambda hear: Here())
    charts = {"first chart": (6, 5), "chart": (6, 5), "exponents": (3, 2), "fine chart": (8, 7)}
    monkeypatch.setattr("nonsmooth.explorer.work._CHARTS", charts)
    monkeypatch.setattr("nonsmooth.explorer.work._BASINS", {"first basins": 4, "basins": 6, "fine basins": 8})
    monkeypatch.setattr("nonsmooth.explorer.views.over_parameters._POINTS", {"first response": 5, "response": 9})
    monkeypatch.setattr("nonsmooth.explorer.work._POINTS", 50)


def opened(more: str = "") -> Tab:
    return Tab("model=given&columns=10&transient=200&keep=16" + more)
