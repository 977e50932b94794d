r"""The gap, referred to the car's mean position under the drive.

The string moves the driven end by :math:`a\cos\varphi + L - \sqrt{L^2 - a^2 \sin^2\varphi}`, whose mean is
:math:`a^2/(4L)` and not zero; the car's mean position moves by half of it, :math:`a^2/(8L)`: 0.4 mm at Fig. 13 with
L = 0.5 m, a quarter of the gap, to the side where the motor is. A motor that turns unevenly,
:math:`\varphi = \omega t + \epsilon \sin(\omega t + \beta)`, moves it by :math:`-a\,\epsilon \cos\beta/4` more
(:func:`mean_of_drive` derives both).
The model's drive, :math:`\rho\cos\omega t`, has no mean: its gap must be counted from where the car swings about. Both
parts are read off the mean positions of steady runs without contact.

Where the car rests and about which place it swings comes from one function, :func:`places`, for `identify` and
`compare` alike; :func:`refer` refers to it the gap that the contacts tell in the sensor's count.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import block_diag

from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, Finding, uniform
from nonsmooth.recordings import Quantity
from nonsmooth_savi2007.identification.adjustment import Adjusted
from nonsmooth_savi2007.identification.cross_checks import consistent, inverse
from nonsmooth_savi2007.identification.evidence import Evidence
from nonsmooth_savi2007.identification.free_decay import DecayFit
from nonsmooth_savi2007.identification.multiple_shooting import ContactFit
from nonsmooth_savi2007.identification.response_fits import crank_mark
from nonsmooth_savi2007.identification.steady import Steady

_CLEAR = 4.0  # standard uncertainties by which a sign, or a contradiction, is taken as seen


class MeanShift(NamedTuple):
    r"""Place of the car over crank length, in the sensor's count: at rest, and about which it swings.

    .. math:: \bar x(a) = r + s(a), \qquad s(a) = \alpha a^2 + \beta a

    Three places are told apart: where the sensor counts zero, where the springs balance (``rest``; a car with dry
    friction stops within F_C/2k of it, and a sensor is zeroed where the car happens to stand), and the mean position
    under the drive. ``covariance`` is that of (rest, alpha, beta), ``by_zero`` how they move with the place of rest
    that the taps tell; ``notes`` on what the runs say of the string.
    """

    rest: float
    alpha: float
    beta: float
    covariance: FloatArray
    by_zero: FloatArray
    string_length: float | None = None
    notes: tuple[str, ...] = ()

    def at(self, crank_length: float) -> tuple[float, float]:
        """The shift s (m) from the place of rest at a crank length, and its standard uncertainty."""
        return self._of(self.row(crank_length))

    def place(self, crank_length: float) -> tuple[float, float]:
        """The mean position (m) in the sensor's count at a crank length, and its standard uncertainty."""
        return self._of(self.row(crank_length) + np.array([1.0, 0.0, 0.0]))

    def row(self, crank_length: float) -> FloatArray:
        """Derivatives of the shift in (rest, alpha, beta)."""
        return np.array([0.0, _square(crank_length, self.string_length), crank_length])

    def _of(self, row: FloatArray) -> tuple[float, float]:
        return float(row @ [self.rest, self.alpha, self.beta]), float(np.sqrt(row @ self.covariance @ row))


def mean_of_drive(crank_length: float, string_length: float, ripple: float = 0.0, ripple_phase: float = 0.0) -> float:
    r"""Mean of the driven end over a turn (m), string and uneven turning to their lowest orders.

    .. math::

        \langle d \rangle = \frac{a^2}{4L}\left(1 + \frac{3a^2}{16L^2}\right) - \frac{a\,\epsilon}{2}\cos\beta

    since (with the means 1/2, 3/8 and :math:`\cos\beta/2`)

    .. math::

        L - \sqrt{L^2 - a^2\sin^2\varphi} = \frac{a^2\sin^2\varphi}{2L} + \frac{a^4\sin^4\varphi}{8L^3} + \ldots, \qquad
        \cos(\theta + \epsilon\sin(\theta + \beta)) \approx \cos\theta - \epsilon \sin\theta \sin(\theta + \beta) .

    The car between two equal springs moves by half.
    """
    string = _square(crank_length, string_length) / (4 * string_length)
    return string - 0.5 * crank_length * ripple * np.cos(ripple_phase)


