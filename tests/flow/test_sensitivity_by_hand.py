"""Every variable of ``sensitivity`` of a ball that falls, and strikes the floor once."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics

T = 1.4


def flight(h: float, v: float, g: float, r: float) -> np.ndarray:
    """Place and velocity at T of a ball thrown up with v from h, which the floor sends back with r times its speed."""
    w = np.sqrt(v * v + 2 * g * h)  # at the floor
    left = T - (v + w) / g
    return np.array([r * w * left - g * left**2 / 2, r * w - g * left])


@pytest.fixture(scope="module")
def ball() -> ns.System:
    return ns.System(
        name="ball",
        states=["x", "v"],
        parameters={"g": 10.0, "r": 0.8},
        modes={"falls": lambda t, u, p: (u.v, -p.g)},
        indicators={"floor": lambda t, u, p: u.x},
        transitions=[ns.Transition("falls", "falls", when="floor < 0", reset=lambda t, u, p: (u.x, -p.r * u.v))],
    )


@pytest.mark.parametrize("given", [(5.0, 0.0, 10.0, 0.8), (3.0, 2.0, 9.81, 0.5)])
def test_a_ball_that_strikes_once(ball: ns.System, given: tuple[float, float, float, float]) -> None:
    h, v, g, r = given
    system = ball.with_parameters(g=g, r=r)
    found = ns.sensitivity(system, duration=T, start={"x": h, "v": v}, parameters=["r", "g"])
    w = np.sqrt(v * v + 2 * g * h)
    assert found["crossing_time"].values == pytest.approx([(v + w) / g])
    assert found["crossing_transition"].values.tolist() == [0]
    assert found["end"].values == pytest.approx(flight(*given), abs=1e-9)
    slopes = [(flight(*(given + step)) - flight(*(given - step))) / 2e-5 for step in 1e-5 * np.eye(4)]
    assert found["Phi"].values == pytest.approx(np.transpose(slopes[:2]), abs=1e-7)
    assert found["P"].sel(parameter="g").values == pytest.approx(slopes[2], abs=1e-7)
    assert found["P"].sel(parameter="r").values == pytest.approx(slopes[3], abs=1e-7)
    # R + (f+ - R f-) h_u / (h_u f-), with R = diag(1, -r), f- = (-w, -g), f+ = (r w, -g), h_u = (1, 0)
    assert found["saltation"].values[0] == pytest.approx(np.array([[-r, 0.0], [(1 + r) * g / w, -r]]), abs=1e-9)
    assert found["log_det_saltation"].values == pytest.approx([2 * np.log(r)])
    assert found["transversality"].values == pytest.approx([w / np.hypot(w, g)])
    assert (float(found["log_det"]), float(found["divergence"])) == pytest.approx((2 * np.log(r), 0.0))
    assert float(found["trace_defect"]) == pytest.approx(0.0, abs=1e-12)
    assert int(found["status"]) == 0
    for name in ("state", "initial_state"):
        assert found[name].values.tolist() == ["x", "v"]
