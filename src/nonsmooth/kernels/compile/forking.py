"""A fork waits for first calls in other threads: for what they compile, load and compute once.

A child has only the thread that forked, and locks that another thread held then stay held in it for ever. Python holds
one for each module while it is loaded, and up to 3.11 one for each ``cached_property`` while it is computed.
"""

from __future__ import annotations

import _imp
import os
import sys
import threading
import time
from collections.abc import Iterator
from functools import cached_property
from types import CodeType, FrameType
from typing import Any

_OFTEN = 0.002  # seconds between two looks
_LONGEST = 120.0  # seconds; a module that waits for the fork itself must not hold it up for ever
_COMPUTED_ONCE = cached_property.__get__.__code__
_held: list[Any] = []


def watch_forks() -> None:
    """Let every fork of this process wait until no other thread makes a first call."""
    if hasattr(os, "register_at_fork"):
        # It and logging have hooks of this kind, which may not come while a fork waits.
        import concurrent.futures.thread  # noqa: F401  its hook comes with it

        os.register_at_fork(before=_wait, after_in_parent=_go_on, after_in_child=_go_on)


def is_importing(frame: FrameType | None) -> bool:
    """Return whether a thread that stands at ``frame`` is loading a module."""
    return any(code.co_filename.startswith("<frozen importlib") for code in _codes(frame))


def _wait() -> None:
    """Take the locks of compiling and the one that an import must take to begin, at a moment when none goes on."""
    end = time.monotonic() + _LONGEST
    if _is_first_use(sys._getframe()):  # others may wait for what this thread loads or computes
        end = 0.0
    while True:
        _imp.acquire_lock()
        quiet, there = time.monotonic() > end or _others_are_through(), _compiles()
        _imp.release_lock()  # who compiles may have to import
        if quiet:
            if there:
                _take()
            _imp.acquire_lock()
            if time.monotonic() > end or (_others_are_through() and there == _compiles()):
                return
            _go_on()
        time.sleep(_OFTEN)


def _go_on() -> None:
    _imp.release_lock()
    _give_back()


def _others_are_through() -> bool:
    me = threading.get_ident()
    return not any(_is_first_use(frame) for thread, frame in sys._current_frames().items() if thread != me)


def _is_first_use(frame: FrameType | None) -> bool:
    return is_importing(frame) or any(code is _COMPUTED_ONCE for code in _codes(frame))


def _codes(frame: FrameType | None) -> Iterator[CodeType]:
    while frame is not None:
        yield frame.f_code
        frame = frame.f_back


def _compiles() -> bool:
    """Return whether what compiles has been loaded, to its last name."""
    return hasattr(sys.modules.get("nonsmooth.kernels.compile.cache"), "cache_statistics")


def _take() -> None:
    """Take the locks of compiling: the module's, Numba's, LLVM's, in the order in which a compile takes them."""
    cache = sys.modules.get("nonsmooth.kernels.compile.cache")
    if cache is None:
        return  # nothing has been compiled yet
    from llvmlite.binding import ffi

    for lock in (cache._lock, cache.global_compiler_lock, ffi.lib._lock):
        lock.__enter__()
        _held.append(lock)


def _give_back() -> None:
    while _held:
        _held.pop().__exit__(None, None, None)
