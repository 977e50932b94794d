"""`simulate`: what a run holds, and single runs against closed forms stretch by stretch."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from linear_flow import LinearFlow

import nonsmooth as ns
from nonsmooth.results.provenance import read_provenance

METHODS = {"exact": {}, "taylor": {"rtol": 1e-14}, "rkf45": {"rtol": 1e-13}}


def support_flows(p: dict[str, float]) -> dict[int, LinearFlow]:
    """The two modes of the paper's oscillator in closed form."""
    wave = {1: ([0, p["rho"] / p["m"]], [0, 0])}
    free = [[0, 1], [-2 * p["k"] / p["m"], -p["c"] / p["m"]]]
    contact = [[0, 1], [-(2 * p["k"] + p["k_s"]) / p["m"], -(p["c"] + p["c_s"]) / p["m"]]]
    return {
        0: LinearFlow(free, [0, 0], wave, p["omega"]),
        1: LinearFlow(contact, [0, p["k_s"] * p["g"] / p["m"]], wave, p["omega"]),
    }


def replay(run: xr.Dataset, p: dict[str, float], tolerance: float) -> None:
    """Every stretch between crossings by the closed form of its mode: it ends where the condition of the mode's exit
    becomes true, and at no instant before (1000 per stretch)."""
    flows = support_flows(p)

    def h_a(u):
        return u[..., 0] - p["g"]

    def h_b(u):
        return -(u[..., 0] - p["g"]) - p["c_s"] / p["k_s"] * u[..., 1]

    scale = np.array([1e-3, 1e-2])
    ends = [*run["crossing_time"].values, float(run["time"][-1])]
    earlier = np.concatenate([run["u_before"].values, run["u"].values[-1:]])
    t0, u0, mode = float(run["time"][0]), run["u"].values[0], int(run["mode"][0])
    for k, t1 in enumerate(ends):
        if t1 > t0:
            times, states = flows[mode].along(t0, u0, t1, 1000)
            assert np.max(np.abs(states[-1] - earlier[k]) / scale) < tolerance, (k, t0, t1)
            within = (times > t0 + 1e-9) & (times < t1 - 1e-9)
            inside = (h_a(states) > 0) & (h_b(states) < 0)
            assert (inside[within] if mode == 1 else ~inside[within]).all(), (k, t0, t1, mode)
        if k < len(run["crossing_time"]):
            mode = 1 - mode
            t0, u0 = t1, earlier[k]
            assert min(abs(h_a(u0)), abs(h_b(u0))) < 1e-13


@pytest.mark.parametrize(
    ("method", "changes"),
    [(method, {}) for method in METHODS]
    + [
        ("exact", changes)
        for changes in (
            {"rho": 0.39, "c_s": 0.0},
            {"rho": 0.39, "c_s": 60.0},
            {"rho": 0.23, "g": 0.0014, "omega": 9.6},
            {"c": 12.0, "rho": 3.0},
            {"c": 2 * np.sqrt(2 * 8.47 * 0.838), "rho": 3.0},
            {"k": 0.0, "c": 0.0, "g": 0.0},
            {"c": 0.0, "omega": np.sqrt(2 * 8.47 / 0.838)},
            {"c_s": 70.0, "rho": 1e-3, "g": -0.05, "omega": 5.0},
        )
    ],
)
def test_the_support_stretch_by_stretch(method: str, changes: dict[str, float]) -> None:
    """Table 1, then an elastic support, an overdamped contact, Fig. 13, over- and critically damped free modes,
    a free mass, resonance, and a support far into the mass's way."""
    system = ns.models.discontinuous_support(**changes)
    run = ns.simulate(system, periods=12, method=method, **METHODS[method])
    assert run["crossing_time"].size >= 2
    replay(run, dict(system.values), 1e-9)


