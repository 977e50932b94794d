"""Directions of the sensors: which way each counts, read off the recordings, and all runs brought to one convention.

The convention: the position grows towards the support, and the force sensor reads positive where it pulls the car
that way. A rotary sensor with its string the other way round, or a force sensor that is pushed in place of pulled,
counts the other way, and no notebook says so. The support shows it: it pushes a car only away from itself, and harder
than the springs do, so the largest accelerations of a run with contact point away from it. A pull then shows the force
sensor's direction: the force of a spring grows with its displacement.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import linregress

if TYPE_CHECKING:
    from nonsmooth_savi2007.identification.evidence import Run

#: Procedures in which the car may meet the support.
_AT_SUPPORT = ("contact", "grazing", "section", "rise", "response")
_LAG = 0.03  # s: over which an acceleration is taken, a third of a contact
_SHARE = 0.002  # of the samples that may be faster than "the largest"
_HARDER = 1.8  # times: so much larger are accelerations away from the support than towards it
_FOLLOWS = 0.5  # least correlation of force and displacement of a pull


def oriented(runs: Mapping[str, tuple[Run, ...]]) -> tuple[dict[str, tuple[Run, ...]], int, tuple[str, ...]]:
    """The runs with positions that grow towards the support and forces that pull that way, and what was turned.

    The direction of the rotary sensor (-1: away from the support) and sentences on what was turned come with them.

    Raises
    ------
    ValueError
        If the runs contradict one another, or the recordings of springs and support look swapped.
    """
    found, notes = dict(runs), []
    sign, sentence = towards_support([run for name in _AT_SUPPORT for run in runs.get(name, ())])
    if sign < 0:
        found = {
            name: tuple(run if run.x is None else replace(run, x=run.x.copy(data=-run.x.values)) for run in rows)
            for name, rows in found.items()
        }
        notes.append(sentence)
    _swapped(found)
    for name in ("springs", "support"):
        rows = found.get(name, ())
        against = [run.name for run in rows if _slope(run) < 0]
        if against:
            found[name] = tuple(
                replace(run, force=run.force.copy(data=-run.force.values)) if run.name in against else run
                for run in rows
            )
            which = "all" if len(against) == len(rows) else ", ".join(against)
            notes.append(
                f"{name}: the force sensor counts against the displacement in {len(against)} of {len(rows)} runs "
                f"({which}): it was pushed where a pull is positive, or mounted the other way round; its "
                "readings are taken with the other sign there"
            )
    if backwards := [run.label for rows in runs.values() for run in rows if run.backwards]:
        notes.append(
            f"the photogate counts backwards in {len(backwards)} runs ({few(backwards)}): only the times of channel "
            "'Turn' are used, which is right whichever way the motor turns"
        )
    return found, -1 if sign < 0 else 1, tuple(notes)


def towards_support(runs: Sequence[Run]) -> tuple[int, str]:
    """1 where positions grow towards the support, -1 where they fall, 0 where no run shows it; and a sentence.

    Raises
    ------
    ValueError
        If the runs contradict one another.
    """
    votes = {run: _vote(run) for run in runs if run.x is not None and run.mounted}
    up, down = ([run.label for run, vote in votes.items() if vote == sign] for sign in (1, -1))
    if min(len(up), len(down)) > 0.2 * (len(up) + len(down)):
        raise ValueError(
            f"the support pushes the car towards falling positions in {len(up)} runs ({few(up)}) and towards growing "
            f"ones in {len(down)} ({few(down)}): the rotary sensor counts one way in some runs and the other way in "
            "others. Give the runs of one direction, or turn the sign of channel 'Angle' in the others' files"
        )
    if len(down) > len(up):
        return -1, (
            f"the rotary sensor counts away from the support: in {len(down)} of {len(up) + len(down)} runs with "
            "contact the support pushes the car towards growing positions; channel 'Angle' is taken with the other "
            "sign in all runs"
        )
    return (1, "") if up else (0, "")


def _vote(run: Run) -> int:
    """1 where the largest accelerations point towards falling positions, -1 towards growing ones, 0 where neither."""
    time, x = run.time, run.positions
    lag = max(1, round(_LAG / np.median(np.diff(time)))) if len(time) > 1 else 1
    if len(x) < 20 * lag:
        return 0
    low, high = np.quantile(x[2 * lag :] - 2 * x[lag:-lag] + x[: -2 * lag], (_SHARE, 1 - _SHARE))
    if -low > _HARDER * high:
        return 1
    return -1 if high > -_HARDER * low else 0


def _swapped(runs: Mapping[str, tuple[Run, ...]]) -> None:
    slopes = {name: [abs(_slope(run)) for run in runs.get(name, ())] for name in ("springs", "support")}
    springs, support = (np.median([s for s in slopes[name] if s > 0] or [np.nan]) for name in slopes)
    if springs > support:
        raise ValueError(
            f"the pulls of 'springs' have a slope of {springs:.3g} N/m and the pushes of 'support' one of "
            f"{support:.3g} N/m: a support that is softer than the car's springs. Their recordings look swapped: check "
            "`file` and `procedure` of both in the notebook"
        )


def _slope(run: Run) -> float:
    """Force over displacement (N/m) by least squares; 0 where the force does not follow the displacement."""
    if run.x is None or run.force is None or run.x.size != run.force.size or run.x.size < 3:
        return 0.0
    x, force = run.positions, run.force.values
    if np.ptp(x) == 0 or np.ptp(force) == 0:
        return 0.0
    line = linregress(x, force)
    return line.slope if abs(line.rvalue) > _FOLLOWS else 0.0


def few(names: Sequence[str]) -> str:
    """The first three names."""
    return ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
