r"""From a notebook's settings to the model's parameters, for rigs with a crank: gap and mean position of the car.

The crank of length a moves the end of one spring by :math:`a \cos\varphi`: to first order the force is
:math:`\rho = k a`. The model's x and g count from the car's mean position under the drive, the screw's reading and the
sensor's count from elsewhere: both are referred.

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
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from nonsmooth.errors import unknown
from nonsmooth.identification.compare import measured_motion, measured_response, measured_rise, measured_sections
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


class GapReference(NamedTuple):
    r"""Reference of the screw's reading and of the sensor's count.

    Attributes
    ----------
    offset : GapOffset
        What the gap at rest is more than the screw reads.
    places : MeanShift
        Place of rest, and about which the car swings, in the sensor's count; no shift: x and g stay as read.
    direction : int
        -1 where the sensor counts away from the support.
    mark : float
        The crank's angle (rad) at the photogate, from where it pulls towards the support; 0 where it is near that.
    """

    offset: GapOffset
    places: MeanShift = MeanShift(0.0, 0.0, 0.0, np.zeros((3, 3)), np.zeros(3))
    direction: int = 1
    mark: float = 0.0

    def mean(self, crank_length: float) -> tuple[float, float]:
        """The car's mean position (m) in the sensor's count, and its standard uncertainty."""
        return self.places.place(crank_length)

    def gap(self, reading: float, crank_length: float) -> tuple[float, float]:
        """The gap (m) from the mean position at a reading of the screw, and its standard uncertainty."""
        shift, error = self.places.at(crank_length)
        variance = self.offset.uncertainty**2 + error**2
        if self.offset.rest is not None and abs(self.offset.rest - self.places.rest) < 1e-12:
            # the taps that the gap at rest was counted from: rest falls out of the difference
            own = self.offset.uncertainty**2 - self.places.covariance[0, 0]
            variance = max(own, 0.0) + self.places.place(crank_length)[1] ** 2
        return reading + self.offset.value - shift, np.sqrt(variance)


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
    if not isinstance(offset, GapOffset):
        offset = GapOffset(*(float(one) for one in (*np.atleast_1d(offset), 0.0)[:2]))
    evidence = gather(session, procedures=_TELLING)
    notes = list(evidence.notes)
    if not referred:
        return GapReference(offset, direction=evidence.direction)
    taps, mark = evidence.runs["impulse"], 0.0
    decay = free_decay(taps) if taps else None
    seen = steady([run for run in evidence.runs["response"] if not run.mounted])
    found = places(evidence, decay, seen, held=offset.held)
    if decay is not None:
        mark, said = mark_of(seen, decay)
        notes += [*(f"impulse: {note}" for note in decay.notes), *([said] if said else [])]
    else:
        notes.append(
            f"no taps of the car (impulse) in {session.folder}: where it rests is taken from the sensor's zero, to "
            f"±{1e3 * np.sqrt(found.covariance[0, 0]):.2g} mm, since a car with dry friction is zeroed where it "
            "sticks. Record a few taps in each session"
        )
    for note in (*notes, *found.notes):
        warnings.warn(note, RecordingWarning, stacklevel=3)
    return GapReference(offset, found, evidence.direction, mark)


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
    readings = [item.settings["gap"] for item in session.recordings("contact")]
    if not readings:
        raise ValueError(f"{session.folder} has no run of 'contact': what the screw read at the identified gap is lost")
    reading = max(set(readings), key=readings.count)
    at_rest = parameters.estimate("gap_at_rest")
    rest = parameters.extra.get("rest_position")
    held = None
    if "friction" in parameters.extra and "k" in parameters:
        held = max(parameters.extra["friction"].value, 0.0) / (2 * parameters["k"])
    return GapOffset(at_rest.value - reading, at_rest.uncertainty, None if rest is None else rest.value, held)


#: What a run with each procedure shows.
SHOWS = {"section": "motion", "contact": "motion", "grazing": "motion", "response": "response", "rise": "diagram"}


def session_measurement(
    session: Session,
    procedure: str,
    runs: str | Sequence[str] | None = None,
    *,
    k: float,
    crank_force: float | None = None,
    gap_offset: float | Sequence[float] | GapOffset = 0.0,
    referred: bool = True,
    reference: GapReference | None = None,
) -> tuple[xr.Dataset, dict[str, Any]]:
    """The measurement of a session that ``compare`` takes, and the settings of the model that belong to it.

    Parameters
    ----------
    session : Session
    procedure : str
        ``section``, ``contact``, ``grazing`` (one run: a motion; several named runs that differ in the gap: a diagram
        over ``g``), ``response`` (all runs of one crank length) or ``rise`` (one run).
    runs : str or sequence of str, optional
        The run or runs; needed where there are several motions.
    k : float
        The spring's stiffness (N/m), for the parameter over which a rise is drawn.
    crank_force : float, optional
        Force per crank length from a calibration (N/m); the spring's ``k`` where not given.
    gap_offset : float, (value, standard uncertainty) or GapOffset
        What the gap is more than the screw's reading (m); see
        :func:`nonsmooth_savi2007.comparison.gap_offset`.
    referred : bool
        Refer x and g to the mean position under the drive: by the taps (``impulse``) and the runs of ``response``
        without the support where the session has them.
    reference : GapReference, optional
        Another session's, in place of ``gap_offset`` and ``referred``.

    Returns
    -------
    measured : Dataset
        Of a diagram over ``g`` and of a rise, each point is referred at its own crank length.
    settings : dict
        ``rho``, ``g``, ``omega`` as :func:`compare` takes them: values, pairs with the standard uncertainty, or
        functions of the other parameters.

    Raises
    ------
    ValueError
        A procedure or run that the session does not have, or several where one is meant.
    """
    chosen = _chosen(session, procedure, runs)
    apparatus = session.apparatus
    if "distance_per_turn" not in apparatus:
        raise ValueError(
            f"{session.folder}: [apparatus] needs distance_per_turn, the travel per turn of the sensor's wheel"
        )
    shows = SHOWS[procedure] if len(chosen) == 1 or procedure == "response" else "sections"
    lengths = {item.settings["crank_length"] for item in chosen if "crank_length" in item.settings}
    if len(lengths) > 1:
        raise ValueError(
            f"the runs have {len(lengths)} crank lengths ({', '.join(f'{a:g}' for a in sorted(lengths))} m): a "
            "response, or a diagram, has one; name the runs"
        )
    length = lengths.pop() if lengths else 0.0
    if reference is None:
        reference = gap_reference(session, referred=referred, offset=gap_offset)
    # The crank of a rise grows, and the mean position moves with it: it is referred point by point.
    shift = 0.0 if shows == "diagram" else reference.mean(length)[0]
    counts = int(float(apparatus.get("counts_per_turn", 1440)))
    travel = reference.direction * float(apparatus["distance_per_turn"])
    motions = [
        measured_motion(
            item.recording,
            item.run,
            distance_per_turn=travel,
            counts_per_turn=counts,
            zero=shift,
            mark=reference.mark,
            support="gap" in item.settings,
        )
        for item in chosen
    ]
    omega, error = (np.array([float(motion[name]) for motion in motions]) for name in ("omega", "omega_error"))
    settings: dict[str, Any] = {
        "rho": (lambda p: p["k"] * length) if crank_force is None else crank_force * length,
    }
    first = chosen[0].settings
    if "gap" in first:
        settings["g"] = reference.gap(first["gap"], length)
    if shows == "response":
        # Steps that do not say how they were reached: up as long as the frequency rises.
        top = np.argmax(omega)
        words = [str(i.settings.get("direction", "up" if n <= top else "down")) for n, i in enumerate(chosen)]
        return measured_response(motions, words), settings
    settings["omega"] = (omega.mean(), error[0])
    if shows == "sections":
        gaps = [reference.gap(item.settings["gap"], length)[0] for item in chosen]
        if np.ptp(omega) > 1e-2 * omega.mean() or len(set(gaps)) < len(gaps):
            raise ValueError(
                f"{len(chosen)} runs of {procedure!r}, {', '.join(i.run for i in chosen)}: a diagram over g needs runs "
                "at one frequency, each with a gap of its own; a motion is one run: run = ..."
            )
        return measured_sections(motions, "g", gaps, unit="m"), {n: settings[n] for n in ("rho", "omega")}
    (motion,) = motions
    if shows == "motion":
        return motion, settings
    per, last = k if crank_force is None else crank_force, first["crank_length_end"]
    rise = measured_rise(motion, "rho", per * length, per * last, unit="N")
    moved = np.zeros(rise["section"].shape)
    moved[:, 0] = [reference.mean(rho / per)[0] for rho in rise["rho"].values]
    screw = first["gap"]
    known = max(reference.gap(screw, a)[1] for a in (length, last))
    settings = {"omega": settings["omega"], "g": (lambda p: reference.gap(screw, p["rho"] / per)[0], known)}
    return rise.assign(section=(rise["section"] - moved).assign_attrs(rise["section"].attrs)), settings


def _chosen(session: Session, procedure: str, runs: str | Sequence[str] | None) -> list[Any]:
    if procedure not in SHOWS:
        raise ValueError(unknown(procedure, "a procedure", "compare", SHOWS.keys()))
    found = session.recordings(procedure)
    if not found:
        raise ValueError(f"{session.folder} has no run of {procedure!r}; it has: {', '.join(session.procedures)}")
    if runs is None:
        # Runs without the support stand beside a response with it: they show the mean position.
        mounted = [item for item in found if "gap" in item.settings]
        found = mounted if procedure == "response" and mounted else found
        if SHOWS[procedure] != "response" and len(found) != 1:
            names = ", ".join(item.run for item in found)
            raise ValueError(f"{len(found)} runs of {procedure!r}; a motion is one: run = ... one of {names}")
        return found
    wanted = [runs] if isinstance(runs, str) else list(runs)
    for name in wanted:
        if name not in [item.run for item in found]:
            raise ValueError(unknown(name, "a run", f"{procedure!r} in {session.folder}", [i.run for i in found]))
    if SHOWS[procedure] == "diagram" and len(wanted) != 1:
        raise ValueError(f"{len(wanted)} runs of {procedure!r}: a slow rise is one run")
    return [item for item in found if item.run in wanted]
