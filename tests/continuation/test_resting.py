"""Equilibria with contacts and friction, against the force balances that define them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns

pytestmark = pytest.mark.physics

E = ns.elements
MU = 0.5


def pushed(**elements: Any) -> ns.System:
    """A mass on a spring of stiffness 2 under a constant force P."""
    return ns.mechanical(
        1.0, 0.1, 2.0, parameters={"P": 0.0}, forcing={"q": lambda t, p: p.P}, elements=elements, coordinates=["q"]
    )


def boundaries(branch: xr.Dataset) -> list[tuple[str, float]]:
    special = ns.special_points(branch)
    assert set(special["kind"].values) <= {"boundary_equilibrium"}
    return list(zip(special["boundary"].values.tolist(), special["P"].values.tolist(), strict=True))


def whole(branch: xr.Dataset, low: float, high: float) -> None:
    assert branch["P"].values[[0, -1]] == pytest.approx([low, high], abs=1e-12)
    assert all("edge of the range" in str(text) for text in branch["ended_because"].values)


@pytest.mark.parametrize("start", [0.0, 1.0, 0.9])
def test_newton_s_method_on_its_own_goes_round_in_a_circle(start: float) -> None:
    """By x^3 - 2 x + 2 it goes from 0 to 1 and back; the one real zero is Cardano's."""
    system = ns.System(
        name="cubic",
        states=["x", "v"],
        parameters={"P": 2.0},
        modes={"free": lambda t, u, p: [u.v, -u.v - u.x**3 + 2.0 * u.x - p.P]},
    )
    branch = ns.continue_equilibrium(system, "P", (1.9, 2.1), start={"x": start})
    root = np.sqrt(1.0 - 8.0 / 27.0)
    found = branch["u"].values[np.argmin(np.abs(branch["P"].values - 2.0)), 0]
    assert found == pytest.approx(np.cbrt(root - 1.0) - np.cbrt(root + 1.0), abs=1e-12)


@pytest.mark.parametrize("start", [{}, {"q": 3.0}])
def test_a_mass_pressed_against_a_rigid_stop(start: dict[str, float]) -> None:
    """q = P / 2 up to the stop at .5, and there beyond: persistence at P = 1."""
    branch = ns.continue_equilibrium(pushed(s=E.Stop(at="q", position=0.5)), "P", (-1.0, 3.0), start=start)
    whole(branch, -1.0, 3.0)
    assert branch["u"].values[:, 0] == pytest.approx(np.minimum(branch["P"].values / 2.0, 0.5), abs=1e-12)
    ((name, P),) = boundaries(branch)
    assert name == "persistence" and pytest.approx(1.0, abs=1e-9) == P


def test_a_force_beyond_the_stop_from_the_first() -> None:
    """Behind the stop the field of free motion vanishes at q = P / 2, which is no equilibrium."""
    stopped = pushed(s=E.Stop(at="q", position=0.5)).with_parameters(P=2.0)
    branch = ns.continue_equilibrium(stopped, "P", (1.5, 3.0), start={"q": 0.4})
    assert branch["u"].values[:, 0] == pytest.approx(0.5, abs=1e-12)


def test_a_slipping_equilibrium_on_a_belt() -> None:
    """The belt drags forward with the friction: 2 q = mu, whichever mode comes first."""
    belt = ns.mechanical(
        1.0,
        0.1,
        2.0,
        parameters={"vd": 0.3},
        elements={"f": E.Coulomb(at="q", friction=MU, belt="vd")},
        coordinates=["q"],
    )
    branch = ns.continue_equilibrium(belt, "vd", (0.1, 1.0))
    assert branch["u"].values[:, 0] == pytest.approx(MU / 2.0, abs=1e-12)
    for mode in ("f_stick", "f_forward"):
        with pytest.raises(ns.SolveError, match="no equilibrium was found"):
            ns.continue_equilibrium(belt, "vd", (0.1, 1.0), mode=mode)


