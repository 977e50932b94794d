"""Floating-point operations of the relief valve by Taylor series, counted like those of the exact flow (``gpu_flops``).

Run with NUMBA_DISABLE_JIT=1; prints one JSON object: operations and steps per section return, the mean over inflows at
which the valve hits its seat, each after some returns have brought it near its attractor.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

import nonsmooth as ns
from gpu_flops import Counted, counted
from nonsmooth.flow.engine import Chain, State
from nonsmooth.flow.methods import engine_for
from nonsmooth.flow.sections import section_plan
from nonsmooth.kernels import (
    crossing,
    polynomial,
    series,
    series_node,
    series_places,
    series_step,
    taylor,
    trust,
    watch,
)

FILES = (crossing, polynomial, series, series_node, series_step, taylor, trust, watch)
TRANSIENT, RETURNS, TOLERANCE = 40, 20, 1e-10
START = [0.2, 0.0, 10.0]


def counting(engine: Any) -> dict[str, int]:
    """Make an engine march on counting numbers; operations and steps of its last run."""
    found = {"operations": 0, "steps": 0}
    sources = {name: getattr(math, name) for name in ("fabs", "sqrt", "exp", "log")} | {"ln": math.log}
    for space in (*map(vars, FILES), engine.model.jet.__globals__):
        for name, plain in sources.items():
            if name in space:
                space[name] = lambda x, f=plain: Counted(f(x))

    def convert(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(convert(one) for one in value)
        return counted(value) if isinstance(value, np.ndarray) and value.dtype.kind == "f" else value

    def march(
        tables: Any, i: int, choice: Any, control: Any, state: State, q: Any, scratch: Any, sections: Any,
        extremes: Any, tally: Any, memo: Any, log: Any,
    ) -> int:  # fmt: skip
        model, u, clock = engine.model, convert(state.u), convert(state.clock)
        given = (
            *map(convert, (control, engine.norms, tables.steps[i], u, q, clock)), state.counters,
            *map(convert, (scratch.arrays, sections, extremes)), tally, convert(memo), log,
        )  # fmt: skip
        Counted.done = 0
        status: int = series.march(
            model.field, model.jet, model.values, model.jump, engine.net, engine.lacking, engine.kinds, choice, *given
        )
        found["operations"], found["steps"] = Counted.done, int(tally[series_places.STEPS])
        state.u[:], state.clock[:] = u.astype(float), clock.astype(float)
        return status

    engine._march = march
    return found


def main() -> None:
    valve = ns.models.relief_valve()
    _, plan = section_plan(valve, ns.Poincare("lift_velocity", rising=False))
    operations, steps = [], []
    for q in np.linspace(0.5, 7.5, 8):
        system = valve.with_parameters(q=float(q))
        engine: Any = engine_for(system, "taylor", TOLERANCE, None)
        tables = engine.prepare(system.parameter_vector()[None, :])
        found, totals = counting(engine), []
        for returns in (TRANSIENT, TRANSIENT + RETURNS):
            out, state = Chain.empty(1, 1, 3, 2, 0), State(np.array(START), np.zeros(0))
            engine.chain(tables, 0, 1, state, None, plan, returns - 1, 1, out)
            totals.append((found["operations"], found["steps"]))
        operations.append((totals[1][0] - totals[0][0]) / RETURNS)
        steps.append((totals[1][1] - totals[0][1]) / RETURNS)
    print(json.dumps({"per_return": float(np.mean(operations)), "steps_per_return": float(np.mean(steps))}))


if __name__ == "__main__":
    main()
