"""The engine of the exact flow: linear modes with harmonic forcing, affine indicators and resets; its memory.

It only packs a system into the arrays of ``kernels.linear`` and unpacks what comes back. Memory travels there as
states behind the others, that nothing but transitions changes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray, Points
from nonsmooth.flow.engines.loop import Engine, pack_net
from nonsmooth.kernels.compile.pointers import one_block
from nonsmooth.kernels.hybrid.codes import N_MEMO, N_TALLY
from nonsmooth.kernels.hybrid.records import Tables, Work
from nonsmooth.kernels.linear.bands import BANDED
from nonsmooth.kernels.linear.search import WIDTH
from nonsmooth.kernels.linear.tables import DEGREE, NODES, TERMS

if TYPE_CHECKING:
    from nonsmooth.system.codegen.linear import LinearForm
    from nonsmooth.system.symbolic.traced import Traced


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
    return 8 * modes * (NODES + 1) * states * (states + 1 + 2 * harmonics)


@dataclass
class LinearEngine(Engine):
    """``Engine`` over ``kernels.linear`` for one system's traced form."""

    traced: Traced
    form: LinearForm
    scale: FloatArray  # (n,)
    name: str = "exact"
    net: Any = field(init=False)  # ``kernels.records.Net``

    def __post_init__(self) -> None:
        self.net = pack_net(self.traced)

    def step_in(self, mode: int, system: Any) -> float:
        return float(system[2].info[mode, 0])

    def prepare(self, points: FloatArray) -> Points:
        from nonsmooth.kernels.compile.cache import compiled

        form = self.form.evaluate(points)
        sizes = form.b.shape[1], form.ia.shape[1], form.oa.shape[1], len(self.net.rows)
        if self.is_planar and not len(form.multiples):  # a forcing of no size
            form = _with_harmonic(form)
        if len(points) > 1:  # threads may share them
            compiled(self.module().run)
        return Points(points, form.period, form, sizes)

    @property
    def is_planar(self) -> bool:
        """Return whether it runs by the kernel of two states with one harmonic."""
        return len(self.scale) == 2 and not self.traced.m and len(self.form.multiples) <= 1

    def module(self) -> ModuleType:
        from nonsmooth.kernels.compile.assembly import linear_module

        return linear_module(self.is_planar)

    def given(self, tables: Points) -> tuple[Any, Any, Any]:
        """The present thread's tables and work; the kernel keeps the tables of the last point in them."""
        if tables.form.ra.shape[1] < len(self.net.changed):  # some were found since
            from nonsmooth.system.codegen.linear import linear_form

            self.form = linear_form(self.traced.without_answers()[0]) or self.form
            tables.form = self.prepare(tables.points).form
        local = self._threads
        if not hasattr(local, "work"):
            n, harmonics = tables.form.A.shape[-1], len(tables.form.multiples)
            local.work, local.last = scratch(n, harmonics, *tables.sizes, planar=self.is_planar), tables
        if local.last is not tables:  # the same place among other points
            local.work[1].built[0], local.last = 0, tables
        return tables.form, *local.work

    def touches_of_a_leg(self) -> int:
        return 64 * len(self.net.rows)


def _with_harmonic(form: Any) -> Any:
    """The same form with one harmonic, all of whose coefficients are zero."""
    waves = {}
    for name in ("c", "s", "ic", "is_", "oc", "os", "rc", "rs"):
        shape = list(getattr(form, name).shape)
        shape[2 if name in ("c", "s", "rc", "rs") else -1] = 1
        waves[name] = np.zeros(shape)
    return form._replace(multiples=np.ones(1, dtype=np.int64), **waves)


class PlanarEngine(LinearEngine):
    """That of two states: its spectrum, its judging of many jobs and its GPU kernels are compiled as well."""


LANES = 4  # numbers of a vector: columns of propagators are filled up to whole ones


def scratch(
    states: int,
    harmonics: int,
    n_modes: int,
    n_indicators: int,
    n_outputs: int,
    n_rows: int,
    *,
    planar: bool = False,
    apart: bool = False,
) -> tuple[Tables, Work]:
    """Tables and working memory for one thread, in one block.

    ``planar``: for the kernel of two states with one harmonic. ``apart``: each table by itself, which takes memory only
    where it is written."""
    n, m, n_f = states, states + 1 + 2 * harmonics, n_indicators + states + n_outputs
    filled = n if planar else -(-n // LANES) * LANES

    def whole(*shape: int) -> Any:
        return np.zeros(shape, dtype=np.int64)

    tables = (
        np.zeros((n_modes, NODES + 1, m, filled)),
        np.zeros((n_modes, NODES + 1, 2 * harmonics + 1)),
        np.zeros((n_modes, n_f, 2 * (m + n + 1))),
        np.zeros((n_modes, n_f, m, DEGREE + 1)),
        np.zeros((n_modes, n, m)),
        np.zeros((n_modes, 2 + n)),
        whole(1, 1, 1, 1) if planar else whole(n_modes, n_f, 2, m + 1),
        np.zeros((n_modes, n + m, n) if n >= BANDED else (n_modes, 1, 1)),
        whole(n_modes, n + m if n >= BANDED else 1, 3),
    )
    work = (
        *(np.zeros(m + LANES) for _ in range(8)),
        np.zeros((max(TERMS, n) + 1, m)),
        np.zeros((n_rows + n + 1, WIDTH)),
        np.zeros(4),
        np.zeros(harmonics),
        *map(whole, (n_indicators, 4, n_modes, n_indicators, 2, N_TALLY)),
        np.zeros(N_MEMO),
    )
    if apart:
        return Tables(*tables), Work(*one_block(*work))
    block = one_block(*tables, *work)
    return Tables(*block[: len(tables)]), Work(*block[len(tables) :])
