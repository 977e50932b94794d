"""Special points of systems whose parts do not feel each other, and their curves, against closed forms of one part."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns

pytestmark = pytest.mark.physics


def grazing_curve(y: dict[str, float], g: float, ends: tuple[float, float]) -> xr.Dataset:
    """Of x, linear below its stop at g; y bounces at an elastic stop of its own, between dampers."""
    c, stop = 0.2, ns.elements.ElasticStop
    system = ns.mechanical(
        np.eye(2),
        np.diag([c, y["damping"]]),
        np.eye(2),
        coordinates=["x", "y"],
        parameters={"w": ends[0] + 0.01, "g": g},
        forcing={"x": lambda t, p: np.cos(p.w * t), "y": lambda t, p: np.cos(p.w * t + y["phase"])},
        elements={
            "touched": stop(at="x", position="g", stiffness=4.0, damping=0.5),
            "other": stop(at="y", position=0.1, stiffness=5.0, damping=y["loss"]),
        },
    )
    branch = ns.continue_orbit(ns.find_orbit(system, progress=False), "g", (0.7 * g, 1.1 * g))
    special = ns.special_points(branch)
    graze = special.isel(special=special["kind"].values.tolist().index("grazing"))
    curve = ns.continue_curve(graze, {"w": ends, "g": (0.2, 6.0)}, step=0.1)
    w = curve["w"].values
    assert curve["g"].values == pytest.approx(1 / np.hypot(1 - w**2, c * w), rel=1e-10)
    return curve


def test_a_touch_passes_the_crossings_of_another_element() -> None:
    """The grazing curve of x is that of one mass alone, g = 1 / |1 - w^2 + i c w|, whatever y does meanwhile.

    Its touch lies before both crossings of y at 0.9, and between them at 1; a crossing passes the section at 1.25."""
    curve = grazing_curve({"damping": 1.0, "phase": 0.5, "loss": 0.0}, 2.8, (0.8, 1.6))
    assert sorted(curve["w"].values[[0, -1]]) == pytest.approx([0.8, 1.6]) and curve.sizes["special"] == 0
    assert curve["ended_because"].values.tolist() == 2 * ["The curve reached the edge of the box."]


def test_a_point_of_two_numbers_is_listed_once() -> None:
    """At a fold of y alone det(I - M) vanishes with and without the contact of x: one grazing_fold."""
    curve = grazing_curve({"damping": 0.1, "phase": 1.0, "loss": 0.3}, 1.9, (0.69, 0.8))
    assert curve["special_kind"].values.tolist().count("grazing_fold") == 2


def test_two_torus_points_within_a_step() -> None:
    """Of two masses apart the multipliers of each have the product exp(-(D - a) T): 1 at D = a, whatever they hit."""
    system = ns.mechanical(
        np.eye(2),
        lambda p: [[p.D - 0.1, 0.0], [0.0, p.D - 0.102]],
        np.diag([1.0, 4.0]),
        coordinates=["x", "y"],
        parameters={"D": 0.3},
        forcing={q: lambda t, p: 0.3 * np.cos(1.5 * t) for q in "xy"},
        elements={"stop": ns.elements.ElasticStop(at="x", position=0.2, stiffness=0.5)},
    )
    special = ns.special_points(ns.continue_orbit(ns.find_orbit(system, progress=False), "D", (-0.4, 0.6)))
    assert special["kind"].values.tolist() == ["neimark_sacker", "neimark_sacker"]
    assert special["D"].values == pytest.approx([0.1, 0.102], abs=1e-9)
