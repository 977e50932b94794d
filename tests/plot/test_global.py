"""Pictures of charts, basins and multistability: what is drawn is what the result holds."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.attractors.basin_fractions import basin_fractions
from nonsmooth.attractors.basins import basins
from nonsmooth.diagrams.chart import chart
from nonsmooth.plot.planes import basin_fractions as draw_fractions
from nonsmooth.plot.planes import basins as draw_basins
from nonsmooth.plot.planes import chart as draw_chart
from nonsmooth.plot.planes import told_apart
from nonsmooth.plot.style import PERIODS, attractor_color

mpl.use("Agg")
QUIET = {"progress": False}
BOX = {"x": (-0.02, 0.02), "v": (-0.2, 0.2)}


@pytest.fixture(scope="module")
def support() -> ns.System:
    return ns.models.discontinuous_support(omega=11.15, rho=0.33, g=0.0014)


def texts(ax) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_a_chart_shows_each_period_once_with_its_colour(support: ns.System) -> None:
    plane = chart(support, {"g": [-0.001, 0.0009, 0.0012, 0.0018], "rho": [0.33, 0.331]}, lyapunov=100, **QUIET)
    ax = draw_chart(plane)
    assert texts(ax) == [str(p) for p in sorted(set(plane["period_number"].values.ravel().tolist()) - {0})] + [
        "none found"
    ]
    mesh = ax.collections[0]
    assert mesh.get_array().size == 8
    first = mesh.to_rgba(mesh.get_array().ravel())[0]
    assert mpl.colors.to_hex(first) == PERIODS[int(plane["period_number"][0, 0]) - 1].lower()
    assert ax.get_xlabel() == "$g$ (mm)" and ax.get_ylabel() == r"$\rho$ (N)"
    for show in ("lyapunov", "maximum", "contacts_per_period"):
        drawn = draw_chart(plane, show=show)
        low, high = drawn.collections[0].get_clim()
        assert show != "lyapunov" or low == -high
        values = drawn.collections[0].get_array().ravel()
        expected = plane[show].isel(state=0) if "state" in plane[show].dims else plane[show]
        np.testing.assert_allclose(values, expected.transpose("rho", "g").values.ravel())
    with pytest.raises(ValueError, match="chart"):
        draw_chart(ns.sweep(support, "g", [0.001], keep=17, **QUIET))
    with pytest.raises(TypeError, match="ax = 'lyapunov' is no matplotlib Axes"):
        draw_chart(plane, "lyapunov")


def test_basins_show_their_attractors(support: ns.System) -> None:
    found = basins(support, {"x": np.linspace(-0.02, 0.02, 12), "v": np.linspace(-0.2, 0.2, 10)}, **QUIET)
    ax = draw_basins(found)
    words = texts(ax)
    assert len(words) == 2 and {word.split(":")[0] for word in words} == {"period 3", "period 4"}
    assert sum(len(line.get_xdata()) for line in ax.lines) == 7
    np.testing.assert_array_equal(ax.collections[0].get_array().ravel(), found["label"].values.T.ravel())
    assert len({attractor_color(k) for k in range(-1, 9)}) == 10 and attractor_color(-1) == "#FFFFFF"


def test_one_value_has_a_cell_and_any_order_is_drawn_rising(support: ns.System) -> None:
    found = basins(support, {"x": [0.01], "v": [0.0]}, **QUIET)
    corners = draw_basins(found).collections[0].get_coordinates()
    assert np.ptp(corners[..., 0]) > 0 and np.ptp(corners[..., 1]) > 0
    np.testing.assert_allclose(corners[..., 0].mean(), 0.01)
    plane = chart(support, {"g": [0.0012, -0.001, 0.0009], "rho": [0.33]}, **QUIET)
    for show in ("period_number", "maximum"):
        mesh = draw_chart(plane, show=show).collections[0]
        middle = mesh.get_coordinates()[0, :, 0]
        assert (np.diff(middle) > 0).all() and middle.min() < -0.001 and middle.max() > 0.0012
    rising = plane["maximum"].sel(state="x").sortby("g").values.ravel()
    np.testing.assert_allclose(mesh.get_array().ravel(), rising)


def test_shares_add_up_to_all(support: ns.System) -> None:
    along = basin_fractions(support, "g", [0.0012, 0.0014, 0.0018], n_starts=30, box=BOX, **QUIET)
    ax = draw_fractions(along)
    top = max(path.vertices[:, 1].max() for item in ax.collections for path in item.get_paths())
    assert top == pytest.approx(100.0)
    above = draw_fractions(along, y="x")
    assert above.get_ylabel() == "max $x$ (mm)"
    with pytest.raises(ValueError, match="not a state"):
        draw_fractions(along, y="z")


def test_a_density_diagram_shows_the_shares_of_the_bins() -> None:
    from nonsmooth.plot.sweeps import density

    system = ns.models.discontinuous_support(omega=3.69, g=-0.0045)
    swept = ns.sweep(system, "rho", [0.3, 0.32, 0.36], transient=40, keep=20, density=True, bins=10, **QUIET)
    ax = density(swept, y="v")
    shown = np.ma.filled(ax.collections[0].get_array(), 0.0).reshape(10, 3)
    np.testing.assert_allclose(np.nan_to_num(shown), 5.0 * swept["density"].sel(state="v").values.T)
    assert ax.get_xlabel() == r"$\rho$ (N)" and ax.get_ylabel() == "$v$ (mm/s)"
    np.testing.assert_allclose(ax.get_xlim(), (0.29, 0.38))
    with pytest.raises(ValueError, match=r"plot\.density"):
        ns.plot.bifurcation(swept)
    with pytest.raises(ValueError, match="density=True"):
        density(ns.sweep(system, "rho", [0.3], keep=17, **QUIET))
    with pytest.raises(ValueError, match="not a state"):
        density(swept, y="z")


def test_runs_that_diverge_have_a_colour_of_their_own() -> None:
    """x' = -x + x^3: starts within (-1, 1) come to rest, the others grow without end."""
    system = ns.System(
        states=["x", "y"],
        parameters={"a": 1.0},
        period=1.0,
        modes={"only": lambda t, u, p: (-u.x + p.a * u.x**3, -u.y)},
    )
    found = ns.basins(system, {"x": [-1.5, 0.5, 1.5], "y": [0.0, 1.0]}, transient=50, keep=20, progress=False)
    axes = draw_basins(found)
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    assert names == ["equilibrium in only: 33.3 %", "diverged"]
    drawn = axes.collections[0]
    colours = drawn.to_rgba(drawn.get_array()).reshape(2, 3, 4)
    assert (colours[:, 0] == colours[:, 2]).all() and (colours[:, 0] != colours[:, 1]).any()
    assert (colours[:, 0, :3] < 1.0).all()  # not the white of what is not known


def test_attractors_of_one_kind_are_told_apart() -> None:
    assert told_apart(["period 3", "chaos", "period 3"]) == ["period 3 (a)", "chaos", "period 3 (b)"]


def test_each_attractor_has_a_mark_of_its_own(support: ns.System) -> None:
    found = basins(support, {"x": np.linspace(-0.02, 0.02, 12), "v": np.linspace(-0.2, 0.2, 10)}, **QUIET)
    ax = draw_basins(found)
    marks = [line.get_marker() for line in ax.lines]
    assert len(set(marks)) == found.sizes["attractor"]
    assert [len(line.get_xdata()) for line in ax.lines] == found["period_number"].values.tolist()
