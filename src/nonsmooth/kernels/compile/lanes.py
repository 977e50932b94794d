"""Numbers and vectors of four or eight at an address, inside kernels: for sums that the compiler does not find.

Numba unrolls short loops and switches off the pass of LLVM that would join what comes out. And an array is seven words
of a call: a function that is given addresses costs no more than the two nanoseconds of the call, so that its loops
stand once in the code. Whoever passes addresses keeps the arrays alive. With ``NUMBA_DISABLE_JIT=1`` the same is done
by ctypes.
"""

from __future__ import annotations

from ctypes import c_double, c_int64
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, models, register_model

FOUR = 4  # numbers of a vector that is a value in a kernel
MOST = 8  # vectors of a column that are summed side by side: they keep the processor busy
CONTRACT = ("contract",)
_whole = ir.IntType(64)


class _Four(types.Type):
    """Four numbers in a vector register."""

    def __init__(self) -> None:
        super().__init__(name="Four")


_four, _vector = _Four(), ir.VectorType(ir.DoubleType(), FOUR)


@register_model(_Four)
class _FourModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _vector)


def _pointer(builder: Any, kind: Any, address: Any, place: Any) -> Any:
    """Place ``place`` behind an address, counted in numbers of eight bytes."""
    first = builder.inttoptr(address, ir.DoubleType().as_pointer())
    return builder.bitcast(builder.gep(first, [place]), kind.as_pointer())


