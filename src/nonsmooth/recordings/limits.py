"""Limits on what a file may claim. A recording comes from elsewhere; claims are checked against its size."""

from __future__ import annotations

__all__ = ["MAX_COLUMNS", "MAX_DEPTH", "MAX_FILE_BYTES", "inflation_limit"]

MAX_FILE_BYTES = 1 << 30  # read whole into memory, so that the hash is that of what was read
MAX_COLUMNS = 4096  # over all runs of one file; each becomes a labelled array
MAX_DEPTH = 32  # of nested containers

_FLOOR = 16 << 20  # small files may hold long constant signals, which compress without bound
_RATIO = 100


def inflation_limit(n_bytes: int) -> int:
    """The most bytes that the compressed parts of a file of ``n_bytes`` may become, all together."""
    return max(_FLOOR, _RATIO * n_bytes)
