"""A search that cannot succeed ends with a status and a sentence: no traceback from Newton, no silent half branch."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import reference_values as known
import xarray as xr

import nonsmooth as ns
from nonsmooth.continuation.events.of_orbits import ENDINGS
from nonsmooth.continuation.problems.curve import Curve
from nonsmooth.continuation.problems.equilibrium import Equilibria
from nonsmooth.continuation.problems.locus import Locus

support = ns.models.discontinuous_support


def ends(branch: object) -> list[str]:
    words = list(ENDINGS)
    return [words[int(i)] for i in branch["ended"].values]


def test_a_chaotic_start() -> None:
    with pytest.raises(ns.SolveError, match="period_number=") as caught:
        ns.find_orbit(support(rho=0.22, omega=3.69, g=-0.0045))
    assert caught.value.status == "not_periodic"


def test_an_unstable_orbit_within_chaos() -> None:
    """Given its period number, Newton finds the saddle; it lies on the branch that comes from the stable side."""
    system = support(rho=0.22, omega=3.69, g=-0.0045)
    orbit = ns.find_orbit(system, period_number=1)
    assert not orbit.stable and not orbit.virtual
    branch = ns.continue_orbit(ns.find_orbit(system.with_parameters(rho=0.45)), "rho", (0.22, 0.5))
    assert branch["section"].values[0] == pytest.approx(orbit.u, abs=1e-10)


def test_an_equilibrium_is_no_cycle() -> None:
    with pytest.raises(ns.SolveError, match="equilibrium"):
        ns.find_orbit(ns.models.relief_valve(q=9.5), start={"y1": 0.2, "y2": 0.0, "y3": 10.0})


def test_an_unstable_orbit_whose_motion_diverges() -> None:
    """x' = x + cos t has the orbit (sin t - cos t) / 2 with the multiplier exp(2 pi); the motion leaves it.

    (A second state: a shape of code that is there.)"""
    system = ns.System(states=["x", "y"], parameters={}, modes={"one": lambda t, u, p: (u.x + np.cos(t), -u.y)})
    orbit = ns.find_orbit(system, start={"x": -0.5}, transient=0, period_number=1)
    assert orbit.u == pytest.approx([-0.5, 0.0], abs=1e-12)
    assert orbit.floquet_multipliers == pytest.approx([np.exp(2 * np.pi), np.exp(-2 * np.pi)], rel=1e-10)


def test_a_branch_that_is_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C raises with what was found, which goes on from there to the same ends, interrupted again on the way."""
    orbit = ns.find_orbit(support(rho=0.14, g=0.02, omega=3.3))
    whole = ns.continue_orbit(orbit, "omega", (3.0, 3.5))
    _interrupt_after(5, Curve, monkeypatch)
    with pytest.raises(ns.Interrupted, match=r"continue_orbit\(branch\). Its \d+ points are in `result`") as first:
        ns.continue_orbit(orbit, "omega", (3.0, 3.5))
    monkeypatch.undo()
    assert isinstance(first.value, KeyboardInterrupt)
    _interrupt_after(5, Curve, monkeypatch)
    with pytest.raises(ns.Interrupted) as second:  # Ctrl-C on the first side ends the second one too
        ns.continue_orbit(first.value.result)
    monkeypatch.undo()
    part = second.value.result
    assert first.value.result.sizes["point"] < part.sizes["point"] <= first.value.result.sizes["point"] + 10
    assert ends(part) == ["interrupted", "interrupted"] and 3 < part.sizes["point"] < whole.sizes["point"]
    rest = ns.continue_orbit(part)
    assert ends(rest) == ends(whole) and rest["omega"].values[[0, -1]] == pytest.approx(whole["omega"].values[[0, -1]])
    assert ns.special_points(rest)["omega"].values == pytest.approx(ns.special_points(whole)["omega"].values, abs=1e-9)


