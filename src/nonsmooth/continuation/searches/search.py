"""A search with a budget: its time is counted, shown as a bar, and comes to an end."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.flow.engines.engine import Log, State
from nonsmooth.kernels import before_compiling
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.progress import Progress
from nonsmooth.results.progress import progress as progress_bar

if TYPE_CHECKING:
    from nonsmooth.flow.engines.loop import Engine

__all__ = ["Search", "search_within"]

MOMENT, LONGEST = 0.25, 2.0  # seconds of a processor between two looks at the time
PART = 0.6180339887498949 / 40  # of a run: no event of a motion lies just where it is cut


class Search:
    """Seconds of a processor that this thread has spent, compiling apart; :meth:`look` counts them and ends the search.

    Attributes
    ----------
    doing : str
        What the search is at, for the message.
    """

    def __init__(self, budget: float, advance: Callable[[int], None]) -> None:
        self.budget, self.spent, self.doing = budget, 0.0, "letting the motion settle"
        self._advance, self._shown = advance, 0
        self._compiled, self._since = False, time.thread_time()
        self._pace = np.inf  # units of time marched in a second

    def look(self) -> float:
        """Count the time since the last look; the seconds, NaN where kernels were compiled in them.

        Raises
        ------
        SolveError
            The budget is spent.
        """
        now = time.thread_time()
        took, self._since = now - self._since, now
        if self._compiled:
            self._compiled = False
            return np.nan
        self.spent += took
        if int(self.spent) > self._shown:
            self._advance(int(self.spent) - self._shown)
            self._shown = int(self.spent)
        if self.spent > self.budget:
            raise SolveError(
                f"no periodic orbit was found in the budget of {self.budget:g} s of processor time, spent while "
                f"{self.doing}. Give a start nearer to the orbit, a shorter transient, a smaller max_period, or a "
                "larger budget=",
                status="budget",
            )
        return took

    def compiling(self, name: str) -> None:
        """A kernel is compiled: the time until the next look does not count."""
        self._compiled = True

    def in_pieces(self, length: float, march: Callable[[float], bool]) -> None:
        """Call ``march(piece)``, which says whether to go on, with equal parts of a length.

        Only of slow motions, whose parts would take seconds, are they shorter: where a run is cut its rounding
        differs, and what is found should not depend on how busy the machine is."""
        done = 0.0
        while done < length:
            piece = min(length * PART, length - done)
            if piece > LONGEST * self._pace:
                piece = MOMENT * self._pace
            rest = length - done - piece
            if rest < 1e-9 * length:
                piece, rest = length - done, 0.0
            self.look()
            if not march(piece):
                return
            done = length - rest
            took = self.look()
            if np.isfinite(took):
                self._pace = piece / max(took, 1e-4)

    def record(self, engine: Engine, tables: Any, state: State, until: float, samples: FloatArray) -> Log:
        """``engine.record`` in pieces; its log stops where it failed."""
        logs: list[Log] = []
        given = 0

        def march(piece: float) -> bool:
            nonlocal given
            begin = float(state.clock[0])
            stop = until if until - begin <= piece * (1.0 + 1e-9) else begin + piece
            count = len(samples) if stop == until else int(np.searchsorted(samples, stop, side="right"))
            state.settled = False  # an event at the cut itself is taken as at any start
            logs.append(engine.record(tables, state, stop, samples[given:count]))
            given = count
            return logs[-1].status in (codes.OK, codes.NOT_GUARANTEED)

        self.in_pieces(until - float(state.clock[0]), march)
        return _joined(logs)


@contextmanager
def search_within(budget: float, label: str, enabled: Progress) -> Iterator[Search]:
    """A search for a ``with`` block; the bar shows how much of the budget is spent."""
    with progress_bar(max(1, int(budget)), f"{label}, seconds of its budget", enabled) as advance:
        search = Search(budget, advance)
        before_compiling.append(search.compiling)
        try:
            yield search
        finally:
            before_compiling.remove(search.compiling)


def _joined(logs: list[Log]) -> Log:
    """Join the logs of segments that follow each other."""
    if len(logs) == 1:
        return logs[0]
    before = np.cumsum([0, *(len(log.crossing_time) for log in logs[:-1])])
    for log, n in zip(logs, before, strict=True):
        log.sample_segment = log.sample_segment + int(n)
    arrays = [item.name for item in fields(Log) if item.name not in ("status", "message")]
    worst = [log.status for log in logs if log.status != codes.OK]  # at most the last has failed
    return Log(
        **{name: np.concatenate([getattr(log, name) for log in logs]) for name in arrays},
        status=worst[-1] if worst else codes.OK, message=logs[-1].message,
    )  # fmt: skip
