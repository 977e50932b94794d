"""A motion that repeats itself bit for bit is not run again: what is kept of it is what would have come.

``simulate`` runs every period: its samples at the section's instants and its log are held against ``poincare`` and
``sweep``. A thousand million periods could not be run.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics

ELEMENTS: dict[str, dict[str, Any]] = {
    "stop": {"stop": ns.elements.Stop(at="q", position=0.4, restitution=0.7)},
    "friction and spring": {
        "rub": ns.elements.Coulomb(at="q", friction=0.2),
        "wall": ns.elements.ElasticStop(at="q", position=0.3, stiffness=20.0),
    },
    "two stops": {
        "right": ns.elements.Stop(at="q", position=0.5, restitution=0.8),
        "left": ns.elements.Stop(at="q", position=-0.3, side=-1, restitution=0.8),
    },
}


def driven(elements: dict[str, Any], frequency: float = 1.3) -> ns.System:
    return ns.mechanical(
        M=[[1.0]],
        K=[[1.0]],
        C=[[0.1]],
        parameters={"w": frequency},
        forcing={"q": lambda t, p: np.cos(p.w * t)},
        elements=elements,
    )


@pytest.mark.parametrize("method", ["exact", "taylor"])
@pytest.mark.parametrize("elements", ELEMENTS)
@pytest.mark.parametrize(("phase", "transient", "n"), [(0.0, 300, 37), (0.37, 0, 160)])
def test_returns_are_those_of_a_run_of_every_period(elements, method, phase, transient, n) -> None:
    system = driven(ELEMENTS[elements])
    points = ns.poincare(
        system, n=n, transient=transient, section=ns.Stroboscopic(phase), start=[0.1, 0.0], method=method
    )
    period = 2.0 * np.pi / 1.3
    first = transient + (0 if phase else 1)
    times = (first + phase + np.arange(n)) * period
    assert np.max(np.abs(points["time"] - times)) < 1e-12 * times[-1]
    run = ns.simulate(system, duration=times[-1] + 0.1, samples=times, start=[0.1, 0.0], method=method)
    u = run["u"].values[np.isin(run["time"].values, times)]  # crossings stand in it too
    assert np.max(np.abs(u - points["section"].values)) < 1e-9


@pytest.mark.parametrize("elements", ELEMENTS)
def test_counts_and_extremes_are_those_of_a_run_of_every_period(elements) -> None:
    """They repeat themselves within 2 and 6 periods, of which 53 is no multiple."""
    transient, keep = 250, 53
    system = driven(ELEMENTS[elements])
    row = ns.sweep(system, "w", [1.3], transient=transient, keep=keep, start=[0.1, 0.0], direction=None).squeeze()
    run = ns.simulate(system, periods=keep, transient=transient, samples=20_001, start=[0.1, 0.0])
    assert float(row["crossings_per_period"]) * keep == pytest.approx(len(run["crossing_time"]), abs=1e-9)
    if "rub" not in ELEMENTS[elements]:  # every transition is an impact
        assert float(row["contacts_per_period"]) == float(row["crossings_per_period"])
    for i, state in enumerate(("q", "v_q")):
        u = np.concatenate([run[name].values[:, i] for name in ("u", "u_before", "u_after")])
        assert float(row["maximum"].sel(state=state)) == pytest.approx(u.max(), abs=2e-4 * np.ptp(u))
        assert float(row["minimum"].sel(state=state)) == pytest.approx(u.min(), abs=2e-4 * np.ptp(u))


@pytest.mark.parametrize("keep", [1, 2, 3, 8])
def test_returns_at_the_instant_of_a_transition(keep: int) -> None:
    """At the section's phase x becomes x / 2 + 1, and decays in between: behind it x -> exp(-1) x / 2 + 1."""
    system = ns.System(
        states=["x"],
        parameters={"T": 1.0},
        modes={"all": lambda t, u, p: (-u.x,)},
        period=lambda p: p.T,
        transitions=[ns.Transition("all", "all", at=0.25, reset=lambda t, u, p: (0.5 * u.x + 1.0,))],
    )
    for transient in (0, 5, 400):
        points = ns.poincare(system, n=keep, transient=transient, start=[0.0], section=ns.Stroboscopic(0.25))
        assert points["time"].values == pytest.approx(transient + np.arange(keep) + 0.25, rel=1e-14)
        x = [0.0]
        for _ in range(transient + keep):
            x.append(0.5 * x[-1] * (np.exp(-1.0) if len(x) > 1 else 1.0) + 1.0)
        assert points["section"].values[:, 0] == pytest.approx(x[-keep:], abs=1e-13)


@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_a_thousand_million_periods(method: str) -> None:
    """Impacts once a period, whose orbit is a fixed point of the return."""
    system = driven(ELEMENTS["stop"])
    orbit = ns.find_orbit(system, start=[0.1, 0.0])
    assert orbit.period_number == 1
    for transient, n in ((10**9, 2), (2, 100_000)):
        points = ns.poincare(system, n=n, transient=transient, start=[0.1, 0.0], method=method)
        assert points["section"].values[-1] == pytest.approx(orbit.u, abs=1e-9)
        assert points["time"].values[-1] == pytest.approx((transient + n) * 2.0 * np.pi / 1.3, rel=1e-14)


@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_a_motion_that_counts_never_repeats_itself(method: str) -> None:
    """The same impacts again and again, and a memory of their number: the states come back, the memory does not."""

    def along(t: Any, u: Any, p: Any) -> tuple[Any, Any]:
        return u.v, np.cos(p.w * t) - u.x - 0.1 * u.v

    system = ns.System(
        states=["x", "v"],
        parameters={"w": 1.3},
        memory={"n": 0.0},
        modes={"free": along},
        indicators={"gap": lambda t, u, p: u.x - 0.4},
        transitions=[
            ns.Transition(
                "free",
                "free",
                when="gap > 0",
                reset=lambda t, u, p: (u.x, -0.7 * u.v),
                write={"n": lambda t, u, p: p.n + 1},
            )
        ],
    )
    run = ns.simulate(system, periods=400, start=[0.1, 0.0], method=method)
    assert len(run["crossing_time"]) >= 400
    row = ns.sweep(system, "w", [1.3], transient=300, keep=100, start=[0.1, 0.0], direction=None, method=method)
    late = run["crossing_time"].values > 300 * 2.0 * np.pi / 1.3
    assert float(row["crossings_per_period"].squeeze()) * 100 == pytest.approx(np.count_nonzero(late), abs=1e-9)
    assert float(run["n"].values[-1]) == len(run["crossing_time"])
