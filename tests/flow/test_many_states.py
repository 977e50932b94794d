"""The exact flow of more than two states against matrix exponentials: every segment, and no transition missed."""

from __future__ import annotations

import numpy as np
import pytest
from linear_flow import LinearFlow

import nonsmooth as ns
from nonsmooth.results.provenance import read_provenance


def chain(masses: int, **values: float) -> ns.System:
    """Masses between springs, the first one driven, the last one against an elastic stop."""
    names = [f"{letter}{i}" for letter in "xv" for i in range(masses)]

    def field(stopped: bool):
        def motion(t, u, p):
            x, v = list(u)[:masses], list(u)[masses:]
            force = [-2 * p.k * x[i] - p.c * v[i] for i in range(masses)]
            for i in range(masses - 1):
                force[i] += p.k * x[i + 1]
                force[i + 1] += p.k * x[i]
            force[0] += p.A * np.cos(p.w * t)
            if stopped:
                force[-1] -= p.k_s * (x[-1] - p.g)
            return (*v, *force)

        return motion

    last = names[masses - 1]
    return ns.System(
        states=names,
        parameters={"k": 1.0, "c": 0.05, "A": 1.0, "w": 1.0, "k_s": 20.0, "g": 0.5},
        modes={"free": field(False), "contact": field(True)},
        indicators={"over": lambda t, u, p: getattr(u, last) - p.g},
        transitions=[
            ns.Transition("free", "contact", when="over > 0"),
            ns.Transition("contact", "free", when="over < 0"),
        ],
        name=f"chain of {masses}",
    ).with_parameters(values)


def flows(system: ns.System, masses: int) -> list[LinearFlow]:
    """The chain's two modes, written down a second time as matrices."""
    p = system.values
    K = p["k"] * (2 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1))
    found = []
    for stiffness in (0.0, p["k_s"]):
        stiff = K.copy()
        stiff[-1, -1] += stiffness
        A = np.block([[np.zeros((masses, masses)), np.eye(masses)], [-stiff, -p["c"] * np.eye(masses)]])
        b, drive = np.zeros(2 * masses), np.zeros(2 * masses)
        b[-1], drive[masses] = stiffness * p["g"], p["A"]
        found.append(LinearFlow(A, b, {1: (drive, 0 * drive)}, p["w"]))
    return found


@pytest.mark.parametrize(
    "masses", [2, pytest.param(3, marks=pytest.mark.slow), pytest.param(10, marks=pytest.mark.slow)]
)
def test_a_chain_with_a_stop_segment_by_segment(masses: int) -> None:
    """Each segment of a run is a matrix exponential, ends on the surface, and does not cross it before."""
    system = chain(masses, g=0.2)
    modes = flows(system, masses)
    start = np.random.default_rng(masses).normal(0.0, 0.1, 2 * masses)
    start[masses - 1] = 0.0
    run = ns.simulate(system, periods=30, start=start)
    assert read_provenance(run)["method"] == "exact"  # without being asked for
    times, after, before = (run[name].values for name in ("crossing_time", "u_after", "u_before"))
    assert len(times) > 20
    mode, t0, u0 = 0, 0.0, start
    for time, u_before, u_after in zip(times, before, after, strict=True):
        assert np.abs(modes[mode].at(t0, u0, time) - u_before).max() < 2e-13
        assert abs(u_before[masses - 1] - 0.2) < 1e-13 and np.array_equal(u_before, u_after)
        _, dense = modes[mode].along(t0, u0, time, 400)
        assert ((dense[1:-1, masses - 1] - 0.2) * (1, -1)[mode] < 1e-13).all()
        mode, t0, u0 = 1 - mode, time, u_after
    assert np.abs(modes[mode].at(t0, u0, run["time"].values[-1]) - run["u"].values[-1]).max() < 2e-13


def test_a_sweep_of_a_chain_has_the_sections_and_extremes_of_its_run() -> None:
    system = chain(2)
    values = np.array([0.4, 0.55])
    swept = ns.sweep(system, "g", values, direction=None, transient=300, keep=20, method="exact", progress=False)
    for k, g in enumerate(values):
        run = ns.simulate(system.with_parameters(g=g), periods=320, samples=320 * 200, method="exact")
        assert swept["section"].values[k, -1] == pytest.approx(run["u"].values[-1], abs=1e-10)
        last = run["u"].values[run["time"].values >= 300 * 2 * np.pi - 1e-9]
        for found, sampled in ((swept["maximum"], last.max(axis=0)), (-swept["minimum"], (-last).max(axis=0))):
            beyond = found.values[k] - sampled
            assert (beyond > -1e-12).all() and (beyond < 1e-3).all()  # samples miss the top by little


