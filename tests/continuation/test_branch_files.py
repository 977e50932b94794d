"""A branch saves, loads, and goes on from where it stopped; so does an orbit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import systems
import xarray as xr

import nonsmooth as ns


def test_branch_goes_on_after_a_file(tmp_path: Path) -> None:
    """Two ranges joined through a file give the special points of one."""
    system = ns.models.discontinuous_support(rho=0.14, g=0.02, omega=3.5)
    orbit = ns.find_orbit(system)
    whole = ns.special_points(ns.continue_orbit(orbit, "omega", (3.3, 4.3)))
    part = ns.continue_orbit(orbit, "omega", (3.4, 4.0))
    assert 0 < part.sizes["special"] < whole.sizes["special"]
    for suffix in (".nc", ".zarr"):
        loaded = ns.load(ns.save(part, tmp_path / f"part{suffix}"))
        assert loaded.identical(part)
    joined = ns.continue_orbit(loaded, range=(3.3, 4.3))
    special = ns.special_points(joined)
    assert list(special["kind"].values) == list(whole["kind"].values)
    assert special["omega"].values == pytest.approx(whole["omega"].values, abs=1e-10)
    assert joined.sizes["point"] > part.sizes["point"]
    n = int(np.flatnonzero(np.isclose(joined["omega"].values, part["omega"].values[0], rtol=0, atol=1e-12))[0])
    kept = joined.isel(point=slice(n, n + part.sizes["point"]))
    assert np.array_equal(kept["section"], part["section"])
    omega, size = joined["omega"].values, part.sizes["point"]
    assert omega[n - 1] < omega[n] and omega[n + size] > omega[n + size - 1]  # each side begins where the part ends


def test_too_few_points_and_on(tmp_path: Path) -> None:
    orbit = ns.find_orbit(ns.models.discontinuous_support(rho=0.45, omega=3.69, g=-0.0045))
    few = ns.continue_orbit(orbit, "rho", (0.2, 0.5), points=5)
    assert "number of points" in str(few["ended_because"].values[0])
    rest = ns.continue_orbit(few)
    assert float(rest["rho"].min()) == pytest.approx(0.2) and float(rest["rho"].max()) == pytest.approx(0.5)


def test_orbit_there_and_back(tmp_path: Path) -> None:
    for orbit in (
        ns.find_orbit(ns.models.impact_oscillator()),
        ns.find_orbit(systems.belt(), start={"x": 0.5, "v": 0.2}),
    ):
        path = ns.save(orbit.to_dataset(), tmp_path / f"{orbit.period_number}.nc")
        back = ns.Orbit.from_dataset(ns.load(path))
        assert back.system == orbit.system and back.signature == orbit.signature
        assert np.array_equal(back.u, orbit.u) and np.array_equal(back.monodromy_matrix, orbit.monodromy_matrix)
        assert back.stable == orbit.stable and back.mode == orbit.mode
        again = ns.find_orbit(back.system, **back.options)  # the record of how it was found finds it again
        assert np.array_equal(again.u, orbit.u)


def test_trajectory_closes() -> None:
    orbit = ns.find_orbit(ns.models.discontinuous_support(rho=0.3, omega=3.69, g=-0.0045))
    run = orbit.trajectory()
    assert run["u"].values[-1] == pytest.approx(orbit.u, abs=1e-12)
    assert run["crossing_time"].values == pytest.approx(orbit.crossing_times, abs=1e-12)
    assert run["u"].max("time").values == pytest.approx(orbit.maximum, abs=1e-5)  # samples miss the peaks


def test_trajectory_from_an_impact() -> None:
    """The forcing shifted by the instant of the impact puts the impact on the section: the motion begins behind it."""
    system = ns.models.impact_oscillator()
    at = float(ns.find_orbit(system).crossing_times[0])
    shifted = ns.System(
        states=["x", "v"],
        parameters={"A": 1.0, "c": 0.1, "e": 0.8, "phi": at},
        modes={"motion": lambda t, u, p: (u.v, p.A * np.cos(t + p.phi) - u.x - p.c * u.v)},
        indicators={"stop": lambda t, u, p: u.x - 1.0},
        transitions=[ns.Transition("motion", "motion", when="stop > 0", reset=lambda t, u, p: (u.x, -p.e * u.v))],
    )
    orbit = ns.find_orbit(shifted)
    run = orbit.trajectory()
    assert orbit.crossing_times == pytest.approx([0.0], abs=1e-12) and orbit.u[0] == pytest.approx(1.0, abs=1e-12)
    assert run["u"].values[0, 1] == pytest.approx(-0.8 * orbit.u[1], abs=1e-12)
    before = run["u"].values[run["time"].values < orbit.period][-1]
    assert before == pytest.approx(orbit.u, abs=2 * orbit.period / 1024)  # a sample before the next impact
    assert float(run["u"].max()) == pytest.approx(float(orbit.maximum.max()), abs=1e-5)


def test_orbit_of_the_smoothed_switch() -> None:
    """Its memory, the velocity at the entry into the band, is part of the orbit; eta^2 away from the sharp one."""
    sharp = ns.models.discontinuous_support(rho=0.45, omega=3.69, g=-0.0045)
    orbit, near = ns.find_orbit(sharp), ns.find_orbit(sharp.smoothed(1e-6), transient=200)
    assert near.u == pytest.approx(orbit.u, abs=1e-6)
    assert np.abs(near.floquet_multipliers[:2] - orbit.floquet_multipliers).max() < 1e-2
    run = near.trajectory()
    assert run["u"].values[-1] == pytest.approx(near.u, abs=1e-10)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("layout", 7),
        ("layout", -1),
        ("mode", 5),
        ("unknowns", np.nan),
        ("tangent", np.nan),
        ("ended", 99),
        ("special_point", -3),
        ("special_indicator", "elsewhere"),
        ("clearance", None),
        ("stable", None),
    ],
)
def test_damaged_branch(branch: xr.Dataset, name: str, value: object) -> None:
    """An index that points nowhere, a number that is lost, a variable that is gone: refused, never read as another."""
    edited = branch.drop_vars(name) if value is None else branch.assign({name: xr.full_like(branch[name], value)})
    with pytest.raises(ValueError, match="damaged and cannot be read back"):
        ns.continue_orbit(edited, range=(0.1, 0.6))


@pytest.mark.parametrize(
    "layouts", ["[]", "[[[0, 0, 0, 0], [0, -1, -1, 0]]]", "[[[1, 9, 0, 0], [0, -1, -1, 0]]]", "no list"]
)
def test_damaged_signature(branch: xr.Dataset, layouts: str) -> None:
    """A signature that the system's transitions do not allow."""
    edited = branch.assign_attrs(layouts=layouts)
    with pytest.raises(ValueError, match="this branch is damaged"):
        ns.continue_orbit(edited, range=(0.1, 0.6))
    with pytest.raises(ValueError, match="this special point is damaged"):
        ns.continue_orbit(ns.special_points(edited).isel(special=0))
    orbit = ns.find_orbit(ns.models.discontinuous_support(rho=0.45, omega=3.69, g=-0.0045))
    with pytest.raises(ValueError, match="this orbit is damaged"):
        ns.Orbit.from_dataset(orbit.to_dataset().assign_attrs(layouts=layouts))


