"""Attractors found among runs, not given: which runs ended on the same one, and what each of them is.

Runs with a certified period are one attractor where period number and extremes agree. Runs without a period are not
taken at their word: a candidate is run for a long time, over which it must neither settle to a cycle nor leave the
places it has visited before (recurrence, in cells of the section); its exponent says whether it is chaotic. The other
such runs belong to it where their next points lie among its own; else they are run on. What is still on its way after
all that has no attractor: it is never counted as one.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from nonsmooth.analysis.attractors import Settler
from nonsmooth.analysis.settled import Settled
from nonsmooth.flow.engine import FloatArray, IntArray
from nonsmooth.kernels import codes

__all__ = ["DIVERGED", "NOT_CONVERGED", "Attractor", "Patience", "find_attractors"]

NOT_CONVERGED, DIVERGED = -1, -2  # labels of starts without an attractor
SAME = 1e-6  # cycles whose extremes agree to this part of the motion's size are one
CELLS = 40  # cells along the section's extent in which recurrence is judged
NEAR = 0.02  # of the attractor's size: section points nearer than this belong to it
MOSTLY = 0.95
LEAST_EXPONENT = 1e-3  # per return: a faster contraction than this ends on a cycle
LONGEST = 1024  # period number looked for where the exponent says that there is a cycle
LONG_RETURN = 1e-8


@dataclass(frozen=True)
class Patience:
    """How long runs without a period are followed, in section returns."""

    candidate: int = 20_000  # for a candidate for a chaotic attractor
    more: int = 1000  # between two looks at the other runs
    rounds: int = 10  # of such looks
    exponent: int = 4000
    window: int = 60  # points compared with an attractor's


@dataclass(frozen=True)
class Attractor:
    """One attractor on the section.

    ``period_number`` is 0 where it is no cycle; ``points`` are its section points (a sample of them then).
    ``exponent`` is the largest Lyapunov exponent per unit time, ``multiplier`` the largest multiplier of a cycle (else
    NaN).
    """

    period_number: int
    points: FloatArray  # (k, n)
    mode: int
    maximum: FloatArray  # (n,)
    minimum: FloatArray
    multiplier: float
    exponent: float
    exponent_error: float
    least: FloatArray  # (n,): a motion smaller than this is one that has come to rest
    tree: Any = field(default=None, repr=False, compare=False)

    @property
    def size(self) -> FloatArray:
        """Half the range of each state on it, and no less than a small part of the states' scales."""
        return np.maximum(0.5 * (self.maximum - self.minimum), self.least)


def find_attractors(
    settler: Settler, point: FloatArray, runs: Settled, patience: Patience, known: list[Attractor] | None = None
) -> tuple[list[Attractor], IntArray]:
    """Attractors of J runs at one parameter point, and the label of each run.

    Parameters
    ----------
    point : array (1, n_parameters)
    known : list, optional
        Attractors to begin with (their indices stay).

    Returns
    -------
    attractors : list of Attractor
        In the order in which they were met.
    labels : array (J,)
        Index of the attractor; -1 not converged, -2 diverged.
    """
    found = list(known or [])
    labels = np.full(len(runs.status), NOT_CONVERGED, dtype=np.int64)
    labels[runs.status == codes.DIVERGED] = DIVERGED
    _label_cycles(settler, point, runs, np.arange(len(labels)), found, labels)
    wandering = np.flatnonzero((runs.status == codes.NOT_PERIODIC) | (runs.status == codes.SLOW))
    places, modes = runs.last[wandering].copy(), runs.mode[wandering].copy()
    chaotic = runs.status[wandering] == codes.NOT_PERIODIC
    for _ in range(patience.rounds):
        places, modes, wandering, chaotic = _join(
            settler, point, places, modes, wandering, chaotic, found, labels, patience
        )
        if not len(wandering):
            break
        # what belongs to nothing known yet is run on; some of it becomes periodic
        on = _longer(settler, patience.more).run(
            point, np.zeros(len(wandering), dtype=np.int64), places, modes=modes, begin=settler.section_phase
        )
        labels[wandering[on.status == codes.DIVERGED]] = DIVERGED
        _label_cycles(settler, point, on, wandering, found, labels)
        left = (on.status == codes.NOT_PERIODIC) | (on.status == codes.SLOW)
        places, modes, wandering = on.last[left], on.mode[left], wandering[left]
        chaotic = on.status[left] == codes.NOT_PERIODIC
        if not len(wandering):
            break
    return found, labels


def _longer(settler: Settler, transient: int) -> Settler:
    return replace(settler, transient=transient)


def _label_cycles(
    settler: Settler, point: FloatArray, runs: Settled, which: IntArray, found: list[Attractor], labels: IntArray
) -> None:
    """Label the runs that ended on a cycle; cycles not met before become attractors."""
    extremes = np.concatenate([runs.maximum, runs.minimum], axis=1)
    open_ = np.isin(runs.status, (codes.OK, codes.NOT_GUARANTEED)) & (runs.period_number > 0)
    for number, attractor in enumerate(found):
        if attractor.period_number:
            same = open_ & _same_cycle(attractor, runs.period_number, extremes)
            labels[which[same]] = number
            open_ &= ~same
    while open_.any():
        first = int(np.argmax(open_))
        attractor = _cycle(settler, point, runs[first : first + 1])
        same = open_ & _same_cycle(attractor, runs.period_number, extremes)
        same[first] = True
        labels[which[same]] = len(found)
        open_ &= ~same
        found.append(attractor)


