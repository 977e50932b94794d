"""Arguments of continuation: the step, and the range of a parameter, cut to what the equations allow."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.kinds import at_least
from nonsmooth.system.system import System

GRID = 65
INSIDE = 1e-3  # of the range: the equations are singular at the edge itself


#: The largest step along a branch, whose own size is 1.
LargestStep = Annotated[float, at_least(1e-9, 1.0), "the branch's own size is 1"]


def limits(
    system: System, name: str, given: tuple[float, float], here: float | None, *, what: str = "the orbit"
) -> tuple[float, float]:
    """The range given for a parameter; ``here``: where ``what`` lies, which must be within it."""
    if name not in system.values:
        system.with_parameters({str(name): 0.0})  # raises with the names there are
    low, high = given
    if here is not None and not low <= here <= high:
        raise ValueError(f"{what} lies at {name} = {here!r}, outside the range {low!r} ... {high!r}")
    return low, high


def allowed_range(system: System, name: str, low: float, high: float) -> tuple[float, float]:
    """The range from the system's own value outwards, cut where the equations stop allowing the parameter.

    A denominator that passes through zero, the root of a negative number, a period that is not positive.
    """
    here = min(max(system.values[name], low), high)
    return _end(system, name, here, low), _end(system, name, here, high)


def _end(system: System, name: str, here: float, end: float) -> float:
    """The farthest value from ``here`` towards ``end``."""
    if here == end:
        return end
    values = np.linspace(here, end, GRID)
    if here * end < 0.0:  # an interval that holds zero must try it: that is where most denominators vanish
        values = np.insert(values, int(np.searchsorted(np.abs(values - here), abs(here))), 0.0)
    good = here
    for value in values:
        if not _allowed(system, name, float(value)):
            break
        good = float(value)
    else:
        return end
    bad = float(value)
    for _ in range(60):
        middle = 0.5 * (good + bad)
        if _allowed(system, name, middle):
            good = middle
        else:
            bad = middle
    return good + INSIDE * (here - end)


def _allowed(system: System, name: str, value: float) -> bool:
    try:
        system.with_parameters({name: value})
    except SystemDefinitionError:
        return False
    return True
