r"""Gap and contact parameters by multiple shooting: short pieces with one contact each, every start free.

A piece runs from one turning point far from the support to the next but one contact; in between the motion is linear in
each mode. What the free decay has told, :math:`\omega_0, c/m, F_C/m`, enters as known with its covariance; the drive's
amplitude is the crank's length, while its phase at the mark, its second harmonic (string and ripple) and the place
about which the car swings are free in each run. The gap comes out in the sensor's own count, and the place of the
swing with it, so that their difference, the gap *referred to the car's mean position under the drive*, needs no zero.

A piece in which the car turns at the support itself, a graze, is left out: its motion has no derivative in the
parameters there (the push grows as the power 3/2 of a depth of micrometres), and the fit would stop at it wherever its
minimum lies. How far the estimate moves with every other turn of the crank alone is added to its uncertainty: it is
the uncertainty that a wandering motor causes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from nonsmooth import SolveError
from nonsmooth.arrays import FloatArray
from nonsmooth.identification.arrow import Unsettled, reduced
from nonsmooth.recordings.signals.phase import drive_phase
from nonsmooth.studies.savi2007.identification.evidence import Run
from nonsmooth.studies.savi2007.identification.free_decay import DecayFit
from nonsmooth.studies.savi2007.identification.pieces import Piece, Problem, start_state
from nonsmooth.studies.savi2007.identification.shooting import ShootingFit, shoot

__all__ = ["ContactFit", "shoot_contacts"]

_SHARED = 5  # omega_0, b, f, kappa, gamma
_PER_RUN = 6  # gap, place, cosine and sine of the drive, its second harmonic
LONGEST = 2.5  # s: of a piece
#: Distance (m) from the gap within which a turning point is a graze, and time (s) for which friction may all but hold
#: the car on its way; the second pair where the first fails.
_GRAZING = ((2e-5, np.inf), (6e-5, 0.015))
_SLOW = 5e-4  # m/s: a car that is slower is all but held
_NEAR = 1.0  # standard uncertainties from its minimum, within which a fit that no step improves is taken
_HELD, _ROUNDS = 0.05, 3  # share of pieces whose starts corners may hold, and how often they are looked for
_LARGE, _LEFT_OUT = 3.0, 0.2  # chi^2 per degree of freedom, and share of pieces, from which a fit is doubted


@dataclass(frozen=True, eq=False)
class ContactFit:
    """Outcome: ``kappa`` = k_s/m, ``gamma`` = c_s/m, and for each run the gap and the place of the swing.

    ``values`` and ``covariance``: omega_0, b, f, kappa, gamma, then per run g, x_e, cosine, sine, cosine_2, sine_2;
    ``known`` and ``precision``: what was known of them before; ``grazing``: how many pieces are left out as grazes;
    ``short``: how far short of its minimum the fit stands, in standard uncertainties.
    """

    values: FloatArray
    covariance: FloatArray
    runs: tuple[Run, ...]
    pieces: tuple[Piece, ...]
    fit: ShootingFit
    known: FloatArray
    precision: FloatArray
    grazing: int = 0
    short: float = 0.0

    def place(self, run: int, which: int) -> int:
        """Index of a run's own parameter: 0 gap, 1 place, 2-5 drive."""
        return _SHARED + _PER_RUN * run + which

    @property
    def poor(self) -> bool:
        """Return whether the motion is another than the model's: chi^2, or half of its pieces as outliers."""
        return bool(self.fit.reduced > _LARGE or np.mean(~self.fit.used) > 0.5)

    @property
    def n_contacts(self) -> int:
        """Pieces, each with at least one contact."""
        return int(np.count_nonzero(self.fit.used))


