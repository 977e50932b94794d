"""Tell whether the work of a thread is still wanted: a flag that its kernels look at between two pauses.

Ctrl-C reaches the main thread only, and a kernel that runs in another one hears nothing of it.
"""

from __future__ import annotations

import threading
from typing import Any

import numpy as np

_of_thread = threading.local()


def obey(array: Any) -> None:
    """From here on kernels of this thread end soon after ``array[0]`` has become 1."""
    _of_thread.flag = array


def flag() -> Any:
    """The flag of this thread, an array of one integer: 1 where its work is not wanted any more."""
    if not hasattr(_of_thread, "flag"):
        _of_thread.flag = np.zeros(1, dtype=np.int64)
    return _of_thread.flag