def test_release_leaves_the_support_behind() -> None:
    """At release h_b = 0 with x > g and v < 0; the next contact comes after the mass was below g."""
    run = ns.simulate(ns.models.discontinuous_support(), periods=20)
    released = run["crossing_transition"].values == 1
    u = run["u_before"].values[released]
    assert (u[:, 0] > -0.0045).all()
    assert (u[:, 1] < 0).all()
    times = run["crossing_time"].values
    for t0, t1 in zip(times[released][:-1], times[1:][released[:-1]], strict=False):
        between = (run["time"].values > t0) & (run["time"].values < t1)
        assert not between.any() or run["u"].values[between, 0].min() < -0.0045


def test_entry_by_separation_beyond_the_gap() -> None:
    """From x = g + d, v < -d / tau, pushed: free until x - g + tau v rises through 0, with x > g."""
    p = {"g": -0.05, "rho": 1e-3, "omega": 5.0, "c_s": 60.0}
    system = ns.models.discontinuous_support(**p)
    tau = 60.0 / 1210.0
    start = (-0.05 + 2e-4, -(2e-4 + 1e-4) / tau)
    flow = support_flows(dict(system.values))[0]
    times, states = flow.along(0.0, start, 0.05, 200000)
    force = states[:, 0] + 0.05 + tau * states[:, 1]
    first = int(np.argmax(force > 0))
    entry = times[first - 1] - force[first - 1] * (times[1] - times[0]) / (force[first] - force[first - 1])
    assert states[first, 0] > -0.05
    assert states[:first, 0].min() > -0.05
    for method, settings in METHODS.items():
        run = ns.simulate(system, duration=0.05, start=start, method=method, **settings)
        assert run["mode"].values[0] == 0
        assert run["crossing_transition"].values[0] == 0
        assert abs(run["crossing_time"].values[0] - entry) < 1e-10


def test_what_a_run_holds() -> None:
    system = ns.models.discontinuous_support()
    instants = np.array([0.0, 0.3, 0.31, 2.0])
    run = ns.simulate(system, periods=3, samples=instants)
    crossings = run["crossing_time"].values
    assert set(run.dims) == {"time", "state", "crossing", "touch"}
    assert run["time"].size == 4 + 2 * len(crossings)
    assert (np.diff(run["time"]) >= 0).all()
    assert run["segment"].values[-1] == (crossings <= 2.0).sum() or crossings[-1] > 2.0
    for k, t in enumerate(crossings):
        here = np.flatnonzero(run["time"].values == t)
        assert run["segment"].values[here].tolist() == [k, k + 1]
        assert np.array_equal(run["u"].values[here], [run["u_before"].values[k], run["u_after"].values[k]])
    assert set(instants) <= set(run["time"].values)
    assert str(run["status"].attrs["flag_meanings"]).split()[int(run["status"])] == "ok"
    record = read_provenance(run)
    assert record["verb"] == "simulate" and record["method"] == "exact"
    assert ns.System.from_text(record["system"]["text"]).content_hash() == system.content_hash()


@pytest.mark.parametrize("method", METHODS)
def test_outputs_follow_the_mode(method: str) -> None:
    """The contact force is 0 when free and -(k_s (x - g) + c_s v) in contact, at both limits of a crossing."""
    system = ns.models.discontinuous_support()
    run = ns.simulate(system, periods=4, method=method)
    p, u = system.values, run["u"].values
    force = np.where(run["mode"] == 1, -(p["k_s"] * (u[:, 0] - p["g"]) + p["c_s"] * u[:, 1]), 0.0)
    assert np.max(np.abs(run["contact_force"].values - force)) < 1e-12
    assert run["contact_force"].attrs["units"] == "N"


def test_a_transient_is_not_recorded_and_time_goes_on() -> None:
    system = ns.models.discontinuous_support()
    whole = ns.simulate(system, periods=10, samples=10 * 64 + 1)
    late = ns.simulate(system, periods=4, transient=6, samples=4 * 64 + 1)
    period = system.period()
    assert late["time"].values[0] == pytest.approx(6 * period)
    assert late["time"].values[-1] == pytest.approx(10 * period)
    assert np.max(np.abs(late["u"].values[-1] - whole["u"].values[-1])) < 1e-14
    kept = whole["crossing_time"].values > 6 * period
    assert np.max(np.abs(late["crossing_time"].values - whole["crossing_time"].values[kept])) < 1e-13


