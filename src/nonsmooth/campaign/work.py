"""What the campaign room asks of a piece of work: chunks that depend on their own index only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["Column", "Work", "empty_columns"]


@dataclass(frozen=True)
class Column:
    """One result per place: its type and the shape of one entry."""

    dtype: str
    shape: tuple[int, ...] = ()


class Work(Protocol):
    """Places, cut into chunks; chunk k holds the places from ``bounds(k)[0]`` up to ``bounds(k)[1]``, from k alone.

    ``describe`` is everything that the outcome depends on, as plain data (JSON): two works with equal descriptions
    give equal results. A work can be pickled and sent to another process. ``device`` is ``"cpu"`` or ``"cuda"``.
    """

    @property
    def device(self) -> str: ...

    def columns(self) -> Mapping[str, Column]: ...

    def n_chunks(self) -> int: ...

    def bounds(self, chunk: int) -> tuple[int, int]: ...

    def compute(self, chunk: int) -> Mapping[str, NDArray[Any]]: ...

    def describe(self) -> Mapping[str, Any]: ...


def empty_columns(work: Work) -> dict[str, NDArray[Any]]:
    """Arrays for all places of a work."""
    chunks = work.n_chunks()
    size = work.bounds(chunks - 1)[1] if chunks else 0
    return {name: np.zeros((size, *column.shape), column.dtype) for name, column in work.columns().items()}
