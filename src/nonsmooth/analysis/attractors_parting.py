"""The largest Lyapunov exponent of a run by two neighbours, for engines whose jobs run one by one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.flow.engine import Chain, Engine, FloatArray, SectionPlan, State
from nonsmooth.kernels import codes

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["exponent_of"]


def exponent_of(
    system: System, engine: Engine, plan: SectionPlan, point: FloatArray, start: FloatArray, mode: int, n_returns: int
) -> tuple[float, float]:
    """Exponent per unit time of a run that begins on the section, and its standard error; NaN where a run failed.

    The neighbour is put back to a small distance after each of ``n_returns`` returns; the error is that of the mean of
    ten batches, and a quarter of one before them is left out.
    """
    tables, traced, scale = engine.prepare(point), system.traced, system.scale_vector()
    period = float((tables.period if hasattr(tables, "period") else tables.periods)[0])
    quiet = replace(plan, extremes=False)
    out = Chain.empty(1, 1, len(traced.u), len(traced.indicators), len(traced.outputs))
    state = State(start.copy(), system.memory_vector())
    state.counters[0] = mode
    if plan.indicator < 0:
        state.clock[0], state.clock[2] = plan.phase * period, period
    offset = np.full(len(start), 1e-6) * scale
    first = float(np.linalg.norm(offset / scale))
    batch = n_returns // 10
    logs, times = [], []
    for _ in range(batch // 4 + 10 * batch):
        other = state.copy()
        other.u += offset
        other.settled = False
        for one in (state, other):
            engine.chain(tables, 0, 1, one, None, quiet, 0, 1, out)
            if out.status[0] not in (codes.OK, codes.NOT_GUARANTEED):
                return np.nan, np.nan
            if one is state:
                times.append(float(out.elapsed[0]))
        offset = other.u - state.u
        apart = float(np.linalg.norm(offset / scale))
        if apart > 0.0:
            offset *= first / apart
        else:
            apart, offset = 1e-16 * first, np.full(len(start), 1e-6) * scale
        logs.append(np.log(apart / first))
    grown = np.array(logs[batch // 4 :]).reshape(10, batch).sum(axis=1)
    rates = grown / np.array(times[batch // 4 :]).reshape(10, batch).sum(axis=1)
    return float(rates.mean()), float(rates.std() / 3.0)
