r"""The arrow-shaped normal equations of multiple shooting: starts eliminated piece by piece, parameters kept.

.. math::

    \Big(P + \sum_s G_s^T G_s - G_s^T S_s (S_s^T S_s)^{-1} S_s^T G_s\Big) \delta\theta = \ldots

with G, S the residuals' derivatives in the parameters and in a piece's start, and P the precision of what is known.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.identification.pieces import Fittable, State

__all__ = ["LEAST", "Unsettled", "inverted", "reduced", "settle"]

LEAST = 1e-13  # eigenvalue of the scaled normal matrix from which a direction of a fit counts as determined
_SETTLED = 1e-3  # of a standard uncertainty
_RIDGE = 1e-13  # of a start's column: what keeps a start that is known or not seen from being divided by
_LITTLE = 1e-4  # of the sum of squares: what a rough fit leaves to be gained
_ACCURACY = 0.05  # of a standard uncertainty: how near the minimum is told where the derivatives' accuracy ends


class Unsettled(SolveError):
    """A fit that did not settle; ``distance``: how far its minimum seems, in standard uncertainties.

    Of the parameters first, then of each piece's start. ``step``: what is left of the way, in the parameters;
    ``values`` and ``starts``: where it stood.
    """

    def __init__(
        self, message: str, distance: FloatArray, step: FloatArray, values: FloatArray, starts: FloatArray
    ) -> None:
        super().__init__(message)
        self.distance, self.step, self.values, self.starts = distance, step, values, starts


def reduced(
    problem: Fittable, state: State, weights: list[FloatArray], used: Any, p: int, damping: float = 0.0
) -> tuple[Any, ...]:
    """Normal equations without the starts, and what gives the starts' steps back; ``damping`` is that of the starts.

    By an orthogonal factorization of each piece: squares of a chaotic motion's derivatives lose all digits. For each
    piece ``(inverse, cross, part)``: a start's step is ``inverse @ (part - cross @ step)``, its covariance at given
    parameters ``inverse @ inverse.T``.
    """
    normal, right = np.zeros((p, p)), np.zeros(p)
    back = []
    for i, piece in enumerate(problem.pieces):
        w = weights[i]
        g, s, r = state.in_parameters[i] * w[:, None], state.in_start[i] * w[:, None], state.residuals[i] * w
        n, m = s.shape[1], len(piece.which)
        size = np.linalg.norm(s, axis=0)
        size[size == 0.0] = 1.0  # a number of the start that is known
        table = np.zeros((len(r) + n, n + m + 1))
        table[: len(r)] = np.column_stack([s / size, g, r])
        table[range(len(r), len(r) + n), range(n)] = np.sqrt(_RIDGE**2 + damping)
        factor = np.asarray(np.linalg.qr(table, mode="r"))
        inverse = np.linalg.inv(factor[:n, :n]) / size[:, None]
        back.append((inverse, factor[:n, n : n + m], factor[:n, n + m]))
        if used[i]:
            left, rest = factor[n:, n : n + m], factor[n:, n + m]
            normal[np.ix_(piece.which, piece.which)] += left.T @ left
            right[piece.which] += left.T @ rest
    return normal, right, back


def inverted(matrix: FloatArray, least: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Inverse of a normal matrix in units of its own diagonal, and directions (columns) that it does not determine.

    Eigenvalues below ``least`` make such a direction; it is left out of the inverse. With 0 there is none.
    """
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    shrunk = matrix / np.outer(scale, scale)
    if least <= 0.0:
        return np.linalg.inv(shrunk) / np.outer(scale, scale), np.zeros((len(scale), 0))
    shrunk[np.diag(matrix) <= 0.0] = 0.0  # what nothing depends on is a direction of its own
    values, vectors = np.linalg.eigh(shrunk)
    known = values > least
    inverse = (vectors[:, known] / values[known]) @ vectors[:, known].T / np.outer(scale, scale)
    return inverse, vectors[:, ~known]


