"""A fork waits for compiles in other threads.

A child has only the thread that forked: locks that another thread held then stay held in it for ever, and its first
kernel would wait for them. So the thread that forks takes the locks of compiling itself, and both processes give them
back.
"""

from __future__ import annotations

import os
import sys
from typing import Any

__all__ = ["watch_forks"]

_held: list[Any] = []


def watch_forks() -> None:
    """Take the locks of compiling around every fork of this process; where systems do not fork, nothing."""
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(before=_take, after_in_parent=_give_back, after_in_child=_give_back)


def _take() -> None:
    cache = sys.modules.get("nonsmooth.kernels.compile.cache")
    if cache is None:
        return  # nothing has been compiled yet
    from llvmlite.binding import ffi

    # In the order in which a compile takes them: the module's, Numba's, LLVM's.
    for lock in (cache._lock, cache.global_compiler_lock, ffi.lib._lock):
        lock.__enter__()
        _held.append(lock)


def _give_back() -> None:
    while _held:
        _held.pop().__exit__(None, None, None)
