"""Least squares against closed forms and against certified values."""

from __future__ import annotations

import numpy as np
import pytest

from nonsmooth_savi2007.identification.response_fits import nonlinear_fit

FREE = -np.inf


def test_a_straight_line_has_the_covariance_of_the_normal_equations() -> None:
    rng = np.random.default_rng(0)
    x, sigma = np.linspace(-1, 3, 50), rng.uniform(0.1, 0.4, 50)
    y = 2.0 - 0.5 * x + sigma * rng.standard_normal(50)
    values, covariance = nonlinear_fit(lambda p: (p[0] + p[1] * x - y) / sigma, [0.0, 0.0], [FREE, FREE])
    A = np.column_stack([np.ones(50), x]) / sigma[:, None]
    expected = np.linalg.solve(A.T @ A, A.T @ (y / sigma))
    scale = np.sum((A @ expected - y / sigma) ** 2) / 48
    np.testing.assert_allclose(values, expected, rtol=1e-9)
    np.testing.assert_allclose(covariance, np.linalg.inv(A.T @ A) * scale, rtol=1e-7)


def test_misra1a_of_nist() -> None:
    """Certified values and standard deviations: NIST Statistical Reference Datasets, Misra1a."""
    x = np.array([77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0])
    y = np.array([10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78])
    values, covariance = nonlinear_fit(lambda p: p[0] * (1 - np.exp(-p[1] * x)) - y, [500.0, 1e-4], [FREE, FREE])
    np.testing.assert_allclose(values, [2.3894212918e02, 5.5015643181e-04], rtol=1e-6)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), [2.7070075241, 7.2668688436e-06], rtol=1e-5)


def test_a_bound_holds() -> None:
    values, _ = nonlinear_fit(lambda p: np.array([p[0] + 1.0, p[0] + 1.5, p[0] + 2.0]), [1.0], [0.25])
    assert values == pytest.approx([0.25], abs=1e-9)


def test_what_the_data_do_not_tell_apart_has_no_finite_variance() -> None:
    x = np.linspace(0, 1, 20)
    for residual in (lambda p: p[0] + p[1] - x, lambda p: p[0] - x + 0.0 * p[1]):
        found = nonlinear_fit(residual, [0.2, 0.3], [FREE, FREE])
        assert found is not None and np.isinf(np.diag(found[1])).all()


def test_as_many_parameters_as_data_have_no_covariance() -> None:
    assert nonlinear_fit(lambda p: p - [1.0, 2.0], [0.0, 0.0], [FREE, FREE]) is None
