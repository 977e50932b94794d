"""Chunks on the workers of a Dask cluster. Workers may die: a chunk that was lost with one is sent again."""

from __future__ import annotations

import logging
import time
import uuid
from collections.abc import Callable, Iterable, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from nonsmooth.campaign.store import ChunkStore
from nonsmooth.campaign.work import ChunkedWork
from nonsmooth.errors import not_installed, shortened

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


def compute_chunk(work: ChunkedWork, chunk: int, path: str | None, key: str) -> Mapping[str, NDArray[Any]] | None:
    """Compute one chunk on a worker, into the store where there is one."""
    if path is None:
        return work.compute(chunk)
    store = ChunkStore(Path(path), key)
    if store.has(chunk):  # computed meanwhile for a client that is gone
        return None
    store.note_start(chunk)
    began = time.thread_time()  # of a processor: other users of the machine do not lengthen it
    store.write(work, chunk, work.compute(chunk), time.thread_time() - began)
    return None


def on_cluster(
    work: ChunkedWork,
    chunks: Iterable[int],
    done: Callable[[int, Mapping[str, NDArray[Any]] | None], None],
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
    attempts: dict[int, int] = {}

    def send(chunk: int) -> Any:
        attempts[chunk] = attempts.get(chunk, 0) + 1
        name = f"nonsmooth-{family}-{chunk}" + (f"-{attempts[chunk]}" if attempts[chunk] > 1 else "")
        return client.submit(compute_chunk, work, chunk, path, key, key=name, pure=False)

    address = client.scheduler.address
    threads = max(sum(client.nthreads().values()), 1)
    pending = {send(chunk): chunk for chunk in islice(order, AHEAD * threads)}
    if not pending:
        return
    queue = as_completed(list(pending), loop=client.loop)  # without it: that of the default client
    try:
        for future in queue:
            chunk = pending.pop(future)
            try:
                # With a store there is nothing to fetch, and a worker that dies after its chunk was kept loses nothing.
                arrays = None if store is not None and future.status == "finished" else future.result()
            except KilledWorker:
                if attempts[chunk] >= ATTEMPTS:
                    raise
                again = send(chunk)
                pending[again] = chunk
                queue.add(again)
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
                new = send(following)
                pending[new] = following
                queue.add(new)
    except BaseException:
        client.cancel(list(pending))
        raise
