"""`sweep` against closed forms: the logistic map, linear amplitudes, dense sampling."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.results.provenance import read_provenance

QUIET = {"progress": False}
METHODS = {"exact": {}, "taylor": {"rtol": 1e-12}, "rkf45": {"rtol": 1e-11}}


def words(data: xr.DataArray) -> list[str]:
    names = dict(zip(data.attrs["flag_values"], data.attrs["flag_meanings"].split(), strict=True))
    return [names[int(value)] for value in data.values.ravel()]


@pytest.fixture(scope="module")
def logistic() -> ns.System:
    """x stands still but for a kick at phase 0.5 of every period: x -> r x (1 - x). Its section is the logistic map."""
    return ns.System(
        states=["x"],
        parameters={"r": 2.5},
        modes={"rest": lambda t, u, p: 0 * u.x},
        transitions=[ns.Transition("rest", "rest", at=0.5, reset=lambda t, u, p: p.r * u.x * (1 - u.x))],
        period=1.0,
    )


@pytest.fixture(scope="module")
def linear() -> ns.System:
    """The paper's oscillator with its support out of reach."""
    return ns.models.discontinuous_support(g=1.0, rho=0.2, c=0.87)


def amplitude(p: dict[str, float], omega: np.ndarray) -> np.ndarray:
    return p["rho"] / np.hypot(2 * p["k"] - p["m"] * omega**2, p["c"] * omega)


def test_period_numbers_of_the_logistic_map(logistic: ns.System) -> None:
    """Flips at 3, 1 + sqrt(6), 3.5440903, 3.5644073; period three from 1 + sqrt(8) to 3.8414990."""
    known = {
        1.5: 1,
        2.9: 1,
        3.05: 2,
        3.44: 2,
        3.46: 4,
        3.54: 4,
        3.5445: 8,
        3.564: 8,
        3.566: 16,
        3.83: 3,
        3.8285: 3,
        3.845: 6,
        3.6275: 6,
        3.7: 0,
        3.9: 0,
        4.0: 0,
    }
    diagram = ns.sweep(logistic, "r", list(known), start={"x": 0.3}, direction=None, **QUIET)
    found = dict(zip(known, diagram["period_number"].values.tolist(), strict=True))
    assert found == known
    for status, expected in zip(words(diagram["status"]), known.values(), strict=True):
        assert status == ("ok" if expected else "not_periodic")


def test_few_kept_points_show_short_periods(logistic: ns.System) -> None:
    """Five points show cycles of up to four: not the 8 at 3.5445, and the result says up to where."""
    diagram = ns.sweep(logistic, "r", [2.9, 3.05, 3.46, 3.5445, 3.83], start={"x": 0.3}, keep=5, **QUIET)
    assert diagram["period_number"].values.tolist() == [1, 2, 4, 0, 3]
    assert read_provenance(diagram)["options"]["max_period"] == 4


def test_section_points_and_extremes_of_the_logistic_map(logistic: ns.System) -> None:
    """The fixed point 1 - 1/r, and the 2-cycle (r + 1 +- sqrt((r - 3)(r + 1))) / (2 r)."""
    r = np.array([2.2, 2.8, 3.1, 3.3])
    diagram = ns.sweep(logistic, "r", r, start={"x": 0.3}, **QUIET)
    root = np.sqrt(np.maximum((r - 3) * (r + 1), 0))
    high = np.where(r < 3, 1 - 1 / r, (r + 1 + root) / (2 * r))
    low = np.where(r < 3, 1 - 1 / r, (r + 1 - root) / (2 * r))
    assert np.allclose(diagram["maximum"].sel(state="x"), high, atol=1e-9)
    assert np.allclose(diagram["minimum"].sel(state="x"), low, atol=1e-9)
    points = diagram["section"].sel(state="x").values
    assert np.allclose(np.sort(points[:, -2:], axis=1), np.stack([low, high], axis=1), atol=1e-9)
    assert np.allclose(diagram["crossings_per_period"], 1.0)


