"""Patterns of phases that are made when they are visited: the same motion as with all combinations written out."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.elements import Coulomb, ElasticStop, PreloadedSpring, Stop
from nonsmooth.flow.engines.pattern_tables import PatternTables
from nonsmooth.system.derived import combinations

LAW = {"w": 0.3, "mu": 0.3}  # impacts, rest, slip and stick in each period


def pair() -> ns.System:
    """Two masses that rub, hit a wall and press against each other; four states and one harmonic."""
    stiffness = np.array([[2.0, -1.0], [-1.0, 2.0]])
    return ns.mechanical(
        np.eye(2),
        0.05 * stiffness,
        stiffness,
        parameters={"F": 1.0, "w": 0.7, "mu": 0.1, "e": 0.6, "k": 5.0},
        forcing={"q1": lambda t, p: p.F * np.cos(p.w * t)},
        outputs={"power": lambda t, u, p: p.k * u.q1},
        elements={
            "rub": Coulomb(at="q1", friction="mu", static=lambda t, u, p: 1.3 * p.mu),
            "wall": Stop(at="q2", position=0.4, restitution="e"),
            "soft": ElasticStop(at={"q1": 1, "q2": -1}, position=0.5, stiffness="k", damping=0.1),
        },
    )


@pytest.fixture
def both(monkeypatch: pytest.MonkeyPatch) -> tuple[ns.System, ns.System]:
    """All twelve combinations written out; the same as patterns that are made when they are visited."""
    written = pair().written_out()
    monkeypatch.setattr(combinations, "MOST", 0)
    return written, pair()


@pytest.mark.parametrize("law", [{}, {"w": 1.1, "F": 2.0}, LAW])
def test_a_run_is_that_of_the_combinations_written_out(
    both: tuple[ns.System, ns.System], law: dict[str, float]
) -> None:
    written, made = (system.with_parameters(law) for system in both)
    a, b = (ns.simulate(system, periods=20, samples=201) for system in (written, made))
    sequences = [[system.modes[i] for i in run["mode"].values] for system, run in ((written, a), (made, b))]
    assert sequences[0] == sequences[1]
    assert np.allclose(a["crossing_time"], b["crossing_time"], rtol=0, atol=1e-12)
    assert np.allclose(a["u"], b["u"], rtol=0, atol=1e-12)
    for name in ("power", "rub_force", "wall_force", "soft_force"):
        assert np.allclose(a[name], b[name], rtol=0, atol=1e-11)
    jumps = [[s.transitions[t].label for t in r["crossing_transition"].values] for s, r in ((written, a), (made, b))]
    assert jumps[0] == jumps[1]
    assert len(made.modes) < len(written.modes)
    assert {name.split("_")[1] for name in made.modes} == {"stick", "forward", "back"}


def test_section_points_and_sweeps_are_the_same(both: tuple[ns.System, ns.System]) -> None:
    """At sections of time and of a contact; carried states; extremes of states and forces; a response curve."""
    starts = [{"q1": 0.3}, {"q2": -0.4, "v_q1": 1.0}]
    for section in (None, ns.Poincare("wall_gap", rising=False)):
        a, b = (ns.poincare(system, n=20, start=starts, section=section) for system in both)
        assert np.allclose(a["section"], b["section"], rtol=0, atol=1e-12)
        modes = [np.array(system.modes)[r["mode"].values] for system, r in zip(both, (a, b), strict=True)]
        assert (modes[0] == modes[1]).all()
    values = np.linspace(0.3, 1.2, 7)
    a, b = (ns.frequency_response(s, values, parameter="w", direction="both", progress=False) for s in both)
    assert (a["period_number"] == b["period_number"]).all() and (a["status"] == b["status"]).all()
    for name in (
        "section",
        "maximum",
        "minimum",
        "amplitude",
        "contacts_per_period",
        "wall_force_maximum",
        "rub_force_minimum",
        "power_maximum",
    ):
        assert np.allclose(a[name], b[name], rtol=0, atol=1e-10), name


def test_a_run_goes_on_from_another_one(both: tuple[ns.System, ns.System]) -> None:
    made = both[1].with_parameters(LAW)
    whole = ns.simulate(made, periods=4, samples=5)
    rest = ns.simulate(made, periods=2, samples=3, start=ns.simulate(made, periods=2, samples=3))
    assert np.allclose(rest["u"].values[-1], whole["u"].values[-1], rtol=0, atol=1e-12)
    assert made.modes[int(rest["mode"][-1])] == made.modes[int(whole["mode"][-1])]


def test_a_mass_that_holds_holds_whatever_was_visited_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """A spring of 1/4 pulls at the first mass: its friction may be 0.3 as long as it sticks, but 0.1 once it slips. The
    other one slips, q2 = 0.1 + 0.9 cos t, behind a run in which only the first has slipped."""
    monkeypatch.setattr(combinations, "MOST", 0)
    rubs = {f"rub_{q}": Coulomb(at=q, friction=0.1, static=0.3) for q in ("q1", "q2")}
    system = ns.mechanical(np.eye(2), np.zeros((2, 2)), np.eye(2), elements=rubs)
    ns.simulate(system, duration=1.0, start={"q1": 1.0})
    run = ns.simulate(system, transient=0.5, duration=1.0, start={"q1": 0.25, "q2": 1.0})
    slipped = np.stack([np.full(run.time.size, 0.25), 0.1 + 0.9 * np.cos(run["time"])], axis=1)
    np.testing.assert_allclose(run["u"].values[:, :2], slipped, atol=1e-13)
    assert {system.modes[k] for k in run["mode"].values} == {"rub_q1_stick_rub_q2_back"}


def test_what_sticks_has_the_exponent_zero_whatever_was_visited_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two masses alone the first sticks, so that a change of its place stays; the second is driven, and damped."""
    monkeypatch.setattr(combinations, "MOST", 0)
    rubs = {f"rub_{q}": Coulomb(at=q, friction=0.1, static=0.3) for q in ("q1", "q2")}
    force = {"q2": lambda t, p: np.cos(2.0 * t)}
    system = ns.mechanical(np.eye(2), 0.5 * np.eye(2), np.eye(2), parameters={}, forcing=force, elements=rubs)
    ns.simulate(system, duration=1.0, start={"q1": 1.0})
    found = ns.lyapunov(system, periods=32, transient=4, start={"q1": 0.25}, progress=False).exponents.values
    assert abs(found[0]) < 1e-12 and found[1] < -0.1


