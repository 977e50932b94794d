"""Every figure draws what its result holds, on the axes it was given, and saves as a vector file."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth import plot
from nonsmooth.plot import style
from nonsmooth.plot.labels import column, name_and_unit
from nonsmooth.plot.trajectories import with_gaps

CASES = [
    ("time_history", "trajectory"),
    ("phase_portrait", "trajectory"),
    ("bifurcation", "swept"),
    ("frequency_response", "responded"),
    ("section", "points"),
]


@pytest.mark.parametrize(("figure", "name"), CASES)
def test_a_figure_of_its_own_has_a_column_width_and_names_its_axes(
    figure: str, name: str, request: pytest.FixtureRequest
) -> None:
    ax = getattr(plot, figure)(request.getfixturevalue(name))
    assert ax.figure.get_figwidth() * 25.4 == pytest.approx(84)
    assert ax.get_xlabel()
    assert ax.get_ylabel()


#: With text and lines, and with points as pixels.
SAVED = [*CASES[1:3], *(pytest.param(*case, marks=pytest.mark.slow) for case in (CASES[0], *CASES[3:]))]


@pytest.mark.parametrize(("figure", "name"), SAVED)
def test_a_figure_saves_the_same_twice(figure: str, name: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    ax = getattr(plot, figure)(request.getfixturevalue(name))
    once = plot.save_figure(ax, tmp_path / "a.pdf").read_bytes()
    assert once.startswith(b"%PDF")
    assert plot.save_figure(ax.figure, tmp_path / "b.pdf").read_bytes() == once


@pytest.mark.parametrize(("figure", "name"), CASES)
def test_given_axes_are_used_and_the_callers_style_kept(figure: str, name: str, request: pytest.FixtureRequest) -> None:
    _, mine = plt.subplots()
    before = dict(mpl.rcParams)
    assert getattr(plot, figure)(request.getfixturevalue(name), mine) is mine
    assert dict(mpl.rcParams) == before
    assert len(plt.get_fignums()) == 1


def test_a_legend_on_given_axes_has_the_packages_style(swept: xr.Dataset) -> None:
    """No frame, letters of 7/8 of the axes' labels; a setting of the caller's own stays."""
    _, mine = plt.subplots()
    mine.xaxis.label.set_size(16)
    legend = plot.bifurcation(swept, mine).get_legend()
    assert not legend.get_frame_on()
    assert legend.get_texts()[0].get_size() == pytest.approx(14)
    with mpl.rc_context({"legend.fontsize": 5}):
        assert plot.bifurcation(swept, plt.subplots()[1]).get_legend().get_texts()[0].get_size() == pytest.approx(5)


@pytest.mark.parametrize(("figure", "name"), CASES)
def test_a_result_of_another_verb_is_refused(figure: str, name: str) -> None:
    with pytest.raises(ValueError, match="it is not the result of"):
        getattr(plot, figure)(xr.Dataset({"u2": 1.0}))


@pytest.mark.parametrize(
    "figure",
    [
        "branch",
        "curve",
        "chart",
        "basins",
        "basin_fractions",
        "manifolds",
        "density",
        "multipliers",
        "orbit",
        "time_history",
    ],
)
def test_what_is_no_result_is_refused(figure: str) -> None:
    with pytest.raises(TypeError, match="not (from )?float"):
        getattr(plot, figure)(3.0)


def test_a_diagram_shows_every_finite_point_up_and_down(swept: xr.Dataset) -> None:
    ax = plot.bifurcation(swept, y="v")
    up, down = ax.lines
    assert (up.get_label(), down.get_label()) == ("up", "down")
    for line, direction in ((up, "up"), (down, "down")):
        drawn = np.array(line.get_data()).T
        drawn = drawn[np.isfinite(drawn[:, 1])]
        held = swept["section"].sel(direction=direction, state="v").transpose("iterate", "rho")
        pairs = {(float(r), float(v)) for row in held for r, v in zip(swept["rho"], row, strict=True)}
        expected = {pair for pair in pairs if np.isfinite(pair[1])}
        assert set(map(tuple, drawn)) == expected
        assert line.get_rasterized()
    assert ax.get_xlabel() == r"$\rho$ (N)"
    assert ax.get_ylabel() == r"$\dot x$ (m/s)"


def test_many_starts_are_all_drawn(swept: xr.Dataset) -> None:
    many = swept.isel(direction=0).drop_vars("start").expand_dims(start=3)
    (cloud,) = plot.bifurcation(many).lines
    assert len(cloud.get_xdata()) == many["section"].isel(state=0).size


def test_jumps_are_gaps_with_their_values(responded: xr.Dataset) -> None:
    ax = plot.frequency_response(responded)
    texts = [text.get_text() for text in ax.texts if text.get_text()]
    assert texts == ["5.9", "5.2"]
    up, down = ax.lines
    assert (up.get_label(), down.get_label()) == ("increasing", "decreasing")
    for line, value in ((up, 5.9), (down, 5.2)):
        x, y = line.get_data()
        (gap,) = np.flatnonzero(np.isnan(x))
        assert x[gap - 1] <= value + 1e-9 <= x[gap + 1] + 1e-9
        assert max(y[gap - 1], y[gap + 1]) > 4 * min(y[gap - 1], y[gap + 1])
    assert up.get_linestyle() != down.get_linestyle()
    plain = plot.frequency_response(responded, plt.figure().add_subplot(), jumps=False, quantity="maximum")
    assert not plain.texts


def test_an_axis_in_falling_order_breaks_at_the_same_places(responded: xr.Dataset) -> None:
    rising = plot.frequency_response(responded).lines[0].get_data()
    falling = plot.frequency_response(responded.isel(omega=slice(None, None, -1)), plt.figure().add_subplot())
    np.testing.assert_array_equal(np.array(falling.lines[0].get_data())[:, ::-1], rising)


def test_a_portrait_tells_the_modes_apart(trajectory: xr.Dataset) -> None:
    ax = plot.phase_portrait(trajectory, zone="g")
    free, contact = (line for line in ax.lines if line.get_label() in ("free", "contact"))
    inside = contact.get_xdata()[np.isfinite(contact.get_xdata())]
    outside = free.get_xdata()[np.isfinite(free.get_xdata())]
    assert inside.min() >= 0.5 - 1e-12
    assert outside.max() <= 0.5 + 1e-12
    zone = ax.patches[0]
    assert zone.get_extents().transformed(ax.transData.inverted()).x0 == pytest.approx(0.5)


def test_a_portrait_carries_section_points(trajectory: xr.Dataset, points: xr.Dataset) -> None:
    ax = plot.phase_portrait(trajectory, section=points)
    (drawn,) = (line for line in ax.lines if line.get_label() == "section points")
    np.testing.assert_array_equal(drawn.get_xdata(), points["section"].sel(state="x").values.ravel())


def test_an_impact_is_a_gap_not_a_line(trajectory: xr.Dataset) -> None:
    (plain,) = with_gaps(trajectory, trajectory["time"].values)
    assert np.isfinite(plain).all()
    impact = trajectory.copy(deep=True)
    impact["u"].values[trajectory["segment"].values == 1] *= -0.8
    (cut,) = with_gaps(impact, impact["time"].values)
    assert np.isnan(cut).sum() == 2  # into segment 1 and out of it


def test_contact_is_shaded_over_time(trajectory: xr.Dataset) -> None:
    ax = plot.time_history(trajectory, y="contact_force")
    (shade,) = ax.collections
    spans = [(path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in shade.get_paths()]
    crossing = trajectory["crossing_time"].values
    np.testing.assert_allclose(spans[1], crossing[1:3], atol=0.05)
    assert not plot.time_history(trajectory, plt.figure().add_subplot(), shade=False).collections


def test_labels_have_symbols_units_or_words(trajectory: xr.Dataset, swept: xr.Dataset) -> None:
    assert name_and_unit(trajectory, "time") == ("$t$", "s")
    assert name_and_unit(trajectory, "x") == ("$x$", "m")
    assert name_and_unit(trajectory, "contact_force") == ("contact force", "N")
    assert name_and_unit(swept, "omega") == (r"$\omega$", "rad/s")


def test_an_unknown_state_is_answered_with_all_states(swept: xr.Dataset) -> None:
    with pytest.raises(ValueError, match=r"'w' is neither a state nor an output .*\['x', 'v'\]"):
        column(swept, "section", "w")
    with pytest.raises(ValueError, match="quantity = 'height'; allowed: 'amplitude'"):
        plot.frequency_response(xr.Dataset({"amplitude": 1.0}), quantity="height")


def test_point_clouds_are_pixels_and_text_stays_text(swept: xr.Dataset, tmp_path: Path) -> None:
    text = plot.save_figure(plot.bifurcation(swept), tmp_path / "a.svg").read_text()
    assert "data:image/png;base64" in text
    assert re.search(r"<text[^>]*>", text)


def test_a_falling_sweep_does_not_hide_the_rising_one(swept: xr.Dataset) -> None:
    """It lies on top, and its points are smaller: coinciding ones show as a seam. The legend shows both as large."""
    ax = plot.bifurcation(swept, y="v")
    up, down = ax.lines
    assert up.get_markersize() >= 1.5 * down.get_markersize() and up.get_zorder() <= down.get_zorder()
    light = [mpl.colors.rgb_to_hsv(mpl.colors.to_rgb(line.get_color())) @ [0, -1, 1] for line in (up, down)]
    assert light[0] > light[1] + 0.2  # told apart in grey print too
    assert len({handle.get_markersize() for handle in ax.get_legend().legend_handles}) == 1
    alone = plot.bifurcation(swept.isel(direction=[0]), plt.figure().add_subplot(), y="v")
    assert alone.lines[0].get_markersize() == down.get_markersize()


@pytest.mark.parametrize(("crowded", "outside"), [(False, False), (True, True)])
def test_a_legend_covers_nothing(crowded: bool, outside: bool) -> None:
    """It stands in the axes where there is room, and above them where lines run everywhere."""
    x = np.linspace(0.0, 1.0, 400)
    with style.axes(None) as ax:
        ax.plot(x, 0.2 * x, label="a branch of orbits")
        if crowded:
            ax.plot(x, np.sin(200 * x), label="another")
        legend = style.clear_legend(ax)
    ax.figure.draw_without_rendering()
    box = legend.get_window_extent()
    assert (box.y0 >= ax.bbox.y1) == outside
    for line in ax.lines:
        assert not box.count_contains(line.get_transform().transform(line.get_xydata()))


def test_loads_are_drawn_with_their_units() -> None:
    """A resonance curve of a load: its own name and unit, and the values as they stand."""
    rig = ns.mechanical(
        "m",
        0.1,
        1.0,
        parameters={"m": (2.0, "kg"), "w": 1.0},
        coordinates={"q": "m"},
        forcing={"q": lambda t, p: np.cos(p.w * t)},
        elements={"wall": ns.elements.Stop(at="q", position=1.0)},
    )
    w = np.linspace(0.8, 1.0, 5)
    curve = ns.frequency_response(rig, w, parameter="w", direction="up", loads=True, progress=False)
    ax = plot.frequency_response(curve, y="wall_energy")
    assert ax.get_ylabel() == "wall energy (J)"
    (line,) = ax.get_lines()
    assert np.array_equal(np.asarray(line.get_ydata(), dtype=float), curve["wall_energy"].values)
    # one point of each value in place of as many as were kept: three times as large
    dots = plot.bifurcation(curve, plt.figure().add_subplot(), y="wall_energy", size=2.0).lines[0]
    states = plot.bifurcation(curve, plt.figure().add_subplot(), y="q", size=2.0).lines[0]
    assert (dots.get_markersize(), states.get_markersize()) == (6.0, 2.0)


def test_a_point_between_two_that_failed_is_a_dot(responded: xr.Dataset) -> None:
    """No line leads to it; and where all failed, the axis is that of the values."""
    gone = xr.ones_like(responded["omega"]).where(np.arange(responded.sizes["omega"]) % 2 == 0)
    names = ("maximum", "minimum", "amplitude")
    half = responded.assign({name: gone * responded[name] for name in names})
    assert len(plot.frequency_response(half, jumps=False).lines[0].get_markevery()) > responded.sizes["omega"] // 2 - 3
    none = responded.assign({name: np.nan * responded[name] for name in names})
    assert plot.frequency_response(none, plt.subplots()[1]).get_xlim() == tuple(responded["omega"].values[[0, -1]])


def test_words_stay_within_the_picture(responded: xr.Dataset) -> None:
    """A long condition is written in lines; the value of a jump stands on the side where there is room."""
    condition = " and ".join(
        ["abs(x) < 0.03", "period_number == 1", "abs(v) < 0.5", "contacts_per_period < 2", "omega > 1"]
    )
    edge = responded.isel(omega=slice(int((responded["omega"] < 5.1).sum()), None))
    for ax in (plot.frequency_response(responded, region=condition), plot.frequency_response(edge)):
        ax.figure.draw_without_rendering()
        inside = ax.figure.bbox
        for text in [*ax.texts, *ax.get_legend().get_texts()]:
            box = text.get_window_extent()
            assert inside.x0 <= box.x0 and box.x1 <= inside.x1, text.get_text()
        assert ax.get_window_extent().width > 0.5 * inside.width


@pytest.mark.parametrize("figure", ["bifurcation", "comparison_response", "branch"])
def test_an_orbit_where_another_result_is_wanted(figure: str, points: xr.Dataset) -> None:
    for given in (ns.find_orbit(ns.models.impact_oscillator(), progress=False), points):
        with pytest.raises(
            (TypeError, ValueError), match=r"draws the result of|not the result of|no result of compare"
        ):
            getattr(plot, figure)(given)