def test_near_a_flip_a_period_is_right_or_slow(logistic: ns.System) -> None:
    """Both sides of r = 3, from 1e-1 down to 1e-7 away: never a wrong number."""
    r = np.sort(np.concatenate([3 - np.logspace(-7, -1, 13), 3 + np.logspace(-7, -1, 13)]))
    diagram = ns.sweep(logistic, "r", r, start={"x": 0.3}, direction=None, **QUIET)
    truth = np.where(r < 3, 1, 2)
    numbers, status = diagram["period_number"].values, np.array(words(diagram["status"]))
    assert (numbers[status == "ok"] == truth[status == "ok"]).all()
    assert set(status[numbers == 0]) <= {"slow"}
    assert (status[np.abs(r - 3) > 0.02] == "ok").all()


def test_a_diverging_point_keeps_its_status_and_the_rest_is_whole(logistic: ns.System) -> None:
    """Beyond r = 4 the map leaves every bound. Carried on, the next point starts from the last good one."""
    r = np.array([2.5, 4.5, 3.2, 5.0])
    for direction in ("up", "down", None):
        diagram = ns.sweep(logistic, "r", r, start={"x": 0.3}, direction=direction, transient=200, **QUIET)
        assert words(diagram["status"]) == ["ok", "diverged", "ok", "diverged"]
        assert diagram["period_number"].values.tolist() == [1, 0, 2, 0]
        bad = diagram["status"].values == 3
        for name in ("section", "maximum", "minimum", "crossings_per_period"):
            assert np.isnan(diagram[name].values[bad]).all()
            assert np.isfinite(diagram[name].values[~bad]).all()
        assert np.allclose(diagram["maximum"].values[0, 0], 0.6)


@pytest.mark.parametrize("method", METHODS)
def test_negative_damping_for_a_part_of_the_values(method: str, linear: ns.System) -> None:
    values = np.array([0.5, -0.5, 1.0, -2.0])
    swept = ns.sweep(
        linear.with_parameters(g=1e12),
        "c",
        values,
        direction=None,
        transient=200,
        keep=4,
        max_period=3,
        method=method,
        **METHODS[method],
        **QUIET,
    )
    assert words(swept["status"]) == ["ok", "diverged", "ok", "diverged"]
    p = dict(linear.values)
    for i in (0, 2):
        assert swept["maximum"].values[i, 0] == pytest.approx(amplitude(p | {"c": values[i]}, p["omega"]), rel=1e-9)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("phase", [0.0, 0.37])
def test_extremes_of_a_linear_motion(method: str, phase: float, linear: ns.System) -> None:
    """x = a cos(w t - d): true extremes, section points at the phase, clearance of both indicators."""
    omega = np.linspace(3.0, 6.0, 7)
    swept = ns.sweep(
        linear,
        "omega",
        omega,
        section=ns.Stroboscopic(phase),
        transient=150,
        keep=20,
        method=method,
        **METHODS[method],
        **QUIET,
    )
    p = dict(linear.values)
    a = amplitude(p, omega)
    assert (swept["period_number"] == 1).all()
    assert words(swept["status"]) == ["ok"] * 7
    for state, size in (("x", a), ("v", a * omega)):
        assert np.allclose(swept["maximum"].sel(state=state), size, rtol=1e-8)
        assert np.allclose(swept["minimum"].sel(state=state), -size, rtol=1e-8)
    response = p["rho"] / (2 * p["k"] - p["m"] * omega**2 + 1j * p["c"] * omega)
    expected = (response * np.exp(2j * np.pi * phase)).real
    assert np.max(np.abs(swept["section"].sel(state="x").values - expected[:, None])) < 1e-9
    assert np.allclose(swept["clearance"].sel(indicator="penetration"), 1.0 - a, rtol=1e-9)
    assert (swept["crossings_per_period"] == 0).all()


def test_an_undamped_motion_is_never_called_settled(linear: ns.System) -> None:
    """With c = 0 the free oscillation never dies: not periodic, or slow."""
    swept = ns.sweep(linear, "c", [0.0], start={"x": 0.01}, transient=50, keep=60, **QUIET)
    assert words(swept["status"])[0] in ("not_periodic", "slow")
    assert swept["period_number"].values[0] == 0


