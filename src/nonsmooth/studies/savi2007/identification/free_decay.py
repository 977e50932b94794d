r"""Free decay: natural frequency, viscous damping and dry friction at once, from taps of the car with the motor off.

Between two turning points dry friction only moves the middle of the swing,

.. math::

    \ddot x + b \dot x + \omega_0^2 (x - x_e \pm f / \omega_0^2) = 0,

so that it takes the same length :math:`4 f/\omega_0^2` off the swing in every cycle while viscous damping takes the
same fraction, and it does not shift the frequency: :math:`\omega_d = \sqrt{\omega_0^2 - b^2/4}` with or without it. A
single decay therefore tells the two apart by its shape, several of different heights all the better.

The fit is in the time domain over all runs together, from each first turning point to where the car has become slow:
there the friction law is in doubt (a car that creeps, a belt that gives), and the fit should not hang on it. How far
the estimate moves when half of that speed is let in is added to the uncertainty: it is that of the law.

References: J.P. Den Hartog, Trans. ASME 53 (1931) 107; B.F. Feeny and J.W. Liang, J. Sound Vib. 195 (1996) 149.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from nonsmooth import SolveError
from nonsmooth.arrays import FloatArray
from nonsmooth.studies.savi2007.identification.consistency import Consistent, consistent
from nonsmooth.studies.savi2007.identification.pieces import Piece, start_state
from nonsmooth.studies.savi2007.identification.shooting import ShootingFit, shoot

__all__ = ["DecayFit", "free_decay", "swing"]


#: Speed (m/s) of the slowest half swing that is used.
SLOWEST = 0.03
_NAMES = ("omega_0", "b", "f", "x_e")
_UNFITTING = 4.0  # chi^2 of a run's residuals, in that of the median run, from which the law does not fit it


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
    check: bool = True,
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
    check : bool
        Leave out records that disagree with the majority, with a note on each.

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
    records, notes = _records(runs, resolution, slowest, names)
    if not records:
        raise ValueError("no free decay can be used; " + "; ".join(notes))
    apart: Consistent | None = None
    if check and len(records) > 1:
        chosen, apart, said = _agreeing(records, runs, resolution, slowest, friction, jitter)
        records, notes = [records[i] for i in chosen], notes + said
    values, covariance, fit = _fit(records, friction, resolution, jitter)
    if apart is not None:
        used = _used(friction)
        values[used], covariance[np.ix_(used, used)] = apart.mean, apart.covariance + apart.scatter
    elif doubt_law:
        slower = _records([runs[r.number] for r in records], resolution, slowest / 2, None)[0]
        moved = _fit(slower, friction, resolution, jitter)[0] - values
        covariance += np.outer(moved, moved)
    return DecayFit(
        values, covariance, tuple(r.number for r in records), tuple(r.span for r in records), fit, tuple(notes)
    )


class _Record(NamedTuple):
    """The used part of a record: number of its run, name, first and last+1 sample, times (s) and positions (m)."""

    number: int
    name: str
    span: tuple[int, int]
    time: FloatArray
    x: FloatArray


def _records(
    runs: Sequence[tuple[Any, Any]], resolution: float, slowest: float, names: Sequence[str] | None
) -> tuple[list[_Record], list[str]]:
    """The records that hold a decay, and a sentence on each that does not."""
    found, notes = [], []
    for i, (time, x) in enumerate(runs):
        t, position = np.asarray(time, dtype=np.float64), np.asarray(x, dtype=np.float64)
        name = f"decay {i + 1}" if names is None else f"run {names[i]!r}, channel 'Angle'"
        try:
            begin, end = swing(t, position, resolution=resolution, slowest=slowest)
        except ValueError as error:
            notes.append(f"{name}: not used: {error}")
            continue
        found.append(_Record(i, name, (begin, end), t[begin:end] - t[begin], position[begin:end]))
    return found, notes


def _used(friction: bool) -> list[int]:
    """Indices of the parameters that are fitted."""
    return [0, 1, 2, 3] if friction else [0, 1, 3]


def _fit(
    records: Sequence[_Record], friction: bool, resolution: float, jitter: float | None
) -> tuple[FloatArray, FloatArray, ShootingFit]:
    """The four values, their covariance and the fit; zeros for a friction that is not fitted."""
    used = _used(friction)
    which = np.arange(len(used))
    pieces = [
        Piece(
            r.time, r.x, np.zeros_like(r.time), which, _build(friction), start_state(r.time, r.x), label=str(r.number)
        )
        for r in records
    ]
    steps = np.array([1e-4, 1e-4, 1e-5, 1e-6])[used]
    fit = shoot(pieces, _guess(pieces)[used], steps, resolution=resolution, jitter=jitter)
    values, covariance = np.zeros(4), np.zeros((4, 4))
    values[used] = fit.values
    covariance[np.ix_(used, used)] = fit.covariance
    return values, covariance, fit


def _agreeing(
    records: Sequence[_Record], runs: Sequence[tuple[Any, Any]], resolution: float, slowest: float, friction: bool,
    jitter: float | None,
) -> tuple[list[int], Consistent | None, list[str]]:  # fmt: skip
    """Records that agree, their weighted mean where no majority agrees, and a sentence on each that is left out.

    Each is fitted alone. One that the law does not fit (a string that slipped on the wheel, a hand that touched) leaves
    more than the others; one that it fits may still tell other values.
    """
    alone: list[tuple[FloatArray, FloatArray, ShootingFit] | None] = []
    for r in records:
        try:
            values, covariance, fit = _fit([r], friction, resolution, jitter)
            slower = _records([runs[r.number]], resolution, slowest / 2, None)[0]
            moved = _fit(slower, friction, resolution, jitter)[0] - values
            alone.append((values, covariance + np.outer(moved, moved), fit))
        except SolveError:
            alone.append(None)
    said = []
    fits = {i: one[2] for i, one in enumerate(alone) if one is not None}
    fitted = list(fits)
    left = _unfitting(list(fits.values()), resolution)
    typical = float(np.median(np.sqrt(left))) if len(left) else 1.0
    good = [i for i, excess in zip(fitted, left, strict=True) if excess <= _UNFITTING * typical**2]
    if 2 * len(good) <= len(records):
        return list(range(len(records))), None, [
            f"{len(records) - len(good)} of {len(records)} decays are not those of the law, and no majority is: "
            "see whether the string slips on the wheel, and tap again"
        ]  # fmt: skip
    for i, r in enumerate(records):
        if i not in good:
            by = (
                "no decay fits it" if i not in fitted else
                f"it is {np.sqrt(left[fitted.index(i)]) / typical:.1f} times as far from a decay as the others are "
                "(root of chi^2)"
            )  # fmt: skip
            said.append(f"{r.name}: left out: {by}; see whether the string slipped on the wheel")
    if len(good) < 2:
        return good, None, said
    used = _used(friction)
    told = [(one[0][used], one[1][np.ix_(used, used)]) for one in (alone[i] for i in good) if one is not None]
    found = consistent([values for values, _ in told], [covariance for _, covariance in told])
    for i, keep, (values, covariance) in zip(good, found.used, told, strict=True):
        if not keep:
            off = found.off(values, covariance)
            k = int(np.argmax(np.abs(off)))
            said.append(
                f"{records[i].name}: left out: its {_NAMES[used[k]]} is {off[k]:+.1f} combined uncertainties from that "
                f"of the {np.count_nonzero(found.used)} runs that agree; see whether the string slipped on the wheel"
            )
    if not found.agree:
        said.append(
            f"the {len(good)} decays disagree (Birge ratio {found.birge:.1f}) and no majority agrees: all are used, "
            "with the scatter between them as uncertainty; see whether the string slips on the wheel"
        )
    return [i for i, keep in zip(good, found.used, strict=True) if keep], None if found.agree else found, said


def _unfitting(fits: Sequence[ShootingFit], resolution: float) -> FloatArray:
    """Mean square of each run's residuals over what a count and the clock's typical jitter let expect."""
    jitter = float(np.median([fit.jitter for fit in fits])) if fits else 0.0
    return np.array([
        float(np.mean(r**2 / (resolution**2 / 12 + (jitter * f[:, 1]) ** 2)))
        for fit in fits for r, f in zip(fit.residuals, fit.fitted, strict=True)
    ])  # fmt: skip


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