def test_energy_of_two_masses_and_a_rigid_stop_is_lost_in_impacts_alone() -> None:
    """Without damping each impact takes (1 - e^2) v^2 / 2 of the mass that hits.

    (A force of size 0: a shape of code that is there.)"""
    masses, e = 2, 0.7

    def motion(t, u, p):
        return u.v0, u.v1, p.A * np.cos(p.w * t) - 2 * p.k * u.x0 + p.k * u.x1, -2 * p.k * u.x1 + p.k * u.x0

    system = ns.System(
        states=["x0", "x1", "v0", "v1"],
        parameters={"k": 1.0, "e": e, "g": 0.3, "A": 0.0, "w": 1.0},
        modes={"free": motion},
        indicators={"over": lambda t, u, p: u.x1 - p.g},
        transitions=[
            ns.Transition("free", "free", when="over > 0", reset=lambda t, u, p: (u.x0, u.x1, u.v0, -p.e * u.v1))
        ],
    )

    def energy(u: np.ndarray) -> np.ndarray:
        x, v = u[..., :masses], u[..., masses:]
        return 0.5 * (v**2).sum(-1) + (x**2).sum(-1) - x[..., 0] * x[..., 1]

    run = ns.simulate(system, duration=60.0, start=[0.6, 0.0, 0.0, 0.4], method="exact")
    hits = run["u_before"].values[:, 3]
    assert len(hits) > 6
    lost = 0.5 * (1 - e**2) * np.cumsum(hits**2)
    begun = energy(np.array([0.6, 0.0, 0.0, 0.4]))
    assert energy(run["u_after"].values) == pytest.approx(begun - lost, abs=1e-13)
    assert energy(run["u"].values[-1]) == pytest.approx(begun - lost[-1], abs=1e-13)


def row_of_masses(masses: int, stops: list[int], part: float, e: float, c: float, w: float) -> ns.System:
    """Driven at its first mass; some masses strike rigid stops at a part of what they would reach without them."""
    names = [f"{letter}{i}" for letter in "xv" for i in range(masses)]
    reach = np.abs(np.linalg.inv(stiffness(masses) - (w**2 - 1j * w * c) * np.eye(masses))[0])

    def motion(t, u, p):
        x, v = list(u)[:masses], list(u)[masses:]
        force = [-2 * x[i] - p.c * v[i] for i in range(masses)]
        for i in range(masses - 1):
            force[i] += x[i + 1]
            force[i + 1] += x[i]
        force[0] += np.cos(p.w * t)
        return (*v, *force)

    def rebound(i):
        return lambda t, u, p: [-p.e * a if k == masses + i else a for k, a in enumerate(list(u))]

    return ns.System(
        states=names,
        parameters={"w": w, "c": c, "e": e},
        modes={"free": motion},
        indicators={f"over{i}": lambda t, u, p, i=i: list(u)[i] - part * float(reach[i]) for i in stops},
        transitions=[ns.Transition("free", "free", when=f"over{i} > 0", reset=rebound(i)) for i in stops],
    )


def stiffness(masses: int) -> np.ndarray:
    return 2 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1)


