"""Options of every figure, and labels of jumps that stand apart."""

from __future__ import annotations

import re

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.plot import style
from nonsmooth.plot.labels import in_lines
from nonsmooth.plot.style import nth


@pytest.fixture(scope="module")
def run():
    return ns.simulate(ns.models.discontinuous_support(g=0.02, rho=0.33, omega=4.2), periods=2, transient=100)


def test_title_unit_legend_and_lines(run) -> None:
    ax = ns.plot.time_history(run, title="the support", unit="m", linewidth=2.5, color="black")
    assert ax.get_title() == "the support"
    assert ax.get_ylabel() == "$x$ (m)"
    assert [line.get_linewidth() for line in ax.lines] == [2.5]
    assert ax.lines[0].get_color() == "black"
    ax.figure.canvas.draw()
    assert "10^{\N{MINUS SIGN}2}" in ax.yaxis.get_offset_text().get_text()
    numbers = [re.search(r"-?\d+(\.\d+)?", t.get_text().replace("\N{MINUS SIGN}", "-")) for t in ax.get_yticklabels()]
    ticks = [0.01 * float(number[0]) for number in numbers]
    assert ticks == pytest.approx(list(ax.get_yticks()), abs=1e-12)  # in metres, as the label says
    assert ns.plot.time_history(run, unit="um").get_ylabel() == "$x$ (\N{MICRO SIGN}m)"
    ax = ns.plot.phase_portrait(run, unit={"x": "mm", "y": "m/s"})
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$x$ (mm)", "$v$ (m/s)")
    both = ns.sweep(ns.models.discontinuous_support(), "rho", [0.3, 0.4], direction="both", keep=3, progress=False)
    assert ns.plot.bifurcation(both).get_legend() is not None
    assert ns.plot.bifurcation(both, legend=False).get_legend() is None


def test_lines_that_were_there_stay_as_they_were(run) -> None:
    _, ax = plt.subplots()
    ax.plot([0, 1], [0, 1], linewidth=7)
    ns.plot.time_history(run, ax, linewidth=3)
    assert [line.get_linewidth() for line in ax.lines] == [7, 3]


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"unit": "kg"}, ValueError, "not one of m, mm"),
        ({"unit": {"z": "m"}}, ValueError, "a unit of the ordinate"),
        ({"linewith": 2}, TypeError, "`linewith` is not an option of time_history; nearest: linewidth"),
        ({"shade": "stop"}, ValueError, "no element of this name"),
    ],
)
def test_what_does_not_fit_is_said(run, options, error, words) -> None:
    with pytest.raises(error, match=words):
        ns.plot.time_history(run, **options)


def test_the_phases_of_one_element_are_shaded() -> None:
    rig = ns.mechanical(
        1.0,
        0.05,
        1.0,
        coordinates=["x"],
        parameters={"w": 0.8},
        forcing={"x": lambda t, p: np.cos(p.w * t)},
        elements={
            "rub": ns.elements.Coulomb(at="x", friction=0.3),
            "soft": ns.elements.ElasticStop(at="x", position=0.5, stiffness=5.0),
        },
    )
    run = ns.simulate(rig, periods=2, transient=20)
    middle = 0.5 * (run.time.values[1:] + run.time.values[:-1])
    x = np.interp(middle, run.time.values, run.u.sel(state="x").values)
    clear = np.abs(x - 0.5) > 1e-3
    for shade in ("soft", True):  # of several elements the closed contacts are shaded, not all that slips
        (shaded,) = ns.plot.time_history(run, shade=shade).collections
        ends = [path.vertices[:, 0] for path in shaded.get_paths()]
        covered = np.any([(one.min() < middle) & (middle < one.max()) for one in ends], axis=0)
        assert (covered == (x > 0.5))[clear].all()


@pytest.fixture(scope="module")
def preloaded():
    """Two masses, a preloaded spring, an elastic stop and friction: modes with long names."""
    return ns.mechanical(
        np.eye(2),
        0.1 * np.eye(2),
        [[3.0, -1.0], [-1.0, 2.0]],
        parameters={"w": 1.0, "F": 2.0},
        forcing={"q1": lambda t, p: p.F * np.cos(p.w * t)},
        elements={
            "preloaded_spring": ns.elements.PreloadedSpring(at="q1", preload=0.3, stiffness=1.0),
            "elastic_stop_on_the_right": ns.elements.ElasticStop(at="q2", position=0.4, stiffness=1.0),
            "rail": ns.elements.Coulomb(at="q2", friction=0.05),
        },
    )


