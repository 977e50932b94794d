"""All chunks of a work, from wherever they are to be had: a store, threads of this process, workers of a cluster."""

from __future__ import annotations

import logging
import os
import threading
import uuid
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import islice
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from nonsmooth.campaign.work import ChunkedWork, Columns, check_room, empty_columns, places_of
from nonsmooth.errors import Interrupted, not_installed, shortened
from nonsmooth.flow.engines.engine import obey
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.progress import Progress
from nonsmooth.results.progress import progress as progress_bar

if TYPE_CHECKING:
    from nonsmooth.campaign.store import ChunkStore


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
        from nonsmooth.campaign.store import open_store, started

        keeper = open_store(store, work, any_cpu=any_cpu)
    there = set() if keeper is None else keeper.done()
    missing = [chunk for chunk in range(work.n_chunks()) if chunk not in there]
    if keeper is not None and client is not None:
        # by workers that may be at them still, for a client that is gone: they come last
        begun = set(started(keeper.path))
        missing.sort(key=begun.__contains__)
    columns = {} if columns is None else columns
    if keeper is None:
        columns |= empty_columns(work)
    size = places_of(work)
    before = size - sum(last - first for first, last in map(work.bounds, missing))
    try:
        with progress_bar(size, label, progress, before) as advance:

            def keep(chunk: int, arrays: Columns | None) -> None:
                first, last = work.bounds(chunk)
                if keeper is None and arrays is not None:
                    for name, values in arrays.items():
                        columns[name][first:last] = values
                advance(last - first)

            if client is not None:
                on_cluster(work, missing, keep, client, keeper)
            else:
                if missing:
                    work.load()
                over_items(missing, work.compute if keeper is None else partial(keeper.compute, work), keep, threads)
    except KeyboardInterrupt as error:
        if keeper is None:
            raise
        kept = f"{len(keeper.done())} of {work.n_chunks()} chunks are kept in {store}; run it again to go on"
        raise KeyboardInterrupt(f"{str(error) or 'interrupted'}: {kept}") from error
    return columns if keeper is None else keeper.read(work)


def whole_or_part(
    fill: Callable[..., dict[str, NDArray[Any]]], label: str, result: Callable[[dict[str, NDArray[Any]], bool], Any]
) -> Any:
    """``result(columns, True)`` of what ``fill`` computes; at Ctrl-C ``Interrupted`` with ``result(columns, False)``.

    None of the second says that nothing is whole yet. What is in a store stays there, and is not read."""
    columns: dict[str, NDArray[Any]] = {}
    try:
        return result(fill(label=label, columns=columns), True)
    except KeyboardInterrupt as error:
        done = columns.get("status", np.array([codes.INTERRUPTED])) != codes.INTERRUPTED
        part = result(columns, False) if done.any() else None
        if part is None:
            raise
        raise Interrupted.with_points(error, int(done.sum()), done.size, label, part) from error


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


MISSING = f"a cluster needs {not_installed('distributed', 'cluster')}"
AHEAD = 2  # chunks that wait at each thread of the cluster
ANSWER = 60  # seconds to wait for a scheduler
ATTEMPTS = 10  # times that a chunk is sent again after its workers died


def connect(address: str) -> Any:
    """A client of the scheduler at an address such as ``tcp://127.0.0.1:8786``.

    Raises
    ------
    ImportError
        Without Dask distributed.
    OSError
        Where no scheduler answers.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise ImportError(MISSING) from error
    # A scheduler that goes is told by on_cluster in one sentence; no traceback of the connection before it.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    try:
        return Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError) as error:
        raise OSError(
            f"no scheduler answers at {address} ({error}); start one with `dask scheduler` and give the address that "
            "it prints"
        ) from error


def compute_chunk(work: ChunkedWork, chunk: int, path: str | None, key: str) -> Columns | None:
    """Compute one chunk on a worker, into the store where there is one."""
    if path is None:
        return work.compute(chunk)
    from nonsmooth.campaign.store import ChunkStore

    store = ChunkStore(Path(path), key)
    if not store.has(chunk):  # else computed meanwhile for a client that is gone
        store.compute(work, chunk)
    return None


def on_cluster(
    work: ChunkedWork,
    chunks: Iterable[int],
    done: Callable[[int, Columns | None], None],
    client: Any,
    store: ChunkStore | None,
) -> None:
    """Send chunks to the workers and call ``done(chunk, arrays or None)`` for each that has come back.

    With a store the workers write, and only the news comes back. Few chunks are on their way at any time, so that
    the scheduler's memory does not grow with their number.

    Raises
    ------
    ImportError
        Without Dask distributed.
    ConnectionError
        The scheduler is gone; what has come back, or is in the store, stands.
    """
    if client is not None and not hasattr(client, "scheduler"):
        raise TypeError(f"client = {shortened(client)}: give dask.distributed.Client(address)")
    try:
        from distributed import as_completed
        from distributed.client import FutureCancelledError
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        raise ImportError(MISSING) from error
    path, key = (None, "") if store is None else (str(store.path.resolve()), store.key)
    family = uuid.uuid4().hex[:16]  # never the names of a client that is gone: its tasks may be half forgotten
    order = iter(chunks)
    attempts: Counter[int] = Counter()
    pending: dict[Any, int] = {}
    queue = as_completed([], loop=client.loop)  # without it: that of the default client

    def send(chunk: int) -> None:
        attempts[chunk] += 1
        name = f"nonsmooth-{family}-{chunk}-{attempts[chunk]}"
        future = client.submit(compute_chunk, work, chunk, path, key, key=name, pure=False)
        pending[future] = chunk
        queue.add(future)

    address = client.scheduler.address
    try:
        for chunk in islice(order, AHEAD * max(sum(client.nthreads().values()), 1)):
            send(chunk)
        for future in queue:
            chunk = pending.pop(future)
            try:
                # With a store there is nothing to fetch, and a worker that dies after its chunk was kept loses nothing.
                arrays = None if store is not None and future.status == "finished" else future.result()
            except KilledWorker:
                if attempts[chunk] >= ATTEMPTS:
                    raise
                send(chunk)
                continue
            except FutureCancelledError as error:
                kept = "finished chunks are in the store: " if store is not None else ""
                raise ConnectionError(
                    f"the scheduler at {address} is gone ({error.reason}); {kept}start it again with its workers, and "
                    "run again"
                ) from error
            done(chunk, arrays)
            future.release()
            for following in islice(order, 1):
                send(following)
    except BaseException:
        client.cancel(list(pending))
        raise
