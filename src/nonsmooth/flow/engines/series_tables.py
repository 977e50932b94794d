"""All that the series kernels need to know of a system: its periods and scratch."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced


@dataclass(frozen=True)
class SeriesPoints:
    """Result of ``prepare`` for P points; read only, shared by threads."""

    points: FloatArray  # (P, n_parameters)
    period: FloatArray  # (P,), inf where autonomous


def work_of(
    n: int, n_indicators: int, rows: int, n_modes: int, n_rows: int, n_p: int, n_m: int, order: int, n_scratch: int
) -> Any:
    """Working memory of one running kernel (``kernels.records.SeriesWork``)."""
    from nonsmooth.kernels.compile.block import one_block
    from nonsmooth.kernels.hybrid.records import SeriesWork
    from nonsmooth.kernels.series.places import N_SERIES_MEMO, N_SERIES_TALLY
    from nonsmooth.kernels.series.polynomial import stack_size

    width = max(order, 6) + 1
    vector, integers = np.zeros, lambda size: np.zeros(size, dtype=np.int64)
    jets = [np.zeros((size, width)) for size in (rows, n_scratch, rows, rows)]
    return SeriesWork(
        *one_block(
            *(vector(size) for size in (n, n, n + n_m, n, n)),
            vector(n_p + n_m),
            vector(n_p + n_m),
            *jets,
            tuple(vector(n) for _ in range(8)),
            vector(width),
            vector(width),
            vector(width),
            vector(rows - n),
            vector(rows - n),
            vector(n_indicators),
            vector(n_indicators),
            integers(n_indicators),
            integers(n_indicators),
            integers(n_rows),
            vector(n_modes),
            vector(n_modes),
            integers(n_modes),
            vector(stack_size(width)),
            integers(2),
            vector(n),
            integers(N_SERIES_TALLY),
            vector(N_SERIES_MEMO),
        )
    )


@lru_cache(maxsize=64)
def _period_function(traced: Traced) -> Any:
    from sympy import lambdify

    return lambdify([list(traced.p)], traced.period, "numpy")


def periods(traced: Traced, points: FloatArray) -> FloatArray:
    """The forcing period at each point (P,); inf for an autonomous system."""
    if traced.period is None:
        return np.full(len(points), np.inf)
    values = _period_function(traced)(list(points.T))
    return np.full(len(points), values, dtype=float)
