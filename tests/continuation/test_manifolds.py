"""Manifolds of saddles against a linear map, and those of the Henon map against their power series."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns

pytestmark = pytest.mark.physics

A, B = 1.4, 0.3


@cache
def henon() -> ns.System:
    """x, y stand still (k = 0) and jump by the Henon map in the middle of every period."""
    return ns.System(
        states=["x", "y"],
        parameters={"a": A, "b": B, "k": 0.0},
        modes={"still": lambda t, u, p: (p.k * u.x, p.k * u.y)},
        scale={"x": 1000.0, "y": 1000.0},
        transitions=[
            ns.Transition("still", "still", at=0.5, reset=lambda t, u, p: (1.0 - p.a * u.x**2 + u.y, p.b * u.x))
        ],
        period=lambda p: 1.0 + 0.0 * p.k,
    )


def henon_map(p: np.ndarray) -> np.ndarray:
    return np.stack([1.0 - A * p[..., 0] ** 2 + p[..., 1], B * p[..., 0]], axis=-1)


def henon_back(p: np.ndarray) -> np.ndarray:
    x = p[..., 1] / B
    return np.stack([x, p[..., 0] - 1.0 + A * x**2], axis=-1)


def series(x0: float, mu: float, order: int = 30) -> np.ndarray:
    """w_k of W(t) with W(mu t) = F(W(t)): mu^k x_k = -a sum x_i x_(k-i) + y_k, mu^k y_k = b x_k; x_1 = 1."""
    x, y = np.zeros(order), np.zeros(order)
    x[0], x[1] = x0, 1.0
    y[0], y[1] = B * x0, B / mu
    for k in range(2, order):
        x[k] = -A * (x[1:k] @ x[k - 1 : 0 : -1]) / (mu**k + 2 * A * x0 - B / mu**k)
        y[k] = B * x[k] / mu**k
    return np.stack([x, y], axis=1)


def on_manifold(t: np.ndarray, w: np.ndarray, mu: float, stable: bool) -> np.ndarray:
    """W at any t: from the series near 0, then by the map (or its inverse) outwards."""
    grow = 1.0 / mu if stable else mu
    steps = np.maximum(np.ceil(np.log(np.abs(t) / 0.02) / np.log(abs(grow))), 0).astype(int)
    small = t / grow**steps
    p = (small[:, None, None] ** np.arange(len(w))[None, :, None] * w).sum(axis=1)
    for k in range(int(steps.max())):
        p = np.where((steps > k)[:, None], (henon_back if stable else henon_map)(p), p)
    return p


def distance(p: np.ndarray, w: np.ndarray, mu: float, stable: bool, far: float) -> float:
    """The largest distance of points from the manifold."""
    rise = np.geomspace(1e-6, far, 30_000)
    table = np.concatenate([-rise[::-1], rise])
    curve, width = on_manifold(table, w, mu, stable), 2.0 * np.log(far / 1e-6) / 30_000
    worst, spread = 0.0, np.linspace(-1.0, 1.0, 21)
    for point in p[::15]:  # sheets lie close together: the nearest of every passage is looked at
        off = np.linalg.norm(curve - point, axis=1)
        passages = np.flatnonzero((off[1:-1] <= off[:-2]) & (off[1:-1] <= off[2:])) + 1
        t, h = table[passages[np.argsort(off[passages])[:12]]], width
        for _ in range(15):  # the nearest of 21 parameters about each, ever closer together
            trial = t[:, None] * (1.0 + h * spread)
            there = np.linalg.norm(on_manifold(trial.ravel(), w, mu, stable) - point, axis=1).reshape(trial.shape)
            t, h = trial[np.arange(len(t)), there.argmin(axis=1)], h / 6.0
        worst = max(worst, float(there.min()))
    return worst


def saddle(x: float) -> ns.Orbit:
    return ns.find_orbit(henon(), start={"x": x, "y": B * x}, period_number=1, transient=0)


@pytest.fixture(scope="module")
def unstable() -> xr.Dataset:
    return ns.manifolds(saddle(0.63), length=4.0, kind="unstable", distance=0.05)


def test_unstable_manifold_of_the_henon_map_is_that_of_its_power_series(unstable: xr.Dataset) -> None:
    """A flip saddle (-1.92): both sides, to 1e-8, and the images of its points lie on it to 1e-8."""
    x0 = (B - 1 + np.sqrt((1 - B) ** 2 + 4 * A)) / (2 * A)
    mu = -A * x0 - np.sqrt((A * x0) ** 2 + B)
    assert unstable["multiplier"].values == pytest.approx([mu, mu], abs=1e-10)
    w = series(x0, mu)
    points = unstable["section"].values
    assert distance(points, w, mu, False, 30.0) < 1e-8
    assert distance(ns.poincare(henon(), start=points.tolist(), n=1)["section"].values[:, 0], w, mu, False, 60.0) < 1e-8
    assert np.array_equal(unstable["ended"].values, [0, 0])
    assert list(unstable["side"].values) == [1, -1]


def test_neighbours_are_as_near_as_asked_for(unstable: xr.Dataset) -> None:
    for arc in (0, 1):
        x = unstable["section"].values[unstable["arc_number"].values == arc] / unstable["size"].values
        d = np.linalg.norm(np.diff(x, axis=0), axis=1)
        assert d.max() <= 0.05
        assert d.sum() == pytest.approx(4.0, abs=0.06)


def test_stable_manifold_of_the_henon_map_is_that_of_its_power_series() -> None:
    found = ns.manifolds(saddle(0.63), length=1.0, kind="stable", distance=0.1, angle=0.4)
    x0 = (B - 1 + np.sqrt((1 - B) ** 2 + 4 * A)) / (2 * A)
    mu = -A * x0 + np.sqrt((A * x0) ** 2 + B)
    w = series(x0, mu)
    assert distance(found["section"].values, w, mu, True, 30.0) < 1e-8
    assert float(found["arc_length"].max()) > 0.99


@cache
def linear() -> ns.System:
    """Two linear states under a forcing: eigenvalues 0.3 and -0.7 along (1, 1) and (1, -2)."""
    V = np.array([[1.0, 1.0], [1.0, -2.0]])
    M = V @ np.diag([0.3, -0.7]) @ np.linalg.inv(V)
    a, b, c, d = map(float, M.ravel())
    return ns.System(
        states=["x", "y"],
        parameters={"w": 2.0},
        modes={"only": lambda t, u, p: (a * u.x + b * u.y + np.cos(p.w * t), c * u.x + d * u.y)},
        period=lambda p: 2 * np.pi / p.w,
    )


@pytest.mark.parametrize(("kind", "direction"), [("unstable", (1.0, 1.0)), ("stable", (1.0, -2.0))])
def test_manifolds_of_a_linear_saddle_are_straight_lines(kind: str, direction: tuple[float, float]) -> None:
    orbit = ns.find_orbit(linear(), period_number=1, transient=0, max_period=1)
    found = ns.manifolds(orbit, length=20.0, kind=kind, distance=0.5)
    off = found["section"].values - orbit.u
    size = np.abs(off).max()
    assert size > 2.5
    assert np.abs(off @ np.array([-direction[1], direction[0]])).max() < 1e-9 * size
    along = off @ np.array(direction)
    assert along.min() < 0.0 < along.max()


def test_manifold_behind_the_kick() -> None:
    """At phase 0.7 the points have been mapped once more: they lie on the manifold of the power series too."""
    found = ns.manifolds(saddle(0.63), length=1.0, kind="unstable", distance=0.05, section=ns.Stroboscopic(0.7))
    x0 = (B - 1 + np.sqrt((1 - B) ** 2 + 4 * A)) / (2 * A)
    mu = -A * x0 - np.sqrt((A * x0) ** 2 + B)
    assert distance(found["section"].values, series(x0, mu), mu, False, 30.0) < 1e-8
    step = np.linalg.norm(np.diff(found["section"].values, axis=0), axis=1)[np.diff(found["arc_number"].values) == 0]
    assert step.max() <= 0.05 * (1 + 1e-9)


def test_phases_of_a_linear_saddle() -> None:
    """The line through the orbit's point along the eigenvector: the orbit moves with the phase, the direction stays."""
    orbit = ns.find_orbit(linear(), period_number=1, transient=0, max_period=1)
    found = ns.manifolds(orbit, length=20.0, kind="unstable", distance=0.5, section=ns.Stroboscopic(0.3))
    run = orbit.trajectory(samples=1001)
    at = run["u"].values[int(np.argmin(np.abs(run["time"].values - 0.3 * orbit.period)))]
    assert found["orbit_section"].values[0] == pytest.approx(at, abs=1e-9)
    off = found["section"].values - found["orbit_section"].values[0]
    assert np.abs(off @ np.array([-1.0, 1.0])).max() < 1e-9 * np.abs(off).max()
    with pytest.raises(TypeError, match="Stroboscopic"):
        ns.manifolds(orbit, section=0.3)


def test_what_has_no_manifolds_is_refused(tmp_path: Any) -> None:
    stable = ns.find_orbit(ns.models.discontinuous_support(rho=0.14, g=0.02, omega=4.5))
    with pytest.raises(ValueError, match="has no unstable manifold that is a curve: 0 multipliers lie outside"):
        ns.manifolds(stable, kind="unstable")
    orbit = ns.find_orbit(linear(), period_number=1, transient=0, max_period=1)
    with pytest.raises(ValueError, match="allowed: 'both'"):
        ns.manifolds(orbit, kind="other")
    with pytest.raises(ValueError, match="length = -1"):
        ns.manifolds(orbit, length=-1)
    few = ns.manifolds(orbit, length=1.0, kind="unstable", distance=0.01, points=30)
    assert "largest number of points" in str(few["ended_because"].values[0])
    with pytest.raises(TypeError, match="orbit must be ns.Orbit"):
        ns.manifolds("orbit")
    short = ns.manifolds(orbit, length=1.0, kind="unstable", distance=0.2)
    ns.save(short, tmp_path / "m.nc")
    assert np.array_equal(ns.load(tmp_path / "m.nc")["section"].values, short["section"].values)
