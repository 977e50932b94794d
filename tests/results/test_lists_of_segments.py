"""A trajectory's list beside its crossings, through verbs: every crossing stands twice, with its two limits."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics


def test_limits_at_each_impact_of_a_ball() -> None:
    """Impacts at 1, 2 and 2.5 s with e = 1/2, dropped from g / 2: before each the speed is -g, -g / 2, -g / 4."""
    g = 2.0
    ball = ns.System(
        states={"x": "m", "v": "m/s"},
        parameters={"g": g},
        modes={"fly": lambda t, u, p: (u.v, -p.g)},
        elements={"floor": ns.elements.Stop(gap=lambda t, u, p: u.x, on={"v": 1.0}, restitution=0.5)},
        outputs={"energy": (lambda t, u, p: p.g * u.x + u.v**2 / 2, "J")},
    )
    run = ns.simulate(ball, duration=2.6, start={"x": g / 2}, samples=27)
    time, v = run["time"].values, run["u"].sel(state="v").values
    assert run["crossing_time"].values == pytest.approx([1.0, 2.0, 2.5], abs=1e-10)
    for k, (at, speed) in enumerate(zip([1.0, 2.0, 2.5], [-g, -g / 2, -g / 4], strict=True)):
        here = np.flatnonzero(np.isclose(time, at, atol=1e-9) & np.isclose(run["segment"].values, k))[-1]
        assert v[here : here + 2] == pytest.approx([speed, -speed / 2], abs=1e-9)
        assert run["segment"].values[here : here + 2].tolist() == [k, k + 1]
        assert run["u_before"].sel(state="v").values[k] == pytest.approx(speed, abs=1e-9)
        assert run["u_after"].sel(state="v").values[k] == pytest.approx(-speed / 2, abs=1e-9)
    assert (np.diff(time) >= 0).all() and (np.diff(run["segment"].values) >= 0).all()
    energy = g * g / 2 * 0.25 ** run["segment"].values
    assert run["energy"].values == pytest.approx(energy, abs=1e-9)
    assert run["energy"].attrs["units"] == "J" and run["time"].attrs["units"] == "s"
