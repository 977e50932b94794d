"""The page in a real browser, as a person uses it."""

from __future__ import annotations

import os
import re
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.explorer.test_access import ask

import nonsmooth as ns


def test_figure_11_a_dragged_slider_and_a_click_on_a_column_of_period_4(page: Any) -> None:
    page.tab.select_option("#preset", "Fig. 11")
    page.write("columns", "121")
    page.until_done()
    assert page.ui()["state"]["over"] == "rho"
    handle = page.tab.locator('[id="s-p.rho"]').bounding_box()
    middle = handle["y"] + handle["height"] / 2
    page.tab.mouse.move(handle["x"] + 0.33 * handle["width"], middle)
    page.tab.mouse.down()
    for part in np.linspace(0.33, 0.25, 9):
        page.tab.mouse.move(handle["x"] + part * handle["width"], middle)
    page.tab.mouse.up()
    page.until_done()
    dragged = page.value("rho")
    assert 0.25 < dragged < 0.42
    assert page.readout()["motion"] == "period 2"
    columns = page.tab.evaluate("""(() => {
        const source = Bokeh.documents[0].get_model_by_name("columns");
        return [...source.data.value].filter((value, i) => source.data.period[i] === 4);
    })()""")
    value = columns[len(columns) // 2]
    page.tab.mouse.click(*page.place("diagram", value, 0.02))
    ui = 'JSON.parse(Bokeh.documents[0].get_model_by_name("ui").value)'
    page.until(f'Math.abs({ui}.state["p.rho"] - {value}) < 1e-3')
    page.until_done()
    told = page.readout()
    print(f"period-4 column at rho = {value:.4f} N: {told}")
    assert (told["motion"], told["section points"]) == ("period 4", "4")
    points = page.tab.evaluate('Array.from(Bokeh.documents[0].get_model_by_name("section points").data.x)')
    system = ns.models.discontinuous_support(rho=page.value("rho"))
    known = ns.poincare(system, n=4, transient=1000)["section"].values[:, 0]
    np.testing.assert_allclose(sorted(points), sorted(known), rtol=1e-6)


@pytest.mark.parametrize("direction", ["both", pytest.param("rest", marks=pytest.mark.slow)])
def test_a_moved_slider_redraws_the_diagram_live(page: Any, direction: str) -> None:
    page.write("columns", "300")
    page.tab.evaluate("""() => {
        const source = Bokeh.documents[0].get_model_by_name("diagram image");
        window.drawn = [];
        const note = () => window.drawn.push(
            [source.data.of[0], source.data.stage[0], source.data.image[0].shape]);
        source.properties.data.change.connect(() => requestAnimationFrame(() => setTimeout(note)));
    }""")
    page.tab.select_option("#direction", direction)
    page.until_done()
    page.tab.evaluate("""() => {
        const slider = document.getElementById("s-p.g");
        slider.value = -0.0047;
        slider.dispatchEvent(new Event("input"));
        window.sent = Number(slider.value);
    }""")
    own = page.until(
        "(() => { const own = window.drawn.filter(one => JSON.parse(one[0]).values.g === window.sent);"
        " return own.some(one => one[1] === 'judged') && own; })()"
    ).json_value()
    assert [stage for _, stage, _ in own][:: len(own) - 1] == ["first look", "judged"]
    assert all(shape[1] == 300 for _, _, shape in own)


@pytest.mark.parametrize("at_work", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_undo_redo_and_the_address_carry_the_state_into_a_tab_that_does_not_disturb(
    page: Any, server: Any, at_work: bool
) -> None:
    page.write("v-p.k_s", "800")
    page.until('location.search.includes("p.k_s=800")')
    page.tab.locator("h1").click()
    page.tab.keyboard.press("Control+z")
    page.until('location.search.includes("p.k_s=1210")')
    page.tab.keyboard.press("Control+Shift+z")
    page.until('location.search.includes("p.k_s=800")')
    shared = page.tab.evaluate("location.href")
    assert server.token not in shared
    assert ask(server, shared.removeprefix(server.origin))[0] == 403  # a colleague
    other = page.beside()
    other.open(shared)  # the cookie lets it in again
    assert other.value("k_s") == 800
    assert not other.tab.is_visible("#tour")
    other.write("v-p.k_s", "1000")
    other.until('location.search.includes("p.k_s=1000")')
    assert page.value("k_s") == 800
    if at_work:
        for one, rho in ((page, "0.26"), (other, "0.45")):
            one.write("v-p.k_s", "1210")
            one.write("v-p.rho", rho)
        page.until_done()
        other.until_done()
        assert (page.readout()["motion"], other.readout()["motion"]) == ("period 4", "period 1")
    for one in (page, other):
        assert re.fullmatch(r"\d+ tabs", one.tab.inner_text("#tabs"))
    other.tab.close()
    assert other.faults == []
    page.until("document.getElementById('tabs').hidden")


def test_text_that_is_no_number_is_refused_and_a_worker_that_dies_is_replaced(page: Any, server: Any) -> None:
    """The text beside its field; neither changes anything."""
    page.write("v-p.rho", "__import__('os').abort()")
    page.until('document.getElementById("wrong-p.rho").textContent.includes("is no number")')
    page.until_done()
    assert page.value("rho") == 0.45
    page.write("v-p.rho", "0.3")
    page.until_done()
    assert not page.tab.inner_text('[id="wrong-p.rho"]')
    assert page.value("rho") == 0.3
    for pid in server.workers():
        os.kill(pid, signal.SIGKILL)
    page.until('document.getElementById("page-note").textContent.includes("Another one was started")')
    assert page.value("rho") == 0.3
    page.write("v-p.rho", "0.45")
    page.until('JSON.parse(Bokeh.documents[0].get_model_by_name("readout").value)[0][1] === "period 1"')


def test_a_motion_that_diverges_is_said_and_no_number_of_another_one_stays(page: Any) -> None:
    page.until_done()
    assert page.readout()["motion"] == "period 1"
    page.write("v-p.c", "-0.9")  # of a damper
    page.until('document.getElementById("portrait-note").textContent.includes("grew beyond")')
    page.until_done()
    assert page.tab.inner_text("#readout") == ""
    assert page.value("c") == -0.9
    page.write("v-p.c", "0.87")
    page.until_done()
    assert page.readout()["motion"] == "period 1"
    assert page.readout()["section points"] == "1"
    assert page.notes() == ""


def test_a_diagram_of_one_direction_stays_drawn_while_another_is_computed(page: Any) -> None:
    page.tab.select_option("#direction", "rest")
    page.until_done()
    page.tab.evaluate("""() => {
        for (const [id, value] of [["direction", "both"], ["shown", "x"]]) {
            document.getElementById(id).value = value;
            document.getElementById(id).dispatchEvent(new Event("change"));
        }
    }""")
    page.until('Bokeh.documents[0].get_model_by_name("diagram").title.text === "x (mm)"')
    page.until_done()
    assert [word for word, _ in page.ui()["legends"]["diagram"]] == ["up", "down"]


def test_a_view_is_saved_as_a_figure_and_as_the_script_that_makes_it(page: Any) -> None:
    page.until_done()
    page.tab.select_option("#save-view", "section")
    found = {}
    for kind in ("pdf", "py"):
        page.tab.select_option("#save-kind", kind)
        with page.tab.expect_download() as download:
            page.tab.click("#save")
        found[download.value.suggested_filename] = Path(download.value.path()).read_bytes()
    assert found["discontinuous_support_section.pdf"].startswith(b"%PDF")
    assert b"result = ns.poincare(system, section=ns.Stroboscopic()" in found["discontinuous_support_section.py"]


def test_another_axis_and_another_model_are_drawn_with_their_units(page: Any) -> None:
    def label(figure: str, axis: str) -> str:
        words = "title.text" if axis == "left" else f"{axis}[0].axis_label"
        return str(page.tab.evaluate(f'Bokeh.documents[0].get_model_by_name("{figure}").{words}'))

    page.until_done()
    assert [label("diagram", axis) for axis in ("below", "left")] == ["ρ (N)", "v (mm/s)"]
    page.tab.select_option("#shown", "x")
    page.tab.select_option("#y", "x")
    page.until_done()
    assert [label("diagram", "left"), label("portrait", "left")] == ["x (mm)", "x (mm)"]
    page.tab.select_option("#model", "border_collision")
    page.until_done()
    assert page.ui()["state"]["model"] == "border_collision"
    assert [label("diagram", axis) for axis in ("below", "left")] == ["μ", "x"]
    assert page.readout()["motion"] == "period 2"
    assert page.notes() == ""
    assert not page.tab.is_visible("#sketch")  # there is none of a map
    assert "border" in page.tab.inner_text("#equations")
