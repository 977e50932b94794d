"""All that the series kernels need to know of a system: its transition table, periods, exact steps and scratch."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import factorial
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced

__all__ = ["Tables", "exact_steps", "periods", "work_of"]


@dataclass(frozen=True)
class Tables:
    """Result of ``prepare`` for P points; read only, shared by threads."""

    points: FloatArray  # (P, n_parameters)
    period: FloatArray  # (P,), inf where autonomous
    steps: FloatArray  # (P, n_modes): length of an exact step
    nonlinear_rows: bool  # indicators whose series must be watched on an exact step


def work_of(
    n: int, n_indicators: int, rows: int, n_modes: int, n_rows: int, n_q: int, order: int, n_scratch: int
) -> Any:
    """Working memory of one running kernel (``kernels.records.SeriesWork``)."""
    from nonsmooth.kernels.compile.block import one_block
    from nonsmooth.kernels.hybrid.records import SeriesWork
    from nonsmooth.kernels.series.places import N_SERIES_MEMO, N_SERIES_TALLY
    from nonsmooth.kernels.series.polynomial import stack_size

    width = max(order, 6) + 1
    vector, integers = np.zeros, lambda size: np.zeros(size, dtype=np.int64)
    jets = [np.zeros((size, width)) for size in (rows, n_scratch, rows, rows)]
    return SeriesWork(*one_block(
        *(vector(n) for _ in range(5)), vector(n_q), vector(n_q), *jets, tuple(vector(n) for _ in range(8)),
        vector(width), vector(width), vector(width), vector(rows - n), vector(rows - n), vector(n_indicators),
        vector(n_indicators), integers(n_indicators), integers(n_indicators), integers(n_rows), vector(n_modes),
        vector(n_modes), integers(n_modes), vector(stack_size(width)), integers(2), vector(n),
        integers(N_SERIES_TALLY), vector(N_SERIES_MEMO),
    ))  # fmt: skip


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


def exact_steps(traced: Traced, points: FloatArray, order: int) -> tuple[FloatArray, bool]:
    r"""Lengths (P, n_modes) of steps on which a Taylor series of this order is exact to rounding.

    With the generator's norm beta (the balanced matrix of the mode, the frequencies of the forcing) the remainder
    after the term of order p is below (beta h)^(p+1) / (p+1)! / (1 - beta h / (p+2)) of the state's size; h makes it
    2^-60.

    Returns
    -------
    steps : array (P, n_modes)
    nonlinear : bool
        Whether some indicator is not affine, so that its own series needs watching.

    Raises
    ------
    ValueError
        Some mode is not linear with constant coefficients and harmonic forcing.
    """
    from nonsmooth.system.codegen.linear import linear_form

    form = linear_form(traced)
    if form is None:
        raise ValueError(
            f'{traced.name!r} has no exact flow: some mode is not linear with harmonic forcing; use method="taylor"'
        )
    linear = form.evaluate(points)
    beta = balanced_norm(linear.A)
    if len(form.multiples):
        beta = np.maximum(beta, np.abs(linear.omega)[:, None] * max(form.multiples))
    reach = (2.0**-60 * factorial(order + 1)) ** (1.0 / (order + 1)) * 0.99
    with np.errstate(divide="ignore"):
        return np.ascontiguousarray(reach / beta), not form.affine_indicators


def balanced_norm(matrices: FloatArray) -> FloatArray:
    """An upper bound of the growth rate of the powers of each matrix (..., n, n): the norm after diagonal scaling."""
    size = np.abs(matrices)
    n = size.shape[-1]
    off = size * (1.0 - np.eye(n))
    for _ in range(4):
        for i in range(n):
            row, column = off[..., i, :].sum(-1), off[..., :, i].sum(-1)
            with np.errstate(divide="ignore", invalid="ignore"):
                factor = np.where((row > 0.0) & (column > 0.0), np.sqrt(row / column), 1.0)
            off[..., i, :] /= factor[..., None]
            off[..., :, i] *= factor[..., None]
    diagonal = np.abs(np.diagonal(matrices, axis1=-2, axis2=-1))
    return np.asarray((off.sum(-1) + diagonal).max(-1), dtype=float)
