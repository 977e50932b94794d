"""Extremes, crossings and clearance that a sweep reports of an attractor, against heyoka and closed forms."""

from __future__ import annotations

import heyoka_support as hs
import numpy as np
import pytest
import reference_values as known

import nonsmooth as ns

pytestmark = pytest.mark.physics

#: Settled periodic orbits with contact: parameters and period number.
ORBITS = {
    "figure 9": ({"rho": 0.14, "g": 0.02, "omega": 4.8}, 1),
    "figure 11, period 2": ({"rho": 0.39, "g": -0.0045, "omega": 3.69}, 2),
    "figure 11, period 4": ({"rho": 0.255, "g": -0.0045, "omega": 3.69}, 4),
    "figure 13": ({"rho": 0.33, "g": 0.0009, "omega": 11.15}, 2),
}


def one_point(p: dict[str, float], start: np.ndarray, **options: object):
    system = ns.models.discontinuous_support().with_parameters(p)
    begin = {"x": float(start[0]), "v": float(start[1])}
    return ns.sweep(
        system, "rho", [p["rho"]], start=begin, transient=100, keep=16, max_period=15, progress=False, **options
    ).squeeze()


@pytest.mark.parametrize("name", ORBITS)
def test_settled_orbit_with_contact(name: str) -> None:
    parameters, n = ORBITS[name]
    p = dict(known.TABLE_1, **parameters)
    u = hs.run(p, 3000).states[-1]
    theirs = hs.run(p, 16, u, per_period=1000)
    found = one_point(p, u)
    assert int(found["period_number"]) == n
    assert found["section"].sel(state="x").values == pytest.approx(hs.run(p, 116, u).states[-16:, 0], abs=1e-10)
    tops = [e.value + p["g"] for e in theirs.extrema if e.indicator == "penetration"]
    assert float(found["maximum"].sel(state="x")) == pytest.approx(max(tops), abs=1e-12)
    # The others lie between heyoka's dense samples or at its crossings (corners of the velocity): 1e-3 of the range.
    dense = np.concatenate([theirs.states, [c.u for c in theirs.crossings]])
    for state, column in (("x", 0), ("v", 1)):
        sampled = dense[:, column]
        low, high = float(found["minimum"].sel(state=state)), float(found["maximum"].sel(state=state))
        assert low <= sampled.min() + 1e-12
        assert high >= sampled.max() - 1e-12
        assert sampled.min() - low < 1e-3 * np.ptp(sampled)
        assert high - sampled.max() < 1e-3 * np.ptp(sampled)
    contacts = theirs.n_contacts / 16
    assert float(found["contacts_per_period"]) == pytest.approx(contacts)
    assert float(found["crossings_per_period"]) == pytest.approx(len(theirs.crossings) / 16)


def test_motion_without_contact() -> None:
    """Amplitudes and the clearance of the gap in closed form."""
    p = dict(known.TABLE_1, rho=0.14, g=0.02, omega=6.0)
    top = known.amplitude(p)
    found = one_point(p, known.steady_state(p))
    assert int(found["period_number"]) == 1
    assert float(found["crossings_per_period"]) == 0
    assert float(found["maximum"].sel(state="x")) == pytest.approx(top, rel=1e-13)
    assert float(found["minimum"].sel(state="x")) == pytest.approx(-top, rel=1e-13)
    assert float(found["maximum"].sel(state="v")) == pytest.approx(top * p["omega"], rel=1e-13)
    clearance = found["clearance"].sel(indicator="penetration")
    assert abs(float(clearance)) == pytest.approx(p["g"] - top, rel=1e-12)
