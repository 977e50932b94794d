"""The neighbourhood of the optimum of a fit: a smaller sum of squares, or one that rises less than its parabola says.

The sum of squares of a motion with contacts has a smooth piece for every sequence of transitions, and derivatives tell
of their own piece alone: in the next one there may be another minimum, or nothing may depend on the unknown any more.
So each unknown is moved alone by some standard uncertainties. There a parabola has risen by the square of their number
or more, since the others do not follow; where it has risen by less, the fit is begun anew, and an unknown that may as
well lie there is in doubt: its uncertainty is told by its profile.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.identification.arrow import Unsettled, inverted, reduced, settle
from nonsmooth.identification.fit.first_level import BETTER, Stage
from nonsmooth.identification.fit.growth import Grown
from nonsmooth.identification.fit.windows import Windows

_AWAY = (2.0, 3.5, 5.0, 6.5, 8.0, 10.0, 12.0)  # standard uncertainties
_LESS = 0.5  # of the least rise of a parabola: below, there is another piece
_MOVES = 4  # from minimum to minimum, at most
_GAIN = 0.1  # of the sum of squares, in squares of the noise: less is the end of the iteration


def looked_beside(grown: Grown, finished: Callable[[Stage], Grown]) -> Grown:
    """The best of the minima found from one to the next, with the unknowns in doubt; ``finished`` is a fit's end."""
    for left in range(_MOVES, -1, -1):
        found = _beside(grown)
        better = _better(grown, found) if left else None
        if better is None:
            break
        try:
            grown = replace(finished(better), stuck=grown.stuck)
        except SolveError:
            break
    return replace(grown, doubted=tuple(dict.fromkeys(i for rise, i, _ in found if rise < BETTER)))


def _beside(grown: Grown) -> list[tuple[float, int, FloatArray]]:
    """Points where the sum of squares has risen less than a parabola, the lowest first: rise, unknown moved, place."""
    problem, theta, u = grown.problem, grown.theta, grown.problem.unknowns
    state = problem.residuals(theta, grown.starts, True)
    weights = problem.weights(state)
    covariance = inverted(reduced(problem, state, weights, len(theta))[0] + u.precision)[0]
    least, found = problem.cost(theta, grown.starts, weights), []
    here = _transitions(problem, theta, grown.starts)
    for i, error in enumerate(np.sqrt(np.maximum(np.diag(covariance), 0.0))):
        for side in (1.0, -1.0) if error > 0.0 else ():
            fars = [side * far for far in _AWAY if u.low[i] <= theta[i] + side * far * error <= u.high[i]]
            places = {far: np.where(np.arange(len(theta)) == i, theta[i] + far * error, theta) for far in fars}
            if fars and not problem.steady and _transitions(problem, places[fars[-1]], grown.starts) == here:
                fars = fars[-1:]  # the same piece as far as that
            for far in fars:
                rise = problem.cost(places[far], grown.starts, weights) - least
                if rise < _LESS * far**2:
                    found.append((rise, i, places[far]))
    return sorted(found, key=lambda row: row[0])


def _transitions(problem: Windows, theta: FloatArray, starts: FloatArray) -> list[list[int] | None]:
    """The transitions of each window's motion; None where it does not come to its end."""
    motions = [problem.motion(theta, window, start) for window, start in zip(problem.pieces, starts, strict=True)]
    return [None if one is None else one.log.crossing_transition.tolist() for one in motions]


def _better(grown: Grown, beside: list[tuple[float, int, FloatArray]]) -> Stage | None:
    """The better fit from the lowest of these points of each unknown; None where there is none."""
    lowest: dict[int, FloatArray] = {}
    for _, i, place in beside:
        lowest.setdefault(i, place)
    best, least = None, grown.problem.cost(grown.theta, grown.starts) - _GAIN
    for place in lowest.values():
        try:
            theta, starts, _ = settle(grown.problem, place, grown.starts)
        except Unsettled as reason:
            theta, starts = reason.values, reason.starts
        except SolveError:
            continue
        if (cost := grown.problem.cost(theta, starts)) < least:
            best, least = Stage(grown.problem, theta, starts), cost
    return best
