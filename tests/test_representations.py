"""Objects and results as a terminal and a notebook show them: short, and nothing that matters left out."""

from __future__ import annotations

from html.parser import HTMLParser
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.identification.parameter_set import ParameterSet
from nonsmooth.results.representation import cut, html_table, text_table


class Page(HTMLParser):
    """Cells of the tables of a page; fails where an element is not closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.cells: list[str] = []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.open.append(tag)
        if tag in ("td", "th"):
            self.cells.append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if {"td", "th"} & set(self.open):
            self.cells[-1] += data


def short(text: str) -> bool:
    return text.count("\n") < 30 and max(map(len, text.splitlines())) <= 240


def findings() -> tuple[Finding, ...]:
    return tuple(
        Finding(
            f"q{i}",
            Estimate(2.0, 0.1, "N"),
            "by a <method> that is told " + "at length " * 30,
            40,
            ("a", "b"),
            tuple(f"note {k}: " + "words " * 100 for k in range(6)),
            {"other": Estimate(1.0, 0.25, "m")},
        )
        for i in range(9)
    )


def identified(**more: object) -> ParameterSet:
    return ParameterSet(
        {"k": Estimate(8.47, 0.05, "N/m"), "c": Estimate(0.8, 0.1, "N s/m", logarithmic=True)},
        np.diag([0.05**2, 0.01, 0.0]),
        extra={"gain": Estimate(1.0, 0.0)},
        findings=findings(),
        identifiability={"k": "from the springs"},
        notes=["a long note " * 40] * 12,
        **more,
    )


def test_a_surface_shows_its_static_friction() -> None:
    assert "crossed or slid on, static f_s" in str(ns.models.dry_friction_oscillator())


def test_a_smoothed_system_shows_the_ways_into_and_out_of_its_bands() -> None:
    system = ns.models.stick_slip_belt()
    assert str(system).count(" -> ") == 0  # its surface is crossed or slid on
    assert str(system.smoothed(0.01)).count(" -> ") == 4


def many_modes(modes: int) -> ns.System:
    """A chain of modes, one behind the other."""
    names = [f"mode{i}" for i in range(modes)]
    return ns.System(
        states=["x"],
        parameters={f"parameter_{i}": float(i) for i in range(30)},
        modes={name: lambda t, u, p: (p.parameter_1,) for name in names},
        indicators={f"h_{name}": lambda t, u, p, i=i: u.x - i for i, name in enumerate(names)},
        transitions=[ns.Transition(a, b, when=f"h_{b} > 0") for a, b in pairwise(names)],
    )


def test_a_system_is_short_and_printed_whole() -> None:
    system = many_modes(40)
    assert short(repr(system)) and "print(system) shows" in repr(system)
    assert "mode39" in str(system) and "more lines" not in str(system)
    small = ns.models.impact_oscillator()
    assert repr(small) == str(small)
    cells = Page(small._repr_html_()).cells
    assert "A*cos(omega*t) - c*v - k*x" in "".join(cells) and "stop > 0" in "".join(cells)
    assert len(system._repr_html_()) < 20_000


def test_an_orbit_with_many_transitions_is_short() -> None:
    orbit = ns.find_orbit(ns.models.discontinuous_support().with_parameters(omega=3.69, g=-0.0045))
    assert short(repr(orbit)) and "period-1, stable" in repr(orbit)
    cells = Page(orbit._repr_html_()).cells
    assert "".join(cells).count("penetration > 0") == 2
    from dataclasses import replace

    from nonsmooth.continuation.problems.signature import Signature

    long = replace(orbit, signature=Signature(orbit.signature.visits[:-1] * 60 + orbit.signature.visits[-1:]))
    assert short(repr(long)) and "(240 transitions)" in repr(long)


def test_identified_parameters_are_short_and_name_every_anomaly() -> None:
    anomalies = ["the springs contradict the masses", "two clocks"]
    found = identified(anomalies=anomalies)
    assert short(repr(found))
    for text in (repr(found), str(found), found._repr_html_()):
        assert "8.470 ± 0.050 N/m" in text and all(sentence in text for sentence in anomalies)
    assert "9 findings, 12 notes" in repr(found) and str(found).count("a long note") == 12 * 40
    assert "from the springs" in Page(found._repr_html_()).cells


def test_a_finding_is_one_line_and_printed_whole() -> None:
    (one, *_) = findings()
    assert short(repr(one)) and "\n" not in repr(one) and "2.00 ± 0.10 N" in repr(one)
    assert str(one).count("note ") == 6 and "besides: other" in str(one)
    page = one._repr_html_()
    assert "by a <method>" in "".join(Page(page).cells) and "<method>" not in page


def test_a_recording_is_short() -> None:
    sensors = {
        f"s{i}": xr.Dataset(
            {f"channel{i}_{k}": ("time", np.zeros(5), {"units": "N"}) for k in range(40)},
            {"time": np.arange(5.0)},
            {"rate": 100.0},
        )
        for i in range(40)
    }
    recording = ns.Recording.from_runs({"run": sensors}, synthetic=True, warnings=("a <warning>",))
    assert short(repr(recording)) and "5 samples at 100 Hz: channel0_0 [N]" in repr(recording)
    cells = Page(recording._repr_html_()).cells
    assert ["run", "samples", "rate", "channels"] == cells[:4] and "100 Hz" in cells and len(cells) < 120


def test_a_result_unrolls_no_provenance_in_a_notebook() -> None:
    """Xarray shows an attribute whole."""
    diagram = ns.sweep(
        ns.models.discontinuous_support(), "rho", np.linspace(0.40, 0.45, 60), transient=2, keep=2, progress=False
    )
    response = ns.frequency_response(
        ns.models.discontinuous_support(), np.linspace(3.0, 3.1, 60), transient=2, keep=2, progress=False
    )
    for result in (diagram, response, ns.simulate(ns.models.discontinuous_support(), periods=1)):
        assert len(result.attrs["nonsmooth"]) <= 2000


def test_parameters_as_a_table_of_pandas() -> None:
    table = identified().to_dataframe()
    assert isinstance(table, pd.DataFrame) and list(table.index) == ["k", "c", "gain"]
    assert table.loc["k", "unit"] == "N/m" and table.loc["k", "identifiability"] == "from the springs"
    assert table["parameter_of_the_model"].tolist() == [True, True, False]
    low, high = table.loc["k", ["low", "high"]]
    assert (low, high) == pytest.approx((8.47 - 1.959964 * 0.05, 8.47 + 1.959964 * 0.05))
    assert table.loc["c", "low"] * table.loc["c", "high"] == pytest.approx(0.8**2)  # known to a factor
    assert identified().to_dataframe(0.5).loc["k", "high"] == pytest.approx(8.47 + 0.6744898 * 0.05)
    assert ParameterSet({}, np.zeros((0, 0))).to_dataframe().empty


def test_lines_are_broken_after_commas_and_cut() -> None:
    rows = [("head", ", ".join(f"item {i}" for i in range(40)))]
    lines = text_table("title", rows).splitlines()
    assert len(lines) > 3 and max(map(len, lines)) <= 100
    assert [word.strip() for line in lines[1:] for word in line.removeprefix("  head").split(",") if word.strip()] == [
        f"item {i}" for i in range(40)
    ]
    assert cut("a" * 300, 50).endswith("a ...") and len(cut("a" * 300, 50)) == 50
    many = [("a", str(i)) for i in range(100)]
    assert text_table("t", many, whole=False).endswith("... print() shows 77 more lines")
    assert "... and 76 more" in html_table("t", many)
