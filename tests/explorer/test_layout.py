"""The page as it is seen: large type, narrow windows, legends, the sketch, the equations."""

from __future__ import annotations

from typing import Any

import pytest

import nonsmooth as ns
from nonsmooth.explorer.sketch import equations_of

#: All is drawn anew for each; the first has the least room, and small type has more.
SIZES = [(400, True), (1280, True), (1280, False)]
LARGE = "document.documentElement.classList.contains('large')"
#: Notes what is written on every canvas since it was cleared: words, and the box that they take on it.
NOTE = """(() => {
    const of = CanvasRenderingContext2D.prototype, {fillText, clearRect} = of;
    window.written = new Map();
    of.clearRect = function (...given) { window.written.set(this.canvas, []); return clearRect.apply(this, given); };
    of.fillText = function (words, x, y, ...more) {
        const size = this.measureText(words), turn = this.getTransform();
        const at = (x, y) => [turn.a * x + turn.c * y + turn.e, turn.b * x + turn.d * y + turn.f];
        const [left, top] = at(x - size.actualBoundingBoxLeft, y - size.actualBoundingBoxAscent);
        const [right, bottom] = at(x + size.actualBoundingBoxRight, y + size.actualBoundingBoxDescent);
        if (!window.written.has(this.canvas)) window.written.set(this.canvas, []);
        window.written.get(this.canvas).push([words, left, top, right, bottom]);
        return fillText.call(this, words, x, y, ...more);
    };
})()"""


def box(page: Any, which: str) -> dict[str, float]:
    return dict(page.tab.locator(which).first.bounding_box())


def frame(page: Any, figure: str) -> list[float]:
    """Width and height of the frame of a figure."""
    return list(
        page.tab.evaluate(
            "name => (one => [one.inner_width, one.inner_height])(Bokeh.documents[0].get_model_by_name(name))", figure
        )
    )


@pytest.mark.parametrize("sizes", [SIZES[:1], pytest.param(SIZES, marks=pytest.mark.slow)], ids=["narrow", "all"])
def test_every_picture_and_every_word_has_room_and_numbers_stand_apart(
    page: Any, sizes: list[tuple[int, bool]]
) -> None:
    page.tab.evaluate(f"window.written || {NOTE}")
    page.tab.click("#tab-response")
    page.until_done()
    for width, large in sizes:
        page.tab.set_viewport_size({"width": width, "height": 800})
        if page.ui()["large"] != large:
            page.tab.click("#large")
        page.until_done()
        page.until(f"innerWidth === {width} && {LARGE} === {str(large).lower()}")
        page.tab.wait_for_timeout(300)
        check_room(page, width, large)
    if page.ui()["large"]:
        page.tab.click("#large")  # as it was, for who comes next
        page.until_done()


def check_room(page: Any, width: int, large: bool) -> None:
    assert page.tab.evaluate("document.documentElement.scrollWidth") <= width
    type_size = 19 if large else 13
    for figure in ("response", "portrait", "history", "section"):
        assert min(frame(page, figure)) > 8 * type_size, figure  # high enough to read a value from
    strip, readout = box(page, "#strip"), box(page, "#readout")
    assert readout["y"] >= strip["y"]
    assert readout["y"] + readout["height"] <= strip["y"] + strip["height"] + 1
    first = page.tab.locator("#readout span").first
    assert first.inner_text() == "motion period 1"
    shown = first.bounding_box()
    assert shown["y"] >= strip["y"]
    assert 0 <= shown["x"] and shown["x"] + shown["width"] <= width
    cut = page.tab.evaluate("""() => [...document.querySelectorAll("main select, main button, main label, aside input")]
        .filter(one => {
            const box = one.getBoundingClientRect();
            return box.width && (box.right > innerWidth || box.left < 0);
        }).map(one => one.id || one.textContent)""")
    assert cut == []
    for figure, words in (("response", "amplitude of v (mm/s)"), ("portrait", "v (mm/s)")):
        wide = page.tab.evaluate(
            """name => {
                const title = Bokeh.documents[0].get_model_by_name(name).title;
                const paint = document.createElement("canvas").getContext("2d");
                paint.font = `${title.text_font_size} ${title.text_font}`;
                return [title.text, paint.measureText(title.text).width];
            }""",
            figure,
        )
        assert wide[0] == words
        assert wide[1] <= frame(page, figure)[0] + 1
    written = page.tab.evaluate("""[...window.written]
        .filter(([canvas]) => canvas.id !== "sketch" && canvas.checkVisibility())
        .map(([, some]) => some.filter(([words]) => /^[\\d\\u2212.]+$/.test(words)))""")
    axes = [some for some in written if some]
    assert sum(map(len, axes)) >= 16  # of eight axes
    for some in axes:
        for k, (words, left, top, right, bottom) in enumerate(some):
            for other, a, b, c, d in some[:k]:
                assert right <= a or c <= left or bottom <= b or d <= top, (words, other, large, width)


