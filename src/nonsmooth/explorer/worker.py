"""A process that computes, and the page's side of it: asked, cancelled, started again where it ended.

Requests and answers are pickles on the two pipes of the process, both ends of which are ours. A request may be
cancelled: the verbs hear of it through their ``progress``.
"""

from __future__ import annotations

import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

__all__ = ["Answer", "Worker"]

_OFTEN = 0.15  # seconds between two words on progress

#: ``(kind, number, content)``: "progress" with the fraction done, "done" with results and warnings, "cancelled",
#: "error" with a sentence, "ended" with the exit code of the process.
Answer = tuple[str, int, Any]


class Worker:
    """The process that computes for one page.

    Parameters
    ----------
    hear : function
        Called with every answer, in a thread of its own.
    """

    def __init__(self, hear: Callable[[Answer], None]) -> None:
        self._hear = hear
        self._closed = False
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()
        self.start()

    def start(self) -> None:
        """Start the process, in place of one that has ended."""
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "nonsmooth.explorer.worker"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            env={**os.environ, "MPLBACKEND": "Agg"},
        )  # fmt: skip
        threading.Thread(target=self._listen, args=(self._process,), daemon=True).start()

    def ask(self, number: int, job: Mapping[str, Any]) -> None:
        """Hand over a request; its answers bear this number."""
        self._send(("ask", number, dict(job)))

    def cancel(self, number: int) -> None:
        """Say that a request is not wanted any more."""
        self._send(("cancel", number, None))

    def end(self) -> None:
        """End the process, whatever it does now; ``start`` begins another one."""
        if self._process is not None:
            self._process.kill()

    def close(self) -> None:
        """End for good."""
        self._closed = True
        self.end()

    def _send(self, message: Any) -> None:
        process = self._process
        assert process is not None
        assert process.stdin is not None
        with self._lock, suppress(OSError, ValueError):  # one that has ended is reported by the thread that listens
            pickle.dump(message, process.stdin)
            process.stdin.flush()

    def _listen(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout is not None
        with suppress(EOFError, OSError, pickle.UnpicklingError):
            while True:
                self._hear(pickle.load(process.stdout))
        code = process.wait()
        for pipe in (process.stdin, process.stdout):
            with suppress(OSError):
                assert pipe is not None
                pipe.close()
        if not self._closed:
            self._hear(("ended", 0, code))


def main() -> None:
    """Answer requests until the pipe is closed. What is printed goes to stderr."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C on the terminal ends the server, and that closes the pipe
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    waiting: queue.SimpleQueue[tuple[int, dict[str, Any]] | None] = queue.SimpleQueue()
    cancelled: set[int] = set()
    threading.Thread(target=_read, args=(waiting, cancelled), daemon=True).start()
    from nonsmooth.explorer.work import compute

    def send(answer: Answer) -> None:
        pickle.dump(answer, out, protocol=pickle.HIGHEST_PROTOCOL)
        out.flush()

    while (request := waiting.get()) is not None:
        number, job = request
        if number not in cancelled:
            with suppress(BrokenPipeError):
                send(_answer(number, job, compute, cancelled, send))
        cancelled.discard(number)


def _answer(
    number: int, job: dict[str, Any], compute: Callable[..., dict[str, Any]], cancelled: set[int],
    send: Callable[[Answer], None],
) -> Answer:  # fmt: skip
    last = time.monotonic()

    def heard(fraction: float) -> bool:
        nonlocal last
        if time.monotonic() - last > _OFTEN:
            last = time.monotonic()
            send(("progress", number, fraction))
        return number not in cancelled

    try:
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            found = compute(job, heard)
        return "done", number, (found, [str(one.message) for one in said])
    except KeyboardInterrupt:
        return "cancelled", number, None
    except Exception as error:
        return "error", number, f"{error}" if isinstance(error, (ValueError, TypeError)) else _told(error)


def _told(error: Exception) -> str:
    from nonsmooth.errors import SolveError

    return str(error) if isinstance(error, SolveError) else f"{type(error).__name__}: {error}"


def _read(waiting: queue.SimpleQueue[Any], cancelled: set[int]) -> None:
    with suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            what, number, job = pickle.load(sys.stdin.buffer)
            if what == "cancel":
                cancelled.add(number)
            else:
                waiting.put((number, job))
    waiting.put(None)
    time.sleep(0.5)
    os._exit(0)  # in the midst of work too: nobody waits for it


if __name__ == "__main__":
    main()