@pytest.mark.parametrize("q", [0.0, 0.2, -4.0])
def test_dry_friction_leaves_an_interval(q: float) -> None:
    """Whatever balances: |P - 2 q| <= mu, so that the ends are (P -+ mu) / 2."""
    branch = ns.continue_equilibrium(pushed(f=E.Coulomb(at="q", friction=MU)), "P", (-1.0, 2.0), start={"q": q})
    whole(branch, -1.0, 2.0)
    P = branch["P"].values
    assert branch["u_lower"].values == pytest.approx(np.column_stack([(P - MU) / 2, 0 * P]), abs=1e-12)
    assert branch["u_upper"].values == pytest.approx(np.column_stack([(P + MU) / 2, 0 * P]), abs=1e-12)
    assert branch["u"].values[:, 0] == pytest.approx(P / 2, abs=1e-12) and branch["stable"].values.all()
    assert not boundaries(branch)


def test_friction_before_a_stop() -> None:
    """The interval meets the stop at 1 with P + mu = 2, shrinks, and is the stop itself from P - mu = 2 on."""
    system = pushed(f=E.Coulomb(at="q", friction=MU), s=E.Stop(at="q", position=1.0))
    branch = ns.continue_equilibrium(system, "P", (-1.0, 4.0), step=0.2)
    whole(branch, -1.0, 4.0)
    P = branch["P"].values
    assert branch["u_upper"].values[:, 0] == pytest.approx(np.minimum((P + MU) / 2, 1.0), abs=1e-9)
    assert branch["u_lower"].values[:, 0] == pytest.approx(np.minimum((P - MU) / 2, 1.0), abs=1e-9)
    assert boundaries(branch) == [
        ("persistence", pytest.approx(2.0 - MU, abs=1e-9)),
        ("persistence", pytest.approx(2.0 + MU, abs=1e-9)),
    ]


def test_two_equilibria_that_vanish_at_a_boundary() -> None:
    """x' = mu + x below 0 and mu - x above: x = -mu and x = mu, both for mu > 0 only: a non-smooth fold."""
    system = ns.System(
        states=["x"],
        parameters={"mu": 0.5},
        modes={"below": lambda t, u, p: (p.mu + u.x,), "above": lambda t, u, p: (p.mu - u.x,)},
        indicators={"side": lambda t, u, p: u.x},
        transitions=[
            ns.Transition("below", "above", when="side > 0"),
            ns.Transition("above", "below", when="side < 0"),
        ],
    )
    branch = ns.continue_equilibrium(system, "mu", (-1.0, 1.0), start={"x": -0.4})
    special = ns.special_points(branch)
    assert special["boundary"].values.tolist() == ["non_smooth_fold"]
    assert float(special["mu"][0]) == pytest.approx(0.0, abs=1e-12)
    assert branch["u"].values[[0, -1], 0] == pytest.approx([1.0, -1.0]) and (branch["mu"].values >= -1e-12).all()


def test_two_frictions_are_followed_by_their_extreme_points() -> None:
    """K q = P e_1 + lambda_1 (1, 0) + lambda_2 (0, 1): the extent is |K^-1| times the bounds, about K^-1 P e_1."""
    stiffness, bounds = np.array([[3.0, -1.0], [-1.0, 2.0]]), np.array([0.5, 0.3])
    system = ns.mechanical(
        np.diag([1.0, 2.0]),
        0.1 * np.eye(2),
        stiffness,
        parameters={"P": 0.0},
        forcing={"q1": lambda t, p: p.P},
        elements={"f": E.Coulomb(at="q1", friction=bounds[0]), "g": E.Coulomb(at="q2", friction=bounds[1])},
    )
    branch = ns.continue_equilibrium(system, "P", (-1.0, 2.0), step=0.3)
    whole(branch, -1.0, 2.0)
    inverse = np.linalg.inv(stiffness)
    middle, half = branch["P"].values[:, None] * inverse[0], np.abs(inverse) @ bounds
    assert branch["u_lower"].values[:, :2] == pytest.approx(middle - half, abs=1e-10)
    assert branch["u_upper"].values[:, :2] == pytest.approx(middle + half, abs=1e-10)
    assert branch["u"].values[:, :2] == pytest.approx(middle, abs=1e-10) and branch["stable"].values.all()
    assert not boundaries(branch)


