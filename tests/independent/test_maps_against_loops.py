"""Maps against plain loops in NumPy: iterates, periods, exponents."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth import models

pytestmark = pytest.mark.physics


def next_point(w: np.ndarray, p: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Image and derivative in the border-collision normal form."""
    side = "l" if w[0] <= 0 else "r"
    D = np.array([[p[f"tau_{side}"], 1.0], [-p[f"delta_{side}"], 0.0]])
    return D @ w + [p["mu"], 0.0], D


def random_values(seed: int) -> dict[str, float]:
    """Contracting on average on both sides."""
    random = np.random.default_rng(seed)
    tau, delta = random.uniform(-1.6, 1.6, 2), random.uniform(0.1, 0.6, 2)
    return {"tau_l": tau[0], "tau_r": tau[1], "delta_l": delta[0], "delta_r": delta[1], "mu": random.choice([-1, 1])}


@pytest.mark.parametrize("seed", range(12))
def test_iterates_of_random_normal_forms(seed: int):
    p = random_values(seed)
    found = ns.poincare(models.border_collision(**p), n=25, start={"x": 0.1, "y": -0.2})
    w, expected = np.array([0.1, -0.2]), []
    for _ in range(25):
        w, _ = next_point(w, p)
        expected.append(w)
    assert np.allclose(found.section.values, expected, rtol=1e-9, atol=1e-11)


def test_the_spectrum_of_a_chaotic_normal_form():
    """Two exponents in a loop: the growth of a direction, and what is left of the determinant's."""
    p = {"tau_l": 1.4, "delta_l": 0.2, "tau_r": -1.6, "delta_r": 0.4, "mu": 1.0}
    n = 100_000
    x, y, a, b = 0.1, 0.1, 1.0, 0.0  # the point, and the direction that grows most
    sums = np.zeros(2)
    for i in range(-1000, n):
        tau, delta = (p["tau_l"], p["delta_l"]) if x <= 0 else (p["tau_r"], p["delta_r"])
        x, y = tau * x + y + p["mu"], -delta * x
        a, b = tau * a + b, -delta * a
        size = math.hypot(a, b)
        a, b = a / size, b / size
        if i >= 0:
            sums += math.log(size), math.log(delta / size)  # the determinant is delta
    found = ns.lyapunov(models.border_collision(**p), periods=n, transient=1000, start={"x": 0.1, "y": 0.1})
    assert found.exponents.values == pytest.approx(sums / n, abs=4e-3)
    assert sums[0] / n > 0.1


def test_henons_attractor():
    """The published exponents of Henon's map, 0.419 and -1.623 (their sum is ln b)."""
    henon = ns.Map(
        states=["x", "y"],
        parameters={"a": 1.4, "b": 0.3},
        branches=[ns.Branch(lambda u, p: (1 - p.a * u.x**2 + u.y, p.b * u.x))],
    )
    found = ns.lyapunov(henon, periods=100_000, start={"x": 0.1, "y": 0.1})
    assert found.exponents.values == pytest.approx([0.419, -1.623], abs=3e-3)
    assert found.exponents.values.sum() == pytest.approx(np.log(0.3), abs=1e-10)
    saddle = ns.find_orbit(henon, start={"x": 0.63, "y": 0.19}, period_number=1)
    x = (-0.7 + np.sqrt(0.49 + 5.6)) / 2.8
    assert saddle.u == pytest.approx([x, 0.3 * x], abs=1e-12)
    arcs = ns.manifolds(saddle, length=5.0)
    assert np.unique(arcs.multiplier.values.round(8)) == pytest.approx(np.sort(np.roots([1, 2.8 * x, -0.3])), abs=1e-7)


def test_basins_of_two_coexisting_cycles():
    """The square-root map where periods 2 and 3 both attract: each start goes where a loop takes it."""
    lam, mu = 0.2, 0.0255
    start = np.linspace(-0.3, 0.3, 41)
    found = ns.sweep(
        models.square_root_map(lam=lam), "mu", [mu], start=[{"x": x} for x in start], direction=None, keep=20
    )
    x = start.copy()
    for _ in range(3000):
        x = lam * x + mu - np.sqrt(np.maximum(x, 0.0))
    first, numbers = x.copy(), np.zeros(len(x), dtype=int)
    for n in range(1, 7):
        x = lam * x + mu - np.sqrt(np.maximum(x, 0.0))
        numbers[(numbers == 0) & (np.abs(x - first) < 1e-9)] = n
    assert set(numbers) == {2, 3}
    assert found.period_number.values.ravel().tolist() == numbers.tolist()