@pytest.fixture(scope="module")
def branch() -> xr.Dataset:
    orbit = ns.find_orbit(ns.models.discontinuous_support(rho=0.45, omega=3.69, g=-0.0045))
    return ns.continue_orbit(orbit, "rho", (0.2, 0.5))


def test_schema(branch: xr.Dataset) -> None:
    """Dims and variables that scripts may rely on."""
    assert {"point", "state", "multiplier", "special"} <= set(branch.dims)
    for name in (
        "section",
        "maximum",
        "minimum",
        "period",
        "floquet_multipliers",
        "stable",
        "signature",
        "clearance",
        "status",
    ):
        assert "point" in branch[name].dims, name
    assert branch["rho"].dims == ("point",) and branch["rho"].attrs["units"] == "N"
    special = ns.special_points(branch)
    assert {"kind", "rho", "section", "floquet_multipliers"} <= set(special.data_vars)
    assert special.sizes["special"] == branch.sizes["special"]


def test_multipliers_change_little_from_point_to_point() -> None:
    """A step is made shorter where multipliers move by more than 0.15 on the Riemann sphere, straight or not."""
    system = ns.models.discontinuous_support(rho=0.14, g=0.02, omega=3.4)
    branch = ns.continue_orbit(ns.find_orbit(system), "omega", (3.0, 7.0))
    mu, signature = branch["floquet_multipliers"].values, branch["signature"].values
    a, b = mu[:-1], mu[1:]
    moved = (np.abs(a - b) / np.sqrt((1 + np.abs(a) ** 2) * (1 + np.abs(b) ** 2))).max(axis=1)
    steps = (signature[1:] == signature[:-1]) & (np.abs(np.diff(branch["omega"].values)) > 1e-5)
    assert steps.sum() > 100
    assert moved[steps].max() <= 0.15
