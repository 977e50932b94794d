"""Equilibria and sets of them as attractors, against the force balances that define them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

E = ns.elements
MU, K = 0.5, 2.0
GRID = {"q": np.linspace(-1.4, 0.9, 13), "v_q": np.linspace(-1.5, 1.5, 13)}


def rubbed(**forcing: Any) -> ns.System:
    return ns.mechanical(
        1.0,
        0.1,
        K,
        parameters={"mu": MU, "F": 0.3, "w": 1.0},
        elements={"f": E.Coulomb(at="q", friction="mu")},
        coordinates=["q"],
        **forcing,
    )


FREE = rubbed()
FORCED = rubbed(forcing={"q": lambda t, p: p.F * np.cos(p.w * t)})
STOPPED = ns.Poincare("f_speed")


@pytest.mark.parametrize("method", ["auto", "taylor"])
def test_every_start_of_a_friction_oscillator_comes_to_stand(method: str) -> None:
    """The ends are +-mu / k; a start within that is there already."""
    found = ns.basins(FREE, GRID, section=STOPPED, method=method, progress=False)
    assert (found["label"].values == 0).all() and (found["status"].values == 0).all()
    assert found["fraction"].values.tolist() == [1.0] and found["name"].values.tolist() == ["equilibria in f_stick"]
    assert found["period_number"].values.tolist() == [1] and found["lyapunov"].values.tolist() == [0.0]
    assert found["minimum"].values[0] == pytest.approx([-MU / K, 0.0], abs=1e-12)
    assert found["maximum"].values[0] == pytest.approx([MU / K, 0.0], abs=1e-12)
    assert ns.plot.basins(found) is not None


def test_shares_over_the_friction() -> None:
    mu = np.array([0.2, 0.5, 0.8])
    found = ns.basin_fractions(
        FREE, "mu", mu, n_starts=300, box={"q": (-2, 2), "v_q": (-2, 2)}, section=STOPPED, progress=False
    )
    assert found["fraction"].values.ravel().tolist() == [1.0] * 3
    assert set(found["name"].values.ravel()) == {"equilibria in f_stick"}
    assert found["maximum"].values[:, 0, 0] == pytest.approx(mu / K, abs=1e-12)
    assert (found["not_converged"].values == 0).all()
    assert ns.plot.basin_fractions(found) is not None


def test_a_forcing_below_friction() -> None:
    """It stands where |F cos wt - k q| <= mu at all times: |q| <= (mu - F) / k. Some creep to the ends."""
    found = ns.basins(FORCED, GRID, progress=False)
    assert (found["label"].values == 0).all()
    assert found["maximum"].values[0, 0] == pytest.approx((MU - 0.3) / K, abs=1e-7)


@pytest.mark.parametrize("method", ["auto", "taylor", "rkf45"])
def test_a_mass_that_stands_has_period_1(method: str) -> None:
    """From rest it does not move at all; above F = mu it does."""
    swept = ns.sweep(FORCED, "F", [0.1, 0.4, 0.7], method=method, direction=None, progress=False)
    assert swept["period_number"].values.tolist() == [1, 1, 1] and (swept["status"].values == 0).all()
    assert swept["equilibrium"].values.tolist() == ["equilibria in f_stick"] * 2 + [""]
    ends = swept["equilibrium_maximum"].values[:2, 0]
    assert ends == pytest.approx((MU - swept["F"].values[:2]) / K, abs=1e-7)
    assert np.isnan(swept["equilibrium_maximum"].values[2]).all()
    assert (swept["maximum"].values[:2] == 0.0).all() and swept["maximum"].values[2, 0] > 0.1


@pytest.mark.parametrize("method", ["auto", "taylor"])
def test_a_mass_that_rides_on_a_belt_has_period_1(method: Any) -> None:
    """Wherever it is held, it goes to and fro by 2 / (10 w), and so does every neighbour: one attractor, not many."""
    riding = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"w": 1.3},
        elements={
            "f": E.Coulomb(at="q", friction=0.5, belt=lambda t, u, p: 0.1 * np.cos(p.w * t)),
            "s": E.Stop(at="q", position=1.5),
        },
        coordinates=["q"],
    )
    swept = ns.sweep(riding, "w", [1.1, 1.3], method=method, progress=False)
    assert (swept["period_number"] == 1).all() and (swept["status"] == 0).all()
    assert (swept["maximum"] - swept["minimum"]).values[:, 0] == pytest.approx(0.2 / swept["w"].values, rel=1e-6)
    grid = {"q": np.linspace(-0.2, 0.3, 4), "v_q": np.linspace(-0.5, 0.5, 3)}
    found = ns.basins(riding, grid, method=method, progress=False)
    assert (found["label"].values == 0).all() and found["name"].values.tolist() == ["period 1"]


def test_a_sweep_without_forcing_ends_at_rest() -> None:
    """Undamped, from q0 within 3 mu / k it swings once about mu / k, to 2 mu / k - q0, and stays."""
    bare = ns.mechanical(
        1.0, 0.0, K, parameters={"mu": MU}, elements={"f": E.Coulomb(at="q", friction="mu")}, coordinates=["q"]
    )
    swept = ns.sweep(bare, "mu", [0.4, MU], start={"q": 0.4}, section=STOPPED, direction=None, progress=False)
    assert swept["section"].values[:, -1, 0] == pytest.approx(2 * swept["mu"].values / K - 0.4, abs=1e-9)
    assert swept["period_number"].values.tolist() == [1, 1]
    assert swept["equilibrium_minimum"].values[:, 0] == pytest.approx(-swept["mu"].values / K)


def test_what_sticks_for_good_beside_what_moves() -> None:
    """One mass sticks, one is driven: cycles that differ in where the first one stands are one attractor."""
    system = ns.mechanical(
        np.eye(2),
        0.1 * np.eye(2),
        [[3.0, -1.0], [-1.0, 2.0]],
        parameters={"F": 0.3, "w": 1.0},
        forcing={"q2": lambda t, p: p.F * np.cos(p.w * t)},
        elements={"f": E.Coulomb(at="q1", friction=1.5)},
    )
    grid = {"q1": np.linspace(-0.2, 0.2, 5), "q2": np.linspace(-0.2, 0.2, 3)}
    found = ns.basins(system, grid, progress=False)
    assert (found["label"].values == 0).all() and found["name"].values.tolist() == ["period 1"]
    assert found["maximum"].values[0, 0] >= 0.2 and found["minimum"].values[0, 0] <= -0.2
    # q2'' + .1 q2' + 2 q2 = F cos wt + q1: its own decay
    assert found["lyapunov"].values[0] == pytest.approx(-0.05, abs=1e-6)


def test_rest_against_either_of_two_stops() -> None:
    """q'' = q - .1 q' between stops: the middle is unstable, both stops draw in."""
    system = ns.mechanical(
        1.0,
        0.1,
        -1.0,
        coordinates=["q"],
        elements={
            "a": E.Stop(at="q", position=1.0, restitution=0.5),
            "b": E.Stop(at="q", position=-1.5, side=-1, restitution=0.5),
        },
    )
    grid = {"q": np.linspace(-1.4, 0.9, 8), "v_q": np.linspace(-0.4, 0.4, 6)}
    found = ns.basins(system, grid, section=ns.Poincare("a_gap"), progress=False)
    assert sorted(found["name"].values) == ["equilibrium in a_open_b_rest", "equilibrium in a_rest_b_open"]
    assert sorted(found["section"].values[:, 0]) == pytest.approx([-1.5, 1.0], abs=1e-9)
    assert found["fraction"].values.sum() == pytest.approx(1.0)