def shoot_contacts(
    runs: Sequence[Run], decay: DecayFit, *, resolution: float, kappa: float, gamma: float, pieces_per_run: int = 25,
    mark: float = 0.0,
) -> ContactFit:  # fmt: skip
    """Fit the runs with contact together.

    Parameters
    ----------
    runs : sequence of Run
        With ``x``, ``turns``, and the settings ``crank_length`` and ``gap`` (a first guess).
    decay : DecayFit
        What the free decay told.
    resolution : float
        Length of a count (m).
    kappa, gamma : float
        First guess of k_s/m (1/s^2) and c_s/m (1/s).
    pieces_per_run : int
        Pieces taken from each run, spread over it.
    mark : float
        About the crank's angle at the photogate (rad), from where it pulls towards the support.

    Raises
    ------
    ValueError
        If no run has a contact.
    SolveError
        If the fit does not settle.
    """
    values = [*decay.values[:3], kappa, gamma]
    steps = [1e-6, 1e-6, 1e-7, 1e-6 * kappa, 1e-4]
    told: FloatArray = np.asarray(np.linalg.inv(_regular(decay.covariance[:3, :3])))
    precision: list[FloatArray] = [told, 1e-12 / kappa**2 * np.eye(2)]
    pieces: list[Piece] = []
    taken: list[Run] = []
    for run in runs:
        crank, gap = float(run.settings["crank_length"]), float(run.settings["gap"])
        own = _SHARED + _PER_RUN * len(taken)
        which = np.array([*range(_SHARED), *range(own, own + _PER_RUN)])
        here = _pieces(run, which, gap, float(decay.values[3]), pieces_per_run)
        if not here:
            continue
        pieces += here
        taken.append(run)
        along = np.array([np.cos(mark), -np.sin(mark)])  # a cos(phi + mark)
        values += [gap + decay.values[3], decay.values[3], *(crank * along), 0.0, 0.0]
        steps += [3e-8, 3e-8, 1e-7, 1e-7, 1e-7, 1e-7]
        # the drive: amplitude as set to 0.5 %, a phase of the mark to 0.05 rad, a second harmonic to 3 %
        spread = np.array([1.5e-3, 1e-3, 5e-3 * crank, 0.05 * crank, 0.03 * crank, 0.03 * crank])
        own_precision = np.diag(spread**-2.0)
        turned = np.array([along, [-along[1], along[0]]])
        own_precision[2:4, 2:4] = turned.T @ own_precision[2:4, 2:4] @ turned
        precision.append(own_precision)
    if not pieces:
        raise ValueError("no run shows a contact: the gap and the support cannot be found from them")
    joint = _Joint(pieces, np.array(values), np.array(steps), precision, resolution, decay.fit.jitter)
    fit, kept, short = joint.best(len(taken))
    moved = joint.by_turns(fit, kept)
    return ContactFit(
        fit.values, fit.covariance + np.outer(moved, moved), tuple(taken), tuple(kept), fit, joint.values,
        _blocks(precision), len(pieces) - len(kept), short,
    )  # fmt: skip


def _poor(fit: ShootingFit) -> bool:
    """Return whether a fit leaves more than it should: chi^2, or a fifth of its pieces as outliers."""
    return fit.reduced > _LARGE or float(np.mean(~fit.used)) > _LEFT_OUT


