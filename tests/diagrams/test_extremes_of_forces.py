"""Extremes of forces that elements bear, against their laws."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics


@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_a_friction_torn_off_at_once_bears_no_more_than_it_can(method: str) -> None:
    """A block that sticks to its belt meets a damper of 3 at the speed 0.5: 1.5 and more would have to be held."""
    system = ns.mechanical(
        1.0,
        0.0,
        1.0,
        parameters={"w": 1.0},
        forcing={"q": lambda t, p: 0.31 * np.cos(p.w * t)},
        elements={
            "belt": ns.elements.Coulomb(at="q", belt=0.5, friction=0.3, static=0.6),
            "stop": ns.elements.ElasticStop(at="q", position=0.4, stiffness=0.2, damping=3.0),
        },
    )
    swept = ns.sweep(system, "w", [1.0, 1.1], transient=100, keep=30, method=method, progress=False)  # type: ignore[arg-type]
    assert (swept["period_number"] == 1).all() and (swept["stop_force_maximum"] > 1.4).all()
    assert swept["belt_force_maximum"].values == pytest.approx(0.3, abs=1e-9)
    assert (swept["belt_force_minimum"] > -0.6).all()
