"""Carried rows side by side (as on a GPU) are the rows one after the other, bit for bit; here both on the processor."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.diagrams.chart import plan_chart
from nonsmooth.diagrams.chart_work import along_rows, side_by_side
from nonsmooth.kernels.hybrid import codes

SUPPORT = ns.models.discontinuous_support(g=0.02), {"omega": np.linspace(3, 7, 9), "rho": [0.12, 0.2, 0.3]}
STOP = ns.models.impact_oscillator(), {"d": np.linspace(0.2, 1.2, 9), "omega": [0.9, 2.7]}


@pytest.mark.parametrize(
    ("given", "carry", "options"),
    [
        (SUPPORT, {"omega": "up"}, {"section": ns.Stroboscopic(0.3), "start": [{"x": 0.0}, {"x": 0.01, "v": 0.1}]}),
        (SUPPORT, {"rho": "down"}, {}),
        (STOP, {"d": "down"}, {"start": [{"x": 0.0}, {"x": 5.0}]}),
    ],
)
def test_side_by_side(given: Any, carry: dict[str, str], options: dict[str, Any]) -> None:
    system, grid = given
    work = plan_chart(system, grid, carry=carry, transient=40, keep=20, max_period=4, **options).work
    (a, outer), (b, inner) = work.grid.items()
    points = system.parameter_points({a: np.repeat(outer, len(inner)), b: np.tile(inner, len(outer))})
    one, other = (run(work.settler, points, len(inner), work.starts, work.modes) for run in (along_rows, side_by_side))
    for item in fields(one):
        np.testing.assert_array_equal(getattr(one, item.name), getattr(other, item.name), err_msg=item.name)
    if system is STOP[0]:  # starts and carried states beyond the stop are among them
        assert (one.status == codes.NO_CONVERGENCE).any() and (one.status == codes.OK).any()
