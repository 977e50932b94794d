r"""Mean position of the car, and the gap counted from there.

Three places are told apart. The rig's position counts from where the *sensor was zeroed*; the car *rests* where its
springs balance, and a car with dry friction stops, and is zeroed, anywhere within :math:`F_C/2k` of it; under the drive
it swings about a *mean position*, which string and uneven turning move away from rest
(``identification.referral``). The model's drive has no mean, so its x and g count from the mean position. The
screw has a zero of its own: identification tells the gap at rest.

Taps of the session tell where the car rests, its steady runs without the support where it swings; `identify` takes both
from the same function.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from nonsmooth.recordings import RecordingWarning, Session
from nonsmooth_savi2007.identification.evidence import gather
from nonsmooth_savi2007.identification.free_decay import free_decay
from nonsmooth_savi2007.identification.referral import MeanShift, mark_of, places
from nonsmooth_savi2007.identification.steady import steady

#: Procedures that tell the reference: taps, steady runs, and those that show the sensor's direction.
_TELLING = ("impulse", "response", "contact", "grazing", "section", "rise")


class GapOffset(NamedTuple):
    """Gap at rest less the screw's reading (m), its standard uncertainty, and what it is correlated with.

    ``rest`` is the place of rest in the count of the session that was identified from: another session with the same
    taps has the same, and its errors cancel. ``held`` is F_C/2k: as far as dry friction may hold a car off its rest.
    """

    value: float
    uncertainty: float
    rest: float | None = None
    held: float | None = None


@dataclass(frozen=True, eq=False)
class GapReference:
    r"""Reference of the screw's reading and of the sensor's count.

    Attributes
    ----------
    offset : GapOffset
        What the gap at rest is more than the screw reads.
    places : MeanShift, optional
        Place of rest, and about which the car swings, in the sensor's count. None: x and g stay as read.
    direction : int
        -1 where the sensor counts away from the support.
    mark : float
        The crank's angle (rad) at the photogate, from where it pulls towards the support; 0 where it is near that.
    """

    offset: GapOffset
    places: MeanShift | None = None
    direction: int = 1
    mark: float = 0.0

    @property
    def runs(self) -> int:
        """Runs without the support behind it."""
        return 0 if self.places is None else self.places.runs

    def mean(self, crank_length: float) -> tuple[float, float]:
        """The car's mean position (m) in the sensor's count, and its standard uncertainty."""
        return (0.0, 0.0) if self.places is None else self.places.place(crank_length)

    def gap(self, reading: float, crank_length: float) -> tuple[float, float]:
        """The gap (m) from the mean position at a reading of the screw, and its standard uncertainty."""
        if self.places is None:
            return reading + self.offset.value, self.offset.uncertainty
        shift, error = self.places.at(crank_length)
        variance = self.offset.uncertainty**2 + error**2
        if self.offset.rest is not None and abs(self.offset.rest - self.places.rest) < 1e-12:
            # the taps that the gap at rest was counted from: rest falls out of the difference
            own = self.offset.uncertainty**2 - float(self.places.covariance[0, 0])
            variance = max(own, 0.0) + self.places.place(crank_length)[1] ** 2
        return reading + self.offset.value - shift, float(np.sqrt(variance))


def gap_reference(
    session: Session, *, referred: bool = True, offset: float | Sequence[float] | GapOffset = 0.0
) -> GapReference:
    """Read the reference off the taps of a session, its runs without the support, and its string's length.

    Parameters
    ----------
    session : Session
        Its runs of ``impulse`` show where the car rests, those of ``response`` without the setting ``gap`` where it
        swings. Without taps the sensor's zero is taken for rest, as uncertain as dry friction holds the car (``offset``
        says how far; a millimetre where it does not). Without runs the string and the ripple are unknown within what
        they may be.
    referred : bool
        Without it x and g stay as read.
    offset : float, (value, standard uncertainty), or GapOffset
        What the gap at rest is more than the screw reads (m); see :func:`gap_offset`.

    Warns
    -----
    RecordingWarning
        Where the sensor counts away from the support, or no tap tells the place of rest.

    Raises
    ------
    ValueError
        A run without the channels that it needs; the message names run and channel.
    """

    given = _offset(offset)
    evidence = gather(session, procedures=_TELLING)
    notes = list(evidence.notes)
    if not referred:
        return GapReference(given, direction=evidence.direction)
    taps, mark = evidence.runs["impulse"], 0.0
    decay = free_decay(taps, resolution=evidence.resolution) if taps else None
    seen = steady([run for run in evidence.runs["response"] if "gap" not in run.settings])
    found = places(evidence, decay, seen, held=given.held)
    if decay is not None:
        mark, said = mark_of(seen, decay)
        notes += [*(f"impulse: {note}" for note in decay.notes), *([said] if said else [])]
    else:
        notes.append(
            f"no taps of the car (impulse) in {session.folder}: where it rests is taken from the sensor's zero, to "
            f"±{1e3 * float(np.sqrt(found.covariance[0, 0])):.2g} mm, since a car with dry friction is zeroed where it "
            "sticks. Record a few taps in each session"
        )
    for note in (*notes, *found.notes):
        warnings.warn(note, RecordingWarning, stacklevel=3)
    return GapReference(given, found, evidence.direction, mark)


def _offset(given: float | Sequence[float] | GapOffset) -> GapOffset:
    if isinstance(given, GapOffset):
        return given
    return GapOffset(*(float(one) for one in (*np.atleast_1d(given), 0.0)[:2]))


def gap_offset(parameters: Any, session: Session) -> GapOffset:
    """Return the identified gap at rest less the screw's reading, with its standard uncertainty.

    Parameters
    ----------
    parameters : ParameterSet
        With ``gap_at_rest`` among its extras, as :func:`nonsmooth.identify` gives it.
    session : Session
        That was identified from: the reading stands in its runs with contact. Several readings: the most frequent,
        as ``identify`` takes it.

    Raises
    ------
    ValueError
        If the session has no run with contact.
    """
    readings = [float(item.settings["gap"]) for item in session.recordings("contact")]
    if not readings:
        raise ValueError(f"{session.folder} has no run of 'contact': what the screw read at the identified gap is lost")
    reading = max(set(readings), key=readings.count)
    at_rest = parameters.estimate("gap_at_rest")
    rest = parameters.extra.get("rest_position")
    held = None
    if "friction" in parameters.extra and "k" in parameters:
        held = max(float(parameters.extra["friction"].value), 0.0) / (2 * float(parameters["k"]))
    return GapOffset(
        float(at_rest.value) - reading, float(at_rest.uncertainty), None if rest is None else float(rest.value), held
    )
