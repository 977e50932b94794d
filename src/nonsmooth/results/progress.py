"""Progress of long work: a bar on a terminal, nothing anywhere else."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["progress"]


@contextmanager
def progress(total: int, label: str, enabled: bool = True, done: int = 0) -> Iterator[Callable[..., None]]:
    """A bar of ``total`` steps on stderr; yields ``advance(n=1)``, which any thread may call.

    ``done`` steps were made before: they fill the bar, and do not count in the estimate of what remains. No bar is drawn, and nothing is imported, when ``enabled`` is False, when there is nothing to do or when
    stderr is not a terminal. The bar is wiped when the block ends, by an exception too.
    """
    if not enabled or total <= 0 or not sys.stderr.isatty():
        yield _count_nothing
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label, total=total, completed=done)

        def advance(n: int = 1) -> None:
            bar.advance(task, n)

        yield advance


def _count_nothing(n: int = 1) -> None:
    pass