@pytest.mark.parametrize("method", METHODS)
def test_a_run_goes_on_from_a_result(method: str) -> None:
    """Two runs of 5 periods are one of 10; the second begins in the mode in which the first ended."""
    system = ns.models.discontinuous_support()
    settings = METHODS[method]
    whole = ns.simulate(system, periods=10, method=method, **settings)
    first = ns.simulate(system, periods=5, method=method, **settings)
    second = ns.simulate(system, periods=5, start=first, method=method, **settings)
    assert second["mode"].values[0] == first["mode"].values[-1]
    assert np.max(np.abs(second["u"].values[-1] - whole["u"].values[-1])) < 1e-11
    assert second["crossing_time"].size + first["crossing_time"].size == whole["crossing_time"].size


def test_instants_at_the_ends_of_a_run_may_be_off_by_rounding() -> None:
    system = ns.mechanical(1.0, 0.2, 4.0, parameters={"w": 0.7}, forcing={"q": lambda t, p: np.cos(p.w * t)})
    period = system.period()
    assert period is not None
    instants = np.linspace(1000 * period, 1100 * period, 301) * (1 - 4e-16)
    assert instants[0] < 1000 * period
    run = ns.simulate(system, periods=100, transient=1000, samples=instants)
    assert run.sizes["time"] == 301
    with pytest.raises(ValueError, match="lie outside the recorded time"):
        ns.simulate(system, periods=100, transient=1000, samples=instants - 1e-6)


def test_memory_and_mode_of_a_result_are_a_start() -> None:
    """A switch with hysteresis: up at x > 1, down at x < -1; in between only the mode tells. Memory counts. (A second
    state and a force of size 0: a shape of code that is there.)"""

    def along(speed):
        return lambda t, u, p: (speed * p.a, -u.y + p.A * np.cos(p.w * t))

    system = ns.System(
        states=["x", "y"],
        parameters={"a": 1.0, "A": 0.0, "w": 1.0},
        memory={"n": 0.0},
        modes={"rise": along(1.0), "fall": along(-1.0)},
        indicators={"top": lambda t, u, p: u.x - 1, "bottom": lambda t, u, p: u.x + 1},
        transitions=[
            ns.Transition("rise", "fall", when="top > 0", write={"n": lambda t, u, p: p.n + 1}),
            ns.Transition("fall", "rise", when="bottom < 0", write={"n": lambda t, u, p: p.n + 1}),
        ],
    )
    first = ns.simulate(system, duration=5.0, start={"x": 0.5})  # 0.5 up, 2 down, 2 up, 0.5 down
    assert first["crossing_time"].values == pytest.approx([0.5, 2.5, 4.5], abs=1e-12)
    assert first["n"].values[-1] == 3
    assert first["u"].values[-1, 0] == pytest.approx(0.5)
    second = ns.simulate(system, duration=1.0, start=first)
    assert second["u"].values[-1, 0] == pytest.approx(-0.5)
    assert second["n"].values[-1] == 3
    forced_up = ns.simulate(system, duration=0.25, start=first, mode="rise")
    assert forced_up["u"].values[-1, 0] == pytest.approx(0.75)


@pytest.mark.parametrize("method", ["taylor", "rkf45"])
def test_the_smoothed_switch_remembers_the_velocity_at_its_entry(method: str) -> None:
    """v_a is the velocity with which the band was entered, from the entry on, and stays until the next."""
    system = ns.models.discontinuous_support().smoothed(1e-5)
    run = ns.simulate(system, periods=4, method=method, rtol=1e-10)
    names = system.modes
    entries = [k for k, t in enumerate(run["crossing_transition"].values) if system.transitions[t].writes]
    assert len(entries) >= 4
    seen = 0
    for k in entries:
        segment = run["segment"].values == k + 1
        if segment.any() and names[system.transitions[run["crossing_transition"].values[k]].target] != "free":
            v_a = run["v_a"].values[segment]
            # at S_b -> S_a, where v = 0, the paper's memory is 0, which is the velocity there
            assert np.allclose(v_a, run["u_before"].values[k, 1], atol=1e-9)
            seen += 1
    assert seen >= 4
    assert run["v_a"].attrs["units"] == "m/s"


