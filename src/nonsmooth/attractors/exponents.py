"""Largest Lyapunov exponents of runs by two neighbours, with engines whose jobs run one by one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.attractors.settled import ROUNDED
from nonsmooth.attractors.trace import period_of, state_at
from nonsmooth.flow.engines.engine import Chain, Engine, FloatArray, IntArray, SectionPlan
from nonsmooth.kernels.hybrid import codes

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["rates", "separate_one_by_one", "separation_sizes"]

USUAL = 1.5  # powers of ten: a motion this near to its scale is taken to have that size
SLENDER = 1e-6  # a state whose motion is smaller than this, beside the largest of the others, is at rest
RESTING = 1e-9  # in units of the scales: a motion that has come to rest in all states
AT_REST = 1e-3


def separation_sizes(maximum: FloatArray, minimum: FloatArray, scale: FloatArray) -> FloatArray:
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


def rates(sums: FloatArray, status: IntArray) -> tuple[FloatArray, FloatArray]:
    """Exponents per unit time and their standard errors (J,) from the sums of J jobs; NaN where a run failed."""
    from nonsmooth.kernels.judging.exponent import BATCHES, MEAN_RATE, SQUARED_RATES

    good = np.isin(status, (codes.OK, codes.NOT_GUARANTEED))
    error = np.sqrt(sums[:, SQUARED_RATES] / (BATCHES * (BATCHES - 1)))
    return np.where(good, sums[:, MEAN_RATE], np.nan), np.where(good, error, np.nan)


def separate_one_by_one(
    system: System, engine: Engine, plan: SectionPlan, points: FloatArray, rows: IntArray, starts: FloatArray,
    modes: IntArray, returns: int, batch: int, size: FloatArray, offsets: FloatArray, sums: FloatArray,
) -> IntArray:  # fmt: skip
    """Growth of neighbours of jobs, taken into their sums (``kernels.judging.exponent``); their statuses.

    A forced system is looked at once per period, whatever the section: neighbours must be compared at equal phase. On a
    Poincare section of an autonomous system the result is the largest exponent beside the zero along the flow.
    """
    from nonsmooth.kernels.judging.exponent import separate

    status, traced = np.zeros(len(rows), dtype=np.int64), system.traced
    for j, i in enumerate(rows):
        tables = engine.prepare(points[i : i + 1])
        period = period_of(tables)
        state = state_at(system, starts[j], int(modes[j]), plan.phase * period if plan.indicator < 0 else 0.0, period)
        quiet = replace(plan, extremes=False, every=1)  # a neighbour's count of returns may be one off
        if period < np.inf and plan.indicator >= 0:
            quiet = SectionPlan(phase=float(state.clock[0] / period % 1.0), extremes=False)
        out = Chain.empty(1, 1, len(traced.u), len(traced.indicators), len(traced.outputs))
        for n in range(returns):
            other, elapsed = state.copy(), 0.0
            other.u += offsets[j]
            other.settled = False
            for one in (state, other):
                engine.chain(tables, 0, 1, one, None, quiet, 0, 1, out)
                elapsed = elapsed or float(out.elapsed[0])
                if out.elapsed[0] < 0.5 * elapsed:  # the neighbour was just before the surface: that was no return
                    engine.chain(tables, 0, 1, one, None, quiet, 0, 1, out)
                status[j] = out.status[0]
                if status[j] not in (codes.OK, codes.NOT_GUARANTEED):
                    break
            else:
                separate(n, batch, elapsed, state.u, other.u, size, offsets[j], sums[j])
                continue
            break
    return status
