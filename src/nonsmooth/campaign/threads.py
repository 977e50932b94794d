"""Work on the threads of this process. The compiled kernels release the interpreter's lock."""

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

from nonsmooth.campaign.work import ChunkedWork
from nonsmooth.kernels.hybrid.stopping import obey

T = TypeVar("T")
R = TypeVar("R")


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def on_threads(
    work: ChunkedWork,
    chunks: Iterable[int],
    done: Callable[[int, Mapping[str, NDArray[Any]]], None],
    threads: int | None = None,
) -> None:
    """Compute chunks and hand each to ``done(chunk, arrays)``: see :func:`over_items`."""
    over_items(chunks, work.compute, done, threads)


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
