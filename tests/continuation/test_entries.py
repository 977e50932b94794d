"""A branch does not depend on the orbit it starts from, nor on how friction is written."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import random_templates as templates
from mpmath import mp, mpf
from scipy.optimize import brentq
from test_sliding_bifurcations import BACKWARD, FORWARD, STICK, Belt, root

import nonsmooth as ns

pytestmark = pytest.mark.physics

#: x'' + x = cos(w t) - F sgn(x'), w = 1 / 5: one slip each way from a stick, or two.
W = mpf(1) / 5


def by_element(F: float) -> ns.System:
    return ns.mechanical(
        1.0,
        0.0,
        1.0,
        parameters={"w": 0.2, "F": F},
        forcing={"q": lambda t, p: np.cos(p.w * t)},
        elements={"f": ns.elements.Coulomb(at="q", friction="F")},
        coordinates=["q"],
    )


def by_surface(F: float) -> ns.System:
    def slip(sign: float) -> Any:
        return lambda t, u, p: (u.v, np.cos(p.w * t) - u.x - sign * p.F)

    return ns.System(
        states=["x", "v"],
        parameters={"w": 0.2, "F": F},
        modes={"back": slip(-1.0), "forward": slip(1.0)},
        indicators={"speed": lambda t, u, p: u.v},
        transitions=[ns.Surface("speed", below="back", above="forward", mode="stick")],
    )


def slip(begin: Any, x0: Any, F: Any, t: Any) -> tuple[Any, Any, Any]:
    """Place, speed and acceleration at t of a slip backward from rest."""
    V = 1 / (1 - W * W)
    a, b, s = x0 - F - V * mp.cos(W * begin), V * W * mp.sin(W * begin), t - begin
    x = V * mp.cos(W * t) + F + a * mp.cos(s) + b * mp.sin(s)
    return x, -V * W * mp.sin(W * t) - a * mp.sin(s) + b * mp.cos(s), mp.cos(W * t) - x + F


@cache
def adding() -> Any:
    """The stick at x touches its limit where the force is largest: 1 - x = F; a slip leads from x to -x."""

    def equations(F: Any, begin: Any, end: Any) -> list[Any]:
        x, v, _ = slip(begin, 1 - F, F, end)
        return [mp.cos(W * begin) - (1 - F) + F, x + 1 - F, v]

    return root(equations, 0.427, 7.12, 12.5)[0]


@cache
def grazing() -> Any:
    """The slip from x to -x comes to rest on its way, without acceleration."""

    def equations(F: Any, x0: Any, begin: Any, touch: Any, end: Any) -> list[Any]:
        x, v, _ = slip(begin, x0, F, end)
        _, speed, acceleration = slip(begin, x0, F, touch)
        return [mp.cos(W * begin) - x0 + F, x + x0, v, speed, acceleration]

    return root(equations, 0.298, 0.91, 4.56, 11.12, 15.71)[0]


@pytest.mark.parametrize(
    ("make", "F"),
    [
        (by_element, 0.28),
        *(pytest.param(*one, marks=pytest.mark.slow) for one in ((by_surface, 0.36), (by_element, 0.6))),
    ],
)
def test_from_other_orbits_the_same_branch(make: Any, F: float) -> None:
    """Beside both points visits as short as the square root of the distance: no trivial root beside theirs."""
    expected = [float(grazing()), float(adding())]
    branch = ns.continue_orbit(ns.find_orbit(make(F)), "F", (0.25, 0.9))
    special = ns.special_points(branch)
    assert special["sliding"].values.tolist() == ["grazing_sliding", "adding_sliding"]
    assert special["F"].values == pytest.approx(expected, abs=1e-9)
    assert branch["F"].values[[0, -1]] == pytest.approx([0.25, 0.9], abs=1e-14)
    assert all("edge of the range" in str(text) for text in branch["ended_because"].values)


@cache
def edges_on_a_belt() -> list[float]:
    """Speeds of the belt at the crossing, the switching and the grazing of its sliding region."""
    case = "0.8", "0.02", "0.3"
    return [
        float(value)
        for value in (
            Belt(*case, FORWARD, BACKWARD).edge(1, BACKWARD, 2.01, 5.35, -1.41, 6.27, 0.52),
            Belt(*case, STICK, BACKWARD).edge(0, FORWARD, 2.16, 5.62, -0.60, 6.06, 0.35),
            Belt(*case).without_contact(),
        )
    ]


@pytest.mark.parametrize("v_b", [0.6, 2.05, 2.5])
def test_sliding_bifurcations_of_elements_and_surfaces(v_b: float) -> None:
    """Crossing-, switching- and grazing-sliding on a belt, from orbits with each of their signatures."""
    element = ns.mechanical(
        1.0,
        0.04,
        1.0,
        parameters={"v_b": v_b},
        forcing={"q": lambda t, p: np.cos(0.8 * t)},
        coordinates=["q"],
        period=2 * np.pi / 0.8,
        elements={"f": ns.elements.Coulomb(at="q", friction=0.3, belt="v_b")},
    )
    for system in (element, ns.models.dry_friction_oscillator(omega=0.8, zeta=0.02, f_k=0.3, f_s=0.3, v_b=v_b)):
        special = ns.special_points(ns.continue_orbit(ns.find_orbit(system), "v_b", (0.05, 3.0)))
        assert special["sliding"].values.tolist() == ["crossing_sliding", "switching_sliding", "grazing_sliding"]
        assert special["v_b"].values == pytest.approx(edges_on_a_belt(), abs=1e-9)


@pytest.mark.parametrize("sides", [(1.08,), pytest.param((0.82, 1.08), marks=pytest.mark.slow)])
def test_an_impact_that_vanishes_is_a_graze_from_either_side(sides: tuple[float, ...]) -> None:
    """It passes the speed below which impacts are completed as rest: that is a graze all the same.

    Beyond the last one the mass touches nothing: the amplitude of the forced vibration is the gap."""
    system, name, _, start = templates.two_stops(np.random.default_rng([0, 9]))
    at, limits = system.with_parameters({name: 0.85}), (0.8, 1.1)
    first = ns.continue_orbit(ns.find_orbit(at, start=start, max_period=4, progress=False), name, limits)
    tables = [ns.special_points(first)]  # begun at 0.85
    for value in sides:
        i = int(np.abs(first[name].values - value).argmin())
        here = system.with_parameters({name: float(first[name][i])})
        orbit = ns.find_orbit(here, start=first["section"].values[i], transient=0, period_number=1, progress=False)
        tables.append(ns.special_points(ns.continue_orbit(orbit, name, limits)))
    p = system.values

    def reach(w: float) -> float:
        z, k = p["z"], p["s"]
        matrix = [[1 + k - w * w + 2j * z * w, -k - 1j * z * w], [-k - 1j * z * w, k - w * w + 1j * z * w]]
        return float(np.abs(np.linalg.solve(matrix, [p["f"], 0.0]))[0]) - p["b"]

    last = brentq(reach, 0.9303, 0.9307, xtol=1e-14)
    for table in tables:
        assert np.abs(table[name].values[table["kind"].values == "grazing"] - last).min() < 1e-9
        assert table["kind"].values.tolist() == tables[0]["kind"].values.tolist()
        assert table[name].values == pytest.approx(tables[0][name].values, abs=1e-8)


@pytest.mark.parametrize("amplitude", [pytest.param(0.3, marks=pytest.mark.slow), 0.79, 1.979308279994206])
def test_from_a_small_orbit_to_a_large_one(amplitude: float) -> None:
    """Motion dies out where the relay equals the forcing; steps are measured by the orbit that has grown.

    At rest the forcing is largest just at the section, and half way round."""
    system, name, limits, _ = templates.relay(np.random.default_rng([1, 5]))
    here = system.with_parameters({name: amplitude})
    branch = ns.continue_orbit(ns.find_orbit(here, progress=False), name, limits, points=400)
    assert branch[name].values[[0, -1]] == pytest.approx(limits, abs=1e-12)
    special = ns.special_points(branch)
    assert special["sliding"].values.tolist() == ["adding_sliding", "crossing_sliding"]
    assert special["kind"].values.tolist() == ["grazing", "corner"]
    assert special[name].values[0] == pytest.approx(system.values["F"], abs=1e-9)


def test_a_slow_impact_is_the_same_impact() -> None:
    """Beside a non-smooth fold the speed below which impacts may end in rest is passed too: no way back.

    It once went back through the orbits it had come by, and met their special points again."""
    system, name, limits, _ = templates.rest(np.random.default_rng([1, 4]))
    here = system.with_parameters({name: 2.4515905})
    orbit = ns.find_orbit(here, start=[0.231722, 0.773737], transient=0, period_number=1, progress=False)
    special = ns.special_points(ns.continue_orbit(orbit, name, limits, points=150))
    for kind in ("grazing", "fold", "flip"):
        values = np.sort(special[name].values[special["kind"].values == kind])
        assert np.diff(values).min() > 1e-9, kind


@pytest.mark.parametrize(
    ("begun", "low", "high", "pairs"),
    [
        (2.1716, 2.1715, 2.1722, 4),
        (2.172168, 2.17216, 2.17217, 3),  # between them the speed is passed below which impacts are completed
        pytest.param(2.1721695, 2.17216, 2.17217, 3, marks=pytest.mark.slow),
        pytest.param(2.1734, 2.1715, 2.1735, 7, marks=pytest.mark.slow),
        pytest.param(2.1727, 2.1715, 2.1735, 7, marks=pytest.mark.slow),
    ],
)
def test_where_impacts_accumulate(begun: float, low: float, high: float, pairs: int) -> None:
    """From where rest ends on flips and grazes follow each other, each pair once: an impact less in each."""
    table = templates._table().with_parameters(e=0.2373710, c=0.0564473, a=begun)
    branch = ns.continue_orbit(ns.find_orbit(table, start=[0.1, 0.0], progress=False), "a", (low, high))
    assert branch["a"].values[[0, -1]] == pytest.approx([low, high], abs=1e-12)
    assert ns.special_points(branch)["kind"].values.tolist() == ["flip", "grazing"] * pairs


@pytest.mark.slow
def test_where_impacts_accumulate_from_either_side() -> None:
    """Grazes and flips follow each other ever faster up to where rest begins: all are met from either side.

    Beyond an impact so slow that it is completed as rest the orbit jumps by up to 1e-7 of its size: the first of them,
    where rest ends, is known no better."""
    table, limits = templates._table().with_parameters(e=0.2373710, c=0.0564473), (2.168, 2.178)
    first = ns.find_orbit(table.with_parameters(a=limits[0]), start=[0.1, 0.0], progress=False)
    branch = ns.continue_orbit(first, "a", limits)
    at = int(np.flatnonzero(np.diff(np.sign(branch["a"].values - 2.1727)))[-1])
    here, begun = table.with_parameters(a=float(branch["a"][at])), branch["section"].values[at]
    other = ns.find_orbit(here, start=begun, transient=0, period_number=1, progress=False)
    a, b = (ns.special_points(one) for one in (branch, ns.continue_orbit(other, "a", limits)))
    assert float(a["a"][0]) == pytest.approx(float(b["a"][0]), abs=1e-7)
    assert a["kind"].values[1:].tolist() == b["kind"].values[1:].tolist()
    assert a["a"].values[1:] == pytest.approx(b["a"].values[1:], abs=1e-10)
    assert (a["kind"] == "flip").sum() >= 8


def test_a_crossing_that_has_just_passed_the_section() -> None:
    """An elastic contact that begins at the section of an orbit begun one forcing period later is no end of the branch.

    The branch ends where the orbit of half its period flips, from whichever period it is begun."""
    values = {
        "z": 0.3321063608543215,
        "s": 1.9544936727092173,
        "b": 1.6471896040241403,
        "g": 0.3014006099471556,
        "e": 0.35455152724094197,
        "k": 1.9928910656372831,
    }
    system = templates._two_stops().with_parameters(values)
    first = ns.find_orbit(system.with_parameters(w=1.7414550305132799), period_number=2, progress=False)
    branch = ns.continue_orbit(first, "w", (1.55, 3.0))
    at = int(np.abs(branch["w"].values - 1.611047026999419).argmin())
    here = system.with_parameters(w=float(branch["w"][at]))
    run = ns.simulate(here, duration=4 * np.pi / here.values["w"], start=branch["section"].values[at])
    later = ns.find_orbit(here, start=run, transient=0, period_number=2, progress=False)
    tables = [ns.special_points(one) for one in (branch, ns.continue_orbit(later, "w", (1.55, 3.0)))]
    assert np.abs(later.u - branch["section"].values[at]).max() > 0.1
    assert tables[0]["kind"].values.tolist() == tables[1]["kind"].values.tolist()
    assert tables[0]["w"].values == pytest.approx(tables[1]["w"].values, abs=1e-9)


@pytest.mark.parametrize(("begun", "d"), [(-0.05, 3e-4), (0.05, 3e-4), (-0.03, 3e-3), (-1.0, 1e-4)])
def test_a_flip_right_behind_a_corner(begun: float, d: float) -> None:
    """x -> l x + mu - d sqrt(x) for x > 0: the multiplier l - d / (2 sqrt(x)) is -1 at sqrt(x) = d / (2 (1 + l)).

    The first orbit found behind the border lies beyond that flip, and the map has no values on the other side."""
    lam = 0.15
    slight = ns.Map(
        states=["x"],
        parameters={"mu": begun, "d": d},
        branches=[
            ns.Branch(lambda u, p: (lam * u.x + p.mu,), when="x < 0"),
            ns.Branch(lambda u, p: (lam * u.x + p.mu - p.d * np.sqrt(u.x),), when="x > 0"),
        ],
    )
    root = (np.sqrt(d * d + 4 * (1 - lam) * abs(begun)) - d) / (2 * (1 - lam))
    start = begun / (1 - lam) if begun < 0 else root**2
    orbit = ns.find_orbit(slight, start=[float(start)], period_number=1, transient=0, progress=False)
    special = ns.special_points(ns.continue_orbit(orbit, "mu", (-5.0, 5.0), points=400))
    at = d / (2 * (1 + lam))
    assert special["kind"].values.tolist() == ["corner", "flip"]
    assert special["mu"].values == pytest.approx([0.0, (1 - lam) * at**2 + d * at], abs=1e-11)
