"""The covariance of a fit over pieces: by the scatter of the scores, which correlate in time within a piece."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from nonsmooth.arrays import BoolArray, FloatArray
from nonsmooth.identification.arrow import inverted, reduced
from nonsmooth.identification.pieces import Fittable, State
from nonsmooth.identification.uncertainty import newey_west, not_below

__all__ = ["Sandwich", "sandwich"]


class Sandwich(NamedTuple):
    """State at the best fit, covariance (p, p), chi^2 per degree of freedom, samples that share an error.

    ``normal`` and ``back`` are those of :func:`nonsmooth.identification.arrow.reduced` there.
    """

    state: State
    covariance: FloatArray
    reduced: float
    correlation: float
    normal: FloatArray
    back: list[Any]


def sandwich(
    problem: Fittable, theta: FloatArray, starts: FloatArray, spread: float, used: BoolArray, prior: FloatArray,
    least: float = 0.0,
) -> Sandwich:  # fmt: skip
    """Covariance of the parameters, never smaller along any of them than that of white residuals of the same size.

    Parameters
    ----------
    theta, starts : array (p,), (n_pieces, n)
        The best fit.
    spread : float
        Standard deviation of a reading's instant (s).
    used : array of bool (n_pieces,)
    prior : array (p, p)
        Precision of what was known before.
    least : float
        See :func:`nonsmooth.identification.arrow.inverted`.
    """
    p = len(theta)
    state = problem.derivatives(theta, starts)
    weights = problem.weights(state, spread)
    normal, _, back = reduced(problem, state, weights, used, p)
    scores, rows, chi2 = [], [], 0.0
    for i, piece in enumerate(problem.pieces):
        if not used[i]:
            continue
        g, s = state.in_parameters[i] * weights[i][:, None], state.in_start[i] * weights[i][:, None]
        r = state.residuals[i] * weights[i]
        inverse, cross, _ = back[i]
        scores.append((piece, (g - s @ (inverse @ cross)), r))
        chi2 += float(r @ r)
        rows.append(len(r))
    freedom = max(sum(rows) - sum(piece.n_free for piece, _, _ in scores) - p, 1)
    size = chi2 / freedom
    tau = float(np.median([piece.correlation(r) for piece, _, r in scores]))
    meat = _meat(scores, p)
    inverse, _ = inverted(normal + prior, least)
    part = sum(rows) / freedom
    covariance = not_below(inverse @ (meat * part + prior) @ inverse, inverse @ (normal * size + prior) @ inverse)
    return Sandwich(state, covariance, size, tau, normal, back)


def _meat(scores: Sequence[tuple[Any, FloatArray, FloatArray]], p: int) -> FloatArray:
    """Sum of products of scores, over neighbours in time within pieces."""
    meat = np.zeros((p, p))
    for piece, g, r in scores:
        meat[np.ix_(piece.which, piece.which)] += newey_west(piece.by_instant(g * r[:, None]), piece.correlation(r))
    return meat
