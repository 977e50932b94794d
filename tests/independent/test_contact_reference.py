"""The independent reference of contacts against closed forms: worked cases, energy, and its own pieces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from contact_draws import Draw, random_contact_system
from contact_elements import (
    Array,
    Backlash,
    Coulomb,
    ElasticStop,
    Element,
    PreloadedSpring,
    Stop,
    System,
    harmonic,
    one_mass,
)
from contact_impacts import sequential, simultaneous, stronge
from contact_reference import Reference, Run, simulate
from contact_time_stepping import time_stepping
from scipy.optimize import lsq_linear

pytestmark = pytest.mark.physics

ONE = (1.0,)


def run(system: System, q: list[float], v: list[float], times: list[float], **how: object) -> Run:
    out = simulate(system, np.array(q), np.array(v), np.array(times), **how)  # type: ignore[arg-type]
    assert not out.failure, out.failure
    return out


def carts(n: int, loads: object = 0.0, **elements: object) -> System:
    """Unit masses without springs; loads: constants, or rows of constant, cosine, sine."""
    rows = np.zeros((n, 3))
    loads = np.asarray(loads, float)
    rows[:, : loads.shape[1] if loads.ndim > 1 else 1] = loads if loads.ndim > 1 else loads.reshape(-1, 1)
    return System(np.eye(n), np.zeros((n, n)), np.zeros((n, n)), rows, 1.0, elements)  # type: ignore[arg-type]


def test_rests_at_a_plastic_wall_without_force() -> None:
    for e in (0.0,):
        out = run(one_mass(wall=Stop(ONE, 1.0, restitution=e)), [0], [0.5], [1.0, 2.5, 6.0])
        assert np.allclose(out.states, [[0.5, 0.5], [1, 0], [1, 0]], atol=1e-15)
        assert [x.time for x in out.events] == [0.0, 2.0]


def test_leaves_a_wall_slower_than_the_rest_speed_where_nothing_presses() -> None:
    out = run(one_mass(wall=Stop(ONE, 1.0, restitution=0.5)), [1 - 1e-9], [1e-9], [2.0])
    assert np.allclose(out.states, [[1 - 5e-10, -5e-10]], rtol=0, atol=1e-16)
    out = run(one_mass(load=1.0, wall=Stop(ONE, 1.0, restitution=0.5)), [1.0], [1e-9], [2.0])
    assert np.array_equal(out.states, [[1.0, 0.0]])


def test_rest_beside_a_friction_that_could_hold_alone() -> None:
    """The force of least norm decides: a load into the wall presses it, a load away from it does not."""
    for load, speed in ((0.2, 0.0), (-0.2, -0.5e-9)):
        wall = one_mass(load=load, wall=Stop(ONE, 1.0, restitution=0.5), f=Coulomb(ONE, 0.4))
        out = run(wall, [1.0], [1e-9], [0.0, 1.0])
        assert out.states[0] == pytest.approx([1.0, speed], abs=1e-18)
        assert out.states[1, 1] == 0.0


def test_two_carts_with_a_plastic_stop_between_them() -> None:
    out = run(carts(2, wall=Stop((1.0, -1.0), 1.0)), [0, 0], [0.5, 0], [2.0, 4.0])
    assert np.allclose(out.states, [[1, 0, 0.25, 0.25], [1.5, 0.5, 0.25, 0.25]], atol=1e-15)


@pytest.mark.parametrize("belt", [-0.5, -0.37, -0.25, -1.1])
def test_a_mass_stuck_to_a_belt_hits_a_plastic_stop(belt: float) -> None:
    system = one_mass(
        damping=0.05,
        stiffness=1.0,
        load=(0, 0.3, 0),
        frequency=0.7,
        f=Coulomb(ONE, 1.2, belt=belt),
        s=Stop(ONE, 0.2, side=-1),
    )
    out = run(system, [0.8], [belt], [10.0])
    assert out.events[1].time == pytest.approx(0.6 / -belt, rel=1e-14)
    assert out.events[1].approach["s"] == pytest.approx(-belt, rel=1e-14)
    assert out.states[0, 0] == pytest.approx(0.2, abs=1e-14)  # the friction holds it there


@pytest.mark.parametrize("mu", [0.5, 0.3, 1.7])
def test_a_load_equal_to_the_friction(mu: float) -> None:
    out = run(one_mass(load=mu, f=Coulomb(ONE, mu)), [0], [-1], [9.0])
    assert out.events[1].time == pytest.approx(1 / (2 * mu), rel=1e-14)
    assert np.allclose(out.states, [[-1 / (4 * mu), 0.0]], atol=1e-15)
    # a slope at the friction angle: thrown up it rests, thrown down it keeps its speed
    down = run(one_mass(load=-mu, f=Coulomb(ONE, mu)), [0], [-1], [9.0])
    assert np.allclose(down.states, [[-9.0, -1.0]], atol=1e-14)


def test_static_above_kinetic_at_rest_stays() -> None:
    out = run(one_mass(load=0.5, f=Coulomb(ONE, 0.3, static=0.6)), [0], [0], [9.0])
    assert np.array_equal(out.states, [[0, 0]])


def test_the_first_derivative_that_is_not_zero_decides() -> None:
    held = run(one_mass(load=(0, 0.5, 0), f=Coulomb(ONE, 0.5)), [0], [0], [50.0])
    assert np.array_equal(held.states, [[0, 0]])
    times = np.linspace(0, 20, 41)
    moved = run(one_mass(load=(0.5, 0, 0.3), f=Coulomb(ONE, 0.5)), [0], [0], list(times))
    assert np.allclose(moved.states[:, 0], 0.3 * (times - np.sin(times)), atol=1e-12)
    assert all("stick" not in x.states for x in moved.events)


@pytest.mark.parametrize("reverse", [False, True])
def test_frictions_that_hold_together(reverse: bool) -> None:
    elements = {"a": Coulomb(ONE, 0.3, static=0.6), "b": Coulomb(ONE, 0.3)}
    system = one_mass(
        load=(0, 0, 0.75), frequency=0.5, **dict(reversed(elements.items()) if reverse else elements.items())
    )
    assert np.array_equal(run(system, [0], [0], [200.0]).states, [[0, 0]])
    _, a, forces = Reference(system).behind(np.zeros(1), np.zeros(1), t=np.pi)
    assert np.array_equal(a, [0.0])
    assert forces == pytest.approx({"a": -0.45, "b": -0.3})


def test_looks_of_coupled_frictions() -> None:
    first = carts(2, [-5.0, -6.0], a=Coulomb((1, 0), 2, 5), b=Coulomb((1, -1), 2, 2))
    _, a, forces = Reference(first).behind(np.zeros(2), np.zeros(2))
    assert np.allclose(a, [-4.5, -4.5])
    assert forces == pytest.approx({"b": -1.5})
    second = carts(2, [-2.0, -8.0], a=Coulomb((1, 1), 1, 6), b=Coulomb((1, 0), 2, 3))
    _, a, forces = Reference(second).behind(np.zeros(2), np.zeros(2))
    assert np.allclose(a, [0, -7])
    assert forces == pytest.approx({"b": 1.0})


@pytest.mark.parametrize(
    ("e", "law", "after"),
    [
        (1.0, "simultaneous", (-1 / 3, 2 / 3, 2 / 3)),
        (1.0, "sequential", (0, 0, 1)),
        (0.0, "simultaneous", (1 / 3, 1 / 3, 1 / 3)),
        (0.0, "sequential", (1 / 3, 1 / 3, 1 / 3)),
    ],
)
def test_three_balls(e: float, law: str, after: tuple[float, ...]) -> None:
    balls = carts(3, a=Stop((1, -1, 0), restitution=e), b=Stop((0, 1, -1), restitution=e))
    out = run(balls, [0, 0, 0], [1, 0, 0], [1.0], impacts=law)
    assert np.allclose(out.states[0, 3:], after, rtol=0, atol=1e-15)


def test_a_moving_stop() -> None:
    # position sin t - 1 at t = 0 moves at 1 towards ... the mass above it: the stop rises and throws it up
    out = run(one_mass(stop=Stop(ONE, (0, 0, 1.0), side=-1, restitution=1.0)), [0], [0], [0.1])
    assert np.allclose(out.states, [[0.2, 2.0]], atol=1e-15)
    out = run(one_mass(stop=Stop(ONE, (0, 0, -1.0), side=1, restitution=1.0)), [0], [0], [0.1])
    assert np.allclose(out.states, [[-0.2, -2.0]], atol=1e-15)


@pytest.mark.parametrize("e", [0.3, 0.8, 0.985])
def test_rest_time_of_a_bouncing_ball(e: float) -> None:
    h, g = 1.0, 9.81
    ball = one_mass(load=-g, floor=Stop(ONE, 0.0, side=-1, restitution=e))
    end = np.sqrt(2 * h / g) * (1 + e) / (1 - e)
    out = run(ball, [h], [0], [1.01 * end])
    assert out.events[-1].rest_time["floor"] == pytest.approx(end, rel=1e-9)
    assert np.array_equal(out.states, [[0.0, 0.0]])


@pytest.mark.parametrize("w", [0.8, 1.04746, 1.15])
def test_two_plastic_stops(w: float) -> None:
    system = one_mass(damping=0.2, load=(0, 1.0, 0), frequency=w, right=Stop(ONE, 1.0), left=Stop(ONE, -1.0, side=-1))
    period = 2 * np.pi / w
    out = run(system, [0], [0], [30 * period])
    late = [x for x in out.events if x.time > 20 * period]
    assert sum(bool(x.approach) for x in late) == 20
    assert min(speed for x in late for speed in x.approach.values()) > 0.1


def test_end_of_sticking_between_two_plastic_stops() -> None:
    # above it the mass leaves at once when it arrives: an arrival in the half period that pulls it away
    def sticks(w: float) -> bool:
        system = one_mass(
            damping=0.2, load=(0, 1.0, 0), frequency=w, right=Stop(ONE, 1.0), left=Stop(ONE, -1.0, side=-1)
        )
        out = run(system, [0], [0], [80 * np.pi / w])
        return any("closed" in x.states for x in out.events[-6:])

    assert sticks(1.15983562)
    assert not sticks(1.15983563)


def test_friction_impacts_of_worked_cases() -> None:
    G = np.array([[2.0, -1.0], [-1.0, 5.0]])
    w = np.array([[1.0, 1.0], [-2.0, 1.0]])
    for mu, speeds, impulses, energy in (
        (0.1, (0.477842372894, -0.204695361288), (0.742724055909, 0.007605738924), 0.057213489679),
        (0.3, (0.459891291503, 0.0), (0.755495161946, 0.051099032389), 0.05875),
    ):
        after, impulse = stronge(G, -1.0, 0.5, 0.5, mu)
        assert np.allclose(after, speeds, rtol=0, atol=1e-12)
        assert np.allclose(impulse, impulses, rtol=0, atol=1e-12)
        v = np.array([-0.5, -0.5]) + w.T @ impulse
        assert v @ v / 2 == pytest.approx(energy, abs=1e-12)
    ball = np.array([[1.0, 0.0], [0.0, 3.5]])
    after, _ = stronge(ball, -1.0, 1.0, 0.5, 0.1)
    assert np.allclose(after, [0.5, 0.475], atol=1e-15)
    after, impulse = stronge(ball, -1.0, 1.0, 0.5, 0.3)
    assert np.allclose(after, [0.5, 0.0], atol=1e-15)
    assert impulse[1] == pytest.approx(-2 / 7)


def test_painleve_angles_of_a_thin_rod() -> None:
    # G_nn = 1 + 3 cos^2, G_nt = 3 sin cos for unit mass and half length
    def value(degrees: float, mu: float) -> float:
        a = np.radians(degrees)
        return 1 + 3 * np.cos(a) ** 2 - mu * 3 * np.sin(a) * np.cos(a)

    for angle in (50.6415982, 73.0484695):
        assert abs(value(angle, 1.5)) < 1e-7
    assert min(value(a, 1.3333) for a in np.linspace(0, 90, 9001)) > 0


def random_impact(seed: int) -> tuple[Array, Array, Array, Array]:
    rng = np.random.default_rng(seed)
    n, m = rng.integers(1, 5), rng.integers(1, 6)
    root = rng.normal(size=(n, n))
    v, W = rng.normal(size=n), np.sign(rng.normal(size=(m, n))) * (rng.random((m, n)) < 0.6)
    W[:, 0] += W.any(axis=1) == 0
    W[W @ v > 0] *= -1
    return root @ root.T + 0.1 * np.eye(n), W, W @ v, rng.choice([0.0, 0.5, 1.0, rng.random()], m)


def test_impacts_never_add_energy_where_no_contact_separates() -> None:
    for seed in range(300):
        inverse, W, before, e = random_impact(seed)
        change, impulse = simultaneous(inverse, W, before, e)
        after = before + W @ change
        assert impulse @ (before + after) <= 1e-11
        assert np.all(after + e * np.minimum(before, 0) >= -1e-10)
        if len(before) == 1:
            assert np.allclose(sequential(inverse, W, before, e, 1e-7)[0], change)


def test_a_contact_that_separates_already_can_add_energy() -> None:
    """Three touching balls, the last one leaving: the law by its letter takes 0.505 to 0.535."""
    W = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0]]) * -1
    v = np.array([1.0, 0.0, 0.1])
    after = v + simultaneous(np.eye(3), W, W @ v, np.ones(2))[0]
    assert np.allclose(after, [-0.3, 0.7, 0.7])
    assert after @ after / 2 == pytest.approx(0.535)


def test_energy_of_a_conservative_system() -> None:
    """Springs with play, stops with e = 1, preload: energy stays."""
    system = System(
        np.diag([1.0, 0.838]),
        np.zeros((2, 2)),
        np.array([[2.0, -1.0], [-1.0, 2.0]]),
        np.zeros((2, 3)),
        1.0,
        {
            "a": Stop((1, 0), 0.6, restitution=1.0),
            "b": Backlash((0, 1), 0.3, 50.0),
            "p": PreloadedSpring((1, -1), 0.2, 3.0),
            "d": ElasticStop((0, 1), -0.4, -1, 200.0),
        },
    )
    times = np.linspace(0, 30, 400)
    out = run(system, [0.2, 0.1], [1.3, -0.9], list(times))
    q, v = out.states[:, :2], out.states[:, 2:]
    s = np.abs(q[:, 0] - q[:, 1])
    energy = ((v**2 * [1, 0.838]).sum(1) + np.einsum("ti,ij,tj->t", q, system.stiffness, q)) / 2
    energy += 25 * np.maximum(np.abs(q[:, 1]) - 0.3, 0) ** 2 + 0.2 * s + 1.5 * s**2
    energy += 100 * np.maximum(-0.4 - q[:, 1], 0) ** 2
    assert np.ptp(energy) < 1e-12
    assert len(out.events) > 50


def test_an_elastic_stop_that_does_not_pull_ends_by_force() -> None:
    """The contact ends where -k g - c g' = 0, inside g < 0: half sine with damping."""
    k, c = 100.0, 4.0
    system = one_mass(stop=ElasticStop(ONE, 0.0, 1, k, c))
    out = run(system, [-1.0], [1.0], [3.0])
    zeta = c / (2 * np.sqrt(k))
    w = np.sqrt(k) * np.sqrt(1 - zeta**2)
    end = (np.pi - np.arctan2(2 * zeta * np.sqrt(1 - zeta**2), 1 - 2 * zeta**2)) / w  # acceleration is zero
    assert [x.time for x in out.events[1:3]] == pytest.approx([1.0, 1.0 + end], rel=1e-12)


