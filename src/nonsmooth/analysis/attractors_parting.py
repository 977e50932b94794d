"""The largest Lyapunov exponent of a run by two neighbours, for engines whose jobs run one by one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.analysis.attractors_trace import period_of, state_at
from nonsmooth.analysis.settled import ROUNDED
from nonsmooth.flow.engine import Chain, Engine, FloatArray, SectionPlan
from nonsmooth.kernels import codes

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["BESIDE", "exponent_of", "parting_sizes"]

BESIDE = 1e-6  # where a neighbour begins, in units of the motion's size
USUAL = 1.5  # powers of ten: a motion this near to its scale is taken to have that size
SLENDER = 1e-6  # a state whose motion is smaller than this, beside the largest of the others, is at rest
RESTING = 1e-9  # in units of the scales: a motion that has come to rest in all states
AT_REST = 1e-3


def parting_sizes(maximum: FloatArray, minimum: FloatArray, scale: FloatArray) -> FloatArray:
    """Sizes (J, n) by which neighbours of J motions are told apart: those of the motions, in powers of ten.

    The states' ``scale`` will not do: neighbours of a motion in micrometres would be as far apart as it is wide, and
    those of a motion in pascals equal within rounding. Extremes that are not known (NaN) give the scale.
    """
    half = np.nan_to_num(0.5 * (maximum - minimum)) / scale
    value = np.nan_to_num(np.maximum(np.abs(maximum), np.abs(minimum))) / scale
    widest = half.max(axis=1, keepdims=True, initial=0.0)
    size = np.maximum(half, SLENDER * widest)
    size = np.maximum(np.where(widest < RESTING, AT_REST, size), ROUNDED * value)
    power = np.log10(size)
    power = np.where((np.abs(power) < USUAL) | np.isnan(maximum).all(axis=1, keepdims=True), 0.0, np.rint(power))
    return np.asarray(scale * 10.0**power)


def exponent_of(
    system: System, engine: Engine, plan: SectionPlan, point: FloatArray, start: FloatArray, mode: int, n_returns: int,
    scale: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Exponent per unit time of a run that begins on the section, and its standard error; NaN where a run failed.

    The neighbour is put back to a small distance, in units of ``scale`` (n,), after each of ``n_returns`` returns; the
    error is that of the mean of ten batches, and a quarter of one before them is left out. A forced system is looked at
    once per period, whatever the section: neighbours must be compared at equal phase. On a Poincare section of an
    autonomous system the result is the largest exponent beside the zero along the flow.
    """
    tables, traced = engine.prepare(point), system.traced
    period = period_of(tables)
    state = state_at(system, start, mode, plan.phase * period if plan.indicator < 0 else 0.0, period)
    quiet = replace(plan, extremes=False, every=1)  # a neighbour's count of returns may be one off
    if period < np.inf and plan.indicator >= 0:
        quiet = SectionPlan(phase=float(state.clock[0] / period % 1.0), extremes=False)
    out = Chain.empty(1, 1, len(traced.u), len(traced.indicators), len(traced.outputs))
    offset = np.full(len(state.u), BESIDE) * scale
    first = float(np.linalg.norm(offset / scale))
    batch = n_returns // 10
    logs, times = [], []
    for _ in range(batch // 4 + 10 * batch):
        other = state.copy()
        other.u += offset
        other.settled = False
        taken = []
        for one in (state, other):
            engine.chain(tables, 0, 1, one, None, quiet, 0, 1, out)
            taken.append(float(out.elapsed[0]))
            if taken[-1] < 0.5 * taken[0]:  # the neighbour was just before the surface: that was no return
                engine.chain(tables, 0, 1, one, None, quiet, 0, 1, out)
            if out.status[0] not in (codes.OK, codes.NOT_GUARANTEED):
                return np.nan, np.nan
        times.append(taken[0])
        offset = other.u - state.u
        apart = float(np.linalg.norm(offset / scale))
        if apart > 0.0:
            offset *= first / apart
        else:
            apart, offset = 1e-16 * first, np.full(len(state.u), BESIDE) * scale
        logs.append(np.log(apart / first))
    grown = np.array(logs[batch // 4 :]).reshape(10, batch).sum(axis=1)
    rates = grown / np.array(times[batch // 4 :]).reshape(10, batch).sum(axis=1)
    return float(rates.mean()), float(rates.std() / 3.0)