def mean_shift(
    seen: Steady,
    zero: float,
    zero_error: float,
    *,
    string: Quantity | None = None,
    dry: float = 0.0,
) -> MeanShift:
    r"""Fit the mean positions of steady runs without contact, together with the place of rest.

    The string's length says how large :math:`\alpha = \pm 1/(8L)` is and not which sign it has: the motor pulls the
    mean position to its own side, which the runs show where they have two crank lengths or more. Dry friction holds a
    car that goes longer one way than the other off its place, by :math:`F_C/2k` times the mean sign of its velocity:
    some micrometres, which are taken out.

    Parameters
    ----------
    seen : Steady
        Steady runs; without any, what is known of string and motor alone bounds the shift.
    zero, zero_error : float
        Where the car rests in the sensor's count (m), from the free decay; without taps, where the sensor was zeroed
        and how far that may be from rest.
    string : Quantity, optional
        Length of the string (m).
    dry : float
        F_C/2k (m).
    """
    string_length, size, told = None, 0.1, 0.0
    if string is not None:
        string_length = string.value
        size, told = 1 / (8 * string_length), max(string.uncertainty, 1e-4 * string_length) / (8 * string_length**2)

    def fitted(length: float | None, alpha: float, alpha_error: float) -> MeanShift:
        """Rest, alpha and beta by least squares; alpha is known beforehand to its error, beta to a ripple of 0.03."""
        matrix = np.column_stack([np.ones(len(seen)), _square(seen.crank, length), seen.crank])
        y = seen.mean + dry * seen.lean
        known = np.array([max(zero_error, 1e-9), alpha_error, 0.03 / 4]) ** -2.0
        spread = 1e-5
        for _ in range(3):  # the scatter of the means from what the fit leaves of them
            covariance = inverse(matrix.T @ matrix / spread**2 + np.diag(known))
            found = covariance @ (matrix.T @ y / spread**2 + known * [zero, alpha, 0.0])
            left = y - matrix @ found
            spread = max(float(np.sqrt(left @ left / max(len(y) - 2, 1))), 1e-6)
        rest, curved, straight = found.tolist()
        return MeanShift(rest, curved, straight, covariance, covariance[:, 0] * known[0], length)

    free = fitted(None, 0.0, 2 * size if string_length else 0.25)
    error = np.sqrt(free.covariance[1, 1])
    if abs(free.alpha) <= _CLEAR * error:
        several = f"the {len(seen)} runs without the support do not tell"
        note = (
            f"{several if len(seen) else 'no run without the support tells'} on which side the motor is, and with it "
            "which way its string moves the mean position: the gap is uncertain by as much at other crank lengths than "
            "theirs. Record such runs (response, no gap) at two crank lengths or more, and taps of the car (impulse)"
        )
        return fitted(string_length, 0.0, size)._replace(notes=(note,))
    side, note = int(np.sign(free.alpha)), ""
    if not string_length:
        return free
    off = abs(free.alpha - side * size) / np.hypot(error, told)
    if off > _CLEAR:
        note = (
            f"the mean positions say a string of {1 / (8 * abs(free.alpha)):.3g} m, the notebook {string_length:.3g} "
            f"m ({off:.0f} uncertainties apart): string_length is not used. Measure it from crank to driven spring"
        )
        return free._replace(notes=(note,))
    if side < 0:
        note = (
            "the motor pulls from the side away from the support: its string moves the mean position away from the "
            "support"
        )
    return fitted(string_length, side * size, told)._replace(notes=(note,) if note else ())


def _square(crank_length: Any, string_length: float | None) -> Any:
    """Square of the crank's length, with the next order of the string's term: 0.1 % at a = 39 mm and L = 0.5 m."""
    square = crank_length**2
    return square * (1 + 3 * square / (16 * string_length**2)) if string_length else square