@dataclass(frozen=True, eq=False)
class _Joint:
    """All pieces with the common vector: first guess, sizes for derivatives, precision of what is known by blocks."""

    pieces: list[Piece]
    values: FloatArray
    steps: FloatArray
    precision: list[FloatArray]
    resolution: float
    jitter: float

    def best(self, runs: int) -> tuple[ShootingFit, list[Piece], float]:
        """The joint fit, the pieces that are no grazes, and how far short of its minimum the fit stands.

        Far from the solution the cost is rough, the rougher the more runs: where all together do not get there, each
        alone finds the way.
        """
        first: ShootingFit | None = None
        try:
            first = self.fit(self.values, rough=True)
        except SolveError:
            if runs == 1:
                raise
        if first is None or (runs > 1 and _poor(first)):
            again = self.fit(self.one_by_one(runs), rough=True)
            rows = [again] if first is None else [first, again]
            first = min(rows, key=lambda found: (float(np.mean(~found.used)), found.reduced))
        for limits in _GRAZING:
            kept = [
                replace(piece, start=start)
                for piece, start, motion in zip(self.pieces, first.starts, first.fitted, strict=True)
                if not _grazes(piece, motion, float(first.values[piece.which[_SHARED]]), *limits)
            ]
            if not kept:
                raise SolveError("every piece with contact grazes the support only: use more forcing, or a smaller gap")
            try:
                return replace(self, pieces=kept).fit(first.values), kept, 0.0
            except Unsettled as reason:
                if limits == _GRAZING[-1]:
                    return self.near(kept, reason)
            except SolveError:
                if limits == _GRAZING[-1]:
                    raise
        raise AssertionError

    def near(
        self, kept: list[Piece], reason: Unsettled, rounds: int = _ROUNDS
    ) -> tuple[ShootingFit, list[Piece], float]:
        """The fit where it stands short of its minimum, with what is left of the way as a further uncertainty.

        Where friction holds the car or a contact grazes, the sum of squares has corners, and no step leads on. The few
        pieces whose own starts are held by one are left out with the grazes.

        Raises
        ------
        SolveError
            If more than a standard uncertainty of a parameter or a start is left.
        """
        pieces = [replace(piece, start=start) for piece, start in zip(kept, reason.starts, strict=True)]
        held = reason.distance[1:] > _NEAR
        if rounds and 0 < np.mean(held) <= _HELD:
            pieces = [piece for piece, corner in zip(pieces, held, strict=True) if not corner]
            try:
                return replace(self, pieces=pieces).fit(reason.values), pieces, 0.0
            except Unsettled as again:
                return self.near(pieces, again, rounds - 1)
        short = float(np.max(reason.distance))
        if short > _NEAR:
            raise reason
        found = replace(self, pieces=pieces).fit(reason.values, rough=True)
        return replace(found, covariance=found.covariance + np.outer(reason.step, reason.step)), pieces, short

    def by_turns(self, fit: ShootingFit, kept: list[Piece]) -> FloatArray:
        """Shift of the parameters, to first order, when the crank's angle is known from every other turn only.

        Between passages of the photogate a motor that wanders is not where a straight line has it. How far it is off
        nobody sees, but how far a line over two turns is off.
        """
        problem = Problem(kept, self.steps, self.resolution)
        state = problem.derivatives(fit.values, fit.starts)
        weights = problem.weights(state, self.jitter)
        coarse = replace(problem, pieces=[replace(p, phase=p.phase if p.coarse is None else p.coarse) for p in kept])
        other = replace(state, residuals=coarse.residuals(fit.values, fit.starts).residuals)
        p, prior = len(fit.values), _blocks(self.precision)
        normal, right, _ = reduced(problem, other, weights, fit.used, p)
        return np.asarray(np.linalg.solve(normal + prior, right - prior @ (fit.values - self.values)))

    def fit(self, start: FloatArray, rough: bool = False) -> ShootingFit:
        """Fit all runs together from these parameters."""
        return self._shoot(self.pieces, start, slice(None), self.precision, rough)

    def one_by_one(self, runs: int) -> FloatArray:
        """Start for the joint fit from fits of each run alone; what they share by its median."""
        start, shared = self.values.copy(), []
        for i in range(runs):
            own = slice(_SHARED + _PER_RUN * i, _SHARED + _PER_RUN * (i + 1))
            pieces = [
                replace(piece, which=np.arange(_SHARED + _PER_RUN)) for piece in self.pieces
                if piece.which[_SHARED] == own.start
            ]  # fmt: skip
            rows = np.r_[np.arange(_SHARED), np.arange(own.start, own.stop)]
            blocks = [*self.precision[:2], self.precision[2 + i]]
            try:
                alone = self._shoot(pieces, self.values[rows], rows, blocks, True)
            except SolveError:
                continue
            if not _poor(alone):
                shared.append(alone.values[:_SHARED])
                start[own] = alone.values[_SHARED:]
        if shared:
            start[:_SHARED] = np.median(shared, axis=0)
        return start

    def _shoot(
        self, pieces: list[Piece], start: FloatArray, rows: Any, blocks: list[FloatArray], rough: bool
    ) -> ShootingFit:
        return shoot(
            pieces, start, self.steps[rows], resolution=self.resolution, known=self.values[rows],
            precision=_blocks(blocks), jitter=self.jitter, outliers=6.0, rough=rough,
        )  # fmt: skip


