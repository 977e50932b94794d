r"""Free decay: natural frequency, viscous damping and dry friction at once, from taps of the car with the motor off.

Between two turning points dry friction only moves the middle of the swing,

.. math::

    \ddot x + b \dot x + \omega_0^2 (x - x_e \pm f / \omega_0^2) = 0,

so that it takes the same length :math:`4 f/\omega_0^2` off the swing in every cycle while viscous damping takes the
same fraction, and it does not shift the frequency: :math:`\omega_d = \sqrt{\omega_0^2 - b^2/4}` with or without it. A
single decay therefore tells the two apart by its shape, several of different heights all the better.

The fit is in the time domain over all runs together, from each first turning point to where the car has become slow:
there the friction law is in doubt (a car that creeps, a belt that gives), and the fit should not hang on it. How far
the estimate moves when half of that speed is let in is added to the uncertainty: it is what the law is worth.

References: J.P. Den Hartog, Trans. ASME 53 (1931) 107; B.F. Feeny and J.W. Liang, J. Sound Vib. 195 (1996) 149.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.identification.pieces import Piece, start_state
from nonsmooth.identification.shooting import ShootingFit, shoot

__all__ = ["DecayFit", "free_decay", "swing"]

FloatArray = NDArray[np.float64]

#: Speed (m/s) of the slowest half swing that is used.
SLOWEST = 0.03
_NAMES = ("omega_0", "b", "f", "x_e")


@dataclass(frozen=True, eq=False)
class DecayFit:
    r"""Outcome of `free_decay`: :math:`\omega_0`, b = c/m, f = F_C/m, and the place of rest x_e in the sensor's count.

    ``values`` and ``covariance`` are in the order ``omega_0, b, f, x_e``; ``fit`` holds residuals and weights.
    """

    values: FloatArray
    covariance: FloatArray
    runs: tuple[int, ...]
    spans: tuple[tuple[int, int], ...]
    fit: ShootingFit
    notes: tuple[str, ...] = ()

    @property
    def samples(self) -> int:
        """Samples that entered."""
        return self.fit.samples

    def error(self, name: str) -> float:
        """Standard uncertainty of one of the four."""
        i = _NAMES.index(name)
        return float(np.sqrt(self.covariance[i, i]))


def swing(time: FloatArray, x: FloatArray, *, resolution: float, slowest: float = SLOWEST) -> tuple[int, int]:
    """First and last+1 sample of a decay that are to be used: from the first turning point to the last fast half swing.

    Raises
    ------
    ValueError
        If the record holds no motion, or less than two half swings of that speed.
    """
    rest = float(np.median(x[-max(10, len(x) // 10) :]))
    away = x - rest
    steps = np.diff(x)
    moving = np.flatnonzero(np.abs(steps) > 2.5 * resolution)
    if len(moving) == 0 or np.max(np.abs(away)) < 20 * resolution:
        raise ValueError(f"the car moves by {np.max(np.abs(away)) / resolution:.0f} counts only: tap it harder")
    # before the tap it rests, or is held: the first turning point comes after it has begun to move
    first = int(moving[0])
    reach, way = 0.5 * float(np.max(np.abs(away[first:]))), 0.0
    begin = first
    for i in range(first, len(steps)):
        if way * steps[i] < 0 and abs(away[i]) > reach and way * away[i] > 0:
            begin = i
            break
        way = float(np.sign(steps[i])) or way
    crossings = begin + 1 + np.flatnonzero(np.sign(away[begin + 1 :]) != np.sign(away[begin:-1]))
    end, fast, wide = begin, 0, 2
    for i in crossings.tolist():
        if i + wide >= len(x) or i - wide < begin:
            continue
        speed = abs(x[i + wide] - x[i - wide]) / (time[i + wide] - time[i - wide])
        if speed < slowest:
            break
        end, fast = int(i) + 1, fast + 1
    if fast < 2 or end - begin < 20:
        raise ValueError(
            f"only {fast} half swings are faster than {slowest:g} m/s; tap harder, or give a smaller `slowest`"
        )
    return begin, end


def free_decay(
    runs: Sequence[tuple[Any, Any]],
    *,
    resolution: float,
    slowest: float = SLOWEST,
    friction: bool = True,
    jitter: float | None = None,
    doubt_law: bool = True,
    names: Sequence[str] | None = None,
) -> DecayFit:
    r"""Fit :math:`\omega_0`, c/m and F_C/m to free decays.

    Parameters
    ----------
    runs : sequence of (time, x)
        Records (s, m), each with one tap and its decay.
    resolution : float
        Length of a count (m).
    slowest : float
        Speed (m/s) of the slowest half swing that is used.
    friction : bool
        False: viscous damping only.
    jitter : float, optional
        Standard deviation of the sampling instants (s), where known.
    doubt_law : bool
        Add to the covariance how far the estimate moves with half of ``slowest``.
    names : sequence of str, optional
        Names of the records for the notes on those that cannot be used.

    Returns
    -------
    DecayFit

    Raises
    ------
    ValueError
        If no record can be used.
    SolveError
        If the fit does not settle.
    """
    pieces: list[Piece] = []
    taken, spans, notes = [], [], []
    for i, (time, x) in enumerate(runs):
        t, position = np.asarray(time, dtype=np.float64), np.asarray(x, dtype=np.float64)
        try:
            begin, end = swing(t, position, resolution=resolution, slowest=slowest)
        except ValueError as error:
            name = f"decay {i + 1}" if names is None else f"run {names[i]!r}, channel 'Angle'"
            notes.append(f"{name}: not used: {error}")
            continue
        taken.append(i)
        spans.append((begin, end))
        t, position = t[begin:end] - t[begin], position[begin:end]
        which = np.arange(4) if friction else np.array([0, 1, 3])
        pieces.append(
            Piece(t, position, np.zeros_like(t), which, _build(friction), start_state(t, position), label=str(i))
        )
    if not pieces:
        raise ValueError("no free decay can be used; " + "; ".join(notes))
    guess = _guess(pieces)
    used = [0, 1, 2, 3] if friction else [0, 1, 3]
    place = {name: k for k, name in enumerate(used)}
    pieces = [
        Piece(p.time, p.x, p.phase, np.array([place[w] for w in p.which]), p.build, p.start, label=p.label)
        for p in pieces
    ]
    steps = np.array([1e-4, 1e-4, 1e-5, 1e-6])[used]
    fit = shoot(pieces, guess[used], steps, resolution=resolution, jitter=jitter)
    values, covariance = np.zeros(4), np.zeros((4, 4))
    values[used] = fit.values
    covariance[np.ix_(used, used)] = fit.covariance
    if doubt_law:
        other = free_decay(
            runs, resolution=resolution, slowest=slowest / 2, friction=friction, jitter=jitter, doubt_law=False
        )
        moved = other.values - values
        covariance += np.outer(moved, moved)
    return DecayFit(values, covariance, tuple(taken), tuple(spans), fit, tuple(notes))


_NO_DRIVE, _NO_CONTACT = np.zeros(4), np.array([0.0, 0.0, np.inf])


def _build(friction: bool) -> Any:
    def with_friction(p: FloatArray) -> tuple[Any, Any, Any]:
        return p, _NO_DRIVE, _NO_CONTACT

    def viscous(p: FloatArray) -> tuple[Any, Any, Any]:
        return np.array([p[0], p[1], 0.0, p[2]]), _NO_DRIVE, _NO_CONTACT

    return with_friction if friction else viscous


def _guess(pieces: Sequence[Piece]) -> FloatArray:
    """From turning points: half a period between them; each swing is q times the one before."""
    periods, ratios, rests = [], [], []
    for p in pieces:
        rest = float(np.mean(p.x[-20:])) if len(p.x) > 40 else 0.0
        away = p.x - rest
        turned = np.flatnonzero(np.sign(away[1:]) != np.sign(away[:-1]))
        if len(turned) > 1:
            periods.append(2 * float(np.mean(np.diff(p.time[turned]))))
            heights = [np.max(np.abs(away[a:b])) for a, b in pairwise(turned)]
            ratios += [h / g for g, h in pairwise(heights) if g > 0]
        rests.append(0.0)
    period = float(np.median(periods)) if periods else 1.4
    ratio = min(float(np.median(ratios)), 0.99) if ratios else 0.7
    b = -4 * np.log(ratio) / period  # swing to swing: exp(-b T/4)
    omega_d = 2 * np.pi / period
    return np.array([np.sqrt(omega_d**2 + b**2 / 4), b, 0.005, float(np.mean(rests))])
