"""Attractors found among runs, not given: which runs ended on the same one, and what each of them is.

Runs with a certified period belong to one cycle where they end on its section points, in the modes that it has there;
Newton's method confirms the cycle where it can. Runs without a period are not taken at their word: see
``basins_candidate``. The other such runs belong to an attractor without a period where their next points lie among its
own; else they are run on. What is still on its way after all that has no attractor: it is never counted as one.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from nonsmooth.attractors.basins_candidate import CandidateSearch, among
from nonsmooth.attractors.basins_found import Attractor, Patience
from nonsmooth.attractors.basins_newton import STEP, Cycle, confirmed_cycle, exponent_on
from nonsmooth.attractors.settled import Settled, half_ranges
from nonsmooth.attractors.settler import Settler
from nonsmooth.attractors.standing import label_standing
from nonsmooth.flow.engines.engine import FloatArray, IntArray
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.judging.judge import ALONG

NOT_CONVERGED, DIVERGED = -1, -2  # labels of starts without an attractor
SAME = 1e-5  # of the motion's size: runs that end this near to a cycle's point are on it
STILL = (codes.NOT_PERIODIC, codes.SLOW)


def find_attractors(
    settler: Settler, point: FloatArray, runs: Settled, patience: Patience, known: list[Attractor] | None = None
) -> tuple[list[Attractor], IntArray, IntArray]:
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
    status : array (J,)
        Of each run at its end.
    """
    found = list(known or [])
    labels = np.full(len(runs.status), NOT_CONVERGED, dtype=np.int64)
    status = runs.status.copy()
    labels[status == codes.DIVERGED] = DIVERGED
    every = np.arange(len(labels))
    label_standing(settler, point, runs, every, found, labels, status)
    _label_cycles(settler, point, runs, every, found, labels)
    wandering = np.flatnonzero(np.isin(status, STILL))
    places, modes = runs.last[wandering].copy(), runs.mode[wandering].copy()
    search = CandidateSearch(replace(settler, device="cpu"), point, patience, found)  # it makes single runs
    for _ in range(patience.rounds):
        places, modes, wandering = _join(search, places, modes, wandering, labels, status)
        if search.hopeless:  # motion that nothing draws in, as without damping: waiting changes nothing
            settling = status[wandering] == codes.SLOW
            places, modes, wandering = places[settling], modes[settling], wandering[settling]
        if not len(wandering):
            break
        # what belongs to nothing known yet is run on; some of it becomes periodic
        on = replace(settler, transient=patience.more).run(
            point, np.zeros(len(wandering), dtype=np.int64), places, modes=modes, begin=settler.section_phase
        )
        status[wandering] = on.status
        labels[wandering[on.status == codes.DIVERGED]] = DIVERGED
        label_standing(settler, point, on, wandering, found, labels, status)
        _label_cycles(settler, point, on, wandering, found, labels)
        left = np.isin(on.status, STILL)
        places, modes, wandering = on.last[left], on.mode[left], wandering[left]
    return found, labels, status


def _label_cycles(
    settler: Settler, point: FloatArray, runs: Settled, which: IntArray, found: list[Attractor], labels: IntArray
) -> None:
    """Label the runs that ended on a cycle; cycles not met before become attractors."""
    open_ = np.isin(runs.status, (codes.OK, codes.NOT_GUARANTEED)) & (runs.period_number > 0) & (labels[which] < 0)
    for number, attractor in enumerate(found):
        if attractor.period_number and attractor.standing is None:
            same = open_ & _on_cycle(attractor, runs)
            labels[which[same]] = number
            open_ &= ~same
    while open_.any():
        first = int(np.argmax(open_))
        attractor = _cycle(settler, point, runs[first : first + 1])
        same = open_ & _on_cycle(attractor, runs)
        same[first] = True
        labels[which[same]] = len(found)
        open_ &= ~same
        if np.isfinite(attractor.held).any():  # the extent of all that were met
            maximum, minimum = runs.maximum[same].max(axis=0), runs.minimum[same].min(axis=0)
            attractor = replace(attractor, maximum=maximum, minimum=minimum)
        found.append(attractor)


