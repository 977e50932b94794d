"""With crossings located, the error against a fixed step falls with the method's own order; without, like h.

Two switched systems: a linear one with an exact solution (two spirals meeting at the unit circle, after nosnoc), and a
nonlinear one (Duffing with a stiffer side), whose truth is heyoka's at tolerance 1e-18.
"""

from __future__ import annotations

from collections.abc import Callable

import fixed_step_reference as reference
import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics


def two_spirals() -> ns.System:
    def inside(t, u, p):
        x, y = u
        return x - p.turn * y, p.turn * x + y

    def outside(t, u, p):
        x, y = u
        return x + p.turn * y, -p.turn * x + y

    return ns.System(
        states={"x": "", "y": ""},
        parameters={"turn": reference.TURN},
        modes={"inside": inside, "outside": outside},
        indicators={"circle": lambda t, u, p: u.x**2 + u.y**2 - 1},
        transitions=[
            ns.Transition("inside", "outside", when="circle > 0"),
            ns.Transition("outside", "inside", when="circle < 0"),
        ],
    )


def stiffer_side() -> ns.System:
    def free(t, u, p):
        return u.v, p.force * np.cos(p.omega * t) - u.x - u.x**3 - p.damping * u.v

    def contact(t, u, p):
        x, v = u
        support = p.support * (x - p.g) + p.dashpot * v
        return v, p.force * np.cos(p.omega * t) - x - x**3 - p.damping * v - support

    return ns.System(
        states={"x": "", "v": ""},
        parameters=dict(reference.DUFFING),
        modes={"free": free, "contact": contact},
        indicators={"depth": lambda t, u, p: u.x - p.g},
        transitions=[
            ns.Transition("free", "contact", when="depth > 0"),
            ns.Transition("contact", "free", when="depth < 0"),
        ],
    )


DURATION = 8.0
CASES: dict[str, tuple[Callable[[], ns.System], dict[str, float], float]] = {
    "two spirals": (two_spirals, {"x": float(reference.SPIRAL_START[0]), "y": 0.0}, reference.SPIRAL_DURATION),
    "stiffer side": (stiffer_side, {"x": reference.DUFFING_START[0], "v": reference.DUFFING_START[1]}, DURATION),
}


def truth(name: str) -> np.ndarray:
    if name == "two spirals":
        return reference.SPIRAL_END
    return np.array(reference.duffing_truth(DURATION)[0])


def end(name: str, **options: object) -> np.ndarray:
    build, start, duration = CASES[name]
    run = ns.simulate(build(), duration=duration, start=start, **options)
    assert int(run["status"]) == 0
    return run["u"].transpose("time", "state").values[-1]


def errors(name: str, steps: np.ndarray, **options: object) -> np.ndarray:
    return np.array([np.linalg.norm(end(name, step=float(h), **options) - truth(name)) for h in steps])


def order(steps: np.ndarray, found: np.ndarray) -> float:
    return float(np.polyfit(np.log(steps), np.log(found), 1)[0])


@pytest.mark.parametrize(("name", "largest"), [("two spirals", 0.05), ("stiffer side", 0.1)])
def test_rkf45_keeps_its_order_across_crossings(name: str, largest: float) -> None:
    """Order 4 (the fourth-order solution is carried on, no local extrapolation) over two decades of the step."""
    steps = np.geomspace(largest, largest / 100, 13)
    found = errors(name, steps, method="rkf45")
    print(f"\n{name}, rkf45: order {order(steps, found):.3f}, errors {found[0]:.1e} ... {found[-1]:.1e}")
    assert found[-1] < 1e-10
    assert abs(order(steps, found) - 4) <= 0.2


@pytest.mark.parametrize(("name", "largest"), [("two spirals", 0.05), ("stiffer side", 0.1)])
def test_without_located_crossings_the_order_is_lost(name: str, largest: float) -> None:
    """The same Fehlberg formula, switching by sign inside its stages: first order at best, and erratic."""
    field, start, duration = {
        "two spirals": (reference.spiral, reference.SPIRAL_START, reference.SPIRAL_DURATION),
        "stiffer side": (reference.duffing, reference.DUFFING_START, DURATION),
    }[name]
    steps = np.geomspace(largest, largest / 100, 7)
    found = np.array([np.linalg.norm(reference.march(field, start, duration, h) - truth(name)) for h in steps])
    located = errors(name, steps[-1:], method="rkf45")[0]
    print(f"\n{name}, not located: order {order(steps, found):.2f}, error {found[-1]:.1e} where located {located:.1e}")
    assert order(steps, found) < 2
    assert found[-1] > 1e4 * located


@pytest.mark.parametrize(("rtol", "expected"), [(1e-2, 4), (1e-3, 5)])
@pytest.mark.parametrize(("name", "largest"), [("two spirals", 0.05), ("stiffer side", 0.1)])
def test_taylor_keeps_its_order_across_crossings(name: str, largest: float, rtol: float, expected: int) -> None:
    """The order follows from the tolerance, p = ceil(1 - ln(rtol) / 2) (Jorba and Zou 2005); the step is fixed.

    Order 4 over two decades; at order 5 the second decade sinks into rounding, so errors below 2e-11 are left out.
    """
    steps = np.geomspace(largest, largest / 100, 13)
    found = errors(name, steps, method="taylor", rtol=rtol)
    seen = found > (0 if expected == 4 else 2e-11)
    slope = order(steps[seen], found[seen])
    print(f"\n{name}, taylor of order {expected}: found {slope:.3f}, errors {found[0]:.1e} ... {found[-1]:.1e}")
    assert seen.sum() >= 7
    assert abs(slope - expected) <= 0.2


@pytest.mark.parametrize("name", CASES)
def test_taylor_reaches_the_truth(name: str) -> None:
    found = np.linalg.norm(end(name, method="taylor", rtol=1e-14) - truth(name))
    assert found < 1e-11


def test_linear_modes_of_two_spirals() -> None:
    """Without a method asked for: the crossing lies at t = 1 exactly; the end state agrees to 1e-13 relative."""
    build, start, duration = CASES["two spirals"]
    run = ns.simulate(build(), duration=duration, start=start)
    assert run["crossing_time"].values == pytest.approx([1.0], abs=1e-13)
    end = run["u"].transpose("time", "state").values[-1]
    assert np.linalg.norm(end - reference.SPIRAL_END) <= 1e-13 * np.linalg.norm(reference.SPIRAL_END)


def test_crossing_times_of_the_nonlinear_case() -> None:
    times = reference.duffing_truth(DURATION)[1]
    build, start, duration = CASES["stiffer side"]
    for method, rtol, tolerance in (("taylor", 1e-14, 1e-12), ("rkf45", 1e-12, 1e-9)):
        run = ns.simulate(build(), duration=duration, start=start, method=method, rtol=rtol)
        assert len(run["crossing_time"]) == len(times) >= 4
        assert np.max(np.abs(run["crossing_time"].values - times)) < tolerance