def test_a_preloaded_spring_holds_and_lets_go() -> None:
    system = one_mass(load=(0, 0, 0.5), frequency=1.0, p=PreloadedSpring(ONE, 0.4, 1.0))
    out = run(system, [0], [0], [0.5, 2.0])
    assert out.states[0] == pytest.approx([0, 0])
    assert out.events[1].time == pytest.approx(np.arcsin(0.8), rel=1e-13)


@pytest.mark.parametrize("mass", [0.838, 1.0, 1.3, 0.7, 3.1])
def test_singular_combinations(mass: float) -> None:
    """Stops on both sides of one coordinate at one place with a friction: it stays, whatever the mass."""
    system = one_mass(
        mass, load=(0.4, 0, 0.9), a=Stop(ONE, 0.0), b=Stop(ONE, 0.0), c=Coulomb(ONE, 0.2), d=Stop(ONE, 0.0, side=-1)
    )
    out = run(system, [0], [0], [40.0])
    assert np.array_equal(out.states, [[0, 0]])
    assert len(out.events) < 3


def test_den_hartog() -> None:
    """Amplitude of sticking-free forced vibration with dry friction (Den Hartog 1931)."""
    w, f = 1.6, 0.2
    system = one_mass(stiffness=1.0, load=(0, 1.0, 0), damping=0.0, frequency=w, f=Coulomb(ONE, f))
    period = 2 * np.pi / w
    out = run(system, [0], [0], list(np.linspace(300 * period, 301 * period, 2001)))
    b = 1 / w  # natural over forcing frequency
    g = 1 / (1 - w**2)
    u = b * np.sin(np.pi * b) / (1 + np.cos(np.pi * b))
    assert np.abs(out.states[:, 0]).max() == pytest.approx(np.sqrt(g**2 - (f * u) ** 2), rel=1e-5)


