"""Functions of a model, from their text to machine code without Numba: nine tenths of its time went before LLVM.

A callback is called by kernels, by its address, as Numba would call one of the same signature. Its machine code is kept
on disk as that of kernels is (``cache``). With ``NUMBA_DISABLE_JIT=1`` it is the function of Python itself.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numba.core.compiler_lock import global_compiler_lock

from nonsmooth.errors import shortened
from nonsmooth.kernels.compile.cache import entry_of, read_entry, write_entry
from nonsmooth.kernels.compile.scalar import REAL, WHOLE, kinds_of, text_of
from nonsmooth.kernels.compile.target import Codegen, Library

_C_TYPES: dict[str, Any] = {WHOLE: ctypes.c_int64, REAL: ctypes.c_double}


class Callback:
    """A function of a model: its address, and itself for Python (float64 arrays without gaps, whole numbers, floats).

    ``loads`` and ``compiles`` say where its code came from."""

    def __init__(self, function: Any, signature: str) -> None:
        self.py_func, self.signature = function, signature
        self.__name__, self.__module__ = function.__name__, function.__module__
        names = function.__globals__
        if "_codegen" not in names:
            names["_codegen"] = Codegen("models")  # one of each file, which ends with it
        self.codegen = names["_codegen"]
        entry = entry_of(function, signature, self.codegen, {})
        with global_compiler_lock:
            code = read_entry(entry)
            self.loads, self.compiles = int(bool(code)), int(not code)
            if code:
                self._library = Library.of_code(self.codegen, self.__name__, code)
            else:
                self._library = Library.of_text(self.codegen, self.__name__, text_of(function, signature))
            self.address = self._library.get_pointer_to_function(f"{self.__name__}_entry")
            if not code:
                write_entry(entry, self._library._get_compiled_object())

    def __call__(self, *given: Any) -> Any:
        words: list[Any] = []
        for (kind, dims), one in zip(kinds_of(self.signature), given, strict=True):
            if not dims:
                words.append(_C_TYPES[kind](one))
                continue
            array = isinstance(one, np.ndarray) and one.ndim == dims and one.dtype == np.float64
            if not (array and one.flags.c_contiguous):
                raise TypeError(f"{self.__name__} has the signature {self.signature}; {shortened(one)} does not fit")
            numbers = [one.size, one.itemsize, one.ctypes.data, *one.shape, *one.strides]
            words += [ctypes.c_void_p(), ctypes.c_void_p(), *map(ctypes.c_int64, numbers)]
        result = ctypes.c_double()
        ctypes.CFUNCTYPE(ctypes.c_int32)(self.address)(ctypes.byref(result), ctypes.c_void_p(), *words)
        return None if self.signature.startswith("void") else result.value


def callback(signature: str) -> Callable[[Callable[..., Any]], Any]:
    """Mark a function that kernels are given by its address: made at once."""
    return lambda function: function if numba.config.DISABLE_JIT else Callback(function, signature)


def device(function: Callable[..., Any]) -> Any:
    """Mark a function that callbacks of its file call: it is made with them."""
    return function