_MOUNTED = 0.15  # rad: within which a mark is taken as put where it should be
_HELD = 1e-3  # m: half width within which dry friction may hold a car of which nothing is known


class CountedGap(NamedTuple):
    """The gap in the sensor's count at one reading of the screw, by the runs with contact there.

    ``places`` and ``weight``: the places of the runs' gaps among the parameters of the contacts' fit, and how much each
    counts; ``notes``: a sentence on each run that is left out.
    """

    value: float
    error: float
    places: list[int]
    weight: FloatArray
    notes: tuple[str, ...]


def counted_gap(contacts: ContactFit, reading: float) -> CountedGap | None:
    """Weighted mean of the gaps of the runs at a reading of the screw, without those that disagree; None of none."""
    rows = [i for i, run in enumerate(contacts.runs) if run.gap == reading]
    if not rows:
        return None
    index = [contacts.place(i, 0) for i in rows]
    own = np.diag(contacts.covariance)[index]
    apart = consistent(contacts.values[index][:, None], own[:, None, None])
    notes = [
        f"contact {contacts.runs[i].name}: left out of the gap, which differs there by "
        f"{1e6 * (contacts.values[j] - apart.mean[0]):+.0f} µm ({apart.off(contacts.values[[j]], [[e]])[0]:+.1f} "
        "uncertainties) from that of the other runs: see whether the string slipped on the wheel"
        for i, j, e, keep in zip(rows, index, own, apart.used, strict=True)
        if not keep
    ]
    index = [j for j, keep in zip(index, apart.used, strict=True) if keep]
    block = contacts.covariance[np.ix_(index, index)]
    solved = np.linalg.solve(block, np.ones(len(index)))
    weight = solved / solved.sum()
    counted = weight @ contacts.values[index]
    off = contacts.values[index] - counted
    chi2 = off @ np.linalg.solve(block, off)
    # the runs may differ by more than they say: then their scatter counts
    square = max(chi2 / max(len(index) - 1, 1), 1.0) * (weight @ block @ weight)
    if not apart.agree:
        square += apart.scatter[0, 0]
        notes.append(
            f"the gaps of the {len(index)} runs with contact disagree (Birge ratio {apart.birge:.1f}) and no majority "
            "agrees: the scatter between them is the uncertainty; see whether the string slips on the wheel"
        )
    return CountedGap(counted, np.sqrt(square), index, weight, tuple(notes))


class Referred(NamedTuple):
    """The gap, and how it varies together with what else is identified.

    Attributes
    ----------
    finding : Finding
        ``g``, counted from the mean position under the drive; ``others``: ``gap_at_rest``, from where the car rests,
        ``mean_shift``, the one less the other, and ``rest_position``, where the car rests in the sensor's count (m).
        ``covariance`` is that of these four.
    cross : array (4, p)
        Covariance with the unknowns of the adjustment: the same records tell the gap and k_s/m, the same decays zero
        and omega_0.
    notes : tuple of str
        What the runs say of the string, and which of them are left out.
    """

    finding: Finding
    cross: FloatArray
    notes: tuple[str, ...]


def places(evidence: Evidence, decay: DecayFit | None, seen: Steady, *, held: float | None = None) -> MeanShift:
    """Places about which the car rests and swings, in the sensor's count, from taps, steady runs and the string.

    Parameters
    ----------
    decay : DecayFit, optional
        Of taps with the same zero of the sensor. Without it the sensor's zero stands for the place of rest, as far as
        friction holds the car off it.
    seen : Steady
        Steady runs without contact.
    held : float, optional
        Half width (m) of the range in which dry friction holds the car, F_C/2k; a millimetre where it is not known.
    """
    if decay is not None:
        zero, error, dry = decay.rest, decay.error("x_e"), decay.held
    else:
        zero, dry = 0.0, held or 0.0
        error = np.hypot(uniform(_HELD if held is None else held), uniform(evidence.resolution / 2))
    found = mean_shift(seen, zero, error, string=evidence.apparatus.get("string_length"), dry=dry)
    if decay is None or abs(found.rest) < evidence.resolution:
        return found
    said = (
        f"the car rests at {1e3 * found.rest:+.3f} mm of the rotary sensor's count, and not where it was zeroed (dry "
        f"friction holds it within ±{1e3 * dry:.2f} mm): gap and mean position count from where it rests"
    )
    return found._replace(notes=(said, *found.notes))


