"""Planning of experiments: information against closed forms, and against fits of drawn records."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics
M, C, K, NOISE = 1.3, 0.12, 40.0, 0.01


def oscillator(**values: float) -> ns.System:
    given = {"m": M, "c": C, "k": K, "F": 0.0, "omega": 1.0, **values}
    return ns.mechanical(
        "m", "c", "k", parameters=given, coordinates=["q"], forcing={"q": lambda t, p: p.F * np.cos(p.omega * t)}
    )


def decay(t: Any, c: Any, k: Any, q: Any, v: Any) -> Any:
    """Free decay from (q, v), for complex numbers too."""
    rate = c / (2 * M)
    w = np.sqrt(k / M - rate**2)
    return np.exp(-rate * t) * (q * np.cos(w * t) + (v + rate * q) / w * np.sin(w * t))


def covariance(t: np.ndarray, unknown_start: bool) -> np.ndarray:
    """Cramer and Rao's bound of (c, k) from the closed form, differentiated by complex steps."""
    at, h = [C, K, 1.0, 0.0], 1e-30
    columns = [np.imag(decay(t, *[x + 1j * h * (i == j) for j, x in enumerate(at)])) / h for i in range(4)]
    J = np.stack(columns if unknown_start else columns[:2], axis=1)
    return np.linalg.inv(J.T @ J / NOISE**2)[:2, :2]


def plan(runs: dict[str, Any], **options: Any) -> Any:
    return ns.plan_experiment(oscillator(), runs, ["c", "k"], measured={"q": ns.Sensor(noise=NOISE)}, **options)


@pytest.mark.parametrize("free", [True, False])
def test_the_uncertainties_of_a_free_decay_are_the_closed_form(free: bool) -> None:
    t = np.linspace(0.0, 30.0, 601)
    found = plan({"decay": {"duration": 30.0, "samples": t, "start": {"q": 1.0}}}, free_start=free)
    expected = covariance(t, free)
    np.testing.assert_allclose(found["uncertainty"].values[0], np.sqrt(np.diag(expected)), rtol=1e-6)
    log_det = -np.log(np.linalg.det(expected)) + 2 * np.log(C * K)
    assert float(found["log_det"][0]) == pytest.approx(log_det, abs=1e-5)


def test_readings_beyond_the_limits_of_a_sensor_tell_hardly_anything() -> None:
    """Those within them have the bound of the closed form; a few beside them tell a little more."""
    t = np.linspace(0.0, 30.0, 1201)
    inside = np.abs(decay(t, C, K, 1.0, 0.0)) < 0.3
    for gain in (1.0, -1e3):
        limits = 0.3 * abs(gain) * np.array([-1.0, 1.0])
        sensor = ns.Sensor(noise=NOISE * abs(gain), gain=gain, range=limits)
        run = {"duration": 30.0, "samples": t, "start": {"q": 1.0}}
        found = ns.plan_experiment(oscillator(), {"decay": run}, ["c", "k"], measured={"q": sensor})
        ratio = found["uncertainty"].values[0] / np.sqrt(np.diag(covariance(t[inside], True)))
        assert (ratio < 1.01).all() and (ratio > 0.85).all()
    assert (covariance(t, True)[0, 0] / covariance(t[inside], True)[0, 0]) < 0.2


def test_a_long_decay_has_the_variance_of_the_books() -> None:
    r"""var delta = var omega_d = 16 delta^3 sigma^2 / (A^2 f_s) for a decay followed to its end, delta << omega."""
    rate, delta = 40.0, C / (2 * M)
    t = np.arange(0.0, 10 / delta, 1 / rate)
    found = plan({"decay": {"duration": float(t[-1]), "samples": t, "start": {"q": 1.0}}})
    of_delta = np.sqrt(16 * delta**3 * NOISE**2 / rate)
    of_k = np.hypot(2 * M * np.sqrt(K / M) * of_delta, 2 * M * delta * of_delta)
    np.testing.assert_allclose(found["uncertainty"].values[0], [2 * M * of_delta, of_k], rtol=0.02)


def test_fits_of_drawn_records_scatter_as_planned() -> None:
    """24 fits give a standard deviation to 15 %: two of these are allowed."""
    t = np.linspace(0.0, 12.0, 241)
    found = plan({"decay": {"duration": 12.0, "samples": t, "start": {"q": 1.0}}})
    rng = np.random.default_rng(4)
    fits = []
    for _ in range(24):
        y = decay(t, C, K, 1.0, 0.0) + NOISE * rng.standard_normal(t.size)
        fits.append(list(ns.fit(oscillator(), {"q": (t, y)}, ["c", "k"], progress=False).values()))
    np.testing.assert_allclose(np.std(fits, axis=0), found["uncertainty"].values[0], rtol=0.31)


def test_runs_are_ordered_by_what_they_add() -> None:
    """Far above resonance a response is F/(m omega^2): it tells of neither c nor k; a static pull tells of k alone."""
    forced = {"duration": 60.0, "samples": 1200}
    runs = {
        "high": {**forced, "settings": {"F": 1.0, "omega": 60.0}},
        "static": {**forced, "settings": {"F": 1.0, "omega": 1e-3}},
        "resonance": {**forced, "settings": {"F": 1.0, "omega": float(np.sqrt(K / M))}},
    }
    found = plan(runs, free_start=False)
    assert found["order"].values[0] == "resonance"
    assert found["best"].values.tolist() == ["resonance", "resonance"]
    np.testing.assert_allclose(found["information"].sum("run"), np.linalg.inv(_last_covariance(found)), rtol=1e-6)
    assert (np.diff(found["log_det_after"]) > 0).all()


