"""A page without a browser: what it shows after a change, what it says, and what becomes of its process."""

from __future__ import annotations

import json
import queue
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bokeh", reason="the explorer needs bokeh")

from bokeh.document import Document
from bokeh.models import ColumnDataSource

from nonsmooth.explorer import session as sessions
from nonsmooth.explorer.catalogue import Catalogue
from nonsmooth.explorer.figures import BLUE
from nonsmooth.explorer.session import Page
from nonsmooth.explorer.worker import Worker
from nonsmooth.plot.style import COLORS

FEW = "columns=10&transient=20&keep=8&low=0.2&high=0.3"
PATIENCE = 120.0


class Tab:
    """A page whose document calls back when it is asked to (a server does it by itself)."""

    def __init__(self, tabs: list[Page], query: str = FEW) -> None:
        self.session = Page(Document(), Catalogue.of(None), query, tabs)
        self.calls: queue.Queue[Callable[[], None]] = queue.Queue()
        self.session.later = lambda act, *given: self.calls.put(lambda: act(*given))  # type: ignore[method-assign]
        self.busy: list[dict[str, Any]] = []
        self._n = 0

    def say(self, what: str, name: str = "", value: Any = None) -> None:
        self._n += 1
        self.session._told(json.dumps({"do": what, "name": name, "value": value, "n": self._n}))

    def told(self, channel: str) -> Any:
        return json.loads(self.session._say[channel].value or "null")

    def until(self, fact: Callable[[], object]) -> None:
        """Let the page hear its process until something is so."""
        end = time.monotonic() + PATIENCE
        while not fact():
            assert time.monotonic() < end, self.session.notes
            try:
                self.calls.get(timeout=0.05)()
            except queue.Empty:
                continue
            if self.told("busy") not in self.busy:
                self.busy.append(self.told("busy"))

    def until_done(self) -> None:
        self.until(lambda: self.told("busy") == {"view": ""})

    def drawn(self) -> dict[str, int]:
        """Numbers of points in the figures' sources; an image counts by its points that are not blank."""
        found = {}
        for root in self.session.document.roots:
            for source in root.select({"type": ColumnDataSource}):
                columns = [np.asarray(column) for name, column in source.data.items() if name in ("x", "xs", "value")]
                if "image" in source.data:
                    columns = [np.nan_to_num(np.asarray(source.data["image"][0])).ravel()]
                    columns = [column[column != 0] for column in columns]
                found[f"{root.name}: {source.name or source.id}"] = max((len(one) for one in columns), default=0)
        return found


@pytest.fixture
def tabs() -> Iterator[list[Page]]:
    found: list[Page] = []
    yield found
    for one in [*found]:
        one._close()


@pytest.fixture
def new_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    """No page takes over the process of another one, which has its environment."""
    monkeypatch.setattr(Worker, "idle", Worker)


def test_nothing_of_a_model_stands_under_the_name_of_the_next(tabs: list[Page]) -> None:
    """The figures, the line above them and the names of the axes are blank until the new motion is there."""
    tab = Tab(tabs)
    tab.say("begin")
    tab.until_done()
    before = tab.drawn()
    assert {name.partition(":")[0] for name, n in before.items() if n} >= {"diagram", "portrait", "history", "section"}
    plots = [tab.session.sheet.views[name].figure.plot for name in ("portrait", "section", "history")]
    names = [("x (mm)", "v (mm/s)")] * 2 + [("t (s)", "x (mm)")]
    assert [(plot.xaxis[0].axis_label, plot.title.text) for plot in plots] == names
    assert tab.told("readout")
    tab.say("model", "", "bilinear_oscillator")
    assert {name for name, n in tab.drawn().items() if n} == set()
    assert tab.told("readout") == []
    assert not tab.session.sheet.views["portrait"].zone.visible
    for plot in plots:
        assert (plot.xaxis[0].axis_label, plot.title.text) == (None, "")


def test_curves_have_the_colour_of_their_mode_on_a_light_and_on_a_dark_ground(tabs: list[Page]) -> None:
    tab = Tab(tabs, f"{FEW}&p.rho=0.45")
    tab.say("begin")
    tab.until_done()
    for dark in (False, True):
        tab.say("look", "", {"dark": dark, "large": False})
        for name in ("portrait", "history"):
            view = tab.session.sheet.views[name]
            assert view.curves.data["mode"] == [0, 1]  # out of contact, and in it
            palette = view.lines.glyph.line_color.transform.palette
            assert palette[:2] == (BLUE[dark], COLORS["second"])


