r"""Free decay: natural frequency, viscous damping and dry friction at once, from taps of the car with the motor off.

Between two turning points dry friction only moves the middle of the swing,

.. math::

    \ddot x + b \dot x + \omega_0^2 (x - x_e \pm f / \omega_0^2) = 0,

so that it takes the same length :math:`4 f/\omega_0^2` off the swing in every cycle while viscous damping takes the
same fraction, and it does not shift the frequency: :math:`\omega_d = \sqrt{\omega_0^2 - b^2/4}` with or without it. A
single decay therefore tells the two apart by its shape, several of different heights all the better.

The fit is :func:`nonsmooth.fit`'s, over all runs together, from each first turning point to where the car has become
slow: there the friction law is in doubt (a car that creeps, a belt that gives), and the fit should not hang on it. How
far the estimate moves when half of that speed is let in is added to the uncertainty: it is that of the law.

References: J.P. Den Hartog, Trans. ASME 53 (1931) 107; B.F. Feeny and J.W. Liang, J. Sound Vib. 195 (1996) 149.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.signal import find_peaks

from nonsmooth import ParameterSet, Sensor, SolveError, System, elements, fit, mechanical
from nonsmooth.arrays import FloatArray
from nonsmooth_savi2007.identification.cross_checks import Consistent, consistent
from nonsmooth_savi2007.identification.evidence import Run

#: Speed (m/s) of the slowest half swing that is used.
SLOWEST = 0.03
_NAMES = ("omega_0", "b", "f", "x_e")
_UNFITTING = 2.0  # residuals of a run over those of the median run, from which the law does not fit it


class Decay(NamedTuple):
    """The part of a run that is used: from its first sample to before its last."""

    run: Run
    first: int
    last: int

    @property
    def time(self) -> FloatArray:
        """Times in the run (s)."""
        return self.run.time[self.first : self.last]

    @property
    def x(self) -> FloatArray:
        """Positions (m), as counted."""
        return self.run.positions[self.first : self.last]


class DecayFit(NamedTuple):
    r"""Outcome of `free_decay`: :math:`\omega_0`, b = c/m, f = F_C/m, and the place of rest x_e in the sensor's count.

    ``values`` and ``covariance`` are in the order ``omega_0, b, f, x_e``; ``fit`` is what :func:`nonsmooth.fit` found.
    """

    values: FloatArray
    covariance: FloatArray
    parts: tuple[Decay, ...]
    fit: ParameterSet
    notes: tuple[str, ...] = ()

    @property
    def law(self) -> tuple[float, float, float]:
        """Values of omega_0, b and f."""
        natural, b, f, _ = self.values.tolist()
        return natural, b, f

    @property
    def rest(self) -> float:
        """Place of rest (m) in the sensor's count."""
        return self.values[3]

    @property
    def held(self) -> float:
        """As far as dry friction holds the car off its rest (m): F_C/2k."""
        natural, _, f = self.law
        return f / natural**2

    @property
    def runs(self) -> tuple[str, ...]:
        """Names of the runs that entered."""
        return tuple(part.run.name for part in self.parts)

    @property
    def samples(self) -> int:
        """Samples that entered."""
        return self.fit.residuals.sizes["sample"]

    @property
    def noise(self) -> float:
        """Standard deviation of a reading (m)."""
        return self.fit.extra["x.noise"].value

    def error(self, name: str) -> float:
        """Standard uncertainty of one of the four."""
        i = _NAMES.index(name)
        return np.sqrt(self.covariance[i, i])

    def fitted(self, which: int) -> FloatArray:
        """Fitted positions of one of the runs (m), in the sensor's count."""
        data = self.fit.residuals
        return data["fitted"].values[data["run"].values == which]