def test_its_text_is_read_back_whatever_it_has_visited(both: tuple[ns.System, ns.System]) -> None:
    made = both[1]
    before = made.to_text()
    ns.simulate(made, periods=2)
    assert made.to_text() == before
    sent = pickle.loads(pickle.dumps(made))
    for again, modes in ((ns.System.from_text(before), made.modes[:1]), (sent, made.modes)):
        assert again == made and again.modes == modes
        runs = [ns.simulate(system, periods=2, samples=9) for system in (made, again)]
        assert np.allclose(*(run["u"].values for run in runs), rtol=0, atol=1e-14)
        with pytest.raises(ns.SystemDefinitionError, match="lies between 0 and 1"):
            again.with_parameters(e=-0.1)
    assert 'wall: Stop(at="q2"' in repr(made) and "visited so far" in repr(made)


def hardening() -> ns.System:
    """A mass on a cubic spring between a wall and a second mass that it may strike."""
    return ns.System(
        states=["a", "b", "v", "w"],
        parameters={"F": 1.2},
        modes={
            "free": lambda t, u, p: (
                u.v,
                u.w,
                p.F * np.cos(t) - u.a - u.a**3 - 0.1 * u.v - (u.a - u.b),
                u.a - u.b - 0.1 * u.w,
            )
        },
        elements={
            "wall": Stop(gap=lambda t, u, p: 0.4 - u.a, on={"v": -1.0}, restitution=0.0),
            "between": Stop(gap=lambda t, u, p: 0.2 - u.b + u.a, on={"w": -1.0, "v": 1.0}, restitution=0.3),
        },
    )


