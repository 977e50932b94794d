"""Derivatives where transitions happen at one instant, each by itself: side by side as alone, else with a warning."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics


def hopping(count: int, friction: float | None, coupling: float = 0.0) -> tuple[ns.System, dict[str, float]]:
    """Balls that fall and bounce at the same instants, on a floor that may rub, and a start."""
    names = [f"{axis}{i}" for i in range(count) for axis in "xy"]
    system = ns.mechanical(
        np.eye(2 * count),
        0.1 * np.eye(2 * count) + coupling,
        np.diag([1.0, 0.0] * count),
        parameters={},
        coordinates=names,
        period=2 * np.pi,
        forcing={f"y{i}": lambda t, p: -1.0 - 0.3 * np.cos(t) for i in range(count)},
        elements={
            f"s{i}": ns.elements.Stop(
                at=f"y{i}", side=-1, restitution=0.6, friction=friction, tangent=f"x{i}" if friction else None
            )
            for i in range(count)
        },
    )
    return system, {name: 0.2 if name[0] == "x" else 0.5 for name in names}


def derivatives(system: ns.System, start: dict[str, float], states: list[str]) -> np.ndarray:
    found = ns.sensitivity(system, periods=0.4, start=start).Phi
    return np.asarray(found.sel(state=states, initial_state=states).values)


@pytest.mark.parametrize("visited", [True, False])
@pytest.mark.parametrize("friction", [None, 0.2])
def test_side_by_side_each_has_the_derivatives_that_it_has_alone(
    friction: float | None, visited: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if visited:
        monkeypatch.setattr("nonsmooth.system.derived.combinations.MOST", 1)
    order = [f"{v}{axis}{i}" for i in range(2) for v in ("", "v_") for axis in "xy"]
    alone = derivatives(*hopping(1, friction), order[:4])
    assert np.abs(alone).max() > 1.5  # impacts are there
    system, start = hopping(2, friction)
    system = system if visited else system.written_out()
    assert derivatives(system, start, order) == pytest.approx(np.kron(np.eye(2), alone), abs=1e-12)


def test_those_that_depend_on_an_order_are_warned_of() -> None:
    with pytest.warns(RuntimeWarning, match="two transitions happen at one instant, each by itself"):
        derivatives(*hopping(2, None, coupling=0.05), ["x0"])


def exponents(count: int, friction: float | None, method: str) -> np.ndarray:
    """Of balls on springs that bounce once in a period, on a floor that may rub; they do not come to rest."""
    names = [f"{axis}{i}" for i in range(count) for axis in "xy"]
    system = ns.mechanical(
        np.eye(2 * count),
        0.1 * np.eye(2 * count),
        np.eye(2 * count),
        parameters={},
        coordinates=names,
        period=np.pi,
        forcing={name: (lambda t, p, a=(0.5 if name[0] == "x" else 2.0): a * np.cos(2 * t)) for name in names},
        elements={
            f"s{i}": ns.elements.Stop(
                at=f"y{i}",
                side=-1,
                position=-0.1,
                restitution=0.8,
                friction=friction,
                tangent=f"x{i}" if friction else None,
            )
            for i in range(count)
        },
    )
    start = {name: 0.2 if name[0] == "x" else 0.5 for name in names}
    found = ns.lyapunov(system, periods=60, transient=20, start=start, method=method, progress=False)
    return np.sort(np.exp(found.exponents.values))  # of a rate that an impact takes away: 0


@pytest.mark.parametrize(
    ("friction", "method", "visited"),
    [(None, "exact", False), (None, "exact", True), (None, "taylor", False), (0.2, "exact", True)],
)
def test_side_by_side_each_has_the_exponents_that_it_has_alone(
    friction: float | None, method: str, visited: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both impacts have an instant of their own, whether they rub or not; as one, exponents were off by up to 4 %."""
    if visited:
        monkeypatch.setattr("nonsmooth.system.derived.combinations.MOST", 1)
    alone = exponents(1, friction, method)
    assert exponents(2, friction, method) == pytest.approx(np.repeat(alone, 2), abs=1e-9)


