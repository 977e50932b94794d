"""The relief valve, nonlinear with impacts: sections, impacts and the published cycle, for both series methods."""

from __future__ import annotations

import heyoka_valve as hv
import numpy as np
import pytest
import reference_values as known

import nonsmooth as ns

pytestmark = pytest.mark.physics

START = np.array([1.0, 0.0, 11.0])
METHODS = {"taylor": 1e-14, "rkf45": 1e-12}


def start_of(u: np.ndarray) -> dict[str, float]:
    return dict(zip(("y1", "y2", "y3"), map(float, u), strict=True))


@pytest.mark.parametrize("method", METHODS)
def test_published_cycle(method: str) -> None:
    """Maximum and period from the section, minimum from the true extremes of the kept window."""
    top = ns.Poincare("lift_velocity", rising=False)
    swept = ns.sweep(
        ns.models.relief_valve(),
        "q",
        [8.0],
        section=top,
        start=start_of(START),
        transient=500,
        keep=4,
        max_period=3,
        method=method,
        rtol=1e-12,
        progress=False,
    )
    y1 = swept.sel(state="y1")
    assert float(y1["maximum"].squeeze()) == pytest.approx(known.VALVE_CYCLE["maximum"], abs=2e-9)
    assert float(y1["minimum"].squeeze()) == pytest.approx(known.VALVE_CYCLE["minimum"], abs=2e-9)
    assert int(swept["period_number"].squeeze()) == 1
    section = ns.poincare(
        ns.models.relief_valve().with_parameters(q=8.0),
        section=top,
        start=start_of(START),
        transient=500,
        n=4,
        method=method,
        rtol=1e-12,
    )
    assert np.diff(section["time"].values) == pytest.approx(known.VALVE_CYCLE["period"], abs=2e-9)


@pytest.mark.parametrize(("q", "duration"), [(5.0, 15.0), (2.0, 15.0), (0.5, 6.0)])  # 0.5 is chaotic
@pytest.mark.parametrize("method", METHODS)
def test_impacts_and_end_state(method: str, q: float, duration: float) -> None:
    theirs = hv.run({"q": q}, START, duration, tolerance=1e-16)
    ours = ns.simulate(
        ns.models.relief_valve().with_parameters(q=q),
        duration=duration,
        start=start_of(START),
        samples=2,
        method=method,
        rtol=METHODS[method],
    )
    assert len(theirs.impact_time) >= 4
    assert len(ours["crossing_time"]) == len(theirs.impact_time)
    tolerance = 1e-11 if method == "taylor" else 1e-8
    assert np.max(np.abs(ours["crossing_time"].values - theirs.impact_time)) < tolerance
    before = ours["u_before"].sel(state="y2").values
    assert np.max(np.abs(before - theirs.impact_speed)) < 10 * tolerance
    assert np.max(np.abs(ours["u"].transpose("time", "state").values[-1] - theirs.end)) < 10 * tolerance


@pytest.mark.parametrize("q", [5.0, 2.0])
@pytest.mark.parametrize("method", METHODS)
def test_section_returns(method: str, q: float) -> None:
    """Maxima of the lift, one by one; the start (y2 = 0) is not counted by comparing from the first later one."""
    theirs = hv.run({"q": q}, START, 30.0, tolerance=1e-16)
    late = theirs.section_time > 1e-9
    ours = ns.poincare(
        ns.models.relief_valve().with_parameters(q=q),
        section=ns.Poincare("lift_velocity", rising=False),
        start=start_of(START),
        n=10,
        method=method,
        rtol=METHODS[method],
    )
    points = ours["section"].transpose("iterate", "state").values
    times = ours["time"].values
    first = int(times[0] < 1e-9)
    tolerance = 1e-10 if method == "taylor" else 1e-7
    n = 10 - first
    assert np.max(np.abs(times[first:] - theirs.section_time[late][:n])) < tolerance
    assert np.max(np.abs(points[first:] - theirs.section[late][:n])) < 10 * tolerance
