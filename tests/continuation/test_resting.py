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
        1.0, 0.1, 2.0, parameters={"vd": 0.3}, elements={"f": E.Coulomb(at="q", friction=MU, belt="vd")},
        coordinates=["q"],
    )  # fmt: skip
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
    branch = ns.continue_equilibrium(system, "P", (-1.0, 4.0))
    whole(branch, -1.0, 4.0)
    P = branch["P"].values
    assert branch["u_upper"].values[:, 0] == pytest.approx(np.minimum((P + MU) / 2, 1.0), abs=1e-9)
    assert branch["u_lower"].values[:, 0] == pytest.approx(np.minimum((P - MU) / 2, 1.0), abs=1e-9)
    assert boundaries(branch) == [
        ("persistence", pytest.approx(2.0 - MU, abs=1e-9)), ("persistence", pytest.approx(2.0 + MU, abs=1e-9)),
    ]  # fmt: skip


def test_two_equilibria_that_vanish_at_a_boundary() -> None:
    """x' = mu + x below 0 and mu - x above: x = -mu and x = mu, both for mu > 0 only: a non-smooth fold."""
    system = ns.System(
        states=["x"], parameters={"mu": 0.5},
        modes={"below": lambda t, u, p: (p.mu + u.x,), "above": lambda t, u, p: (p.mu - u.x,)},
        indicators={"side": lambda t, u, p: u.x},
        transitions=[
            ns.Transition("below", "above", when="side > 0"), ns.Transition("above", "below", when="side < 0"),
        ],
    )  # fmt: skip
    branch = ns.continue_equilibrium(system, "mu", (-1.0, 1.0), start={"x": -0.4})
    special = ns.special_points(branch)
    assert special["boundary"].values.tolist() == ["non_smooth_fold"]
    assert float(special["mu"][0]) == pytest.approx(0.0, abs=1e-12)
    assert branch["u"].values[[0, -1], 0] == pytest.approx([1.0, -1.0]) and (branch["mu"].values >= -1e-12).all()
