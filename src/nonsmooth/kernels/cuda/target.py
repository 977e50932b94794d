"""The module that kernel texts import on a GPU in place of ``cache``: the same markers, another compiler.

A generated module for CUDA is the CPU's text with this header (``cuda.module``): ``device``, ``inline`` and
``kernel`` mark functions that only other device functions call, ``entry`` what the host launches with one thread per
trajectory. Everything is inlined into its entry: the tables of a thread then stand in arrays of constant shape, so
that an index is one multiplication and the arrays lie in the GPU's local memory, interleaved by thread.

``numba.cuda`` is that of the package numba-cuda; with ``NUMBA_ENABLE_CUDASIM=1`` it is Numba's simulator.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import config, cuda

THREADS = 64  # in a block: few, because a trajectory fills a thread's registers
REGISTERS = None  # of a thread, at most; None: as many as the compiler takes (255)


_SIMULATED = bool(config.ENABLE_CUDASIM)


def device(function: Callable[..., Any]) -> Any:
    """Mark a function that kernels call. The simulator takes it as it is: only entries use ``cuda`` themselves."""
    return function if _SIMULATED else cuda.jit(device=True, forceinline=True)(function)


inline = once = device  # once as on a processor would take a kernel 66 s of the compiler in place of 28


def local(function: Callable[..., Any]) -> Any:
    """Mark a function that makes arrays of a thread: it becomes part of its caller before anything is compiled."""
    return function if _SIMULATED else cuda.jit(device=True, inline="always")(function)


def kernel(signature: Any) -> Callable[[Callable[..., Any]], Any]:
    """A kernel of the CPU is a function inside an entry here; its types follow from the call."""
    return device


callback = kernel


def entry(function: Callable[..., Any]) -> Any:
    """Mark what the host launches; compiled for the types of its first call, and kept on disk."""
    if _SIMULATED:
        return cuda.jit(function)
    return cuda.jit(launch_bounds=THREADS, max_registers=REGISTERS, lto=False, cache=True)(function)
