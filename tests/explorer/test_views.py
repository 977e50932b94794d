"""Views that are chosen as tabs or laid over others, in a real browser.

With ``NONSMOOTH_PICTURES=docs/pictures`` the tests also take the screenshots of the guide.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

TIPS = """(() => { const found = [], walk = node => { for (const one of node.querySelectorAll("*")) {
    if (one.classList.contains("bk-Tooltip")) found.push((one.shadowRoot || one).textContent);
    if (one.shadowRoot) walk(one.shadowRoot); } }; walk(document); return found.join(" | "); })()"""


def data(page: Any, name: str) -> dict[str, np.ndarray]:
    """Columns of a source of the page."""
    found = page.tab.evaluate(
        f'Object.entries(Bokeh.documents[0].get_model_by_name("{name}").data).map(([k, v]) => [k, Array.from(v)])'
    )
    return {key: np.array([np.nan if v is None else v for v in values]) for key, values in found}


def until_tip(page: Any, words: str) -> str:
    """The text of the tooltip, once it holds some words."""
    page.until(f"{TIPS}.includes({json.dumps(words)})", 20)
    return str(page.tab.evaluate(TIPS))


def test_branches_lie_over_the_diagram_and_special_points_say_what_they_are(page: Any) -> None:
    page.tab.select_option('[id="branches.show"]', "yes")
    page.until_done()
    special = data(page, "special points")
    flips = [k for k, words in enumerate(special["words"]) if words.startswith("flip") and "period 1," in words]
    (first,) = flips
    value = special["x"][first]
    for step, stable in ((-5e-4, False), (5e-4, True)):  # the multiplier passes through -1 there
        orbit = ns.find_orbit(ns.models.discontinuous_support(rho=value + step), period_number=1, progress=False)
        assert orbit.stable is stable
        assert np.isclose(np.sort(orbit.floquet_multipliers.real)[0], -1.0, atol=0.01)
    unstable, stable = data(page, "unstable branches"), data(page, "stable branches")
    assert np.nanmin(unstable["x"]) == 0.2  # the orbit of period 1 is followed beyond its flip
    assert np.nanmax(stable["x"]) == 0.5
    page.tab.mouse.move(*page.place("diagram", value, special["y"][first]))
    assert "multipliers" in until_tip(page, "flip (period doubling) at 0.401")
    page.picture("branches")
    page.tab.select_option("#shown", "x")
    page.until_done()
    assert abs(np.nanmean(data(page, "stable branches")["y"])) < 0.02  # m, where it was m/s
    page.tab.select_option("#over", "omega")
    page.until("Bokeh.documents[0].get_model_by_name('special points').data.x.length === 0")
    page.until_done()
    assert page.notes() == ""


def test_branches_that_nobody_waits_for_are_cancelled_and_the_worker_stays(page: Any, server: Any) -> None:
    page.until_done()
    workers = server.workers()
    page.write("transient", "20000")
    page.tab.select_option('[id="branches.show"]', "yes")
    page.until('document.documentElement.dataset.busy === "branches"')
    page.write("transient", "100")
    page.until_done()
    assert len(data(page, "special points")["x"]) > 0
    assert server.workers() == workers
    assert page.notes() == ""


def test_the_spectrum_of_a_motion_without_contact_is_one_line_of_the_linear_amplitude(page: Any) -> None:
    page.write("v-p.g", "1")
    page.tab.click("#tab-spectrum")
    page.until_done()
    p = {one["name"]: one["value"] for one in page.ui()["parameters"]}
    known = p["rho"] / p["m"] / np.hypot(2 * p["k"] / p["m"] - p["omega"] ** 2, p["c"] * p["omega"] / p["m"])
    lines = data(page, "lines")
    assert list(lines["x"]) == [1.0]
    assert lines["y"][0] == pytest.approx(known, rel=1e-6)


def test_a_period_4_motion_has_lines_at_quarters(page: Any) -> None:
    page.write("v-p.rho", "0.26")
    page.tab.focus("#tab-history")
    page.tab.keyboard.press("ArrowRight")  # tabs are reached by keys
    page.until('location.search.includes("lower=spectrum")')
    page.until_done()
    lines = data(page, "lines")
    np.testing.assert_allclose(4 * lines["x"], np.round(4 * lines["x"]), atol=1e-9)
    assert {0.25, 0.5, 0.75, 1.0} <= set(np.round(lines["x"], 9))
    page.tab.mouse.move(*page.place("spectrum", 1.0, float(lines["y"].max()) / 30))
    until_tip(page, "1 · ")
    page.picture("spectrum")
