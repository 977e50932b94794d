"""`chart` against closed forms, the logistic map and sweeps."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.attractors.mapper import Mapper
from nonsmooth.attractors.settled import Settled
from nonsmooth.attractors.settler import Settler
from nonsmooth.diagrams.chart import chart
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.sections import section_plan
from nonsmooth.results.provenance import read_provenance

QUIET = {"progress": False}
FIGURE_9 = {"g": 0.02}


@pytest.fixture(scope="module")
def logistic() -> ns.System:
    """x stands still but for a kick in every period: x -> r x (1 - x / c). The period number does not depend on c."""
    return ns.System(
        states=["x"],
        parameters={"r": 2.5, "c": 1.0},
        modes={"rest": lambda t, u, p: 0 * u.x},
        transitions=[ns.Transition("rest", "rest", at=0.5, reset=lambda t, u, p: p.r * u.x * (1 - u.x / p.c))],
        period=1.0,
    )


@pytest.fixture(scope="module")
def support() -> ns.System:
    return ns.models.discontinuous_support(**FIGURE_9)


def amplitude(p: dict[str, float], omega: np.ndarray, rho: np.ndarray) -> np.ndarray:
    return rho / np.hypot(2 * p["k"] - p["m"] * omega**2, p["c"] * omega)


def test_motion_without_contact_in_closed_form(support: ns.System) -> None:
    """Out of the support's reach the maximum is the linear amplitude; so it is wherever nothing is touched."""
    omega, rho = np.linspace(3, 7, 9), np.linspace(0.1, 0.3, 7)
    far = chart(support.with_parameters(g=1.0), {"omega": omega, "rho": rho}, **QUIET)
    expected = amplitude(support.values, omega[:, None], rho[None, :])
    assert far["maximum"].dims == ("omega", "rho", "state")
    np.testing.assert_allclose(far["maximum"].sel(state="x"), expected, rtol=1e-9)
    np.testing.assert_allclose(far["minimum"].sel(state="v"), -expected * omega[:, None], rtol=1e-9)
    assert (far["period_number"] == 1).all() and (far["contacts_per_period"] == 0).all() and (far["status"] == 0).all()
    near = chart(support, {"rho": rho, "omega": omega}, **QUIET).transpose("omega", "rho", "state")
    free = (near["contacts_per_period"] == 0).values
    assert 0 < free.sum() < free.size
    np.testing.assert_allclose(near["maximum"].values[free, 0], expected[free], rtol=1e-9)
    assert (expected[free] < support.values["g"]).all()


@pytest.mark.parametrize("direction", ["up", "down"])
def test_carried_rows_are_sweeps(support: ns.System, direction: str) -> None:
    omega, rho = np.linspace(5.0, 6.2, 13), np.array([0.3, 0.14, 0.2])
    plane = chart(support, {"omega": omega, "rho": rho}, carry={"omega": direction}, **QUIET)
    for i, value in enumerate(rho):
        swept = ns.sweep(support.with_parameters(rho=value), "omega", omega, direction=direction, keep=60, **QUIET)
        row = plane.isel(rho=i)
        assert row["period_number"].values.tolist() == swept["period_number"].values.tolist()
        np.testing.assert_allclose(row["maximum"], swept["maximum"], rtol=1e-8)


def test_period_numbers_of_the_logistic_map(logistic: ns.System) -> None:
    """Flips at 3, 1 + sqrt(6), 3.5440903; period three from 1 + sqrt(8); whatever the scale. Any n, any method."""
    known = {1.5: 1, 2.9: 1, 3.05: 2, 3.44: 2, 3.46: 4, 3.5545: 8, 3.83: 3, 3.7: 0, 4.0: 0}
    plane = chart(logistic, {"c": [0.5, 2.0], "r": list(known)}, start={"x": 0.1}, **QUIET)
    assert plane["period_number"].values.tolist() == [list(known.values())] * 2
    assert (plane["crossings_per_period"] == 1).all()


