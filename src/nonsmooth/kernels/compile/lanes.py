"""Many numbers at once: sums of table rows and columns in vector instructions.

Numba does not find these sums by itself: it unrolls such short loops, and switches off the pass of LLVM that would join
what comes out. Here the vector instructions are written down; LLVM splits them to what the processor has. ``plain``
holds the same sums as loops, for a GPU's threads and for runs without compilation. Sums over many states stand in
``long_sums``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from types import SimpleNamespace
from typing import Any

import numba
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, models, register_model

__all__ = [
    "CONTRACT", "FOUR", "LANES", "LONGEST", "WIDEST", "Array", "choose", "load", "plain", "plus", "scaled", "store",
    "sum_columns", "sum_rows", "sum_some_rows", "times",
]  # fmt: skip

LANES = 8
FOUR = 4  # numbers of a vector that is a value in a kernel
WIDEST = 32  # lanes of one sum: what the vector registers hold
LONGEST = 24  # sums of more terms are loops
FEW = 2  # so many columns' entries go one by one: joining them costs more than it gains
CONTRACT = ("contract",)


def _sum_rows(out: Any, row: Any, table: Any, mode: Any, f: Any, w: Any, one: Any, m: Any) -> None:
    """out[row, :] = sum_j table[mode, f, j, :] w[j], with w[one] = 1; the first ``one`` terms come last."""
    for k in range(LANES):
        total = table[mode, f, one, k]
        for j in range(one + 1, m):
            total += table[mode, f, j, k] * w[j]
        for j in range(one - 1, -1, -1):
            total += table[mode, f, j, k] * w[j]
        out[row, k] = total


def _sum_some_rows(out: Any, row: Any, table: Any, mode: Any, f: Any, w: Any, some: Any) -> None:
    """The same where table[mode, f, j, :] is zero but for the some[0] values of j that stand behind that number."""
    for k in range(LANES):
        total = 0.0
        for q in range(1, some[0] + 1):
            total += table[mode, f, some[q], k] * w[some[q]]
        out[row, k] = total


def _sum_columns(out: Any, table: Any, mode: Any, node: Any, w: Any, n: Any, m: Any) -> None:
    """out[:n] = sum_j table[mode, node, j, :] w[j], with w[n] = 1; the states, known last, come last."""
    for r in range(n):
        total = table[mode, node, n, r]
        for j in range(n + 1, m):
            total += table[mode, node, j, r] * w[j]
        for j in range(n - 1, -1, -1):
            total += table[mode, node, j, r] * w[j]
        out[r] = total


def _load(D: Any, place: Any) -> Any:
    """Four numbers of an array from a place in its memory on."""
    return D.reshape(-1)[place : place + FOUR].copy()


def _store(D: Any, place: Any, x: Any) -> None:
    """Four numbers to an array."""
    D.reshape(-1)[place : place + FOUR] = x


def _times(a: Any, x: Any) -> Any:
    """A number times four."""
    return a * x


def _plus(y: Any, a: Any, x: Any) -> Any:
    """y + a x."""
    return y + a * x


plain = SimpleNamespace(sum_rows=_sum_rows, sum_some_rows=_sum_some_rows, sum_columns=_sum_columns)


class Array:
    """Numbers and vectors from and to an array, inside a function under construction."""

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

    def put(self, number: Any, *indices: Any) -> None:
        self.builder.store(number, self._at(*indices))

    def load(self, vector: Any, *indices: Any) -> Any:
        return self.builder.load(self.builder.bitcast(self._at(*indices), vector.as_pointer()), align=8)

    def get(self, vector: Any, *indices: Any) -> Any:
        """A vector, or a number where ``vector`` is None."""
        return self.number(*indices) if vector is None else self.load(vector, *indices)

    def store(self, value: Any, *indices: Any) -> None:
        self.builder.store(value, self.builder.bitcast(self._at(*indices), value.type.as_pointer()), align=8)


def scaled(builder: Any, vector: Any, number: Any) -> Any:
    """A vector times a number."""
    nothing, lane = ir.Constant(vector.type, ir.Undefined), ir.IntType(32)
    one = builder.insert_element(nothing, number, ir.Constant(lane, 0))
    zeros = ir.Constant(ir.VectorType(lane, vector.type.count), [0] * vector.type.count)
    return builder.fmul(vector, builder.shuffle_vector(one, nothing, zeros), flags=CONTRACT)


def _sum(builder: Any, first: Any, terms: Callable[[Any], Any], one: int, m: int) -> Any:
    """``first`` and terms(j) for j behind ``one``, then before it; one by one, or in loops where there are many."""

    def add(total: Any, j: Any) -> Any:
        return builder.fadd(total, terms(j), flags=CONTRACT)

    if m <= LONGEST:
        total = first
        for j in (*range(one + 1, m), *range(one - 1, -1, -1)):
            total = add(total, j)
        return total
    place = cgutils.alloca_once_value(builder, first)
    for begin, end in ((one + 1, m), (0, one)):
        if end > begin:
            whole = ir.IntType(64)
            with cgutils.for_range_slice(
                builder, ir.Constant(whole, begin), ir.Constant(whole, end), ir.Constant(whole, 1), intp=whole
            ) as (j, _):
                builder.store(add(builder.load(place), j), place)
    return builder.load(place)


@intrinsic(prefer_literal=True)
def _sum_rows_in_lanes(
    typing: Any, out: Any, row: Any, table: Any, mode: Any, f: Any, w: Any, one: Any, m: Any
) -> Any:  # fmt: skip
    whole = types.int64
    signature = types.void(out, whole, table, whole, whole, w, one, m)
    vector = ir.VectorType(ir.DoubleType(), LANES)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        out_, row_, table_, mode_, f_, w_ = arguments[:6]
        source, weights = Array(context, builder, table, table_), Array(context, builder, w, w_)
        total = _sum(
            builder, source.load(vector, mode_, f_, one.literal_value, 0),
            lambda j: scaled(builder, source.load(vector, mode_, f_, j, 0), weights.number(j)),
            one.literal_value, m.literal_value,
        )  # fmt: skip
        Array(context, builder, out, out_).store(total, row_, 0)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def _sum_some_rows_in_lanes(typing: Any, out: Any, row: Any, table: Any, mode: Any, f: Any, w: Any, some: Any) -> Any:
    whole = types.int64
    signature = types.void(out, whole, table, whole, whole, w, some)
    vector = ir.VectorType(ir.DoubleType(), LANES)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        out_, row_, table_, mode_, f_, w_, some_ = arguments
        source, weights = Array(context, builder, table, table_), Array(context, builder, w, w_)
        places, index = Array(context, builder, some, some_), ir.IntType(64)
        place = cgutils.alloca_once_value(builder, ir.Constant(vector, [0.0] * LANES))
        begin, end = ir.Constant(index, 1), builder.add(places.number(0), ir.Constant(index, 1))
        with cgutils.for_range_slice(builder, begin, end, begin, intp=index) as (q, _):
            j = places.number(q)
            term = scaled(builder, source.load(vector, mode_, f_, j, 0), weights.number(j))
            builder.store(builder.fadd(builder.load(place), term, flags=CONTRACT), place)
        Array(context, builder, out, out_).store(builder.load(place), row_, 0)
        return context.get_dummy_value()

    return signature, generate


@intrinsic(prefer_literal=True)
def _sum_columns_in_lanes(typing: Any, out: Any, table: Any, mode: Any, node: Any, w: Any, n: Any, m: Any) -> Any:
    whole = types.int64
    signature = types.void(out, table, whole, whole, w, n, m)
    states = n.literal_value

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        out_, table_, mode_, node_, w_ = arguments[:5]
        source, weights = Array(context, builder, table, table_), Array(context, builder, w, w_)
        target = Array(context, builder, out, out_)
        if states <= FEW:

            def product(r: int, j: Any) -> Any:
                return builder.fmul(source.number(mode_, node_, j, r), weights.number(j), flags=CONTRACT)

            totals = [
                _sum(builder, source.number(mode_, node_, states, r), partial(product, r), states, m.literal_value)
                for r in range(states)
            ]
            for r, total in enumerate(totals):
                target.put(total, r)
            return context.get_dummy_value()

        def column(vector: Any, begin: int, j: Any) -> Any:
            return scaled(builder, source.load(vector, mode_, node_, j, begin), weights.number(j))

        parts = []
        begins = list(range(0, max(states - LANES, 1), WIDEST))  # a few that are left go with the last
        for begin, end in zip(begins, [*begins[1:], states], strict=True):
            vector = ir.VectorType(ir.DoubleType(), end - begin)
            first = source.load(vector, mode_, node_, states, begin)
            parts.append((begin, _sum(builder, first, partial(column, vector, begin), states, m.literal_value)))
        for begin, total in parts:
            target.store(total, begin)
        return context.get_dummy_value()

    return signature, generate


class _Four(types.Type):
    """Four numbers in a vector register."""

    def __init__(self) -> None:
        super().__init__(name="Four")


_four, _vector = _Four(), ir.VectorType(ir.DoubleType(), FOUR)


@register_model(_Four)
class _FourModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _vector)


def _at(context: Any, builder: Any, kind: Any, array: Any, place: Any) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [place]), _vector.as_pointer())


@intrinsic
def _load_four(typing: Any, D: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load(_at(context, builder, D, *arguments), align=8)

    return _four(D, types.int64), generate


@intrinsic
def _store_four(typing: Any, D: Any, place: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store(arguments[2], _at(context, builder, D, *arguments[:2]), align=8)
        return context.get_dummy_value()

    return types.void(D, types.int64, x), generate


@intrinsic
def _times_four(typing: Any, a: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return scaled(builder, arguments[1], arguments[0])

    return _four(types.float64, x), generate


@intrinsic
def _plus_four(typing: Any, y: Any, a: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fadd(arguments[0], scaled(builder, arguments[2], arguments[1]), flags=CONTRACT)

    return _four(y, types.float64, x), generate


def choose(compiled: Any, loops: Callable[..., Any]) -> Any:
    """The compiled way, or the loops where nothing is compiled."""
    return loops if numba.config.DISABLE_JIT else compiled


sum_rows = choose(_sum_rows_in_lanes, _sum_rows)
sum_columns = choose(_sum_columns_in_lanes, _sum_columns)
sum_some_rows = choose(_sum_some_rows_in_lanes, _sum_some_rows)
load, store = choose(_load_four, _load), choose(_store_four, _store)
times, plus = choose(_times_four, _times), choose(_plus_four, _plus)