def test_undamped_motions_that_all_repeat_are_no_attractors() -> None:
    """x'' + x = cos w t, w = 1/2, 1/3 and 2: every motion repeats after one, one and two periods, and none attracts."""
    free = ns.mechanical(
        1.0, 0.0, 1.0, parameters={"w": 0.5}, forcing={"q": lambda t, p: np.cos(p.w * t)}, coordinates=["q"]
    )
    swept = ns.sweep(free, "w", [0.5, 1 / 3, 2.0], start=[0.3, 0.1], direction=None, **QUIET)
    assert (swept["period_number"] == 0).all() and words(swept["status"]) == ["slow"] * 3


def test_a_motion_that_dies_out_has_period_one(linear: ns.System) -> None:
    """Without forcing x decays like exp(-c t / 2 m); its section points shrink by the same factor at every return."""
    swept = ns.sweep(linear, "rho", [0.0], start={"x": 0.01}, transient=100, keep=20, **QUIET)
    assert (words(swept["status"]), swept["period_number"].values.tolist()) == (["ok"], [1])
    assert np.abs(swept["section"].values).max() < 1e-12


@pytest.mark.parametrize("method", METHODS)
def test_extremes_in_contact_are_those_of_a_dense_run(method: str) -> None:
    """True extremes bound 20000 samples per period and are met by them within the parabola between two."""
    system = ns.models.discontinuous_support(rho=0.29)
    options = {"transient": 200, "keep": 4, "max_period": 3, "method": method, **METHODS[method], **QUIET}
    swept = ns.sweep(system, "rho", [0.29], **options)
    start = swept["section"].values[0, -1]
    run = ns.simulate(system, periods=4, start=start, samples=80001, method=method, **METHODS[method])
    u = run["u"].values
    step = system.period() / 20000
    for high, low, i in ((u.max(axis=0), u.min(axis=0), 0), (u.max(axis=0), u.min(axis=0), 1)):
        curvature = np.abs(np.diff(u[:, i], 2)).max() + 40.0 * step**2
        assert -1e-9 < swept["maximum"].values[0, i] - high[i] < curvature
        assert -1e-9 < low[i] - swept["minimum"].values[0, i] < curvature
    force = run["contact_force"].values
    assert swept["contact_force_minimum"].values[0] == pytest.approx(force.min(), rel=1e-4)
    assert swept["contact_force_maximum"].values[0] == pytest.approx(force.max(), abs=1e-3)
    assert swept["crossings_per_period"].values[0] == run["crossing_time"].size / 4
    assert swept["contacts_per_period"].values[0] == (run["crossing_transition"].values == 0).sum() / 4
    clearance = (u[:, 0] - system.values["g"]).max()
    assert swept["clearance"].sel(indicator="penetration").values[0] == pytest.approx(-clearance, rel=1e-5)


def test_the_three_methods_agree_point_by_point() -> None:
    """Values of Fig. 11, with a section at an odd phase, each from rest; where the exact flow settles all must."""
    system = ns.models.discontinuous_support()
    values = np.linspace(0.2, 0.34, 8)
    results = {
        method: ns.sweep(
            system,
            "rho",
            values,
            direction=None,
            section=ns.Stroboscopic(0.13),
            transient=300,
            keep=48,
            method=method,
            **settings,
            **QUIET,
        )
        for method, settings in METHODS.items()
    }
    settled = results["exact"]["status"].values == 0
    assert settled.sum() >= 3
    for method in ("taylor", "rkf45"):
        assert np.array_equal(results[method]["period_number"][settled], results["exact"]["period_number"][settled])
        for name in ("maximum", "minimum", "clearance"):
            error = np.abs(results[method][name].values - results["exact"][name].values)[settled]
            assert error.max() < 1e-8, (method, name)


@pytest.mark.parametrize("phase", [0.1, 0.3, 0.7, 0.9])
@pytest.mark.parametrize("method", METHODS)
def test_a_carried_state_keeps_the_phase_of_the_forcing(method: str, phase: float, linear: ns.System) -> None:
    """Without transient: at the next frequency the motion goes on from the same state and phase, and the state
    itself, which lies on the section, is no return."""
    omega = np.array([3.1, 4.3]) + phase
    swept = ns.sweep(
        linear,
        "omega",
        omega,
        section=ns.Stroboscopic(phase),
        transient=0,
        keep=3,
        max_period=2,
        method=method,
        **METHODS[method],
        **QUIET,
    )
    assert words(swept["status"])[1] == "not_periodic"  # so that there was one pass only
    shifted = linear_with_phase(omega[1], phase, linear)
    run = ns.simulate(shifted, periods=3, start=swept["section"].values[0, -1], samples=4)
    assert np.max(np.abs(swept["section"].values[1] - run["u"].values[1:])) < 1e-10


