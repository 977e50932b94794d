"""Correlation dimensions of sets whose dimension is a closed form, and of an attractor with a published one."""

from __future__ import annotations

import signal
import time

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.diagrams.correlation_dimension import correlation_dimension

RNG = np.random.default_rng(5)


def cantor(n: int, ratio: float = 1 / 3, digits: int = 30) -> np.ndarray:
    """Random points of the Cantor set with two parts of this ratio: dimension log 2 / log(1 / ratio)."""
    return (RNG.integers(0, 2, (n, digits)) * (1 - ratio) * ratio ** np.arange(digits)).sum(axis=1)


def henon(n: int) -> np.ndarray:
    points = np.empty((n, 2))
    x, y = 0.1, 0.1
    for i in range(-100, n):
        x, y = 1 - 1.4 * x * x + y, 0.3 * x
        points[max(i, 0)] = x, y
    return points


@pytest.mark.parametrize("ratio", [1 / 3, 0.2, 0.45])
def test_cantor_sets(ratio: float) -> None:
    found = correlation_dimension(cantor(8000, ratio), window=0, scale=[1.0], range=(ratio**7, ratio))
    assert abs(float(found.dimension) - np.log(2) / np.log(1 / ratio)) < 0.02
    assert abs(float(found.decades) - 6 * np.log10(1 / ratio)) < 1e-12


def test_a_product_of_cantor_sets_and_smooth_sets() -> None:
    product = correlation_dimension(np.stack([cantor(8000), cantor(8000)], axis=1), window=0)
    assert abs(float(product.dimension) - 2 * np.log(2) / np.log(3)) < 0.06
    angle = RNG.uniform(0, 2 * np.pi, 5000)
    circle = correlation_dimension(np.stack([np.cos(angle), 1e3 * np.sin(angle)], axis=1), window=0)
    assert abs(float(circle.dimension) - 1) < 0.02 and circle.scaling == 1
    square = correlation_dimension(RNG.uniform(0, 1, (4000, 2)), window=0)
    assert abs(float(square.dimension) - 2) < 0.05 and square.scaling == 1


def test_henon() -> None:
    """Grassberger and Procaccia (1983), Table 1: 1.21 +- 0.01 for a = 1.4, b = 0.3."""
    found = correlation_dimension(henon(8000))
    assert abs(float(found.dimension) - 1.21) < 0.03
    assert found.scaling == 1 and found.decades > 1.0 and found.slope_spread < 0.1


def test_the_same_pairs_as_by_hand() -> None:
    """Counts of the tree against all distances, with a window in time."""
    x = henon(400)
    found = correlation_dimension(x, window=3, scale=[1.0, 1.0])
    distance = np.abs(x[:, None] - x[None]).max(axis=2)
    i, j = np.triu_indices(400, 4)
    wanted = (distance[i, j][None, :] <= found.radius.values[:, None]).sum(axis=1)
    assert np.array_equal(found.n_pairs.values, wanted)
    assert abs(found.correlation_sum.values[-1] - 1.0) < 1e-12


def test_the_range_found_is_that_of_the_slope() -> None:
    """A strip looks like a line from afar and like a plane from near: the range found does not span its thickness."""
    thickness = 3e-2
    x = np.stack([RNG.uniform(0, 1, 6000), thickness * RNG.uniform(0, 1, 6000)], axis=1)
    near = correlation_dimension(x, window=0, scale=[1.0, 1.0])
    assert near.scaling == 1 and near.range_high < thickness and abs(float(near.dimension) - 2) < 0.1
    far = correlation_dimension(x, window=0, scale=[1.0, 1.0], range=(0.09, 0.3))
    assert abs(float(far.dimension) - 1) < 0.2 and far.scaling == 0 and far.decades < 0.6


def test_a_section_of_the_papers_oscillator() -> None:
    """The chaotic attractor of Fig. 13: between 1 and the Kaplan-Yorke dimension, as conjectured."""
    system = ns.models.discontinuous_support().with_parameters(rho=0.33, g=0.0018, omega=11.15)
    found = correlation_dimension(ns.poincare(system, n=5000, transient=500))
    spectrum = ns.lyapunov(system, periods=5000)
    assert abs(float(spectrum.trace_defect)) < 1e-10
    kaplan_yorke = float(spectrum.kaplan_yorke)
    assert 1.0 < float(found.dimension) < kaplan_yorke + 0.05


def test_errors_at_the_door() -> None:
    with pytest.raises(ValueError, match="N >= 200"):
        correlation_dimension(np.zeros((10, 2)))
    with pytest.raises(ValueError, match="are the same"):
        correlation_dimension(np.zeros((500, 2)))
    with pytest.raises(ValueError, match="must be finite"):
        correlation_dimension(np.full((500, 2), np.nan))
    with pytest.raises(ValueError, match=r"section\(iterate, state\)"):
        correlation_dimension(ns.simulate(ns.models.discontinuous_support(), periods=1))
    with pytest.raises(ValueError, match="the first end must be below the second"):
        correlation_dimension(henon(300), range=(0.5, 0.1))


def test_the_error_knows_of_a_drifting_slope() -> None:
    """The density 1 / (pi sqrt(x (1 - x))) of the logistic map at r = 4 has the dimension 1, reached like 1 / log r."""
    x = np.sin(0.5 * np.pi * np.random.default_rng(1).random(20_000)) ** 2  # that density, drawn
    found = ns.correlation_dimension(x)
    even = ns.correlation_dimension(np.random.default_rng(1).random(20_000))
    assert abs(even.dimension - 1.0) < 3 * even.standard_error + 0.01
    assert found.dimension < 0.95 and found.standard_error > 3 * even.standard_error


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="a timer of processor time")
def test_ctrl_c_is_heard_while_the_pairs_of_many_points_are_counted() -> None:
    """Of processor time: that of other jobs does not count. All these pairs take seven seconds of it."""
    points = np.random.default_rng(3).uniform(size=(20_000, 4))
    before = signal.signal(signal.SIGPROF, signal.default_int_handler)
    try:
        began = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, 0.5)
        with pytest.raises(KeyboardInterrupt):
            correlation_dimension(points)
        assert time.process_time() - began < 1.5
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def test_how_steady_a_slope_is_hangs_on_its_own_size() -> None:
    """A tenth of all slopes (dimensions below one) has the same steady part, the longer one: from 1e-4 on."""
    from nonsmooth.diagrams.correlation_dimension import SPREAD, _range

    radius = 10 ** np.linspace(-6, 0, 200)
    slope = np.where(radius < 1e-4, 1.5, 1.0) * (1 + 0.02 * (-1.0) ** np.arange(200))
    ranges = [_range(radius, size * slope, np.full(200, 1e9), 1e9) for size in (1.0, 0.1)]
    assert 0.02 < SPREAD < 0.2
    assert ranges[0] == ranges[1] and min(ranges[0]) == pytest.approx(1e-4, rel=0.2)
