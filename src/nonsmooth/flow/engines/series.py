"""The engine of the series methods: generated Taylor series and Runge-Kutta-Fehlberg 4(5), periods and scratch.

It packs a system into the records of ``kernels.series``; no numerics of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import ceil, log
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray, Points
from nonsmooth.flow.engines.layers import Layers, layers
from nonsmooth.flow.engines.loop import DIVERGENCE, Engine, pack_net
from nonsmooth.kernels.hybrid.codes import LENGTH, METHODS
from nonsmooth.system.symbolic.numeric import numeric

if TYPE_CHECKING:
    from nonsmooth.system.codegen.generate import CompiledModel
    from nonsmooth.system.derived.assembly import Pattern
    from nonsmooth.system.derived.instants import Numbers
    from nonsmooth.system.symbolic.traced import Traced


def order_for(rtol: float, fixed_step: bool = False) -> int:
    """Order of the Taylor series for a tolerance: p = ceil(1 - ln(rtol) / 2) (Jorba and Zou 2005), and 3 more; 4 to 22.

    That optimum counts the cost of the series alone. A step also has its crossings to exclude, at a cost that hardly
    grows with p, so that longer steps of a higher order are cheaper. With a fixed step it is the bare optimum.
    """
    return min(max(ceil(1.0 - 0.5 * log(rtol)), 4) + (0 if fixed_step else 3), 22)


@dataclass
class SeriesEngine(Engine):
    """``Engine`` over ``kernels.series`` for one system, method and tolerance.

    Parameters
    ----------
    traced : Traced
        The system.
    scale : array (n,)
        Size of each state; ``atol`` defaults to ``rtol * scale``.
    name : str
        ``"taylor"`` or ``"rkf45"``.
    rtol : float
        Relative tolerance per step, 1e-15 to 1e-2.
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
    net: Any = field(init=False)  # ``kernels.records.Net``

    def __post_init__(self) -> None:
        if self.name not in METHODS:
            raise ValueError(f"method {self.name!r} is not a series method; allowed: {', '.join(METHODS)}")
        self.scale = np.array(self.scale, dtype=float)
        self.net = pack_net(self.traced)

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
        """Per row of the jets: 1 it has a polynomial, 2 one that is zero where it is not asked for, 0 an output with a
        corner, -1 - s it repeats the state s."""
        traced = self.traced
        kinds = np.ones(len(traced.u) + len(traced.indicators) + len(traced.outputs), dtype=np.int64)
        kinds[len(traced.u) :] = 1 if traced.decider is None else 2
        kinds[len(traced.u) + len(traced.indicators) :] = self.smooth_outputs
        for row, state in self.repeats.items():
            kinds[row] = -1 - state
        return kinds

    @cached_property
    def norms(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Per state: atol / rtol, atol, and the size beyond which it has diverged."""
        absolute = self.rtol * self.scale if self.atol is None else np.array(self.atol, dtype=float)
        return absolute / self.rtol, absolute, DIVERGENCE * self.scale

    @cached_property
    def model(self) -> CompiledModel:
        """The generated functions of the system."""
        from nonsmooth.system.codegen.generate import compile_model

        return compile_model(self.layers.model.without_answers()[0])

    @cached_property
    def layers(self) -> Layers:
        """Places that a step has to be checked for: only Taylor steps whose length follows from the tolerance."""
        if self.name == "taylor" and self.step is None:
            return layers(self.traced)
        return Layers(self.traced, 0, False)

    @property
    def is_smooth(self) -> bool:
        """Return whether motion is one Taylor series after the other, of steps that need not be checked."""
        chosen = self.step is not None or self.order is not None
        return self.name == "taylor" and not (chosen or self.traced.transitions or self.layers.checked)

    @property
    def smooth_outputs(self) -> tuple[bool, ...]:
        """Per output of the system: whether it has a series."""
        return self.model.smooth_outputs[: len(self.traced.outputs)]

    def renew(self) -> None:
        for name in ("layers", "model", "functions"):
            self.__dict__.pop(name, None)

    def memory_in(self, work: Any) -> FloatArray:
        return np.asarray(work.q[len(self.traced.p) :])

    def note_zeros(self, mode: int, numbers: Numbers, pattern: Pattern, work: Any) -> None:
        meets = self.net.meets[self.net.meets_start[mode] : self.net.meets_start[mode + 1]]
        for f, (_, one) in zip(meets, numbers.make.meetings(numbers.mode, pattern), strict=True):
            work.measured[f] = -1.0 if numbers.number(one.value) else abs(numbers.value(one.value))

    def step_in(self, mode: int, system: Any) -> float:
        return float(system[3].memo[LENGTH])

    def prepare(self, points: FloatArray) -> Points:
        """Periods at the parameter points (P, n_parameters)."""
        points = np.ascontiguousarray(points, dtype=float)
        return Points(points, periods(self.traced, points))

    def module(self) -> ModuleType:
        from nonsmooth.kernels.compile.assembly import series_module

        return series_module()

    def given(self, tables: Points) -> tuple[Any, Any, Any]:
        local = self._threads
        if getattr(local, "tables", None) is not tables or local.maps != len(self.net.changed):
            local.tables, local.generated, local.maps = tables, self.generated(tables), len(self.net.changed)
        if not hasattr(local, "work"):
            local.work = self._work()
        return local.generated, (), local.work

    def touches_of_a_leg(self) -> int:
        return (len(self.net.rows) + 1) * (self.series_order + 1)

    def generated(self, tables: Points) -> Any:
        """Record that stands for system and method in the kernels (``kernels.records.Generated``)."""
        from nonsmooth.kernels.hybrid.records import Generated

        traced = self.traced
        weight, absolute, _ = self.norms
        return Generated(
            self.functions,
            tables.points,
            tables.period,
            self.lacking,
            self.kinds,
            weight,
            absolute,
            float(self.rtol),
            0.0 if self.step is None else float(self.step),
            METHODS[self.name],
            self.series_order,
            int(self.locate),
            int(self.layers.checked),
            int(not all(self.smooth_outputs)),
            self.layers.count,
            len(traced.indicators),
            len(traced.outputs),
        )

    @cached_property
    def functions(self) -> Any:
        """Addresses of the generated functions; ``model`` keeps them alive."""
        from nonsmooth.kernels.compile.pointers import addresses

        return addresses(self.model.field, self.model.jet, self.model.values, self.model.jump)

    @property
    def series_order(self) -> int:
        """Order of the series."""
        return order_for(self.rtol, self.step is not None) if self.order is None else self.order

    def _work(self) -> Any:
        traced = self.traced
        rows = len(traced.u) + len(traced.indicators) + len(traced.outputs) + self.layers.count
        sizes = (len(traced.u), len(traced.indicators), rows, len(traced.mode_names), len(self.net.rows))
        return work_of(*sizes, len(traced.p), len(traced.m), self.series_order, self.model.n_scratch)


def work_of(
    n: int, n_indicators: int, rows: int, n_modes: int, n_rows: int, n_p: int, n_m: int, order: int, n_scratch: int
) -> Any:
    """Working memory of one running kernel (``kernels.records.SeriesWork``)."""
    from nonsmooth.kernels.compile.pointers import one_block
    from nonsmooth.kernels.hybrid.codes import N_SERIES_MEMO, N_SERIES_TALLY
    from nonsmooth.kernels.hybrid.records import SeriesWork
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


def periods(traced: Traced, points: FloatArray) -> FloatArray:
    """The forcing period at each point (P,); inf for an autonomous system."""
    if traced.period is None:
        return np.full(len(points), np.inf)
    found: FloatArray = numeric(traced, (traced.period,))(points)[:, 0]
    return found
