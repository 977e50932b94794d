"""``identify``: from the recordings of a session to the model's parameters with their covariance."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
import scipy.linalg  # noqa: F401  it loads a library of its own, which is to have one thread too
from threadpoolctl import threadpool_limits

from nonsmooth import ParameterSet, SolveError
from nonsmooth.identification import Estimate, Finding
from nonsmooth.recordings import RecordingWarning, Session
from nonsmooth_savi2007.identification.adjustment import Adjusted, Observation, adjust
from nonsmooth_savi2007.identification.calibrations import crank_force, stiffness, voltage_frequency
from nonsmooth_savi2007.identification.cross_checks import cross_checks, sentences
from nonsmooth_savi2007.identification.decay_findings import decay_damping, natural_frequency, support_damping
from nonsmooth_savi2007.identification.evidence import Evidence, gather
from nonsmooth_savi2007.identification.free_decay import DecayFit, free_decay
from nonsmooth_savi2007.identification.grazing import grazing_gap
from nonsmooth_savi2007.identification.multiple_shooting import (
    ContactFit,
    contact_finding,
    one_contact,
    shoot_contacts,
)
from nonsmooth_savi2007.identification.plausibility import check_plausible, not_driven, slipped_late
from nonsmooth_savi2007.identification.referral import counted_gap, mark_of, refer
from nonsmooth_savi2007.identification.response_fits import amplitude_fit, receptance_fit
from nonsmooth_savi2007.identification.statements import (
    agreement,
    disagreement,
    for_model,
    identifiability,
    impossible,
    joined,
)
from nonsmooth_savi2007.identification.steady import steady

#: The findings that name the runs of a procedure which were used.
_FOUND_BY = {
    "impulse": ("omega_0", "c_decay"),
    "drop": ("c_s_drop",),
    "springs": ("spring_slope",),
    "support": ("support_slope",),
    "contact": ("c_s_contact",),
}


@threadpool_limits.wrap(limits=1, user_api="blas")  # the matrices are small: threads would wait for each other
def identify(
    recordings: Session | str | os.PathLike[str] | Mapping[str, Any],
    model: Any = None,
    *,
    apparatus: Mapping[str, Any] | None = None,
    crank_length: float | None = None,
) -> ParameterSet:
    r"""Identify the parameters of the oscillator with a discontinuous support from recordings.

    Each procedure gives what it can tell, and one adjustment joins them: the scale gives m, free decay
    :math:`\omega_0`, c/m and the dry friction, pulls and pushes 2k and k_s but for the force sensor's gain, the drop
    k_s/M and c_s/M, and records with contact k_s/m, c_s/m and the gap. What the paper does besides (Fig. 6, Fig. 8),
    the complex response and the grazing frequency are findings beside it: they take dry friction for damping, or tell
    less of the same.

    Parameters
    ----------
    recordings : Session, path, or mapping
        A session folder, or recordings by procedure; see :func:`nonsmooth_savi2007.identification.gather`.
    model : System, optional
        The result then holds only this model's parameters; what else was found stands in ``extra``.
    apparatus : mapping, optional
        What is known of the apparatus, where there is no notebook.
    crank_length : float, optional
        The crank (m) to whose mean position the gap ``g`` is referred; the longest of the runs with contact where
        not given.

    Returns
    -------
    ParameterSet
        ``m, k, k_s, c, c_s, g`` as far as the recordings tell them; ``system.with_parameters`` takes it.

    Warns
    -----
    RecordingWarning
        Where the recordings of a procedure cannot be used for a finding that the parameters do not rest on; the
        result's notes say it too.

    Raises
    ------
    ValueError
        If there is no mass, no recording from which anything can be identified, or a procedure on which a parameter
        rests was recorded so that nothing can be told from it.

    Examples
    --------
    >>> found = ns.identify("rig_03")                                              # doctest: +SKIP
    >>> system = ns.models.discontinuous_support().with_parameters(found)          # doctest: +SKIP
    """
    if crank_length is not None and not 0 < crank_length < np.inf:
        raise ValueError(f"crank_length = {crank_length!r} must be a positive length in m")
    evidence = gather(recordings, apparatus=apparatus)
    chain = _Chain(evidence)
    check_plausible(evidence)
    chain.say(*evidence.notes)
    chain.motor()
    chain.taps()
    chain.response()
    chain.forces()
    chain.drop()
    chain.graze()
    single = chain.contact()
    adjusted = chain.adjusted()
    chain.calibrations(adjusted)
    gap = None
    if chain.contacts is not None and chain.decay is not None:
        gap = refer(evidence, chain.decay, chain.contacts, adjusted, chain.seen, crank_length)
        chain.findings.append(gap.finding)
        chain.say(*gap.notes)
    chain.checks(adjusted)
    chain.doubts(adjusted)
    found = joined(
        adjusted,
        gap,
        findings=chain.findings,
        identifiability=identifiability(adjusted, chain.contacts, single),
        notes=[*agreement(adjusted, evidence), *chain.notes],
        anomalies=chain.anomalies,
        synthetic=evidence.synthetic,
    )
    return found if model is None else for_model(found, model)


@contextmanager
def _of(procedure: str) -> Iterator[None]:
    """Put the procedure before the message of what goes wrong in its fit, and what to look at behind it."""
    try:
        yield
    except (ValueError, SolveError) as error:
        kind = SolveError if isinstance(error, SolveError) else ValueError
        raise kind(
            f"{procedure}: {error}. Are these the recordings of {procedure!r}, each one tap with its free decay?"
        ) from error


class _Chain:
    """The procedures in their order, with what they observed, found and could not use."""

    def __init__(self, evidence: Evidence) -> None:
        self.evidence, self.runs = evidence, evidence.runs
        self.mass, self.gain_limit = evidence.quantity("mass"), evidence.apparatus["force_gain_limit"].value
        self.findings: list[Finding] = []
        self.observations = [self.weighed("mass")]
        self.notes: list[str] = []
        self.anomalies: list[str] = []
        self.decay: DecayFit | None = None
        self.contacts: ContactFit | None = None
        self.grazing: Finding | None = None

    def adjusted(self) -> Adjusted:
        return adjust(self.observations, gain_limit=self.gain_limit)

    def weighed(self, name: str) -> Observation:
        quantity = self.evidence.quantity(name)
        if quantity.uncertainty <= 0:
            raise ValueError(
                f"the notebook states no uncertainty of `{name}`; write {{ value = ..., uncertainty = ... }}"
            )
        return Observation.of(name, quantity.value, quantity.uncertainty)

    def beside(self, what: str, find: Callable[[], Finding | list[Finding]]) -> Finding | None:
        """Make a finding that no parameter rests on; on failure, record a note and continue."""
        try:
            found = find()
        except (ValueError, SolveError) as error:
            self.say(f"{what}: not found: {error}")
            return None
        if isinstance(found, list):
            self.findings += found
            return found[0]
        if not np.isfinite([found.value, found.uncertainty]).all():
            self.say(f"{what}: not found: the recordings do not determine it")
            return None
        self.findings.append(found)
        return found

    def say(self, *sentences: str, doubts: bool = False) -> None:
        """Say what a reader should know; ``doubts``: a parameter may be wrong by more than its uncertainty."""
        kept = self.anomalies if doubts else self.notes
        kept += sentences
        for sentence in sentences:
            warnings.warn(sentence, RecordingWarning, stacklevel=5)

    def doubts(self, adjusted: Adjusted) -> None:
        """Anomalies: impossible values, disagreements, and procedures of which most runs could not be used.

        Runs that no finding rests on are named; where they are most of a procedure, that is an anomaly.
        """
        for procedure, names in _FOUND_BY.items():
            used = {name for finding in self.findings if finding.name in names for name in finding.runs}
            given = [run.name for run in self.runs[procedure]]
            idle = [name for name in given if name not in used]
            if not idle or (procedure == "contact" and not used):
                continue
            sentence = f"{procedure}: {len(idle)} of {len(given)} runs were not used: {', '.join(idle)}"
            if 2 * len(idle) > len(given):
                self.say(sentence, doubts=True)
            elif any(not any(procedure in note and repr(name) in note for note in self.notes) for name in idle):
                self.say(sentence)
        self.say(*filter(None, [disagreement(adjusted), *impossible(adjusted)]), doubts=True)
        if self.contacts is not None and self.contacts.poor:
            self.say(
                f"contact: the motion is not that of the model: residuals {self.contacts.excess:.3g} times the "
                "sensor's noise. Look at the crank's length, the photogate and the gap of these runs",
                doubts=True,
            )

    def motor(self) -> None:
        """Say where the photogate sees the motor's frequency wander."""
        resolution = self.evidence.apparatus["turn_resolution"].value
        for procedure in ("response", "grazing", "contact"):
            seen = [run.drive.wander(resolution) for run in self.runs[procedure]]
            if unsteady := [size for size, steady in seen if not steady]:
                self.say(
                    f"{procedure}: the motor wanders in {len(unsteady)} of {len(seen)} runs, by "
                    f"{100 * np.median(unsteady):.2g} % from turn to turn (standard deviation; up to "
                    f"{100 * max(unsteady):.2g} %), more than the photogate's steps explain. The crank's angle is "
                    "followed from turn to turn, and what a turn may hide is in the uncertainty of what contacts tell; "
                    "a regulated supply would be better"
                )

    def taps(self) -> None:
        runs = self.runs["impulse"]
        if not runs:
            return
        with _of("impulse"):
            self.decay = decay = free_decay(runs)
        self.say(*(f"impulse: {note}" for note in decay.notes), *slipped_late(decay))
        self.observations.append(Observation(("omega_0", "b", "f"), decay.values[:3], decay.covariance[:3, :3]))
        self.beside("natural frequency (Fig. 5)", lambda: natural_frequency(decay))
        self.beside("damping by free decay", lambda: decay_damping(decay, self.mass))

    def response(self) -> None:
        """The steady runs without support, and the dampings found from them."""
        free, decay = [run for run in self.runs["response"] if not run.mounted], self.decay
        if mounted := len(self.runs["response"]) - len(free):
            self.say(f"{mounted} runs of the response state a gap: the support was mounted, no damping from them")
        self.seen = seen = steady(free)
        if sentence := not_driven(seen):
            raise ValueError(sentence)
        if free and decay is not None:
            self.beside("damping by amplitude (Fig. 6)", lambda: amplitude_fit(seen, decay, self.mass))
            self.beside("complex frequency response", lambda: receptance_fit(seen, decay, self.mass))

    def forces(self) -> None:
        for procedure, law, mass, friction in (
            ("springs", "spring_slope", self.mass.value, True),
            ("support", "support_slope", 0.0, False),
        ):
            if runs := self.runs[procedure]:
                found = stiffness(runs, mass=mass, gain_limit=self.gain_limit, friction=friction, name=law)
                self.findings.append(found)
                self.observations.append(Observation.of(law, found.value, found.others["slope_a"].uncertainty))

    def drop(self) -> None:
        runs = self.runs["drop"]
        if not runs:
            return
        mass = self.evidence.quantity("test_mass")
        with _of("drop"):
            found, decay = support_damping(runs, test_mass=mass)
        self.say(*(f"drop: {note}" for note in decay.notes))
        self.findings.append(found)
        self.observations += [
            self.weighed("test_mass"),
            Observation(("omega_s", "b_s"), decay.values[:2], decay.covariance[:2, :2]),
        ]

    def graze(self) -> None:
        runs, decay, rough = self.runs["grazing"], self.decay, self.adjusted()
        if runs and decay is not None and "k_s" in rough.names:
            self.grazing = self.beside(
                "gap by the grazing frequency",
                lambda: grazing_gap(runs, decay, kappa=rough["k_s"] / rough["m"]),
            )

    def contact(self) -> Finding | None:
        """Fit the runs with contact; what one contact tells by itself."""
        runs, rough, decay = self.runs["contact"], self.adjusted(), self.decay
        mark = 0.0
        if decay is not None:  # by steady runs without support, or the first ones of the graze
            mark, note = mark_of(self.seen if len(self.seen) else steady(self.runs["grazing"][:4]), decay)
            self.say(*filter(None, [note]))
        if not runs:
            return None
        if decay is None or "k_s" not in rough.names:
            self.say("contact: not used: needs taps of the car (impulse), and the support's stiffness")
            return None
        if impossible(rough):  # said of the final values
            self.say("contact: not used: what the other procedures say of the car and the support cannot be")
            return None
        mass, kappa = rough.estimate("m"), rough.ratio("k_s", "m")
        gamma = rough["c_s"] / mass.value if "c_s" in rough.names else 1e-3 * kappa.value
        try:
            found = shoot_contacts(runs, decay, kappa=kappa.value, gamma=gamma, mark=mark)
        except SolveError as reason:
            self.say(f"contact: not used, so that the gap is not known: {reason}")
            return None
        self.contacts = found
        self.say(*found.left)
        self.observations.append(Observation(("kappa", "gamma"), found.values[3:5], found.covariance[3:5, 3:5]))
        self.findings.append(contact_finding(found, mass))
        return self.beside(
            "c_s from one contact",
            lambda: one_contact(found, decay, mass.value, kappa_error=kappa.uncertainty),
        )

    def calibrations(self, adjusted: Adjusted) -> None:
        if runs := self.runs["voltage"]:
            self.beside("voltage calibration (Fig. 8a)", lambda: voltage_frequency(runs))
        if held := self.runs["crank"]:
            k = adjusted.known("k")
            self.beside("crank calibration (Fig. 8b)", lambda: crank_force(held, gain_limit=self.gain_limit, k=k))

    def checks(self, adjusted: Adjusted) -> None:
        """Compare what the procedures say of one quantity; what disagrees is said."""
        at_rest = None
        if self.grazing is not None and self.contacts is not None and self.decay is not None:
            counted = counted_gap(self.contacts, self.runs["grazing"][0].gap)
            if counted is None:
                self.notes.append("the graze was sought at another setting of the screw: its gap is not compared")
            else:
                at_rest = Estimate(counted.value - self.decay.rest, counted.error, "m")
        found = cross_checks(
            self.findings,
            self.evidence.apparatus,
            gain=adjusted.known("gain"),
            gain_limit=self.gain_limit,
            k=adjusted.known("k"),
            gap=at_rest,
        )
        agree, disagree = sentences(found)
        self.notes += agree
        self.say(*disagree, doubts=True)
