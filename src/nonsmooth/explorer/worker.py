"""A process that computes, and the page's side of it: asked, cancelled, started again where it ended.

Where a page is closed its process waits for the next one, which need not load everything again.
Requests and answers are pickles on the two pipes of the process, both ends of which are ours. A request may be
cancelled: the verbs hear of it through their ``progress``, and those that say nothing for a while as Ctrl-C.
"""

from __future__ import annotations

import _thread
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
from types import FrameType
from typing import Any

from nonsmooth.errors import SolveError
from nonsmooth.kernels.compile.forking import is_importing

_OFTEN = 0.15  # seconds between two words on progress
_SILENT = 1.0  # seconds in which cancelled work must end before it is interrupted
DEAF = 10.0  # seconds in which cancelled work must end by itself; then its process is ended

#: ``(kind, number, content)``: "ready" to take work, "progress" with the fraction done, "compiling" with the name of a
#: kernel, "done" with results and warnings, "cancelled", "error" with a sentence, "ended" with the process's exit code.
Answer = tuple[str, int, Any]


class Worker:
    """A process that computes, for the one that hears it; one that nobody hears any more waits for the next.

    Parameters
    ----------
    hear : function, optional
        Called with every answer, in a thread of its own.
    """

    spare: Worker | None = None
    lock = threading.RLock()  # of the spare one, and of who hears whom

    def __init__(self, hear: Callable[[Answer], None] | None = None) -> None:
        self.hear = hear
        self._ready, self._count = False, 0
        self._asked: dict[int, int] = {}  # number here, and that of the one who asked
        self._writing = threading.Lock()
        self._popen = subprocess.Popen(
            [sys.executable, "-P", "-m", "nonsmooth.explorer.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "MPLBACKEND": "Agg"},
        )
        threading.Thread(target=self._listen, daemon=True).start()

    @classmethod
    def idle(cls, hear: Callable[[Answer], None]) -> Worker:
        """The one that waits, or a new one, heard from now on."""
        with cls.lock:
            one, cls.spare = cls.spare, None
            if one is None or one._popen.poll() is not None:
                return cls(hear)
            one.hear = hear
            if one._ready:
                hear(("ready", 0, None))
            return one

    def ask(self, number: int, job: Mapping[str, Any]) -> None:
        """Hand over a request; its answers bear this number."""
        with self.lock:
            self._count += 1
            self._asked[self._count] = number
        self._send(("ask", self._count, dict(job)))

    def cancel(self, number: int) -> None:
        """Say that a request is not wanted any more."""
        for own in [own for own, other in self._asked.copy().items() if other == number]:
            self._send(("cancel", own, None))

    def end(self) -> None:
        """End the process, whatever it does now."""
        self._popen.kill()

    def close(self) -> None:
        """Wait for the next page, once what was asked has been cancelled; who has closed it asks no more."""
        with self.lock:
            self.hear, unwanted = None, [*self._asked]
            self._rest()
        for own in unwanted:
            self._send(("cancel", own, None))
        if unwanted:
            late = threading.Timer(DEAF, self._end_if_at_work)
            late.daemon = True
            late.start()

    def _rest(self) -> None:
        if self.hear is None and not self._asked and Worker.spare is not self:
            if Worker.spare is not None:
                self.end()
            else:
                Worker.spare = self

    def _end_if_at_work(self) -> None:
        with self.lock:
            if self.hear is None and self._asked:
                self.end()

    def _send(self, message: Any) -> None:
        assert self._popen.stdin is not None
        with self._writing, suppress(OSError, ValueError):  # one that has ended is reported by the thread that listens
            pickle.dump(message, self._popen.stdin)
            self._popen.stdin.flush()

    def _listen(self) -> None:
        assert self._popen.stdout is not None
        with suppress(EOFError, OSError, pickle.UnpicklingError):
            while True:
                self._take(pickle.load(self._popen.stdout))
        code = self._popen.wait()
        for pipe in (self._popen.stdin, self._popen.stdout):
            with suppress(OSError):
                assert pipe is not None
                pipe.close()
        with self.lock:
            if Worker.spare is self:
                Worker.spare = None
            if self.hear is not None:
                self.hear(("ended", 0, code))

    def _take(self, answer: Answer) -> None:
        kind, own, content = answer
        with self.lock:
            self._ready = True
            number = self._asked.get(own, 0)
            if kind in ("done", "cancelled", "error"):
                self._asked.pop(own, None)
            if self.hear is not None:
                self.hear((kind, number, content))
            self._rest()


def prepare() -> None:
    """Start the process of the first page, which takes a while."""
    with Worker.lock:
        if Worker.spare is None:
            Worker.spare = Worker()


def end_spare() -> None:
    """End the process that waits for a page."""
    with Worker.lock:
        if Worker.spare is not None:
            Worker.spare.end()
        Worker.spare = None


class _Cancelled:
    """Numbers of requests that nobody waits for, and the way to end the one at work."""

    def __init__(self) -> None:
        self.numbers: set[int] = set()
        self.at_work = 0
        # Ctrl-C on the terminal comes here too: it ends the server, and that closes the pipe
        signal.signal(signal.SIGINT, self._interrupted)
        sys.unraisablehook = self._swallowed

    def add(self, number: int) -> None:
        """Cancel a request; in a while as Ctrl-C does, should its verb not hear of it."""
        self.numbers.add(number)
        self._later(_SILENT, number)

    def _later(self, seconds: float, number: int) -> None:
        late = threading.Timer(seconds, self._interrupt, (number,))
        late.daemon = True
        late.start()

    def _interrupt(self, number: int) -> None:
        if self.at_work != number:
            return
        if hasattr(signal, "pthread_kill"):  # wakes it where it waits for other threads, too
            signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
        else:
            _thread.interrupt_main()

    def _interrupted(self, signum: int, frame: FrameType | None) -> None:
        if self.at_work not in self.numbers:
            return
        if is_importing(frame):  # a package that is loaded by half stays so for the rest of the process
            self._later(_OFTEN, self.at_work)
            return
        raise KeyboardInterrupt

    def _swallowed(self, what: sys.UnraisableHookArgs) -> None:
        # raised where C had called Python (LLVM asks for an object that it compiled): ignored there, so it comes again
        if issubclass(what.exc_type, KeyboardInterrupt):
            self._later(_OFTEN, self.at_work)
        else:
            sys.__unraisablehook__(what)


def main() -> None:
    """Answer requests until the pipe is closed. What is printed goes to stderr."""
    cancelled = _Cancelled()
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    waiting: queue.SimpleQueue[tuple[int, dict[str, Any]] | None] = queue.SimpleQueue()
    # Before a request is read, which may hold arrays: two threads that load NumPy at once break it.
    from nonsmooth.explorer.work import compute
    from nonsmooth.kernels import before_compiling

    def send(answer: Answer) -> None:
        pickle.dump(answer, out, protocol=pickle.HIGHEST_PROTOCOL)
        out.flush()

    def compiling(name: str) -> None:
        if threading.current_thread() is threading.main_thread():
            number, cancelled.at_work = cancelled.at_work, 0  # a message is not cut in two
            send(("compiling", number, name))
            cancelled.at_work = number

    before_compiling.append(compiling)
    threading.Thread(target=_read, args=(waiting, cancelled), daemon=True).start()
    send(("ready", 0, None))
    while (request := waiting.get()) is not None:
        number, job = request
        with suppress(BrokenPipeError):  # one that was cancelled while it waited is answered too
            send(
                ("cancelled", number, None)
                if number in cancelled.numbers
                else _answer(number, job, compute, cancelled, send)
            )
        cancelled.numbers.discard(number)


def _answer(
    number: int,
    job: dict[str, Any],
    compute: Callable[..., dict[str, Any]],
    cancelled: _Cancelled,
    send: Callable[[Answer], None],
) -> Answer:
    last = time.monotonic()

    def heard(fraction: float) -> bool:
        nonlocal last
        if number in cancelled.numbers:
            return False
        if time.monotonic() - last > _OFTEN:
            last = time.monotonic()
            cancelled.at_work = 0  # a message is not cut in two
            send(("progress", number, fraction))
            cancelled.at_work = number
        return True

    try:
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            try:
                cancelled.at_work = number
                found = compute(job, heard)
            finally:
                cancelled.at_work = 0
        return "done", number, (found, [str(one.message) for one in said])
    except KeyboardInterrupt:
        return "cancelled", number, None
    except Exception as error:
        ours = isinstance(error, (ValueError, TypeError, SolveError))
        return "error", number, str(error) if ours else f"{type(error).__name__}: {error}"


def _read(waiting: queue.SimpleQueue[Any], cancelled: _Cancelled) -> None:
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