def test_a_state_that_a_mode_lacks_is_nan() -> None:
    """A mass that sticks to a moving hook at x = 1 for a phase: stuck it has no velocity."""
    system = ns.System(
        states=["x", "v"],
        parameters={"T": 2.0},
        modes={
            "free": lambda t, u, p: (u.v, -1.0 + 0 * u.x),
            "stuck": ns.Mode(lambda t, u, p: (0 * u.x,), states=["x"]),
        },
        indicators={"floor": lambda t, u, p: u.x},
        transitions=[
            ns.Transition("free", "stuck", when="floor < 0", reset=lambda t, u, p: (0.0,)),
            ns.Transition("stuck", "free", at=0.0, reset=lambda t, u, p: (u.x, 0.8)),
        ],
        period=lambda p: p.T,
    )
    run = ns.simulate(system, periods=2.5, start={"x": 0.5, "v": 0.0}, samples=101)
    stuck = run["mode"].values == 1
    assert stuck.any() and (~stuck).any()
    assert np.isnan(run["u"].sel(state="v").values[stuck]).all()
    assert np.isfinite(run["u"].sel(state="v").values[~stuck]).all()
    assert np.isfinite(run["u"].sel(state="x").values).all()
    # falls from 0.5 for 1, is thrown at 2 with 0.8, lands after 1.6, is thrown at 4
    assert np.allclose(run["crossing_time"], [1.0, 2.0, 3.6, 4.0], atol=1e-12)
    again = ns.simulate(system, periods=1, start=ns.simulate(system, duration=1.5, start={"x": 0.5}))
    assert again["mode"].values[0] == 1
    assert np.isnan(again["u"].values[0, 1])


@pytest.mark.parametrize("method", ["taylor", "rkf45"])
def test_a_solution_that_ends_says_where(method: str) -> None:
    """x' = x^2 from 1 is 1 / (1 - t): infinite at t = 1."""
    system = ns.System(states=["x"], parameters={"a": 1.0}, modes={"only": lambda t, u, p: p.a * u.x**2})
    run = ns.simulate(system, duration=0.999, start=[1.0], method=method, rtol=1e-12)
    assert run["u"].values[-1, 0] == pytest.approx(1000.0, rel=1e-7)
    with pytest.raises(
        ns.SolveError, match=r"grew beyond 1e9 times its scale.*at t = 0\.99.*x = .*mode 'only'"
    ) as caught:
        ns.simulate(system, duration=2.0, start=[1.0], method=method)
    assert caught.value.status == "diverged"
    assert caught.value.time == pytest.approx(1.0, abs=1e-6)
    assert caught.value.mode == "only"


@pytest.mark.parametrize("method", ["taylor", "rkf45"])
@pytest.mark.parametrize("power", [2, 3, 4])
@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10, 1e-12, 1e-13])
def test_a_series_with_gaps_does_not_hide_its_end(method: str, power: int, rtol: float) -> None:
    """x' = cos(t^n): at t = 0 most coefficients of the series are zero, the last ones too; the truth by quadrature."""
    system = ns.System(
        states=["x"], parameters={"w": 1.0}, modes={"only": lambda t, u, p: np.cos(p.w * t**power) + 0 * u.x}
    )
    nodes, weights = np.polynomial.legendre.leggauss(200)
    truth = np.sum(weights * np.cos((1 + nodes) ** power))  # over 0 ... 2
    run = ns.simulate(system, duration=2.0, method=method, rtol=rtol, samples=2)
    assert abs(run["u"].values[-1, 0] - truth) < 100 * rtol