def test_another_extreme_point_is_no_boundary() -> None:
    """The coupling c changes its sign, and with it the corner at which q1 is largest: (3 m + |c| n) / (6 - c^2)."""
    m, n = 0.5, 0.4
    system = ns.mechanical(
        np.eye(2),
        0.1 * np.eye(2),
        lambda p: [[2.0, p.c], [p.c, 3.0]],
        parameters={"c": -1.0},
        elements={"f": E.Coulomb(at="q1", friction=m), "g": E.Coulomb(at="q2", friction=n)},
    )
    branch = ns.continue_equilibrium(system, "c", (-1.5, 1.5), step=0.2)
    c = branch["c"].values
    assert c[[0, -1]] == pytest.approx([-1.5, 1.5])
    assert branch["u_upper"].values[:, 0] == pytest.approx((3 * m + np.abs(c) * n) / (6 - c**2), abs=1e-9)
    assert not ns.special_points(branch).sizes["special"]


def test_a_set_that_runs_into_another() -> None:
    """k < 0: beyond |P + |k| q| <= mu the stop at g holds the mass too; both are one where P + mu = |k| g."""
    k, mu, g = 0.5, 0.4, 1.0
    system = ns.mechanical(
        1.0,
        0.1,
        -k,
        parameters={"P": 0.5},
        forcing={"q": lambda t, p: p.P},
        coordinates=["q"],
        elements={"f": E.Coulomb(at="q", friction=mu), "s": E.Stop(at="q", position=g)},
    )
    branch = ns.continue_equilibrium(system, "P", (-0.6, 0.6), start={"q": g})
    ((name, P),) = boundaries(branch)
    assert name == "persistence" and pytest.approx(mu - k * g, abs=1e-7) == P
    P = branch["P"].values
    low, high = branch["u_lower"].values[:, 0], branch["u_upper"].values[:, 0]
    joined = P < mu - k * g - 1e-5
    assert high == pytest.approx(g, abs=1e-9) and joined.any()
    assert low[joined] == pytest.approx((-P[joined] - mu) / k, abs=1e-9)
    assert low[~joined & (P > mu - k * g + 1e-5)] == pytest.approx(g, abs=1e-9)


def test_a_pendulum_with_friction() -> None:
    """|T - sin q| <= mu about q = 0: asin(T - mu) to asin(T + mu), up to where one end turns."""
    pendulum = ns.System(
        states=["q", "v"],
        parameters={"T": 0.2},
        modes={"swing": lambda t, u, p: (u.v, p.T - np.sin(u.q))},
        elements={"f": E.Coulomb(speed=lambda t, u, p: u.v, on={"v": 1.0}, friction=MU)},
    )
    branch = ns.continue_equilibrium(pendulum, "T", (-0.45, 0.45))
    whole_range = branch["T"].values[[0, -1]]
    assert whole_range == pytest.approx([-0.45, 0.45])
    assert branch["u_lower"].values[:, 0] == pytest.approx(np.arcsin(branch["T"].values - MU), abs=1e-9)
    assert branch["u_upper"].values[:, 0] == pytest.approx(np.arcsin(branch["T"].values + MU), abs=1e-9)


def test_a_mass_that_is_pulled_away() -> None:
    """Without a spring it stands anywhere as long as |P| <= mu."""
    system = ns.mechanical(
        1.0,
        0.1,
        0.0,
        parameters={"P": 0.1},
        forcing={"q": lambda t, p: p.P},
        coordinates=["q"],
        elements={"f": E.Coulomb(at="q", friction=MU)},
    )
    branch = ns.continue_equilibrium(system, "P", (-1.0, 1.0), start={"q": 0.7})
    assert branch["P"].values[[0, -1]] == pytest.approx([-MU, MU], abs=1e-9)
    assert np.isinf(branch["u_upper"].values[:, 0]).all()
    assert all("boundary" in str(text) for text in branch["ended_because"].values)