def test_a_curve_that_is_interrupted(flip: xr.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C raises with what was found, and its end says so."""
    _interrupt_after(5, Locus, monkeypatch)
    with pytest.raises(ns.Interrupted) as raised:
        ns.continue_curve(flip, {"omega": (3.9, 5.0), "rho": (0.1, 0.2)})
    assert "continue_orbit" not in str(raised.value)  # which goes on with orbits of one parameter
    curve = raised.value.result
    assert curve.sizes["point"] == 6  # the first, and one for each step
    assert [str(text)[:11] for text in curve["ended_because"].values] == ["Interrupted"] * 2


def test_a_branch_of_equilibria_that_is_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    """x^2 = a has equilibria at x = -sqrt(a) and sqrt(a)."""
    system = ns.System(states=["x"], parameters={"a": 1.0}, modes={"one": lambda t, u, p: p.a - u.x * u.x})
    _interrupt_after(4, Equilibria, monkeypatch)
    with pytest.raises(ns.Interrupted) as raised:
        ns.continue_equilibrium(system, "a", (0.5, 2.0), start={"x": 0.9})
    branch = raised.value.result
    assert branch.sizes["point"] == 5
    assert branch["u"].values[:, 0] == pytest.approx(np.sqrt(branch["a"].values), abs=1e-12)
    assert [str(text)[:11] for text in branch["ended_because"].values] == ["Interrupted"] * 2


def _interrupt_after(n: int, owner: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C once, at the step after the n-th."""
    steps, step = iter(range(n + 1)), owner.step

    def interrupted(*arguments: Any, **options: Any) -> Any:
        if next(steps, None) == n:
            raise KeyboardInterrupt
        return step(*arguments, **options)

    monkeypatch.setattr(owner, "step", interrupted)


def test_a_start_beyond_a_stop() -> None:
    with pytest.raises(ns.SolveError, match="stop"):
        ns.find_orbit(ns.models.impact_oscillator(), start={"x": 2.0})


def test_an_orbit_that_grazes_at_the_start() -> None:
    """At the grazing frequency itself: the branch goes both ways, and the graze is reported."""
    graze = known.grazing_frequencies(0.14, 0.02)[0]
    orbit = ns.find_orbit(support(rho=0.14, g=0.02, omega=graze), period_number=1)
    assert abs(orbit.clearance["penetration"]) < 1e-12
    branch = ns.continue_orbit(orbit, "omega", (3.4, 3.7))
    special = ns.special_points(branch)
    found = special["omega"].values[special["kind"].values == "grazing"]
    assert found == pytest.approx([graze], abs=1e-9)
    assert float(branch["omega"].min()) == pytest.approx(3.4) and float(branch["omega"].max()) == pytest.approx(3.7)
    assert set(np.unique(branch["contacts_per_period"])) == {0.0, 1.0}


@pytest.mark.parametrize("shift", [0.0, 1e-14, -1e-14])
def test_an_orbit_that_is_a_flip_at_the_start(shift: float) -> None:
    """Begun at the flip itself the branch reports it once, whatever rounding says."""
    system = support(rho=0.14, g=0.02)
    plain = ns.continue_orbit(ns.find_orbit(system.with_parameters(omega=4.5)), "omega", (3.9, 5.0))
    special = ns.special_points(plain)
    row = special.isel(special=int(np.flatnonzero(special["kind"].values == "flip")[0]))
    at = system.with_parameters(omega=float(row["omega"]) + shift)
    orbit = ns.find_orbit(at, start=row["section"].values, period_number=1, transient=0)
    found = ns.special_points(ns.continue_orbit(orbit, "omega", (3.9, 4.3)))
    values = found["omega"].values[found["kind"].values == "flip"]
    assert values == pytest.approx([float(row["omega"])], abs=1e-9)


def test_a_range_that_leaves_the_physical_region() -> None:
    """A mass that would become negative, a period without end: the range is cut, and the end says so."""
    orbit = ns.find_orbit(support(rho=0.14, g=0.02, omega=3.3))
    for name, limits in (("m", (-0.5, 1.0)), ("omega", (-1.0, 4.0))):
        branch = ns.continue_orbit(orbit, name, limits, points=150)
        assert float(branch[name].min()) > 0.0
        assert "allow" in str(branch["ended_because"].values[0]) or ends(branch)[0] in ("points", "no_convergence")
        assert all(str(text) for text in branch["ended_because"].values)


@pytest.mark.parametrize(("asked", "begun", "edge"), [((0.2, 0.4), 0.38, 0.3), ((0.2, 0.5), 0.32, 0.4)])
def test_the_end_says_where_the_equations_end_it(asked: tuple[float, float], begun: float, edge: float) -> None:
    """A forcing of sqrt(a - 0.3) or sqrt(0.4 - a): one end of the range lies beyond."""
    side = 1.0 if edge == 0.3 else -1.0
    system = ns.mechanical(
        1.0,
        0.2,
        4.0,
        parameters={"a": begun, "omega": 1.0},
        forcing={"x": lambda t, p: np.sqrt(side * (p.a - edge)) * np.cos(p.omega * t)},
        coordinates=["x"],
    )
    branch = ns.continue_orbit(ns.find_orbit(system), "a", asked)
    end = 0 if edge == 0.3 else -1
    assert ends(branch)[end] == "physical"
    assert ends(branch)[-1 - end] == "range"
    assert 0.0 < side * (float(branch["a"][end]) - edge) < 2e-4


def test_a_fold_at_the_edge_of_the_range() -> None:
    """The range ends exactly at the fold: the branch ends there or just turns, and says which."""
    fold = known.FOLDS["figure 9 rising"]
    orbit = ns.find_orbit(support(rho=0.14, g=0.02, omega=4.5))
    for edge in (fold, fold - 1e-9, fold + 1e-9):
        branch = ns.continue_orbit(orbit, "omega", (4.0, edge))
        assert set(ends(branch)) <= {"range", "grazing"}
        assert float(branch["omega"].max()) <= edge + 1e-12
        assert np.isfinite(branch["section"].values).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("omegas", (3.0, 4.0)), "parameter"),
        (("omega", (5.0, 6.0)), "outside"),
        (("omega", (4.0, 3.0)), "below"),
        (("omega", 3.0), "two ends"),
        ((), "which parameter"),
    ],
)
def test_wrong_arguments(arguments: tuple[object, ...], words: str) -> None:
    orbit = ns.find_orbit(support(rho=0.14, g=0.02, omega=3.3))
    with pytest.raises((ValueError, TypeError), match=words):
        ns.continue_orbit(orbit, *arguments)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"range": 3.0}, "two ends"),
        ({"range": (0.5, 1.5, 2.0)}, "two ends"),
        ({"range": (2.0, 0.5)}, "below"),
        ({"range": (2.0, 3.0)}, "the system lies at a = 1.0, outside"),
        ({"step": 0}, "must be at least"),
        ({"step": -0.1}, "must be at least"),
    ],
)
def test_wrong_arguments_of_an_equilibrium(options: dict[str, Any], words: str) -> None:
    system = ns.System(states=["x"], parameters={"a": 1.0}, modes={"one": lambda t, u, p: p.a - u.x * u.x})
    with pytest.raises(ValueError, match=words):
        ns.continue_equilibrium(system, "a", **{"range": (0.5, 2.0), "start": {"x": 0.9}, **options})


