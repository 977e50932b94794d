"""All chunks of a work, from wherever they are to be had: computed here, on a cluster, or already in a store."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from nonsmooth.campaign.threads import on_threads
from nonsmooth.campaign.work import Work, empty_columns
from nonsmooth.results.progress import progress as progress_bar

__all__ = ["run"]


def run(
    work: Work, *, threads: int | None = None, progress: bool = True, label: str = "", store: Any = None,
    client: Any = None,
) -> dict[str, NDArray[Any]]:  # fmt: skip
    """Compute every chunk of ``work`` once and return its columns over all places.

    Parameters
    ----------
    threads : int, optional
        Threads of this process; one per core where not given. The result does not depend on it.
    progress : bool
        A bar on a terminal.
    """
    columns = empty_columns(work)

    with progress_bar(len(next(iter(columns.values()))), label, progress) as advance:

        def keep(chunk: int, arrays: Mapping[str, NDArray[Any]]) -> None:
            first, last = work.bounds(chunk)
            for name, values in arrays.items():
                columns[name][first:last] = values
            advance(last - first)

        on_threads(work, range(work.n_chunks()), keep, threads)
    return columns