def test_exponents_in_closed_form(logistic: ns.System, support: ns.System) -> None:
    """ln |r - 2 r x| at the fixed point 1 - 1/r is ln |2 - r|; ln 2 at r = 4; -c / 2m for a linear oscillator."""
    plane = chart(logistic, {"c": [1.0], "r": [2.9, 3.999999]}, start={"x": 0.1}, lyapunov=1500, **QUIET)
    assert float(plane["lyapunov"][0, 0]) == pytest.approx(np.log(0.9), abs=1e-4)
    assert float(plane["lyapunov"][0, 1]) == pytest.approx(np.log(2), abs=0.03)
    linear = chart(support.with_parameters(g=1.0), {"c": [0.5, 0.9], "rho": [0.1, 0.2]}, lyapunov=True, **QUIET)
    expected = -np.array([0.5, 0.9]) / (2 * support.values["m"])
    np.testing.assert_allclose(linear["lyapunov"], np.stack([expected, expected], axis=1), rtol=2e-2)
    assert linear["lyapunov"].attrs["units"] == "1/s"


def test_a_failed_point_keeps_its_status(logistic: ns.System) -> None:
    plane = chart(logistic, {"c": [1.0, 2.0], "r": [2.5, 4.5]}, start={"x": 0.3}, lyapunov=100, **QUIET)
    assert plane["status"].values.tolist() == [[0, 3], [0, 3]]
    assert np.isfinite(plane["maximum"].values[:, 0]).all()
    assert np.isnan(plane["maximum"].values[:, 1]).all() and np.isnan(plane["lyapunov"].values[:, 1]).all()


def test_bits_do_not_depend_on_threads(support: ns.System) -> None:
    grid = {"omega": np.linspace(3, 7, 23), "rho": np.linspace(0.1, 0.3, 29)}
    for extra in ({}, {"carry": {"rho": "up"}}, {"start": [{"x": 0.0}, {"x": 0.01}]}):
        one, two = (chart(support, grid, threads=n, **extra, **QUIET) for n in (1, 2))
        assert one.identical(two)


def test_sizes_by_one_return_and_by_all_kept_ones_agree() -> None:
    """As a chart asks and as a sweep does: every period, status and count equal, extremes to rounding."""
    system = ns.models.discontinuous_support(omega=11.15)
    rng = np.random.default_rng(11)
    n = 120
    points = system.parameter_points({"g": rng.uniform(-0.0015, 0.002, n), "rho": rng.uniform(0.2, 0.5, n)})
    _, plan = section_plan(system, None)

    def mapped(settler: Settler) -> Mapper:
        mapper = Mapper(settler, settler.engine.prepare(points), np.arange(n), np.zeros((n, 2)), np.zeros(n, int), 0.0)
        mapper.settle(settler.rules(), 0, True)(n)
        return mapper

    settler = Settler(system, engine_for(system), plan, 400, 60, 16, stop_early=False)
    fast, patient = settler.run(points, np.arange(n), np.zeros((n, 2))), mapped(settler)
    slow = patient.settled()
    assert len(set(fast.period_number)) > 4 and 0 in fast.period_number
    assert (fast.period_number == slow.period_number).all() and (fast.status == slow.status).all()
    periodic = fast.period_number > 0
    np.testing.assert_allclose(fast.contacts[periodic], slow.contacts[periodic])
    np.testing.assert_allclose(fast.maximum[periodic], slow.maximum[periodic], rtol=1e-6)
    # at points of a cycle one return apart: differences over 1e-6 of its size, curvature in them
    np.testing.assert_allclose(fast.multiplier[periodic], slow.multiplier[periodic], atol=5e-3)
    early = mapped(Settler(system, engine_for(system), plan, 400, 60, 16))
    assert (early.settled().period_number == fast.period_number).all()
    assert early.jobs.spent.sum() < 0.7 * patient.jobs.spent.sum()


def oscillator_at_a_wall(*, filtered: bool) -> ns.System:
    """Two states, linear with and without contact; with two more states beside them, z' = v - z and y' = -8 y."""

    def field(contact: bool) -> Any:
        def rates(t: Any, u: Any, p: Any) -> Any:
            push = p.F * np.cos(p.w * t) - u.x - 0.1 * u.v - (100.0 * (u.x + 0.2) if contact else 0.0)
            return (u.v, push, u.v - u.z, -8 * u.y) if filtered else (u.v, push)

        return rates

    return ns.System(
        name="at a wall",
        states=["x", "v", *(["z", "y"] if filtered else [])],
        parameters={"F": 0.3, "w": 0.8},
        modes={"free": field(False), "contact": field(True)},
        indicators={"wall": lambda t, u, p: u.x + 0.2},
        transitions=[
            ns.Transition("free", "contact", when="wall > 0"),
            ns.Transition("contact", "free", when="wall < 0"),
        ],
    )