# modes written out, and made when visited
@pytest.mark.parametrize("impacts", ["sequential", pytest.param("simultaneous", marks=pytest.mark.slow)])
def test_friction_between_two_walls(impacts: str) -> None:
    """The ends of what friction leaves are F -+ mu, cut off by the walls: along a branch, and where sweeps and basins
    end."""
    walls = {"up": ns.elements.Stop(at="q", position=1.0), "down": ns.elements.Stop(at="q", position=-1.0, side=-1)}
    system = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"F": 0.0, "mu": 0.2},
        forcing={"q": "F"},
        impacts=impacts,
        elements={"friction": ns.elements.Coulomb(at="q", friction="mu"), **walls},
    )
    branch = ns.continue_equilibrium(system, "F", (-1.5, 1.5), step=0.05)
    for side, sign in (("lower", -1.0), ("upper", 1.0)):
        ends = np.clip(branch.F + sign * 0.2, -1.0, 1.0)
        np.testing.assert_allclose(branch[f"u_{side}"].sel(state="q"), ends, atol=1e-9)
    np.testing.assert_allclose(ns.special_points(branch).F, [-1.2, -0.8, 0.8, 1.2], atol=1e-9)

    section, forces = ns.Poincare("friction_speed"), [0.1, 0.9, 1.4]
    box = {"q": (-0.9, 0.9), "v_q": (-1.0, 1.0)}
    found = ns.basin_fractions(system, "F", forces, box=box, n_starts=8, section=section, progress=False)
    np.testing.assert_array_equal(found.fraction, 1.0)
    swept = ns.sweep(
        system,
        "F",
        forces,
        direction=None,
        start={"q": 0.3, "v_q": 0.5},
        section=section,
        transient=20,
        keep=10,
        progress=False,
    )
    np.testing.assert_allclose(swept.equilibrium_minimum.sel(state="q"), [-0.1, 0.7, 1.0], atol=1e-9)
    np.testing.assert_allclose(swept.equilibrium_maximum.sel(state="q"), [0.3, 1.0, 1.0], atol=1e-9)


def test_equal_elements_on_other_springs() -> None:
    """Two systems that differ in what their modes hold beside elements: q = F / k in each."""
    for k in (1.0, 2.0):
        walls = [ns.elements.Stop(at="q", position=9.0), ns.elements.Stop(at="q", position=-9.0, side=-1)]
        system = ns.mechanical(
            1.0, 0.1, k, parameters={"F": 0.0}, forcing={"q": "F"}, impacts="sequential", elements=walls
        )
        branch = ns.continue_equilibrium(system, "F", (-1.0, 1.0))
        np.testing.assert_allclose(branch.u.sel(state="q"), branch.F / k, atol=1e-12)


def test_equal_systems_number_their_modes_themselves() -> None:
    """Whatever was visited first: the ends are F -+ mu before the elastic stop, and where it closes is found."""
    found = []
    for first in ({}, {"q": 0.9, "v_q": 3.0}):
        elements = {
            "friction": ns.elements.Coulomb(at="q", friction=0.2),
            "soft": ns.elements.ElasticStop(at="q", position=0.5, stiffness=2.0),
            "up": ns.elements.Stop(at="q", position=1.0),
            "down": ns.elements.Stop(at="q", position=-1.0, side=-1),
        }
        system = ns.mechanical(
            1.0, 0.1, 1.0, parameters={"F": 0.0}, forcing={"q": "F"}, impacts="sequential", elements=elements
        )
        if first:
            ns.simulate(system, duration=20.0, start=first)
        found.append(ns.continue_equilibrium(system, "F", (0.0, 0.6), step=0.1))
    for branch in found:
        q = branch.F.values[:, None] + np.array([-0.2, 0.2])
        ends = np.where(q > 0.5, (q + 1.0) / 3.0, q)  # q + 2 (q - 0.5) = F -+ mu
        np.testing.assert_allclose(branch.u_lower.sel(state="q"), ends[:, 0], atol=1e-9)
        np.testing.assert_allclose(branch.u_upper.sel(state="q"), ends[:, 1], atol=1e-9)
        np.testing.assert_allclose(ns.special_points(branch).F, [0.3], atol=1e-9)


