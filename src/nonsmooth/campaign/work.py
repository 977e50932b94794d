"""Interface of a piece of work for the campaign room: chunks that depend on their own index only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from nonsmooth.results.memory import room_for

if TYPE_CHECKING:
    from nonsmooth.system.system import System

CHUNK = 256  # runs of one chunk, at least: a tenth of a second
STORED = 4096  # and of one that is kept in a store or sent to a cluster: a second
LISTED = 40  # bytes of a chunk's number in a list


@dataclass(frozen=True)
class ColumnType:
    """One result per place: its type, the shape of one entry, and what stands where nothing was computed (NaN of real
    numbers)."""

    dtype: str
    shape: tuple[int, ...] = ()
    unknown: int = 0


class ChunkedWork(Protocol):
    """Places, cut into chunks; chunk k holds the places from ``bounds(k)[0]`` up to ``bounds(k)[1]``, from k alone.

    ``describe`` is everything that the outcome depends on, as plain data (JSON): two works with equal descriptions
    give equal results. A work can be pickled and sent to another process. ``device`` is ``"cpu"`` or ``"cuda"``.
    ``load`` compiles what ``compute`` calls: Ctrl-C cannot stop a compile in a thread.
    """

    @property
    def device(self) -> str: ...

    def columns(self) -> Mapping[str, ColumnType]: ...

    def n_chunks(self) -> int: ...

    def bounds(self, chunk: int) -> tuple[int, int]: ...

    def load(self) -> None: ...

    def compute(self, chunk: int) -> Mapping[str, NDArray[Any]]: ...

    def describe(self) -> Mapping[str, Any]: ...


def check_room(work: ChunkedWork, label: str) -> None:
    """MemoryError where a work's columns over all places would not fit into memory."""
    chunks = work.n_chunks()
    width = sum(np.dtype(item.dtype).itemsize * int(np.prod(item.shape)) for item in work.columns().values())
    size = work.bounds(chunks - 1)[1] if chunks else 0
    room_for(width * size + LISTED * chunks, label or "the result", "ask for fewer points")


def empty_columns(work: ChunkedWork) -> dict[str, NDArray[Any]]:
    """Arrays for all places of a work."""
    chunks = work.n_chunks()
    size = work.bounds(chunks - 1)[1] if chunks else 0
    return {
        name: np.full((size, *one.shape), np.nan if one.dtype.startswith("f") else one.unknown, one.dtype)
        for name, one in work.columns().items()
    }


def inputs(system: System, verb: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Everything that a work's outcome depends on, as plain data."""
    from nonsmooth.results.provenance import options_as_data

    return {
        "verb": verb,
        "system": system.to_text(),
        "parameters": {k: float(v) for k, v in system.values.items()},
        "options": options_as_data(options),
    }
