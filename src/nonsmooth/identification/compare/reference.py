r"""Where the car swings about, and the gap counted from there.

The model's drive has no mean, so its x and g count from the car's mean position under the drive. The rig's position
counts from where the sensor was zeroed, its screw from a zero of its own. To second order in the crank's length a, a
string of length L and a motor with the ripple :math:`\epsilon \sin(\omega t + \beta)` move the driven end by

.. math::

    d = a \cos(\omega t) - \tfrac12 a \epsilon [\cos\beta - \cos(2 \omega t + \beta)]
        + \frac{a^2}{4 L} [1 - \cos(2 \omega t)]

Its mean is :math:`a^2/(4L) - a \epsilon \cos(\beta)/2`, and the car between two equal springs is moved by half of it,
:math:`\bar x = a^2/(8L) - a \epsilon \cos(\beta)/4`. The ripple cannot be seen by a photogate with one mark a turn;
the mean position of steady runs without the support shows both terms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from nonsmooth.experiment.session import Session

__all__ = ["GapReference", "gap_offset", "gap_reference"]

FloatArray = NDArray[np.float64]

RIPPLE = 0.03  # rad: standard deviation of what a motor's ripple may be where no run shows it
STRING = 1.0  # m: alpha = 1/(8 L) is taken as 0 +- 1/(8 STRING) where no string's length is known


@dataclass(frozen=True)
class GapReference:
    r"""What the screw's reading and the sensor's zero are to be referred to.

    Attributes
    ----------
    alpha, beta : float
        Mean position in the sensor's count, :math:`\bar x = \alpha a^2 + \beta a` (1/m, 1).
    covariance : array (2, 2)
        Of alpha and beta.
    runs : int
        Runs without the support behind them.
    zero_error : float
        Standard uncertainty (m) of the sensor's zero against the true rest position, from which the screw counts.
    offset, offset_error : float
        What the gap at rest is more than the screw reads (m).
    """

    alpha: float = 0.0
    beta: float = 0.0
    covariance: FloatArray | None = None
    runs: int = 0
    zero_error: float = 0.0
    offset: float = 0.0
    offset_error: float = 0.0

    def mean(self, crank_length: float) -> tuple[float, float]:
        """The car's mean position (m) in the sensor's count, and its standard uncertainty."""
        row = np.array([crank_length**2, crank_length])
        error = 0.0 if self.covariance is None else float(np.sqrt(row @ self.covariance @ row))
        return float(row @ [self.alpha, self.beta]), error

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
        Its runs of ``response`` without the setting ``gap`` show the mean positions. Without such runs the string's
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
    value, error = offset if isinstance(offset, tuple) else (offset, 0.0)
    if not referred:
        return GapReference(offset=float(value), offset_error=float(error))
    count = _count(session)
    free = [item for item in session.recordings("response") if "gap" not in item.settings]
    length = session.apparatus.get("string_length")
    prior = (1 / (8 * length.value), length.uncertainty / (8 * length.value**2)) if length else (0.0, 1 / (8 * STRING))
    weight = np.diag([1 / max(prior[1], 1e-6) ** 2, (4 / RIPPLE) ** 2])
    right = weight @ [prior[0], 0.0]
    for item in free:
        a = float(item.settings["crank_length"])
        mean, mean_error = _mean(session, item, count)
        row = np.array([a**2, a])
        weight = weight + np.outer(row, row) / mean_error**2
        right = right + row * mean / mean_error**2
    alpha, beta = np.linalg.solve(weight, right)
    return GapReference(
        float(alpha), float(beta), np.linalg.inv(weight), len(free), float(count / np.sqrt(12)), float(value),
        float(error),
    )  # fmt: skip


def _count(session: Session) -> float:
    from nonsmooth.experiment.signals.displacement import resolution

    apparatus = session.apparatus
    counts = apparatus["counts_per_turn"].value if "counts_per_turn" in apparatus else 1440
    travel = apparatus["distance_per_turn"].value
    return float(resolution(distance_per_turn=travel, counts_per_turn=round(counts)))


def _mean(session: Session, item: Any, count: float) -> tuple[float, float]:
    """Mean position of a steady run over whole turns, and its standard error."""
    from nonsmooth.experiment.signals.checks import take
    from nonsmooth.experiment.signals.displacement import position
    from nonsmooth.experiment.signals.harmonics import fit
    from nonsmooth.experiment.signals.phase import drive_phase

    angle = take(item.recording, "Angle", item.run, units=("rad", "deg", "rev"), samples=64)
    gate = take(item.recording, "Turn", item.run, samples=3)
    x = position(angle, distance_per_turn=session.apparatus["distance_per_turn"].value)
    time = x[x.dims[0]].values
    drive = drive_phase(gate[gate.dims[0]].values)
    inside = time <= time[0] + np.floor((time[-1] - time[0]) / drive.period) * drive.period
    fitted = fit(time[inside], x.values[inside], drive.omega, 3)
    # Counts of a steady motion repeat with it: their errors do not average out beyond a hundredth of a count.
    return float(fitted.mean), float(np.hypot(fitted.mean_error, 0.01 * count))


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
    readings = [float(item.settings["gap"]) for item in session.recordings("contact")]
    if not readings:
        raise ValueError(f"{session.folder} has no run of 'contact': what the screw read at the identified gap is lost")
    reading = max(set(readings), key=readings.count)
    at_rest = parameters.estimate("gap_at_rest")
    return float(at_rest.value) - reading, float(at_rest.uncertainty)
