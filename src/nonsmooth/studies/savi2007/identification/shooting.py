r"""Least squares over many short pieces of motion, each with its own free start: multiple shooting.

A long record of a chaotic motion cannot be fitted by one shot: the start's error grows until the fit's cost has a
minimum at every wrong parameter. Short pieces have no such trouble. Each piece has its own start (x, v), the parameters
are common, and the normal equations have an arrow's shape: the starts are eliminated piece by piece.

An encoder's residuals: variance :math:`\delta^2/12` of a count, and :math:`v^2 \sigma_t^2` of a clock that jitters,
found from the residuals themselves.

References: H.G. Bock, in Springer Ser. Chem. Phys. 18 (1981) 102; E. Baake, M. Baake, H.G. Bock, K.M. Briggs, Phys.
Rev. A 45 (1992) 5524.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth import SolveError
from nonsmooth.arrays import FloatArray
from nonsmooth.identification.arrow import Unsettled, settle
from nonsmooth.identification.pieces import State
from nonsmooth.identification.sandwich import sandwich
from nonsmooth.studies.savi2007.identification.pieces import Piece, Problem

__all__ = ["ShootingFit", "shoot"]

_UNEVEN = 0.2  # steps of the clock: the most that its instants are taken to jitter
_ROUNDS = 10  # of weights from residuals and residuals from weights


@dataclass(frozen=True, eq=False)
class ShootingFit:
    """Result of `shoot`.

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
    rough: bool = False,
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
    rough : bool
        Only a start for another fit is wanted: it need not settle.

    Raises
    ------
    SolveError
        If the fit does not settle, or a direction of the parameters is not determined.
    """
    problem = Problem(list(pieces), np.asarray(steps, dtype=np.float64), resolution)
    theta = np.array(values, dtype=np.float64)
    p = len(theta)
    prior = np.zeros((p, p)) if precision is None else np.asarray(precision, dtype=np.float64)
    centre = theta.copy() if known is None else np.asarray(known, dtype=np.float64)
    starts = np.array([piece.start for piece in pieces], dtype=np.float64)
    spread = 0.0 if jitter is None else jitter
    used = np.ones(len(pieces), dtype=bool)
    total = 0
    for _ in range(_ROUNDS):  # weights from residuals, residuals from weights
        try:
            theta, starts, state, count = settle(problem, theta, starts, spread, used, centre, prior, iterations, rough)
        except Unsettled as reason:  # pieces of another motion keep all others from settling: first without them
            worse = _worse(problem.residuals(reason.values, reason.starts), used, outliers or np.inf)
            if not worse.any():
                raise
            theta, starts, used = reason.values, reason.starts, used & ~worse
            continue
        total += count
        again = False
        if outliers is not None:
            worse = _worse(state, used, outliers)
            again = bool(worse.any())
            used = used & ~worse
        if jitter is None:
            # a clock that is off by more than a part of its step is none: then the law does not fit
            wider = min(_jitter(state, used, resolution), _UNEVEN * float(np.median(np.diff(pieces[0].time))))
            again |= abs(wider - spread) > 0.05 * max(wider, spread)
            spread = wider
        if not again or rough:
            break
    else:
        raise SolveError(
            f"weights and outliers of the fit over {len(pieces)} pieces have not settled in {_ROUNDS} rounds; look at "
            "the residuals of the runs"
        )
    found = sandwich(problem, theta, starts, spread, used, prior)
    return ShootingFit(
        theta, found.covariance, starts, found.state.residuals, found.state.fitted, resolution / np.sqrt(12), spread,
        found.reduced, found.correlation, total, used,
    )  # fmt: skip


def _jitter(state: State, used: Any, resolution: float) -> float:
    """Standard deviation of the instants, from the part of the squared residuals that grows with v^2."""
    from scipy.optimize import brentq

    r = np.concatenate([r for r, u in zip(state.residuals, used, strict=True) if u])
    v = np.concatenate([f[:, 1] for f, u in zip(state.fitted, used, strict=True) if u])
    v2, extra = v**2, r**2 - resolution**2 / 12

    def score(sigma2: float) -> float:  # of the likelihood, with Var(r^2) = 2 variance^2
        return float(np.sum(v2 * (extra - sigma2 * v2) / (resolution**2 / 12 + sigma2 * v2) ** 2))

    if score(0.0) <= 0:
        return 0.0
    high = float(np.max(extra)) / float(np.mean(v2))
    while score(high) > 0:
        high *= 4
    return float(np.sqrt(brentq(score, 0.0, high, rtol=1e-6)))


def _worse(state: State, used: Any, limit: float) -> NDArray[np.bool_]:
    mean = np.array([float(np.mean(r**2)) for r in state.residuals])
    return used & (mean > limit * float(np.median(mean[used])))
