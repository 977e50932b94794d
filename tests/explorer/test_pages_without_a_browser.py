"""Pages of a motion known in closed form, without a browser."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("bokeh", reason="the explorer needs bokeh")

from bokeh.events import RangesUpdate, Reset, Tap
from tests.explorer.without_browser import OWN, P, T, Tab, V, X, amplitude, in_this_process, opened

from nonsmooth.explorer.catalogue import Catalogue


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    in_this_process(monkeypatch)


def test_the_motion_is_told_and_drawn() -> None:
    tab = opened("&lower=spectrum")
    told = dict(tab.heard("readout"))
    ends = told.pop("x").replace("\N{MINUS SIGN}", "-").split(" … ")
    assert [float(end.split()[0]) * 1e-3 for end in ends] == pytest.approx([-X, X], rel=1e-3)
    decay = np.exp(-P["c"] * T / (2 * P["m"]))
    assert told == {
        "motion": "period 1",
        "section points": "1",
        "contacts per period": "0",
        "largest |multiplier|": f"{decay:.4f}",
    }
    views = tab.page.sheet.views
    (xs,), (ys,) = (np.asarray(views["portrait"].curves.data[key]) for key in ("xs", "ys"))
    assert (xs / X) ** 2 + (ys / V) ** 2 == pytest.approx(np.ones(len(xs)), abs=1e-5)
    left, right, bottom, top = tab.ends("portrait")  # with a little room about it
    for low, high, size in ((left, right, X), (bottom, top, V)):
        assert -1.2 * size < low < -size and size < high < 1.2 * size
    assert views["history"].curves.data["xs"][0][[0, -1]] == pytest.approx([200 * T, 202 * T])
    assert tab.ends("history")[:2] == pytest.approx([200 * T, 202 * T])
    lines = tab.data("lines")
    assert (lines["x"].tolist(), lines["y"].tolist()) == ([1.0], pytest.approx([X], rel=1e-6))
    assert tab.heard("busy") == {"view": ""} and tab.heard("notes") == {}


def test_a_section_point_moves_with_the_phase_and_a_click_starts_there() -> None:
    tab = opened()
    at = {}
    for phase in (0.0, 0.25, 0.5):
        tab.act("set", "phase", phase)
        points = tab.data("section points")
        at[phase] = complex(points["x"][0] / X, -points["y"][0] / V)
        assert tab.page.sheet.views["portrait"].points.data["x"].tolist() == points["x"].tolist()
    assert [at[0.25] / at[0.0], at[0.5] / at[0.0]] == pytest.approx([1j, -1.0], abs=1e-5)
    for view, start in (("portrait", (0.003, 0.02)), ("section", (0.001, -0.01))):
        tab.event(Tap, view, x=start[0], y=start[1])
        assert tab.page.state.start == start
    tab.act("undo")
    assert tab.page.state.start == (0.003, 0.02)


def test_the_response_is_the_linear_resonance_curve() -> None:
    tab = opened("&upper=response&response.low=3&response.high=5&shown=x")
    omega = np.linspace(3, 5, 9)
    for word in ("up", "down"):
        drawn = tab.data(f"response {word}")
        assert drawn["x"] == pytest.approx(omega) and drawn["y"] == pytest.approx(amplitude(omega), rel=1e-5)
        assert [words.split(",")[0] for words in drawn["words"]] == [word] * 9
        assert all(words.endswith(", period 1") for words in drawn["words"])
    left, right, bottom, top = tab.ends("response")
    assert (left, right, bottom) == (3.0, 5.0, 0.0) and 1.0 < top / amplitude(omega).max() < 1.2
    tab.event(Tap, "response", x=4.3, y=0.0)
    assert tab.page.state.values["omega"] == pytest.approx(4.25)
    x, v = tab.page.state.start  # that of the motion there
    assert np.hypot(x, v / 4.25) == pytest.approx(amplitude(4.25), rel=1e-5)
    tab.event(RangesUpdate, "response", x0=3.5, x1=4.5, y0=0.0, y1=1.0)
    assert tab.data("response up")["x"] == pytest.approx(np.linspace(3.5, 4.5, 9))
    tab.event(Reset, "response")
    assert not tab.page.state.settings
    assert tab.data("response up")["x"][[0, -1]] == pytest.approx([0.5 * P["omega"], 1.5 * P["omega"]])


def test_a_jump_and_the_orbits_of_two_clicks_on_its_branches() -> None:
    """The orbit that is shown is that of the curve that was clicked: figure 9 of the paper, one way and the other."""
    values = "p.g=0.02&p.rho=0.14&p.omega=4.8&response.low=3&response.high=7"
    tab = Tab(f"model=discontinuous_support&columns=10&transient=300&keep=16&upper=response&shown=x&{values}")
    up, down = (tab.data(f"response {word}") for word in ("up", "down"))
    (at,) = np.flatnonzero(np.abs(up["y"] - down["y"]) > 1e-4)
    for one in (up, down):
        tab.event(Tap, "response", x=one["x"][at], y=one["y"][at])
        ends = dict(tab.heard("readout"))["x"].split(" \u2026 ")
        low, high = (float(end.split()[0].replace("\u2212", "-")) for end in ends)
        assert (high - low) / 2000 == pytest.approx(one["y"][at], rel=2e-3)


def test_two_pages_have_each_their_own_motion() -> None:
    first, second = opened(), opened("&p.rho=0.3")
    for tab, rho in ((first, P["rho"]), (second, 0.3)):
        ends = np.ptp(tab.page.sheet.views["portrait"].curves.data["xs"][0]) / 2
        assert ends == pytest.approx(amplitude(P["omega"], rho), rel=1e-4)
    first.act("set", "p.rho", 0.4)
    assert second.page.state.values["rho"] == 0.3


def test_a_chart_gets_finer_and_is_clicked_and_zoomed() -> None:
    tab = opened("&upper=chart&over=rho&low=0.2&high=0.5&chart.across=omega&chart.low=3&chart.high=5")
    cells = tab.data("chart cells")
    assert (cells["stage"], cells["image"][0].shape) == (["fine chart"], (7, 8))
    assert (cells["image"][0] == 0).all()  # the one class of the legend
    dx, dy = 0.3 / 7, 2.0 / 6
    assert [cells[key][0] for key in ("x", "dw", "y", "dh")] == pytest.approx(
        [0.2 - dx / 2, 8 * dx, 3 - dy / 2, 7 * dy]
    )
    assert cells["more"][0] == pytest.approx(np.full((7, 8), -P["c"] / (2 * P["m"])), rel=0.02)  # the exponent
    assert tab.ends("chart") == [0.2, 0.5, 3.0, 5.0]
    here = tab.data("chart here")
    assert (here["x"], here["y"]) == ([P["rho"]], [P["omega"]])
    assert [words for words, *_ in tab.heard("ui")["legends"]["chart"]] == ["1"]
    tab.event(Tap, "chart", x=0.2 + 2.2 * dx, y=3 + 3.9 * dy)
    values = tab.page.state.values
    assert [values["rho"], values["omega"]] == pytest.approx([0.2 + 2 * dx, 3 + 4 * dy])
    tab.event(RangesUpdate, "chart", x0=0.3, x1=0.4, y0=3.5, y1=4.0)
    state = tab.page.state
    assert (state.low, state.high, state.settings["chart.low"], state.settings["chart.high"]) == (0.3, 0.4, 3.5, 4.0)
    assert tab.ends("chart") == [0.3, 0.4, 3.5, 4.0]


def test_basins_fill_the_figure_and_are_clicked_and_zoomed() -> None:
    tab = opened("&plane=basins&basins.left=-0.02&basins.right=0.02&basins.bottom=-0.1&basins.top=0.3")
    cells = tab.data("basins cells")
    assert (cells["stage"], cells["image"][0].shape) == (["fine basins"], (8, 8))
    assert (cells["image"][0] == 2).all()  # the one attractor, behind "diverged" and "none reached"
    dx, dy = 0.04 / 7, 0.4 / 7
    assert tab.ends("basins") == pytest.approx([-0.02 - dx / 2, 0.02 + dx / 2, -0.1 - dy / 2, 0.3 + dy / 2])
    points = tab.data("basins points")
    assert np.hypot(points["x"] / X, points["y"] / V) == pytest.approx([1.0], rel=1e-4)
    assert tab.heard("ui")["legends"]["basins"][0][0].endswith(": 100 %")
    tab.event(Tap, "basins", x=0.01, y=0.2)
    assert tab.page.state.start == (0.01, 0.2)
    assert tab.data("basins here") == {"x": [0.01], "y": [0.2]}
    tab.event(RangesUpdate, "basins", x0=-0.01, x1=0.01, y0=0.0, y1=0.1)
    assert [tab.page.state.settings[f"basins.{end}"] for end in ("left", "right", "bottom", "top")] == [
        -0.01,
        0.01,
        0,
        0.1,
    ]
    tab.event(Reset, "basins")
    assert not tab.page.state.settings


def test_a_click_in_a_basin_starts_there_and_reaches_its_attractor() -> None:
    tab = Tab("model=discontinuous_support&columns=10&transient=200&keep=16&p.rho=0.323&plane=basins")
    legend = tab.heard("ui")["legends"]["basins"]
    assert [words.split(":")[0] for words, _ in legend] == ["period 2 (a)", "period 2 (b)"]
    cells, marks = tab.data("basins cells"), tab.data("basins points")
    assert np.isfinite(cells["more"][0]).all()  # of a number that is not there a tip would say NaN
    kinds = list(dict.fromkeys(marks["marker"]))
    assert len(kinds) == 2
    (image,), dx, dy = cells["image"], cells["dw"][0] / 8, cells["dh"][0] / 8
    for label, kind in ((2, kinds[0]), (3, kinds[1])):
        row, column = np.argwhere(image == label)[0]
        tab.event(Tap, "basins", x=cells["x"][0] + (column + 0.5) * dx, y=cells["y"][0] + (row + 0.5) * dy)
        known = marks["x"][np.array(marks["marker"]) == kind]
        assert sorted(tab.data("section points")["x"]) == pytest.approx(sorted(known), rel=1e-3)


def test_an_address_may_name_its_model_behind_other_things() -> None:
    catalogue = Catalogue.of(OWN)
    pairs = [("columns", "77"), ("model", "impact_oscillator"), ("keep", "33")]
    state = catalogue.state_of(pairs)
    assert (state.model, state.columns, state.keep) == ("impact_oscillator", 77, 33)
    assert catalogue.state_of(pairs[:1]).model == "given"
    assert Catalogue.of(None).state_of(pairs[:1]).model == "discontinuous_support"


def test_what_no_view_needs_is_not_computed_again() -> None:
    tab = opened()
    worker: Any = tab.page.work.worker
    first = list(worker.did)
    assert len(set(first)) == len(first) and {"orbit", "first look", "diagram", "section", "stability"} <= set(first)
    tab.act("begin")
    tab.act("set", "shown", "x")  # other axes of what is there
    assert worker.did == first
    tab.act("set", "p.rho", 0.4)
    assert "orbit" in worker.did[len(first) :] and "diagram" not in worker.did[len(first) :]
    assert np.ptp(tab.page.sheet.views["portrait"].curves.data["xs"][0]) == pytest.approx(
        2 * amplitude(P["omega"], 0.4), rel=1e-4
    )
