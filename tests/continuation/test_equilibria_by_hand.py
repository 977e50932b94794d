"""Special points of equilibria against closed forms."""

from __future__ import annotations

import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics


def test_two_hopf_points_within_a_step() -> None:
    """q'' + (D - a) q' + k q + q^3 = 0 for two masses apart: at D = a of each, however near to each other."""
    system = ns.System(
        states=["x", "y", "v", "w"],
        parameters={"D": 0.0},
        modes={
            "all": lambda t, u, p: (
                u.v,
                u.w,
                -u.x - u.x**3 - (p.D - 0.1) * u.v,
                -4 * u.y - u.y**3 - (p.D - 0.101) * u.w,
            )
        },
    )
    branch = ns.continue_equilibrium(system, "D", (-1.0, 1.0))
    special = ns.special_points(branch)
    assert special["kind"].values.tolist() == ["hopf", "hopf"]
    assert special["D"].values == pytest.approx([0.1, 0.101], abs=1e-10)