def struck_and_turned(count: int, hardening: float) -> ns.System:
    """Masses on springs with a stop and dry friction each: an impact turns the friction of its own mass."""

    def field(t: Any, u: Any, p: Any) -> list[Any]:
        q, v = list(u)[:count], list(u)[count:]
        return [*v, *(p.F * np.cos(1.7 * t) - 0.1 * w - x - hardening * x**3 for x, w in zip(q, v, strict=True))]

    elements: dict[str, Any] = {}
    for i in range(count):
        elements[f"f{i}"] = ns.elements.Coulomb(
            speed=lambda t, u, p, v=f"v{i}": getattr(u, v), on={f"v{i}": 1.0}, friction=0.1
        )
        elements[f"s{i}"] = ns.elements.Stop(
            gap=lambda t, u, p, q=f"q{i}": 0.15 - getattr(u, q), on={f"v{i}": -1.0}, restitution=0.4
        )
    names = [f"{x}{i}" for x in "qv" for i in range(count)]
    return ns.System(states=names, parameters={"F": 1.0}, modes={"all": field}, elements=elements)


@pytest.mark.parametrize("hardening", [0.0, 0.3])
def test_an_impact_turns_the_friction_of_its_own_mass_alone(hardening: float) -> None:
    """Two such masses were asked as one, by the instant of the first: their derivatives and multipliers were mixed."""

    def found(count: int) -> tuple[np.ndarray, np.ndarray]:
        system = struck_and_turned(count, hardening)
        given = ns.sensitivity(system, periods=2, start={f"q{i}": 0.05 for i in range(count)}, parameters=["F"])
        return given["Phi"].values, given["P"].values

    (alone, by_force), (both, by_both) = found(1), found(2)
    assert np.abs(by_force).max() > 0.1
    assert both == pytest.approx(np.kron(alone, np.eye(2)), abs=1e-9)
    assert by_both == pytest.approx(np.repeat(by_force, 2, axis=0), abs=1e-9)


@pytest.mark.parametrize("method", ["taylor", pytest.param("rkf45", marks=pytest.mark.slow)])
def test_a_stick_that_began_at_rest_ends_at_any_phase(method: str) -> None:
    """The slope of the speed is mere rounding there, and no scale of it: of 141 phases 5 ended in chatter."""
    system = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"w": 1.1, "phi": 0.0},
        forcing={"q": lambda t, p: np.sin(p.w * t + p.phi)},
        elements={"f": ns.elements.Coulomb(at="q", friction=0.15)},
    )
    for phi in np.linspace(-1.4, 1.4, 141):
        one = system.with_parameters(phi=phi)
        exact, series = (ns.simulate(one, periods=0.3, method=name) for name in ("exact", method))
        assert len(exact["crossing_time"]) == len(series["crossing_time"])
        np.testing.assert_allclose(series["u"].values[-1], exact["u"].values[-1], atol=1e-7)


def test_systems_that_were_defined_alike_have_their_own_answers() -> None:
    """Elements that decide together number what they find; derivatives once took the numbers of another system."""

    def rubbing_between_walls() -> ns.System:
        return ns.System(
            states=["q", "v"],
            parameters={"k": 1.0, "w": 0.8},
            modes={"all": lambda t, u, p: (u.v, 1.2 * np.cos(p.w * t) - p.k * u.q - u.q**3 - 0.1 * u.v)},
            elements={
                "right": ns.elements.Stop(gap=lambda t, u, p: 0.5 - u.q, on={"v": -1.0}, restitution=0.0),
                "left": ns.elements.Stop(gap=lambda t, u, p: 0.45 + u.q, on={"v": 1.0}, restitution=0.3),
                "rub": ns.elements.Coulomb(speed=lambda t, u, p: u.v, on={"v": 1.0}, friction=0.15, static=0.25),
            },
        )

    def end(system: ns.System, start: list[float], length: float, **values: float) -> np.ndarray:
        run = ns.simulate(system.with_parameters(**values), duration=length, start=start, samples=2)
        return run["u"].values[-1]

    for start, length in (([0.11, -0.46], 3.4), ([-0.39, 0.63], 11.2)):
        system = rubbing_between_walls()
        found = ns.sensitivity(system, duration=length, start=start, parameters=["k", "w"])
        assert found.sizes["crossing"] >= 3
        for name, column in zip(("k", "w"), found["P"].values.T, strict=True):
            value, h = system.values[name], 1e-5
            one, other = (end(system, start, length, **{name: value + sign * h}) for sign in (1, -1))
            np.testing.assert_allclose(column, (one - other) / (2 * h), rtol=1e-5, atol=1e-5)


