"""The least value of a convex function between bounds, against its optimality conditions and SciPy."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from nonsmooth.kernels import convex


def found(G, a, low, high):
    size = len(a)
    x = np.empty(size)
    sets = np.empty((2, size), dtype=np.int64)
    status = convex.least(G.copy(), a.copy(), low, high, x, *sets, np.empty((size, size + 1)), np.empty(size))
    return status, x


@pytest.mark.parametrize("seed", range(60))
def test_optimality_and_the_value_of_scipy(seed):
    """Rows W of fewer directions than forces give a singular G; a lies in its range, as rates do."""
    draw = np.random.default_rng(seed)
    size, directions = int(draw.integers(1, 8)), int(draw.integers(1, 6))
    W = draw.normal(size=(size, directions)) * 10.0 ** draw.uniform(-2, 2, size=(size, 1))
    if seed % 3 == 0 and size > 1:
        W[-1] = 2.0 * W[0]
    free = draw.normal(size=directions)
    G, a = W @ W.T, W @ free
    high = np.where(draw.random(size) < 0.4, np.inf, draw.uniform(0.1, 2.0, size=size))
    low = np.where(np.isinf(high), 0.0, -high)
    status, x = found(G, a, low, high)
    assert status == 0
    slope, terms = a + G @ x, np.abs(a) + np.abs(G) @ np.abs(x)
    assert (x >= low).all() and (x <= high).all()
    assert (slope[(x > low) & (x < high)] <= 1e-8 * terms[(x > low) & (x < high)]).all()
    assert (slope[x > low] <= 1e-8 * terms[x > low]).all()
    assert (slope[x < high] >= -1e-8 * terms[x < high]).all()
    other = lsq_linear(W.T, -free, bounds=(low - 1e-300, high), tol=1e-14, lsq_solver="exact").x
    assert np.linalg.norm(W.T @ x + free) <= np.linalg.norm(W.T @ other + free) * (1 + 1e-7) + 1e-12


def test_two_walls_that_close_on_a_mass():
    """No force of two opposite walls ends the approach of both: the function falls without end."""
    G = np.array([[1.0, -1.0], [-1.0, 1.0]])
    assert found(G, np.array([-1.0, -1.0]), np.zeros(2), np.full(2, np.inf))[0] == 2
    status, x = found(G, np.array([-1.0, 1.0]), np.zeros(2), np.full(2, np.inf))
    assert status == 0
    assert x[0] - x[1] == pytest.approx(1.0)