def test_nothing_is_loaded_or_drawn_that_nobody_sees(page: Any) -> None:
    loaded = page.tab.evaluate("[...document.scripts].filter(one => one.src).map(one => new URL(one.src).pathname)")
    assert loaded == ["/static/js/bokeh.min.js", "/static/js/bokeh-widgets.min.js"]
    seen = "[...document.querySelectorAll('.view')].filter(one => one.checkVisibility()).map(one => one.dataset.view)"
    assert page.tab.evaluate(seen) == ["diagram", "portrait", "history", None]  # and the section
    page.tab.click("#tab-response")
    page.until_done()
    assert page.tab.evaluate(seen) == ["response", "portrait", "history", None]
    assert min(frame(page, "response")) > 100


def test_a_first_visit_is_shown_round_by_keys_alone_and_the_tour_covers_nothing(page: Any) -> None:
    """On a second visit nobody is shown round, and type is as large as it was."""
    free = """() => {
        const tour = document.getElementById("tour").getBoundingClientRect();
        return [...document.querySelectorAll("#bar *, aside, main, .panel")].every(one => {
            const box = one.getBoundingClientRect();
            return box.bottom <= tour.top + 1 || box.top >= tour.bottom - 1 || !box.width;
        });
    }"""
    page.tab.click("#large")
    page.until(LARGE)
    page.tab.evaluate("localStorage.removeItem('nonsmooth-tour')")
    page.tab.emulate_media(reduced_motion="no-preference")
    page.open(page.first[0])
    page.until(LARGE)
    for width, large in ((400, True), (1280, False)):
        page.tab.set_viewport_size({"width": width, "height": 800})
        seen = f"{LARGE} === {str(large).lower()}"
        page.tab.evaluate(f"{seen} || document.getElementById('large').click()")  # which keeps the focus
        page.until(f"innerWidth === {width} && {seen}", 5)
        for k, part in enumerate(("parameters", "upper", "plane"), 1):
            assert page.tab.evaluate(f'document.getElementById("{part}").classList.contains("toured")')
            assert page.tab.inner_text("#tour-title").startswith(f"{k} / 3")
            if part == "upper" and not large:
                page.picture("tour")
            page.until(f"({free})()", 5)
            place = box(page, "#tour")
            assert 0 <= place["x"] <= width - place["width"]
            assert 0 <= place["y"] <= 800 - place["height"]
            page.tab.keyboard.press("Enter")
        assert not page.tab.is_visible("#tour")
        page.tab.evaluate("document.getElementById('help').click()")  # begins again
    page.tab.keyboard.press("Escape")
    assert not page.tab.is_visible("#tour")
    assert page.tab.locator(".toured").count() == 0
    page.until('document.getElementById("sketch").dataset.at > 0')  # it moves for whom motion is not too much
    page.tab.emulate_media(reduced_motion="reduce")
    page.tab.click("#sketch")  # held, for who comes next


def test_equations_and_a_moving_sketch_stand_beside_the_sliders(page: Any) -> None:
    """The sketch rests at first, because this tab asks for reduced motion, and a click moves or holds it."""
    equations = page.tab.inner_text("#equations")
    assert "free" in equations
    assert "contact" in equations
    assert page.tab.locator("#equations math").count() > 5
    assert page.tab.evaluate("""(() => {
        const [first] = document.querySelectorAll("#equations math");
        return first.namespaceURI === "http://www.w3.org/1998/Math/MathML";
    })()""")
    mass = """(() => {
        const told = JSON.parse(Bokeh.documents[0].get_model_by_name("sketch").value);
        return told && told.frames.map(one => one.find(part => part[5] === "#DCE6EE")[1][0]);
    })()"""
    places = page.tab.evaluate(mass)
    assert len(places) == 36  # one period
    x = page.tab.evaluate("""(() => {
        const [{data_source: {data: {ys}}}] = Bokeh.documents[0].get_model_by_name("history").renderers;
        return ys.flatMap(one => [...one]).filter(y => y === y);
    })()""")
    # the mass lies as the motion says, to one scale: its first place is that of the section point
    first = page.tab.evaluate('Bokeh.documents[0].get_model_by_name("section points").data.x[0]')
    part = (places[0] - min(places)) / (max(places) - min(places))
    assert part == pytest.approx((first - min(x)) / (max(x) - min(x)), abs=0.02)
    seen = page.tab.evaluate('document.getElementById("sketch").dataset.at')
    page.tab.click("#sketch")
    page.until(f'document.getElementById("sketch").dataset.at !== "{seen}"')
    page.tab.click("#sketch")
    held = page.tab.evaluate('document.getElementById("sketch").dataset.at')
    page.tab.wait_for_timeout(300)
    assert page.tab.evaluate('document.getElementById("sketch").dataset.at') == held


def test_subscripts_stand_in_the_equations_as_beside_the_sliders() -> None:
    """A name with a subscript in one piece would be upright among letters in italics."""
    contact = dict(equations_of(ns.models.discontinuous_support()))["contact"]
    assert "<msub><mi>k</mi><mi>s</mi></msub>" in contact and "ₛ" not in contact
    assert "<mover><msub><mi>v</mi><mi>q</mi></msub><mo>˙</mo></mover>" in equations_of(ns.models.gear_pair())[0][1]


def test_an_element_stands_in_the_equations_in_its_own_words() -> None:
    heading, words = equations_of(ns.models.chua_circuit())[-1]
    assert heading == "diode"
    assert words.startswith("Backlash(displacement=x,")
