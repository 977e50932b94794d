"""Pictures of what `propagate` gives: the bands are the quantiles of closed forms."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics

C, EDGES = 0.4, [0.1, 0.5, 0.9]
DRAWN: dict[str, Any] = {
    "settings": {"F": (1.0, 0.1), "G": (0.0, 0.3)},
    "draws": 8,
    "quantiles": EDGES,
    "progress": False,
}


def oscillator() -> ns.System:
    """A mass on a spring under a harmonic and a constant force."""
    return ns.mechanical(
        1.0,
        C,
        1.0,
        parameters={"F": 1.0, "G": 0.0, "w": 2.0},
        coordinates=["q"],
        forcing={"q": lambda t, p: p.G + p.F * np.cos(p.w * t)},
    )


def gain(w: Any) -> Any:
    return 1 / np.hypot(1 - w**2, C * w)


def corners(ax: Any, x: float) -> tuple[float, float]:
    """The band at an abscissa, as it is drawn."""
    (band,) = (one for one in ax.collections if str(one.get_label()).endswith("% band"))
    assert band.get_label() == "80 % band"
    places = np.concatenate([path.vertices for path in band.get_paths()])
    heights = places[np.isclose(places[:, 0], x), 1]
    return float(heights.min()), float(heights.max())


@pytest.fixture(autouse=True)
def closed() -> Any:
    yield
    plt.close("all")


def test_the_band_of_an_amplitude_is_that_of_the_amplitude() -> None:
    """A constant force moves both extremes and no amplitude: the band is not that of the extremes."""
    values = np.array([0.5, 1.0, 1.5])
    found = ns.propagate({}, ns.frequency_response, oscillator(), values, parameter="w", **DRAWN)
    swept = ns.propagate({}, ns.sweep, oscillator(), "w", values, **DRAWN)
    ax, other = ns.plot.frequency_response(found), ns.plot.frequency_response(swept)
    highest = ns.plot.frequency_response(found, quantity="maximum")
    force, constant = found["drawn_F"].values, found["drawn_G"].values
    for w in values:
        ends = np.quantile(gain(w) * force, EDGES)[[0, -1]]
        assert corners(ax, w) == pytest.approx(ends, rel=1e-6)
        assert corners(other, w) == pytest.approx(ends, rel=1e-6)
        assert corners(highest, w) == pytest.approx(np.quantile(gain(w) * force + constant, EDGES)[[0, -1]], rel=1e-6)


def test_the_band_of_a_run_is_that_of_its_instants() -> None:
    """A spring that is let go against a constant force of G, from rest: q = G (1 - exp(-a t) (...))."""
    options = DRAWN | {"settings": {"G": (1.0, 0.1)}}
    system = oscillator().with_parameters(F=0.0)
    run = ns.propagate({}, ns.simulate, system, duration=8.0, samples=9, **options)
    a, w = C / 2, np.sqrt(1 - C**2 / 4)
    ax = ns.plot.time_history(run)
    for t in run["time"].values[1:]:
        step = 1 - np.exp(-a * t) * (np.cos(w * t) + a / w * np.sin(w * t))
        assert corners(ax, t) == pytest.approx(np.quantile(run["drawn_G"] * step, EDGES)[[0, -1]], rel=1e-6)


def test_a_branch_has_bands_and_a_special_point_a_bar() -> None:
    """The mass touches the stop at 1 where the amplitude is 1: w as a function of F in closed form."""
    stop = ns.elements.ElasticStop(at="q", position=1.0, stiffness=3.0)
    system = ns.mechanical(
        1.0,
        C,
        1.0,
        parameters={"F": 1.0, "w": 3.0},
        coordinates=["q"],
        elements={"stop": stop},
        forcing={"q": lambda t, p: p.F * np.cos(p.w * t)},
    )
    options = {**DRAWN, "settings": {"F": (1.0, 0.03)}}
    found = ns.propagate({}, ns.continue_orbit, ns.find_orbit(system, progress=False), "w", (1.2, 3.0), **options)
    assert list(found["special_kind"].values[:1]) == ["grazing"]
    ax = ns.plot.branch(found, quantity="amplitude")
    touches = [np.sqrt(max(np.roots([1, C**2 - 2, 1 - F**2]).real)) for F in found["drawn_F"].values]
    ends = np.quantile(touches, EDGES)[[0, -1]]
    bars = [path.vertices[:, 0] for one in ax.collections if str(one.get_label())[0] == "_" for path in one.get_paths()]
    assert any(bar == pytest.approx(ends, rel=1e-5) for bar in bars)
    far = found["w"].values > 1.02 * ends[1]
    for w in found["w"].values[far][1:-1]:
        assert corners(ax, w) == pytest.approx(np.quantile(gain(w) * found["drawn_F"], EDGES)[[0, -1]], rel=1e-3)


def test_shares_of_a_period_are_drawn_over_the_plane() -> None:
    grid = {"w": [1.5, 2.0, 2.5], "F": [0.5, 1.0]}
    options = {**DRAWN, "settings": {"G": (0.0, 0.3)}, "draws": 2}
    found = ns.propagate({}, ns.chart, oscillator(), grid, **options)
    ax = ns.plot.chart(found.sel(period_value=1), show="period_number_probability")
    (mesh,) = (one for one in ax.collections if one.get_array() is not None)
    assert (mesh.get_array() == 1.0).all() and mesh.get_array().size == 6


def test_what_is_certain_has_no_band_and_no_legend() -> None:
    known = DRAWN | {"settings": {"w": (2.0, 0.0)}}
    ax = ns.plot.time_history(ns.propagate({}, ns.simulate, oscillator(), duration=2.0, samples=5, **known))
    assert ax.get_legend() is None and ax.get_legend_handles_labels()[1] == []
