r"""Least squares over many short pieces of motion, each with its own free start: multiple shooting.

A long record of a chaotic motion cannot be fitted by one shot: the start's error grows until the fit's cost has a
minimum at every wrong parameter. Short pieces have no such trouble. Each piece *s* has its own start :math:`(x, v)_s`,
and the parameters :math:`\theta` are common, so that the normal equations have an arrow's shape and the starts are
eliminated piece by piece:

.. math::

    \Big(P + \sum_s G_s^T G_s - G_s^T S_s (S_s^T S_s)^{-1} S_s^T G_s\Big) \delta\theta = \ldots

with G, S the residuals' derivatives in the parameters and in the start, and P the precision of what is known already.

An encoder's residuals: variance :math:`\delta^2/12` of a count, and :math:`v^2 \sigma_t^2` of a clock that jitters,
found from the residuals themselves.

References: H.G. Bock, in Springer Ser. Chem. Phys. 18 (1981) 102; E. Baake, M. Baake, H.G. Bock, K.M. Briggs, Phys.
Rev. A 45 (1992) 5524.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.errors import SolveError
from nonsmooth.identification.uncertainty import correlation_times

__all__ = ["Piece", "ShootingFit", "shoot", "start_state"]

FloatArray = NDArray[np.float64]
#: From the parameters of a piece to the vectors ``oscillator``, ``drive``, ``contact`` of `motion.march`.
Build = Callable[[FloatArray], tuple[Any, Any, Any]]

_SETTLED = 1e-3  # of a standard uncertainty


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of a record and the parameters that act on it.

    Attributes
    ----------
    time, x, phase : array (n,)
        Samples (s, m) and the crank's mean angle (rad; zeros where nothing turns).
    which : array of int
        Indices of its parameters in the common vector; ``build`` gets them in this order.
    build : callable
    start : array (2,)
        First guess of x and v at the first sample.
    touching : bool
        Whether it begins in contact.
    label : str
        The run it comes from.
    """

    time: FloatArray
    x: FloatArray
    phase: FloatArray
    which: NDArray[np.intp]
    build: Build
    start: FloatArray
    touching: bool = False
    label: str = ""


@dataclass(frozen=True, eq=False)
class ShootingFit:
    """What `shoot` found.

    Attributes
    ----------
    values, covariance : array (p,), (p, p)
        The parameters; the covariance holds the residuals' correlation and what was known before.
    starts : array (n_pieces, 2)
    residuals : list of array
        Measured minus fitted (m), by piece; ``fitted`` is x and v, (n, 2).
    noise, jitter : float
        Standard deviations of a reading (m) and of its instant (s).
    reduced : float
        chi^2 per degree of freedom of the residuals, weighted so.
    correlation : float
        Samples that share one independent error.
    used : array of bool
        False for pieces that were left out as outliers.
    """

    values: FloatArray
    covariance: FloatArray
    starts: FloatArray
    residuals: list[FloatArray]
    fitted: list[FloatArray]
    noise: float
    jitter: float
    reduced: float
    correlation: float
    iterations: int
    used: NDArray[np.bool_] = field(default_factory=lambda: np.ones(0, dtype=bool))

    @property
    def samples(self) -> int:
        """Samples that entered."""
        return int(sum(len(r) for r, use in zip(self.residuals, self.used, strict=True) if use))


def start_state(time: FloatArray, x: FloatArray, n: int = 7) -> FloatArray:
    """Position and velocity at the first sample, from a parabola through the first few."""
    n = min(n, len(time))
    slope, order = time[:n] - time[0], min(2, n - 1)
    coefficients = np.polynomial.polynomial.polyfit(slope, x[:n], order)
    return np.array([coefficients[0], coefficients[1] if order else 0.0])


