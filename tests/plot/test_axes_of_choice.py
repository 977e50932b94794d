"""Figures over axes that were chosen: exchanged states show the same points, mirrored, under exchanged labels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from tests.plot.test_identification import motion

import nonsmooth as ns

QUIET = {"progress": False}
STRIKES = {"g": 0.0009, "rho": 0.33, "omega": 11.15}


def support(**parameters: float) -> ns.System:
    return ns.models.discontinuous_support(**(parameters or STRIKES))


def saddle() -> ns.System:
    """x' = y / 3, y' = (2 x - y) / 3, under a force."""
    return ns.System(
        states=["x", "y"],
        parameters={"w": 2.0},
        modes={"one": lambda t, u, p: (u.y / 3 + np.cos(p.w * t), (2 * u.x - u.y) / 3)},
    )


def manifolds() -> Any:
    return ns.manifolds(ns.find_orbit(saddle(), period_number=1, transient=0, max_period=1), length=2.0, distance=0.3)


#: Of a figure of two states: its result, and these states.
PLANES: dict[str, tuple[Callable[[], Any], tuple[str, str]]] = {
    "phase_portrait": (lambda: ns.simulate(support(), periods=3, transient=20), ("x", "v")),
    "section": (lambda: ns.poincare(support(), n=8, transient=20), ("x", "v")),
    "orbit": (lambda: ns.find_orbit(support(g=0.02, rho=0.3, omega=4.5)), ("x", "v")),
    "manifolds": (manifolds, ("x", "y")),
    "comparison_phase_portrait": (motion, ("x", "v")),
    "comparison_section": (motion, ("x", "v")),
}


def points_of(ax: Any) -> np.ndarray:
    """All that is drawn over the data, (N, 2), in order."""
    found = [np.column_stack(line.get_data()) for line in ax.lines if line.get_transform() == ax.transData]
    found += [np.asarray(one.get_offsets()) for one in ax.collections if len(one.get_offsets())]
    whole = np.concatenate([np.asarray(one, float).reshape(-1, 2) for one in found])
    whole = whole[np.isfinite(whole).all(axis=1)]
    return whole[np.lexsort(whole.T)]


@pytest.mark.parametrize("name", PLANES)
def test_exchanged_axes_show_a_mirrored_picture(name: str) -> None:
    make, (first, second) = PLANES[name]
    draw, result = getattr(ns.plot, name), make()
    one, other = draw(result), draw(result, x=second, y=first)
    plain, mirrored = points_of(one), points_of(other)[:, ::-1]
    assert len(plain) > 2 and mirrored[np.lexsort(mirrored.T)] == pytest.approx(plain)
    assert (one.get_xlabel(), one.get_ylabel()) == (other.get_ylabel(), other.get_xlabel())
    plt.close("all")


def test_a_spectrum_up_to_a_multiple_of_a_state() -> None:
    result = ns.amplitude_spectrum(support(), transient=100, **QUIET)
    order, v = result["order"].values, result["amplitude"].sel(state="v").values
    for highest in (1.5, 4.0):
        ax = ns.plot.amplitude_spectrum(result, y="v", highest=highest)
        (drawn,) = (line for line in ax.lines if line.get_marker() == "o" or len(line.get_xdata()) > 3)
        some = (order > 1e-9) & (order <= highest)
        x, y = drawn.get_data()
        assert np.max(x) <= highest and set(np.round(x, 9)) <= set(np.round(order[some], 9))
        assert np.max(y) == pytest.approx(v[some].max())
    plt.close("all")


def test_special_points_may_be_left_out_and_multipliers_seen_from_further_away() -> None:
    orbit = ns.find_orbit(support(g=0.02, rho=0.14, omega=4.5))
    branch = ns.continue_orbit(orbit, "omega", (3.5, 4.6))
    assert branch.sizes["special"] > 0
    marked, plain = ns.plot.branch(branch), ns.plot.branch(branch, special=False)

    def marks(ax: Any) -> int:
        return sum(line.get_marker() not in ("None", "", None) for line in ax.lines) + len(ax.collections)

    assert marks(marked) > marks(plain) == 0
    for limit in (1.5, 3.0):
        ax = ns.plot.multipliers(orbit, limit=limit)
        assert (*ax.get_xlim(), *ax.get_ylim()) == pytest.approx((-limit, limit, -limit, limit))
    plt.close("all")


def test_an_animation_of_other_states() -> None:
    """A free oscillator x = cos t over its speed, beside x in time."""
    system = ns.mechanical(1.0, 0.0, 1.0, coordinates=["x"], parameters={})
    run = ns.simulate(system, duration=4 * np.pi, start={"x": 1.0})
    moving = ns.animate(run, x="v_x", y="x", history="x", seconds=1.0, rate=10, pixels=360)
    for k in (1, 7):
        moving.draw(k)
        t = 4 * np.pi * k / 10
        plane, over = moving._dots
        assert [float(v[0]) for v in plane.get_data()] == pytest.approx([-np.sin(t), np.cos(t)], abs=1e-9)
        assert [float(v[0]) for v in over.get_data()] == pytest.approx([t, np.cos(t)], abs=1e-9)
