"""Chunks on the threads of this process. The compiled kernels release the interpreter's lock."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from typing import Any

from numpy.typing import NDArray

from nonsmooth.campaign.work import Work

__all__ = ["cores", "on_threads"]


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def on_threads(
    work: Work,
    chunks: Iterable[int],
    done: Callable[[int, Mapping[str, NDArray[Any]]], None],
    threads: int | None = None,
) -> None:
    """Compute chunks and hand each to ``done(chunk, arrays)``, in the calling thread, in any order.

    Ctrl-C (or an error) lets the chunks in hand end and starts no other. At most two chunks per thread wait, so that
    memory does not grow with the number of chunks.
    """
    order = iter(chunks)
    workers = threads or cores()
    if workers == 1:
        for chunk in order:
            done(chunk, work.compute(chunk))
        return
    stop = threading.Event()

    def compute(chunk: int) -> Mapping[str, NDArray[Any]]:
        return {} if stop.is_set() else work.compute(chunk)

    with ThreadPoolExecutor(workers) as pool:
        pending: dict[Future[Any], int] = {}
        try:
            while True:
                for chunk in islice(order, 2 * workers - len(pending)):
                    pending[pool.submit(compute, chunk)] = chunk
                if not pending:
                    return
                for future in wait(pending, return_when=FIRST_COMPLETED).done:
                    done(pending.pop(future), future.result())
        except BaseException:
            stop.set()
            for future in pending:
                future.cancel()
            raise
