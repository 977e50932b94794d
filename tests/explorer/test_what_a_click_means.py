"""Clicks, zooms and messages become the state that they say, without a browser and without computing."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
import xarray as xr

pytest.importorskip("bokeh", reason="the explorer needs bokeh")

from nonsmooth.explorer.catalogue import Catalogue
from nonsmooth.explorer.schedule import Schedule, key_of
from nonsmooth.explorer.session import MOST_TABS, History, Page


@pytest.fixture(scope="module")
def one_page() -> Iterator[Page]:
    """A page whose work never begins."""
    from bokeh.document import Document

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Schedule, "begin", lambda self, hear: False)
        session = Page(Document(), Catalogue.of(None), "columns=10&transient=20&keep=8&low=0.2&high=0.3", [])
        yield session
        session._close()


@pytest.fixture
def page(one_page: Page) -> Page:
    """The same in its first state."""
    one_page.past = History(one_page._first("columns=10&transient=20&keep=8&low=0.2&high=0.3"))
    one_page.notes.clear()
    one_page.work.done.clear()
    return one_page


def say(page: Page, what: str, name: str = "", value: Any = None, n: int = 1) -> None:
    page._told(json.dumps({"do": what, "name": name, "value": value, "n": n}))


def at(x: float, y: float) -> Any:
    return SimpleNamespace(x=x, y=y)


def over(x0: float, x1: float, y0: float = 0.0, y1: float = 1.0) -> Any:
    return SimpleNamespace(x0=x0, x1=x1, y0=y0, y1=y1)


def test_a_click_in_the_plane_is_a_start(page: Page) -> None:
    """x of the click belongs to the state on the x axis; the other states stay as they are."""
    names = list(page.system.states)
    page.past.put(replace(page.state, x=names[1], y=names[0], start=(0.0, 0.0)))
    page._tap(page.sheet.views["portrait"], at(0.3, -0.2))
    assert dict(zip(names, page.state.start, strict=True)) == {names[1]: 0.3, names[0]: -0.2}


def test_a_zoom_is_the_range_of_the_diagram_and_can_be_undone(page: Page) -> None:
    page._zoom(page.sheet.views["diagram"], over(0.22, 0.27))
    assert (page.state.low, page.state.high) == (0.22, 0.27)
    for empty in (over(0.25, 0.25), over(0.27, 0.22)):
        page._zoom(page.sheet.views["diagram"], empty)
        assert (page.state.low, page.state.high) == (0.22, 0.27)
    say(page, "undo")
    assert (page.state.low, page.state.high) == (0.2, 0.3)


def test_a_range_keeps_its_order_and_has_a_length(page: Page) -> None:
    say(page, "set", "low", 0.5)
    assert (page.state.low, page.state.high) == (0.3, 0.5)
    say(page, "set", "low", page.state.high)
    assert "the two ends of the range are equal" in page.notes["low"]
    assert (page.state.low, page.state.high) == (0.3, 0.5)
    say(page, "set", "low", 0.1)
    assert "low" not in page.notes and (page.state.low, page.state.high) == (0.1, 0.5)


def test_another_parameter_of_the_diagram_brings_its_range(page: Page) -> None:
    """From 0.6 to 1.4 of its value where that is positive; else about it."""
    values = page.state.values
    name = next(name for name, value in values.items() if value > 0 and name != page.state.over)
    say(page, "set", "over", name)
    assert (page.state.over, page.state.low, page.state.high) == pytest.approx(
        (name, 0.6 * values[name], 1.4 * values[name])
    )
    other = next((name for name, value in values.items() if value < 0), None)
    if other is not None:
        say(page, "set", "over", other)
        assert page.state.low < values[other] < page.state.high


def test_reset_is_the_first_state_of_the_same_model(page: Page) -> None:
    other = [*page.catalogue][-1]
    assert other not in (page.state.model, next(iter(page.catalogue)))
    say(page, "model", value=other)
    first = page.state
    assert first.model == other
    page._tap(page.sheet.views["portrait"], at(0.123, 0.456))
    assert page.state != first
    say(page, "reset")
    assert page.state == first


def test_only_what_is_shown_is_asked_for(page: Page) -> None:
    assert {"diagram", "first look"} <= set(page.wanted())
    page.work.done["diagram"] = key_of(page.wanted()["diagram"])
    assert "first look" not in page.wanted() and "diagram" in page.wanted()
    page.past.put(replace(page.state, upper="chart"))
    assert not {"diagram", "first look"} & set(page.wanted())


def test_what_follows_from_a_motion_is_asked_for_of_the_motion_that_is_there(page: Page) -> None:
    """Its exponents, by its period number: not before it is there, nor of other values until theirs is."""
    alone, known = set(page.wanted()), page.sheet.views["portrait"].results
    page.work.done["orbit"] = key_of(page.wanted()["orbit"])
    assert set(page.wanted()) == alone
    judged = xr.Dataset({"period_number": ("parameter", [3])})
    known.update(run=xr.Dataset(coords={"time": [2.0, 7.0]}), judged=judged)
    more = [asked for stage, asked in page.wanted().items() if stage not in alone]
    assert more and all((asked["period"], asked["span"]) == (3, 5.0) for asked in more)
    page.past.put(replace(page.state, values={**page.state.values, "rho": 0.31}))
    assert set(page.wanted()) == alone
    known.clear()


def test_a_message_that_is_none_says_so_and_changes_nothing(page: Page) -> None:
    before = page.state
    say(page, "explode")
    assert "'explode', which does not exist" in page.notes["page"] and page.state == before
    say(page, "preset", "preset", "figure 99")
    assert "is no figure of this model" in page.notes["preset"] and page.state == before
    say(page, "look", value={"dark": True, "large": False}, n=7)
    assert (page.dark, page.large, page._heard) == (True, False, 7) and "page" not in page.notes


def test_as_many_tabs_as_may_compute(page: Page, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last one that may begins; with all of them at work the next waits and says why."""
    began = []
    monkeypatch.setattr(type(page.work), "begin", lambda self, hear: bool(began.append(1)))
    page.tabs[:] = [SimpleNamespace(later=lambda *given: None)] * (MOST_TABS - 1)
    page._begin()
    assert began == [1] and "page" not in page.notes
    page.tabs.append(page.tabs[0])
    page._begin()
    assert began == [1] and f"{MOST_TABS} tabs" in page.notes["page"]
    page.tabs.clear()
