"""A branch is the same in any unit of length: its special points, and their kinds."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics


def points(length: float, w: float, limits: tuple[float, float]) -> tuple[list[str], list[float]]:
    """Those of a mass that rubs and meets an elastic stop under two harmonics, its states in a unit of length."""
    system = ns.mechanical(
        1.0,
        0.2877,
        1.0192,
        parameters={"w": w},
        coordinates=["q"],
        scale={"q": length, "v_q": length},
        elements={
            "rub": ns.elements.Coulomb(at="q", friction=0.3128 * length),
            "soft": ns.elements.ElasticStop(at="q", position=0.2045 * length, stiffness=11.23),
        },
        forcing={"q": lambda t, p: 1.189 * length * (np.cos(p.w * t) + 0.6734 * np.cos(3 * p.w * t + 0.7))},
    )
    branch = ns.continue_orbit(ns.find_orbit(system, progress=False), "w", limits)
    return branch["special_kind"].values.tolist(), branch["special_value"].values.tolist()


@pytest.mark.parametrize(
    ("w", "limits", "number"),
    [(0.3992, (0.3986, 0.3994), 4), pytest.param(0.645, (0.397, 0.645), 30, marks=pytest.mark.slow)],
)
def test_special_points_in_metres_and_millimetres(w: float, limits: tuple[float, float], number: int) -> None:
    (kinds, values), (others, there) = (points(length, w, limits) for length in (1.0, 1e3))
    assert len(kinds) >= number and kinds == others and values == pytest.approx(there, abs=1e-9)
