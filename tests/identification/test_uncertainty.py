"""Intervals, correlated residuals and profiles against closed forms and published numbers."""

from types import SimpleNamespace

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.identification.arrow import Residuals, sandwich, settle
from nonsmooth.identification.finding import (
    Estimate,
    Finding,
    correlated,
    coverage_factor,
    uniform,
)
from nonsmooth.identification.fit.likelihood import limits_of
from nonsmooth.recordings.signals.spectrum import correlation_times


def test_uniform_and_normal_limits():
    assert uniform(1.0) == pytest.approx(1 / np.sqrt(3))
    assert coverage_factor(0.95) == pytest.approx(1.959964, abs=1e-6)
    assert Estimate(0.0, 1.0).interval()[1] == pytest.approx(1.959964, abs=1e-6)
    assert Estimate(0.0, uniform(1.0), half_width=1.0).interval()[1] == pytest.approx(0.95)


def test_uniform_and_normal_together_hold_what_they_say():
    rng = np.random.default_rng(1)
    low, high = Estimate(0.0, np.hypot(0.5, uniform(1.0)), half_width=1.0).interval()
    drawn = 0.5 * rng.standard_normal(400_000) + rng.uniform(-1, 1, 400_000)
    assert np.mean((drawn > low) & (drawn < high)) == pytest.approx(0.95, abs=0.002)


def test_a_factor():
    doubled = Estimate(2.0, 2 * np.log(2) / 1.959964, logarithmic=True)
    assert (*doubled.interval(), doubled.factor) == pytest.approx((1.0, 4.0, 2.0), rel=1e-6)
    assert Estimate(2.0, 0.4, logarithmic=True).factor == pytest.approx(np.exp(1.959964 * 0.2))
    for value in (0.0, -2.0):  # no factor holds it
        own, plain = Estimate(value, 0.4, logarithmic=True), Estimate(value, 0.4)
        assert own.interval() == plain.interval() and str(own) == str(plain)


def test_a_product_and_the_half_interval_of_an_estimate():
    """m b of b = 4 +- 0.3 by m = 2 +- 0.05: sqrt((2 * 0.3)^2 + (4 * 0.05)^2); 95 % of a normal quantity is 1.96 of its
    standard uncertainty to either side, of a logarithmic one wider above than below."""
    b = Estimate(4.0, 0.3, "1/s")
    c = b.times(2.0, 0.05, "N s/m")
    assert (c.value, c.uncertainty, c.unit) == (8.0, pytest.approx(np.hypot(0.6, 0.2)), "N s/m")
    assert float(b) == 4.0 and b.times(-1.0).unit == "1/s"
    assert Estimate(1.0, 0.2, half_width=0.3).times(-2).half_width == 0.6
    assert b.expanded == pytest.approx(1.959964 * 0.3, rel=1e-6)
    factor = np.exp(1.959964 * 0.3 / 4.0)
    assert Estimate(4.0, 0.3, logarithmic=True).expanded == pytest.approx(4.0 * (factor - 1), rel=1e-6)


def test_a_finding_is_what_its_record_says():
    others = {"c": Estimate(1.0, 0.1)}
    record = Finding("k", Estimate(4.0, np.inf, "N/m"), "by hand", 3, ("a",), ("one",), others).to_record()
    again = Finding.from_record(record)
    assert again.to_record() == record and again.others["c"] == Estimate(1.0, 0.1)
    assert (again.value, again.uncertainty, again.interval()) == (4.0, np.inf, (-np.inf, np.inf))


def test_correlation_of_an_autoregressive_series():
    # tau = (1 + a) / (1 - a) for x_n = a x_(n-1) + e_n
    rng, a = np.random.default_rng(0), 0.6
    x = np.zeros(200_000)
    for i, e in enumerate(rng.standard_normal(len(x) - 1), 1):
        x[i] = a * x[i - 1] + e
    assert correlation_times(x) == pytest.approx(4.0, rel=0.05)
    # and the variance of its mean is tau times that of white residuals
    c = correlated(np.ones((20_000, 1)), x[:20_000] - x[:20_000].mean())
    assert c[0, 0] * 20_000 == pytest.approx(1 / (1 - a) ** 2, rel=0.25)


