r"""The arrow-shaped normal equations of multiple shooting: starts eliminated piece by piece, parameters kept.

.. math::

    \Big(P + \sum_s G_s^T G_s - G_s^T S_s (S_s^T S_s)^{-1} S_s^T G_s\Big) \delta\theta = \ldots

with G, S the residuals' derivatives in the parameters and in a piece's start, and P the precision of what is known.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.errors import SolveError
from nonsmooth.identification.pieces import Problem, State

__all__ = ["reduced", "settle"]

FloatArray = NDArray[np.float64]
_SETTLED = 1e-3  # of a standard uncertainty


def reduced(problem: Problem, state: State, weights: list[FloatArray], used: Any, p: int) -> tuple[Any, ...]:
    """Normal equations without the starts, and what gives the starts' steps back."""
    normal, right = np.zeros((p, p)), np.zeros(p)
    back = []
    for i, piece in enumerate(problem.pieces):
        g, s = state.in_parameters[i] * weights[i][:, None], state.in_start[i] * weights[i][:, None]
        r = state.residuals[i] * weights[i]
        block = np.linalg.inv(s.T @ s + 1e-12 * np.trace(s.T @ s) * np.eye(2))
        back.append((block, s.T @ g, s.T @ r))
        if used[i]:
            normal[np.ix_(piece.which, piece.which)] += g.T @ g - (s.T @ g).T @ block @ (s.T @ g)
            right[piece.which] += g.T @ r - (s.T @ g).T @ block @ (s.T @ r)
    return normal, right, back


def settle(
    problem: Problem, theta: FloatArray, starts: FloatArray, spread: float, used: Any, centre: FloatArray,
    prior: FloatArray, iterations: int,
) -> tuple[FloatArray, FloatArray, State, int]:  # fmt: skip
    """Levenberg and Marquardt's iteration: parameters, starts, the state there, and how many steps it took.

    Raises
    ------
    SolveError
        If it does not settle, or a direction of the parameters is not determined.
    """
    damping = 1e-4
    p = len(theta)
    state = problem.derivatives(theta, starts)
    weights = problem.weights(state, spread)

    def cost(now: State, at: FloatArray) -> float:
        data = sum(float(np.sum((r * w) ** 2)) for r, w, u in zip(now.residuals, weights, used, strict=True) if u)
        return data + float((at - centre) @ prior @ (at - centre))

    best = cost(state, theta)
    for count in range(1, iterations + 1):
        normal, right, back = reduced(problem, state, weights, used, p)
        full = normal + prior
        pull = right - prior @ (theta - centre)
        scale = np.sqrt(np.maximum(np.diag(full), 1e-300))
        shrunk = full / np.outer(scale, scale)
        if not np.isfinite(shrunk).all():
            raise SolveError(
                f"the motion of this fit over {len(problem.pieces)} pieces grows without bound: its records are not of "
                "the motion that they are taken for"
            )
        if np.linalg.cond(shrunk) > 1e13:
            raise SolveError("the records do not determine all parameters of this fit; give one its value")
        while True:
            step = np.linalg.solve(shrunk + damping * np.eye(p), pull / scale) / scale
            moved = starts.copy()
            for i, (block, cross, part) in enumerate(back):
                moved[i] += block @ (part - cross @ step[problem.pieces[i].which])
            trial = problem.residuals(theta + step, moved)
            found = cost(trial, theta + step)
            if np.isfinite(found) and found <= best * (1 + 1e-12):
                damping = max(damping / 10, 1e-9)
                break
            damping *= 8
            if damping > 1e8:  # no smaller sum of squares: the derivatives' own accuracy is reached
                return theta, starts, state, count
        small = float(np.max(np.abs(step) * np.sqrt(np.diag(full))))
        theta, starts, gain, best = theta + step, moved, best - found, found
        state = problem.derivatives(theta, starts)
        if small < _SETTLED or gain < 1e-7 * best:
            return theta, starts, state, count
    raise SolveError(f"the fit over {len(problem.pieces)} pieces did not settle in {iterations} iterations")
