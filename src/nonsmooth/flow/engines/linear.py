"""The engine of the exact flow: linear modes with harmonic forcing, affine indicators and resets, any number of states.

It only packs a system into the arrays of ``kernels.linear`` and unpacks what comes back. Memory travels there as
states behind the others, that nothing but transitions changes.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray, State
from nonsmooth.flow.engines.loop import LoopEngine, nowhere, pack_net
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.places import BEGUN

if TYPE_CHECKING:
    from nonsmooth.system.codegen.linear import LinearForm
    from nonsmooth.system.symbolic.traced import Traced

__all__ = ["LinearEngine", "PlanarEngine", "is_linear"]

LARGEST = 64e6  # bytes of the tables of all modes


def is_linear(traced: Traced, form: LinearForm | None) -> bool:
    """The fast kernel covers the system: fields, indicators, resets and what is written to memory are all affine."""
    return (
        form is not None
        and table_bytes(len(traced.u) + len(traced.m), len(form.multiples), len(traced.mode_names)) <= LARGEST
        and form.affine_indicators
        and form.affine_resets
    )


def table_bytes(states: int, harmonics: int, modes: int) -> int:
    """Memory of the propagators, which are most of the tables."""
    return 8 * modes * 33 * states * (states + 1 + 2 * harmonics)


@dataclass
class Tables:
    """Arrays of the kernel for P parameter points."""

    points: FloatArray
    form: Any  # ``kernels.records.Form``
    period: FloatArray
    sizes: tuple[int, int, int, int]
    harmonics: int


@dataclass
class LinearEngine(LoopEngine):
    """``Engine`` over ``kernels.linear`` for one system's traced form."""

    traced: Traced
    form: LinearForm
    scale: FloatArray  # (n,)
    name: str = "exact"
    net: Any = field(init=False)  # ``kernels.records.Net``
    _local: threading.local = field(default_factory=threading.local, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        self.net = pack_net(self.traced)

    @property
    def is_plain(self) -> bool:
        """Return whether there is no memory and every mode has every state."""
        return not self.traced.m and not self.lacking.any()

    def prepare(self, points: FloatArray) -> Tables:
        t = self.form.evaluate(points)
        n_points, n_modes = t.b.shape[:2]
        n_i, n_h = t.ia.shape[1], len(self.form.multiples)
        if self.form.affine_outputs:
            outputs = (t.oa, t.ob, t.oc, t.os)
        else:
            shape = (n_points, 0, n_modes)
            waves = np.zeros((*shape, n_h))
            outputs = (np.zeros((*shape, t.A.shape[-1])), np.zeros(shape), waves, waves)
        multiples = np.array(self.form.multiples, dtype=np.int64)
        from nonsmooth.kernels.compile.cache import compiled
        from nonsmooth.kernels.hybrid.records import Form

        lacking = np.hstack([self.lacking, np.ones((n_modes, len(self.traced.m)), dtype=np.int64)])
        form = Form(
            t.A, t.b, t.c, t.s, multiples, t.omega, t.period,
            t.ia, t.ib, t.ic, t.is_, *outputs, t.ra, t.rb, t.rc, t.rs, lacking,
        )  # fmt: skip
        tables = Tables(points, form, form.period, (n_modes, n_i, outputs[0].shape[1], len(self.net.rows)), n_h)
        if n_points > 1:  # threads may share them
            compiled(self.module(tables, "sections").chain)
        return tables

    def module(self, tables: Tables, observer: str) -> ModuleType:
        from nonsmooth.kernels.linear.module import linear_module

        memory = len(self.traced.m)
        return linear_module(len(self.scale) + memory, tables.harmonics, observer, memory)

    def given(self, tables: Tables, observer: str) -> tuple[Any, Any, Any]:
        """The present thread's tables and work; the kernel keeps the tables of the last point in them."""
        local = self._local
        if not hasattr(local, "work"):
            local.work, local.last = self.module(tables, observer).scratch(*tables.sizes), tables
        if local.last is not tables:  # the same place among other points
            local.work[1].built[0], local.last = 0, tables
        return tables.form, *local.work

    def touches_of_a_leg(self) -> int:
        return 64 * len(self.net.rows)

    def grow(self, tables: Tables, i: int, state: State, count: int, unit: float, growth: Any) -> int:
        """Point i: march ``count`` units of time with a frame (``kernels.records.Growth``). Returns a status.

        The periods in the state's clock count from here."""
        form, own, work = self.given(tables, "growth")
        kernel = self.module(tables, "growth").grow
        goal, motion = self._goal(0, count, 0.0, unit), self._motion(state, False)
        work.tally[BEGUN], code = 0, codes.PAUSED
        while code == codes.PAUSED:
            code = kernel(i, form, self.net_of(tables, i), nowhere(), goal, motion, growth, own, work)
        state.settled = True
        return int(code)


class PlanarEngine(LinearEngine):
    """That of two states: its spectrum, its judging of many jobs and its GPU kernels are compiled as well."""