def without_source(draw: Draw) -> System | None:
    """Return the draw without loads, belts and moving stops; none where a contact opens while another one is hit."""
    kept: dict[str, Element] = {}
    for name, e in draw.system.elements.items():
        if isinstance(e, Stop | ElasticStop):
            e = replace(e, position=harmonic(e.position)[0])
        if isinstance(e, ElasticStop):
            e = replace(e, pulls=True)  # one that does not pull has no stored energy of its own
        if isinstance(e, Coulomb):
            e = replace(e, belt=0.0)
        kept[name] = e
    at_stops = [
        e for e in kept.values() if isinstance(e, Stop) and e.side * (e.position - np.array(e.at) @ draw.q) <= 0
    ]
    return None if len(at_stops) > 1 else replace(draw.system, elements=kept, loads=0 * draw.system.loads)


def energy(system: System, q: Array, v: Array) -> float:
    out = v @ system.mass @ v + q @ system.stiffness @ q
    for e in system.elements.values():
        s = float(np.array(e.at) @ q)
        if isinstance(e, ElasticStop):
            out += e.stiffness * max(e.side * (s - harmonic(e.position)[0]), 0.0) ** 2
        elif isinstance(e, Backlash):
            out += e.stiffness * max(abs(s) - e.half_width, 0.0) ** 2
        elif isinstance(e, PreloadedSpring):
            out += 2 * e.preload * abs(s) + e.stiffness * s**2
    return out / 2


