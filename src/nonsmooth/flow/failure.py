"""The error for a single run that did not come to its end; where there are many, each keeps a status instead."""

from __future__ import annotations

from typing import Any

from nonsmooth.errors import SolveError
from nonsmooth.kernels import codes

__all__ = ["solve_error"]

BEYOND_STOP = (
    "the start lies beyond a stop: a transition with a reset holds there already; "
    "start on the admissible side of its indicator"
)


def solve_error(code: int, **where: Any) -> SolveError:
    """The error for a kernel's code; ``where`` (time, state, mode) as :class:`SolveError` takes it."""
    from nonsmooth.results.statuses import by_code

    if code == codes.BEYOND_STOP:
        return SolveError(BEYOND_STOP, status="beyond_stop", **where)
    status = by_code(code)
    return SolveError(status.sentence, status=status.name, **where)
