"""All chunks of a work, from wherever they are to be had: a store, threads of this process, a cluster."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from queue import SimpleQueue
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from nonsmooth.campaign.work import ChunkedWork, check_room, clock, empty_columns
from nonsmooth.flow.engines.engine import obey
from nonsmooth.results.progress import Progress
from nonsmooth.results.progress import progress as progress_bar


def run(
    work: ChunkedWork,
    *,
    threads: int | None = None,
    progress: Progress = True,
    label: str = "",
    store: Any = None,
    client: Any = None,
    any_cpu: bool = False,
    columns: dict[str, NDArray[Any]] | None = None,
) -> dict[str, NDArray[Any]]:
    """Compute every chunk of ``work`` that is not in the store yet, and return its columns over all places.

    Parameters
    ----------
    threads : int, optional
        Threads of this process; one per core where not given. The result does not depend on it.
    progress : bool, or function
        A bar, on a terminal and in a notebook; nothing elsewhere. A function hears the fraction done, and cancels the
        work by returning False (:func:`nonsmooth.results.progress.progress`).
    store : path, optional
        A Zarr store (see :mod:`nonsmooth.campaign.store`).
    client : dask.distributed.Client, optional
        Chunks are computed by its workers, which must see the same store under the same path.
    any_cpu : bool
        See :func:`nonsmooth.campaign.store.open_store`.
    columns : dict, optional
        Filled in place where there is no store: holds what was computed by then, should the work be interrupted.
    """
    check_room(work, label)
    keeper = None
    if store is not None:
        from nonsmooth.campaign.store import open_store

        keeper = open_store(store, work, any_cpu=any_cpu)
    there = set() if keeper is None else keeper.done()
    missing = [chunk for chunk in range(work.n_chunks()) if chunk not in there]
    if keeper is not None and client is not None:
        begun = keeper.begun()  # by workers that may be at them still, for a client that is gone: they come last
        missing.sort(key=begun.__contains__)
    columns = {} if columns is None else columns
    if keeper is None:
        columns |= empty_columns(work)
    size = work.bounds(work.n_chunks() - 1)[1]
    before = size - sum(last - first for first, last in map(work.bounds, missing))
    with progress_bar(size, label, progress, before) as advance:

        def keep(chunk: int, arrays: Mapping[str, NDArray[Any]] | None) -> None:
            first, last = work.bounds(chunk)
            if keeper is None and arrays is not None:
                for name, values in arrays.items():
                    columns[name][first:last] = values
            advance(last - first)

        if client is not None:
            from nonsmooth.campaign.cluster import on_cluster

            on_cluster(work, missing, keep, client, keeper)
        else:
            if missing:
                work.load()
            over_items(missing, (_Kept(work, keeper) if keeper else work).compute, keep, threads)
    return columns if keeper is None else keeper.read(work)


class _Kept:
    """A work whose chunks go into a store as soon as they are computed, in the thread that computed them."""

    def __init__(self, work: ChunkedWork, keeper: Any) -> None:
        self.work, self.keeper, self.device = work, keeper, work.device
        self.columns, self.n_chunks, self.bounds = work.columns, work.n_chunks, work.bounds
        self.describe, self.load = work.describe, work.load

    def compute(self, chunk: int) -> Mapping[str, NDArray[Any]]:
        self.keeper.note_start(chunk)
        now = clock(self.device)
        began = now()
        arrays = self.work.compute(chunk)
        self.keeper.write(self.work, chunk, arrays, now() - began)
        return arrays


T = TypeVar("T")
R = TypeVar("R")


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def over_items(
    items: Iterable[T],
    compute: Callable[[T], R],
    done: Callable[[T, R], None],
    threads: int | None = None,
    stop: threading.Event | None = None,
) -> None:
    """Compute every item and hand it to ``done(item, result)``, in the calling thread, in any order.

    Ctrl-C (or an error) sets ``stop``, ends the items in hand at their next pause and starts no other. At most two
    items per thread wait (one by one where there is one thread), so that memory does not grow with their number.
    """
    order = iter(items)
    workers = threads or cores()
    in_hand = 2 * workers if workers > 1 else 1
    halt = threading.Event() if stop is None else stop
    # A queue, not the futures: Ctrl-C in the midst of a wait for futures can leave their locks in disorder.
    came: SimpleQueue[tuple[Any, Any, BaseException | None]] = SimpleQueue()
    unwanted = np.zeros(1, dtype=np.int64)

    def run(item: T) -> None:
        obey(unwanted)
        try:
            came.put((item, None if halt.is_set() else compute(item), None))
        except BaseException as error:
            came.put((item, None, error))

    with ThreadPoolExecutor(workers) as pool:
        waiting = 0
        try:
            while True:
                for item in islice(order, in_hand - waiting):
                    pool.submit(run, item)
                    waiting += 1
                if not waiting:
                    return
                item, result, error = came.get()
                waiting -= 1
                if error is not None:
                    raise error
                done(item, result)
        except BaseException:
            unwanted[0] = 1
            halt.set()
            raise