def test_energy_never_grows_without_a_source() -> None:
    ran = 0
    for seed in range(25):
        draw = random_contact_system(seed)
        system = without_source(draw)
        if system is None:
            continue
        out = simulate(system, draw.q, draw.v, np.linspace(0, 2 * draw.period, 121), max_events=2000)
        states = out.states[np.isfinite(out.states).all(axis=1)]
        n = len(draw.q)
        values = np.array([energy(system, x[:n], x[n:]) for x in states])
        assert np.all(np.diff(values) <= 1e-9 * values[0]), seed
        gaps = [e.side * (e.position - states[:, :n] @ e.at) for e in system.elements.values() if isinstance(e, Stop)]
        assert min((g.min() for g in gaps), default=0.0) > -1e-11, seed
        ran += len(states) == 121
    assert ran > 20


@pytest.mark.slow
@pytest.mark.parametrize("seed", [17, 86, 118])
def test_time_stepping_agrees(seed: int) -> None:
    draw = random_contact_system(seed)
    count = 60
    states = simulate(draw.system, draw.q, draw.v, np.linspace(0, draw.period, count + 1)).states[:, : len(draw.q)]
    worst = [
        np.abs(
            time_stepping(draw.system, draw.q, draw.v, draw.period / 60, count, every)[:, : len(draw.q)] - states
        ).max()
        for every in (400, 3200)
    ]
    assert worst[1] < max(worst[0] / 3, 1e-6)
    assert worst[1] < 3e-4


