r"""The arrow-shaped normal equations of multiple shooting: starts eliminated piece by piece, parameters kept.

.. math::

    \Big(P + \sum_s G_s^T G_s - G_s^T S_s (S_s^T S_s)^{-1} S_s^T G_s\Big) \delta\theta = \ldots

with G, S the residuals' derivatives in the parameters and in a piece's start, and P the precision of what is known.
Pieces of motion have free starts of their own. The covariance is by the scatter of the scores, which correlate in time
within a piece.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from nonsmooth.arrays import BoolArray, FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.identification.finding import newey_west, not_below

if TYPE_CHECKING:
    from nonsmooth.identification.fit.windows import Windows

_LEAST = 1e-13  # eigenvalue of the scaled normal matrix from which a direction counts as determined
_SETTLED = 1e-3  # of a standard uncertainty
_TOLD = 1e-8  # of a column: what is left of it behind the start's, below which a start makes up for it
_RIDGE = 1e-13  # of a start's column: what keeps a start that is known or not seen from being divided by
_LITTLE = 1e-4  # of the sum of squares: what a rough fit leaves to be gained
_ACCURACY = 0.05  # of a standard uncertainty: how near the minimum is told where the derivatives' accuracy ends


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals and derivatives of all pieces at one point, not weighted; ``alone``, those of what depends on the
    unknowns alone, weighted, with the derivatives of what they are the residuals of."""

    residuals: list[FloatArray]
    in_parameters: list[FloatArray]
    in_start: list[FloatArray]
    alone: FloatArray = field(default_factory=lambda: np.zeros(0))
    of_alone: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))

    def chi2(self, weights: list[FloatArray], used: Any = None) -> float:
        """Sum of the weighted residuals' squares, of all pieces or of those that are used."""
        rows = zip(self.residuals, weights, strict=True)
        each = (np.sum((r * w) ** 2) for i, (r, w) in enumerate(rows) if used is None or used[i])
        return sum(each, float(self.alone @ self.alone))


class Minimized(NamedTuple):
    """Parameters, starts and the state where an iteration ended.

    ``short``: how far the minimum seems where no step leads on, in standard uncertainties; 0 at a minimum. ``left``:
    what is left of the way, in the parameters.
    """

    theta: FloatArray
    starts: FloatArray
    state: Residuals
    short: float
    left: FloatArray


class Eliminated(NamedTuple):
    """A piece's start, eliminated: its step follows that of the piece's parameters; ``inverse @ inverse.T`` is its
    covariance at given parameters."""

    inverse: FloatArray
    cross: FloatArray
    part: FloatArray

    def step(self, own: FloatArray) -> FloatArray:
        """Its step with one of the piece's parameters."""
        return self.inverse @ (self.part - self.cross @ own)


def reduced(
    problem: Windows, state: Residuals, weights: list[FloatArray] | None = None, used: Any = None, damping: float = 0.0
) -> tuple[Any, ...]:
    """Normal equations without the starts, and what gives the starts' steps back; ``damping`` is that of the starts.

    By an orthogonal factorization of each piece: squares of a chaotic motion's derivatives lose all digits.
    """
    J, weights = state.of_alone.reshape(-1, len(problem.unknowns.precision)), weights or problem.weights(state)
    normal, right = J.T @ J, J.T @ state.alone[: len(J)]
    back = []
    for i, piece in enumerate(problem.pieces):
        w = weights[i]
        g, s, r = state.in_parameters[i] * w[:, None], state.in_start[i] * w[:, None], state.residuals[i] * w
        r = np.where(np.isfinite(r), r, 0.0)  # a motion that does not come to its end pulls nowhere
        n, m = s.shape[1], len(piece.which)
        size = np.linalg.norm(s, axis=0)
        size[size == 0.0] = 1.0  # a number of the start that is known
        table = np.zeros((len(r) + n, n + m + 1))
        table[: len(r)] = np.column_stack([s / size, g, r])
        table[range(len(r), len(r) + n), range(n)] = np.sqrt(_RIDGE**2 + damping)
        factor: Any = np.linalg.qr(table, mode="r")
        back.append(Eliminated(np.linalg.inv(factor[:n, :n]) / size[:, None], factor[:n, n : n + m], factor[:n, n + m]))
        if used is None or used[i]:
            left, rest = factor[n:, n : n + m], factor[n:, n + m]
            left[:, np.linalg.norm(left, axis=0) < _TOLD * np.linalg.norm(g, axis=0)] = 0.0
            normal[np.ix_(piece.which, piece.which)] += left.T @ left
            right[piece.which] += left.T @ rest
    return normal, right, back


