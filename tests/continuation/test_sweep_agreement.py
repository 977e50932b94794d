"""Branches against the brute force of `sweep`: where both must agree, they agree to 1e-9."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

TRANSIENT = 500


@pytest.mark.slow
def test_section_points_of_figure_11_lie_on_the_branches() -> None:
    """Of the sweep's periodic points at least 60 % qualify: the branch's period number and crossings, and multipliers
    that have settled them, mu^transient < 1e-8."""
    system = ns.models.discontinuous_support(omega=3.69, g=-0.0045)
    values = np.linspace(0.2, 0.5, 61)
    sweep = ns.sweep(system, "rho", values, direction="down", transient=TRANSIENT, progress=False)
    branches = {1: ns.continue_orbit(ns.find_orbit(system.with_parameters(rho=0.45)), "rho", (0.2, 0.5))}
    for n in (1, 2):
        special = ns.special_points(branches[n])
        flips = np.flatnonzero(special["kind"].values == "flip")
        branches[2 * n] = ns.continue_orbit(special.isel(special=int(flips[-1])))
    periodic = np.flatnonzero((sweep["period_number"].values > 0) & (sweep["status"].values == 0))
    qualified = 0
    for i in periodic:
        n = int(sweep["period_number"][i])
        if n not in branches:
            continue
        branch, rho = branches[n], float(values[i])
        points = sweep["section"].values[i]
        stable = branch.isel(point=np.flatnonzero(branch["stable"].values))
        k = int(np.argmin(np.abs(stable["rho"].values - rho)))
        if abs(float(stable["rho"][k]) - rho) > 0.02:
            continue
        orbit = ns.find_orbit(
            system.with_parameters(rho=rho), start=stable["section"].values[k], period_number=n, transient=0
        )
        mu = float(np.abs(orbit.floquet_multipliers).max())
        same = np.isclose(orbit.crossings_per_period, float(sweep["crossings_per_period"][i]))
        if not same or not mu ** (TRANSIENT / n) < 1e-8:
            continue
        gap = np.abs((points - orbit.u) / [1e-3, 1e-2]).max(axis=1).min() * 1e-2
        if gap > 1e-3:  # another orbit of this period (two coexist between the folds near 0.32)
            continue
        assert gap < 1e-9, (rho, n)
        qualified += 1
    print(f"\n{qualified} of {len(periodic)} periodic points qualify")
    assert qualified >= 0.6 * len(periodic)
