"""First guesses with their starts, from the beginnings of the records: where states are hidden, which no sample shows.

A short window shows little of a hidden state, and a long one has many minima. So unknowns and starts are drawn, those
that follow the first swing of each record best are fitted to it, and the fits that succeed are taken on over longer and
longer beginnings, which few wrong ones survive.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.identification.fit.first_level import Stage, settle_soft
from nonsmooth.identification.fit.first_windows import WIDE, first_windows, told_start
from nonsmooth.identification.fit.growth import POOR
from nonsmooth.identification.fit.window import Window
from nonsmooth.identification.fit.windows import Windows

_SPREAD = 0.5  # other first guesses lie within this factor, exp(+-0.5), of the one that was given
_GUESSES, _STARTS = 128, 8  # drawn; starts for each guess
_FITTED = 24  # of these guesses
_SWING, _LAST, _LONGER = 3.3, 16.0, 1.3  # the first beginning and the longest, in first windows; by how much they grow
_SAME = 1e-4  # of a start's spread: two fits nearer than that are one
_BEHIND = 10.0  # mean squared residual over that of the best, beyond which a fit is given up


def drawn(problem: Windows, rng: np.random.Generator) -> FloatArray:
    """Another first guess: around the given one, or within the bounds; phases at random."""
    u = problem.unknowns
    other = u.guess * np.exp(rng.uniform(-_SPREAD, _SPREAD, len(u.guess)))
    bounded = np.isfinite(u.low) & np.isfinite(u.high)
    other[bounded] = rng.uniform(u.low[bounded], u.high[bounded])
    other[len(other) - u.phases :] = rng.uniform(size=u.phases)
    clocks = [u.clock_place(run) for run in range(len(problem.records)) if u.clock]
    other[clocks] = u.guess[clocks]
    return np.clip(other, u.low, u.high)


def beginnings(
    problem: Windows, length: float, start: FloatArray | None, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray] | None:
    """Unknowns and starts (records, n_u) that follow the beginning of every record; None where none were found.

    ``length`` is that of first windows, ``start`` (records, n_u) a first guess of the starts.
    """
    first: dict[int, Window] = {}
    for window in first_windows(problem, problem.unknowns.guess, length, start, True):
        first.setdefault(window.record, window)
    windows = [window for window in first.values() if window.first == 0]
    if len(windows) < len(problem.records):
        return None
    times = _SWING
    tried = _best_drawn(_cut(problem, windows, times * length), rng)
    while tried:
        now = _cut(problem, windows, times * length)
        fitted: list[tuple[float, FloatArray, FloatArray]] = []
        size = np.array([np.where(window.spread > 0, window.spread, np.inf) for window in now.pieces])
        for theta, starts in tried:
            try:
                begun = now.of([replace(window, start=z) for window, z in zip(now.pieces, starts, strict=True)])
                found = settle_soft(Stage(begun, theta, starts))
            except SolveError:
                continue
            cost = float(np.mean(found.misfits))
            if all(np.max(np.abs(found.starts - others) / size) > _SAME for _, _, others in fitted):
                fitted.append((cost, found.theta, found.starts))
        least = min((cost for cost, _, _ in fitted), default=np.inf)
        tried = [(theta, z) for cost, theta, z in fitted if cost < _BEHIND * max(least, 1.0)]
        if times > _LAST or all(w.last == len(r.time) for w, r in zip(now.pieces, problem.records, strict=True)):
            best = min(fitted, key=lambda one: one[0], default=None)
            return None if best is None or best[0] > POOR else (best[1], best[2][:, : len(problem.system.states)])
        times *= _LONGER
    return None


def _cut(problem: Windows, windows: list[Window], length: float) -> Windows:
    """The problem with one window at the beginning of each record."""
    pieces = []
    for window, record in zip(windows, problem.records, strict=True):
        last = max(np.searchsorted(record.time, record.time[0] + length, "right"), window.last)
        pieces.append(window.cut(record, last))
    return problem.of(pieces)


def _best_drawn(problem: Windows, rng: np.random.Generator) -> list[tuple[FloatArray, FloatArray]]:
    """Guesses and starts (records, n), of those drawn, that follow the beginnings best before any fit."""
    found = []
    for k in range(_GUESSES):
        theta = drawn(problem, rng) if k else problem.unknowns.guess
        total, starts = 0.0, np.empty_like(problem.starts)
        for i, window in enumerate(problem.pieces):
            told = told_start(problem, theta, window)
            known, least = np.isfinite(told), np.inf
            size = np.where(known, 0.0, window.spread / WIDE)
            for j in range(_STARTS):
                z = np.where(known, told, window.start) + (size * rng.standard_normal(len(size)) if k or j else 0.0)
                one = problem.of([replace(window, start=z)])
                cost = Stage(one, theta, z[None, :]).misfits[0]
                if not cost >= least:
                    least, starts[i] = cost, z
            total += least
        if np.isfinite(total):
            found.append((total, theta, starts))
    found.sort(key=lambda one: one[0])
    return [(theta, starts) for _, theta, starts in found[:_FITTED]]
