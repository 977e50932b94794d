"""Kinds of special points that the published problems do not show: tori with their resonances, corners, pitchforks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns


def rotor(**parameters: float) -> ns.System:
    """z' = (mu + i w + e cos t) z - |z|^2 z: the orbit z = 0 has the multipliers exp(2 pi (mu +- i w))."""

    def field(t: Any, u: Any, p: Any) -> Any:
        x, y = u
        growth = p.mu - p.b**2 + p.e * np.cos(t) - x * x - y * y
        return growth * x - p.w * y, p.w * x + growth * y

    system = ns.System(
        name="rotor", states=["x", "y"], parameters={"mu": -0.2, "w": 0.3, "e": 0.5, "b": 0.0}, modes={"one": field}
    )
    return system.with_parameters(parameters)


def row(branch: xr.Dataset, kind: str, i: int = 0) -> xr.Dataset:
    special = ns.special_points(branch)
    return special.isel(special=int(np.flatnonzero(special["kind"].values == kind)[i]))


def test_neimark_sacker_point() -> None:
    """At mu = 0 exactly, with the multipliers exp(+-2 pi i w)."""
    branch = ns.continue_orbit(ns.find_orbit(rotor()), "mu", (-0.5, 0.5))
    special = ns.special_points(branch)
    assert list(special["kind"].values) == ["neimark_sacker"]
    assert float(special["mu"][0]) == pytest.approx(0.0, abs=1e-12)
    mu = special["floquet_multipliers"].values[0]
    assert np.sort_complex(mu) == pytest.approx(np.sort_complex(np.exp(2j * np.pi * np.array([0.3, -0.3]))), abs=1e-10)
    stable = branch["stable"].values
    assert stable[branch["mu"] < -1e-9].all() and not stable[branch["mu"] > 1e-9].any()


def test_curve_of_tori_and_its_resonances() -> None:
    """The curve is mu = b^2; over the frequency the multipliers pass 1:3 at w = 1/3 and 1:4 at w = 1/4."""
    branch = ns.continue_orbit(ns.find_orbit(rotor()), "mu", (-0.5, 0.5))
    curve = ns.continue_curve(row(branch, "neimark_sacker"), {"mu": (-0.5, 0.5), "b": (-0.6, 0.6)})
    assert curve["mu"].values == pytest.approx(curve["b"].values ** 2, abs=1e-10)
    assert np.abs(curve["b"].values).max() == pytest.approx(0.6)
    strong = ns.continue_curve(row(branch, "neimark_sacker"), {"mu": (-0.5, 0.5), "w": (0.2, 0.4)})
    at = strong.isel(point=strong["special_point"].values)
    found = {str(kind): float(w) for kind, w in zip(strong["special_kind"].values, at["w"].values, strict=True)}
    assert found == pytest.approx({"resonance_1_3": 1 / 3, "resonance_1_4": 1 / 4}, abs=1e-9)


def clutch(**parameters: float) -> ns.System:
    """A spring that engages beyond x = 1, but only while the mass is slower than c."""

    def free(t: Any, u: Any, p: Any) -> Any:
        x, v = u
        return v, p.A * np.cos(t) - 0.4 * v - 2.0 * x

    def engaged(t: Any, u: Any, p: Any) -> Any:
        x, v = u
        return v, p.A * np.cos(t) - 0.4 * v - 2.0 * x - 3.0 * (x - 1.0)

    system = ns.System(
        name="clutch",
        states=["x", "v"],
        parameters={"A": 1.3, "c": 0.5},
        modes={"free": free, "engaged": engaged},
        indicators={"beyond": lambda t, u, p: u.x - 1.0, "slow": lambda t, u, p: p.c - u.v},
        transitions=[
            ns.Transition("free", "engaged", when="beyond > 0 and slow > 0"),
            ns.Transition("engaged", "free", when="beyond < 0"),
        ],
    )
    return system.with_parameters(parameters)


def test_corner_of_a_condition() -> None:
    """If the mass comes to x = 1 with just the speed c, the other row of the condition becomes the last to hold.

    Without contact the amplitude is A / sqrt(1 + 0.4^2), and c = 0.5 is met near 1.2."""
    branches = [ns.continue_orbit(ns.find_orbit(clutch(A=A)), "A", (1.12, 2.2)) for A in (1.15, 1.5)]
    corners = [row(branch, "corner") for branch in branches]
    assert float(corners[0]["A"]) == pytest.approx(float(corners[1]["A"]), abs=1e-9)
    assert {str(corner["touched"].values) for corner in corners} <= {"slow", "beyond"}
    # At the corner itself, by simulation: contact begins at x = 1 with v = c.
    at = float(corners[0]["A"])
    run = ns.simulate(clutch(A=at), periods=1, transient=200, rtol=None)
    entry = run["u_before"].values[run["crossing_transition"].values == 0]
    assert entry[0] == pytest.approx([1.0, 0.5], abs=1e-7)
    # And beyond it the branch is what the simulation settles on.
    for A in (at - 0.05, at + 0.05):
        orbit = ns.find_orbit(clutch(A=A))
        for branch in branches:
            k = int(np.argmin(np.abs(branch["A"].values - A)))
            start = dict(zip(("x", "v"), branch["section"].values[k], strict=True))
            near = ns.find_orbit(clutch(A=A), start=start, transient=0, period_number=1)
            assert near.u == pytest.approx(orbit.u, abs=1e-10)


