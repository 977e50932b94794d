"""Branches go on where orbits do: onset of stops, skipped cycles, several grazes at once, centres, closed branches."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq

import nonsmooth as ns

pytestmark = pytest.mark.physics


def returns(system: ns.System, branch: xr.Dataset, name: str, every: int) -> float:
    """Largest distance by which simulated orbits of a branch miss their beginning, of those with small multipliers."""
    worst, n = 0.0, 0
    for i in range(0, branch.sizes["point"], every):
        point = branch.isel(point=i)
        if np.abs(point["floquet_multipliers"].values).max() > 1e3:
            continue
        same, mode = system.with_parameters({name: float(point[name])}), system.modes[int(point["mode"])]
        run = ns.simulate(same, duration=float(point["period"]), start=point["section"].values, mode=mode)
        assert int(run["status"]) == 0
        missed = np.abs(run["u"].values[-1] - point["section"].values) / system.scale_vector()
        worst, n = max(worst, float(np.nanmax(missed))), n + 1
    assert n > 4
    return worst


def whole(branch: xr.Dataset, name: str, low: float, high: float) -> None:
    """The branch lies between both edges of the range."""
    assert sorted(branch[name].values[[0, -1]]) == pytest.approx([low, high])
    assert [str(branch["ended"].attrs["flag_meanings"]).split()[int(i)] for i in branch["ended"].values] == [
        "range",
        "range",
    ]


def coulomb(w: float, F: float = 0.5, ratio: float = 1.0, z: float = 0.0) -> ns.System:
    """x'' + 2 z x' + x = cos(w t), with the friction F forwards and F ratio backwards."""

    def net(t: Any, u: Any, p: Any) -> Any:
        return np.cos(p.w * t) - u.x

    def rest(t: Any, u: Any, p: Any) -> Any:
        return u.x, 0 * u.v

    return ns.System(
        name="coulomb",
        states=["x", "v"],
        parameters={"w": w, "F": F, "r": ratio, "z": z},
        modes={
            "forward": lambda t, u, p: (u.v, net(t, u, p) - p.F - 2 * p.z * u.v),
            "backward": lambda t, u, p: (u.v, net(t, u, p) + p.r * p.F - 2 * p.z * u.v),
            "stick": lambda t, u, p: (0 * u.v, 0 * u.v),
        },
        indicators={
            "speed": lambda t, u, p: u.v,
            "push": lambda t, u, p: net(t, u, p) - p.F,
            "pull": lambda t, u, p: net(t, u, p) + p.r * p.F,
        },
        transitions=[
            ns.Transition("forward", "backward", when="speed < 0 and pull < 0"),
            ns.Transition("backward", "forward", when="speed > 0 and push > 0"),
            ns.Transition("forward", "stick", when="speed < 0 and pull > 0", reset=rest),
            ns.Transition("backward", "stick", when="speed > 0 and push < 0", reset=rest),
            ns.Transition("stick", "forward", when="push > 0"),
            ns.Transition("stick", "backward", when="pull < 0"),
        ],
    )


def onset_of_stops(F: float) -> float:
    """Den Hartog: motion without stops needs F < V / sqrt(U^2 + 1 / r^4)."""

    def condition(r: float) -> float:
        V, U = 1 / (1 - r * r), np.sin(np.pi / r) / (r * (1 + np.cos(np.pi / r)))
        return float(V / np.sqrt(U * U + r**-4) - F)

    return float(brentq(condition, 0.51, 0.7, xtol=1e-14))


@pytest.mark.parametrize("begin", [0.54, 0.65])
def test_onset_of_two_stops(begin: float) -> None:
    branch = ns.continue_orbit(ns.find_orbit(coulomb(begin)), "w", (0.52, 0.7))
    whole(branch, "w", 0.52, 0.7)
    special = ns.special_points(branch)
    assert list(special["kind"].values) == ["corner"]
    assert float(special["w"][0]) == pytest.approx(onset_of_stops(0.5), abs=1e-9)
    assert set(np.unique(branch["crossings_per_period"])) == {2.0, 4.0}
    assert returns(coulomb(begin), branch, "w", 9) < 1e-9


