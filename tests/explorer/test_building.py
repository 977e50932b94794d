"""The form of a system of elements: it takes numbers and choices, writes Python, and the two make the same system."""

from __future__ import annotations

import json
from typing import Any

import pytest

import nonsmooth as ns
from nonsmooth.explorer.building import KINDS, read_plan

ONE = {"m": "1", "k": "1", "c": "0.1", "F": "0.5"}
TWO = {"m": "0.5", "k": "2", "c": "0", "F": "0"}
ALL = {
    "masses": [ONE, TWO],
    "omega": "0.9",
    "elements": [
        {"kind": "stop", "at": "2", "other": "0", "side": "above", "position": "0.3", "restitution": "0.6"},
        {
            "kind": "elastic",
            "at": "2",
            "other": "1",
            "side": "below",
            "position": "-0.5",
            "stiffness": "20",
            "damping": "1",
        },
        {"kind": "friction", "at": "1", "other": "0", "friction": "0.2", "belt": "0"},
    ],
}


def python_of(form: Any) -> ns.System:
    made: dict[str, Any] = {}
    exec(read_plan(form).python(), made)  # our own text, as a person would run it
    return made["system"]


@pytest.mark.parametrize("kind", KINDS)
def test_the_python_of_each_element_makes_the_system_that_is_explored(kind: str) -> None:
    form = {"masses": [ONE], "omega": 1, "elements": [{"kind": kind, "at": 1}]}
    system = read_plan(form).system()
    assert python_of(form) == system
    assert ns.System.from_text(system.to_text()) == system


def test_a_chain_of_masses_has_the_matrices_of_its_springs() -> None:
    form = {"masses": [ONE, TWO, ONE], "omega": 1, "elements": []}
    system = read_plan(form).system()
    assert python_of(form) == system
    field = next(iter(system.traced.fields))
    values = dict(zip(system.traced.p, [system.values[name] for name in system.parameters], strict=True))
    x1, x2, x3 = system.traced.u[:3]
    acceleration = field[4].subs(values).expand()  # of the second mass: 0.5 a = -2 (x2 - x1) + 1 (x3 - x2)
    assert [float(acceleration.coeff(x)) for x in (x1, x2, x3)] == pytest.approx([4.0, -6.0, 2.0])


def test_elements_between_masses_and_several_kinds_together() -> None:
    system = read_plan(ALL).system()
    assert python_of(ALL) == system
    assert ns.System.from_text(system.to_text()) == system
    assert {"d_1", "e_1", "s_2", "f_3", "omega"} <= set(system.parameters)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"masses": [{**ONE, "m": "0"}]}, "mass 1, mass = 0"),
        ({"masses": [{**ONE, "k": "__import__('os')"}]}, "is no number"),
        ({"elements": [{"kind": "stop", "at": 3}]}, "no mass 3"),
        ({"elements": [{"kind": "stop", "at": 1, "other": 1}]}, "with itself"),
        ({"elements": [{"kind": "stop", "at": 1, "restitution": 2}]}, "at most 1"),
        ({"omega": -1}, "forcing frequency"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_row(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        read_plan({**ALL, **change})


def test_a_system_of_the_form_is_written_and_explored(page: Any) -> None:
    page.until_done()
    page.tab.select_option("#model", "")
    page.until('document.getElementById("building-python").textContent.includes("ns.elements.Stop")')
    page.tab.fill('#building-elements [data-set="build.elements.0.restitution"]', "2")
    page.tab.press('#building-elements [data-set="build.elements.0.restitution"]', "Tab")
    page.until('document.getElementById("wrong-building").textContent.includes("at most 1")')
    page.until('document.getElementById("building-explore").disabled')
    page.tab.fill('#building-elements [data-set="build.elements.0.restitution"]', "0.6")
    page.tab.press('#building-elements [data-set="build.elements.0.restitution"]', "Tab")
    page.until('document.getElementById("building-python").textContent.includes("(0.6,")')
    page.picture("building")
    made: dict[str, Any] = {}
    exec(page.tab.inner_text("#building-python"), made)
    with page.tab.expect_download() as download:
        page.tab.click("#building-save")
    assert download.value.suggested_filename == "system.py"
    page.tab.click("#building-explore")
    page.until('JSON.parse(Bokeh.documents[0].get_model_by_name("ui").value).state.model === "built_1"')
    page.tab.wait_for_selector("#building", state="hidden")
    page.until_done()
    assert page.notes() == ""
    told = page.readout()
    period = ns.sweep(made["system"], "omega", [1.0], direction=None, transient=100, keep=40, progress=False)
    assert told["motion"] == f"period {int(period['period_number'].values[0])}"
    page.tab.click("#undo")
    page.until_done()
    assert page.ui()["state"]["model"] == "discontinuous_support"
    assert json.dumps(page.ui()["models"]).count("built") == 2
