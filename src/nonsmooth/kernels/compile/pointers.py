"""Compiled functions passed to a kernel as integers.

An argument of function type costs 30 microseconds per call from Python, because Numba asks Python for its address each
time. That is nothing beside a sweep, and far too much where a kernel runs for ten microseconds. Here the addresses are
asked for once and passed as an array; ``function_at`` makes them functions again inside the kernel. Whoever passes
addresses keeps the functions alive.

Leans on the layout of Numba's function values, as ``numba.core.types.FunctionType`` lowers a call; checked with 0.62
and 0.68.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numba.core import cgutils
from numba.extending import intrinsic

__all__ = ["addresses", "function_at"]

_DISABLED = bool(numba.config.DISABLE_JIT)


def addresses(*functions: Any) -> Any:
    """Return what stands for compiled functions (each with one signature) in a call of a kernel: an array of int64.

    With ``NUMBA_DISABLE_JIT=1`` the functions themselves."""
    if _DISABLED:
        return functions
    found = []
    for function in functions:
        (compiled,) = function.overloads.values()
        found.append(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))
    return np.array(found, dtype=np.int64)


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
