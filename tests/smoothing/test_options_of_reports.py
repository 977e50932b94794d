"""Options of the smoothing report that are seldom given: the length of its runs, the box of its starts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

T = 2 * np.pi / 0.4


@pytest.fixture(scope="module")
def friction() -> ns.System:
    return ns.models.dry_friction_oscillator(omega=0.4, zeta=0.05)


def test_a_length_in_time_or_in_periods_is_one_length(friction: ns.System) -> None:
    """Exponents of runs come near to those of the orbit, ln|mu| / T, and are another estimate."""
    orbit = ns.find_orbit(friction)
    quick = {"orbit": orbit, "progress": False}
    own = ns.smoothing_report(friction, [1e-2], **quick)
    by_time = ns.smoothing_report(friction, [1e-2], duration=60 * T, **quick)
    by_periods = ns.smoothing_report(friction, [1e-2], periods=60, **quick)
    assert by_time["exponents"].values == pytest.approx(by_periods["exponents"].values, rel=1e-9)
    mu = own["floquet_multipliers"].values[0, 0]
    assert own["exponents"].values[0, 0] == pytest.approx(np.log(np.abs(mu)) / T)
    assert by_time["exponents"].values[0, 0, 0] != own["exponents"].values[0, 0, 0]
    assert by_time["exponents"].values[0, 0, 0] == pytest.approx(own["exponents"].values[0, 0, 0], abs=0.02)


def test_attractors_of_two_wells_in_a_box_of_ones_own() -> None:
    """A mass in a double well beside a support out of reach: a box about one well meets one of two attractors."""

    def free(t: Any, u: Any, p: Any) -> Any:
        return u.v, u.x - u.x**3 - 0.2 * u.v + p.a * np.cos(p.w * t)

    well = ns.System(
        states=["x", "v"],
        parameters={"w": 1.0, "a": 0.05},
        modes={"free": free, "contact": lambda t, u, p: (u.v, free(t, u, p)[1] - 10 * (u.x - 5))},
        indicators={"gap": lambda t, u, p: u.x - 5},
        transitions=[
            ns.Transition("free", "contact", when="gap > 0"),
            ns.Transition("contact", "free", when="gap < 0"),
        ],
    )
    found = {}
    for name, box in (("both", {"x": (-1.5, 1.5), "v": (-0.1, 0.1)}), ("one", {"x": (0.8, 1.2), "v": (-0.1, 0.1)})):
        report = ns.smoothing_report(well, [1e-3], start={"x": 1.0}, n_starts=8, box=box, seed=3, progress=False)
        found[name] = [int(report[key].values.ravel()[0]) for key in ("reference_n_attractors", "n_attractors")]
        assert not report["missing"].values.any() and not report["spurious"].values.any()
    assert found == {"both": [2, 2], "one": [1, 1]}