def _last_covariance(found: Any) -> np.ndarray:
    total = found["information"].sum("run").values
    inverse = np.linalg.inv(total)
    np.testing.assert_allclose(found["uncertainty_after"].values[-1], np.sqrt(np.diag(inverse)), rtol=1e-9)
    return inverse


def test_a_run_that_does_not_move_tells_nothing_and_priors_stand() -> None:
    still = {"still": {"duration": 10.0, "samples": 100}}
    assert np.isinf(plan(still)["uncertainty"]).all() and np.isneginf(plan(still)["log_det"]).all()
    known = plan(still, priors={"k": (K, 0.3), "c": (C, 0.01)})
    np.testing.assert_allclose(known["uncertainty"].values[0], [0.01, 0.3], rtol=1e-9)


def test_a_parameter_that_a_run_sets_is_known_there_alone() -> None:
    """The bound of the other is that with k given: the inverse of one entry of F, not an entry of the inverse of F."""
    t = np.linspace(0.0, 30.0, 601)
    run = {"duration": 30.0, "samples": t, "start": {"q": 1.0}}
    found = plan({"free": run, "set": {**run, "settings": {"k": K}}}, free_start=False)["uncertainty"]
    information = np.linalg.inv(covariance(t, False))
    assert float(found.sel(run="set", parameter="c")) == pytest.approx(information[0, 0] ** -0.5, rel=1e-6)
    assert np.isinf(found.sel(run="set", parameter="k")) and np.isfinite(found.sel(run="free")).all()


def test_a_measured_force_is_that_of_its_run_or_of_all() -> None:
    """Of m v' = f - c v behind a step of the force the derivatives of v are closed forms."""
    cart = ns.System(
        states=["v"],
        parameters={"c": 0.5, "m": 2.0},
        modes={"rolls": lambda t, u, p: ((p.force - p.c * u.v) / p.m,)},
        inputs=["force"],
    )
    t, c, m = np.linspace(0.0, 6.0, 61), 0.5, 2.0
    rest = np.exp(-c * t / m)
    unit = np.stack([t / m / c * rest - (1 - rest) / c**2, -t / m**2 * rest], axis=1)
    run = {"duration": 6.0, "samples": t}
    found = ns.plan_experiment(
        cart,
        {"own": {**run, "inputs": {"force": ([0.0, 6.0], [3.0, 3.0])}}, "shared": run},
        ["c", "m"],
        measured={"v": ns.Sensor(noise=0.01)},
        inputs={"force": ns.Input([0.0, 6.0], [2.0, 2.0], between="steps")},
        free_start=False,
    )
    for k, force in enumerate((3.0, 2.0)):
        np.testing.assert_allclose(found["information"].values[k], unit.T @ unit * (force / 0.01) ** 2, rtol=1e-9)


def test_through_a_stop_information_comes_with_the_impacts() -> None:
    """Before the first impact nothing is told of the restitution; behind each one more."""
    s = ns.mechanical(
        1.0,
        0.0,
        1.0,
        parameters={"e": 0.8},
        coordinates=["q"],
        elements={"s": ns.elements.Stop(at="q", position=0.5, restitution="e")},
    )
    runs = {str(T): {"duration": T, "samples": 200, "start": {"q": 0.0, "v_q": 1.0}} for T in (0.4, 3.0, 9.0)}
    found = ns.plan_experiment(s, runs, ["e"], measured={"q": ns.Sensor(noise=0.01)}, free_start=False)
    first, second, third = found["uncertainty"].values[:, 0]
    assert np.isinf(first) and np.isfinite(second) and third < second


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"measured": {"q": ns.Sensor()}}, ValueError, "says no noise"),
        ({"runs": {}}, TypeError, "give the candidates by name"),
        ({"runs": {"a": {"length": 3}}}, ValueError, "`length` is not a property of a run"),
        ({"parameters": ["kk"]}, ValueError, "kk"),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, Any], error: type[Exception], message: str) -> None:
    given: dict[str, Any] = {
        "runs": {"a": {"duration": 3.0, "samples": 50, "start": {"q": 1.0}}},
        "parameters": ["k"],
        "measured": {"q": ns.Sensor(noise=0.01)},
        **change,
    }
    with pytest.raises(error, match=message):
        ns.plan_experiment(oscillator(), given.pop("runs"), given.pop("parameters"), **given)


def test_what_is_known_of_a_phase_counts() -> None:
    """A phase that is known to next to nothing is as one that is known."""
    s = ns.mechanical(M, C, "k", coordinates=["q"], parameters={"k": K}, forcing={"q": lambda t, p: np.cos(2.0 * t)})
    run = {"one": {"duration": 6.0, "samples": 300}}
    asked = {"measured": {"q": ns.Sensor(noise=NOISE)}, "free_start": False}
    size = {
        names: float(ns.plan_experiment(s, run, names, priors=priors, **asked)["uncertainty"].sel(parameter="k")[0])
        for names, priors in ((("k",), None), (("k", "phase"), {"phase": (0.0, 1e-7)}))
    }
    assert size["k", "phase"] == pytest.approx(size["k",], rel=1e-6)
    unknown = ns.plan_experiment(s, run, ["k", "phase"], **asked)["uncertainty"].sel(parameter="k")
    assert float(unknown[0]) > 1.02 * size["k",]
