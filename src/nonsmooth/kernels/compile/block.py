"""A kernel's working memory in one block, every array at the beginning of a cache line.

Where Python happens to put small arrays changes from process to process, and a vector that straddles two cache lines
costs twice: the same kernel took up to 20 % more time in one process than in another.
"""

from __future__ import annotations

from typing import Any

import numpy as np

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
