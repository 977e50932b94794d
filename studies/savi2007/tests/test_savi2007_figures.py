"""The figures as a referee reads them: units, legends, order, letters, nothing cut; not their pixels."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import Collection
from matplotlib.text import Annotation, Text

from nonsmooth.plot import COLORS
from nonsmooth_savi2007 import Reproduction
from nonsmooth_savi2007.figures.diagrams import other_motions
from nonsmooth_savi2007.figures.figure import Figure
from nonsmooth_savi2007.figures.measured_diagrams import transient_points
from nonsmooth_savi2007.printed import FIGURE_14, NUMBERS
from nonsmooth_savi2007.study import figures_of_the_study

FIGURES: dict[str, Figure] = {figure.name: figure for figure in figures_of_the_study()}
QUICK = ["fig09", "fig09_rig", "fig11", "fig11_rig", "table1"]
#: No other unit of a length, speed, force, frequency or time stands at an axis of the study.
UNITS = {"mm", "mm/s", "\N{MICRO SIGN}m", "N", "rad/s", "%"}


@pytest.fixture(scope="module")
def drawn(quick: Reproduction) -> dict[str, Any]:
    """The figures of the quick run, laid out."""
    canvases = {name: FIGURES[name].draw(quick.data[name]) for name in QUICK}
    for canvas in canvases.values():
        canvas.canvas.draw()
    return canvases


def legend_of(canvas: Any) -> list[str]:
    (legend,) = [*canvas.legends, *(one for ax in canvas.axes if (one := ax.get_legend()) is not None)]
    return [text.get_text() for text in legend.get_texts()]


def inside(ax: Any, artist: Any) -> bool:
    """Return True where some of an artist lies within its axes."""
    if isinstance(artist, Collection) or not hasattr(artist, "get_xydata"):
        return bool(artist.get_visible())
    at = artist.get_transform().transform(np.asarray(artist.get_xydata(), dtype=float))
    box = ax.get_window_extent().padded(1.0)
    return any(box.contains(*point) for point in at[np.isfinite(at).all(axis=1)])


@pytest.mark.parametrize("name", ["fig09", "fig11"])
def test_the_legend_names_what_is_drawn_and_nothing_else(drawn: Mapping[str, Any], name: str) -> None:
    canvas = drawn[name]
    there = {
        artist.get_label()
        for ax in canvas.axes
        for artist in [*ax.lines, *ax.collections, *ax.patches]
        if not str(artist.get_label()).startswith("_") and inside(ax, artist)
    }
    assert set(legend_of(canvas)) == there
    assert len(set(legend_of(canvas))) == len(legend_of(canvas))


@pytest.mark.parametrize("name", QUICK)
def test_one_system_of_units(drawn: Mapping[str, Any], name: str) -> None:
    labels = [label for ax in drawn[name].axes for label in (ax.get_xlabel(), ax.get_ylabel()) if label]
    units = {unit for label in labels for unit in re.findall(r"\(([^()]*)\)$", label)}
    assert units and units <= UNITS
    for ax in drawn[name].axes:
        for axis in (ax.xaxis, ax.yaxis):
            assert not axis.get_offset_text().get_text(), "a power of ten at the end of an axis"


@pytest.mark.parametrize("name", QUICK)
def test_letters_are_seven_points_and_lie_on_the_sheet(drawn: Mapping[str, Any], name: str) -> None:
    canvas = drawn[name]
    sheet = canvas.bbox.padded(1.0)
    for text in canvas.findobj(Text):
        if not text.get_text().strip() or not text.get_visible():
            continue
        assert text.get_fontsize() >= 6.99, text.get_text()
        box = text.get_window_extent()
        # Labels of ticks beyond the limits of an axis are there too, unseen.
        if isinstance(text, Annotation) or text in canvas.legends:
            assert sheet.x0 <= box.x0 and box.x1 <= sheet.x1 and sheet.y0 <= box.y0 and box.y1 <= sheet.y1


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("fig09", ("period 2 near", "jump rising", "jump falling")),
        ("fig09_rig", ("jump rising", "jump falling")),
        ("fig11", ("period 4 from", "period 2 from", "period 1 from")),
        ("fig11_rig", ("period 1 from",)),
    ],
)
def test_printed_values_have_their_numbers(drawn: Mapping[str, Any], name: str, numbers: tuple[str, ...]) -> None:
    for ax in drawn[name].axes:
        at = {round(text.xy[0], 9): text.get_text() for text in ax.texts if isinstance(text, Annotation)}
        for number in numbers:
            assert at[NUMBERS[number].value] == NUMBERS[number].text


def test_no_bar_of_table_1_is_cut(drawn: Mapping[str, Any]) -> None:
    (ax,) = drawn["table1"].axes
    low, high = ax.get_xlim()
    bars = [segment for item in ax.collections for segment in item.get_segments()]
    assert len(bars) >= 12
    assert all(low < x < high for segment in bars for x in segment[:, 0])


def test_grazing_hides_no_jump(drawn: Mapping[str, Any]) -> None:
    """The falling jump begins at the grazing frequency: its mark ends below the arrow."""
    for ax in drawn["fig09"].axes:
        marks = [line for line in ax.lines if np.ptp(line.get_xdata()) == 0 and len(line.get_xdata()) == 2]
        green = [line for line in marks if line.get_color() == COLORS["third"]]
        tops = [line.get_transform().transform(line.get_xydata())[:, 1].max() for line in green]
        feet = [ax.transData.transform((0, min(text.xy[1], text.xyann[1])))[1] for text in ax.texts if text.arrow_patch]
        assert len(tops) == 2 and feet and max(tops) < min(feet)


def gaps() -> dict[str, xr.Dataset]:
    """Circles in place of motions, the rig's larger than the model's, at the gaps of Fig. 14."""
    angle = np.linspace(0, 2 * np.pi, 50, endpoint=False)
    circle = np.stack([0.01 * np.cos(angle), 0.08 * np.sin(angle)], axis=1)
    return {
        f"{g:g}": xr.Dataset(
            {
                "theory_orbit": (("phase", "state"), circle),
                "measured_orbit": (("phase", "state"), 1.1 * circle),
                "theory_section": (("theory_iterate", "state"), circle[:1]),
                "measured_section": (("measured_iterate", "state"), 1.1 * circle[:1]),
                "measured_period_number": number,
                "theory_period_number": 1,
                "g": g,
            },
            {"phase": angle, "state": ["x", "v"], "state_unit": ("state", ["m", "m/s"])},
        )
        for g, number in FIGURE_14.items()
    }


def attractor() -> dict[str, xr.Dataset]:
    points = np.tile(np.array([[0.001, 0.02], [0.002, -0.03]]), (4, 1, 1))
    return {
        "attractor": xr.Dataset(
            {
                "theory_section": (("section_phase", "theory_iterate", "state"), points),
                "measured_section": (("section_phase", "measured_iterate", "state"), 1.1 * points),
            },
            {"state": ["x", "v"], "state_unit": ("state", ["m", "m/s"])},
        )
    }


@pytest.mark.parametrize(("name", "data"), [("fig14_rig", gaps()), ("fig16", attractor())])
def test_the_model_stands_above_the_rig(name: str, data: dict[str, xr.Dataset]) -> None:
    """In the same order in all sheets, and every column in the order of the paper's parts (a) to (d)."""
    canvas = FIGURES[name].draw(data)
    canvas.canvas.draw()
    axes = np.reshape(canvas.axes[:8], (2, 4))
    assert [ax.get_ylabel().split("\n")[0] for ax in axes[:, 0]] == ["model, identified", "virtual rig (synthetic)"]
    for above, below in axes.T:
        largest = [max(np.nanmax(line.get_ydata()) for line in ax.lines[:1]) for ax in (above, below)]
        assert largest[1] == pytest.approx(1.1 * largest[0])  # the rig's circles and points are the larger ones
    assert [ax.get_title()[:3] for ax in axes[0]] == ["(a)", "(b)", "(c)", "(d)"]
    for ax in axes.ravel():  # inner labels are hidden, and still tell the unit
        assert ax.get_ylabel().endswith("$v$ (mm/s)") and ax.get_xlabel() == "$x$ (mm)"
        assert ax.yaxis.label.get_visible() == (ax in axes[:, 0])


