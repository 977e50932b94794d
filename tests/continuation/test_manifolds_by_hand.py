"""Manifolds of a linear saddle: every variable of the result."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.results.labels import in_words


def test_every_variable_of_a_linear_saddle() -> None:
    """Along a straight line an image is the point times the multiplier, and the length to it is its distance."""
    system = ns.System(
        states=["x", "y"],
        parameters={"w": 2.0},
        modes={"only": lambda t, u, p: (u.y / 3 + np.cos(p.w * t), (2 * u.x - u.y) / 3)},
        period=lambda p: 2 * np.pi / p.w,
    )
    orbit = ns.find_orbit(system, period_number=1, transient=0, max_period=1)
    for kind, rate in (("unstable", 1 / 3), ("stable", -2 / 3)):  # of x' = y / 3, y' = (2 x - y) / 3
        found = ns.manifolds(orbit, length=3.0, kind=kind, distance=0.2, delta=1e-4)
        mu = np.exp(rate * np.pi)
        assert found["multiplier"].values == pytest.approx([mu, mu])
        assert found["side"].values.tolist() == [1, -1] and found["orbit_point"].values.tolist() == [0, 0]
        assert (
            in_words(found["manifold"]).tolist() == [kind] * 2 and in_words(found["ended"]).tolist() == ["length"] * 2
        )
        assert found["orbit_section"].values == pytest.approx(orbit.u[None, :], abs=1e-12)
        size = np.maximum(0.5 * (orbit.maximum - orbit.minimum), 1e-3 * system.scale_vector())
        assert found["size"].values == pytest.approx(size)
        assert not found["piece"].values.any()
        away = np.linalg.norm((found["section"].values - orbit.u) / size, axis=1)
        assert found["arc_length"].values == pytest.approx(away, rel=1e-6)
        for arc in (0, 1):
            here = found["arc_number"].values == arc
            assert away[here][0] <= 1e-4 * (1 + 1e-9) and away[here][-1] == pytest.approx(3.0, abs=0.2)
            images = np.log(away[here][1:] / 1e-4) / abs(rate * np.pi)
            assert (np.abs(found["iterate"].values[here][1:] - images + 0.5) <= 0.5 + 1e-6).all()