@pytest.mark.parametrize(("system", "decided"), [(pair, "patterns"), (hardening, "decider")])
def test_an_orbit_is_the_same_in_another_process(system: Any, decided: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Modes and answers have the numbers of their first visits: they travel with what is told by them."""
    monkeypatch.setattr(combinations, "MOST", 0 if decided == "patterns" else combinations.MOST)
    orbit = ns.find_orbit(system())
    assert getattr(orbit.system.traced, decided) is not None and len(orbit.crossing_times)
    there = pickle.loads(pickle.dumps(orbit))
    assert repr(there) == repr(orbit) and there.crossings_per_period == orbit.crossings_per_period
    np.testing.assert_array_equal(there.trajectory()["u"], orbit.trajectory()["u"])


def test_a_slow_start_of_a_preloaded_spring_that_cannot_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    """The load 2 exceeds the preload 1: from rest, or 1e-9 beside it, q = (1 - cos 2 t) / 4."""
    monkeypatch.setattr(combinations, "MOST", 0)
    spring = PreloadedSpring(at="q", preload=1.0, stiffness=4.0)
    load = {"q": lambda t, p: 2.0 + 0 * t}
    system = ns.mechanical(1.0, 0.0, 0.0, parameters={}, coordinates=["q"], forcing=load, elements={"s": spring})
    for speed in (1e-9, -1e-9):
        run = ns.simulate(system, start={"v_q": speed}, duration=1.0)
        np.testing.assert_allclose(run["u"].values[:, 0], (1 - np.cos(2 * run["time"])) / 4, atol=2e-9)


def test_exponents_are_those_of_the_system_written_out(both: tuple[ns.System, ns.System]) -> None:
    one, two = (ns.lyapunov(system, periods=40, transient=20, progress=False).exponents.values for system in both)
    np.testing.assert_allclose(one, two, atol=1e-8)


def test_what_cannot_be_done_with_patterns_is_refused(both: tuple[ns.System, ns.System]) -> None:
    made = both[1]
    verbs: list[Any] = [
        lambda s: s.smoothed(0.1),
        lambda s: s.derivatives,
        lambda s: s.to_latex(),
        lambda s: ns.simulate(s, periods=1, ramps={"w": (0.5, 0.6)}),
    ]
    for verb in verbs:
        with pytest.raises(ns.SystemDefinitionError, match="made when a run first visits it"):
            verb(made)
    with pytest.raises(ValueError, match="by the exact flow alone"):
        ns.simulate(made, periods=1, method="taylor")
    with pytest.raises(ValueError, match="by the processor"):
        ns.sweep(made, "w", [0.5, 0.6], direction=None, device="cuda", progress=False)
    stribeck = ns.mechanical(
        1.0, 0.0, 1.0, elements=[Coulomb(at="q", friction=lambda v, p: 0.1 / (1 + v)), Stop(at="q", position=1.0)]
    )
    with pytest.raises(ns.SystemDefinitionError, match="everything is affine"):
        ns.simulate(stribeck, duration=1.0)
    with pytest.raises(ns.SystemDefinitionError, match="one mode and no indicators"):
        ns.System(
            states=["x", "v"],
            parameters={},
            modes={"a": lambda t, u, p: (u.v, -u.x)},
            indicators={"middle": lambda t, u, p: u.x},
            elements=[Stop(gap=lambda t, u, p: 1 - u.x, on={"v": -1.0})],
        )


@pytest.mark.parametrize("seed", range(4))
def test_an_instant_asks_the_elements_that_it_concerns(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Six masses in a row with contacts of their own: the same crossings, to rounding, as where all are asked."""
    rng = np.random.default_rng(seed)
    stiffness = 2.0 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1)
    elements: dict[str, Any] = {}
    for i in range(1, 7):
        if rng.random() < 0.6:
            elements[f"rub{i}"] = Coulomb(at=f"q{i}", friction=rng.uniform(0.02, 0.1), static=rng.uniform(0.1, 0.2))
        if rng.random() < 0.7:
            elements[f"wall{i}"] = Stop(at=f"q{i}", position=rng.uniform(0.05, 0.3), restitution=rng.uniform(0.0, 0.6))

    def row() -> ns.System:
        return ns.mechanical(
            np.eye(6),
            0.1 * stiffness,
            stiffness,
            parameters={"w": 0.6},
            forcing={f"q{i}": lambda t, p: np.cos(p.w * t) for i in (1, 4)},
            elements=elements,
        )

    monkeypatch.setattr(combinations, "MOST", 0)
    asked: list[bool] = []
    concerned = PatternTables._concerned

    def counted(*arguments: Any) -> Any:
        found = concerned(*arguments)
        asked.append(found is not None and len(found) < len(elements))
        return found

    monkeypatch.setattr(PatternTables, "_concerned", counted)
    some = ns.simulate(row(), periods=8, samples=9)
    monkeypatch.setattr(PatternTables, "_concerned", lambda *arguments: None)
    every = ns.simulate(row(), periods=8, samples=9)
    assert sum(asked) > 5
    np.testing.assert_array_equal(some["crossing_transition"].values, every["crossing_transition"].values)
    np.testing.assert_allclose(some["crossing_time"].values, every["crossing_time"].values, rtol=0, atol=1e-11)
    np.testing.assert_allclose(some["u"].values, every["u"].values, rtol=0, atol=1e-11)


