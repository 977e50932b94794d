"""A search with a budget: its time is counted, shown as a bar, and comes to an end."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from nonsmooth.errors import SolveError
from nonsmooth.flow.engines.loop import at_pause
from nonsmooth.kernels import before_compiling
from nonsmooth.results.progress import Progress
from nonsmooth.results.progress import progress as progress_bar


class Search:
    """Seconds of a processor that this thread has spent, compiling apart; :meth:`look` counts them and ends the search.

    Attributes
    ----------
    doing : str
        What the search is at, for the message.
    """

    def __init__(self, budget: float, advance: Callable[[int], None]) -> None:
        self.budget, self.spent, self.doing = budget, 0.0, "letting the motion settle"
        self._advance, self._shown, self._thread = advance, 0, threading.get_ident()
        self._compiled, self._since = False, time.thread_time()

    def over(self) -> bool:
        """Count the time since the last call, unless kernels were compiled in it; whether the budget is spent."""
        now = time.thread_time()
        if not self._compiled:
            self.spent += now - self._since
        self._since, self._compiled = now, False
        if int(self.spent) > self._shown:
            self._advance(int(self.spent) - self._shown)
            self._shown = int(self.spent)
        return self.spent > self.budget

    def look(self) -> None:
        """End the search where its budget is spent; other threads spend their own.

        Raises
        ------
        SolveError
            The budget is spent.
        """
        if threading.get_ident() == self._thread and self.over():
            raise SolveError(
                f"no periodic orbit was found in the budget of {self.budget:g} s of processor time, spent while "
                f"{self.doing}. Give a start nearer to the orbit, a shorter transient, a smaller max_period, or a "
                "larger budget=",
                status="budget",
            )

    def compiling(self, name: str) -> None:
        """A kernel is compiled: the time until the next look does not count."""
        self._compiled = True


@contextmanager
def search_within(budget: float, label: str, enabled: Progress, *, looks: bool = False) -> Iterator[Search]:
    """A search for a ``with`` block; ``looks``: whenever a run pauses too. The bar shows how much is spent."""
    with progress_bar(max(1, int(budget)), f"{label}, seconds of its budget", enabled) as advance:
        search = Search(budget, advance)
        before_compiling.append(search.compiling)
        at_pause.extend([search.look] * looks)
        try:
            yield search
        finally:
            before_compiling.remove(search.compiling)
            if looks:
                at_pause.remove(search.look)