def swing(run: Run, slowest: float = SLOWEST) -> tuple[int, int]:
    """First and last+1 sample of a decay that are to be used: from the first turning point to the last fast half swing.

    Raises
    ------
    ValueError
        If the record holds no motion, or less than two half swings of that speed.
    """
    time, x = run.time, run.positions
    away = x - np.median(x[-max(10, len(x) // 10) :])
    steps = np.diff(x)
    moving = np.flatnonzero(np.abs(steps) > 2.5 * run.resolution)
    if len(moving) == 0 or np.max(np.abs(away)) < 20 * run.resolution:
        raise ValueError(f"the car moves by {np.max(np.abs(away)) / run.resolution:.0f} counts only: tap it harder")
    # before the tap it rests, or is held: the first turning point comes after it has begun to move
    _, tops = find_peaks(np.abs(away), height=0.5 * np.max(np.abs(away)), plateau_size=1)
    begin = np.append(tops["right_edges"], moving)[0]
    crossings = begin + 1 + np.flatnonzero(np.sign(away[begin + 1 :]) != np.sign(away[begin:-1]))
    at = crossings[(crossings >= begin + 2) & (crossings < len(x) - 2)]
    speeds = np.abs(x[at + 2] - x[at - 2]) / (time[at + 2] - time[at - 2])
    fast = np.argmax(np.append(speeds < slowest, True))
    end = at[fast - 1] + 1 if fast else begin
    if fast < 2 or end - begin < 20:
        raise ValueError(
            f"only {fast} half swings are faster than {slowest:g} m/s; tap harder, or give a smaller `slowest`"
        )
    return begin, end


def free_decay(runs: Sequence[Run], *, slowest: float = SLOWEST, friction: bool = True) -> DecayFit:
    r"""Fit :math:`\omega_0`, c/m and F_C/m to free decays.

    Parameters
    ----------
    runs : sequence of Run
        Each with one tap and its decay.
    slowest : float
        Speed (m/s) of the slowest half swing that is used.
    friction : bool
        False: viscous damping only.

    Returns
    -------
    DecayFit
        Without the records that disagree with the majority, with a note on each.

    Raises
    ------
    ValueError
        If no record can be used.
    SolveError
        If the fit does not settle.
    """
    method = _Method(slowest, friction)
    used = method.used
    parts, notes = method.parts(runs)
    if not parts:
        raise ValueError("no free decay can be used; " + "; ".join(notes))
    agreed, first = None, _guess(parts)
    if len(parts) > 1:
        parts, agreed, said = _agreeing(method, parts, first)
        notes, first = notes + said, _guess(parts)
    if agreed is not None:
        first[used] = agreed.mean
    found = method.fit(parts, first)
    if agreed is None or agreed.agree:
        found = method.with_doubt(found)
    else:
        found.values[used] = agreed.mean
        found.covariance[np.ix_(used, used)] = agreed.covariance + agreed.scatter
    return found._replace(notes=tuple(notes))


@cache
def _oscillator(friction: bool) -> System:
    """The free oscillator about its rest, everything over its mass."""
    dry = {"dry": elements.Coulomb(at="x", friction="f")} if friction else {}
    known = {"omega_0": (4.5, "rad/s"), "b": (1.0, "1/s")} | ({"f": (0.005, "N/kg")} if friction else {})
    return mechanical(
        1.0, "b", lambda p: [[p.omega_0**2]], parameters=known, coordinates={"x": "m"}, elements=dry, name="free decay"
    )


def _guess(parts: Sequence[Decay]) -> FloatArray:
    """First values from turning points: half a period between them; each swing is q times the one before."""
    periods, ratios = [], []
    for part in parts:
        away = part.x - (np.mean(part.x[-20:]) if len(part.x) > 40 else 0.0)
        turned = np.flatnonzero(np.sign(away[1:]) != np.sign(away[:-1]))
        if len(turned) > 1:
            periods.append(2 * np.mean(np.diff(part.time[turned])))
            heights = [np.max(np.abs(away[a:b])) for a, b in pairwise(turned)]
            ratios += [h / g for g, h in pairwise(heights) if g > 0]
    period = np.median(periods) if periods else 1.4
    b = -4 * np.log(min(np.median(ratios), 0.99) if ratios else 0.7) / period  # swing to swing: exp(-b T/4)
    return np.array([np.sqrt((2 * np.pi / period) ** 2 + b**2 / 4), b, 0.005, 0.0])


class _Method(NamedTuple):
    """The fit of decays: speed of the slowest half swing that is used (m/s), and whether friction acts."""

    slowest: float
    friction: bool

    @property
    def used(self) -> list[int]:
        """Indices of the parameters that are fitted."""
        return [0, 1, 2, 3] if self.friction else [0, 1, 3]

    def parts(self, runs: Sequence[Run]) -> tuple[list[Decay], list[str]]:
        """The runs that hold a decay, and a sentence on each that does not."""
        found, notes = [], []
        for run in runs:
            try:
                found.append(Decay(run, *swing(run, self.slowest)))
            except ValueError as error:
                notes.append(f"{_named(run)}: not used: {error}")
        return found, notes

    def fit(self, parts: Sequence[Decay], first: FloatArray) -> DecayFit:
        """The fit from first values; zeros for a friction that is not fitted."""
        names = [_NAMES[i] for i in self.used[:-1]]
        found = fit(
            _oscillator(self.friction).with_parameters(dict(zip(names, first[self.used].tolist(), strict=False))),
            [{"x": (part.time - part.time[0], part.x)} for part in parts],
            [*names, "x.offset"],
            measured={"x": Sensor(resolution=parts[0].run.resolution, offset=first[3])},
            mode="dry_stick" if self.friction else None,
            tries=1,
            progress=False,
        )
        values, covariance = np.zeros(4), np.zeros((4, 4))
        names.append("x.offset")
        values[self.used] = [found.estimate(name).value for name in names]
        covariance[np.ix_(self.used, self.used)] = found.full_covariance.sel(parameter=names, other=names)
        if not np.isfinite(covariance).all():
            raise SolveError(f"the decays do not determine {', '.join(names)}")
        return DecayFit(values, covariance, tuple(parts), found)

    def with_doubt(self, found: DecayFit) -> DecayFit:
        """The fit with the uncertainty of the law: how far its values move when half of the speed is let in."""
        slower, _ = self._replace(slowest=self.slowest / 2).parts([part.run for part in found.parts])
        moved = self.fit(slower, found.values).values - found.values
        return found._replace(covariance=found.covariance + np.outer(moved, moved))


def _named(run: Run) -> str:
    return f"run {run.name!r}, channel 'Angle'"


def _agreeing(
    method: _Method, parts: list[Decay], first: FloatArray
) -> tuple[list[Decay], Consistent | None, list[str]]:
    """Parts that are used, what they agree on where there are several, and a sentence on each that is left out.

    Each is fitted alone. One that the law does not fit (a string that slipped on the wheel, a hand that touched) leaves
    more than the others; one that it fits may still tell other values.
    """
    used, alone = method.used, dict[int, DecayFit]()
    for i, part in enumerate(parts):
        with suppress(SolveError):
            alone[i] = method.with_doubt(method.fit([part], first))
    said = []
    typical = np.median([one.noise for one in alone.values()]) if alone else 1.0
    good = [i for i, one in alone.items() if one.noise <= _UNFITTING * typical]
    if 2 * len(good) <= len(parts):
        said.append(
            f"{len(parts) - len(good)} of {len(parts)} decays are not those of the law, and no majority is: see "
            "whether the string slips on the wheel, and tap again"
        )
        return parts, None, said
    for i, part in enumerate(parts):
        if i not in good:
            by = (
                "no decay fits it"
                if i not in alone
                else f"it is {alone[i].noise / typical:.1f} times as far from a decay as the others are (root of chi^2)"
            )
            said.append(f"{_named(part.run)}: left out: {by}; see whether the string slipped on the wheel")
    if len(good) < 2:
        return [parts[i] for i in good], None, said
    told = {i: (alone[i].values[used], alone[i].covariance[np.ix_(used, used)]) for i in good}
    agreed = consistent(*zip(*told.values(), strict=True))
    for i, keep in zip(good, agreed.used, strict=True):
        if not keep:
            off = agreed.off(*told[i])
            k = np.argmax(np.abs(off))
            said.append(
                f"{_named(parts[i].run)}: left out: its {_NAMES[used[k]]} is {off[k]:+.1f} combined uncertainties from "
                f"that of the {np.count_nonzero(agreed.used)} runs that agree; see whether the string slipped on the "
                "wheel"
            )
    if not agreed.agree:
        said.append(
            f"the {len(good)} decays disagree (Birge ratio {agreed.birge:.1f}) and no majority agrees: all are used, "
            "with the scatter between them as uncertainty; see whether the string slips on the wheel"
        )
    return [parts[i] for i, keep in zip(good, agreed.used, strict=True) if keep], agreed, said
