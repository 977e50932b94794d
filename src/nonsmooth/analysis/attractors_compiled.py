"""Jobs of systems of two states with the exact flow and a stroboscopic section, in one compiled call."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from nonsmooth.analysis.settled import Settled, usable
from nonsmooth.flow.engine import Chain, FloatArray, IntArray
from nonsmooth.flow.linear import PlanarEngine
from nonsmooth.flow.loop import DIVERGENCE
from nonsmooth.flow.poincare import result_status

__all__ = ["exponents_compiled", "load", "run_compiled"]


def load(engine: PlanarEngine) -> Any:
    """The compiled module of an engine's number of harmonics."""
    from nonsmooth.kernels.linear_module import settle_module

    return settle_module(len(engine.form.multiples))


def run_compiled(
    engine: PlanarEngine, points: FloatArray, rows: IntArray, starts: FloatArray, modes: IntArray, begin: float,
    phase: float, choice: tuple[Any, ...], tolerance: float, least: FloatArray,
) -> Settled:  # fmt: skip
    """Jobs settled and judged, as :meth:`nonsmooth.analysis.attractors.Settler.run` describes.

    Parameters
    ----------
    choice : tuple of int
        Transient, keep, max_period, first look (0: none), attempts, carried, extremes.
    tolerance : float
        What counts as a return.
    least : array (2,)
        The least size of a motion.
    """
    tables, traced = engine.prepare(points), engine.traced
    _, keep, max_period, *_ = choice
    sizes = len(traced.u), len(traced.indicators), tables.sizes[2]
    out, probe = (Chain.empty(len(points), k, *sizes).record() for k in (keep, max_period))
    norms = np.concatenate([[tolerance], least, np.zeros(2)])
    plan, quiet = (np.array([-1, 1, -1, 1, 1, extremes], dtype=np.int64) for extremes in (1, 0))
    found = Settled.empty(len(rows), 2)
    load(engine).settle_many(
        rows, starts, np.full(len(rows), begin), modes, np.array(choice, dtype=np.int64), norms, tables.form,
        engine.net, plan, quiet, phase, np.inf, DIVERGENCE * engine.scale, out, probe,
        engine.given(tables, "sections")[1:], _work(max_period),
        tuple(getattr(found, item.name) for item in fields(found)),
    )  # fmt: skip
    failed = ~usable(found.status)
    found.status[failed] = [result_status(code) for code in found.status[failed]]
    found.residual[failed] = np.nan
    found.multiplier[found.multiplier < 0.0] = np.nan
    return found


def exponents_compiled(
    engine: PlanarEngine, points: FloatArray, rows: IntArray, starts: FloatArray, modes: IntArray, n_returns: int,
    phase: float, scale: FloatArray, max_period: int,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Largest exponents of jobs and their standard errors (:meth:`nonsmooth.analysis.attractors.Settler.exponents`)."""
    tables = engine.prepare(points)
    largest, error = np.full(len(rows), np.nan), np.full(len(rows), np.nan)
    out = Chain.empty(len(points), 1, 2, len(engine.traced.indicators), tables.sizes[2]).record()
    quiet = np.array([-1, 1, -1, 1, 1, 0], dtype=np.int64)
    load(engine).exponents_of(
        rows, starts, modes, n_returns, scale, tables.form, engine.net, quiet, phase, np.inf,
        DIVERGENCE * engine.scale, out, engine.given(tables, "sections")[1:], _work(max_period), largest, error,
    )  # fmt: skip
    return largest, error


def _work(max_period: int) -> tuple[Any, ...]:
    """Two states in pieces (u, clock, counters), images of the return map, returns (and three sums)."""
    one, other = ((np.zeros(2), np.zeros(3), np.zeros(4, dtype=np.int64)) for _ in range(2))
    return *one, *other, np.zeros((3, 2)), np.zeros(max(max_period, 3))