def test_a_preloaded_spring_is_no_contact_that_closes(preloaded) -> None:
    """It is above or below at any instant; shaded is where the second mass is beyond its stop."""
    run = ns.simulate(preloaded, periods=2, transient=20)
    middle = 0.5 * (run.time.values[1:] + run.time.values[:-1])
    beyond = np.interp(middle, run.time.values, run.u.sel(state="q2").values) - 0.4
    (shaded,) = ns.plot.time_history(run).collections
    ends = [path.vertices[:, 0] for path in shaded.get_paths()]
    covered = np.any([(one.min() < middle) & (middle < one.max()) for one in ends], axis=0)
    clear = np.abs(beyond) > 1e-2
    assert (covered == (beyond > 0))[clear].all() and 0 < covered.mean() < 0.5


def test_a_legend_of_long_names_stays_in_the_figure(preloaded) -> None:
    ax = ns.plot.orbit(ns.find_orbit(preloaded))
    ax.figure.draw_without_rendering()
    box, whole = ax.get_legend().get_window_extent(), ax.figure.bbox
    assert len(ax.get_legend().get_texts()) > 4
    assert whole.x0 <= box.x0 and box.x1 <= whole.x1 and box.y1 <= whole.y1
    assert ax.get_window_extent().width > 0.7 * whole.width


def test_labels_of_jumps_do_not_stand_over_each_other() -> None:
    """Three jumps at nearly one place: the labels would lie on each other."""
    response = ns.frequency_response(
        ns.models.impact_oscillator(), np.arange(1.0, 2.2, 0.01), direction="both", progress=False
    )
    row = int(np.flatnonzero(response.jump_variable.values == "x")[0])
    three = response.isel(jump=[row, row, row])
    ax = ns.plot.frequency_response(three.assign(jump_value=three.jump_value + 1e-9 * np.arange(3)))
    ax.figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in ax.texts if text.get_text()]
    assert len(boxes) == 3
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])


def test_a_load_is_broken_where_the_motion_jumps() -> None:
    """Grazing ends the motion with impacts: no line leads from their speed to zero, and labels stay in the axes."""
    response = ns.frequency_response(
        ns.models.discontinuous_support(g=0.02, rho=0.14), np.linspace(3, 7, 101), progress=False
    )
    ax = ns.plot.frequency_response(response, y="penetration_clearance")
    rising = ax.lines[0].get_ydata()
    steps = np.abs(np.diff(rising))
    assert np.isnan(rising).sum() == len(np.unique(response.jump_value.values[response.jump_direction.values == "up"]))
    assert np.nanmax(steps) < 0.2 * np.nanmax(rising)
    ax.figure.draw_without_rendering()
    low, high = ax.get_window_extent().intervaly
    boxes = [text.get_window_extent() for text in ax.texts if text.get_text()]
    assert len(boxes) == 4
    assert all(low - 1 < box.y0 and box.y1 < high + 1 for box in boxes)
    plt.close("all")


def test_lines_of_ones_own_have_the_colours_of_the_package() -> None:
    for chosen in (ns.plot.journal, ns.plot.slides):
        with chosen():
            ax = plt.figure().add_subplot()
            ax.plot(np.zeros((2, 6)))
        assert [line.get_color().lstrip("#") for line in ax.lines] == [nth(k).lstrip("#") for k in range(6)]
    plt.close("all")


def test_a_condition_is_broken_between_its_comparisons() -> None:
    both = in_lines("outlined: abs(q3) < 6e-3 and impact_speed < 0.1", 46)
    assert both.splitlines() == ["outlined: abs(q3) < 6e-3", "and impact_speed < 0.1"]
    assert in_lines("a < 1 or b < 2", 46) == "a < 1 or b < 2"
    assert max(map(len, in_lines("words " * 30, 46).splitlines())) <= 46