def shoot(
    pieces: Sequence[Piece],
    values: Any,
    steps: Any,
    *,
    resolution: float,
    known: Any = None,
    precision: Any = None,
    jitter: float | None = None,
    iterations: int = 40,
    outliers: float | None = None,
) -> ShootingFit:
    """Fit common parameters and each piece's start.

    Parameters
    ----------
    pieces : sequence of Piece
    values : array (p,)
        First guess.
    steps : array (p,)
        Sizes for the derivatives: small against what changes the motion by its noise.
    resolution : float
        Length of a count (m).
    known, precision : array (p,), (p, p), optional
        What is known before, and its inverse covariance.
    jitter : float, optional
        Standard deviation of the sampling instants (s); found from the residuals where not given.
    iterations : int
    outliers : float, optional
        Leave out pieces whose reduced chi^2 exceeds this multiple of the median (a contact that was not seen, a
        hand that touched the car).

    Raises
    ------
    SolveError
        If the fit does not settle, or a direction of the parameters is not determined.
    """
    problem = _Problem(list(pieces), np.asarray(steps, dtype=np.float64), resolution)
    theta = np.array(values, dtype=np.float64)
    p = len(theta)
    prior = np.zeros((p, p)) if precision is None else np.asarray(precision, dtype=np.float64)
    centre = theta.copy() if known is None else np.asarray(known, dtype=np.float64)
    starts = np.array([piece.start for piece in pieces], dtype=np.float64)
    spread = 0.0 if jitter is None else jitter
    used = np.ones(len(pieces), dtype=bool)
    total = 0
    for _ in range(4):  # weights from residuals, residuals from weights
        theta, starts, state, count = _settle(problem, theta, starts, spread, used, centre, prior, iterations)
        total += count
        again = False
        if outliers is not None:
            worse = _worse(state, used, outliers)
            again = bool(worse.any())
            used = used & ~worse
        if jitter is None:
            found = _jitter(state, used, resolution)
            again |= abs(found - spread) > 0.05 * max(found, spread)
            spread = found
        if not again:
            break
    return _finish(problem, theta, starts, spread, used, prior, total)


@dataclass(frozen=True, eq=False)
class _State:
    """Residuals and derivatives of all pieces at one point, not weighted."""

    fitted: list[FloatArray]
    residuals: list[FloatArray]
    in_parameters: list[FloatArray]
    in_start: list[FloatArray]


@dataclass(frozen=True, eq=False)
class _Problem:
    pieces: list[Piece]
    steps: FloatArray
    resolution: float

    def motion(self, piece: Piece, local: FloatArray, start: FloatArray) -> FloatArray:
        from nonsmooth.identification.motion import march

        oscillator, drive, contact = (np.asarray(part, dtype=np.float64) for part in piece.build(local))
        out = np.empty((len(piece.time), 2))
        march(piece.time, piece.phase, start[0], start[1], piece.touching, oscillator, drive, contact, out)
        return out

    def residuals(self, theta: FloatArray, starts: FloatArray) -> _State:
        fitted = [self.motion(p, theta[p.which], s) for p, s in zip(self.pieces, starts, strict=True)]
        return _State(fitted, [p.x - f[:, 0] for p, f in zip(self.pieces, fitted, strict=True)], [], [])

    def derivatives(self, theta: FloatArray, starts: FloatArray) -> _State:
        state = self.residuals(theta, starts)
        for i, piece in enumerate(self.pieces):
            here = theta[piece.which]
            columns = []
            for k, index in enumerate(piece.which):
                moved = [here.copy(), here.copy()]
                moved[0][k] += self.steps[index]
                moved[1][k] -= self.steps[index]
                both = [self.motion(piece, m, starts[i])[:, 0] for m in moved]
                columns.append((both[0] - both[1]) / (2 * self.steps[index]))
            state.in_parameters.append(np.array(columns).T.reshape(len(piece.time), len(piece.which)))
            columns = []
            for k, step in enumerate((1e-6, 1e-5)):
                ahead, behind = starts[i].copy(), starts[i].copy()
                ahead[k] += step
                behind[k] -= step
                columns.append(
                    (self.motion(piece, here, ahead)[:, 0] - self.motion(piece, here, behind)[:, 0]) / (2 * step)
                )
            state.in_start.append(np.array(columns).T)
        return state

    def weights(self, state: _State, spread: float) -> list[FloatArray]:
        variance = self.resolution**2 / 12
        return [1.0 / np.sqrt(variance + (spread * f[:, 1]) ** 2) for f in state.fitted]


def _reduced(problem: _Problem, state: _State, weights: list[FloatArray], used: Any, p: int) -> tuple[Any, ...]:
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


