"""Run in a process with NUMBA_ENABLE_CUDASIM=1: Taylor series on the processor and under the simulator.

Prints one JSON object: the arrays of both, and the argument types with which the kernel was launched.
"""

from __future__ import annotations

import json
from typing import Any

from gpu_both import both, launches_of
from gpu_series_systems import START, TOP, filtered, grows_to_a_stop, two_wells

import nonsmooth as ns
from nonsmooth.flow.engines import gpu

LAUNCHED = launches_of(gpu.SeriesOnGpu)
SHORT: dict[str, Any] = {"transient": 16, "keep": 10, "max_period": 4, "method": "taylor"}

gpu.STEPS = 50  # so that a run takes several launches
valve = ns.models.relief_valve()
results = {
    "sweep": both(ns.sweep, valve, "q", [6.5, 8.0], direction=None, start=START, section=TOP, rtol=1e-10, **SHORT),
    "at_rest": both(
        ns.sweep,
        valve,
        "q",
        [9.5],
        direction=None,
        start=START,
        section=ns.Poincare("lift_velocity", rising=False, t_max=0.5),
        rtol=1e-10,
        **SHORT,
    ),
    "chart": both(ns.chart, two_wells(), {"F": [0.1], "c": [0.3]}, lyapunov=40, **SHORT),
    "basins": both(ns.basins, two_wells(), {"x": [-1.0, 1.2], "v": [0.5]}, **SHORT | {"transient": 20}),
    "memory": both(ns.sweep, two_wells(), "F", [0.1, 0.27], direction=None, **SHORT),
    "exact": both(ns.sweep, filtered(), "F", [0.2, 0.3], direction=None, **SHORT | {"method": "auto"}),
    "planar": both(
        ns.sweep,
        grows_to_a_stop(),
        "c",
        [0.1, 0.2],
        direction=None,
        start={"x": 0.5},
        section=ns.Poincare("speed", rising=True),
        **SHORT | {"method": "auto"},
    ),
    "forced": both(
        ns.chart,
        ns.models.discontinuous_support(g=-0.0045),
        {"omega": [3.2, 3.69], "rho": [0.15, 0.3]},
        section=ns.Poincare("penetration", rising=True),
        **SHORT | {"method": "auto"},
    ),
}
print(json.dumps({"results": results, "launched": LAUNCHED}))