def _reader(kind: Any, lowered: Any) -> Any:
    @intrinsic
    def read(typing: Any, address: Any, place: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.load(_pointer(builder, lowered, *arguments), align=8)

        return kind(types.int64, types.int64), generate

    return read


@intrinsic
def _write(typing: Any, address: Any, place: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        vector = arguments[2]
        builder.store(vector, _pointer(builder, vector.type, *arguments[:2]), align=8)
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, x), generate


def _scaled(builder: Any, vector: Any, number: Any) -> Any:
    """A vector times a number."""
    nothing, lane = ir.Constant(vector.type, ir.Undefined), ir.IntType(32)
    one = builder.insert_element(nothing, number, ir.Constant(lane, 0))
    zeros = ir.Constant(ir.VectorType(lane, vector.type.count), [0] * vector.type.count)
    return builder.fmul(vector, builder.shuffle_vector(one, nothing, zeros), flags=CONTRACT)


@intrinsic
def _apart(typing: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.function.attributes.add("noinline")
        return context.get_dummy_value()

    return types.void(), generate


@intrinsic
def _times(typing: Any, a: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _scaled(builder, arguments[1], arguments[0])

    return x(types.float64, x), generate


@intrinsic
def _plus(typing: Any, y: Any, a: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fadd(arguments[0], _scaled(builder, arguments[2], arguments[1]), flags=CONTRACT)

    return y(y, types.float64, x), generate


@intrinsic
def _load_four(typing: Any, D: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(D)(context, builder, arguments[0]).data
        pointer = builder.bitcast(builder.gep(data, [arguments[1]]), _vector.as_pointer())
        return builder.load(pointer, align=8)

    return _four(D, types.int64), generate


@intrinsic
def _store_four(typing: Any, D: Any, place: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(D)(context, builder, arguments[0]).data
        pointer = builder.bitcast(builder.gep(data, [arguments[1]]), _vector.as_pointer())
        builder.store(arguments[2], pointer, align=8)
        return context.get_dummy_value()

    return types.void(D, types.int64, x), generate


@intrinsic
def _sum_columns(typing: Any, table: Any, filled: Any, w: Any, n: Any, m: Any, out: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        table_, filled_, w_, n_, m_, out_ = arguments
        zero, one = ir.Constant(_whole, 0), ir.Constant(_whole, 1)

        def sums(begin: Any, count: int) -> None:
            def term(j: Any, k: int) -> Any:
                place = builder.add(builder.mul(j, filled_), builder.add(begin, ir.Constant(_whole, FOUR * k)))
                return builder.load(_pointer(builder, _vector, table_, place), align=8)

            totals = [cgutils.alloca_once_value(builder, term(n_, k)) for k in range(count)]

            def add(j: Any) -> None:
                weight = builder.load(_pointer(builder, ir.DoubleType(), w_, j))
                for k, total in enumerate(totals):
                    more = builder.fadd(builder.load(total), _scaled(builder, term(j, k), weight), flags=CONTRACT)
                    builder.store(more, total)

            with cgutils.for_range_slice(builder, builder.add(n_, one), m_, one, intp=_whole) as (j, _):
                add(j)
            with cgutils.for_range_slice(builder, zero, n_, one, intp=_whole) as (j, _):
                add(builder.sub(builder.sub(n_, one), j))
            for k, total in enumerate(totals):
                place = builder.add(begin, ir.Constant(_whole, FOUR * k))
                builder.store(builder.load(total), _pointer(builder, _vector, out_, place), align=8)

        step = ir.Constant(_whole, FOUR * MOST)
        with cgutils.for_range_slice(builder, zero, n_, step, intp=_whole) as (begin, _):
            numbers = builder.add(builder.sub(n_, begin), ir.Constant(_whole, FOUR - 1))
            left = builder.ashr(numbers, ir.Constant(_whole, 2))
            end = builder.append_basic_block("summed")
            all_of_them = builder.append_basic_block("most")
            switch = builder.switch(left, all_of_them)
            for count in range(1, MOST + 1):
                block = all_of_them if count == MOST else builder.append_basic_block(f"vectors_{count}")
                if count < MOST:
                    switch.add_case(ir.Constant(_whole, count), block)
                builder.position_at_end(block)
                sums(begin, count)
                builder.branch(end)
            builder.position_at_end(end)
        return context.get_dummy_value()

    return types.void(*[types.int64] * 6), generate


def _number(address: int, place: int) -> float:
    return c_double.from_address(int(address + 8 * place)).value


def _whole_number(address: int, place: int) -> int:
    return c_int64.from_address(int(address + 8 * place)).value


def _plain_four(address: int, place: int) -> Any:
    return np.array([_number(address, place + k) for k in range(FOUR)])


def _plain_write(address: int, place: int, x: Any) -> None:
    for k in range(FOUR):
        c_double.from_address(int(address + 8 * (place + k))).value = x[k]


def _plain_write_number(address: int, place: int, x: float) -> None:
    c_double.from_address(int(address + 8 * place)).value = x


def _plain_load(D: Any, place: Any) -> Any:
    return D.reshape(-1)[place : place + FOUR].copy()


def _plain_store(D: Any, place: Any, x: Any) -> None:
    D.reshape(-1)[place : place + FOUR] = x


def _plain_times(a: Any, x: Any) -> Any:
    return a * x


def _plain_plus(y: Any, a: Any, x: Any) -> Any:
    return y + a * x


def _plain_columns(table: int, filled: int, w: int, n: int, m: int, out: int) -> None:
    for r in range(0, n, FOUR):
        total = _plain_four(table, n * filled + r)
        for j in (*range(n + 1, m), *range(n - 1, -1, -1)):
            total = total + _number(w, j) * _plain_four(table, j * filled + r)
        _plain_write(out, r, total)


def _choose(compiled: Any, plain: Any) -> Any:
    """The compiled way, or the plain one where nothing is compiled."""
    return plain if numba.config.DISABLE_JIT else compiled


#: Called by a function that must not become part of its callers.
apart = _choose(_apart, lambda: None)
number_at = _choose(_reader(types.float64, ir.DoubleType()), _number)
whole_at = _choose(_reader(types.int64, _whole), _whole_number)
write_number = _choose(_write, _plain_write_number)
four_at, write_four = _choose(_reader(_four, _vector), _plain_four), _choose(_write, _plain_write)
load, store = _choose(_load_four, _plain_load), _choose(_store_four, _plain_store)
times, plus = _choose(_times, _plain_times), _choose(_plus, _plain_plus)
#: out[:n] = sum_j table[j, :n] w[j] for j < m, with w[n] = 1; the states, known last, come last. The rows of the table
#: are ``filled`` numbers, a multiple of four, and so many numbers of ``out`` are written. All by their addresses.
sum_columns = _choose(_sum_columns, _plain_columns)