@pytest.mark.parametrize("begin", [0.4, 0.65])
def test_onset_of_stops_one_after_the_other(begin: float) -> None:
    """Unequal friction: the branch through one stop is that of a sweep."""
    system = coulomb(begin, 0.3, 0.8, 0.02)
    branch = ns.continue_orbit(ns.find_orbit(system), "w", (0.35, 0.7))
    whole(branch, "w", 0.35, 0.7)
    assert returns(system, branch, "w", 9) < 1e-9
    there = branch.isel(point=slice(0, None, 7)).sortby("w")
    swept = ns.sweep(system, "w", there["w"].values, keep=2, progress=False)
    assert swept["section"].values[:, -1] == pytest.approx(there["section"].values, abs=1e-9)


def buck(V: float) -> ns.System:
    """Fossas and Olivar's DC-DC buck converter; the ramp is a clock that is set back at every period."""
    parameters = {"V": V, "R": 22.0, "L": 20e-3, "C": 47e-6, "a": 8.4, "T": 400e-6}

    def circuit(on: float) -> Any:
        return lambda t, u, p: (u.i / p.C - u.v / (p.R * p.C), (on * p.V - u.v) / p.L, 1 / p.T)

    def tick(t: Any, u: Any, p: Any) -> Any:
        return u.v, u.i, 0 * u.w

    return ns.System(
        name="buck",
        states=["v", "i", "w"],
        parameters=parameters,
        modes={"off": circuit(0.0), "on": circuit(1.0)},
        indicators={"ramp": lambda t, u, p: p.a * (u.v - 11.3) - (3.8 + 4.4 * u.w)},
        transitions=[
            ns.Transition("off", "on", when="ramp < 0"),
            ns.Transition("on", "off", when="ramp > 0"),
            ns.Transition("on", "on", at=0.0, reset=tick),
            ns.Transition("off", "off", at=0.0, reset=tick),
        ],
        period=lambda p: p.T,
        scale={"v": 10.0, "i": 1.0, "w": 1.0},
    )


def test_corner_is_the_same_from_either_side() -> None:
    """Unequal friction: where rest turns to a stop and a slip, from there a visit ends in a double zero."""
    found = []
    for begin in (0.472, 0.49):
        branch = ns.continue_orbit(ns.find_orbit(coulomb(begin, 0.3, 0.8, 0.02)), "w", (0.45, 0.5))
        special = ns.special_points(branch)
        assert list(special["kind"].values) == ["corner", "grazing"]
        found.append(special["w"].values)
    assert found[0] == pytest.approx(found[1], abs=1e-13)


def test_skipped_cycle_of_the_buck_converter() -> None:
    """The branch of period 2 loses one of its two switchings at 36.3532370641 V and goes on to 40 V."""
    first = ns.continue_orbit(ns.find_orbit(buck(22.0), start={"v": 12.0, "i": 0.5}), "V", (20.0, 40.0))
    special = ns.special_points(first)
    branch = ns.continue_orbit(special.isel(special=list(special["kind"].values).index("flip")))
    assert float(branch["V"][-1]) == pytest.approx(40.0)
    corner = ns.special_points(branch).isel(special=-1)
    assert (str(corner["kind"].values), float(corner["V"])) == ("corner", pytest.approx(36.3532370641, abs=1e-8))
    assert str(branch["ended_because"].values[0]) == "The branch begins at the flip."
    # Beyond: one switching on, one off, two ticks, by Newton's method from elsewhere.
    orbit = ns.find_orbit(buck(40.0), start=branch["section"].values[-1], transient=0, period_number=2)
    assert sorted(v.row for v in orbit.signature.crossings) == [-2, -1, -1, 0]
    back = ns.continue_orbit(orbit, "V", (20.0, 40.0))
    there = ns.special_points(back)
    assert sorted(there["kind"].values) == ["corner", "flip", "flip"]  # and ends at the flip that it leaves
    assert there["V"].values.max() == pytest.approx(float(corner["V"]), abs=1e-11)
    assert branch["floquet_multipliers"].values[-1] == pytest.approx(orbit.floquet_multipliers, abs=1e-8)
    assert orbit.trajectory()["u"].values[-1, :2] == pytest.approx(orbit.u[:2], abs=1e-9)