def test_many_masses_do_the_same_at_one_instant() -> None:
    """Twelve that are struck, and turned by their friction, together: "ever shorter times", as if they bounced."""

    def last(count: int) -> np.ndarray:
        names = [f"q{i}" for i in range(count)]
        system = ns.mechanical(
            np.eye(count),
            0.1 * np.eye(count),
            np.eye(count),
            parameters={},
            coordinates=names,
            forcing={name: (lambda t, p: np.cos(1.7 * t)) for name in names},
            elements={f"s{name}": ns.elements.Stop(at=name, position=0.15, restitution=0.4) for name in names}
            | {f"f{name}": ns.elements.Coulomb(at=name, friction=0.1) for name in names},
        )
        run = ns.simulate(system, periods=4, start=dict.fromkeys(names, 0.05), samples=2)
        assert run.sizes["crossing"] >= 8 * count
        return np.asarray(run.u.values[-1]).reshape(2, count)

    np.testing.assert_allclose(last(12), np.repeat(last(1), 12, axis=1), atol=1e-10)


@pytest.mark.parametrize("many", [3, pytest.param(8, marks=pytest.mark.slow)])
def test_two_masses_that_move_against_each_other_turn_at_one_instant(many: int) -> None:
    """Speeds of 0 and 8e-16, which one mode took for zero and the next did not: the two led back and forth, "ever
    shorter times", in seven of eight such runs."""

    def system(*signs: int) -> ns.System:
        names = [f"q{i}" for i in range(len(signs))]
        return ns.mechanical(
            1.742 * np.eye(len(signs)),
            0.4 * np.eye(len(signs)),
            3.05 * np.eye(len(signs)),
            coordinates=names,
            forcing={
                name: lambda t, p, sign=sign: sign * (0.615 * np.cos(0.7734 * t + 0.16) - 0.28)
                for name, sign in zip(names, signs, strict=True)
            },
            elements={f"rub_{name}": ns.elements.Coulomb(at=name, friction=0.129) for name in names}
            | {f"pre_{name}": ns.elements.PreloadedSpring(at=name, preload=0.4476, stiffness=1.515) for name in names},
        )

    one, both = system(1), system(1, -1)
    for x, v in np.random.default_rng(1).uniform(-0.1, 0.1, (many, 2)):
        alone = ns.simulate(one, periods=6, start=[x, v], samples=2)
        run = ns.simulate(both, periods=6, start=[x, -x, v, -v], samples=2)
        assert alone.sizes["crossing"] > 50
        assert run.u.values[-1] == pytest.approx(np.kron(alone.u.values[-1], [1, -1]), abs=1e-11)


def test_a_chain_at_one_instant_may_come_by_a_mode_again() -> None:
    """A reset is drawn on through four levels of one surface, each by a step of its own: as a staircase has steps."""
    system = ns.System(
        states=["x", "step"],
        parameters={},
        modes={"fall": lambda t, u, p: (-1.0, 0.0), "stand": lambda t, u, p: (-1.0, 0.0)},
        indicators={"floor": lambda t, u, p: u.x, "low": lambda t, u, p: u.step - 8.5},
        transitions=[
            ns.Transition("fall", "stand", when="floor < 0", reset=lambda t, u, p: (0.0, u.step + 1.0)),
            ns.Transition("stand", "fall", when="floor < 0 and low < 0", reset=lambda t, u, p: (0.0, u.step + 1.0)),
            ns.Transition("stand", "stand", when="floor < 0 and low > 0", reset=lambda t, u, p: (1.0, 0.0)),
        ],
    )
    run = ns.simulate(system, duration=2.5, start=[1.0, 0.0], samples=2)
    assert run.crossing_time.values == pytest.approx([1.0] * 10 + [2.0] * 11)
    assert run.u.values[-1] == pytest.approx([0.5, 0.0], abs=1e-12)
