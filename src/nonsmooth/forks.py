"""A fork waits for first calls in other threads: for what they compile, and for the modules that they load.

A child has only the thread that forked, and locks that another thread held then stay held in it for ever. Python holds
one for each module while it is loaded, and verbs load theirs when they are first called.
"""

from __future__ import annotations

import _imp
import os
import sys
import threading
import time
from types import FrameType

from nonsmooth.kernels.compile import forking

__all__ = ["is_importing", "watch_forks"]

_OFTEN = 0.002  # seconds between two looks
_LONGEST = 120.0  # seconds; a module that waits for the fork itself must not hold it up for ever


def watch_forks() -> None:
    """Let every fork of this process wait until no other thread compiles or imports; where systems do not fork, nothing."""
    if hasattr(os, "register_at_fork"):
        import concurrent.futures.thread  # noqa: F401  it and logging have such hooks, which may not come during a wait

        os.register_at_fork(before=_wait, after_in_parent=_go_on, after_in_child=_go_on)


def is_importing(frame: FrameType | None) -> bool:
    """Return whether a thread that stands at ``frame`` is loading a module."""
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


def _wait() -> None:
    """Take the locks of compiling and the one that an import must take to begin, at a moment when none goes on."""
    end = time.monotonic() + _LONGEST
    if is_importing(sys._getframe()):  # others may wait for the module that this thread loads
        end = 0.0
    while True:
        _imp.acquire_lock()
        quiet, there = time.monotonic() > end or _none_imports(), _compiles()
        _imp.release_lock()  # who compiles may have to import
        if quiet:
            if there:
                forking._take()
            _imp.acquire_lock()
            if time.monotonic() > end or (_none_imports() and there == _compiles()):
                return
            _go_on()
        time.sleep(_OFTEN)


def _none_imports() -> bool:
    me = threading.get_ident()
    return not any(is_importing(frame) for thread, frame in sys._current_frames().items() if thread != me)


def _compiles() -> bool:
    """Return whether what compiles has been loaded, to its last name."""
    return hasattr(sys.modules.get("nonsmooth.kernels.compile.cache"), "cache_statistics")


def _go_on() -> None:
    _imp.release_lock()
    forking._give_back()