def test_pitchfork_of_a_symmetric_double_well() -> None:
    """x'' + c x' + x (x^2 - p) = 0 under a forcing that keeps the symmetry: three branches meet in one point."""

    def well(t: Any, u: Any, p: Any) -> Any:
        x, v = u
        return v, -0.3 * v + p.a * x - x**3 + 0.05 * np.cos(t)

    system = ns.System(
        name="double well",
        states=["x", "v"],
        parameters={"a": -0.5},
        modes={"one": well},
        symmetry=(lambda u: (-u.x, -u.v), 0.5),
    )
    branch = ns.continue_orbit(ns.find_orbit(system), "a", (-1.0, 1.0))
    fork = row(branch, "pitchfork")
    other = ns.continue_orbit(fork)
    # Two mirror images, which meet in the symmetric orbit.
    assert row(other, "pitchfork")["a"].values == pytest.approx(float(fork["a"]), abs=1e-9)
    ends = other["section"].values[[0, -1]]
    assert float(other["a"][0]) == float(other["a"][-1]) == 1.0
    assert other["maximum"].values[0] == pytest.approx(-other["minimum"].values[-1], abs=1e-8)
    assert not np.allclose(ends[0], ends[1])
    # Beyond the fork the symmetric orbit is unstable, the others are stable.
    assert not branch["stable"].values[branch["a"] > float(fork["a"]) + 1e-6].any()
    assert other["stable"].values[np.abs(other["a"].values - float(fork["a"])) > 1e-6].all()


def test_transcritical_of_the_logistic_map() -> None:
    """x = 0 and x = 1 - 1 / r cross at r = 1 with the multiplier 1, and both go on."""
    system = ns.Map(states=["x"], parameters={"r": 1.5}, branches=[ns.Branch(lambda u, p: (p.r * u.x * (1 - u.x),))])
    branch = ns.continue_orbit(ns.find_orbit(system, start={"x": 0.3}), "r", (0.5, 2.0))
    crossing = row(branch, "transcritical")
    assert float(crossing["r"]) == pytest.approx(1.0, abs=1e-12)
    other = ns.continue_orbit(crossing)
    assert sorted(other["r"].values[[0, -1]]) == [0.5, 2.0]
    for one, fixed in ((branch, 1 - 1 / branch["r"].values), (other, 0 * other["r"].values)):
        assert one["section"].values[:, 0] == pytest.approx(fixed, abs=1e-11)
        assert set(ns.special_points(one)["kind"].values) == {"transcritical"}


@pytest.mark.parametrize(("r", "period_number", "multiplier"), [(1.5, 1, 0.5), (2.9, 1, -0.9), (3.2, 2, 0.16)])
def test_a_reset_at_a_phase_counts_where_it_changes_nothing(r: float, period_number: int, multiplier: float) -> None:
    """The logistic map as a kick: 2 - r at its fixed point, 4 + 2 r - r^2 on its cycle of two."""
    system = ns.System(
        states=["x"],
        parameters={"r": r},
        modes={"rest": lambda t, u, p: 0 * u.x},
        period=1.0,
        transitions=[ns.Transition("rest", "rest", at=0.5, reset=lambda t, u, p: p.r * u.x * (1 - u.x))],
    )
    orbit = ns.find_orbit(system, start={"x": 0.3})
    assert orbit.period_number == period_number
    assert orbit.floquet_multipliers == pytest.approx([multiplier], abs=1e-12)


def test_an_orbit_with_memory_has_its_own_extremes_and_clearance() -> None:
    """x'' + x = m, which changes its sign at each half of T: x = m (1 - cos(t - T/4) / cos(T/4)) in the first half."""

    def field(t: Any, u: Any, p: Any) -> Any:
        return u.v, p.m - u.x

    def rebound(t: Any, u: Any, p: Any) -> Any:
        return u.x, -u.v

    system = ns.System(
        states=["x", "v"],
        parameters={"T": 3.0},
        memory={"m": (1.0, "")},
        modes={"up": field, "down": field},
        indicators={"level": lambda t, u, p: u.x - 1.0},
        transitions=[
            ns.Transition("up", "down", at=0.5, write={"m": lambda t, u, p: -1.0}),
            ns.Transition("down", "up", at=0.0, write={"m": lambda t, u, p: 1.0}),
            *(ns.Transition(mode, mode, when="level > 0", reset=rebound) for mode in ("up", "down")),
        ],
        period=lambda p: p.T,
    )
    orbit = ns.find_orbit(system, start={"v": -np.tan(0.75)}, transient=0, period_number=1)
    assert not orbit.virtual
    highest = 1.0 / np.cos(0.75) - 1.0
    assert orbit.maximum == pytest.approx([highest, np.tan(0.75)], abs=1e-12)
    assert orbit.minimum == pytest.approx([-highest, -np.tan(0.75)], abs=1e-12)
    assert orbit.clearance["level"] == pytest.approx(1.0 - highest, abs=1e-12)


@pytest.mark.parametrize(("own", "other"), [(0.5, 1.5), (1.0, 0.3), (2.0, -1.0)])
def test_of_two_branches_that_cross_the_other_one_leaves_whatever_their_angle(own: float, other: float) -> None:
    """u -> u - (u - 2 - own r) (u - 2 - other r) / 8: two lines of fixed points that cross at r = 0, both ways on."""
    system = ns.Map(
        states=["x"],
        parameters={"r": -0.5},
        branches=[ns.Branch(lambda u, p: (u.x - 0.125 * (u.x - 2 - own * p.r) * (u.x - 2 - other * p.r),))],
    )
    first = ns.find_orbit(system, start={"x": 2 - 0.5 * own}, transient=0)
    branch = ns.continue_orbit(first, "r", (-0.75, 0.75))
    left = ns.continue_orbit(row(branch, "transcritical"))
    for one, slope in ((branch, own), (left, other)):
        assert one["section"].values[:, 0] == pytest.approx(2 + slope * one["r"].values, abs=1e-9)
        assert sorted(one["r"].values[[0, -1]]) == [-0.75, 0.75]
