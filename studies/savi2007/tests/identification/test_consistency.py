"""Consistency of repeated measurements against closed forms: chi^2 of a few numbers, and chance."""

import numpy as np
import pytest

from nonsmooth_savi2007.identification.cross_checks import CHANCE, birge_ratio, consistent


def test_the_weighted_mean_and_birge_ratio_in_closed_form():
    # 1 and 3 with errors 1 and 2: weights 1 and 1/4, mean 1.4, chi^2 = 0.16 + 2.56 / 4 = 0.8
    found = consistent([[1.0], [3.0]], [[[1.0]], [[4.0]]])
    assert found.mean == pytest.approx([1.4]) and found.covariance[0, 0] == pytest.approx(0.8)
    assert found.birge == pytest.approx(np.sqrt(0.8)) and found.agree and found.used.all()
    assert found.off([4.4], [[8.2]]) == pytest.approx([1.0])


def test_correlated_values_are_judged_by_their_covariance():
    # two ridges that cross: both pairs lie one error apart along each axis, the second off the ridge
    ridge = 1e-4 * np.array([[1.0, 0.99], [0.99, 1.0]])
    along = consistent([[0.0, 0.0], [0.01, 0.01]], [ridge, ridge])
    across = consistent([[0.0, 0.0], [0.01, -0.01]], [ridge, ridge])
    # chi^2 = d^2 / 2 over the eigenvalue: 2e-4 / 2 / (1e-4 * 1.99) and 2e-4 / 2 / (1e-4 * 0.01)
    assert along.birge**2 * 2 == pytest.approx(1 / 1.99) and along.agree
    assert across.birge**2 * 2 == pytest.approx(1 / 0.01) and not across.agree


def test_outliers_go_one_after_another_and_a_majority_stays():
    values = [[0.0], [0.1], [-0.1], [0.05], [3.0], [-9.0]]
    found = consistent(values, [[[0.01]]] * 6)
    assert found.used.tolist() == [True] * 4 + [False] * 2 and found.agree
    halves = consistent([[0.0], [0.1], [5.0], [5.1]], [[[0.01]]] * 4)
    assert halves.used.all() and not halves.agree
    # mean 2.55: chi^2 = (2.55^2 + 2.45^2) * 2 / 0.01
    assert halves.birge == pytest.approx(np.sqrt((2.55**2 + 2.45**2) * 2 / 0.01 / 3))
    assert halves.scatter[0, 0] == pytest.approx((2.55**2 + 2.45**2) * 2 / 3)


def test_chance_is_no_disagreement():
    rng = np.random.default_rng(0)
    left = sum(not consistent(rng.normal(size=(6, 4)), [np.eye(4)] * 6).used.all() for _ in range(2000))
    assert left <= 3  # 0.2 expected
    assert birge_ratio(3.0, 0)[1] and np.isnan(birge_ratio(3.0, 0)[0])
    # chi^2 with 2 degrees of freedom exceeds x with probability exp(-x/2)
    edge = -2 * np.log(CHANCE)
    assert birge_ratio(0.99 * edge, 2)[1] and not birge_ratio(1.01 * edge, 2)[1]
