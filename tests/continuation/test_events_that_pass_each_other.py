"""Branches of three masses with a stop between two of them and friction at the third: its turns pass the impacts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns

pytestmark = pytest.mark.physics
E = ns.elements


def masses(w: float) -> ns.System:
    """A row of three masses between springs."""
    k, loads, swings = [1.25, 2.54, 0.73, 2.0], [1.19, -0.44, -0.83], [0.77, 1.42, 1.26]
    K = np.diag(np.add(k[:-1], k[1:])) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)

    def load(push: float, swing: float) -> Any:
        return lambda t, p: swing * np.cos(p.w * t + 0.7) - push

    return ns.mechanical(
        np.diag([0.73, 1.15, 1.5]),
        0.1 * K,
        K,
        parameters={"w": w},
        forcing={f"q{i + 1}": load(*one) for i, one in enumerate(zip(loads, swings, strict=True))},
        elements={
            "between": E.Stop(at={"q1": 1.0, "q2": -1.0}, position=0.3, restitution=0.3),
            "preload": E.PreloadedSpring(at="q1", preload=0.3, stiffness=1.0),
            "rail": E.Coulomb(at="q3", friction=0.23),
        },
    )


def followed(low: float, high: float) -> tuple[list[str], xr.Dataset]:
    """The special points from ``high`` down to ``low``, and the branch, which reaches both."""
    orbit = ns.find_orbit(masses(high), start={"q1": 0.2, "q2": 0.2, "q3": 0.2}, transient=200)
    branch = ns.continue_orbit(orbit, "w", (low, high))
    assert branch.w.values[[0, -1]] == pytest.approx([low, high], abs=1e-12)
    return [str(kind) for kind in ns.special_points(branch)["kind"].values], branch


@pytest.mark.parametrize(("low", "high"), [(1.3299, 1.3303), pytest.param(1.322, 1.323, marks=pytest.mark.slow)])
def test_a_turn_that_passes_an_impact_is_one_corner(low: float, high: float) -> None:
    """Their instants are equal there, one is first on one side and the other one on the other."""
    special, branch = followed(low, high)
    assert special == ["corner"]
    w = float(ns.special_points(branch)["w"].values[0])
    orders = []
    for beside in (w - 1e-6, w + 1e-6):
        run = ns.simulate(masses(beside), periods=1, transient=200, start={"q1": 0.2, "q2": 0.2, "q3": 0.2})
        t, speed = run.crossing_time.values, np.nan_to_num(run.between_impact_speed.values)
        turns = np.abs(run.u_before.sel(state="v_q3").values) < 1e-12
        apart = (t[speed > 0.0] - t[turns][:, None]).ravel()
        orders.append(apart[np.abs(apart).argmin()])
    assert orders[0] * orders[1] < 0.0
    assert np.abs(orders).max() < 1e-4


@pytest.mark.slow
def test_where_impacts_accumulate_each_has_its_flip_and_its_graze() -> None:
    """Before rest ever slower impacts are added: each by a graze, behind which the motion has doubled its period."""
    special, branch = followed(1.3303, 1.33045)
    assert set(special) == {"flip", "grazing"}
    assert special[-8:] == ["flip", "grazing"] * 4
    w = ns.special_points(branch)["w"].values[-7::2]
    assert np.diff(w)[1:] / np.diff(w)[:-1] == pytest.approx(1 / 0.3, rel=0.05)  # as speeds grow: 1 / restitution
