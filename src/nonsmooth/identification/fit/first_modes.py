"""The mode in which each record begins: tried, where more than one is admissible and none was given.

In a relay with hysteresis, or behind a play, no state tells the mode. It is a discrete unknown of each record: over the
record's first window every other mode is tried whose conditions do not end it at once, at the unknowns as they are and
in the end with all of them free, and the one that fits best is taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import shortened
from nonsmooth.identification.fit.first_windows import states_from_samples
from nonsmooth.identification.fit.rough import alone
from nonsmooth.identification.fit.windows import Window, Windows
from nonsmooth.system.names import unknown

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["BETTER", "other_beginnings", "read_modes", "rechosen"]

BETTER = 9.0  # by which the sum of squares has to fall for another mode
_DRAWN = 12  # starts drawn for each mode
_FITTED = 2  # of these


def read_modes(system: System, given: Any, runs: Sequence[str]) -> list[tuple[int, ...]]:
    """The modes in which each run may begin, the first guess first: all, or the one that is given.

    Raises
    ------
    ValueError, TypeError
        A mode or a run that does not exist.
    """
    modes = list(system.modes)
    if given is None:
        return [tuple(range(len(modes)))] * len(runs)
    if isinstance(given, str):
        given = dict.fromkeys(runs, given)
    if not isinstance(given, Mapping):
        raise TypeError(f"mode = {shortened(given)}: allowed are the name of a mode, and a mapping of run to names")
    for run, name in given.items():
        if run not in runs:
            raise ValueError(f"mode: {unknown(run, 'a run', 'this recording', list(runs))}")
        if name not in modes:
            raise ValueError(f"mode: {unknown(name, 'a mode', repr(system.name), modes)}")
    return [(modes.index(given[run]),) if run in given else tuple(range(len(modes))) for run in runs]


def rechosen(problem: Windows, theta: FloatArray, starts: FloatArray) -> bool:
    """Begin each record in the mode that fits its first window best, in place; return whether one has changed."""
    changed = False
    for i, window in enumerate(problem.pieces):
        others = other_beginnings(problem, theta, starts, i)
        if others and (now := alone(problem, theta, [(window, starts[i])], 1)):
            best = min(others, key=lambda row: row[0])
            if (now[0][0] - best[0]) * len(window.readings[0]) > BETTER:
                problem.pieces[i], starts[i], changed = best[1], best[2], True
    return changed


def other_beginnings(
    problem: Windows, theta: FloatArray, starts: FloatArray, i: int
) -> list[tuple[float, Window, FloatArray]]:
    """A window at the beginning of its record in each other mode, its start fitted: mean squared residual, window,
    start."""
    window = problem.pieces[i]
    if window.first or len(problem.modes[window.record]) == 1:
        return []
    told = states_from_samples(problem, theta, problem.records[window.record], slice(0, 1))[0]
    told = np.append(told, np.full(len(window.start) - len(told), np.nan))
    known = np.isfinite(told) & (window.spread > 0)
    rng, found = np.random.default_rng(0), []
    for mode in problem.modes[window.record]:
        other, trials = replace(window, mode=mode), [starts[i], np.where(known, told, starts[i])]
        if mode == window.mode or not _stays(problem, theta, other, trials):
            continue
        reach = np.where(known, 0.0, 0.2) * window.spread
        trials += [trials[k % 2] + reach * rng.standard_normal(len(reach)) for k in range(_DRAWN if reach.any() else 0)]
        found += alone(problem, theta, [(other, z) for z in trials], _FITTED)[:1]
    return found


def _stays(problem: Windows, theta: FloatArray, window: Window, starts: list[FloatArray]) -> bool:
    """Return whether a motion may begin in the mode of this window: no condition ends it at once."""
    for start in starts:
        motion = problem.motion(theta, window, start)
        if motion is not None and int(motion.log.sample_mode[0]) == window.mode:
            return True
    return False