def test_the_rigs_section_points_lie_over_the_models_marks() -> None:
    canvas = FIGURES["fig14_rig"].draw(gaps())
    for ax in canvas.axes[4:8]:
        by_name = {line.get_label(): line for line in ax.lines}
        model, rig = by_name["section points of the model"], by_name["section points"]
        assert model.get_zorder() < rig.get_zorder() and model.get_marker() == "x"


def test_records_in_transient_chaos_are_told_apart() -> None:
    """At 0.9 mm one of two records has period 2, the other none yet; at 1.8 mm none has: that is chaos."""
    runs = xr.Dataset({"setting": ("run", [0.9, 1.8, 0.9, 1.8, -1.2]), "period_number": ("run", [0, 0, 2, 0, 1])})
    compared = xr.Dataset({"measured_g": ("sample", np.repeat(runs["setting"].values, 3))})
    np.testing.assert_array_equal(transient_points(compared, runs), [True] * 3 + [False] * 12)


def test_other_motions_are_those_that_the_sweeps_have_not() -> None:
    """Sweeps on a circle: a start on its points is no other motion, one on a larger circle is."""
    angle = 2 * np.pi * np.arange(40) / 40
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    swept = xr.Dataset(
        {
            "section": (("a", "direction", "iterate", "state"), np.tile(circle, (2, 2, 1, 1))),
            "maximum": ("a", [1.0, 1.0]),
        },
        {"a": [0.0, 1.0], "state": ["x", "v"]},
    )
    found = np.stack([circle[::10], circle[5::10], 1.3 * circle[::10]])
    many = xr.Dataset(
        {
            "section": (("a", "start", "iterate", "state"), found[None]),
            "period_number": (("a", "start"), np.array([[4, 4, 4]])),
        },
        {"a": [0.9], "state": ["x", "v"]},
    )
    np.testing.assert_array_equal(other_motions(many, swept).values, [[False, False, True]])
