"""The engine of the series methods: generated Taylor series, Runge-Kutta-Fehlberg 4(5), and the exact flow for any n.

It packs a system into the arrays of ``kernels.series_run`` and unpacks what comes back; no numerics of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import ceil, log
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engine import Chain, FloatArray, Log, SectionPlan, State
from nonsmooth.flow.series_tables import Scratch, Tables, exact_steps, pack_net, periods
from nonsmooth.kernels import codes
from nonsmooth.kernels import series_places as at

if TYPE_CHECKING:
    from nonsmooth.system.generate import CompiledModel
    from nonsmooth.system.traced import Traced

__all__ = ["SeriesEngine", "order_for"]

DIVERGENCE = 1e9  # in units of a state's scale
EXACT_ORDER = 22
METHODS = {"taylor": at.TAYLOR, "rkf45": at.RKF45, "exact": at.EXACT}


def order_for(rtol: float) -> int:
    """Order of the Taylor series for a tolerance, p = ceil(1 - ln(rtol) / 2) (Jorba and Zou 2005), 4 to 22."""
    return min(max(ceil(1.0 - 0.5 * log(rtol)), 4), 22)


@dataclass
class SeriesEngine:
    """``Engine`` over ``kernels.series_run`` for one system, method and tolerance.

    Parameters
    ----------
    traced : Traced
        The system.
    scale : array (n,)
        Size of each state; ``atol`` defaults to ``rtol * scale``.
    name : str
        ``"taylor"``, ``"rkf45"``, or ``"exact"``: Taylor series of the matrix exponential, of order 22 and with
        steps so short that the remainder is below rounding, for systems whose modes are all linear.
    rtol : float
        Relative tolerance per step, 1e-15 to 1e-2 (not used by ``"exact"``).
    atol : array (n,), optional
        Absolute tolerance per state.
    step : float, optional
        A fixed step. ``"rkf45"`` then has order 4 (no local extrapolation).
    order : int, optional
        Order of the Taylor series, 2 to 30; else from ``rtol``.
    locate : bool
        False judges transitions at the ends of steps only: for showing what that costs.
    """

    traced: Traced
    scale: FloatArray
    name: str = "taylor"
    rtol: float = 1e-9
    atol: FloatArray | None = None
    step: float | None = None
    order: int | None = None
    locate: bool = True
    net: tuple[Any, ...] = field(init=False)

    def __post_init__(self) -> None:
        if self.name not in METHODS:
            raise ValueError(f"method {self.name!r} is not a series method; allowed: {', '.join(METHODS)}")
        if not 1e-15 <= self.rtol <= 1e-2:
            raise ValueError(f"rtol = {self.rtol} is outside 1e-15 ... 1e-2")
        if self.step is not None and not (0.0 < self.step < np.inf):
            raise ValueError(f"step = {self.step}: a fixed step is a positive time")
        if self.order is not None and not 2 <= self.order <= 30:
            raise ValueError(f"order = {self.order} is outside 2 ... 30")
        self.scale = np.array(self.scale, dtype=float)
        self.net = pack_net(self.traced)

    @cached_property
    def model(self) -> CompiledModel:
        """The generated functions of the system."""
        from nonsmooth.system.generate import compile_model

        return compile_model(self.traced)

    def prepare(self, points: FloatArray) -> Tables:
        """Periods, and for ``"exact"`` the length of a step in each mode, at the parameter points (P, n_parameters)."""
        points = np.ascontiguousarray(points, dtype=float)
        n_modes = len(self.traced.mode_names)
        steps, smooth = np.zeros((len(points), n_modes)), False
        if self.name == "exact":
            steps, smooth = exact_steps(self.traced, points, EXACT_ORDER)
        return Tables(points, periods(self.traced, points), steps, smooth)

    def chain(
        self, tables: Tables, first: int, last: int, state: State, starts: FloatArray | None,
        plan: SectionPlan, transient: int, keep: int, out: Chain,
    ) -> None:  # fmt: skip
        """See :class:`nonsmooth.flow.engine.Engine`."""
        traced = self.traced
        n, rows = len(traced.u), len(traced.u) + len(traced.indicators) + len(traced.outputs)
        choice = self._choice(tables)
        choice[[at.TRANSIENT, at.KEEP, at.SECTION, at.RISING]] = transient, keep, plan.indicator, plan.rising
        choice[[at.SECTION_MODE, at.AFTER, at.EVERY]] = plan.mode, plan.after, plan.every
        control = self._control(plan.phase, plan.t_max, -1.0)
        tally, memo = np.zeros(at.N_TALLY, dtype=np.int64), np.zeros(at.N_MEMO)
        tally[at.SETTLED] = state.settled
        begin = np.zeros((0, n)) if starts is None else np.ascontiguousarray(starts, dtype=float)
        carried = state if starts is None else state.copy()
        q = np.concatenate([tables.points[first], carried.memory])
        self._run(
            tables, choice, control, begin, first, last, carried, q, self._scratch(),
            (np.zeros((keep, n + 2)), np.zeros((2, rows)), tally, memo),
            (
                out.section, out.maximum, out.minimum, out.indicator_max, out.indicator_min, out.output_max,
                out.output_min, out.crossings, out.contacts, out.elapsed, out.section_time, out.section_mode,
                out.status,
            ),
            (np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0))),
        )  # fmt: skip
        if starts is None:
            state.memory[:] = q[len(traced.p) :]
            state.settled = True

    def record(self, tables: Tables, state: State, until: float, samples: FloatArray) -> Log:
        """See :class:`nonsmooth.flow.engine.Engine`."""
        traced = self.traced
        n, n_memory, n_p = len(traced.u), len(traced.m), len(traced.p)
        rows = n + len(traced.indicators) + len(traced.outputs)
        samples = np.ascontiguousarray(samples, dtype=float)
        choice, control = self._choice(tables), self._control(-1.0, np.inf, until)
        choice[at.RECORD], choice[at.SECTION] = 1, -1
        control[at.PHASE] = -1.0
        tally, memo = np.zeros(at.N_TALLY, dtype=np.int64), np.zeros(at.N_MEMO)
        tally[at.SETTLED] = state.settled
        q = np.concatenate([tables.points[0], state.memory])
        sampled = np.full((len(samples), n + n_memory + 2), np.nan)
        crossings, touched = np.zeros((256, 2 + 2 * n + n_memory)), np.zeros((1024, 3 + n))
        scratch, seen, result = self._scratch(), (np.zeros((0, n + 2)), np.zeros((2, rows)), tally, memo), _nothing()
        while True:
            status = self._run(
                tables, choice, control, np.zeros((0, n)), 0, 1, state, q, scratch, seen, result,
                (samples, sampled, crossings, touched),
            )  # fmt: skip
            if status != codes.LOG_FULL:
                break
            crossings = np.concatenate([crossings, np.zeros_like(crossings)])
            touched = np.concatenate([touched, np.zeros_like(touched)])
        state.memory[:] = q[n_p:]
        state.settled = True
        return self._log(sampled, crossings[: tally[at.CROSSINGS]], touched[: tally[at.TOUCHES]], int(status))

    def _log(self, sampled: FloatArray, crossings: FloatArray, touched: FloatArray, status: int) -> Log:
        """Columns of the kernel's logs by name; a state that a mode lacks is NaN."""
        traced, n = self.traced, len(self.traced.u)
        lacking = np.array(traced.lacking, dtype=bool)
        known = ~np.isnan(sampled[:, -2])
        mode = np.where(known, sampled[:, -2], -1).astype(np.int64)
        segment = np.where(known, sampled[:, -1], 0).astype(np.int64)
        u = sampled[:, :n].copy()
        transition = crossings[:, 1].astype(np.int64)
        before, after = crossings[:, 2 : 2 + n].copy(), crossings[:, 2 + n : 2 + 2 * n].copy()
        if lacking.any():
            u[lacking[mode] & known[:, None]] = np.nan
            before[lacking[[t.source for t in traced.transitions]][transition]] = np.nan
            after[lacking[[t.target for t in traced.transitions]][transition]] = np.nan
        return Log(
            u, sampled[:, n:-2].copy(), mode, segment,
            crossings[:, 0].copy(), transition, before, after, crossings[:, 2 + 2 * n :].copy(),
            touched[:, 0].copy(), touched[:, 1].astype(np.int64), touched[:, 3:].copy(), touched[:, 2].copy(), status,
        )  # fmt: skip

    def _choice(self, tables: Tables) -> np.ndarray:
        traced, model = self.traced, self.model
        choice = np.zeros(at.N_CHOICE, dtype=np.int64)
        choice[at.METHOD] = METHODS[self.name]
        choice[at.ORDER] = self._order()
        choice[at.LOCATE] = self.locate
        choice[at.EVERY] = 1
        choice[[at.N_PARAMETERS, at.N_INDICATORS, at.N_OUTPUTS]] = (
            len(traced.p), len(traced.indicators), len(traced.outputs),
        )  # fmt: skip
        choice[at.CORNERS] = not all(model.smooth_outputs)
        choice[at.SMOOTH_INDICATORS] = tables.nonlinear_rows
        return choice

    def _order(self) -> int:
        if self.name == "exact":
            return EXACT_ORDER
        return order_for(self.rtol) if self.order is None else self.order

    def _control(self, phase: float, t_max: float, until: float) -> FloatArray:
        control = np.zeros(at.N_CONTROL)
        control[at.RTOL], control[at.STEP] = self.rtol, 0.0 if self.step is None else self.step
        control[[at.PERIOD, at.PHASE, at.T_MAX, at.UNTIL]] = np.inf, phase, t_max, until
        return control

    def _scratch(self) -> Scratch:
        traced = self.traced
        rows = len(traced.u) + len(traced.indicators) + len(traced.outputs)
        sizes = (len(traced.u), len(traced.indicators), rows, len(traced.mode_names), len(self.net[3]))
        return Scratch.of(*sizes, len(traced.p) + len(traced.m), self._order(), self.model.n_scratch)

    def _run(
        self, tables: Tables, choice: Any, control: Any, starts: Any, first: int, last: int, state: State, q: Any,
        scratch: Scratch, seen: Any, result: Any, log: Any,
    ) -> int:  # fmt: skip
        from nonsmooth.kernels.series_run import run

        model = self.model
        absolute = self.rtol * self.scale if self.atol is None else np.array(self.atol, dtype=float)
        norms = (absolute / self.rtol, absolute, DIVERGENCE * self.scale)
        lacking = np.array(self.traced.lacking, dtype=np.int64).reshape(len(self.traced.mode_names), -1)
        smooth = np.array(model.smooth_outputs, dtype=np.int64)
        status: int = run(
            model.field, model.jet, model.values, model.jump, self.net, lacking, smooth, choice, control, norms,
            tables.points, tables.periods, tables.steps, starts, first, last,
            state.u, q, state.clock, state.counters, scratch.arrays, *seen, result, log,
            (state.u.copy(), q.copy(), state.clock.copy(), state.counters.copy()),
        )  # fmt: skip
        return status


def _nothing() -> tuple[Any, ...]:
    """Empty arrays in the places of a chain's results."""
    empty, integers = np.zeros((0, 0)), np.zeros(0, dtype=np.int64)
    return (
        np.zeros((0, 0, 0)), empty, empty, empty, empty, empty, empty, integers, integers, np.zeros(0), empty,
        np.zeros((0, 0), dtype=np.int64), integers,
    )  # fmt: skip