def test_what_stands_moves_in_steps_of_its_place() -> None:
    """One mass dragged by a belt to mu / k while the other moves: no range of motion says how far it goes."""
    system = ns.mechanical(
        np.eye(2),
        0.2 * np.eye(2),
        np.eye(2),
        parameters={"mu": 2.0, "w": 0.8},
        forcing={"q1": lambda t, p: np.cos(p.w * t)},
        elements={"rub": E.Coulomb(at="q2", friction="mu", belt=1.0)},
    )
    branch = ns.continue_orbit(ns.find_orbit(system, start={"q2": 2.0}), "mu", (1.0, 3.0))
    assert branch.section.sel(state="q2").values == pytest.approx(branch.mu.values, abs=1e-12)
    assert [branch.mu.values.min(), branch.mu.values.max()] == pytest.approx([1.0, 3.0])
    assert branch.sizes["point"] < 60


@pytest.mark.parametrize("w", [1.3, 13.0])
def test_what_rests_all_the_time_has_multipliers_zero(w: float) -> None:
    """A mass pressed on a stop beside one that moves: x'' + .2 x' + 2 x = cos w t has exp(-.1 T) twice, the stop 0."""
    system = ns.mechanical(
        np.eye(2),
        np.diag([0.0, 0.2]),
        [[1.0, -1.0], [-1.0, 2.0]],
        parameters={"w": w, "P": 5.0},
        forcing={"q1": lambda t, p: p.P, "q2": lambda t, p: np.cos(p.w * t)},
        elements={"stop": E.Stop(at="q1", position=0.0, restitution=0.5)},
    )
    orbit = ns.find_orbit(system, progress=False)
    assert np.abs(orbit.floquet_multipliers) == pytest.approx([np.exp(-0.2 * np.pi / w)] * 2 + [0.0] * 2, abs=1e-7)
    branch = ns.continue_orbit(orbit, "P", (4.0, 6.0))
    assert np.abs(branch["floquet_multipliers"].values[:, 2:]).max() < 1e-12


@pytest.mark.parametrize("phase", [0.0, 2.0, 3.0])
def test_a_lift_off_into_a_short_flight_is_no_graze(phase: float) -> None:
    """A mass under weight 1 on a table A cos t: x'' + .1 x' + .3 x = A ((.3 - 1) cos t - .1 sin t) lifts off where the
    amplitude is 1, at A = sqrt 2, and nothing else happens on the branch, whatever its flights last."""
    system = ns.mechanical(
        1.0,
        0.1,
        0.3,
        parameters={"A": 1.45},
        forcing={"q": -1.0},
        elements={"table": E.Stop(at="q", position=lambda t, u, p: p.A * np.cos(t + phase), side=-1)},
        period=2 * np.pi,
    )
    start = {"q": 1.45 * np.cos(phase) + 0.1}
    branch = ns.continue_orbit(ns.find_orbit(system, start=start, transient=50), "A", (1.32, 2.4))
    assert branch["A"].values[[0, -1]] == pytest.approx([1.32, 2.4], abs=1e-12)
    special = ns.special_points(branch)
    assert special["kind"].values.tolist() == ["grazing"]
    assert special["A"].values == pytest.approx([np.sqrt(2)], abs=1e-9)


def test_what_lies_beyond_the_range_is_not_listed() -> None:
    """A mass on a table that is shaken by A cos t rests for A < 1: its flight grows like (A - 1)^(1/2), from A = 1."""
    floor = ns.elements.Stop(at="q", position=0.0, side=-1, restitution=0.0)
    system = ns.mechanical(
        1.0, 0.0, 0.0, parameters={"A": 1.2}, forcing={"q": lambda t, p: p.A * np.cos(t) - 1}, elements={"floor": floor}
    )
    orbit = ns.find_orbit(system, start={"q": 0.1}, transient=30)
    for low, kinds in ((1.0001, []), (0.95, ["grazing"])):
        branch = ns.continue_orbit(orbit, "A", (low, 2.2))
        assert branch["special_kind"].values.tolist() == kinds
        assert branch["special_value"].values == pytest.approx([1.0] * len(kinds), abs=1e-9)
        assert float(branch["A"].min()) == pytest.approx(low, abs=1e-12)