def settle(
    problem: Fittable, theta: FloatArray, starts: FloatArray, spread: float, used: Any, centre: FloatArray,
    prior: FloatArray, iterations: int, rough: bool = False, bounds: tuple[FloatArray, FloatArray] | None = None,
    least: float = 0.0,
) -> tuple[FloatArray, FloatArray, State, int]:  # fmt: skip
    """Levenberg and Marquardt's iteration: parameters, starts, the state there, and how many steps it took.

    With ``rough`` it ends where it makes little way, or has taken all its iterations: a start for another fit.
    ``bounds`` are the least and the largest parameters; directions of which `inverted` says that they are not
    determined, at ``least``, are left as they are.

    Raises
    ------
    SolveError
        If it does not settle (`Unsettled`), within the iterations or at all, or (where ``least`` is 0) a direction of
        the parameters is not determined.
    """
    damping = 1e-4
    p = len(theta)
    low, high = bounds or (np.full(p, -np.inf), np.full(p, np.inf))
    state = problem.derivatives(theta, starts)
    weights = problem.weights(state, spread)

    def cost(now: State, at: FloatArray) -> float:
        return now.chi2(weights, used) + float((at - centre) @ prior @ (at - centre))

    best = cost(state, theta)
    for count in range(1, iterations + 1):
        while True:
            normal, right, back = reduced(problem, state, weights, used, p, damping)
            full = normal + prior
            pull = right - prior @ (theta - centre)
            scale = np.sqrt(np.maximum(np.diag(full), 1e-300))
            shrunk = full / np.outer(scale, scale)
            if not np.isfinite(shrunk).all():
                raise SolveError(
                    f"the motion of this fit over {len(problem.pieces)} pieces grows without bound: its records "
                    "are not of the motion that they are taken for"
                )
            if least <= 0.0 and np.linalg.cond(shrunk) > 1e13:
                raise SolveError("the records do not determine all parameters of this fit; give one its value")
            free = _free(theta, pull, low, high)
            step = np.zeros(p)
            damped = shrunk[np.ix_(free, free)] + damping * np.eye(len(free))
            step[free] = np.linalg.solve(damped, pull[free] / scale[free]) / scale[free]
            if least > 0.0:
                _, loose = inverted(full[np.ix_(free, free)], least)
                step[free] -= (loose @ (loose.T @ (step[free] * scale[free]))) / scale[free]
            step = np.clip(theta + step, low, high) - theta
            moved = starts.copy()
            for i, (inverse, cross, part) in enumerate(back):
                moved[i] += inverse @ (part - cross @ step[problem.pieces[i].which])
            trial = problem.residuals(theta + step, moved)
            found = cost(trial, theta + step)
            if np.isfinite(found) and found <= best * (1 + 1e-12):
                break
            damping *= 8
            # no smaller sum of squares: the derivatives' own accuracy is reached, or nothing fits
            if damping > (1e4 if least > 0.0 and rough else 1e8):
                distance, rest = _distance(problem, state, weights, used, theta, centre, prior, low, high, least)
                if (far := float(np.max(distance))) < _ACCURACY or rough:
                    return theta, starts, state, count
                raise Unsettled(
                    f"the fit over {len(problem.pieces)} pieces did not settle: no step lowers the sum of squares, "
                    f"though its minimum should be {far:.2g} standard uncertainties away; look at the records for "
                    "jumps", distance, rest, theta, starts,
                )  # fmt: skip
        theta, starts, gain, best = theta + step, moved, best - found, found
        state = problem.derivatives(theta, starts)
        # by the undamped step: a damped one is short wherever it is taken
        distance, rest = _distance(problem, state, weights, used, theta, centre, prior, low, high, least)
        far = float(np.max(distance))
        if far < _SETTLED or (far < _ACCURACY and gain < 1e-7 * best) or (rough and gain < _LITTLE * best):
            return theta, starts, state, count
        damping = max(damping / 10, 1e-9)
    if rough:
        return theta, starts, state, iterations
    raise Unsettled(
        f"the fit over {len(problem.pieces)} pieces did not settle in {iterations} iterations",
        distance, rest, theta, starts,
    )  # fmt: skip


def _distance(
    problem: Fittable, state: State, weights: list[FloatArray], used: Any, theta: FloatArray, centre: FloatArray,
    prior: FloatArray, low: FloatArray, high: FloatArray, least: float,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Undamped steps in standard uncertainties: the largest of the parameters, then of each start; the parameters'."""
    normal, right, back = reduced(problem, state, weights, used, len(theta))
    pull = right - prior @ (theta - centre)
    free = _free(theta, pull, low, high)
    covariance = np.zeros_like(normal)
    covariance[np.ix_(free, free)] = inverted((normal + prior)[np.ix_(free, free)], least)[0]
    step = covariance @ pull
    far = [float(np.max(np.abs(step) / np.sqrt(np.maximum(np.diag(covariance), 1e-300))))]
    for piece, (inverse, cross, part), use in zip(problem.pieces, back, used, strict=True):
        error = np.linalg.norm(inverse, axis=1)
        own = np.abs(inverse @ (part - cross @ step[piece.which])) / np.maximum(error, 1e-150)
        far.append(float(np.max(own)) if use else 0.0)
    return np.array(far), np.asarray(step)


def _free(theta: FloatArray, pull: FloatArray, low: FloatArray, high: FloatArray) -> Any:
    """Places of the parameters that are not held at a bound, against which the data push them."""
    return np.flatnonzero(~(((theta <= low) & (pull < 0)) | ((theta >= high) & (pull > 0))))
