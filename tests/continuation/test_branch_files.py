"""A branch saves, loads, and goes on from where it stopped; so does an orbit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import systems

import nonsmooth as ns


def test_branch_goes_on_after_a_file(tmp_path: Path) -> None:
    """Two ranges joined through a file give the special points of one."""
    system = ns.models.discontinuous_support(rho=0.14, g=0.02, omega=3.4)
    orbit = ns.find_orbit(system)
    whole = ns.special_points(ns.continue_orbit(orbit, "omega", (3.0, 6.0)))
    part = ns.continue_orbit(orbit, "omega", (3.2, 4.2))
    for suffix in (".nc", ".zarr"):
        loaded = ns.load(ns.save(part, tmp_path / f"part{suffix}"))
        assert loaded.identical(part)
    joined = ns.continue_orbit(loaded, range=(3.0, 6.0))
    special = ns.special_points(joined)
    assert list(special["kind"].values) == list(whole["kind"].values)
    assert special["omega"].values == pytest.approx(whole["omega"].values, abs=1e-10)
    assert joined.sizes["point"] > part.sizes["point"]
    n = int(np.flatnonzero(np.isclose(joined["omega"].values, part["omega"].values[0], rtol=0, atol=1e-12))[0])
    kept = joined.isel(point=slice(n, n + part.sizes["point"]))
    assert np.array_equal(kept["section"], part["section"])


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


def test_trajectory_closes() -> None:
    orbit = ns.find_orbit(ns.models.discontinuous_support(rho=0.3, omega=3.69, g=-0.0045))
    run = orbit.trajectory()
    assert run["u"].values[-1] == pytest.approx(orbit.u, abs=1e-12)
    assert run["crossing_time"].values == pytest.approx(orbit.crossing_times, abs=1e-12)
    assert run["u"].max("time").values == pytest.approx(orbit.maximum, abs=1e-5)  # samples miss the peaks


def test_orbit_of_the_smoothed_switch() -> None:
    """Its memory, the velocity at the entry into the band, is part of the orbit; eta^2 away from the sharp one."""
    sharp = ns.models.discontinuous_support(rho=0.45, omega=3.69, g=-0.0045)
    orbit, near = ns.find_orbit(sharp), ns.find_orbit(sharp.smoothed(1e-6), transient=200)
    assert near.u == pytest.approx(orbit.u, abs=1e-6)
    assert np.abs(near.floquet_multipliers[:2] - orbit.floquet_multipliers).max() < 1e-2
    run = near.trajectory()
    assert run["u"].values[-1] == pytest.approx(near.u, abs=1e-10)


def test_schema() -> None:
    """Dims and variables that scripts may rely on."""
    orbit = ns.find_orbit(ns.models.discontinuous_support(rho=0.45, omega=3.69, g=-0.0045))
    branch = ns.continue_orbit(orbit, "rho", (0.2, 0.5))
    assert {"point", "state", "multiplier", "special"} <= set(branch.dims)
    for name in ("section", "maximum", "minimum", "period", "floquet_multipliers", "stable", "signature", "clearance",
                 "status"):  # fmt: skip
        assert "point" in branch[name].dims, name
    assert branch["rho"].dims == ("point",) and branch["rho"].attrs["units"] == "N"
    special = ns.special_points(branch)
    assert {"kind", "rho", "section", "floquet_multipliers"} <= set(special.data_vars)
    assert special.sizes["special"] == branch.sizes["special"]
