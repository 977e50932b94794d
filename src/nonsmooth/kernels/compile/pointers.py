"""Compiled functions and records of arrays passed to a kernel as integers; its working memory in one block.

An argument of function type costs 30 microseconds per call from Python, because Numba asks Python for its address each
time. That is nothing beside a sweep, and far too much where a kernel runs for ten microseconds. Here the addresses are
asked for once and passed as an array; ``function_at`` makes them functions again inside the kernel. Whoever passes
addresses keeps the functions alive.

The same holds for records: an array takes 150 ns on its way into a kernel, seven words of it in each call between two
kernels, and a system has some sixty. A record is written to a block of memory once (:func:`stored`), and a kernel that
is given its address reads from it what it needs.

Leans on the layout of Numba's function values, as ``numba.core.types.FunctionType`` lowers a call; checked with 0.62
and 0.68.

Where Python happens to put small arrays changes from process to process, and a vector that straddles two cache lines
costs twice: the same kernel took up to 20 % more time in one process than in another.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic

_DISABLED = bool(numba.config.DISABLE_JIT)


def addresses(*functions: Any) -> Any:
    """Return what stands for compiled functions (each with one signature) in a call of a kernel: an array of int64.

    With ``NUMBA_DISABLE_JIT=1`` the functions themselves."""
    if _DISABLED:
        return functions
    return np.array([function.address for function in functions], dtype=np.int64)


def function_at(function_type: Any) -> Any:
    """A function for use inside kernels that turns an address into a function of this ``types.FunctionType``."""
    if _DISABLED:
        return lambda function: function

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value = cgutils.create_struct_proxy(function_type)(context, builder)
        pointer = builder.inttoptr(arguments[0], context.get_value_type(numba.types.voidptr))
        null = cgutils.get_null_value(pointer.type)
        value.c_addr, value.py_addr, value.jit_addr = null, null, pointer
        return value._getvalue()

    @intrinsic
    def from_address(typing_context: Any, address: Any) -> Any:
        return function_type(numba.types.int64), generate

    return from_address


def stored(kind: Any) -> tuple[Any, Any]:
    """Functions for use inside kernels that write a record of this type to an address, and read it there."""
    if _DISABLED:
        return lambda address, record: address.append(record), lambda address: address[-1] if address else None

    @intrinsic
    def put(typing_context: Any, address: Any, record: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            address_, value = arguments
            builder.store(value, builder.inttoptr(address_, value.type.as_pointer()))
            return context.get_dummy_value()

        return numba.types.void(numba.types.int64, kind), generate

    @intrinsic
    def take(typing_context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return _read(builder, builder.inttoptr(arguments[0], context.get_value_type(kind).as_pointer()))

        return kind(numba.types.int64), generate

    return put, take


def _read(builder: Any, pointer: Any) -> Any:
    """The value at a pointer, number by number: what is not needed is then not read."""
    kind = pointer.type.pointee
    if not isinstance(kind, ir.BaseStructType):
        return builder.load(pointer)
    value = ir.Constant(kind, ir.Undefined)
    for k in range(len(kind.elements)):
        part = builder.gep(pointer, [ir.Constant(ir.IntType(32), i) for i in (0, k)], inbounds=True)
        value = builder.insert_value(value, _read(builder, part), k)
    return value


@cache
def _bytes_of(kind: Any) -> int:
    """Bytes of a record of this type (LLVM takes a tenth of a millisecond to tell)."""
    context = numba.core.registry.cpu_target.target_context
    return int(context.get_abi_sizeof(context.get_value_type(kind)))


class Block:
    """Memory for a record of some type, and the record while it stands there.

    ``put`` is the kernel ``(address, record)`` that writes it."""

    def __init__(self, kind: Any, put: Any) -> None:
        self._put: Any = put
        self.record: Any = None
        if _DISABLED:
            self.address: Any = []
        else:
            self._room = np.zeros(_bytes_of(kind) // 8 + 1, dtype=np.int64)
            self.address = self._room.ctypes.data

    def put(self, record: Any) -> Any:
        """Write a record, where other arrays stand; the block's address."""
        if self.record is None or any(new is not old for new, old in zip(record, self.record, strict=True)):
            if _DISABLED:
                self.address.clear()
            self._put(self.address, record)
            self.record = record
        return self.address


LINE = 64  # bytes of a cache line
PAGE = 4096


def one_block(*arrays: Any) -> tuple[Any, ...]:
    """Copies of arrays (and of tuples of arrays), behind each other in one block of memory that begins on a page."""
    block = np.zeros(_room(arrays) + PAGE, dtype=np.uint8)
    return _put(arrays, block, -block.ctypes.data % PAGE)


def _room(array: Any) -> int:
    """Bytes that an array takes up to the next cache line."""
    if isinstance(array, tuple):
        return sum(_room(part) for part in array)
    return -(-int(array.nbytes) // LINE) * LINE


def _put(array: Any, block: Any, first: int) -> Any:
    if isinstance(array, tuple):
        found = []
        for part in array:
            found.append(_put(part, block, first))
            first += _room(part)
        return tuple(found)
    view = block[first : first + array.nbytes].view(array.dtype).reshape(array.shape)
    view[...] = array
    return view
