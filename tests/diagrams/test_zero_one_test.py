"""The 0-1 test on maps whose nature is known in closed form, and beside Lyapunov exponents."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.diagrams.zero_one_test import zero_one_test


@cache
def logistic(mu: float, n: int = 2000) -> np.ndarray:
    x, found = 0.3, np.empty(n)
    for i in range(-1000, n):
        x = mu * x * (1 - x)
        found[max(i, 0)] = x
    return found


@pytest.mark.parametrize(("mu", "chaotic"), [(3.2, 0), (3.55, 0), (3.83, 0), (3.97, 1), (4.0, 1)])
def test_logistic_map(mu: float, chaotic: int) -> None:
    """Periods 2, 8 and 3; chaos at 3.97 and 4 (Gottwald and Melbourne 2009, Fig. 2)."""
    assert abs(float(zero_one_test(logistic(mu))) - chaotic) < 0.06


@pytest.mark.parametrize(
    ("offset", "factor"), [(0.0, 1e-9), (-1e6, 1.0), pytest.param(100.0, 1.0, marks=pytest.mark.slow)]
)
def test_units_do_not_matter(offset: float, factor: float) -> None:
    """K does not know where the observable has its zero, nor its unit."""
    for mu, chaotic in ((3.55, 0), (4.0, 1)):
        assert abs(float(zero_one_test(offset + factor * logistic(mu))) - chaotic) < 0.06


def test_quasiperiodic_motion_is_regular() -> None:
    n = np.arange(3000)
    assert abs(float(zero_one_test(np.cos(2 * np.pi * (np.sqrt(5) - 1) / 2 * n)))) < 0.06


def test_a_sweep_of_the_papers_oscillator() -> None:
    """Over Fig. 11 it agrees with the sign of the largest Lyapunov exponent, wherever that is clear."""
    system = ns.models.discontinuous_support().with_parameters(omega=3.69, g=-0.0045)
    values = [0.21, 0.25, 0.46]
    swept = ns.sweep(system, "rho", values, keep=1500, transient=1000, progress=False)
    k = zero_one_test(swept)
    assert k.dims == ("rho", "state") and list(k.rho.values) == values
    exponents = ns.lyapunov(system, parameter="rho", values=values, periods=1500, progress=False)
    assert np.abs(exponents.trace_defect.values).max() < 1e-10
    largest = exponents.exponents.values[:, 0]
    assert (np.abs(largest) > 0.03).all()
    assert np.array_equal(k.values > 0.5, np.repeat((largest > 0)[:, None], 2, axis=1))
    assert (np.minimum(np.abs(k.values), np.abs(1 - k.values)) < 0.15).all()


def test_shapes_and_failures() -> None:
    x = np.stack([logistic(4.0, 500), np.full(500, 0.3), np.full(500, np.nan)], axis=1)
    k = zero_one_test(x)
    assert k.shape == (3,) and k[0] > 0.9 and k[1] == 0.0 and np.isnan(k[2])
    with pytest.raises(ValueError, match="100 observations"):
        zero_one_test(np.zeros(50))
    with pytest.raises(ValueError, match="not of shape"):
        zero_one_test(np.zeros((3, 3, 300)))
    with pytest.raises(ValueError, match="result of poincare or sweep"):
        zero_one_test(ns.simulate(ns.models.discontinuous_support(), periods=1))