def test_states_that_only_follow_add_their_own_multipliers() -> None:
    """They change no period number; exp(-p T) and exp(-8 p T) join the multipliers, -1 and -8 the exponents."""
    F, w = (values.ravel() for values in np.meshgrid(np.linspace(0.2, 0.9, 6), np.linspace(0.5, 3.5, 6)))
    found = []
    for filtered in (False, True):
        system = oscillator_at_a_wall(filtered=filtered)
        points, rows = system.parameter_points({"F": F, "w": w}), np.arange(len(F))
        settler = Settler(system, engine_for(system), section_plan(system, None)[1], 2000, 40, 16)
        runs = settler.run(points, rows, np.zeros((len(F), len(system.states))))
        found.append((runs, *settler.exponents(points, rows, runs.last, runs.mode, 240, runs.maximum, runs.minimum)))
    (two, largest, _), (three, other, _) = found
    p = two.period_number
    assert len(set(p)) > 3
    # a long chaotic transient ends sooner or later by its rounding (F = 0.9, w = 0.5): compared where both have ended
    cycles = (p > 0) & (three.period_number > 0)
    assert cycles.sum() > 0.9 * (p > 0).sum()
    np.testing.assert_array_equal(three.period_number[cycles], p[cycles])
    own = np.exp(-p * 2 * np.pi / w)
    np.testing.assert_allclose(three.multiplier[cycles], np.maximum(two.multiplier, own)[cycles], rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(other[cycles], np.maximum(largest, -1.0)[cycles], atol=0.02)


def test_several_starts_show_coexisting_attractors(support: ns.System) -> None:
    """Between the two jumps of Fig. 9 both branches are there; far from them one."""
    starts = [{"x": 0.0}, {"x": 0.018, "v": 0.1}, {"x": -0.03}, {"v": 0.15}]
    plane = chart(support, {"omega": [3.9, 5.5, 6.8], "rho": [0.14]}, start=starts, **QUIET)
    assert plane["period_number"].dims == ("omega", "rho", "start")
    assert plane["n_attractors"].values.ravel().tolist() == [1, 2, 1]


def test_the_result_holds_its_input_and_survives_a_file(support: ns.System, tmp_path) -> None:
    plane = chart(support, {"omega": [3.9, 5.5], "rho": [0.14, 0.15, 0.2]}, start={"x": 0.001}, **QUIET)
    record = read_provenance(plane)
    assert record["verb"] == "chart" and record["options"]["grid"]["rho"] == [0.14, 0.15, 0.2]
    assert plane["omega"].attrs["units"] == "rad/s"
    again = ns.load(ns.save(plane, tmp_path / "plane.nc"))
    assert again.identical(plane)


def test_labels_only_stay_small(support: ns.System) -> None:
    """Bytes of the columns of a chart of 4000 x 4000 points without extremes: well below 1 GiB."""
    from nonsmooth.diagrams.chart_work import ChartWork

    _, plan = section_plan(support, None)
    settler = Settler(support, engine_for(support), plan, 440, 60, 16, extremes=False)
    grid = {"omega": np.linspace(3, 7, 4000), "rho": np.linspace(0.1, 0.3, 4000)}
    work = ChartWork(settler, grid, np.zeros((1, 2)), np.zeros(1, dtype=np.int64))
    per_point = sum(np.dtype(item.dtype).itemsize * int(np.prod(item.shape)) for item in work.columns().values())
    assert per_point * 16_000_000 < 0.5 * 2**30


@pytest.mark.parametrize(
    ("grid", "options", "message"),
    [
        ({"omega": [3.0]}, {}, "two parameters"),
        ({"omega": [3.0], "gap": [0.1]}, {}, "gap"),
        ({"omega": [3.0, 3.0], "rho": [0.1]}, {}, "more than once"),
        ({"omega": [3.0], "rho": [0.1]}, {"carry": {"g": "up"}}, "carry"),
        ({"omega": [3.0], "rho": [0.1]}, {"carry": "rho"}, "carry"),
        ({"omega": [3.0], "rho": [0.1]}, {"lyapunov": 5}, "at least 40"),
        ({"omega": [3.0], "rho": [0.1]}, {"threads": 0}, "threads"),
    ],
)
def test_bad_input_is_told_at_the_door(support: ns.System, grid, options, message) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        chart(support, grid, **options, **QUIET)


def test_joining_keeps_every_field() -> None:
    parts = [Settled.empty(2, 2), Settled.empty(3, 2)]
    joined = Settled.joined(parts)
    assert all(len(getattr(joined, item.name)) == 5 for item in fields(Settled))
