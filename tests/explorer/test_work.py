"""Results of views, computed without a page."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bokeh", reason="the explorer needs bokeh")

import nonsmooth as ns
from nonsmooth.explorer.recorded import RecordedStates
from nonsmooth.explorer.work import compute


@pytest.mark.parametrize("load", [1.0, 0.037])
def test_basins_begin_in_a_window_with_as_much_room_as_the_motion_on_each_side(load: float) -> None:
    """Without contact x = X cos: from between -4 X and -3 X to between 3 X and 4 X, and so of v."""
    system = ns.models.discontinuous_support(g=10.0, rho=load)
    p = system.values
    X = p["rho"] / np.hypot(2 * p["k"] - p["m"] * p["omega"] ** 2, p["c"] * p["omega"])
    asked = {"view": "first basins", "text": system.to_text(), "values": dict(p), "method": "auto", "transient": 200}
    asked |= {"x": "x", "y": "v", "begin": None, "fixed": {}, "window": [None] * 4}
    found = compute(asked, lambda done: True)["basins"]
    for state, size in (("x", X), ("v", X * p["omega"])):
        ends = found[state].values[[0, -1]] / size
        assert -4.0 <= ends[0] <= -3.0 and 3.0 <= ends[1] <= 4.0
    assert found["period_number"].values.tolist() == [1]


@pytest.mark.parametrize("late", [0, 1])
def test_a_record_lies_over_the_period_that_is_its_own_whatever_the_sizes_of_its_states(late: int) -> None:
    """x = cos(t/2) mm at a forcing of period 2 pi, beside a large y that grows: which period is which only x tells."""
    system = ns.mechanical(
        np.eye(2),
        np.zeros((2, 2)),
        [[0.25, 0.0], [0.0, 2.0]],
        coordinates={"x": "m", "y": "m"},
        parameters={"F": (100.0, "N"), "w": (1.0, "rad/s")},
        forcing={"y": lambda t, p: p.F * np.cos(p.w * t)},
    )
    t = np.linspace(0.0, 14 * np.pi, 1400)
    record = {"x": 1e-3 * np.cos(t / 2), "y": 100.0 * np.cos(t) * (1.0 + 1e-3 * t)}
    samples = RecordedStates(t + 2 * np.pi * late, record, np.zeros(0))
    asked = {"view": "recording", "text": system.to_text(), "values": dict(system.values), "method": "auto"}
    asked |= {"samples": samples, "start": {"x": 1e-3, "y": 100.0}, "transient": 0, "period": 2}
    asked |= {"periods": 2, "phase": 0.0, "shown": "x"}
    found = compute(asked, lambda done: True)["laid"]["history"]
    assert len(found["x"]) > 300
    assert np.abs(found["x"] - 1e-3 * np.cos(found["time"] / 2)).max() < 1e-6