def linear_with_phase(omega: float, phase: float, linear: ns.System) -> ns.System:
    """The same motion with the forcing's clock set so that t = 0 is at ``phase``."""
    p = linear.values

    def shifted(t, u, q):
        force = p["rho"] * np.cos(q.omega * t + 2 * np.pi * phase)
        return u.v, (force - 2 * p["k"] * u.x - p["c"] * u.v) / p["m"]

    return ns.System(states=["x", "v"], parameters={"omega": omega}, modes={"only": shifted})


def test_directions_carry_the_state_along() -> None:
    """A bistable switch: x falls to -1 or +1 of x' = x - x^3 + a, which folds at a = -+ 2 / (3 sqrt 3) = 0.3849."""
    system = ns.System(
        states=["x"],
        parameters={"a": 0.0, "w": 2.0},
        modes={"only": lambda t, u, p: u.x - u.x**3 + p.a + 1e-6 * np.cos(p.w * t)},
    )
    a = np.array([0.2, -0.2, 0.6, -0.6, 0.0])  # any order is kept
    both = ns.sweep(system, "a", a, direction="both", start={"x": -1.0}, transient=60, keep=4, max_period=3, **QUIET)
    assert both["section"].dims == ("a", "direction", "iterate", "state")
    assert both["a"].values.tolist() == a.tolist()
    x = both["section"].isel(iterate=-1).sel(state="x")
    signs = {d: np.sign(x.sel(direction=d).values).tolist() for d in ("up", "down")}
    assert signs["up"] == [-1, -1, 1, -1, -1]
    assert signs["down"] == [1, 1, 1, -1, 1]
    for i, value in enumerate(a):
        roots = np.roots([-1, 0, 1, value])
        real = roots[np.abs(roots.imag) < 1e-9].real
        for d in ("up", "down"):
            assert np.min(np.abs(real - float(x.sel(direction=d)[i]))) < 1e-5
    for d in ("up", "down"):
        alone = ns.sweep(system, "a", a, direction=d, start={"x": -1.0}, transient=60, keep=4, max_period=3, **QUIET)
        assert str(alone["direction"].values) == d
        assert np.array_equal(alone["section"].values, both["section"].sel(direction=d).values)
    fresh = ns.sweep(system, "a", a, direction=None, start={"x": -1.0}, transient=60, keep=4, max_period=3, **QUIET)
    assert str(fresh["direction"].values) == "none"
    assert np.sign(fresh["section"].values[:, -1, 0]).tolist() == [-1, -1, 1, -1, -1]


def test_several_starts_show_what_coexists() -> None:
    """x' = x - x^3 (and a small forcing): starts left and right of 0 go to -1 and +1."""
    system = ns.System(
        states=["x"],
        parameters={"a": 0.0, "w": 2.0},
        modes={"only": lambda t, u, p: u.x - u.x**3 + p.a + 1e-6 * np.cos(p.w * t)},
    )
    starts = ns.random_starts(6, {"x": -2.0}, {"x": 2.0}, seed=8)
    swept = ns.sweep(system, "a", [0.0, 0.1], direction=None, start=starts, transient=60, keep=4, max_period=3, **QUIET)
    assert swept["section"].dims == ("a", "start", "iterate", "state")
    expected = np.sign([start["x"] for start in starts])
    assert len(set(expected)) == 2
    assert np.array_equal(np.sign(swept["section"].values[0, :, -1, 0]), expected)
    assert swept["start_state"].values[:, 0].tolist() == [start["x"] for start in starts]


