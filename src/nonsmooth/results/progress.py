"""Progress of long work, for a person who watches: on a terminal and in a notebook, and nothing anywhere else."""

from __future__ import annotations

import io
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from shutil import get_terminal_size
from typing import Any

from nonsmooth.kernels import before_compiling

#: True: a bar where somebody watches; a function of the fraction done, which may return False to cancel.
Progress = bool | Callable[[float], object]

AGAIN = 10.0  # seconds until compiling is mentioned again
_mentioned = -AGAIN


@contextmanager
def progress(total: int, label: str, enabled: Progress = True, done: int = 0) -> Iterator[Callable[..., None]]:
    """A bar of ``total`` steps; yields ``advance(n=1)``, which any thread may call.

    Where ``enabled`` is a function, it hears the fraction done, 0 to 1, in place of the bar; the work is cancelled
    where it returns False, and then ends as by Ctrl-C.

    ``done`` steps were made before: they fill the bar, and do not count in the estimate of what remains. No bar is
    drawn, and nothing is imported, when ``enabled`` is False, when there is nothing to do or when nobody watches
    (:func:`is_watched`). The bar is wiped when the block ends, by an exception too.
    """
    if not isinstance(enabled, bool) and not callable(enabled):
        raise TypeError(
            f"progress = {enabled!r}: True, False, or a function that takes the fraction done (0 to 1) and may return "
            "False to cancel"
        )
    lock = threading.Lock()
    if callable(enabled) and total > 0:

        def tell(n: int = 1) -> None:
            nonlocal done
            with lock:
                done += n
                if enabled(min(done / total, 1.0)) is False:
                    raise KeyboardInterrupt("cancelled by the function given as progress")

        tell(0)
        yield tell
        return
    if not enabled or total <= 0 or not is_watched():
        yield _nothing
        return
    with _bar_type()(
        total=total,
        desc=label,
        initial=done,
        leave=False,
        miniters=1,
        bar_format="{desc}: {percentage:3.0f}%|{bar}| {n_fmt}/{total_fmt} [{elapsed}<{remaining}]",
        **_place(),
    ) as bar:

        def advance(n: int = 1) -> None:
            with lock:
                bar.update(n)

        yield advance


def say(text: str, enabled: Progress = True) -> None:
    """A line on stderr, above the bars, where somebody watches; an unwritable stderr is passed over."""
    if enabled is True and is_watched():
        with suppress(OSError, ValueError):
            from tqdm import tqdm

            tqdm.write(text, file=sys.stderr)
            sys.stderr.flush()


def is_watched() -> bool:
    """Return whether stderr is a terminal, or this process a notebook's."""
    try:
        return _in_notebook() or bool(sys.stderr.isatty())
    except (AttributeError, ValueError):  # no stderr (pythonw), or a closed one
        return False


def _in_notebook() -> bool:
    shell = getattr(sys.modules.get("IPython"), "get_ipython", _nothing)()
    return "IPKernelApp" in getattr(shell, "config", ())


def _bar_type() -> Any:
    from tqdm import tqdm

    # A bar that is redrawn by its own steps needs no thread that looks after it.
    own: dict[str, Any] = {"monitor_interval": 0}
    if _in_notebook():
        own |= {"status_printer": staticmethod(_output_of_a_cell), "moveto": _nothing}
    return type("Bar", (tqdm,), own)


def _place() -> dict[str, Any]:
    if _in_notebook():
        return {"file": io.StringIO()}  # for what a terminal needs besides
    # a terminal may say that it has no columns and no rows
    return {"file": sys.stderr, "ncols": get_terminal_size().columns, "nrows": 20}


def _output_of_a_cell(file: Any) -> Callable[[str], None]:
    """One output that is written anew, and empty in the end: text with carriage returns would leave blank lines."""
    from IPython.display import display

    shown = display({"text/plain": ""}, raw=True, display_id=True)

    def show(text: str) -> None:
        shown.update({"text/plain": text}, raw=True)

    return show


def _say_compiling(name: str) -> None:
    """Kernels come one after the other: one line for those of some seconds."""
    global _mentioned
    now = time.monotonic()
    if now - _mentioned < AGAIN or not is_watched():
        return
    _mentioned = now
    from nonsmooth.kernels.compile.folder import cache_folder

    say(f"nonsmooth: compiling (once; kept in {cache_folder()}) ...")


def _nothing(*_: object) -> None:
    pass


before_compiling.append(_say_compiling)