@pytest.mark.parametrize("states", [2, 3])
def test_unstable_linear_motion_ends_as_diverged(states: int) -> None:
    """x'' = k x from x = 1, v = sqrt(k): exp(sqrt(k) t) passes 1e9 at ln(1e9) / sqrt(k), beside a state at rest too."""
    names = ["x", "v", "y"][:states]
    modes = {"only": lambda t, u, p: (u.v, p.k * u.x, *(-u[name] for name in names[2:]))}
    system = ns.System(states=names, parameters={"k": 4.0}, modes=modes)
    with pytest.raises(ns.SolveError) as caught:
        ns.simulate(system, duration=30.0, start={"x": 1.0, "v": 2.0})
    assert caught.value.status == "diverged"
    assert caught.value.time == pytest.approx(np.log(1e9) / 2, abs=1.0)


@pytest.mark.parametrize("method", METHODS)
def test_a_start_beyond_a_rigid_stop_is_refused(method: str) -> None:
    with pytest.raises(ns.SolveError, match=r"beyond a stop.*x = 1\.5, v = 0, mode 'motion'") as caught:
        ns.simulate(ns.models.impact_oscillator(), periods=1, start={"x": 1.5}, method=method)
    assert caught.value.status == "beyond_stop"


@pytest.mark.parametrize("method", METHODS)
def test_a_start_in_contact_takes_the_transition_first(method: str) -> None:
    system = ns.models.discontinuous_support()
    run = ns.simulate(system, duration=0.02, start={"x": 0.0, "v": 0.0}, method=method)  # g = -4.5 mm
    assert run["mode"].values[0] == 1
    assert run["crossing_time"].size == 0
    named = ns.simulate(system, duration=0.02, start={"x": -0.02}, mode="contact", method=method)
    assert named["mode"].values[0] == 0


@pytest.mark.parametrize("suffix", [".nc", ".zarr"])
def test_a_run_is_saved_and_loaded_whole(suffix: str, tmp_path: Path) -> None:
    for name, system in (
        ("sharp", ns.models.discontinuous_support()),
        ("smooth", ns.models.discontinuous_support().smoothed(1e-4)),
    ):
        run = ns.simulate(system, periods=3)
        again = ns.load(ns.save(run, tmp_path / (name + suffix)))
        xr.testing.assert_identical(run, again)


def test_a_motion_as_small_as_the_tolerance_is_warned_of() -> None:
    """x'' + x = 1e-9 cos 2t by a method whose atol is 1e-9: nothing of it is sure; with the right scale it is."""

    def system(**more):
        return ns.System(
            states=["x", "v"],
            parameters={"F": 1e-9},
            modes={"m": lambda t, u, p: (u.v, p.F * np.cos(2 * t) - u.x)},
            **more,
        )

    with pytest.warns(UserWarning, match=r"below a hundred times atol.*System\(scale="):
        ns.simulate(system(), periods=2, method="rkf45")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = ns.simulate(system(scale={"x": 1e-9, "v": 1e-9}), periods=2, method="rkf45")
        ns.simulate(system(), periods=2, method="exact")
    t = run.time.values
    exact = 1e-9 / 3 * (np.cos(t) - np.cos(2 * t))
    np.testing.assert_allclose(run.u.sel(state="x"), exact, atol=1e-16)
    with pytest.warns(UserWarning, match="below a hundred times atol"):
        ns.sweep(system(), "F", [1e-9, 2e-9], transient=2, keep=4, max_period=3, method="rkf45", progress=False)


@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_five_transitions_of_one_instant_are_taken_by_every_method(method: str) -> None:
    """Thrown 0.9 beyond the surface, the state is set back by 0.25 until it is before it again: four times."""
    system = ns.System(
        states=["x", "v"],
        parameters={"A": 0.0, "w": 1.0},
        modes={"first": lambda t, u, p: (1.0, p.A * np.cos(p.w * t)), "then": lambda t, u, p: (1.0, -u.v)},
        indicators={"beyond": lambda t, u, p: u.x},
        transitions=[
            ns.Transition("first", "then", when="beyond > 0", reset=lambda t, u, p: (u.x + 0.9, u.v)),
            ns.Transition("then", "then", when="beyond > 0", reset=lambda t, u, p: (u.x - 0.25, u.v)),
        ],
    )
    run = ns.simulate(system, duration=0.55, start={"x": -0.5}, method=method)
    np.testing.assert_allclose(run.crossing_time, 0.5, atol=1e-12)
    assert run.crossing_transition.values.tolist() == [0, 1, 1, 1, 1]
    np.testing.assert_allclose(run.u.values[-1, 0], -0.1 + 0.05, atol=1e-12)