def inverted(matrix: FloatArray, damping: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Inverse of a normal matrix in units of its own diagonal, and directions (columns) that it does not determine.

    Small eigenvalues make such a direction; it is left out of the inverse. ``damping`` is added to the others.
    """
    scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    scale[scale == 0.0] = 1.0  # what nothing depends on is a direction of its own
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    known = values > _LEAST
    inverse = (vectors[:, known] / (values[known] + damping)) @ vectors[:, known].T / np.outer(scale, scale)
    return inverse, vectors[:, ~known]


def concerned(directions: FloatArray) -> BoolArray:
    """Mark the parameters that have a part in each direction (columns)."""
    return np.abs(directions) > 1e-3 * np.abs(directions).max(axis=0, initial=0.0)


def settle(
    problem: Windows,
    theta: FloatArray,
    starts: FloatArray,
    used: Any = None,
    known: FloatArray | None = None,
    rough: bool = False,
) -> Minimized:
    """Levenberg and Marquardt's iteration; SolveError for derivatives without bound.

    With ``rough`` it ends where it makes little way, or has taken all its iterations: a start for another fit.
    ``known`` is a precision in place of that of the priors. Directions of the parameters that `inverted` says are not
    determined are left as they are.
    """
    u, damping, iterations = problem.unknowns, 1e-4, 30 if rough else 50
    prior = u.precision if known is None else known
    state = problem.residuals(theta, starts, True)
    weights = problem.weights(state)

    def cost(now: Residuals, at: FloatArray) -> float:
        return now.chi2(weights, used) + float((at - u.centre) @ prior @ (at - u.centre))

    def step_of(damping: float = 0.0) -> tuple[FloatArray, FloatArray, list[Eliminated]]:
        """A step of the parameters, those at a bound against which the data push them being held; their covariance, and
        what gives the starts' steps."""
        normal, right, back = reduced(problem, state, weights, used, damping)
        full, pull = normal + prior, right - prior @ (theta - u.centre)
        if not np.isfinite(full).all():
            raise SolveError(
                f"the motion of this fit over {len(problem.pieces)} pieces grows without bound: its records are not of "
                "the motion that they are taken for"
            )
        free = ~(((theta <= u.low) & (pull < 0)) | ((theta >= u.high) & (pull > 0)))
        covariance, places = np.zeros_like(full), np.ix_(free, free)
        covariance[places] = inverted(full[places], damping)[0]
        return covariance @ pull, covariance, back

    def undamped() -> tuple[float, FloatArray]:
        """The largest undamped step in standard uncertainties, of the parameters or of a start; the parameters'."""
        step, covariance, back = step_of()
        far = [float(np.max(np.abs(step) / np.sqrt(np.maximum(np.diag(covariance), 1e-300))))]
        for i, (piece, start) in enumerate(zip(problem.pieces, back, strict=True)):
            error = np.linalg.norm(start.inverse, axis=1)
            own = np.abs(start.step(step[piece.which])) / np.maximum(error, 1e-150)
            far.append(float(np.max(own)) if used is None or used[i] else 0.0)
        return max(far), step

    best, none = cost(state, theta), np.zeros(len(theta))
    for _ in range(iterations):
        while True:
            step, _, back = step_of(damping)
            step = np.clip(theta + step, u.low, u.high) - theta
            moved = starts.copy()
            for i, start in enumerate(back):
                moved[i] += start.step(step[problem.pieces[i].which])
            found = cost(problem.residuals(theta + step, moved), theta + step)
            if np.isfinite(found) and found <= best * (1 + 1e-12):
                break
            damping *= 8
            # no smaller sum of squares: the derivatives' own accuracy is reached, or nothing fits
            if damping > (1e4 if rough else 1e8):
                far, rest = undamped()
                near = far < _ACCURACY or rough
                return Minimized(theta, starts, state, *((0.0, none) if near else (far, rest)))
        theta, starts, gain, best = theta + step, moved, best - found, found
        state = problem.residuals(theta, starts, True)
        # by the undamped step: a damped one is short wherever it is taken
        far, rest = undamped()
        if far < _SETTLED or (far < _ACCURACY and gain < 1e-7 * best) or (rough and gain < _LITTLE * best):
            break
        damping = max(damping / 10, 1e-9)
    else:
        if not rough:
            return Minimized(theta, starts, state, far, rest)
    return Minimized(theta, starts, state, 0.0, none)


class Sandwich(NamedTuple):
    """Residuals at the best fit, covariance (p, p), chi^2 per degree of freedom, samples that share an error.

    ``normal`` and ``back`` are those of `reduced` there.
    """

    state: Residuals
    covariance: FloatArray
    reduced: float
    correlation: float
    normal: FloatArray
    back: list[Eliminated]


def sandwich(problem: Windows, theta: FloatArray, starts: FloatArray) -> Sandwich:
    """Covariance of the parameters at the best fit, never smaller along any than that of white residuals, nor than that
    of rounding."""
    p, prior = len(theta), problem.unknowns.precision
    state = problem.residuals(theta, starts, True)
    weights = problem.weights(state)
    normal, _, back = reduced(problem, state, weights)
    J, tau, rows = state.of_alone.reshape(-1, p), [1.0] * (not problem.pieces), len(state.alone)
    alone = J.T @ J * max(1.0, float(state.alone @ state.alone) / max(rows - p, 1))  # independent, of the noise given
    meat = np.zeros((p, p))
    for i, (piece, (inner, cross, _)) in enumerate(zip(problem.pieces, back, strict=True)):
        g, s = state.in_parameters[i] * weights[i][:, None], state.in_start[i] * weights[i][:, None]
        r = state.residuals[i] * weights[i]
        tau.append(piece.correlation(r))
        scores = piece.by_instant((g - s @ (inner @ cross)) * r[:, None])
        meat[np.ix_(piece.which, piece.which)] += newey_west(scores, tau[-1])
        rows += len(r)
    freedom = max(rows - sum(piece.n_free for piece in problem.pieces) - p, 1)
    size = max(state.chi2(weights) / freedom, problem.rounded)
    inverse, _ = inverted(normal + prior)
    part = rows / freedom
    covariance = not_below(
        inverse @ (meat * part + alone + prior) @ inverse, inverse @ (normal * size + prior) @ inverse
    )
    return Sandwich(state, covariance, size, np.median(tau), normal, back)
