r"""Where the car swings about, and the gap counted from there.

The model's drive has no mean, so its x and g count from the car's mean position under the drive. The rig's position
counts from where the sensor was zeroed, its screw from a zero of its own. To second order in the crank's length a, a
string of length L and a motor with the ripple :math:`\epsilon \sin(\omega t + \beta)` move the driven end by

.. math::

    d(\varphi) = a \cos(\omega t) - \tfrac12 a \epsilon [\cos\beta - \cos(2 \omega t + \beta)]
        + \frac{a^2}{4 L} [1 - \cos(2 \omega t)]

Its mean is :math:`a^2/(4L) - a \epsilon \cos(\beta)/2`, and the car between two equal springs is moved by half of it,
:math:`\bar x = a^2/(8L) - a \epsilon \cos(\beta)/4`. The ripple cannot be seen by a photogate with one mark a turn;
the mean position of steady runs without the support shows both terms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.identification.gap import MeanShift, mean_shift

if TYPE_CHECKING:
    from nonsmooth.experiment.session import Session

__all__ = ["GapReference", "gap_offset", "gap_reference"]


@dataclass(frozen=True)
class GapReference:
    """What the screw's reading and the sensor's zero are to be referred to.

    Attributes
    ----------
    shift : MeanShift, optional
        Mean position over the crank's length, in the sensor's count; None: nothing is referred.
    zero_error : float
        Standard uncertainty (m) of the sensor's zero against the true rest position, from which the screw counts.
    offset, offset_error : float
        What the gap at rest is more than the screw reads (m).
    """

    shift: MeanShift | None = None
    zero_error: float = 0.0
    offset: float = 0.0
    offset_error: float = 0.0

    def mean(self, crank_length: float) -> tuple[float, float]:
        """The car's mean position (m) in the sensor's count, and its standard uncertainty."""
        return (0.0, 0.0) if self.shift is None else self.shift.at(crank_length)

    def gap(self, reading: float, crank_length: float) -> tuple[float, float]:
        """The gap (m) from the mean position at a reading of the screw, and its standard uncertainty."""
        mean, error = self.mean(crank_length)
        return reading + self.offset - mean, float(np.sqrt(error**2 + self.zero_error**2 + self.offset_error**2))


def gap_reference(
    session: Session, *, referred: bool = True, offset: float | tuple[float, float] = 0.0
) -> GapReference:
    """Read the reference off the runs of a session without the support, and off its string's length.

    Parameters
    ----------
    session : Session
        Its runs of ``response`` without the setting ``gap`` show the mean positions; without such runs the string's
        length gives the larger part, and the ripple's is unknown within what motors do.
    referred : bool
        Without it x and g stay as read.
    offset : float or (value, standard uncertainty)
        What the gap at rest is more than the screw reads (m); see :func:`gap_offset`.

    Raises
    ------
    ValueError
        A run without the channels that it needs; the message names run and channel.
    """
    from nonsmooth.experiment.signals.displacement import resolution
    from nonsmooth.identification.evidence import gather

    value, error = offset if isinstance(offset, tuple) else (offset, 0.0)
    if not referred:
        return GapReference(None, 0.0, float(value), float(error))
    free = [item for item in _response(session) if "gap" not in item.settings]
    apparatus = session.apparatus
    length = apparatus.get("string_length")
    counts = apparatus["counts_per_turn"].value if "counts_per_turn" in apparatus else 1440
    count = resolution(distance_per_turn=apparatus["distance_per_turn"].value, counts_per_turn=round(counts))
    runs: Any = ()
    if free:
        runs = gather({"response": [tuple(item) for item in free]}, apparatus=apparatus).runs["response"]
    # Neither string nor runs: no shift is known, and nothing is said to be.
    shift = mean_shift(
        runs, 0.0, 0.0, string_length=length.value if length else None, string_error=length.uncertainty if length else 0
    ) if free or length else None  # fmt: skip
    return GapReference(shift, float(count / np.sqrt(12)), float(value), float(error))


def gap_offset(parameters: Any, session: Session) -> tuple[float, float]:
    """What the identified gap at rest is more than the screw read, and its standard uncertainty.

    Parameters
    ----------
    parameters : ParameterSet
        With ``gap_at_rest`` among its extras, as :func:`nonsmooth.identification.chain.identify` gives it.
    session : Session
        That was identified from: the reading stands in its runs with contact. Several readings: the most frequent,
        as ``identify`` takes it.

    Raises
    ------
    ValueError
        If the session has no run with contact.
    """
    readings = [float(item.settings["gap"]) for item in _runs(session, "contact")]
    if not readings:
        raise ValueError(f"{session.folder} has no run of 'contact': what the screw read at the identified gap is lost")
    reading = max(set(readings), key=readings.count)
    at_rest = parameters.estimate("gap_at_rest")
    return float(at_rest.value) - reading, float(at_rest.uncertainty)


def _response(session: Session) -> list[Any]:
    return _runs(session, "response")


def _runs(session: Session, procedure: str) -> list[Any]:
    return list(session.recordings(procedure)) if procedure in session.procedures else []
