"""Diagram and branches of a page, without a browser, of a motion that is known: x + i v = rho times one number."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("bokeh", reason="the explorer needs bokeh")

from bokeh.events import RangesUpdate, Tap
from tests.explorer.without_browser import P, Tab, in_this_process, opened

from nonsmooth.plot.style import COLORS

VALUES = np.linspace(0.2, 0.5, 10)


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    in_this_process(monkeypatch)


def section(omega: float = P["omega"]) -> complex:
    """x + i v of the motion over rho, at phase 0 of the force rho cos(omega t)."""
    H = 1 / (2 * P["k"] - P["m"] * omega**2 + 1j * P["c"] * omega)
    return complex(H.real, (1j * omega * H).real)


def rows_of(tab: Tab) -> list[list[int]]:
    """Rows of the image that are not empty, by column."""
    (image,) = tab.data("diagram image")["image"]
    return [np.flatnonzero(column >> 24).tolist() for column in image.T]


@pytest.mark.parametrize("shown", ["x", "v"])
def test_the_diagram_is_a_line_through_the_section_points(shown: str) -> None:
    tab = opened(f"&over=rho&low=0.2&high=0.5&direction=both&shown={shown}")
    slope = section().real if shown == "x" else section().imag
    image = tab.data("diagram image")
    assert (image["stage"], image["x"][0], image["dw"][0]) == (
        ["judged"],
        pytest.approx(0.2 - 1 / 60),
        pytest.approx(1 / 3),
    )
    left, right, low, high = tab.ends("diagram")
    assert (left, right) == (0.2, 0.5) and (image["y"], image["dh"]) == ([low], [pytest.approx(high - low)])
    assert low < min(slope * VALUES) and max(slope * VALUES) < high < low + 1.3 * abs(slope) * 0.3
    for value, rows in zip(VALUES, rows_of(tab), strict=True):
        assert 1 <= len(rows) <= 4 and abs(np.mean(rows) - (slope * value - low) / (high - low) * 400) < 3
    columns = tab.data("columns")
    assert columns["value"] == pytest.approx(VALUES)
    assert columns["words"] == [f"{value:.4g} N: period 1" for value in columns["value"]]
    assert (columns["period"].tolist(), columns["status"]) == ([1] * 10, ["ok"] * 10)
    assert [words for words, *_ in tab.heard("ui")["legends"]["diagram"]] == ["up", "down"]
    tab.event(Tap, "diagram", x=0.41, y=0.0)
    state = tab.page.state
    assert state.values["rho"] == pytest.approx(0.4)
    assert complex(*state.start) == pytest.approx(0.4 * section(), rel=1e-5)
    tab.event(RangesUpdate, "diagram", x0=0.3, x1=0.4, y0=low, y1=high)
    assert (tab.page.state.low, tab.page.state.high) == (0.3, 0.4)
    assert tab.data("columns")["value"] == pytest.approx(np.linspace(0.3, 0.4, 10))


def test_a_preview_of_what_was_undone_does_not_stay() -> None:
    """The diagram of before was there, and has been drawn over by the preview of other values."""
    tab = opened("&over=rho&low=0.2&high=0.5")
    before = tab.data("diagram image")
    tab.act("set", "columns", 12, behind="first look")
    assert tab.data("diagram image")["stage"] == ["first look"]
    (number, asked), *_ = tab.page.work.worker.asked
    assert asked["view"] == "diagram"
    tab.act("undo")  # which cancels it
    tab.page.work.take(("cancelled", number, None))
    tab.finish()
    after = tab.data("diagram image")
    assert (after["stage"], after["of"]) == (["judged"], before["of"])
    np.testing.assert_array_equal(after["image"][0], before["image"][0])
    assert [words for words, *_ in tab.heard("ui")["legends"]["diagram"]] == ["up", "down"]


def test_one_direction_has_one_cloud() -> None:
    tab = opened("&over=rho&low=0.2&high=0.5&direction=up&shown=x")
    for direction, color in (("up", COLORS["first"]), ("down", COLORS["second"])):
        tab.act("set", "direction", direction)
        (image,) = tab.data("diagram image")["image"]
        (shade,) = {int(pixel) & 0xFFFFFF for pixel in image[image > 0]}
        red, green, blue = (int(color[i : i + 2], 16) for i in (1, 3, 5))
        assert shade == blue << 16 | green << 8 | red
        assert [color for _, color in tab.heard("ui")["legends"]["diagram"]] == [color]


def test_branches_lie_over_the_diagram() -> None:
    tab = opened("&over=rho&low=0.2&high=0.5&shown=x&branches.show=yes")
    stable, unstable = tab.data("stable branches"), tab.data("unstable branches")
    there = np.isfinite(stable["x"])
    assert stable["y"][there] == pytest.approx(section().real * stable["x"][there], rel=1e-6)
    assert (stable["x"][there].min(), stable["x"][there].max()) == (0.2, 0.5)
    assert not np.isfinite(np.asarray(unstable["x"], float)).any()
    assert not len(tab.data("special points")["x"])
    view: Any = tab.page.sheet.views["branches"]
    words = view._points.data["words"]
    assert all("stable, period 1, multipliers" in one and not one.startswith("un") for one in words)
    assert len(words) == there.sum()
    assert [words for words, *_ in tab.heard("ui")["legends"]["diagram"]][-1] == "stable"
    assert all(renderer.visible for renderer in view._drawn)
    tab.act("set", "shown", "v")
    assert (
        np.nanmax(np.abs(tab.data("stable branches")["y"] - section().imag * tab.data("stable branches")["x"])) < 1e-6
    )
    tab.act("set", "branches.show", "no")
    assert not any(renderer.visible for renderer in view._drawn)
