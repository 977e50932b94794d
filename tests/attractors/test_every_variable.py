"""Every variable of ``basins`` and ``basin_fractions`` of a map whose basins are told by the sign of x - c."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics

SCALE = {"x": 2.0, "y": 1.0, "z": 4.0}


@pytest.fixture(scope="module")
def valleys() -> ns.System:
    """d = x - c grows to 1 or falls to -1, with the multiplier 1/2 there; y and z die out, four and eight times."""
    return ns.Map(
        states={"x": "m", "y": "", "z": ""},
        parameters={"c": 0.0},
        branches=[ns.Branch(lambda u, p: (u.x + 0.25 * ((u.x - p.c) - (u.x - p.c) ** 3), u.y / 4, u.z / 8))],
        scale=SCALE,
    )


def test_a_plane_of_two_valleys(valleys: ns.System) -> None:
    """Of 40 columns 0.1 apart 19 lie at x < 0, and the nearest on either side at 0.05; z = 0.5 everywhere."""
    plane = {"x": -1.85 + 0.1 * np.arange(40), "y": np.linspace(-1, 1, 41)}
    found = ns.basins(valleys, plane, fixed={"z": 0.5}, progress=False)
    assert found["label"].values.tolist() == [[int(x < 0)] * 41 for x in plane["x"]]
    assert not found["status"].values.any()
    assert (found["x"].values, found["y"].values) == (pytest.approx(plane["x"]), pytest.approx(plane["y"]))
    assert (float(found["z"]), float(found["c"])) == (0.5, 0.0)
    # the attractors, by their shares
    points = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    for name in ("section", "section_points", "maximum", "minimum"):
        assert found[name].values == pytest.approx(points, abs=1e-7)
    assert found["point_attractor"].values.tolist() == found["attractor"].values.tolist() == [0, 1]
    for name, value in (("period_number", 1), ("confirmed", 1), ("chaotic", 0), ("name", "period 1")):
        assert found[name].values.tolist() == [value] * 2
    for name, value in (("multiplier", 0.5), ("lyapunov", np.log(0.5)), ("lyapunov_error", 0.0)):
        assert found[name].values == pytest.approx([value] * 2, abs=1e-6)
    share = np.array([21, 19]) / 40
    assert found["fraction"].values == pytest.approx(share)
    assert found["fraction_error"].values == pytest.approx(np.sqrt(share * (1 - share) / (40 * 41)))
    over = np.hypot(1.05 / SCALE["x"], 0.5 / SCALE["z"])  # from +-1 beyond 0, and from z = 0 into the plane
    assert found["minimal_shock"].values == pytest.approx([over] * 2)
    # the picture: boxes of 5 x 5, 8 columns of them, of which one holds the boundary behind its fourth line
    mixed = -(0.8 * np.log(0.8) + 0.2 * np.log(0.2))
    assert (float(found["entropy"]), float(found["boundary_entropy"])) == pytest.approx((mixed / 8, mixed))
    assert float(found["boundary_dimension"]) == 1.0
    steps = found["distance"].values
    assert steps.tolist() == [1, 2, 4]
    assert found["uncertain"].values == pytest.approx(2 * steps / (40 - 2 * steps))
    n = int(found["n_starts_99"])
    assert sum((1 - share) ** n) <= 0.01 < sum((1 - share) ** (n - 1))


def test_shares_over_the_place_of_the_ridge(valleys: ns.System) -> None:
    """Of x between -1 and 1 the part beyond c is (1 - c) / 2."""
    box = {"x": (-1, 1), "y": (-1, 1), "z": (-1, 1)}
    found = ns.basin_fractions(valleys, "c", [-0.5, 0.0, 0.5], n_starts=400, box=box, progress=False)
    right = found["section"].sel(state="x").values > found["c"].values[:, None]
    assert right.sum(axis=1).tolist() == [1, 1, 1] and (right == right[0]).all()  # one number each, all along
    share = found["fraction"].values[right]
    assert share == pytest.approx((1 - found["c"].values) / 2, abs=0.08)
    assert found["fraction"].values.sum(axis=1) == pytest.approx(np.ones(3))
    assert found["fraction_error"].values[right] == pytest.approx(np.sqrt(share * (1 - share) / 400))
    for name in ("section", "maximum", "minimum"):
        x = found[name].sel(state="x").values
        assert x == pytest.approx(found["c"].values[:, None] + np.where(right, 1.0, -1.0), abs=1e-6)
        assert found[name].sel(state=["y", "z"]).values == pytest.approx(np.zeros((3, 2, 2)), abs=1e-9)
    for name, value in (("not_converged", 0.0), ("diverged", 0.0), ("failed", 0.0)):
        assert found[name].values.tolist() == [value] * 3
    for name, value in (("period_number", 1), ("chaotic", 0), ("name", "period 1")):
        assert found[name].values.tolist() == [[value] * 2] * 3
    for name, value in (("lyapunov", np.log(0.5)), ("lyapunov_error", 0.0)):
        assert found[name].values == pytest.approx(np.full((3, 2), value), abs=1e-6)
    for n, shares in zip(found["n_starts_99"].values, found["fraction"].values, strict=True):
        assert sum((1 - shares) ** int(n)) <= 0.01 < sum((1 - shares) ** (int(n) - 1))
