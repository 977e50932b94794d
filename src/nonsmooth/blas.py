"""One thread for the linear algebra of fits and branches: matrices are small, and threads would wait for each other."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import Lock
from typing import Any

_lock = Lock()
_inside = 0
_limits: Any = None


@cache
def _libraries() -> Any:
    """The libraries with threads that are loaded; to look for them takes milliseconds."""
    import scipy.linalg  # noqa: F401  it loads a library of its own, which is to be limited too
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Run a block with one thread of linear algebra; what was set before holds again behind the last such block."""
    global _inside, _limits
    with _lock:
        _inside += 1
        if _inside == 1:
            _limits = _libraries().limit(limits=1, user_api="blas")
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            if _inside == 0:
                _limits.restore_original_limits()