@pytest.mark.parametrize("direction", [None, "both"])
def test_results_do_not_depend_on_the_number_of_threads(direction: str | None) -> None:
    system = ns.models.discontinuous_support()
    starts = ns.random_starts(3, {"x": -0.01}, {"x": 0.01}, seed=1)
    values = np.linspace(0.2, 0.5, 40)
    one, two, five = (
        ns.sweep(system, "rho", values, direction=direction, start=starts, transient=30, keep=18, threads=n, **QUIET)
        for n in (1, 2, 5)
    )
    xr.testing.assert_identical(one, two)
    xr.testing.assert_identical(one, five)


@pytest.mark.parametrize("method", METHODS)
def test_a_stop_that_moves_past_a_carried_state_begins_anew(method: str) -> None:
    """Falling d: the state left where x is largest lies beyond the next stop, so that point starts at rest."""
    system = ns.models.impact_oscillator(A=0.5, omega=0.7, c=0.3)
    size = amplitude({"rho": 0.5, "k": 0.5, "m": 1.0, "c": 0.3}, np.array(0.7))
    lag = np.angle(1 - 0.49 + 1j * 0.3 * 0.7)
    section = ns.Stroboscopic(lag / (2 * np.pi))
    options = {"section": section, "transient": 120, "keep": 6, "max_period": 5, "method": method}
    options |= METHODS[method] | QUIET
    carried = ns.sweep(system, "d", [2.0, 0.3 * size], direction="down", **options)
    fresh = ns.sweep(system, "d", [2.0, 0.3 * size], direction=None, **options)
    assert carried["section"].values[0, -1, 0] == pytest.approx(float(size), rel=1e-9)
    assert "no_convergence" not in words(carried["status"])
    assert np.array_equal(carried["section"].values[1], fresh["section"].values[1])
    assert carried["maximum"].values[1, 0] == pytest.approx(0.3 * size, rel=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_a_start_beyond_the_stop_is_a_status_in_a_sweep(method: str) -> None:
    system = ns.models.impact_oscillator()
    swept = ns.sweep(
        system,
        "d",
        [0.5, 2.0],
        direction=None,
        start={"x": 1.0},
        transient=20,
        keep=4,
        max_period=3,
        method=method,
        **QUIET,
    )
    assert words(swept["status"])[0] == "no_convergence"
    assert words(swept["status"])[1] in ("ok", "slow", "not_periodic")
    assert np.isfinite(swept["section"].values[1]).all()


@pytest.mark.parametrize("method", METHODS)
def test_a_support_that_moves_away_lets_go(method: str) -> None:
    """A carried state in contact, its support gone: it must go on in the free mode, as a fresh run there does."""
    system = ns.models.discontinuous_support(rho=0.1)
    swept = ns.sweep(
        system, "g", [-0.05, 0.5], transient=0, keep=2, max_period=1, method=method, **METHODS[method], **QUIET
    )
    assert swept["crossings_per_period"].values[1] == 0
    assert swept["clearance"].sel(indicator="penetration").values[1] > 0.4


def test_the_relief_valve_on_its_section() -> None:
    """An autonomous system: q = 8 is the published cycle (period one, y1 from 0.668282564 to 6.009885866); no impacts;
    at q = 9 the equilibrium is stable, so maxima of the lift come ever nearer to it."""
    swept = ns.sweep(
        ns.models.relief_valve(),
        "q",
        [8.0],
        section=ns.Poincare("lift_velocity", rising=False),
        start={"y1": 3.0, "y2": 0.0, "y3": 13.0},
        transient=200,
        keep=20,
        rtol=1e-11,
        **QUIET,
    )
    assert words(swept["status"]) == ["ok"]
    assert swept["period_number"].values.tolist() == [1]
    assert swept["maximum"].sel(state="y1").values[0] == pytest.approx(6.009885866, abs=1e-8)
    assert swept["minimum"].sel(state="y1").values[0] == pytest.approx(0.668282564, abs=1e-8)
    assert swept["crossings_per_period"].values[0] == 0
    assert swept["clearance"].sel(indicator="seat").values[0] == pytest.approx(0.668282564, abs=1e-8)


def test_a_section_that_is_never_met_is_a_status() -> None:
    swept = ns.sweep(
        ns.models.discontinuous_support(rho=0.05),
        "g",
        [-0.001, 0.5],
        direction=None,
        section=ns.Poincare("penetration", t_max=30.0),
        transient=20,
        keep=4,
        max_period=3,
        method="taylor",
        **QUIET,
    )
    assert words(swept["status"])[1] == "no_convergence"
    assert np.isnan(swept["section"].values[1]).all()
    assert np.isfinite(swept["section"].values[0]).all()


def test_memory_goes_along_in_a_smoothed_sweep() -> None:
    """Sharp and smoothed agree to order eta where the motion settles, in both directions."""
    system = ns.models.discontinuous_support()
    values = np.linspace(0.2, 0.34, 8)
    options = {"direction": "both", "transient": 300, "keep": 48, **QUIET}
    sharp = ns.sweep(system, "rho", values, **options)
    smooth = ns.sweep(system.smoothed(1e-6), "rho", values, method="rkf45", rtol=1e-9, **options)
    settled = (sharp["status"].values == 0) & (smooth["status"].values == 0)
    assert settled.sum() >= 6
    assert np.array_equal(sharp["period_number"].values[settled], smooth["period_number"].values[settled])
    assert np.max(np.abs(sharp["maximum"].values - smooth["maximum"].values)[settled]) < 1e-5


@pytest.mark.parametrize("suffix", [".nc", ".zarr"])
def test_a_sweep_is_saved_and_loaded_whole(suffix: str, tmp_path: Path, logistic: ns.System) -> None:
    starts = [{"x": 0.3}, {"x": 0.6}]
    options = {"direction": "both", "transient": 50, "keep": 4, "max_period": 3, **QUIET}
    swept = ns.sweep(logistic, "r", [2.5, 4.5, 3.2], start=starts, **options)
    again = ns.load(ns.save(swept, tmp_path / f"sweep{suffix}"))
    xr.testing.assert_identical(swept, again)
    record = read_provenance(again)
    assert record["options"]["values"] == [2.5, 4.5, 3.2]
    assert record["options"]["start"] == [[0.3], [0.6]]
    system = ns.System.from_text(record["system"]["text"])
    options = {**record["options"], **QUIET}
    options["section"] = ns.Stroboscopic(options["section"]["phase"])
    recomputed = ns.sweep(system, **options)
    assert np.array_equal(recomputed["section"].values, swept["section"].values, equal_nan=True)


def test_without_judgement_the_points_are_those_of_poincare_and_no_period_is_claimed() -> None:
    system = ns.models.discontinuous_support()
    values = [0.27, 0.3, 0.45]
    looked = ns.sweep(system, "rho", values, direction=None, transient=60, keep=20, judge=False, **QUIET)
    for value in values:
        alone = ns.poincare(system.with_parameters(rho=value), transient=60, n=20)
        np.testing.assert_allclose(looked["section"].sel(rho=value), alone["section"], atol=1e-12)
    assert not {"period_number", "residual"} & set(looked.variables)
    assert words(looked["status"]) == ["ok"] * 3
    assert ns.plot.bifurcation(looked)
    bare = ns.sweep(system, "rho", values, direction=None, transient=60, keep=20, judge=False, extremes=False, **QUIET)
    np.testing.assert_allclose(bare["section"], looked["section"], atol=1e-12)
    assert ns.plot.bifurcation(bare)
    assert np.array_equal(bare["contacts_per_period"], looked["contacts_per_period"])
    assert not {"maximum", "minimum", "clearance"} & set(bare.variables)
    with pytest.raises(ValueError, match="rests on the size"):
        ns.sweep(system, "rho", values, extremes=False)
    with pytest.raises(ValueError, match="leave out density"):
        ns.sweep(system, "rho", values, density=True, judge=False)
    with pytest.raises(TypeError, match="judge = .no."):
        ns.sweep(system, "rho", values, judge="no")  # type: ignore[arg-type]


@pytest.mark.parametrize("elements", [0, 1, 3])
def test_an_output_that_is_not_affine_takes_no_extremes_from_the_others(elements: int) -> None:
    """x = X cos(w t - phi) of any amplitude between far stops; by series its square is known too."""
    w, c = np.array([0.5, 1.4]), 0.2
    system = ns.mechanical(
        1.0,
        c,
        1.0,
        parameters={"w": 1.0},
        forcing={"q": lambda t, p: np.cos(p.w * t)},
        outputs={"twice": lambda t, u, p: 2 * u.q, "square": lambda t, u, p: u.q**2},
        elements={f"s{k}": ns.elements.ElasticStop(at="q", position=50.0, stiffness=1.0) for k in range(elements)},
    )
    X = 1 / np.hypot(1 - w**2, c * w)
    swept = ns.sweep(system, "w", w, **QUIET)
    assert swept["twice_maximum"].values == pytest.approx(2 * X, rel=1e-9)
    assert np.isnan(swept["square_maximum"]).all() and np.isnan(swept["square_minimum"]).all()
    assert all((swept[f"s{k}_force_maximum"] == 0.0).all() for k in range(elements))
    if not elements:
        by_series = ns.sweep(system, "w", w, method="taylor", **QUIET)
        assert by_series["square_maximum"].values == pytest.approx(X**2, rel=1e-8)


def test_transitions_are_counted_over_whole_cycles() -> None:
    """Whatever the number of returns that are kept: a cycle's count is a whole number, that of its orbit."""
    system, values = ns.models.discontinuous_support(omega=3.69, g=-0.0045), [0.25, 0.26, 0.38, 0.45]
    numbers = []
    for keep in (33, 50):
        found = ns.sweep(system, "rho", values, transient=300, keep=keep, direction=None, **QUIET)
        q = found["period_number"].values
        assert q[1] > 1 and (q > 0).all()
        numbers += [q * found["crossings_per_period"].values, q * found["contacts_per_period"].values]
    for value, number, crossings in zip(values, q, numbers[0], strict=True):
        orbit = ns.find_orbit(system.with_parameters(rho=value), period_number=int(number), progress=False)
        assert crossings == pytest.approx(len(orbit.signature.visits) - 1, abs=1e-12)
    np.testing.assert_allclose(numbers[:2], numbers[2:], atol=1e-12)


@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_the_clearance_of_two_stops_is_what_is_left_to_each(method: str) -> None:
    """x = X cos(w t - phi) between -2 and 1, also where other motions of the same system have met the stops."""
    stop, w = ns.elements.Stop, np.array([2.0, 2.2])
    system = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"w": 2.0, "f": 1.0},
        forcing={"q": lambda t, p: p.f * np.cos(p.w * t)},
        elements={
            "floor": stop(at="q", side=-1, position=-2.0, restitution=0.5),
            "wall": stop(at="q", position=1.0, restitution=0.5),
        },
    )
    X = 1 / np.hypot(1 - w**2, 0.1 * w)
    for meets in (False, True):
        if meets:
            hit = ns.sweep(system.with_parameters(f=9.0), "w", w, method=method, **QUIET)
            assert (hit["contacts_per_period"] > 0).all() and np.allclose(hit["clearance"].sel(indicator="wall_gap"), 0)
        swept = ns.sweep(system, "w", w, method=method, **QUIET)
        assert swept["clearance"].sel(indicator="floor_gap").values == pytest.approx(2 - X, abs=1e-8)
        assert swept["clearance"].sel(indicator="wall_gap").values == pytest.approx(1 - X, abs=1e-8)


@pytest.mark.parametrize("method", METHODS)
def test_the_clearance_of_what_is_not_asked_in_some_modes(method: str) -> None:
    """A spring with play that is met on one side: its other end stays away by as much as the motion does."""
    system = ns.mechanical(
        1.0,
        0.2,
        1.0,
        parameters={"w": 1.0},
        forcing={"q": lambda t, p: 0.3 + 0.25 * np.cos(p.w * t)},
        elements={
            "play": ns.elements.Backlash(at="q", half_width=0.275, stiffness=5.0),
            "rail": ns.elements.Coulomb(at="q", friction=0.05),
            "plate": ns.elements.Stop(at="q", side=-1, position=-1.0, restitution=0.5),
        },
    )
    swept = ns.sweep(system, "w", [1.0, 1.1], start={"q": 0.1}, method=method, **QUIET)
    lowest, clearance = swept["minimum"].sel(state="q").values, swept["clearance"]
    assert (clearance.sel(indicator="play_upper") < 0).all()
    assert clearance.sel(indicator="play_lower").values == pytest.approx(lowest + 0.275, abs=1e-7)