@pytest.mark.parametrize(
    ("ranges", "options", "words"),
    [
        ({"omega": (3.9, 5.0), "rho": 0.2}, {}, "rho.* = 0.2: give its two ends"),
        ({"omega": (3.9, 5.0), "rho": (0.2, 0.1)}, {}, "below"),
        ({"omega": (3.9, 5.0), "rho": (0.2, 0.3)}, {}, "the special point lies at rho = 0.14, outside"),
        ({"omega": (3.9, 5.0), "roh": (0.1, 0.3)}, {}, "nearest: rho"),
        ({"omega": (3.9, 5.0)}, {}, "two parameters"),
        ({"omega": (3.9, 5.0), "rho": (0.1, 0.3)}, {"step": 0}, "must be at least"),
    ],
)
def test_wrong_arguments_of_a_curve(ranges: Any, options: dict[str, Any], words: str, flip: xr.Dataset) -> None:
    with pytest.raises(ValueError, match=words):
        ns.continue_curve(flip, ranges, **options)


@pytest.fixture(scope="module")
def flip() -> xr.Dataset:
    branch = ns.continue_orbit(ns.find_orbit(support(rho=0.14, g=0.02, omega=4.5)), "omega", (3.9, 5.0))
    row = ns.special_points(branch).isel(special=0)
    assert str(row["kind"].values) == "flip"
    return row


def test_what_is_no_orbit() -> None:
    with pytest.raises(TypeError, match="Orbit"):
        ns.continue_orbit(3.0, "omega", (3.0, 4.0))
    with pytest.raises(TypeError, match="branch"):
        ns.special_points({})
    with pytest.raises(TypeError):
        ns.find_orbit("discontinuous_support")


def test_switching_where_nothing_branches() -> None:
    branch = ns.continue_orbit(ns.find_orbit(support(rho=0.14, g=0.02, omega=3.3)), "omega", (3.0, 7.0))
    special = ns.special_points(branch)
    row = special.isel(special=int(np.flatnonzero(special["kind"].values == "fold")[0]))
    with pytest.raises(ValueError, match="no other branch"):
        ns.continue_orbit(row)
    with pytest.raises(ValueError, match="one special point"):
        ns.continue_orbit(special)


@pytest.mark.parametrize("high", [0.8109045226130653, 0.8181407035175879, 0.8231155778894473])
def test_the_last_orbit_lies_at_the_edge_to_the_last_digit(high: float) -> None:
    """An orbit found there is within the same range."""
    system = ns.models.impact_oscillator(omega=0.8, c=0.2, d=2.0)
    limits = 0.7999, high
    branch = ns.continue_orbit(ns.find_orbit(system, progress=False), "omega", limits, step=0.5)
    assert branch["omega"].values[[0, -1]].tolist() == list(limits)
