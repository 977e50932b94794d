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
from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.sections import section_plan
from nonsmooth.kernels.series import crossing, places, polynomial, taylor, trust
from nonsmooth.kernels.series.module import series_module

FILES = (crossing, polynomial, series_module(), taylor, trust)
TRANSIENT, RETURNS, TOLERANCE = 40, 20, 1e-10
START = [0.2, 0.0, 10.0]


def counting(engine: Any) -> dict[str, Any]:
    """Make an engine march on counting numbers; the working memory of its last run."""
    found: dict[str, Any] = {}
    sources = {name: getattr(math, name) for name in ("fabs", "sqrt", "exp", "log")} | {"ln": math.log}
    for space in (*map(vars, FILES), engine.model.jet.__globals__):
        for name, plain in sources.items():
            if name in space:
                space[name] = lambda x, f=plain: Counted(f(x))

    def convert(value: Any) -> Any:
        if isinstance(value, tuple):
            parts = [convert(one) for one in value]
            return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
        return counted(value) if isinstance(value, np.ndarray) and value.dtype.kind == "f" else value

    plain_given, plain_motion = engine.given, engine._motion

    def given(tables: Any, observer: str) -> Any:
        form, own, work = plain_given(tables, observer)
        found["work"] = convert(work)._replace(tally=work.tally)
        return convert(form), own, found["work"]

    engine.given, engine._motion = given, lambda *arguments: convert(plain_motion(*arguments))
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
            out, state = engine.kept(1, 1), State(np.array(START), np.zeros(0))
            Counted.done = 0
            engine.chain(tables, 0, 1, state, None, plan, returns - 1, 1, out)
            totals.append((Counted.done, int(found["work"].tally[places.STEPS])))
        operations.append((totals[1][0] - totals[0][0]) / RETURNS)
        steps.append((totals[1][1] - totals[0][1]) / RETURNS)
    print(json.dumps({"per_return": float(np.mean(operations)), "steps_per_return": float(np.mean(steps))}))


if __name__ == "__main__":
    main()
