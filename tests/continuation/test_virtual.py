"""Branches kept on beyond a graze, with the signature they have: virtual orbits against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import reference_values as known
import xarray as xr

import nonsmooth as ns

support = ns.models.discontinuous_support


def amplitude(v: np.ndarray, c: float = 0.1, e: float = 0.8, d: float = 1.0) -> np.ndarray:
    """A of the orbits of problem A with one impact of speed v per period, in closed form; v may be negative.

    With the response (r, r') at the impact, z+ = (d - r, -e v - r') flows to z- = (d - r, v - r')."""
    T, w = 2 * np.pi, np.sqrt(1 - c * c / 4)
    E, cos, sin = np.exp(-c * T / 2), np.cos(w * T), np.sin(w * T)
    flow = np.array([[cos + c / (2 * w) * sin, sin / w], [-sin / w, cos - c / (2 * w) * sin]]) * E
    found = []
    for speed in v:
        right = flow @ np.array([d, -e * speed]) - np.array([d, speed])
        found.append(c * np.hypot(*np.linalg.solve(flow - np.eye(2), right)))
    return np.array(found)


@pytest.fixture(scope="module")
def impacts() -> xr.Dataset:
    return ns.continue_orbit(ns.find_orbit(ns.models.impact_oscillator()), "A", (0.02, 1.2), virtual=True)


def test_impacting_branch_through_speed_zero(impacts: xr.Dataset) -> None:
    """The branch is smooth in the impact speed; where that is negative the orbit is virtual."""
    alone = impacts["contacts_per_period"].values == 1  # all but the graze itself, kept without its impact
    assert (~alone).sum() == 1
    speed = -impacts["unknowns"].values[alone, 4] / 0.8
    assert impacts["A"].values[alone] == pytest.approx(amplitude(speed), abs=1e-10)
    assert speed.min() < -1.0 < 1.0 < speed.max()
    assert (impacts["virtual"].values[alone] == (speed < 0)).all()
    assert np.diff(speed).max() < 0 or np.diff(speed).min() > 0
    special = ns.special_points(impacts)
    found = {str(kind): float(A) for kind, A in zip(special["kind"].values, special["A"].values, strict=True)}
    assert found["grazing"] == pytest.approx(0.1, abs=1e-12)
    # A negative e v is v with an impact that gains speed: det M = e^2 exp(-c T) there too.
    tame = alone & (np.abs(impacts["floquet_multipliers"].values).max(axis=1) < 1e2)
    product = np.prod(impacts["floquet_multipliers"].values[tame], axis=1)
    assert np.allclose(product, 0.64 * np.exp(-0.1 * 2 * np.pi), rtol=1e-10)


def test_without_the_option_no_orbit_is_virtual() -> None:
    branch = ns.continue_orbit(ns.find_orbit(ns.models.impact_oscillator()), "A", (0.02, 1.2))
    assert not branch["virtual"].any()


@pytest.mark.parametrize("way", ["orbit", "row", "branch"])
def test_motion_without_contact_beyond_the_support(way: str) -> None:
    """The linear response goes on between both grazes of Fig. 9, marked virtual exactly there."""
    rho, g, limits = 0.14, 0.02, (3.0, 7.0)
    orbit = ns.find_orbit(support(rho=rho, g=g, omega=3.3))
    if way == "orbit":
        branch = ns.continue_orbit(orbit, "omega", limits, virtual=True)
    else:
        plain = ns.continue_orbit(orbit, "omega", limits)
        special = ns.special_points(plain)
        first = int(np.flatnonzero(special["kind"].values == "grazing")[0])
        if way == "row":
            branch = ns.continue_orbit(special.isel(special=first), virtual=True)
        else:  # one that was followed to the edge of a narrow range goes on
            short = ns.continue_orbit(orbit, "omega", (3.2, 3.5))
            branch = ns.continue_orbit(short, range=limits, virtual=True)
    assert (branch["contacts_per_period"] == 0).all() and branch["omega"].values[[0, -1]] == pytest.approx(limits)
    for k in range(0, branch.sizes["point"], 7):
        p = {**known.TABLE_1, "rho": rho, "g": g, "omega": float(branch["omega"][k])}
        assert branch["section"].values[k] == pytest.approx(known.steady_state(p), abs=1e-10)
    low, high = known.grazing_frequencies(rho, g)
    omega, virtual = branch["omega"].values, branch["virtual"].values
    assert (virtual == ((omega > low + 1e-12) & (omega < high - 1e-12))).all() and virtual.any()
    rows = ns.special_points(branch)
    assert list(rows["kind"].values) == ["grazing", "grazing"]
    assert rows["omega"].values == pytest.approx([low, high], abs=1e-10)
    assert (rows["grazing"].values == "persistence").all() and not rows["virtual"].any()


@pytest.mark.parametrize("c_s", [0.6, pytest.param(0.0, marks=pytest.mark.slow)])
def test_virtual_contact_goes_round_or_closes(c_s: float) -> None:
    """A contact of negative length is reached through zero; without damper the branch closes, with it it goes round."""
    orbit = ns.find_orbit(support(rho=0.14, g=0.02, c_s=c_s, omega=4.5), period_number=1)
    branch = ns.continue_orbit(orbit, "omega", (3.0, 7.0), virtual=True)
    times = branch["unknowns"].values[:, [2, 5]]
    length = times[:, 1] - times[:, 0]
    contact = np.isfinite(length)
    assert (branch["virtual"].values[contact] == (length[contact] < 0)).all() and branch["virtual"].any()
    assert all("came back" in str(text) for text in branch["ended_because"].values)
    special = ns.special_points(branch)
    grazes = np.unique(special["omega"].values[special["kind"].values == "grazing"].round(9))
    assert grazes == pytest.approx(np.sort(known.grazing_frequencies(0.14, 0.02)), abs=1e-9)


def test_virtual_branch_saves_and_is_drawn(impacts: xr.Dataset, tmp_path: Any) -> None:
    path = ns.save(impacts, tmp_path / "virtual.nc")
    assert ns.load(path).identical(impacts)
    ax = ns.plot.branch(impacts, y="x")
    styles = {line.get_linestyle() for line in ax.get_lines()}
    assert ":" in styles and "-" in styles
