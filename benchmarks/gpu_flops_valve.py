"""Floating-point operations of the relief valve by Taylor series, counted like those of the exact flow (``gpu_flops``).

Run with NUMBA_DISABLE_JIT=1; prints one JSON object: operations and steps per section return, the mean over inflows at
which the valve hits its seat, each after some returns have brought it near its attractor.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

import nonsmooth as ns
from gpu_flops import operations
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.sections import section_plan
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.series import crossing, polynomial, taylor

FILES = (crossing, polynomial, taylor)
TRANSIENT, RETURNS, TOLERANCE = 40, 20, 1e-10
START = [0.2, 0.0, 10.0]


def main() -> None:
    valve = ns.models.relief_valve()
    _, plan = section_plan(valve, ns.Poincare("lift_velocity", rising=False))
    done, steps = [], []
    for q in np.linspace(0.5, 7.5, 8):
        system = valve.with_parameters(q=float(q))
        totals = []
        for returns in (TRANSIENT, TRANSIENT + RETURNS):
            engine: Any = engine_for(system, "taylor", TOLERANCE, None)
            engine.point = system.parameter_vector()[None, :]
            counts = operations(engine, plan, START, returns, (*map(vars, FILES), engine.model.jet.__globals__))
            totals.append((counts, int(engine._threads.work.tally[codes.STEPS])))
        done.append((totals[1][0] - totals[0][0]) / RETURNS)
        steps.append((totals[1][1] - totals[0][1]) / RETURNS)
    print(json.dumps({"per_return": float(np.mean(done)), "steps_per_return": float(np.mean(steps))}))


if __name__ == "__main__":
    main()
