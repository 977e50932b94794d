"""The posterior of a fit, against laws in closed form."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

emcee = pytest.importorskip("emcee", reason="emcee is not installed (extra `posterior`)")
pytestmark = pytest.mark.physics
T = np.linspace(0.0, 3.0, 31)
NOISE = 0.05


def line() -> ns.System:
    """x' = a from x(0): readings are linear in both, so the posterior is normal."""
    return ns.System(states=["x"], parameters={"a": 0.5}, modes={"one": lambda t, u, p: (p.a,)})


def test_a_linear_model_with_normal_noise_has_the_normal_posterior_of_the_books() -> None:
    """mean (X'X)^-1 X'y and covariance sigma^2 (X'X)^-1 of X = (t, 1), a normal prior of a included."""
    rng = np.random.default_rng(1)
    y = 0.2 + 0.7 * T + NOISE * rng.standard_normal(T.size)
    X = np.stack([T, np.ones_like(T)], axis=1)
    precision = X.T @ X / NOISE**2 + np.diag([0.02**-2, 0.0])
    mean = np.linalg.solve(precision, X.T @ y / NOISE**2 + np.array([0.6 * 0.02**-2, 0.0]))
    error = np.sqrt(np.linalg.inv(precision)[0, 0])
    found = ns.fit(
        line(),
        {"x": (T, y)},
        ["a"],
        measured={"x": ns.Sensor(noise=NOISE)},
        priors={"a": (0.6, 0.02)},
        mode="one",
        posterior=900,
        progress=False,
    )
    a = found.posterior.sel(parameter="a").values
    assert len(a) > 360  # by the chains' measured memory, which rounding moves by a tenth
    assert abs(a.mean() - mean[0]) < 0.2 * error
    assert np.std(a) == pytest.approx(error, rel=0.08)
    skew = np.mean(((a - a.mean()) / a.std()) ** 3)
    assert abs(skew) < 0.25
    assert found.draw(500, 3)["a"].std() == pytest.approx(error, rel=0.15)
    assert found["a"] == pytest.approx(mean[0], abs=1e-5 * error)


def test_a_bound_cuts_the_posterior() -> None:
    """A normal law cut at its mean has the mean sigma sqrt(2 / pi) beyond, and the deviation sigma sqrt(1 - 2 / pi)."""
    X = np.stack([T, np.ones_like(T)], axis=1)
    rng = np.random.default_rng(1)
    e = NOISE * rng.standard_normal(T.size)
    e -= X @ np.linalg.lstsq(X, e, rcond=None)[0]  # the unbounded optimum is the truth itself
    error = NOISE * np.sqrt(np.linalg.inv(X.T @ X)[0, 0])
    found = ns.fit(
        line().with_parameters(a=0.75),
        {"x": (T, 0.2 + 0.7 * T + e)},
        {"a": (0.7, None)},
        measured={"x": ns.Sensor(noise=NOISE)},
        posterior=900,
        progress=False,
    )
    a = found.posterior.sel(parameter="a").values
    assert a.min() >= 0.7
    assert np.mean(a) - 0.7 == pytest.approx(error * np.sqrt(2 / np.pi), rel=0.1)
    assert np.std(a) == pytest.approx(error * np.sqrt(1 - 2 / np.pi), rel=0.12)


def test_few_steps_are_said_and_the_same_seed_draws_the_same() -> None:
    rng = np.random.default_rng(1)
    y = 0.2 + 0.7 * T + NOISE * rng.standard_normal(T.size)
    one, two = (ns.fit(line(), {"x": (T, y)}, ["a"], posterior=30, seed=5, progress=False) for _ in range(2))
    np.testing.assert_array_equal(one.posterior.values, two.posterior.values)
    assert any("too few steps" in note for note in one.notes)


def test_a_set_without_one_says_how_to_get_it() -> None:
    y = 0.2 + 0.7 * T
    found = ns.fit(line(), {"x": (T, y + 1e-3 * np.sin(50 * T))}, ["a"], progress=False)
    with pytest.raises(ValueError, match=r"ns\.fit\(\.\.\., posterior=2000\)"):
        found.posterior  # noqa: B018


def test_an_unknown_that_a_start_makes_up_for_is_not_sampled() -> None:
    """Of a free linear decay a gain and the size of the start are one factor: only their product shows."""
    w = np.sqrt(9.0 - 0.1**2)
    t = np.linspace(0.0, 10.0, 301)
    y = 2.0 * np.exp(-0.1 * t) * np.cos(w * t) + 1e-3 * np.random.default_rng(2).standard_normal(t.size)
    system = ns.mechanical(1.0, "c", "k", parameters={"c": 0.2, "k": 9.0}, coordinates=["q"])
    with pytest.raises(ns.SolveError, match=r"do not determine q\.gain: give a prior or a value"):
        ns.fit(system, {"q": (t, y)}, ["k", "c", "q.gain"], posterior=30, progress=False)
    known = {"q.gain": (1.0, 0.05)}
    found = ns.fit(system, {"q": (t, y)}, ["k", "c", "q.gain"], posterior=30, priors=known, progress=False)
    assert np.isfinite(found.posterior.values).all()
