"""Rough fits on the way to the last one: of all windows together, and of one alone, at given parameters."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.identification.fit.windows import Window, Windows
from nonsmooth.identification.pieces import State

__all__ = ["alone", "level", "misfits", "own_size"]

def level(
    problem: Windows, theta: FloatArray, starts: FloatArray, used: Any = None
) -> tuple[FloatArray, FloatArray, State]:
    """A rough fit on the way, in which the parameters are known to about their own size.

    What windows so short do not tell then stays where it is: a coefficient of restitution of 1e8, tried where hardly an
    impact was seen, makes a motion of hours.
    """
    if not np.isfinite(np.concatenate(problem.residuals(theta, starts).residuals)).all():
        raise SolveError("a motion over longer windows does not come to its end")
    known = problem.unknowns.precision + np.diag(own_size(problem) ** -2.0)
    return problem.settle(theta, starts, used, known, rough=True)


def own_size(problem: Windows) -> FloatArray:
    guess = problem.unknowns.guess
    return np.where(guess != 0.0, np.abs(guess), np.inf)


def misfits(problem: Windows, state: State) -> FloatArray:
    """Mean squared residual over the noise, of each window."""
    return np.array([float(np.mean((r / problem.noise[w.readings[1]]) ** 2)) for w, r in problem.rows(state)])


def alone(
    problem: Windows, theta: FloatArray, trials: list[tuple[Window, FloatArray]], most: int
) -> list[tuple[float, Window, FloatArray]]:
    """Of these windows with starts, those that fit best before their starts are fitted, fitted; the best first."""
    fixed = replace(problem, unknowns=replace(problem.unknowns, low=theta, high=theta, centre=theta))
    costs = []
    for window, start in trials:
        one = fixed.of([window])
        costs.append(float(misfits(one, one.residuals(theta, start[None, :]))[0]))
    found = []
    for k in np.argsort(costs, kind="stable")[:most]:
        window, start = trials[k]
        one = fixed.of([replace(window, start=start)])
        try:
            _, moved, state = level(one, theta, start[None, :])
        except SolveError:
            continue
        found.append((float(misfits(one, state)[0]), one.pieces[0], moved[0]))
    return sorted(found, key=lambda row: row[0])
