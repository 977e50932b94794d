"""A stop at x = 0: its indicator has no constant part, so that rounding is all there is of it at an impact."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics


def ball_on_a_table() -> ns.System:
    """A ball (g = 1) over a table that moves as a sin t, x its height over the table."""
    return ns.System(
        states=["x", "v"],
        parameters={"a": 1.0, "e": 0.5},
        modes={"flight": lambda t, u, p: (u.v, -1.0 + p.a * np.sin(t))},
        indicators={"table": lambda t, u, p: -u.x},
        transitions=[ns.Transition("flight", "flight", when="table > 0", reset=lambda t, u, p: (u.x, -p.e * u.v))],
    )


def one_bounce(e: float, above: float) -> tuple[ns.System, dict[str, float], np.ndarray]:
    """One impact a period at the phase th > 0: leaves with pi, comes with -pi, so that a cos th = pi (1 - e) / (1 + e).

    Returns the system at ``above`` times the fold's amplitude, the state at phase 0 and the derivative of the map of
    (th, speed of leaving), from V+ = -e V- + (1 + e) a cos th at the next impact.
    """
    w = np.pi * (1 - e) / (1 + e)
    a = above * w
    th = np.arccos(w / a)
    back = 2 * np.pi - th
    start = {"x": a * np.sin(th) + np.pi * back - back**2 / 2, "v": np.pi - back - a}
    later = 2 * np.pi / (np.pi + w)  # d(instant of the next impact)/dV
    turning = -(1 + e) * a * np.sin(th)
    derivative = np.array([[1.0, later], [turning, -e * (1 - later) + turning * later]])
    return ball_on_a_table().with_parameters(a=a, e=e), start, derivative


@pytest.mark.parametrize("e", [0.3, 0.5, 0.8])
@pytest.mark.parametrize("above", [1.0001, 1.01, 1.05, 1.1])
def test_one_bounce_a_period(e: float, above: float) -> None:
    system, start, derivative = one_bounce(e, above)
    orbit = ns.find_orbit(system, start=start, transient=0, period_number=1)
    assert orbit.u == pytest.approx(list(start.values()), abs=1e-12)
    wanted = np.linalg.eigvals(derivative)
    found = np.sort_complex(orbit.floquet_multipliers)
    assert found == pytest.approx(np.sort_complex(wanted.astype(complex)), abs=1e-9)


@pytest.mark.parametrize("method", ["exact", "taylor", "rkf45"])
@pytest.mark.parametrize("e", [0.5, 1.0])
def test_each_impact_is_one(method: str, e: float) -> None:
    """Dropped from 24 heights on a table at rest: one impact each, which leaves with e times its speed."""
    system = ball_on_a_table().with_parameters(a=0.0, e=e)
    for height in np.linspace(0.1, 3.0, 24):
        fall = np.sqrt(2 * height)
        run = ns.simulate(system, duration=(1 + e) * fall, start={"x": height, "v": 0.0}, method=method)
        assert run["crossing_time"].values == pytest.approx([fall], rel=1e-8)
        assert run["u_after"].values[0, 1] == pytest.approx(e * fall, rel=1e-8)


@pytest.mark.parametrize("method", ["exact", "taylor", "rkf45"])
def test_the_last_flights_are_no_way_through_the_floor(method: str) -> None:
    """A ball rests at sqrt(2h/g) (1 + e)/(1 - e); its last flights, 1e-15 high, are below the rounding of its place."""
    ball = ns.mechanical(
        1.0,
        0.0,
        0.0,
        forcing={"q": lambda t, p: -p.g},
        parameters={"g": 9.81, "e": 0.5},
        elements={"floor": ns.elements.Stop(at="q", side=-1, restitution="e")},
    )
    rng = np.random.default_rng(7)
    for g, e, height in zip(rng.uniform(5, 100, 40), rng.uniform(0.2, 0.7, 40), rng.uniform(0.5, 2, 40), strict=True):
        end = np.sqrt(2 * height / g) * (1 + e) / (1 - e)
        here = ball.with_parameters(g=g, e=e)
        run = ns.simulate(here, duration=1.5 * end, start={"q": height}, samples=3, method=method)
        assert run.u.sel(state="q").values[-1] == pytest.approx(0.0, abs=1e-12)
        assert run.crossing_time.values[-1] == pytest.approx(end, abs=1e-6)
