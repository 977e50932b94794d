"""The state of a page: what a URL holds, what is refused, what can be undone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.explorer.catalogue import first_state, presets_of, slider_range
from nonsmooth.explorer.figures import drawn
from nonsmooth.explorer.labels import axis_label, html_of, number, plain_of
from nonsmooth.explorer.state import CHOICES, History, PageState, changed, from_query, to_query

SYSTEM = ns.models.discontinuous_support()
STATES = list(SYSTEM.states)
FIRST = first_state("discontinuous_support", SYSTEM)


@pytest.mark.parametrize("direction", CHOICES["direction"])
def test_a_query_brings_every_field_back(direction: str) -> None:
    """Whatever its numbers: of any size, to their last bits."""
    bits = np.frombuffer(np.random.default_rng(1).bytes(8 * 40))
    numbers = [0.0, -0.0, 5e-324, 1.7976931348623157e308, 0.1, 1e22, *bits[np.isfinite(bits)].tolist()]
    for rho, low, *start in zip(numbers, numbers[1:], numbers[2:], numbers[3:], strict=False):
        state = replace(FIRST.with_value("rho", rho), low=low, start=tuple(start), direction=direction, columns=77)
        assert from_query(to_query(state), FIRST, STATES) == state


@pytest.mark.parametrize(
    ("query", "said"),
    [
        ("p.rho=__import__('os')", "is no number"),
        ("p.rho=nan", "is no number"),
        ("p.rho=1e999", "is no number"),
        *((f"p.rho={text}", "is no number") for text in ("1_000", "\uff10.\uff13", "0x1", "\u0663")),  # no form of ours
        ("p.gap=1", "is no parameter; there are: m, k"),
        ("over=x", "allowed: m, k"),
        ("shown=rho", "allowed: x, v"),
        ("start=1", "give 2 numbers"),
        ("columns=1e9", "at least 10 and at most 4000"),
        ("eta=0", "must be positive"),
        ("direction=sideways", "allowed: both, up"),
        ("class=1", "nothing that a view holds"),
    ],
)
def test_what_does_not_fit_is_refused(query: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        from_query(query, FIRST, STATES)


def test_undo_goes_back_by_steps_of_a_person_not_of_a_slider() -> None:
    past = History(FIRST)
    for value in (0.3, 0.31, 0.32):
        past.put(FIRST.with_value("rho", value), "p.rho")
    past.end_step()
    past.put(past.state.with_value("rho", 0.4), "p.rho")
    assert past.undo()
    assert past.state.values["rho"] == 0.32
    assert past.undo()
    assert past.state == FIRST
    assert not past.undo()
    assert past.redo()
    assert past.redo()
    assert not past.redo()
    assert past.state.values["rho"] == 0.4


def test_the_paper_has_all_its_figures() -> None:
    presets = presets_of(FIRST.model)
    assert {name.split()[1] for name in presets} == {"9", "10", "11", "12", "13", "14", "15", "17", "18"}
    figure = presets["Fig. 13"]
    assert (figure.values["omega"], figure.values["rho"], figure.over) == (11.15, 0.33, "g")


FEW = ("border_collision", "buck_converter", "discontinuous_support", "relief_valve", "rubbing_rotor")


@pytest.mark.parametrize("names", [FEW, pytest.param(ns.models.names(), marks=pytest.mark.slow)], ids=["few", "all"])
def test_every_model_has_a_first_view(names: tuple[str, ...]) -> None:
    for name in names:
        system = getattr(ns.models, name)()
        state = first_state(name, system)
        assert from_query(to_query(state), state, list(system.states)) == state
        assert state.low < state.high
        assert {state.x, state.y, state.shown} <= set(system.states)
        for parameter, value in state.values.items():
            low, high = slider_range(value)
            assert low <= value <= high, parameter
            assert not value or slider_range(1e3 * value) == pytest.approx((1e3 * low, 1e3 * high))  # in any unit


def test_fields_come_as_numbers_too() -> None:
    assert changed(FIRST, "phase", 1.25, STATES).phase == 0.25
    assert isinstance(changed(FIRST, "columns", 100.0, STATES), PageState)


def test_symbols_and_units_as_text() -> None:
    assert [plain_of(r"\rho"), plain_of("k_{s}"), plain_of(r"V_{\mathrm{in}}")] == ["ρ", "kₛ", "Vᵢₙ"]
    assert html_of("k_{s}") == "<i>k</i><sub>s</sub>"
    assert axis_label("x", "m", -3) == "x (mm)"
    assert axis_label(r"\zeta", "") == "ζ"
    assert number(-0.0045, "m") == "−4.5 mm"


def test_an_image_has_a_pixel_per_column_and_shows_density() -> None:
    points = np.array([[0.05, 0.05, 0.05, np.nan], [0.95, 5.0, -5.0, 0.55]])
    image = drawn([(points, "#0072B2", 1)], 0.0, 1.0, 10)
    assert image.shape == (10, 2)
    at = {(int(r), int(c)) for r, c in zip(*np.nonzero(image), strict=True)}
    assert at == {(0, 0), (9, 1), (5, 1)}
    assert image[0, 0] >> 24 == 255 > image[9, 1] >> 24  # three points, one point
    assert image[0, 0] & 0xFFFFFF == 0xB27200  # bytes R, G, B, A
    over = drawn([(points, "#0072B2", 1), (points, "#D55E00", 1)], 0.0, 1.0, 10)
    assert over[0, 0] & 0xFFFFFF == 0x005ED5


def test_the_range_of_a_response_lies_about_the_value_whatever_sign_the_models_own_has() -> None:
    from nonsmooth.explorer.kinds import setting

    state = replace(FIRST.with_value("g", 2.0), settings={"response.over": "g"})
    ranges = [
        [setting(f"response.{end}", SYSTEM.with_parameters(g=own), state) for end in ("low", "high")]
        for own in (2.0, 0.0, -3.0)
    ]
    np.testing.assert_allclose(ranges[1:], [ranges[0]] * 2, rtol=1e-12)
    assert ranges[0][0] < 2.0 < ranges[0][1]
