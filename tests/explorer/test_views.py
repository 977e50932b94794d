"""Views that are chosen as tabs or laid over others, in a real browser.

With ``NONSMOOTH_PICTURES=docs/pictures`` the tests also take the screenshots of the guide.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from tests.explorer.conftest import wait_until

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


def click(page: Any, figure: str, x: float, y: float) -> None:
    """Click at a point of a figure, and wait until all is shown that changes by it."""
    before = page.tab.evaluate("location.search")
    page.tab.mouse.click(*page.place(figure, x, y))
    page.until(f"location.search !== {json.dumps(before)}")
    page.until_done()


def tip(page: Any, figure: str, x: float, y: float, words: str) -> str:
    """The tooltip at a point of a figure, once it holds some words: a picture that is drawn anew takes its tip away."""
    found = [""]

    def seen() -> bool:
        found[0] = str(page.tab.evaluate(TIPS))
        if words not in found[0]:
            page.tab.mouse.move(0, 0)
            page.tab.mouse.move(*page.place(figure, x, y))
        return words in found[0]

    wait_until(seen)
    return found[0]


@pytest.mark.parametrize(("low", "high"), [(0.38, 0.42), pytest.param(0.2, 0.5, marks=pytest.mark.slow)])
def test_branches_lie_over_the_diagram_and_special_points_say_what_they_are(page: Any, low: float, high: float) -> None:
    page.write("low", str(low))
    page.write("high", str(high))
    page.tab.select_option('[id="branches.show"]', "yes")
    page.until('document.getElementById("legend-diagram").textContent.includes("flip")')
    page.until_done()
    assert page.notes() == ""
    special = data(page, "special points")
    flips = [k for k, words in enumerate(special["words"]) if words.startswith("flip") and "period 1," in words]
    (first,) = flips
    assert special["marker"][first] == "square"
    value = special["x"][first]
    for step, stable in ((-5e-4, False), (5e-4, True)):  # the multiplier passes through -1 there
        orbit = ns.find_orbit(ns.models.discontinuous_support(rho=value + step), period_number=1, progress=False)
        assert orbit.stable is stable
        assert np.isclose(np.sort(orbit.floquet_multipliers.real)[0], -1.0, atol=0.01)
    branches = data(page, "unstable branches"), data(page, "stable branches")
    assert np.nanmin(branches[0]["x"]) == low  # the orbit of period 1 is followed beyond its flip
    assert np.nanmax(branches[1]["x"]) == high
    assert "multipliers" in tip(page, "diagram", value, special["y"][first], "flip (period doubling) at 0.401")
    legends_say_what_is_drawn(page)
    page.picture("branches")
    page.tab.select_option("#shown", "x")
    page.until_done()
    assert abs(np.nanmean(data(page, "stable branches")["y"])) < 0.02  # m, where it was m/s
    page.tab.select_option('[id="branches.show"]', "no")
    page.until('!document.getElementById("legend-diagram").textContent.includes("flip")')
    page.tab.select_option('[id="branches.show"]', "yes")
    page.tab.select_option("#over", "omega")
    page.until("Bokeh.documents[0].get_model_by_name('special points').data.x.length === 0")


def legends_say_what_is_drawn(page: Any) -> None:
    """One colour says up in every view, and kinds of branches are told."""
    legends = page.ui()["legends"]
    up = {words: color for words, color, *_ in legends["diagram"]}["up"]
    assert up == dict(legends["response"])["up"]
    drawn = page.tab.evaluate(
        """(color => {
        const source = Bokeh.documents[0].get_model_by_name("diagram image");
        const seen = new Uint8Array(source.data.image[0].buffer);
        const [red, green, blue] = [1, 3, 5].map(i => parseInt(color.slice(i, i + 2), 16));
        for (let i = 0; i < seen.length; i += 4)
            if (seen[i + 3] && seen[i] === red && seen[i + 1] === green && seen[i + 2] === blue) return true;
        return false;
    })""",
        up,
    )
    assert drawn
    told = page.tab.inner_text("#legend-diagram").replace("\n", "")
    assert "\u2501stable" in told
    assert "\u254dunstable" in told
    assert "\u25a1flip" in told


@pytest.mark.slow
def test_branches_that_nobody_waits_for_are_cancelled_and_the_worker_stays(page: Any, server: Any) -> None:
    page.until_done()
    workers = server.workers()
    page.write("transient", "20000")
    page.tab.select_option('[id="branches.show"]', "yes")
    page.until('document.documentElement.dataset.busy === "branches"')
    page.write("transient", "100")
    page.until_done()
    assert page.notes() == ""
    assert len(data(page, "special points")["x"]) > 0
    assert server.workers() and set(server.workers()) <= set(workers)  # that of an earlier page may have ended


def test_a_period_4_motion_has_lines_at_quarters(page: Any) -> None:
    page.write("v-p.rho", "0.26")
    page.tab.focus("#tab-history")
    page.tab.keyboard.press("ArrowRight")  # tabs are reached by keys
    page.until('location.search.includes("lower=spectrum")')
    page.until_done()
    lines = data(page, "lines")
    np.testing.assert_allclose(4 * lines["x"], np.round(4 * lines["x"]), atol=1e-9)
    assert {0.25, 0.5, 0.75, 1.0} <= set(np.round(lines["x"], 9))
    assert tip(page, "spectrum", 1.0, float(lines["y"].max()) / 30, "1 · ")
    page.picture("spectrum")


@pytest.mark.slow
def test_a_jump_of_figure_9_and_the_orbits_of_two_quick_clicks_on_its_branches(page: Any) -> None:
    page.tab.select_option("#preset", "Fig. 9")
    page.tab.click("#tab-response")
    page.until_done()
    up, down = data(page, "response up"), data(page, "response down")
    apart = np.flatnonzero(np.abs(up["y"] - down["y"]) > 1e-4)
    assert len(apart)
    at = apart[len(apart) // 2]
    for one in (up, down):  # the orbit shown is that of the curve that was clicked
        click(page, "response", one["x"][at], one["y"][at])
        low, high = (float(end.split()[0].replace("\u2212", "-")) for end in page.readout()["x"].split(" … "))
        assert (high - low) / 2000 == pytest.approx(one["y"][at], rel=2e-3)
    page.picture("response")


@pytest.mark.parametrize("finest", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_chart_gets_finer_and_a_click_shows_the_orbit_of_that_cell(page: Any, finest: bool) -> None:
    stage = 'Bokeh.documents[0].get_model_by_name("chart cells").data.stage[0]'
    page.tab.click("#tab-chart")
    page.until(f'{stage} === "first chart"')
    if finest:
        page.until(f'{stage} === "chart"')
        page.until('document.documentElement.dataset.busy === "fine chart"')
    period = 3 if finest else 2
    place = page.tab.evaluate(
        """([period, around]) => {
        const data = Bokeh.documents[0].get_model_by_name("chart cells").data, image = data.image[0];
        const [rows, columns] = image.shape, at = (i, j) => image[i * columns + j];
        for (let i = 2; i < rows - 2; i++) for (let j = 2; j < columns - 2; j++)  // amid cells of one period number
            if (around.every(k => at(i + k, j) === period - 1 && at(i, j + k) === period - 1))
                return [data.x[0] + (j + 0.5) * data.dw[0] / columns, data.y[0] + (i + 0.5) * data.dh[0] / rows];
    }""",
        [period, [-2, -1, 0, 1, 2] if finest else [-1, 0, 1]],
    )
    words = tip(page, "chart", *place, f": period {period}")
    assert not finest or "exponent near \u2212" in words
    page.tab.mouse.click(*page.place("chart", *place))
    page.until(f'JSON.parse(Bokeh.documents[0].get_model_by_name("readout").value)[0][1] === "period {period}"')
    page.picture("chart")
    low, high = (page.ui()["state"][end] for end in ("low", "high"))
    page.tab.mouse.wheel(0, -240)
    page.until('JSON.parse(Bokeh.documents[0].get_model_by_name("ui").value).query.includes("chart.low")')
    state = page.ui()["state"]
    assert high - low > state["high"] - state["low"]
    cells = 'Bokeh.documents[0].get_model_by_name("chart cells").data'
    page.until(f"Math.abs({cells}.dw[0] - {(state['high'] - state['low']) * 40 / 39}) < 1e-9")
    if finest:
        page.tab.click("#tab-diagram")
        page.until_done()
        assert page.notes() == ""


@pytest.mark.slow
def test_a_click_in_a_basin_starts_there_and_reaches_its_attractor(page: Any) -> None:
    page.write("v-p.rho", "0.323")
    page.tab.click("#tab-basins")
    page.until('Bokeh.documents[0].get_model_by_name("basins cells").data.stage[0] === "basins"')
    legend = page.ui()["legends"]["basins"]
    assert [words.split(":")[0] for words, _ in legend] == ["period 2 (a)", "period 2 (b)"]
    marks = data(page, "basins points")
    kinds = list(dict.fromkeys(marks["marker"]))
    assert len(kinds) == 2
    for label, kind in ((2, kinds[0]), (3, kinds[1])):
        place = page.tab.evaluate(
            """label => {
                const data = Bokeh.documents[0].get_model_by_name("basins cells").data, image = data.image[0];
                const [n, m] = image.shape, at = (i, j) => image[i * m + j];
                for (let i = 2; i < n - 2; i++) for (let j = 2; j < m - 2; j++)
                    if ([-2, -1, 0, 1, 2].every(k => at(i + k, j) === label && at(i, j + k) === label))
                        return [data.x[0] + (j + 0.5) * data.dw[0] / m, data.y[0] + (i + 0.5) * data.dh[0] / n];
            }""",
            label,
        )
        page.tab.mouse.click(*page.place("basins", *place))
        known = sorted(marks["x"][marks["marker"] == kind])

        def reached(known: list[float] = known) -> bool:  # while the basins still get finer
            x = sorted(data(page, "section points")["x"])
            return len(x) == len(known) and np.allclose(x, known, rtol=1e-3, atol=0.0)

        wait_until(reached)
    assert "NaN" not in tip(page, "basins", *place, "period 2 (b)")
    page.picture("basins")