def _on_cycle(attractor: Attractor, runs: Settled) -> Any:
    """Marks of runs that ended on this cycle: on one of its points, in the mode that it has there.

    Cycles on which friction holds the same states, at rest or on a belt, are one attractor, wherever it holds them.
    Extremes would not tell: the cycle that is shifted by a part of its period has the same ones."""
    n = attractor.points.shape[1]
    if np.isfinite(attractor.held).any():
        moved, still = runs.maximum - runs.minimum, np.nan_to_num(attractor.held, nan=1.0) == 0.0
        alike = np.isnan(attractor.held) | (np.abs(moved - attractor.held) <= SAME * attractor.size)
        return (
            (runs.period_number == attractor.period_number)
            & (alike & ((moved == 0.0) == still)).all(axis=1)
            & np.isin(runs.mode, attractor.modes)
        )
    gap = np.abs(np.nan_to_num(runs.last[:, None, :n] - attractor.points) / attractor.size).max(axis=2)
    k = gap.argmin(axis=1)
    return (
        (runs.period_number == attractor.period_number)
        & (gap[np.arange(len(k)), k] <= SAME)
        & (runs.mode == attractor.modes[k])
    )


def _held(settler: Settler, point: FloatArray, place: FloatArray, mode: int, p: int, size: FloatArray) -> Any:
    """Marks of states (n,) that are as far beside the cycle after p returns as before: friction holds them there."""
    n, ends = len(size), []
    off = STEP * np.vstack([np.zeros(n), np.diag(size)])
    for one in off:
        run = settler.trace(point, place + np.pad(one, (0, len(place) - n)), mode, 0, p)
        ends.append((run.points[-1] if len(run.points) else np.nan) - place[:n] - one)
    return np.maximum(np.abs(ends[0]), np.abs(np.diag(ends[1:]))) <= ALONG * STEP * size


def _cycle(settler: Settler, point: FloatArray, run: Settled) -> Attractor:
    """The attractor of one run that ended on a cycle."""
    p, place, mode = int(run.period_number[0]), run.last[0], int(run.mode[0])
    n = run.maximum.shape[1]
    least = settler.least_at(run.maximum[0], run.minimum[0])
    size = half_ranges(run.maximum[0], run.minimum[0], least)
    cycle = confirmed_cycle(settler, point, place, mode, p, size)
    held, confirmed = np.full(n, np.nan), cycle is not None
    if cycle is None:
        moved = run.maximum[0] - run.minimum[0]
        beside = settler.plan.indicator < 0 and _held(settler, point, place, mode, p, size)
        held = np.where((moved == 0.0) | beside, moved, np.nan)  # neighbours stand beside it
        once = settler.trace(point, place, mode, 0, p)
        if len(once.points):
            cycle = Cycle(once.points, once.modes, float(run.multiplier[0]), float(once.times[-1]), once.end, once.mode)
        else:
            cycle = Cycle(place[None, :n], run.mode[:1], float(run.multiplier[0]), np.nan, place, mode)
    return Attractor(
        p,
        cycle.points,
        cycle.modes,
        cycle.end,
        cycle.mode,
        run.maximum[0],
        run.minimum[0],
        cycle.multiplier,
        exponent_on(cycle),
        0.0,
        least,
        confirmed,
        held=held,
    )


def _join(
    search: CandidateSearch, places: FloatArray, modes: IntArray, which: IntArray, labels: IntArray, status: IntArray
) -> tuple[FloatArray, IntArray, IntArray]:
    """Label runs whose next points lie on an attractor that is no short cycle; try new candidates; return the rest."""
    found, left = search.found, np.ones(len(which), dtype=bool)
    search.tried = 0
    for j in range(len(which)):
        run = search.settler.trace(search.point, places[j], int(modes[j]), 0, search.patience.window)
        if len(run.points):
            places[j], modes[j] = run.end, run.mode
        number = among(run.points, found)
        if number is None and status[which[j]] == codes.NOT_PERIODIC and len(run.points):
            candidate = search.candidate(places[j], int(modes[j]))
            if candidate is not None:
                number = next((k for k, other in enumerate(found) if _overlap(candidate, other)), len(found))
                if number == len(found):
                    found.append(candidate)
        if number is not None:
            labels[which[j]] = number
            left[j] = False
    return places[left], modes[left], which[left]


def _overlap(a: Attractor, b: Attractor) -> bool:
    return b.tree is not None and among(a.points, [b]) == 0
