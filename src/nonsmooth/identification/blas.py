"""One thread for the linear algebra of fits: their matrices are tiny, and threads would wait for each other.

OpenBLAS, which NumPy's and SciPy's wheels bring along, is told through its own functions while a fit runs, and told
back afterwards. Another BLAS is left as it is: its environment variable (``OMP_NUM_THREADS``, ``MKL_NUM_THREADS``) does
the same.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple

__all__ = ["one_blas_thread"]

#: The names under which builds of OpenBLAS export ``openblas_<what>_num_threads``.
_NAMES = ("scipy_openblas_{}_num_threads64_", "scipy_openblas_{}_num_threads", "openblas_{}_num_threads64_",
          "openblas_{}_num_threads")  # fmt: skip
_lock = Lock()
_inside = 0
_before: list[int] = []


class _Library(NamedTuple):
    get: Callable[[], int]
    put: Callable[[int], Any]


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Run a block with one thread of linear algebra; what was set before holds again behind the last such block."""
    global _inside, _before
    with _lock:
        _inside += 1
        if _inside == 1:
            _before = [library.get() for library in _libraries()]
            for library in _libraries():
                library.put(1)
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            if _inside == 0:
                for library, threads in zip(_libraries(), _before, strict=True):
                    library.put(threads)


@cache
def _libraries() -> tuple[_Library, ...]:
    """The OpenBLAS that NumPy and SciPy have loaded, where they bring one along."""
    import numpy
    import scipy.linalg  # loads SciPy's own

    found = []
    for package in (numpy, scipy):
        here = Path(str(package.__file__)).parent
        for folder in (here.with_name(f"{here.name}.libs"), here / ".dylibs"):
            for file in sorted(folder.glob("*openblas*")):
                library = _functions(file)
                if library is not None:
                    found.append(library)
    return tuple(found)


def _functions(file: Path) -> _Library | None:
    try:
        library = ctypes.CDLL(str(file))  # loaded already: the same one
    except OSError:
        return None
    for name in _NAMES:
        if hasattr(library, name.format("set")) and hasattr(library, name.format("get")):
            return _Library(getattr(library, name.format("get")), getattr(library, name.format("set")))
    return None