def mark_of(seen: Steady, decay: DecayFit) -> tuple[float, str]:
    """The crank's angle at the photogate (rad), and a sentence where it is far from 0; 0 where no run shows it.

    A mark that is a few hundredths off, as gates are mounted, stays 0: fits with a free phase find it better.
    """
    if not len(seen):
        return 0.0, ""
    angle = crank_mark(seen, decay)
    if abs(angle) < _MOUNTED:
        return 0.0, ""
    return angle, (
        f"at the photogate's mark the crank stands {angle:+.2f} rad from where it pulls the car towards the support"
        + (": the motor is on the other side, or the mark half a turn round" if abs(angle) > np.pi - _MOUNTED else "")
        + "; phases are counted from there"
    )


def refer(
    evidence: Evidence,
    decay: DecayFit,
    contacts: ContactFit,
    adjusted: Adjusted,
    seen: Steady,
    crank_length: float | None,
) -> Referred:
    """The gap at the most frequent screw reading, referred to the mean position at ``crank_length``.

    Parameters
    ----------
    seen : Steady
        Steady runs without contact: their mean positions tell the shift.
    crank_length : float, optional
        The longest of the runs with contact where not given.
    """
    readings = [run.gap for run in contacts.runs]
    reading = max(set(readings), key=readings.count)
    counted = counted_gap(contacts, reading)
    assert counted is not None
    found = places(evidence, decay, seen)
    longest = max(run.crank for run in contacts.runs)
    crank = longest if crank_length is None else crank_length
    moved = found.row(crank)
    # gap = counted - rest - shift, at rest = counted - rest, of counted and (rest, alpha, beta)
    rest = np.array([1.0, 0.0, 0.0])
    rows = np.array([[1.0, *(-rest - moved)], [1.0, *-rest], [0.0, *moved], [0.0, *rest]])
    covariance = rows @ block_diag(counted.error**2, found.covariance) @ rows.T
    values = rows @ [counted.value, found.rest, found.alpha, found.beta]
    names = ("g", "gap_at_rest", "mean_shift", "rest_position")
    estimates = {
        name: Estimate(value, np.sqrt(square), "m")
        for name, value, square in zip(names, values, np.diag(covariance), strict=True)
    }
    gap, at_rest, shift, _ = estimates.values()
    finding = Finding(
        "g",
        gap,
        "multiple shooting over records with contact, referred to the mean position",
        contacts.samples,
        tuple(run.name for run in contacts.runs),
        (
            f"counted from the mean position under the drive at a crank of {1e3 * crank:.2f} mm, "
            f"{1e6 * shift.value:+.0f} µm from where the car rests (string and uneven turning); as read at rest, "
            "the model would stand at another gap by as much",
            f"stands for a reading of {1e3 * reading:.4g} mm at the screw, whose zero is off by "
            f"{1e6 * (at_rest.value - reading):+.0f} µm",
            *counted.notes,
        ),
        {name: one for name, one in estimates.items() if name != "g"},
        covariance,
    )
    with_counted = _cross(adjusted, ("kappa", "gamma"), contacts.covariance[3:5][:, counted.places] @ counted.weight)
    with_zero = _cross(adjusted, ("omega_0", "b", "f"), decay.covariance[:3, 3])
    cross = rows @ np.array([with_counted, *np.outer(found.by_zero, with_zero)])
    return Referred(finding, cross, (*found.notes, *counted.notes))


def _cross(adjusted: Adjusted, labels: tuple[str, ...], shared: FloatArray) -> FloatArray:
    """Covariance of the unknowns with something that varies with these observations."""
    columns = [adjusted.labels.index(label) for label in labels if label in adjusted.labels]
    if len(columns) != len(labels):
        return np.zeros(len(adjusted.names))
    return adjusted.influence[:, columns] @ shared
