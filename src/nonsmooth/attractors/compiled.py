"""Jobs of linear systems with the exact flow and a stroboscopic section, in one compiled call."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.attractors.settled import Settled
from nonsmooth.flow.engines.engine import Chain, FloatArray, IntArray
from nonsmooth.flow.engines.linear import LinearEngine, Tables
from nonsmooth.flow.engines.loop import DIVERGENCE
from nonsmooth.kernels.hybrid.places import PATIENCE
from nonsmooth.kernels.hybrid.stopping import flag

if TYPE_CHECKING:
    from nonsmooth.kernels.judging.settle import Rules

__all__ = ["exponents_compiled", "load", "run_compiled"]


def load(engine: LinearEngine) -> Any:
    """The compiled module of an engine's numbers of states and harmonics."""
    from nonsmooth.kernels.linear.module import settle_module

    return settle_module(len(engine.scale), len(engine.form.multiples))


def run_compiled(
    engine: LinearEngine, points: FloatArray, rows: IntArray, starts: FloatArray, modes: IntArray, begin: float,
    phase: float, carried: bool, extremes: bool, rules: Rules,
) -> Settled:  # fmt: skip
    """Jobs settled and judged, as :meth:`nonsmooth.attractors.settler.Settler.run` describes."""
    from nonsmooth.kernels.judging.settle import new_jobs

    tables, n = engine.prepare(points), len(engine.scale)
    jobs, found = new_jobs(len(rows), n, rules.max_period), Settled.empty(len(rows), n)
    load(engine).settle_many(
        (rows, starts, np.full(len(rows), begin), modes), int(carried), int(extremes), rules, jobs,
        _flow(engine, tables, phase), (_plan(True), _plan(False)),
        tuple(_buffers(engine, tables, keep) for keep in (rules.keep, rules.max_period)), (_motion(n), _motion(n)),
        (np.zeros((n + 1, n)), np.zeros((2, n, n))),
        (found.crossings, found.contacts, found.maximum, found.minimum, found.last, found.mode),
    )  # fmt: skip
    return found.judged(jobs)


def exponents_compiled(
    engine: LinearEngine, points: FloatArray, rows: IntArray, starts: FloatArray, modes: IntArray, returns: int,
    batch: int, phase: float, size: FloatArray, offsets: FloatArray, sums: FloatArray,
) -> IntArray:  # fmt: skip
    """Growth of neighbours of jobs, taken into their sums (``kernels.judging.exponent``); their statuses."""
    tables, n, status = engine.prepare(points), len(engine.scale), np.zeros(len(rows), dtype=np.int64)
    load(engine).separate_many(
        (rows, starts, np.full(len(rows), phase), modes), returns, batch, size, _flow(engine, tables, phase),
        _plan(False), _buffers(engine, tables, 1), (_motion(n), _motion(n)), offsets, sums, status,
    )  # fmt: skip
    return status


def _flow(engine: LinearEngine, tables: Tables, phase: float) -> Any:
    from nonsmooth.kernels.hybrid.records import Flow

    none = np.zeros((0, len(engine.scale)))
    form, own, work = engine.given(tables, "sections")
    return Flow(form, engine.net, phase, np.inf, DIVERGENCE * engine.scale, own, work, none, PATIENCE, flag())


def _plan(extremes: bool) -> IntArray:
    return np.array([-1, 1, -1, 1, 1, extremes], dtype=np.int64)


def _motion(n: int) -> Any:
    from nonsmooth.kernels.hybrid.records import Motion

    return Motion(np.zeros(n), np.zeros(0), np.zeros(3), np.zeros(4, dtype=np.int64))


def _buffers(engine: LinearEngine, tables: Tables, keep: int) -> Any:
    sizes = len(engine.scale), len(engine.traced.indicators), tables.sizes[2]
    return Chain.empty(len(tables.points), keep, *sizes).record()