def _settle(
    problem: _Problem, theta: FloatArray, starts: FloatArray, spread: float, used: Any, centre: FloatArray,
    prior: FloatArray, iterations: int,
) -> tuple[FloatArray, FloatArray, _State, int]:  # fmt: skip
    """Levenberg and Marquardt's iteration on the reduced equations."""
    damping = 1e-4
    p = len(theta)
    state = problem.derivatives(theta, starts)
    weights = problem.weights(state, spread)

    def cost(now: _State, at: FloatArray) -> float:
        data = sum(float(np.sum((r * w) ** 2)) for r, w, u in zip(now.residuals, weights, used, strict=True) if u)
        return data + float((at - centre) @ prior @ (at - centre))

    best = cost(state, theta)
    for count in range(1, iterations + 1):
        normal, right, back = _reduced(problem, state, weights, used, p)
        full = normal + prior
        pull = right - prior @ (theta - centre)
        scale = np.sqrt(np.maximum(np.diag(full), 1e-300))
        shrunk = full / np.outer(scale, scale)
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


def _jitter(state: _State, used: Any, resolution: float) -> float:
    """Standard deviation of the instants: the part of the squared residuals that grows with v^2 (median over bins)."""
    r = np.concatenate([r for r, u in zip(state.residuals, used, strict=True) if u])
    v = np.concatenate([f[:, 1] for f, u in zip(state.fitted, used, strict=True) if u])
    v2, extra = v**2, r**2 - resolution**2 / 12
    sigma2 = 0.0
    for _ in range(20):  # maximum likelihood by scoring: Var(r^2) = 2 variance^2
        weight = 1.0 / (resolution**2 / 12 + sigma2 * v2) ** 2
        new = max(0.0, float(np.sum(weight * v2 * extra) / np.sum(weight * v2**2)))
        if abs(new - sigma2) <= 1e-4 * new:
            break
        sigma2 = new
    return float(np.sqrt(sigma2))


def _worse(state: _State, used: Any, limit: float) -> NDArray[np.bool_]:
    mean = np.array([float(np.mean(r**2)) for r in state.residuals])
    return used & (mean > limit * float(np.median(mean[used])))


def _finish(
    problem: _Problem, theta: FloatArray, starts: FloatArray, spread: float, used: Any, prior: FloatArray, total: int
) -> ShootingFit:
    """The sandwich covariance: scores correlate within a piece and from a piece to the next of its run."""
    p = len(theta)
    state = problem.derivatives(theta, starts)
    weights = problem.weights(state, spread)
    normal, _, back = _reduced(problem, state, weights, used, p)
    scores, rows, chi2 = [], [], 0.0
    for i, piece in enumerate(problem.pieces):
        if not used[i]:
            continue
        g, s = state.in_parameters[i] * weights[i][:, None], state.in_start[i] * weights[i][:, None]
        r = state.residuals[i] * weights[i]
        block, cross, _ = back[i]
        scores.append((piece, (g - s @ (block @ cross)), r))
        chi2 += float(r @ r)
        rows.append(len(r))
    freedom = max(sum(rows) - 2 * len(rows) - p, 1)
    reduced = chi2 / freedom
    tau = float(np.median([correlation_times(r) for _, _, r in scores]))
    meat = _meat(scores, p)
    inverse = np.linalg.inv(normal + prior)
    data = normal * reduced
    # what the scatter of the scores shows, and never less than white residuals of their size
    raised = np.maximum(1.0, np.sqrt(np.maximum(np.diag(data), 1e-300) / np.maximum(np.diag(meat), 1e-300)))
    meat = meat * np.outer(raised, raised) * sum(rows) / freedom
    covariance = inverse @ (meat + prior) @ inverse
    return ShootingFit(
        theta, covariance, starts, state.residuals, state.fitted, problem.resolution / np.sqrt(12), spread, reduced,
        tau, total, used,
    )  # fmt: skip


def _meat(scores: Sequence[tuple[Piece, FloatArray, FloatArray]], p: int) -> FloatArray:
    """Sum of products of scores up to a lag of a few correlation times, Bartlett's weights, within pieces."""
    meat = np.zeros((p, p))
    for piece, g, r in scores:
        score = g * r[:, None]
        here = score.T @ score
        lags = min(len(r) - 1, int(np.ceil(4 * correlation_times(r))) + 2)
        for k in range(1, lags + 1):
            cross = score[k:].T @ score[:-k]
            here += (1.0 - k / (lags + 1)) * (cross + cross.T)
        meat[np.ix_(piece.which, piece.which)] += here
    return meat