def test_a_run_behind_a_transient_has_as_many_samples_as_one_without() -> None:
    """Whole periods are sampled at the same phases, whatever the rounding of the times they begin and end at."""
    system = ns.models.discontinuous_support(g=1.0)
    sizes = [ns.simulate(system, periods=3, transient=wait).sizes["time"] for wait in (0, 7, 1000)]
    assert sizes[0] == sizes[1] == sizes[2] and (sizes[0] - 1) % 3 == 0


@pytest.mark.parametrize("method", ["taylor", "rkf45"])
def test_a_method_that_is_asked_for_is_the_one_that_runs(method: str) -> None:
    """x = cos t: at a tolerance of 1e-4 a series errs, and the exact flow would not."""
    mass = ns.mechanical(1.0, 0.0, 1.0, coordinates=["x"])
    run = ns.simulate(mass, duration=20.0, start={"x": 1.0}, samples=101, method=method, rtol=1e-4)
    error = np.abs(run["u"].sel(state="x").values - np.cos(run["time"].values)).max()
    assert 1e-9 < error < 1e-2


@pytest.mark.parametrize("method", ["exact", "taylor"])
@pytest.mark.parametrize("begin", [0.2, 0.21])
def test_a_log_that_is_full_while_elements_are_asked_goes_on(method: str, begin: float) -> None:
    """Ten transitions a cycle, four of them at one instant: a thousand in one run are those of ten runs."""
    system = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"w": 1.0},
        forcing={"q": lambda t, p: 2.0 * np.cos(p.w * t)},
        elements={
            "rail": ns.elements.Coulomb(at="q", friction=0.2),
            "soft": ns.elements.ElasticStop(at="q", position=0.5, stiffness=20.0, damping=0.2),
            "wall": ns.elements.Stop(at="q", position=0.5, restitution=0.8),
        },
    )
    whole = ns.simulate(system, periods=160, start=[begin, 0.0], samples=2, method=method)
    part, times = [begin, 0.0], []
    for k in range(10):
        part = ns.simulate(system, periods=16, start=part, samples=2, method=method)
        times += list(part.crossing_time.values + (32 * np.pi * k - float(part.time[0])))
    assert len(times) == whole.sizes["crossing"] > 1000
    np.testing.assert_allclose(whole.crossing_time, times, atol=1e-8)


@pytest.mark.physics
@pytest.mark.parametrize("method", ["exact", "taylor", "rkf45"])
@pytest.mark.parametrize("at", [0.0, 0.3])
def test_a_kick_at_the_end_of_a_run_is_in_it_whatever_rounding_says(method: str, at: float) -> None:
    """The instants of both are sums of different numbers, of which either may be the smaller by its last digit."""
    system = ns.System(
        states=["x", "v"],
        parameters={"w": 1.0},
        modes={"free": lambda t, u, p: [u.v, -0.3 * u.v - 4.0 * u.x]},
        transitions=[ns.Transition("free", "free", at=at, reset=lambda t, u, p: [u.x, u.v + 0.5])],
        elements={"soft": ns.elements.ElasticStop(gap=lambda t, u, p: 0.12 - u.x, on={"v": -1.0}, stiffness=30.0)},
        period=lambda p: 2 * np.pi / p.w,
    )
    random = np.random.default_rng(1)
    for w, n in zip(random.uniform(0.5, 2.0, 40), random.integers(1, 7, 40), strict=True):
        until = float(n + at) * 2 * np.pi / w
        run = ns.simulate(system.with_parameters(w=w), duration=until, start=[0.05, 0.0], method=method)
        assert run["crossing_time"].values[-1] == pytest.approx(until, abs=1e-9)
        assert (run["u_after"] - run["u_before"]).values[-1] == pytest.approx([0.0, 0.5])