def test_parameters_known_mainly_together_keep_the_uncertainty_of_white_residuals():
    """Ordinary least squares: u^2 = s^2 [(X^T X)^-1]_ii, never less, and hardly more where residuals are white.

    Raising the scores of two such parameters by different factors would add what only one of them can do to both.
    """
    rng, n, together = np.random.default_rng(2), 600, 1e-3
    a, b = rng.standard_normal((2, n))
    table = np.column_stack([a, a + together * b])
    piece = SimpleNamespace(which=np.arange(2), n_free=0, by_instant=lambda rows: rows, correlation=correlation_times)
    ratios = []
    for _ in range(40):
        y = rng.standard_normal(n)
        r = y - table @ np.linalg.lstsq(table, y, rcond=None)[0]
        state = Residuals([r], [table], [np.zeros((n, 1))])
        problem = SimpleNamespace(
            pieces=[piece],
            rounded=0.0,
            residuals=lambda theta, starts, slopes, now=state: now,
            weights=lambda state: [np.ones(n)],
            unknowns=SimpleNamespace(precision=np.zeros((2, 2))),
        )
        found = sandwich(problem, np.zeros(2), np.zeros((1, 1)))
        white = np.linalg.inv(table.T @ table) * (r @ r) / (n - 2)
        ratios.append(np.sqrt(np.diag(found.covariance) / np.diag(white)))
    assert np.min(ratios) > 0.999999 and np.mean(ratios) < 1.05 and np.max(ratios) < 1.3


def test_a_fit_whose_minimum_no_step_reaches_says_how_far_it_is():
    """Derivatives of the wrong sign: the minimum at 1 seems a hundred standard uncertainties away, the other way."""
    piece = SimpleNamespace(which=np.arange(1), n_free=0)

    def state(theta, starts, slopes=False):
        return Residuals([np.full(4, theta[0] - 1.0)], [np.ones((4, 1))], [np.zeros((4, 1))])

    unknowns = SimpleNamespace(
        low=np.array([-np.inf]), high=np.array([np.inf]), centre=np.zeros(1), precision=np.zeros((1, 1))
    )
    problem = SimpleNamespace(
        pieces=[piece], unknowns=unknowns, residuals=state, weights=lambda state: [np.full(4, 50.0)]
    )
    found = settle(problem, np.zeros(1), np.zeros((1, 1)))
    assert found.short == pytest.approx(100.0)  # of 0.01, from four readings known to 0.02
    assert found.theta == 0.0 and np.abs(found.left) == pytest.approx(1.0)


def test_profile_of_a_parabola_gives_the_normal_interval():
    value = np.linspace(0.5, 1.5, 101)
    limits = limits_of(value, ((value - 1.0) / 0.1) ** 2, 1.0)
    assert limits == pytest.approx((1 - 0.19600, 1 + 0.19600), abs=1e-3)


def test_a_profile_that_does_not_rise_has_no_limit():
    value = np.linspace(0.1, 3, 59)
    low, high = limits_of(value, np.minimum(40 * (value - 1) ** 2, np.where(value > 1, 2.0, np.inf)), 1.0)
    assert np.isnan(high) and low == pytest.approx(1 - np.sqrt(3.8415 / 40), abs=0.01)


def test_what_is_not_determined_is_not_drawn() -> None:
    s = ns.models.discontinuous_support(g=0.02, rho=0.14)
    found = ns.ParameterSet(
        {"k": Estimate(s.values["k"], 0.01), "k_s": Estimate(s.values["k_s"], np.inf)}, np.diag([1e-4, np.inf])
    )
    with pytest.raises(ValueError, match=r"an infinite uncertainty has no law to draw from.*found.only"):
        found.draw(10)
    with pytest.raises(ValueError, match="an infinite uncertainty"):
        ns.propagate(found, ns.sweep, s, "omega", [3.0], draws=5, progress=False)
    assert list(found.only("k")) == ["k"]
    with pytest.raises(ValueError, match="only: `kk` is not a parameter of this set; nearest: k"):
        found.only(["kk"])
    band = ns.propagate(found.only(["k"]), ns.sweep, s, "omega", [3.0], draws=5, progress=False)
    assert "drawn_k" in band and "drawn_k_s" not in band