def test_slides_have_a_style_of_their_own(run, tmp_path) -> None:
    from PIL import Image

    with ns.plot.slides():
        ax = ns.plot.time_history(run)
    wide, high = ax.figure.get_size_inches()
    assert wide / high == pytest.approx(16 / 9)
    assert ax.xaxis.label.get_fontsize() == 11
    assert ax.lines[0].get_linewidth() == 1.6
    with Image.open(ns.plot.save_figure(ax, tmp_path / "slide.png")) as picture:
        assert picture.size == (1920, 1080)
    journal = ns.plot.time_history(run)  # behind the block it is the journal's again
    assert journal.figure.get_size_inches() == pytest.approx([84 / 25.4, 0.72 * 84 / 25.4])
    assert journal.lines[0].get_linewidth() == 0.8


def test_a_line_style_joins_no_points() -> None:
    swept = ns.sweep(ns.models.impact_oscillator(), "A", [0.3, 0.31, 0.32], keep=3, progress=False)
    with pytest.raises(TypeError, match="linestyle: no property of this picture, in which bifurcation has drawn no li"):
        ns.plot.bifurcation(swept, linestyle="--")
    orbit = ns.find_orbit(ns.models.impact_oscillator(), progress=False)
    ax = ns.plot.orbit(orbit, linestyle=":")
    assert {line.get_linestyle() for line in ax.lines if line.get_marker() == "None"} == {":"}
    assert {line.get_linestyle() for line in ax.lines if line.get_marker() != "None"} == {"None"}
    plt.close("all")


def test_a_mark_without_a_face_shows() -> None:
    """The dots of a cloud have no edge, and a cross is nothing else."""
    points = ns.poincare(ns.models.impact_oscillator(), n=5)
    (line,) = ns.plot.section(points, marker="+", markersize=5).lines
    assert line.get_markeredgewidth() > 0


def test_a_title_stands_above_what_a_figure_says_of_itself() -> None:
    plane = {"omega": [3.0, 4.0, 5.0], "rho": [0.1, 0.2]}
    chart = ns.chart(ns.models.discontinuous_support(g=0.02), plane, transient=10, keep=12, progress=False)
    ax = ns.plot.chart(chart, region="abs(x) < 0.03", title="a safe region")
    ax.figure.draw_without_rendering()
    own, said = (text.get_window_extent() for text in (ax.title, ax._left_title))
    assert ax.get_title().strip() == "a safe region" and own.y1 > said.y1 and "\n" in ax.get_title()


def test_a_branch_and_a_curve_of_one_point_are_dots(preloaded) -> None:
    branch = ns.continue_orbit(ns.find_orbit(preloaded), "w", (0.99, 1.01)).isel(point=slice(0, 1))
    curve = xr.Dataset({"kind": "grazing"}, {"a": ("point", [0.5]), "b": ("point", [2.0])})
    curve = curve.assign(special_point=("special", np.zeros(0, int)), special_kind=("special", np.zeros(0, str)))
    places = [(branch["w"].values[0], branch["section"].values[0, 0]), (0.5, 2.0)]
    for ax, place in zip((ns.plot.branch(branch), ns.plot.curve(curve)), places, strict=True):
        (line,) = ax.lines
        assert line.get_xydata().tolist() == [list(map(float, place))]
        assert line.get_marker() == "." and line.get_markevery() == [0]
        assert len(ax.get_legend().get_texts()) == 1


def test_contours_take_two_rows(preloaded) -> None:
    chart = ns.chart(preloaded, {"w": [1.0, 1.1], "F": [1.0]}, progress=False)
    with pytest.raises(ValueError, match="two values and more of each parameter"):
        ns.plot.chart(chart, show="q1_maximum", contours={"q1_maximum": 0.5})


@pytest.mark.parametrize(("place", "way"), [(0.1, 1.0), (0.9, -1.0)])
def test_a_label_over_another_moves_towards_the_middle(place: float, way: float) -> None:
    _, ax = plt.subplots()
    labels = [
        ax.annotate("a jump", (0.5, place), xycoords="axes fraction", xytext=(0, 0), textcoords="offset points")
        for _ in range(3)
    ]
    style.apart(ax, labels)
    heights = np.array([label.xyann[1] for label in labels])
    assert heights[0] == 0.0 and (np.diff(heights) * way > 0.0).all()
    boxes = [label.get_window_extent() for label in labels]
    assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[:k])
