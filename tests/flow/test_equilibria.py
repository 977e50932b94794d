"""Equilibria against closed forms, and what the verbs say of a run that begins at one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.flow.equilibria import equilibrium_at

SECTION = ns.Poincare("rate")


def line(a: float, c: float) -> ns.System:
    """x'' = a x - c x': eigenvalues (-c +- sqrt(c^2 + 4 a)) / 2."""
    return ns.System(
        name="line",
        states=["x", "v"],
        parameters={"a": a, "c": c},
        modes={"all": lambda t, u, p: (u.v, p.a * u.x - p.c * u.v)},
        indicators={"rate": lambda t, u, p: u.v},
    )


def lorenz(r: float) -> ns.System:
    return ns.System(
        states=["x", "y", "z"],
        parameters={"s": 10.0, "r": r, "b": 8 / 3},
        modes={"all": lambda t, u, p: (p.s * (u.y - u.x), u.x * (p.r - u.z) - u.y, u.x * u.y - p.b * u.z)},
    )


def at(system: ns.System, *u: float, **options: Any) -> Any:
    return equilibrium_at(system, np.array(u), 0, **options)


def test_eigenvalues_of_the_lorenz_system() -> None:
    origin, c = at(lorenz(28.0), 0.0, 0.0, 0.0), np.sqrt(72.0)
    root = np.sqrt(1201.0)
    expected = [0.5 * (-11 + root), -8 / 3, 0.5 * (-11 - root)]
    assert np.allclose(origin.eigenvalues, expected, rtol=1e-13) and origin.kind == "unstable"
    # beside C+ the place is corrected: lambda^3 + (41/3) lambda^2 + (b (r + s)) lambda + 2 b s (r - 1) = 0
    beside = at(lorenz(28.0), c, c + 1e-7, 27.0)
    roots = np.roots([1.0, 41 / 3, 8 / 3 * 38.0, 1440.0])
    assert np.abs(np.sort_complex(beside.eigenvalues) - np.sort_complex(roots)).max() < 1e-9
    assert np.abs(beside.u - [c, c, 27.0]).max() < 1e-12 and beside.kind == "unstable"
    assert at(lorenz(28.0), c, c + 1e-4, 27.0) is None
    assert at(lorenz(0.5), 0.0, 0.0, 0.0).kind == "stable"
    assert at(lorenz(1.0), 0.0, 0.0, 0.0).kind == "undecided"  # a pitchfork: an eigenvalue 0


def test_a_tank_that_runs_empty_has_no_linearisation_there() -> None:
    """Torricelli's x' = -a sqrt(x): at x = 0 it stands, with an infinite slope."""
    tank = ns.System(states=["x"], parameters={"a": 1.0}, modes={"all": lambda t, u, p: -p.a * np.sqrt(u.x)})
    with np.errstate(all="ignore"):
        assert at(tank, 0.0) is None


@pytest.mark.parametrize("frequency", [1e-4, 1.0, 1e4])
def test_stability_is_the_same_in_every_unit_of_time(frequency: float) -> None:
    """x'' = -w^2 x - 2 D w x': the eigenvalues' real parts are -D w."""
    for damping, kind in ((1e-3, "stable"), (-1e-3, "unstable"), (1e-12, "undecided")):
        assert at(line(-(frequency**2), 2 * damping * frequency), 0.0, 0.0).kind == kind


def test_a_boundary_and_what_lies_beyond_it() -> None:
    """x' = -x below the boundary x = b: at b = 0 no eigenvalue decides, at b < 0 a transition leads away."""
    system = ns.System(
        states=["x"],
        parameters={"b": 1.0},
        modes={"low": lambda t, u, p: -u.x, "high": lambda t, u, p: 2 * u.x},
        indicators={"beyond": lambda t, u, p: u.x - p.b},
        transitions=[ns.Transition("low", "high", when="beyond > 0"), ns.Transition("high", "low", when="beyond < 0")],
    )
    assert at(system, 0.0).kind == "stable"
    assert at(system.with_parameters(b=0.0), 0.0).kind == "undecided"
    assert at(system.with_parameters(b=-1.0), 0.0) is None


def test_under_a_forcing() -> None:
    """x' = (a + b cos t) x has the multiplier exp(2 pi a); a force beside it moves the state."""
    system = ns.System(
        states=["x"],
        parameters={"a": 0.1, "b": 2.0, "f": 0.0},
        modes={"all": lambda t, u, p: (p.a + p.b * np.cos(t)) * u.x + p.f * np.sin(t)},
    )
    for a, kind in ((0.1, "unstable"), (-0.1, "stable"), (0.0, "undecided")):
        found = at(system.with_parameters(a=a), 0.0)
        assert found.kind == kind and abs(found.eigenvalues[0] - a) < 1e-4
    assert at(system.with_parameters(f=1.0), 0.0) is None


def test_a_run_that_stays_at_its_start_says_so(recwarn: pytest.WarningsRecorder) -> None:
    stays = ns.simulate(line(-2.0, 3.0), duration=1.0)
    assert "x = 0, v = 0 (mode 'all') is a stable equilibrium, eigenvalues -1, -2" in stays.attrs["note"]
    assert "note" not in ns.simulate(line(2.0, 1.0), duration=1.0, start={"x": 1e-9}).attrs
    # a whole period of a centre: the first and the last state are one, the run moves
    assert "note" not in ns.simulate(line(-1.0, 0.0), duration=2 * np.pi, start={"x": 1.0}, samples=2).attrs
    assert not recwarn.list
    with pytest.warns(UserWarning, match=r"unstable equilibrium, eigenvalues 1, -2: .* start="):
        saddle = ns.simulate(line(2.0, 1.0), duration=1.0)
    assert "an unstable equilibrium, eigenvalues 1, -2" in saddle.attrs["note"]


@pytest.mark.parametrize(
    "call",
    [
        lambda system: ns.poincare(system, section=SECTION),
        lambda system: ns.sweep(system, "a", [1.0, 2.0, 3.0], section=SECTION, progress=False),
        lambda system: ns.chart(system, {"a": [1.0, 2.0], "c": [1.0, 2.0]}, section=SECTION, progress=False),
    ],
    ids=["poincare", "sweep", "chart"],
)
def test_from_an_equilibrium_no_section_is_met(call: Any) -> None:
    with pytest.raises(ValueError, match=r"of 'line' from an equilibrium: x = 0, v = 0 .* is an unstable .* start="):
        call(line(2.0, 1.0))