def _grazes(piece: Piece, motion: FloatArray, gap: float, margin: float, lingers: float = np.inf) -> bool:
    """Return whether the car turns within a margin of the gap, or dry friction all but holds it on the way for so long.

    A start that changes by a micrometre then decides whether the car touches, or turns: there the sum of squares has
    a corner.
    """
    x, v = motion[:, 0], motion[:, 1]
    slow = np.flatnonzero(np.diff(np.r_[0, np.abs(v) < _SLOW, 0]))
    if np.any(piece.time[slow[1::2] - 1] - piece.time[slow[::2]] > lingers):
        return True
    i = np.flatnonzero(v[:-1] * v[1:] < 0)
    slowing = (v[i + 1] - v[i]) / np.diff(piece.time)[i]
    turned = x[i] - v[i] ** 2 / (2 * slowing)
    return bool(np.any(np.abs(turned - gap) < margin))


def _blocks(blocks: list[FloatArray]) -> FloatArray:
    from scipy.linalg import block_diag

    return np.asarray(block_diag(*blocks), dtype=np.float64)


def _regular(matrix: FloatArray) -> FloatArray:
    return matrix + 1e-12 * np.diag(np.diag(matrix))


def _build(p: FloatArray) -> tuple[Any, Any, Any]:
    return (
        np.array([p[0], p[1], p[2], p[6]]), np.array([p[7], p[8], p[9], p[10]]), np.array([p[3], p[4], p[5]]),
    )  # fmt: skip


def _pieces(run: Run, which: Any, gap: float, rest: float, most: int) -> list[Piece]:
    """Pieces from one low turning point to the next, in each of which the car rises above the gap."""
    t, x = run.time, run.positions
    drive = drive_phase(run.passages)
    phase, coarse = drive.phase(t), drive.coarser.phase(t)
    low = _turning_points(x)
    found: list[Piece] = []
    # the screw's reading may be off by a millimetre: what rises above half of it is taken
    level = rest + (gap - 1e-3 if gap < 2e-3 else 0.5 * gap)
    i = 0
    while i < len(low) - 1:
        j = i + 1
        while j < len(low) - 1 and t[low[j]] - t[low[i]] < 0.3:
            j += 1
        begin, end = low[i], low[j] + 1
        i = j
        if end - begin < 12 or t[end - 1] - t[begin] > LONGEST or np.max(x[begin:end]) < level:
            continue
        if x[begin] > level or x[end - 1] > level:  # a piece begins and ends free
            continue
        local = t[begin:end] - t[begin]
        found.append(
            Piece(local, x[begin:end], phase[begin:end], which, _build, start_state(local, x[begin:end]),
                  label=run.name, origin=float(t[begin]), coarse=coarse[begin:end])
        )  # fmt: skip
    if len(found) > most:
        keep = np.unique(np.linspace(0, len(found) - 1, most).round().astype(int))
        found = [found[k] for k in keep]
    return found


def _turning_points(x: FloatArray) -> list[int]:
    """Samples at which the car turns on the far side from the support, below the middle of its way."""
    middle = 0.5 * (np.quantile(x, 0.02) + np.quantile(x, 0.98))
    below = x < middle
    edges = np.flatnonzero(np.diff(below.astype(int)))
    points: list[int] = []
    for a, b in pairwise(edges.tolist()):
        if below[a + 1]:
            points.append(a + 1 + int(np.argmin(x[a + 1 : b + 1])))
    return points