def test_an_orbit_that_is_shown_again_has_its_exponents(tabs: list[Page]) -> None:
    """Undone between the orbit of other values and its exponents: those of the first values were known."""
    tab = Tab(tabs, f"{FEW}&p.rho=0.45")
    tab.say("begin")
    tab.until_done()
    before, done = tab.told("readout"), tab.session.work.done
    assert any(name.startswith("largest") for name, _ in before)
    first = done["orbit"]
    tab.say("set", "p.rho", 0.47)
    tab.until(lambda: done["orbit"] != first)
    tab.say("undo")
    tab.until_done()
    assert tab.told("readout") == before


def test_attractors_have_colours_of_their_own_however_many_there_are(tabs: list[Page]) -> None:
    basins = Tab(tabs).session.sheet.views["basins"]
    found = [(3, np.full((3, 2), float(place))) for place in range(11)]
    assert basins._numbers(found) == [*range(11)]
    assert basins._numbers(found[::-1]) == [*range(11)][::-1]  # and keep them in the next picture


@pytest.mark.usefixtures("new_processes")
def test_a_compile_is_said(tabs: list[Page], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NONSMOOTH_CACHE_DIR", str(tmp_path))
    tab = Tab(tabs, f"model=stick_slip_belt&{FEW}")
    tab.say("begin")
    tab.until(lambda: any(one.get("compiling") for one in tab.busy))
    assert tab.busy[-1] | {"view": ""} == {"view": "", "fraction": 0, "long": True, "compiling": True}


@pytest.mark.usefixtures("new_processes")
def test_a_process_that_cannot_start_is_given_up(tabs: list[Page], tmp_path: Path, monkeypatch: Any) -> None:
    broken, log = tmp_path / "python", tmp_path / "starts"
    broken.write_text(f"#!/bin/sh\necho start >> {log}\nexit 3\n")
    broken.chmod(0o700)
    monkeypatch.setattr(sys, "executable", str(broken))
    tab = Tab(tabs)
    tab.say("begin")
    tab.until(lambda: "cannot be started: 3 times" in tab.told("notes").get("page", ""))
    tab.say("set", "p.rho", 0.25)  # and it stays so
    time.sleep(0.3)
    assert log.read_text().split() == ["start"] * 3
    assert "cannot be started" in tab.told("notes")["page"]
    assert tab.told("busy") == {"view": ""}


def test_a_note_on_a_value_goes_when_the_values_are_good_again(tabs: list[Page]) -> None:
    tab = Tab(tabs)
    tab.say("set", "low", 0.3)  # as the other end
    assert "equal" in tab.told("notes")["low"]
    tab.say("end")
    assert "equal" in tab.told("notes")["low"]
    tab.say("set", "high", 0.4)
    assert tab.told("notes") == {}


def test_a_note_on_a_computation_goes_when_its_values_do(tabs: list[Page]) -> None:
    """Also on the way back to values whose results are there, for which nothing is computed."""
    tab = Tab(tabs, f"{FEW}&upper=diagram")
    tab.say("begin")
    tab.until_done()
    tab.say("set", "low", -1e308)
    tab.say("set", "high", 1e308)  # a range of which no float is the length
    tab.until_done()
    assert "diagram" in tab.told("notes")
    tab.say("undo")
    tab.say("undo")
    assert "diagram" not in tab.told("notes")
    tab.until_done()
    assert "diagram" not in tab.told("notes")


def test_so_many_tabs_compute_and_no_more(tabs: list[Page], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "MOST_TABS", 2)
    first, second, third = Tab(tabs), Tab(tabs), Tab(tabs)
    for one in (first, second, third):
        one.say("begin")
    assert first.session.work.worker and second.session.work.worker and third.session.work.worker is None
    assert "2 tabs" in third.told("notes")["page"]
    first.session._close()
    third.say("set", "p.rho", 0.25)
    assert third.session.work.worker is not None
    assert "page" not in third.told("notes")


def test_what_was_found_of_a_recording_goes_with_it(tabs: list[Page]) -> None:
    """Its distance may come behind its removal."""
    bench = Tab(tabs).session.bench
    bench.put({"distance": {"of": "x"}, "curve": {}, "section": {}, "history": {}, "why": ""})
    assert bench.laid is None
    assert bench.readout() == []
