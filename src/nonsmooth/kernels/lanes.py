"""Eight numbers at once: sums of Taylor rows in vector instructions.

A row of eight doubles is one AVX-512 register or two of AVX. Numba does not find these sums by itself: it unrolls such
short loops, and switches off the pass of LLVM that would join what comes out. Here the vector instructions are written
down; LLVM splits them to what the processor has. ``plain`` holds the same sums as loops, for a GPU's threads and for
runs without compilation.
"""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numba
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

__all__ = ["LANES", "mix_rows", "plain", "sum_rows"]

LANES = 8
_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_CONTRACT = ("contract",)


def _sum_rows(out: Any, row: Any, table: Any, mode: Any, f: Any, w: Any, m: Any) -> None:
    for k in range(LANES):
        total = table[mode, f, 2, k]
        for j in range(3, m):
            total += table[mode, f, j, k] * w[j]
        out[row, k] = total + table[mode, f, 1, k] * w[1] + table[mode, f, 0, k] * w[0]


def _mix_rows(out: Any, row: Any, a: Any, b: Any) -> None:
    for k in range(LANES):
        out[row, k] = a * out[0, k] + b * out[1, k]


plain = SimpleNamespace(sum_rows=_sum_rows, mix_rows=_mix_rows)


class _Rows:
    """Vectors from and to the rows of an array, inside a function under construction."""

    def __init__(self, context: Any, builder: Any, kind: Any, value: Any) -> None:
        self.context, self.builder, self.kind = context, builder, kind
        self.array = context.make_array(kind)(context, builder, value)

    def _at(self, *indices: Any) -> Any:
        full = [i if isinstance(i, ir.Value) else ir.Constant(ir.IntType(64), i) for i in indices]
        return cgutils.get_item_pointer2(
            self.context, self.builder, self.array.data, cgutils.unpack_tuple(self.builder, self.array.shape),
            cgutils.unpack_tuple(self.builder, self.array.strides), self.kind.layout, full, wraparound=False,
        )  # fmt: skip

    def number(self, *indices: Any) -> Any:
        return self.builder.load(self._at(*indices))

    def load(self, *indices: Any) -> Any:
        return self.builder.load(self.builder.bitcast(self._at(*indices, 0), _VECTOR.as_pointer()), align=8)

    def store(self, vector: Any, *indices: Any) -> None:
        self.builder.store(vector, self.builder.bitcast(self._at(*indices, 0), _VECTOR.as_pointer()), align=8)

    def scaled(self, vector: Any, number: Any) -> Any:
        """A vector times a number."""
        nothing, lane = ir.Constant(_VECTOR, ir.Undefined), ir.IntType(32)
        one = self.builder.insert_element(nothing, number, ir.Constant(lane, 0))
        zeros = ir.Constant(ir.VectorType(lane, LANES), [0] * LANES)
        return self.builder.fmul(vector, self.builder.shuffle_vector(one, nothing, zeros), flags=_CONTRACT)


@intrinsic(prefer_literal=True)
def _sum_rows_in_lanes(typing: Any, out: Any, row: Any, table: Any, mode: Any, f: Any, w: Any, m: Any) -> Any:
    whole = types.int64
    signature = types.void(out, whole, table, whole, whole, w, m)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        out_, row_, table_, mode_, f_, w_, _ = arguments
        source, weights = _Rows(context, builder, table, table_), _Rows(context, builder, w, w_)
        total = source.load(mode_, f_, 2)
        for j in (*range(3, m.literal_value), 1, 0):
            total = builder.fadd(total, source.scaled(source.load(mode_, f_, j), weights.number(j)), flags=_CONTRACT)
        _Rows(context, builder, out, out_).store(total, row_)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def _mix_rows_in_lanes(typing: Any, out: Any, row: Any, a: Any, b: Any) -> Any:
    signature = types.void(out, types.int64, types.float64, types.float64)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        out_, row_, a_, b_ = arguments
        rows = _Rows(context, builder, out, out_)
        total = builder.fadd(rows.scaled(rows.load(0), a_), rows.scaled(rows.load(1), b_), flags=_CONTRACT)
        rows.store(total, row_)
        return context.get_dummy_value()

    return signature, generate


def _choose(compiled: Any, loops: Callable[..., None]) -> Any:
    return loops if numba.config.DISABLE_JIT else compiled


sum_rows = _choose(_sum_rows_in_lanes, _sum_rows)
mix_rows = _choose(_mix_rows_in_lanes, _mix_rows)
