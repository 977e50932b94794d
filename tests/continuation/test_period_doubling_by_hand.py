"""The whole diagram of the logistic map from period 1 to period 4: every variable by its closed form."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns

pytestmark = pytest.mark.physics

LOW, HIGH, FLIPS = 2.9, 3.5, (3.0, 1 + np.sqrt(6))


def iterates(x: np.ndarray, r: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """x, f(x), ... (points, n), and the slope of the n-th iterate."""
    found, slope = [x], np.ones_like(x)
    for _ in range(n):
        slope = slope * r * (1 - 2 * found[-1])
        found.append(r * found[-1] * (1 - found[-1]))
    assert found[-1] == pytest.approx(found[0], abs=1e-10)
    return np.transpose(found[:-1]), slope


@pytest.fixture(scope="module")
def diagram() -> xr.Dataset:
    system = ns.Map(states=["x"], parameters={"r": 2.95}, branches=[ns.Branch(lambda u, p: (p.r * u.x * (1 - u.x),))])
    return ns.bifurcation_diagram(system, "r", (LOW, HIGH), n=31, start={"x": 0.6}, progress=False)


def test_every_point_of_every_branch(diagram: xr.Dataset) -> None:
    r, x, branch = diagram["r"].values, diagram["section"].values[:, 0], diagram["branch"].values
    assert diagram["period_number"].values.tolist() == [1, 2, 4]
    for k, n in enumerate((1, 2, 4)):
        here = branch == k
        points, slope = iterates(x[here], r[here], n)
        assert diagram["returns"].values[here, :n, 0] == pytest.approx(points)
        assert np.isnan(diagram["returns"].values[here, n:]).all()
        assert diagram["maximum"].values[here, 0] == pytest.approx(points.max(axis=1))
        assert diagram["minimum"].values[here, 0] == pytest.approx(points.min(axis=1))
        assert diagram["floquet_multipliers"].values[here, 0] == pytest.approx(slope, abs=1e-7)
        beside = np.abs(np.abs(slope) - 1) > 1e-6  # not at a flip itself
        assert (diagram["stable"].values[here] == (np.abs(slope) < 1))[beside].all()
        assert diagram["period"].values[here] == pytest.approx(np.full(here.sum(), n))
    assert x[branch == 0] == pytest.approx(1 - 1 / r[branch == 0])
    two = r[branch == 1]
    pair = (two + 1 + np.outer([1, -1], np.sqrt(np.maximum((two - 3) * (two + 1), 0)))) / (2 * two)
    assert np.abs(pair - x[branch == 1]).min(axis=0) == pytest.approx(np.zeros(len(two)), abs=1e-7)
    assert not diagram["virtual"].values.any() and not diagram["status"].values.any()


def test_branches_begin_where_their_parents_flip(diagram: xr.Dataset) -> None:
    assert diagram["parent"].values.tolist() == [-1, 0, 1]
    assert set(diagram["special_kind"].values) == {"flip"}
    assert diagram["special_value"].values == pytest.approx(np.repeat(FLIPS, 2), abs=1e-9)
    assert diagram["special_branch"].values.tolist() == [0, 1, 1, 2]
    assert diagram["special_period_number"].values.tolist() == [1, 2, 2, 4]
    at = diagram["special_point"].values
    assert diagram["r"].values[at] == pytest.approx(diagram["special_value"].values)
    assert diagram["branch"].values[at].tolist() == [0, 1, 1, 2]
    assert diagram["special_bounded"].values.all() and int(diagram["complete"]) == 1
    for k, (low, high) in enumerate(((LOW, HIGH), (FLIPS[0], HIGH), (FLIPS[1], HIGH))):
        r = diagram["r"].values[diagram["branch"].values == k]
        assert sorted(r[[0, -1]]) == pytest.approx([low, high], abs=1e-9)
    begun = "The branch begins at the flip."
    assert diagram["ended_because"].values[:, 0].tolist() == ["The branch reached the edge of the range.", begun, begun]
    assert set(diagram["ended_because"].values[:, 1]) == {"The branch reached the edge of the range."}
    table = ns.special_points(diagram)
    assert table["branch"].values.tolist() == [0, 1, 1, 2] and table["period_number"].values.tolist() == [1, 2, 2, 4]
    assert table["r"].values == pytest.approx(np.repeat(FLIPS, 2), abs=1e-9)


def test_the_sweeps_beside_it_are_of_the_attractors(diagram: xr.Dataset) -> None:
    values = diagram["swept_value"].values
    assert values == pytest.approx(np.linspace(LOW, HIGH, 31))
    wanted = 2 ** np.searchsorted(FLIPS, values)
    clear = np.abs(values[:, None] - FLIPS).min(axis=1) > 0.02
    for direction in ("up", "down"):
        one = diagram.sel(direction=direction)
        assert (one["swept_period_number"].values == wanted)[clear].all()
        for k in np.flatnonzero(clear):
            points, n = one["swept_section"].values[k, :, 0], int(wanted[k])
            assert points[1:] == pytest.approx(values[k] * points[:-1] * (1 - points[:-1]), abs=1e-12)
            assert points[n:] == pytest.approx(points[:-n], abs=1e-5)