def told_by_memory(**shape: Any) -> ns.System:
    """x'' + 2 c x' + x = d, c = 0.05 and d = 0, but 0.3 and ``where`` for whatever has once passed x = 1."""
    where = shape.pop("where")

    def field(t: Any, u: Any, p: Any) -> Any:
        return u.v, p.d - u.x - 2 * p.c * u.v

    return ns.System(
        states=["x", "v"],
        parameters={"k": 1.0},
        memory={"c": 0.05, "d": 0.0},
        modes={"before": field, "behind": field},
        indicators={"speed": lambda t, u, p: u.v, "far": lambda t, u, p: u.x - 1.0},
        transitions=[
            ns.Transition(
                "before", "behind", when="far > 0", write={"c": lambda t, u, p: 0.3, "d": lambda t, u, p: where}
            )
        ],
        **shape,
    )


def test_equilibria_are_those_of_the_memory_with_which_runs_end() -> None:
    """One place, and two dampings; two places."""
    plane = {"x": [-2.0, 0.5], "v": [-0.1, 0.2]}
    found = ns.basins(told_by_memory(where=0.0), plane, section=ns.Poincare("speed"), progress=False)
    assert found["label"].values.tolist() == [[0, 0], [1, 1]]
    assert found["lyapunov"].values == pytest.approx([-0.3, -0.05], abs=1e-12)
    system = told_by_memory(where=0.5, period=1.0)
    found = ns.basins(system, plane, progress=False)
    assert found["label"].values.tolist() == [[0, 0], [1, 1]]
    assert found["maximum"].sel(state="x").values == pytest.approx([0.5, 0.0], abs=1e-12)
    assert found["lyapunov"].values == pytest.approx([-0.3, -0.05], abs=1e-6)
    swept = ns.sweep(system, "k", [1.0, 2.0], start=[{"x": -2.0}, {"x": 0.5}], direction="both", progress=False)
    assert (swept["equilibrium"] == "equilibrium in before").all()
    ends = swept["equilibrium_minimum"].sel(state="x")
    assert ends.values == pytest.approx(np.full(ends.shape, [0.5, 0.0]), abs=1e-12)


def test_a_memory_that_no_equation_knows_tells_no_equilibria_apart() -> None:
    """It counts how often a mass that is pulled to 0 has passed 0.5 on its way."""
    modes = {name: lambda t, u, p: (u.v, -u.x - 0.4 * u.v) for name in ("left", "right")}
    system = ns.System(
        states=["x", "v"],
        parameters={"k": 1.0},
        memory={"passes": 0.0},
        modes=modes,
        indicators={"place": lambda t, u, p: u.x - 0.5},
        transitions=[
            ns.Transition("left", "right", when="place > 0", write={"passes": lambda t, u, p: p.passes + 1}),
            ns.Transition("right", "left", when="place < 0"),
        ],
        period=1.0,
    )
    found = ns.basins(system, {"x": [-4.0, -1.5, 0.2], "v": [0.0, 0.1]}, progress=False)
    assert (found["label"] == 0).all() and found["fraction"].values.tolist() == [1.0]


def test_what_friction_holds_anywhere_is_one_attractor_of_a_chart() -> None:
    """Masses under forces below friction stay where they start, on one set of equilibria."""
    system = rubbed(forcing={"q": lambda t, p: p.F * np.cos(p.w * t)})
    starts = [{"q": -0.05}, {"q": 0.0}, {"q": 0.08}]
    found = ns.chart(system, {"F": [0.1, 0.2], "w": [1.0, 1.3]}, start=starts, transient=50, progress=False)
    assert (found["period_number"] == 1).all() and (found["n_attractors"] == 1).all()