def _same_cycle(attractor: Attractor, period: IntArray, extremes: FloatArray) -> Any:
    own = np.concatenate([attractor.maximum, attractor.minimum])
    slack = SAME * np.concatenate([attractor.size, attractor.size])
    # a cycle that is approached slowly is known less well
    return (period == attractor.period_number) & (np.abs(extremes - own) <= 10 * slack).all(axis=1)


def _cycle(settler: Settler, point: FloatArray, run: Settled) -> Attractor:
    """The attractor of one run that ended on a cycle."""
    p, mode = int(run.period_number[0]), int(run.mode[0])
    points, _, _, elapsed = settler.trace(point, run.last[0], mode, 0, p)
    multiplier = float(run.multiplier[0])
    with np.errstate(divide="ignore"):
        exponent = float(np.log(multiplier) / elapsed) if multiplier >= 0.0 else np.nan
    return Attractor(p, points, mode, run.maximum[0], run.minimum[0], multiplier, exponent, 0.0, settler.least)


def _join(
    settler: Settler, point: FloatArray, places: FloatArray, modes: IntArray, which: IntArray, chaotic: Any,
    found: list[Attractor], labels: IntArray, patience: Patience,
) -> tuple[FloatArray, IntArray, IntArray, Any]:  # fmt: skip
    """Label runs whose next points lie on an attractor that is no cycle; try new candidates; return what is left."""
    left = np.ones(len(which), dtype=bool)
    tried = 0
    for j in range(len(which)):
        points, last, mode, _ = settler.trace(point, places[j], int(modes[j]), 0, patience.window)
        if len(points):
            places[j], modes[j] = last, mode
        number = _among(points, found)
        if number is None and chaotic[j] and tried < 3 and len(points):
            candidate = _candidate(settler, point, places[j], int(modes[j]), patience)
            tried += candidate is None
            if candidate is not None:
                number = next((k for k, other in enumerate(found) if _overlap(candidate, other)), len(found))
                if number == len(found):
                    found.append(candidate)
        if number is not None:
            labels[which[j]] = number
            left[j] = False
    return places[left], modes[left], which[left], chaotic[left]


def _among(points: FloatArray, found: list[Attractor]) -> int | None:
    """The attractor without a period on which nearly all these points lie."""
    for number, attractor in enumerate(found):
        if attractor.tree is None or not len(points):
            continue
        gap, _ = attractor.tree.query(points / attractor.size, p=np.inf)
        if (gap < NEAR).mean() >= MOSTLY:
            return number
    return None


def _overlap(a: Attractor, b: Attractor) -> bool:
    return b.tree is not None and _among(a.points, [b]) == 0


def _long_period(points: FloatArray, size: FloatArray) -> int:
    """The least period number up to LONGEST of the last points, 0: none."""
    scaled = points / size
    for p in range(1, min(LONGEST, len(points) // 2)):
        if np.abs(scaled[-p:] - scaled[-2 * p : -p]).max() <= LONG_RETURN:
            return p
    return 0


def _candidate(
    settler: Settler, point: FloatArray, start: FloatArray, mode: int, patience: Patience
) -> Attractor | None:
    """A long run as an attractor, where it is one: recurrent, and no cycle that a longer wait would find."""
    from scipy.spatial import cKDTree

    settler = replace(settler, device="cpu")  # a single run
    points, last, mode, _ = settler.trace(point, start, mode, 0, patience.candidate)
    if not len(points):
        return None
    checked = settler.run(point, [0], last[None], modes=[mode], begin=settler.section_phase)
    if checked.status[0] != codes.NOT_PERIODIC:
        return None
    half = len(points) // 2
    low, width = points.min(axis=0), np.maximum(np.ptp(points, axis=0), 1e-300)
    cells = np.minimum(((points - low) / width * CELLS).astype(np.int64), CELLS - 1)
    keys = cells @ (CELLS ** np.arange(points.shape[1]))
    if np.isin(keys[half:], keys[:half]).mean() < MOSTLY or np.isin(keys[:half], keys[half:]).mean() < MOSTLY:
        return None
    exponents, errors = settler.exponents(point, [0], last[None], [mode], patience.exponent)
    size = np.maximum(0.5 * (checked.maximum[0] - checked.minimum[0]), settler.least)
    period = 0
    if exponents[0] < -3.0 * errors[0] - LEAST_EXPONENT / settler.period(point):
        period = _long_period(points, size)
        if not period:
            return None
        points = points[-period:]
        half = 0
    return Attractor(
        period, points[half:], mode, checked.maximum[0], checked.minimum[0], np.nan, float(exponents[0]),
        float(errors[0]), settler.least, cKDTree(points / size),
    )  # fmt: skip
