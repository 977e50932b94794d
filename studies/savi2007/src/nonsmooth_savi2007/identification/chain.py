"""``identify``: from the recordings of a session to the model's parameters with their covariance."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.linalg  # noqa: F401  it loads a library of its own, which is to have one thread too
from threadpoolctl import threadpool_limits

from nonsmooth import ParameterSet, SolveError
from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, Finding
from nonsmooth.recordings import Quantity, RecordingWarning, Session
from nonsmooth.recordings.signals.phase import drive_phase
from nonsmooth_savi2007.identification.adjustment import Adjusted, Observation, adjust
from nonsmooth_savi2007.identification.calibrations import crank_force, voltage_frequency
from nonsmooth_savi2007.identification.contact_findings import contact_finding, one_contact
from nonsmooth_savi2007.identification.cross_checks import cross_checks, sentences
from nonsmooth_savi2007.identification.decay_findings import decay_damping, natural_frequency, support_damping
from nonsmooth_savi2007.identification.evidence import Evidence, Run, gather
from nonsmooth_savi2007.identification.free_decay import DecayFit, free_decay
from nonsmooth_savi2007.identification.grazing import grazing_gap
from nonsmooth_savi2007.identification.half_power import half_power
from nonsmooth_savi2007.identification.multiple_shooting import ContactFit, shoot_contacts
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
from nonsmooth_savi2007.identification.steady import Steady, steady
from nonsmooth_savi2007.identification.stiffness import stiffness

#: The findings that name the runs of a procedure which were used.
_FOUND_BY = {
    "impulse": ("omega_0", "c_decay"),
    "drop": ("c_s_drop",),
    "springs": ("spring_slope",),
    "support": ("support_slope",),
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
    the half-power bandwidth, the complex response and the grazing frequency are findings beside it: they take dry
    friction for damping, or tell less of the same.

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
    chain = _Chain(gather(recordings, apparatus=apparatus))
    check_plausible(chain.evidence)
    for note in chain.evidence.notes:
        chain.say(note)
    chain.motor()
    decay = chain.taps()
    seen = chain.response(decay)
    chain.forces()
    chain.drop()
    grazing = chain.graze(decay)
    contacts, single = chain.contact(decay, chain.mark(decay, seen))
    adjusted = chain.adjusted()
    chain.calibrations(adjusted)
    gap = None
    if contacts is not None and decay is not None:
        gap = refer(chain.evidence, decay, contacts, adjusted, seen, crank_length)
        chain.findings.append(gap.finding(contacts))
        for note in (*gap.notes, *gap.counted.notes):
            chain.say(note)
    chain.checks(adjusted, decay, contacts, grazing)
    chain.doubts(adjusted, contacts)
    found = joined(
        adjusted,
        gap,
        findings=chain.findings,
        identifiability=identifiability(adjusted, contacts, single),
        notes=[*agreement(adjusted, chain.evidence), *chain.notes],
        anomalies=chain.anomalies,
        synthetic=chain.evidence.synthetic,
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


@dataclass(eq=False)
class _Chain:
    """The procedures in their order, with what they observed, found and could not use."""

    evidence: Evidence
    findings: list[Finding] = field(default_factory=list)
    observations: list[Observation] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    anomalies: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.observations.append(self.weighed("mass"))

    @property
    def mass(self) -> Quantity:
        return self.evidence.quantity("mass")

    @property
    def gain_limit(self) -> float:
        known = self.evidence.apparatus.get("force_gain_limit")
        return 0.01 if known is None else known.value

    def runs(self, procedure: str) -> tuple[Run, ...]:
        return self.evidence.runs.get(procedure, ())

    def adjusted(self) -> Adjusted:
        return adjust(self.observations, gain_limit=self.gain_limit)

    def observe(self, names: tuple[str, ...], values: FloatArray, covariance: FloatArray, source: str) -> None:
        self.observations.append(Observation(names, values, covariance, source))

    def weighed(self, name: str) -> Observation:
        quantity = self.evidence.quantity(name)
        if quantity.uncertainty <= 0:
            raise ValueError(
                f"the notebook states no uncertainty of `{name}`; write {{ value = ..., uncertainty = ... }}"
            )
        return Observation((name,), np.array([quantity.value]), np.array([[quantity.uncertainty**2]]), "weighed")

    def beside(self, what: str, find: Callable[[], Finding | list[Finding]]) -> Finding | None:
        """Make a finding that no parameter rests on; on failure, record a note and continue."""
        try:
            found = find()
        except (ValueError, SolveError) as error:
            self.say(f"{what}: not found: {error}")
            return None
        if not np.isfinite([found.value, found.uncertainty] if isinstance(found, Finding) else 0.0).all():
            self.say(f"{what}: not found: the recordings do not determine it")
            return None
        self.findings += found if isinstance(found, list) else [found]
        return found[0] if isinstance(found, list) else found

    def left_out(self, procedure: str, decay: DecayFit) -> None:
        """Say which decays were not used, and why."""
        for note in decay.notes:
            self.say(f"{procedure}: {note}")

    def doubt(self, sentence: str) -> None:
        """Say what contradicts itself: a parameter may be wrong by more than its uncertainty."""
        self.anomalies.append(sentence)
        warnings.warn(sentence, RecordingWarning, stacklevel=5)

    def doubts(self, adjusted: Adjusted, contacts: ContactFit | None) -> None:
        """Anomalies: impossible values, disagreements, and procedures of which most runs could not be used."""
        self.unused(contacts)
        sentences = [disagreement(adjusted), *impossible(adjusted)]
        if contacts is not None and contacts.poor:
            sentences.append(
                f"contact: the motion is not that of the model: residuals {contacts.excess:.3g} times the sensor's "
                "noise. Look at the crank's length, the photogate and the gap of these runs"
            )
        for sentence in sentences:
            if sentence:
                self.doubt(sentence)

    def unused(self, contacts: ContactFit | None) -> None:
        """Name the runs that no finding rests on; where they are most of a procedure, that is an anomaly."""
        used = {
            procedure: {name for finding in self.findings if finding.name in names for name in finding.runs}
            for procedure, names in _FOUND_BY.items()
        }
        used["contact"] = set() if contacts is None else {run.name for run in contacts.runs}
        for procedure, kept in used.items():
            given = [run.name for run in self.runs(procedure)]
            idle = [name for name in given if name not in kept]
            if not idle or (procedure == "contact" and contacts is None):
                continue
            sentence = f"{procedure}: {len(idle)} of {len(given)} runs were not used: {', '.join(idle)}"
            if 2 * len(idle) > len(given):
                self.doubt(sentence)
            elif any(not any(procedure in note and repr(name) in note for note in self.notes) for name in idle):
                self.say(sentence)

    def say(self, sentence: str) -> None:
        self.notes.append(sentence)
        warnings.warn(sentence, RecordingWarning, stacklevel=5)

    def motor(self) -> None:
        """Say where the photogate sees the motor's frequency wander."""
        known = self.evidence.apparatus.get("turn_resolution")
        for procedure in ("response", "grazing", "contact"):
            seen = [
                drive_phase(run.passages).wander(1e-4 if known is None else known.value)
                for run in self.runs(procedure)
                if run.turns is not None
            ]
            if unsteady := [size for size, steady in seen if not steady]:
                self.say(
                    f"{procedure}: the motor wanders in {len(unsteady)} of {len(seen)} runs, by "
                    f"{100 * float(np.median(unsteady)):.2g} % from turn to turn (standard deviation; up to "
                    f"{100 * max(unsteady):.2g} %), more than the photogate's steps explain. The crank's angle is "
                    "followed from turn to turn, and what a turn may hide is in the uncertainty of what contacts tell; "
                    "a regulated supply would be better"
                )

    def taps(self) -> DecayFit | None:
        runs, resolution = self.runs("impulse"), self.evidence.resolution
        if not runs:
            return None
        with _of("impulse"):
            decay = free_decay(runs, resolution=resolution)
        self.left_out("impulse", decay)
        for sentence in slipped_late(decay, resolution):
            self.say(sentence)
        self.observe(("omega_0", "b", "f"), decay.values[:3], decay.covariance[:3, :3], "free decay")
        self.beside("natural frequency (Fig. 5)", lambda: natural_frequency(decay))
        self.beside("damping by free decay", lambda: decay_damping(decay, self.mass, resolution=resolution))
        return decay

    def response(self, decay: DecayFit | None) -> Steady:
        """The steady runs without support, and the dampings found from them."""
        free = [run for run in self.runs("response") if "gap" not in run.settings]
        if mounted := len(self.runs("response")) - len(free):
            self.say(f"{mounted} runs of the response state a gap: the support was mounted, no damping from them")
        seen = steady(free)
        if sentence := not_driven(seen, self.evidence.resolution):
            raise ValueError(sentence)
        if free and decay is not None:
            self.beside("damping by amplitude (Fig. 6)", lambda: amplitude_fit(seen, decay, self.mass))
            self.beside("complex frequency response", lambda: receptance_fit(seen, decay, self.mass))
        if free:
            self.beside("half-power bandwidth", lambda: half_power(seen, self.mass))
        return seen

    def forces(self) -> None:
        for procedure, law, mass, friction in (
            ("springs", "spring_slope", self.mass.value, True),
            ("support", "support_slope", 0.0, False),
        ):
            runs = self.runs(procedure)
            if not runs:
                continue
            found = stiffness(
                runs,
                resolution=self.evidence.resolution,
                mass=mass,
                gain_limit=self.gain_limit,
                friction=friction,
                name=law,
            )
            self.findings.append(found)
            error = found.others["slope_a"].uncertainty
            self.observe((law,), np.array([found.value]), np.array([[error**2]]), procedure)

    def drop(self) -> None:
        runs = self.runs("drop")
        if not runs:
            return
        mass = self.evidence.quantity("test_mass")
        with _of("drop"):
            found, decay = support_damping(runs, resolution=self.evidence.resolution, test_mass=mass)
        self.left_out("drop", decay)
        self.findings.append(found)
        self.observations.append(self.weighed("test_mass"))
        self.observe(("omega_s", "b_s"), decay.values[:2], decay.covariance[:2, :2], "drop of the test mass")

    def checks(
        self, adjusted: Adjusted, decay: DecayFit | None, contacts: ContactFit | None, grazing: Finding | None
    ) -> None:
        """Compare what the procedures say of one quantity; what disagrees is said."""
        known = self.evidence.apparatus
        masses = {name: known[name] for name in ("mass", "test_mass") if name in known}
        at_rest = None
        if grazing is not None and contacts is not None and decay is not None:
            counted = counted_gap(contacts, float(self.runs("grazing")[0].settings["gap"]))
            if counted is None:
                self.notes.append("the graze was sought at another setting of the screw: its gap is not compared")
            else:
                at_rest = Estimate(counted.value - decay.rest, counted.error, "m")
        found = cross_checks(
            self.findings,
            masses,
            gain=adjusted.estimate("gain") if "gain" in adjusted.names else None,
            gain_limit=self.gain_limit,
            k=adjusted.estimate("k") if "k" in adjusted.names else None,
            gap=at_rest,
        )
        agree, disagree = sentences(found)
        self.notes += agree
        for sentence in disagree:
            self.doubt(sentence)

    def calibrations(self, adjusted: Adjusted) -> None:
        if runs := self.runs("voltage"):
            self.beside("voltage calibration (Fig. 8a)", lambda: voltage_frequency(runs))
        if held := self.runs("crank"):
            k = adjusted.estimate("k") if "k" in adjusted.names else None
            self.beside("crank calibration (Fig. 8b)", lambda: crank_force(held, gain_limit=self.gain_limit, k=k))

    def graze(self, decay: DecayFit | None) -> Finding | None:
        runs, rough = self.runs("grazing"), self.adjusted()
        if not runs or decay is None or "k_s" not in rough.names:
            return None
        return self.beside(
            "gap by the grazing frequency",
            lambda: grazing_gap(runs, decay, resolution=self.evidence.resolution, kappa=rough["k_s"] / rough["m"]),
        )

    def mark(self, decay: DecayFit | None, seen: Steady) -> float:
        """The crank's angle at the photogate (rad), from steady runs without support or the first ones of the graze."""
        if decay is None:
            return 0.0
        free = seen if len(seen) else steady(self.runs("grazing")[:4])
        angle, note = mark_of(free, decay)
        if note:
            self.say(note)
        return angle

    def contact(self, decay: DecayFit | None, mark: float) -> tuple[ContactFit | None, Finding | None]:
        runs, resolution, rough = self.runs("contact"), self.evidence.resolution, self.adjusted()
        if not runs:
            return None, None
        if decay is None or "k_s" not in rough.names:
            self.say("contact: not used: needs taps of the car (impulse), and the support's stiffness")
            return None, None
        if impossible(rough):  # said of the final values
            self.say("contact: not used: what the other procedures say of the car and the support cannot be")
            return None, None
        m = rough["m"]
        gamma = rough["c_s"] / m if "c_s" in rough.names else 1e-3 * rough["k_s"] / m
        try:
            found = shoot_contacts(runs, decay, resolution=resolution, kappa=rough["k_s"] / m, gamma=gamma, mark=mark)
        except SolveError as reason:
            self.say(f"contact: not used, so that the gap is not known: {reason}")
            return None, None
        for sentence in found.left:
            self.say(sentence)
        self.observe(("kappa", "gamma"), found.values[3:5], found.covariance[3:5, 3:5], "multiple shooting")
        own = Quantity(m, float(np.sqrt(rough.covariance[rough.names.index("m"), rough.names.index("m")])))
        self.findings.append(contact_finding(found, own, resolution=resolution))
        i, j = rough.names.index("k_s"), rough.names.index("m")
        relative = rough.covariance[np.ix_([i, j], [i, j])] / np.outer([rough["k_s"], m], [rough["k_s"], m])
        # of the ratio k_s/m: both come from masses and forces that are known apart
        error = rough["k_s"] / m * float(np.sqrt(np.array([1, -1]) @ relative @ [1, -1]))
        return found, self.beside(
            "c_s from one contact", lambda: one_contact(found, decay, m, resolution=resolution, kappa_error=error)
        )