def gear(w: float) -> ns.System:
    """A gear with backlash, forced without a mean: both flanks are met alike."""
    return ns.System(
        name="gear",
        states=["x", "v"],
        parameters={"z": 0.05, "w": w},
        modes={
            "free": lambda t, u, p: (u.v, -2 * p.z * u.v + np.cos(p.w * t)),
            "drive": lambda t, u, p: (u.v, -2 * p.z * u.v - (u.x - 1) + np.cos(p.w * t)),
            "coast": lambda t, u, p: (u.v, -2 * p.z * u.v - (u.x + 1) + np.cos(p.w * t)),
        },
        indicators={"high": lambda t, u, p: u.x - 1, "low": lambda t, u, p: u.x + 1},
        transitions=[
            ns.Transition("free", "drive", when="high > 0"),
            ns.Transition("drive", "free", when="high < 0"),
            ns.Transition("free", "coast", when="low < 0"),
            ns.Transition("coast", "free", when="low > 0"),
        ],
        symmetry=(lambda u: (-u.x, -u.v), 0.5, {"free": "free", "drive": "coast", "coast": "drive"}),
    )


@pytest.fixture(scope="module")
def gears() -> xr.Dataset:
    return ns.continue_orbit(ns.find_orbit(gear(0.8), start=[0.3, 0.2]), "w", (0.2, 0.9))


@pytest.mark.parametrize("low", [0.23, pytest.param(0.2, marks=pytest.mark.slow)])
def test_grazes_at_both_flanks_at_once(gears: xr.Dataset, low: float) -> None:
    """The symmetric branch goes through both of its double grazes and stays symmetric, from either side."""
    begun = ns.find_orbit(gear(0.253), start=[3.57134384, 0.42988223], transient=0, period_number=1)
    other = ns.continue_orbit(begun, "w", (low, 0.5 if low > 0.2 else 0.9))
    whole(other, "w", low, 0.5 if low > 0.2 else 0.9)
    whole(gears, "w", 0.2, 0.9)
    both = [gears, other]
    for branch in both:
        assert branch["maximum"].values == pytest.approx(-branch["minimum"].values, abs=1e-9)
        special = ns.special_points(branch)
        grazes = special.isel(special=np.flatnonzero(special["kind"] == "grazing"))
        assert sorted(grazes["w"].values) == pytest.approx([0.25366680, 0.27518271], abs=1e-7)
        assert returns(gear(0.8), branch, "w", 5) < 1e-9
    points = [sorted(zip(*(ns.special_points(one)[k].values for k in ("kind", "w")), strict=True)) for one in both]
    assert points[1] == [(kind, pytest.approx(w, abs=1e-10)) for kind, w in points[0] if w > low]


def test_closed_branch_ends_where_it_began(gears: xr.Dataset) -> None:
    """Between two pitchforks: the unsymmetric orbits and their mirror images, each special point once."""
    special = ns.special_points(gears)
    first = int(np.flatnonzero((special["kind"] == "pitchfork") & (special["w"] > 0.4))[0])
    branch = ns.continue_orbit(special.isel(special=first))
    assert [str(branch["ended"].attrs["flag_meanings"]).split()[int(i)] for i in branch["ended"].values] == [
        "closed",
        "closed",
    ]
    found = ns.special_points(branch)
    both = zip(found["kind"].values, found["section"].values, strict=True)
    points = [(str(kind), *np.round(u, 6)) for kind, u in both]
    assert len(points) == len(set(points))
    # All but the two pitchforks come in mirror images, at the same frequency.
    others = found["w"].values[found["kind"].values != "pitchfork"]
    assert len(points) - len(others) == 2
    values = np.sort(others)
    assert values[::2] == pytest.approx(values[1::2], abs=1e-9)


def chua(alpha: float) -> ns.System:
    """Chua's circuit with m0 = -8/7, m1 = -5/7, beta = 100/7."""

    def circuit(side: int) -> Any:
        slope = -8 / 7 if side == 0 else -5 / 7
        return lambda t, u, p: (p.alpha * (u.y - u.x - slope * u.x + side * 3 / 7), u.x - u.y + u.z, -100 / 7 * u.y)

    return ns.System(
        name="chua",
        states=["x", "y", "z"],
        parameters={"alpha": alpha},
        modes={"middle": circuit(0), "right": circuit(1), "left": circuit(-1)},
        indicators={"high": lambda t, u, p: u.x - 1, "low": lambda t, u, p: u.x + 1},
        transitions=[
            ns.Transition("middle", "right", when="high > 0"),
            ns.Transition("right", "middle", when="high < 0"),
            ns.Transition("middle", "left", when="low < 0"),
            ns.Transition("left", "middle", when="low > 0"),
        ],
    )


