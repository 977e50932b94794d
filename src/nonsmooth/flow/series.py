"""The engine of the series methods: generated Taylor series, Runge-Kutta-Fehlberg 4(5), and the exact flow for any n.

It packs a system into the arrays of ``kernels.series`` and unpacks what comes back; no numerics of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import ceil, log
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engine import Chain, FloatArray, Log, SectionPlan, State
from nonsmooth.flow.layers import Layers, layers
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


def order_for(rtol: float, fixed_step: bool = False) -> int:
    """Order of the Taylor series for a tolerance: p = ceil(1 - ln(rtol) / 2) (Jorba and Zou 2005), and 3 more; 4 to 22.

    That optimum counts the cost of the series alone. A step also has its crossings to exclude, at a cost that hardly
    grows with p, so that longer steps of a higher order are cheaper. With a fixed step it is the bare optimum.
    """
    return min(max(ceil(1.0 - 0.5 * log(rtol)), 4) + (0 if fixed_step else 3), 22)


@dataclass
class SeriesEngine:
    """``Engine`` over ``kernels.series`` for one system, method and tolerance.

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
    def lacking(self) -> Any:
        return np.array(self.traced.lacking, dtype=np.int64).reshape(len(self.traced.mode_names), -1)

    @cached_property
    def repeats(self) -> dict[int, int]:
        """Rows (indicators, outputs) that are a state and nothing else: row -> state. Their extremes are its."""
        traced = self.traced
        outputs = [row[0] if len(set(row)) == 1 else None for row in traced.outputs]
        found = {}
        for row, expression in enumerate([*traced.indicators, *outputs], start=len(traced.u)):
            if expression in traced.u:
                state = traced.u.index(expression)
                if not self.lacking[:, state].any():
                    found[row] = state
        return found

    @cached_property
    def kinds(self) -> Any:
        """Per row of the jets: 1 it has a polynomial, 0 an output with a corner, -1 it repeats a state."""
        traced = self.traced
        kinds = np.ones(len(traced.u) + len(traced.indicators) + len(traced.outputs), dtype=np.int64)
        kinds[len(traced.u) + len(traced.indicators) :] = self.smooth_outputs
        kinds[list(self.repeats)] = -1
        return kinds

    @cached_property
    def norms(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Per state: atol / rtol, atol, and the size beyond which it has diverged."""
        absolute = self.rtol * self.scale if self.atol is None else np.array(self.atol, dtype=float)
        return absolute / self.rtol, absolute, DIVERGENCE * self.scale

    @cached_property
    def model(self) -> CompiledModel:
        """The generated functions of the system."""
        from nonsmooth.system.generate import compile_model

        return compile_model(self.layers.model)

    @cached_property
    def layers(self) -> Layers:
        """What a step has to be checked for: only Taylor steps whose length follows from the tolerance."""
        if self.name == "taylor" and self.step is None:
            return layers(self.traced)
        return Layers(self.traced, 0, False)

    @property
    def smooth_outputs(self) -> tuple[bool, ...]:
        """Per output of the system: whether it has a series."""
        return self.model.smooth_outputs[: len(self.traced.outputs)]

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
        n, n_p, n_i = len(traced.u), len(traced.p), len(traced.indicators)
        choice = self.choice(tables)
        choice[[at.TRANSIENT, at.KEEP, at.SECTION, at.RISING]] = transient, keep, plan.indicator, plan.rising
        choice[[at.SECTION_MODE, at.AFTER, at.EVERY]] = plan.mode, plan.after, plan.every
        control = self._control(-1.0, plan.t_max, -1.0)
        tally, memo = np.zeros(at.N_TALLY, dtype=np.int64), np.zeros(at.N_MEMO + len(self.traced.u))
        sections, extremes = np.zeros((keep, n + 2)), np.zeros((2, n + n_i + len(traced.outputs)))
        scratch, log = self._scratch(), _no_log()
        carried = state if starts is None else State(np.zeros(n), np.zeros(len(traced.m)))
        good = carried.copy()
        q = np.concatenate([tables.points[first], carried.memory])
        settled = state.settled and starts is None
        for i in range(first, last):
            if starts is not None:
                carried.counters[:2], carried.clock[:] = (0, -1), 0.0
                carried.u[:], q[n_p:] = starts[i], 0.0
            q[:n_p] = tables.points[i]
            control[at.PERIOD] = tables.periods[i]
            carried.keep_phase(float(tables.periods[i]), plan.phase if plan.indicator < 0 else -1.0)
            if plan.indicator < 0:
                control[at.PHASE] = plan.phase * tables.periods[i]
            tally[:], memo[:] = 0, 0.0
            tally[at.SETTLED] = settled and i == first
            status = self._march(tables, i, choice, control, carried, q, scratch, sections, extremes, tally, memo, log)
            out.status[i] = status
            if status in (codes.OK, codes.NOT_GUARANTEED):
                for row, original in self.repeats.items():
                    extremes[:, row] = extremes[:, original]
                out.section[i], out.section_time[i], out.section_mode[i] = sections[:, :n], *sections[:, n:].T
                for high, low, part in (
                    (out.maximum, out.minimum, slice(0, n)),
                    (out.indicator_max, out.indicator_min, slice(n, n + n_i)),
                    (out.output_max, out.output_min, slice(n + n_i, None)),
                ):
                    high[i], low[i] = extremes[0, part], extremes[1, part]
                out.crossings[i], out.contacts[i] = tally[at.KEPT_CROSSINGS], tally[at.KEPT_CONTACTS]
                out.elapsed[i] = memo[at.ELAPSED]
                carried.memory[:] = q[n_p:]
                good = carried.copy()
            elif starts is None:
                carried.u[:], carried.memory[:], q[n_p:] = good.u, good.memory, good.memory
                carried.clock[:], carried.counters[:] = good.clock, good.counters
        if starts is None:
            state.settled = True

    def record(self, tables: Tables, state: State, until: float, samples: FloatArray) -> Log:
        """See :class:`nonsmooth.flow.engine.Engine`."""
        traced = self.traced
        n, n_memory, n_p = len(traced.u), len(traced.m), len(traced.p)
        rows = n + len(traced.indicators) + len(traced.outputs)
        samples = np.ascontiguousarray(samples, dtype=float)
        choice, control = self.choice(tables), self._control(-1.0, np.inf, until)
        choice[at.RECORD], choice[at.SECTION] = 1, -1
        control[at.PERIOD] = tables.periods[0]
        tally, memo = np.zeros(at.N_TALLY, dtype=np.int64), np.zeros(at.N_MEMO + len(self.traced.u))
        tally[at.SETTLED] = state.settled
        q = np.concatenate([tables.points[0], state.memory])
        sampled = np.full((len(samples), n + n_memory + 2), np.nan)
        crossings, touched = np.zeros((256, 2 + 2 * n + n_memory)), np.zeros((1024, 3 + n))
        scratch, sections, extremes = self._scratch(), np.zeros((0, n + 2)), np.zeros((2, rows))
        while True:
            status = self._march(
                tables, 0, choice, control, state, q, scratch, sections, extremes, tally, memo,
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

    def choice(self, tables: Tables) -> np.ndarray:
        """What is asked of the kernel, at the places of ``series_places``; the section and the counts are left open."""
        traced = self.traced
        choice = np.zeros(at.N_CHOICE, dtype=np.int64)
        choice[at.METHOD] = METHODS[self.name]
        choice[at.ORDER] = self._order()
        choice[at.LOCATE] = self.locate
        choice[at.EVERY], choice[at.PAUSE] = 1, at.NEVER
        choice[[at.N_PARAMETERS, at.N_INDICATORS, at.N_OUTPUTS]] = (
            len(traced.p), len(traced.indicators), len(traced.outputs),
        )  # fmt: skip
        choice[at.CORNERS] = not all(self.smooth_outputs)
        choice[at.NONLINEAR_ROWS] = tables.nonlinear_rows
        choice[[at.CHECKED, at.N_GUARDS]] = self.layers.checked, self.layers.count
        return choice

    def _order(self) -> int:
        if self.name == "exact":
            return EXACT_ORDER
        return order_for(self.rtol, self.step is not None) if self.order is None else self.order

    def _control(self, phase: float, t_max: float, until: float) -> FloatArray:
        control = np.zeros(at.N_CONTROL)
        control[at.RTOL], control[at.STEP] = self.rtol, 0.0 if self.step is None else self.step
        control[[at.PERIOD, at.PHASE, at.T_MAX, at.UNTIL]] = np.inf, phase, t_max, until
        return control

    def _scratch(self) -> Scratch:
        traced = self.traced
        rows = len(traced.u) + len(traced.indicators) + len(traced.outputs) + self.layers.count
        sizes = (len(traced.u), len(traced.indicators), rows, len(traced.mode_names), len(self.net[3]))
        return Scratch.of(*sizes, len(traced.p) + len(traced.m), self._order(), self.model.n_scratch)

    def _march(
        self, tables: Tables, i: int, choice: Any, control: Any, state: State, q: Any, scratch: Scratch,
        sections: Any, extremes: Any, tally: Any, memo: Any, log: Any,
    ) -> int:  # fmt: skip
        from nonsmooth.kernels.series import march

        model = self.model
        status: int = march(
            model.field, model.jet, model.values, model.jump, self.net, self.lacking, self.kinds, choice, control,
            self.norms, tables.steps[i], state.u, q, state.clock, state.counters, scratch.arrays, sections, extremes,
            tally, memo, log,
        )  # fmt: skip
        return status


def _no_log() -> tuple[FloatArray, ...]:
    return np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0))
