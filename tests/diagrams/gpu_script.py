"""Run in a process with NUMBA_ENABLE_CUDASIM=1: the same small work on the processor and under the simulator.

Prints one JSON object: the arrays of both, and the argument types with which every kernel was launched.
"""

from __future__ import annotations

import json
from typing import Any

from gpu_both import JOBS, both, launches_of

import nonsmooth as ns
from nonsmooth.flow.engines import gpu as planar_cuda

LAUNCHED = launches_of(planar_cuda.PlanarOnGpu)


def counted(*arguments: Any, **options: Any) -> dict[str, Any]:
    """Both devices, and how many tables the GPU built."""
    before = JOBS["tabulate"]
    return both(*arguments, **options) | {"built": JOBS["tabulate"] - before}


oscillator = ns.models.discontinuous_support()
planar_cuda.SLICE = 16  # so that a transient takes several launches
results = {
    "chart": counted(
        ns.chart,
        oscillator.with_parameters(g=-0.0045),
        {"omega": [3.2, 3.69], "rho": [0.15, 0.3]},
        transient=20,
        keep=12,
        max_period=4,
        lyapunov=40,
    ),
    "every_period": counted(
        ns.chart,
        oscillator.with_parameters(g=-0.0045),
        {"omega": [3.69], "rho": [0.3, 0.47]},
        transient=20,
        keep=12,
        max_period=4,
        stop_early=False,
        extremes=False,
        start=[{"x": 0.0}, {"x": 0.01, "v": 0.05}],
    ),
    "stop": both(
        ns.chart,
        ns.models.impact_oscillator(),
        {"omega": [1.0, 2.7], "A": [0.05, 1.0]},
        transient=30,
        keep=12,
        max_period=4,
        start=[{"x": 0.0}, {"x": 5.0}],
    ),
    "sliding": both(
        ns.chart,
        ns.models.dry_friction_oscillator(f_s=0.4, v_b=0.1),
        {"omega": [0.3, 0.7], "f_0": [0.5, 1.0]},
        transient=12,
        keep=8,
        max_period=3,
    ),
    "carried": both(
        ns.chart,
        ns.models.impact_oscillator(),
        {"d": [0.4, 0.7, 1.0], "omega": [0.9, 2.7]},
        carry={"d": "down"},
        transient=30,
        keep=12,
        max_period=4,
    ),
    "basins": both(
        ns.basins,
        oscillator.with_parameters(g=0.0014, omega=11.15, rho=0.33),
        {"x": [-0.006, 0.006], "v": [-0.1, 0.1]},
        transient=20,
        keep=18,
        max_period=6,
    ),
    "basin_fractions": both(
        ns.basin_fractions,
        oscillator.with_parameters(g=0.0014, omega=11.15),
        "rho",
        [0.3, 0.33],
        n_starts=3,
        box={"x": (-0.02, 0.02), "v": (-0.2, 0.2)},
        seed=1,
        transient=20,
        keep=18,
        max_period=6,
    ),
    "sweep": counted(
        ns.sweep,
        oscillator.with_parameters(g=-0.0045, omega=3.69),
        "rho",
        [0.2, 0.3, 0.47],
        direction=None,
        transient=20,
        keep=10,
    ),
    "lyapunov": counted(
        ns.lyapunov,
        oscillator.with_parameters(g=-0.0045, omega=3.69),
        parameter="rho",
        values=[0.25, 0.33],
        direction=None,
        periods=32,
        transient=10,
    ),
}
print(json.dumps({"results": results, "launched": LAUNCHED}))