def test_focus_centre_and_its_large_cycle() -> None:
    """At Routh and Hurwitz's alpha the mode is a centre; the cycle begins as its orbit that touches x = 1."""
    s = 1 - 5 / 7  # x' = alpha (y - s x): lambda^3 + (1 + s a) l^2 + (beta + s a - a) l + s a beta
    alpha = brentq(lambda a: (1 + s * a) * (100 / 7 + s * a - a) - s * a * 100 / 7, 6.0, 7.0, xtol=1e-15)
    rest = ns.continue_equilibrium(chua(6.5), "alpha", (6.0, 9.0), start={"x": 1.5, "z": -1.5}, mode="right")
    special = ns.special_points(rest)
    assert list(special["kind"].values) == ["focus_centre"]
    assert float(special["alpha"][0]) == pytest.approx(alpha, abs=1e-11)
    branch = ns.continue_orbit(special.isel(special=0))
    begin = branch.isel(point=0)
    assert float(begin["alpha"]) == pytest.approx(alpha, abs=1e-9)
    assert [float(begin[k].sel(state="x")) for k in ("minimum", "maximum")] == pytest.approx([1.0, 2.0], abs=1e-7)
    omega = np.sqrt(100 / 7 + s * alpha - alpha)
    assert float(begin["period"]) == pytest.approx(2 * np.pi / omega, abs=1e-6)
    assert str(branch["ended_because"].values[0]).startswith("The cycle ends in a focus-centre bifurcation")
    near = branch.isel(point=int(np.abs(branch["alpha"].values - 7.5).argmin()))
    orbit = ns.find_orbit(chua(float(near["alpha"])), start={"x": 1.6, "y": 0.05, "z": -1.6})
    assert float(near["period"]) == pytest.approx(orbit.period, abs=1e-9)
    assert near["maximum"].values == pytest.approx(orbit.maximum, abs=1e-9)


def ripple(c: float) -> ns.System:
    """x = g(t) + c with g = (s^3 - 3 e^2 s)(2 + cos t), s = sin t: two extremes within 0.02 rad of each zero of s."""

    def field(on: float) -> Any:
        def slopes(t: Any, u: Any, p: Any) -> Any:
            s, k = np.sin(t), np.cos(t)
            wave, slope = s**3 - 3 * p.e**2 * s, (3 * s * s - 3 * p.e**2) * k
            return slope * (2 + k) - wave * s + wave * (2 + k) + p.c - u.x, on - u.y

        return slopes

    return ns.System(
        name="ripple",
        states=["x", "y"],
        parameters={"c": c, "e": 0.01},
        modes={"low": field(0.0), "high": field(1.0)},
        indicators={"h": lambda t, u, p: u.x},
        period=2 * np.pi,
        transitions=[ns.Transition("low", "high", when="h > 0"), ns.Transition("high", "low", when="h < 0")],
    )


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_touches_between_two_samples_of_a_step() -> None:
    """The four extremes of g are grazes, each at the c that takes it to zero; sampled slopes show none of them."""

    def g(t: float) -> float:
        s = np.sin(t)
        return float((s**3 - 3e-4 * s) * (2 + np.cos(t)))

    grazes = [
        -g(brentq(lambda t: (g(t + 1e-7) - g(t - 1e-7)) / 2e-7, t - 5e-3, t + 5e-3, xtol=1e-15))
        for t in (-0.01, 0.01, np.pi - 0.01, np.pi + 0.01)
    ]
    branch = ns.continue_orbit(ns.find_orbit(ripple(-2e-5)), "c", (-2.5e-5, 2.5e-5))
    whole(branch, "c", -2.5e-5, 2.5e-5)
    special = ns.special_points(branch)
    assert set(special["kind"].values) == {"grazing"} and set(special["touched"].values) == {"h"}
    assert special["c"].values == pytest.approx(sorted(grazes), abs=1e-13)
    for c, crossings in ((-1e-5, 2), (-4e-6, 4), (0.0, 6), (4e-6, 4), (1e-5, 2)):
        near = branch.isel(point=int(np.abs(branch["c"].values - c).argmin()))
        assert int(near["crossings_per_period"]) == crossings