@pytest.mark.parametrize(
    ("masses", "stops"), [(2, [0, 1]), pytest.param(50, list(range(4, 50, 5)), marks=pytest.mark.slow)]
)
def test_a_row_of_masses_with_rigid_stops(masses: int, stops: list[int]) -> None:
    """Energy: the force's work goes into dampers and impacts. Flights are matrix exponentials between the stops."""
    e, c, w, part = 0.8, 0.05, 0.6, 0.4
    system, K, periods = row_of_masses(masses, stops, part, e, c, w), stiffness(masses), 15
    first = ns.simulate(system, periods=periods, samples=2, method="exact")
    hits, before, after = (first[name].values for name in ("crossing_time", "u_before", "u_after"))
    assert len(hits) > 2 * periods and len(set(first["crossing_transition"].values)) >= min(len(stops), 5)

    ends = np.unique([*np.linspace(0.0, periods * 2 * np.pi / w, 15 * periods + 1), *hits])
    nodes, weights = np.polynomial.legendre.leggauss(10)
    instants = (0.5 * (ends[1:] + ends[:-1])[:, None] + 0.5 * np.diff(ends)[:, None] * nodes).ravel()
    weights = (0.5 * np.diff(ends)[:, None] * weights).ravel()
    run = ns.simulate(system, periods=periods, samples=instants, method="exact")
    u = run["u"].values[np.isin(run["time"].values, instants)]
    v = u[:, masses:]
    work = np.cos(w * instants) * v[:, 0]
    lost = (
        0.5
        * (1 - e**2)
        * sum(before[k, masses + stops[t]] ** 2 for k, t in enumerate(first["crossing_transition"].values))
    )
    end = first["u"].values[-1]
    energy = 0.5 * end[masses:] @ end[masses:] + 0.5 * end[:masses] @ K @ end[:masses]
    balance = energy + lost - weights @ (work - c * (v**2).sum(axis=1))
    assert abs(balance) < 1e-12 * float(weights @ np.abs(work))

    A = np.block([[np.zeros((masses, masses)), np.eye(masses)], [-K, -c * np.eye(masses)]])
    flow = LinearFlow(A, None, {1: (np.eye(2 * masses)[masses], np.zeros(2 * masses))}, w)
    gaps = part * np.abs(np.linalg.inv(K - (w**2 - 1j * w * c) * np.eye(masses))[0])[stops]
    t0, u0 = 0.0, np.zeros(2 * masses)
    for k, time in enumerate(hits[:40]):
        assert np.abs(flow.at(t0, u0, time) - before[k]).max() < 1e-12
        if time > t0:
            _, dense = flow.along(t0, u0, time, 100)
            assert (dense[1:-1, stops] < gaps + 1e-13).all()
        t0, u0 = time, after[k]


@pytest.mark.slow
def test_random_systems_run_as_by_their_series() -> None:
    """120 driven systems of 1 to 6 states with hysteresis between two modes, and kicks: as by series at 1e-13."""
    rng = np.random.default_rng(13)
    worst, crossings, judged = 0.0, 0, 0
    for case in range(120):
        n = 1 + case % 6
        A = [rng.normal(0.0, 1.0, (n, n)) for _ in range(2)]
        A = [one - (np.linalg.eigvals(one).real.max() + 0.5) * np.eye(n) for one in A]
        F, b, h = rng.normal(0.0, 4.0, n), rng.normal(0.0, 1.0, n), rng.normal(0.0, 1.0, n)
        kick = 0.1 * rng.normal(0.0, 1.0, n) - 0.05 * np.sign(h)

        def field(which: int, A=A, F=F, b=b):
            return lambda t, u, p: tuple(A[which] @ np.array(list(u)) + F * np.cos(2.0 * t) + which * b)

        system = ns.System(
            states=[f"u{i}" for i in range(n)],
            parameters={"c": 0.1},
            modes={"one": field(0), "other": field(1)},
            indicators={
                "high": lambda t, u, p, h=h: h @ np.array(list(u)) - p.c,
                "low": lambda t, u, p, h=h: h @ np.array(list(u)) + p.c,
            },
            transitions=[
                ns.Transition("one", "other", when="high > 0"),
                ns.Transition("other", "one", when="low < 0", reset=lambda t, u, p, k=kick: np.array(list(u)) + k),
            ],
        )
        start = rng.normal(0.0, 1.0, n)
        found, said = [], []
        for way in ({"method": "exact"}, {"method": "taylor", "rtol": 1e-13}):
            try:
                found.append(ns.simulate(system, periods=20, start=start, **way))
            except ns.SolveError as error:  # two stable modes may throw the state out by turns
                said.append(str(error).split(".")[0])
        if said:
            assert len(said) == 2 and said[0] == said[1], case
            continue
        exact, series = found
        judged += 1
        assert exact["crossing_transition"].values.tolist() == series["crossing_transition"].values.tolist(), case
        crossings += exact.sizes["crossing"]
        for name in ("crossing_time", "u_before"):
            worst = max(worst, float(np.abs(exact[name].values - series[name].values).max(initial=0.0)))
        worst = max(worst, float(np.abs(exact["u"].values[-1] - series["u"].values[-1]).max()))
    print(f"{judged} systems, {crossings} transitions, largest difference {worst:.1e}")
    assert judged > 90 and crossings > 1000
    assert worst < 1e-9