def test_an_accumulation_between_two_masses_is_one_rest() -> None:
    """A carried mass bounces on a driven one: e = 0.6, gravity 1; both laws are the same for one contact."""
    system = carts(2, [[0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], floor=Stop((-1.0, 1.0), 0.0, -1, 0.6))
    end = np.sqrt(2 * 0.5) * 1.6 / 0.4
    one, other = (run(system, [0, 0.5], [0, 0], [end + 0.5], impacts=law) for law in ("simultaneous", "sequential"))
    assert np.array_equal(one.states, other.states)
    assert one.events[-1].rest_time["floor"] == pytest.approx(end, rel=1e-9)
    t = end + 0.5
    assert one.states[0] == pytest.approx([0.25 - t**2 / 4, 0.25 - t**2 / 4, -t / 2, -t / 2], abs=1e-9)


@pytest.mark.parametrize("seeds", [range(40), pytest.param(range(40, 400), marks=pytest.mark.slow)])
def test_accelerations_are_those_of_the_convex_problem(seeds: range) -> None:
    """At rest with whole numbers, duplicates included: beside the box-constrained least squares of the forces."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        n, m = int(rng.integers(1, 5)), int(rng.integers(1, 7))
        loads = np.hstack((rng.integers(-4, 5, (n, 1)), rng.integers(-1, 2, (n, 2)))).astype(float)
        mass = np.diag(rng.choice([1.0, 0.838, 2.0], n))
        elements: dict[str, Element] = {}
        for k in range(m):
            at = rng.integers(-1, 2, n).astype(float)
            at[rng.integers(n)] = 1.0
            row = tuple(map(float, at))
            elements[f"e{k}"] = (
                Stop(row, 0.0, int(rng.choice([1, -1])))
                if rng.random() < 0.4
                else Coulomb(row, float(rng.integers(1, 4)))
            )
        system = System(mass, np.zeros((n, n)), np.zeros((n, n)), loads, 1.0, elements)
        reference = Reference(system)
        _, a, forces = reference.behind(np.zeros(n), np.zeros(n))
        W = np.array([p.direction for p in reference.parts])
        free = loads[:, 0] + loads[:, 1]
        low = [0.0 if p.kind == "stop" else -p.numbers["kinetic"] for p in reference.parts]
        high = [np.inf if p.kind == "stop" else p.numbers["kinetic"] for p in reference.parts]
        root = np.diag(np.diag(mass) ** -0.5)
        best = lsq_linear(root @ W.T, -root @ free, (low, high), method="bvls", tol=1e-14, max_iter=2000)
        assert np.allclose(a, np.linalg.solve(mass, free + W.T @ best.x), rtol=0, atol=1e-5), seed
        assert all(-1e-9 <= f for name, f in forces.items() if isinstance(elements[name], Stop))