def test_no_name_of_an_element_makes_conditions_of_two_others_its_own() -> None:
    """Three frictions that hold each other, named a, b and a_b: a bound of what a and b hold is no bound of a_b."""

    def ends(names: tuple[str, str, str]) -> np.ndarray:
        rubs = [
            Coulomb(at={"q1": 1, "q2": -1}, friction=0.35),
            Coulomb(at={"q1": 0.3, "q2": 1}, friction=0.3),
            Coulomb(at={"q1": 1, "q2": 1e-4}, friction=0.25),
        ]
        system = ns.mechanical(
            np.eye(2),
            0.05 * np.eye(2),
            [[2.0, -1.0], [-1.0, 1.5]],
            parameters={"F": 1.3, "w": 0.8},
            forcing={"q1": lambda t, p: p.F * np.cos(p.w * t)},
            elements=dict(zip(names, rubs, strict=True)),
        )
        assert system.traced.patterns is not None
        return ns.simulate(system, periods=2).crossing_time.values

    assert ends(("a", "a_b", "b")) == pytest.approx(ends(("a", "aa", "b")), abs=1e-9)


def test_a_system_written_out_is_the_same_in_another_process() -> None:
    stops = {
        "a": Stop(at="q1", position=0.5, restitution=0.5),
        "b": Stop(at={"q1": 1, "q2": -1}, position=0.3, restitution=0.5),
    }
    system = ns.mechanical(
        np.eye(2),
        0.1 * np.eye(2),
        [[2.0, -1.0], [-1.0, 2.0]],
        parameters={"F": 1.0, "w": 0.8},
        forcing={"q1": lambda t, p: p.F * np.cos(p.w * t)},
        elements=stops,
    )
    written = system.written_out()
    run = ns.simulate(written, periods=3)
    there = pickle.loads(pickle.dumps(written))
    assert there.modes == written.modes and there.transitions == written.transitions
    again = ns.simulate(there, periods=3)
    assert len(run.crossing)
    np.testing.assert_array_equal(again.crossing_transition, run.crossing_transition)
    assert pickle.loads(pickle.dumps(system)).traced.patterns is not None
