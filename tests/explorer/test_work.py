"""Results of views, computed without a page."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bokeh", reason="the explorer needs bokeh")

import nonsmooth as ns
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
