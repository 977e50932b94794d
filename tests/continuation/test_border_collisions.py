"""Branches of maps that meet a border; more of them, with closed forms, in tests/models/test_published_maps.py."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics


def skew(left: float, right: float, step: float = 0.0, mu: float = -0.1) -> ns.Map:
    """Slopes on either side of 0, and how far the map falls there."""
    return ns.Map(
        states=["x"],
        parameters={"left": left, "right": right, "step": step, "mu": mu},
        branches=[
            ns.Branch(lambda u, p: (p.left * u.x + p.mu,), when="x < 0"),
            ns.Branch(lambda u, p: (p.right * u.x + p.mu - p.step,), when="x > 0"),
        ],
    )


def branch_of(system: ns.Map, **options: Any) -> Any:
    return ns.continue_orbit(ns.find_orbit(system, **options), "mu", (-0.5, 0.5))


def test_a_fixed_point_goes_through_the_border():
    branch = branch_of(skew(0.5, -0.8))
    table = ns.special_points(branch)
    assert table.kind.values.tolist() == ["corner"]
    assert table.touched.values.tolist() == ["border_x"]
    assert table.mu.values == pytest.approx([0.0], abs=1e-13)
    x, mu = branch.section.values[:, 0], branch.mu.values
    assert mu[[0, -1]] == pytest.approx([-0.5, 0.5])
    assert x == pytest.approx(np.where(mu < 0, mu / (1 - 0.5), mu / (1 + 0.8)), abs=1e-12)
    off = np.abs(mu) > 1e-12
    multipliers = branch.floquet_multipliers.values.real.ravel()[off]
    assert multipliers == pytest.approx(np.where(mu < 0, 0.5, -0.8)[off], abs=1e-12)
    assert branch.sizes["point"] < 300  # steps in units of the fixed point, not of a range that it has not


def test_the_fixed_point_of_a_map_with_a_jump_ends_at_the_border():
    branch = branch_of(skew(0.5, 0.5, step=0.3))
    assert ns.special_points(branch).mu.values == pytest.approx([0.0], abs=1e-13)
    assert branch.mu.values[-1] == pytest.approx(0.0, abs=1e-13)
    assert "behind it" in str(branch.ended_because.values[-1])


def test_an_orbit_born_at_the_border_begins_there():
    """b < -1 and a b > -1: the orbit of period 2, x = mu (1 + b) / (1 - a b) and mu (1 + a) / (1 - a b)."""
    branch = branch_of(skew(0.5, -1.5, mu=0.1), start={"x": 0.1})
    assert int(branch.period_number) == 2
    assert branch.period_number.attrs["long_name"].startswith("iterates")
    assert float(branch.mu.min()) == pytest.approx(0.0, abs=1e-13)
    mu, x = branch.mu.values[1:], branch.section.values[1:, 0]
    points = np.abs(x / mu - np.array([[-0.5 / 1.75], [1.5 / 1.75]])).min(axis=0)
    assert points == pytest.approx(np.zeros(len(mu)), abs=1e-10)
    assert branch.floquet_multipliers.values[1:].real.ravel() == pytest.approx(np.full(len(mu), -0.75), abs=1e-10)


def test_points_beyond_which_a_map_has_no_values_print_nothing(capfd):
    """LAPACK writes to the terminal by itself where a number is not finite: no Python code may hide that."""
    system = ns.models.square_root_map(lam=0.14578609905744228, mu=0.02)
    branch = ns.continue_orbit(ns.find_orbit(system, start=[-0.05]), "mu", (-0.1, 0.3))
    assert float(branch.mu.min()) == pytest.approx(0.0, abs=1e-13)
    assert "".join(capfd.readouterr()) == ""
