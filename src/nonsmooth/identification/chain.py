"""``identify``: from the recordings of a session to the model's parameters with their covariance."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.experiment.session import Session
from nonsmooth.identification.adjustment import UNKNOWNS, Adjusted, Observation, adjust
from nonsmooth.identification.damping import amplitude_fit
from nonsmooth.identification.evidence import Evidence, gather
from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.identification.free_decay import DecayFit, free_decay
from nonsmooth.identification.gap import mean_shift
from nonsmooth.identification.multiple_shooting import ContactFit, shoot_contacts
from nonsmooth.identification.natural_frequency import natural_frequency
from nonsmooth.identification.parameter_set import ParameterSet
from nonsmooth.identification.stiffness import stiffness
from nonsmooth.identification.support_damping import support_damping

__all__ = ["identify"]

FloatArray = NDArray[np.float64]
_PARAMETERS = ("m", "k", "k_s", "c", "c_s")


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
    k_s/M and c_s/M, and records with contact k_s/m, c_s/m and the gap.

    Parameters
    ----------
    recordings : Session, path, or mapping
        A session folder, or recordings by procedure; see :func:`nonsmooth.identification.gather`.
    model : System, optional
        The result keeps only its parameters; an error names what it has that recordings cannot tell.
    apparatus : mapping, optional
        What is known of the apparatus, where there is no notebook.
    crank_length : float, optional
        The crank (m) to whose mean position the gap ``g`` is referred; the longest of the runs with contact where
        not given.

    Returns
    -------
    ParameterSet
        ``m, k, k_s, c, c_s, g`` as far as the recordings tell them.

    Raises
    ------
    ValueError
        If there is no mass, or no recording from which anything can be identified.
    """
    evidence = gather(recordings, apparatus=apparatus)
    findings: list[Finding] = []
    observations = [_weighed(evidence, "mass")]
    decay = _decay(evidence, findings, observations)
    _forces(evidence, findings, observations)
    _drop(evidence, findings, observations)
    limit = evidence.apparatus["force_gain_limit"].value if "force_gain_limit" in evidence.apparatus else 0.01
    contacts = None
    if decay is not None and evidence.runs.get("contact"):
        rough = adjust(observations, gain_limit=limit)
        if "k_s" in rough.names:
            contacts = _contacts(evidence, decay, rough, observations, findings)
    adjusted = adjust(observations, gain_limit=limit)
    estimates = {
        name: _estimate(adjusted, name) for name in _PARAMETERS if name in adjusted.names
    }  # fmt: skip
    extra: dict[str, Estimate] = {
        name: _estimate(adjusted, name) for name in ("friction", "gain") if name in adjusted.names
    }
    columns = [_row(adjusted, name) for name in estimates]
    extra_columns = [_row(adjusted, name) for name in extra]
    size = len(adjusted.names)
    joint = adjusted.covariance
    gaps = _gaps(evidence, decay, contacts, crank_length) if contacts is not None and decay is not None else None
    if {"m", "k"} <= set(estimates):
        row = np.zeros(size)
        omega = float(np.sqrt(2 * adjusted["k"] / adjusted["m"]))
        row[adjusted.names.index("k")] = omega / (2 * adjusted["k"])
        row[adjusted.names.index("m")] = -omega / (2 * adjusted["m"])
        extra["omega_0"] = Estimate(omega, float(np.sqrt(row @ joint @ row)), "rad/s")
        extra_columns.append(row)
    jacobian = np.array(columns + extra_columns).reshape(-1, size)
    covariance = jacobian @ joint @ jacobian.T
    if gaps is not None:
        estimates, extra, covariance = _with_gaps(estimates, extra, covariance, gaps)
    result = ParameterSet(
        estimates, covariance, extra=extra, findings=findings, identifiability=_identifiability(adjusted, contacts),
        notes=_notes(adjusted, evidence), synthetic=evidence.synthetic,
    )  # fmt: skip
    if model is not None:
        _check_model(result, model)
    return result


def _weighed(evidence: Evidence, name: str) -> Observation:
    quantity = evidence.quantity(name)
    if quantity.uncertainty <= 0:
        raise ValueError(f"the notebook states no uncertainty of `{name}`; write {{ value = ..., uncertainty = ... }}")
    return Observation((name,), np.array([quantity.value]), np.array([[quantity.uncertainty**2]]), "weighed")


def _decay(evidence: Evidence, findings: list[Finding], observations: list[Observation]) -> DecayFit | None:
    runs = evidence.runs.get("impulse", ())
    if not runs:
        return None
    decay = free_decay([(run.time, run.positions) for run in runs], resolution=evidence.resolution)
    observations.append(
        Observation(("omega_0", "b", "f"), decay.values[:3], decay.covariance[:3, :3], "free decay")
    )  # fmt: skip
    mass = evidence.quantity("mass")
    findings.append(natural_frequency(runs, decay))
    findings += amplitude_fit(evidence.runs.get("response", ()), decay, mass.value)
    return decay


def _forces(evidence: Evidence, findings: list[Finding], observations: list[Observation]) -> None:
    limit = evidence.apparatus["force_gain_limit"].value if "force_gain_limit" in evidence.apparatus else 0.01
    for procedure, law, mass, friction in (
        ("springs", "spring_slope", evidence.quantity("mass").value, True), ("support", "support_slope", 0.0, False),
    ):  # fmt: skip
        runs = evidence.runs.get(procedure, ())
        if not runs:
            continue
        found = stiffness(
            runs, resolution=evidence.resolution, mass=mass, gain_limit=limit, friction=friction, name=law
        )
        findings.append(found)
        error = found.others["slope_a"].uncertainty
        observations.append(Observation((law,), np.array([found.value]), np.array([[error**2]]), procedure))


def _drop(evidence: Evidence, findings: list[Finding], observations: list[Observation]) -> None:
    runs = evidence.runs.get("drop", ())
    if not runs:
        return
    found, decay = support_damping(runs, resolution=evidence.resolution, test_mass=evidence.quantity("test_mass"))
    findings.append(found)
    observations.append(_weighed(evidence, "test_mass"))
    observations.append(
        Observation(("omega_s", "b_s"), decay.values[:2], decay.covariance[:2, :2], "drop of the test mass")
    )  # fmt: skip


def _contacts(
    evidence: Evidence, decay: DecayFit, rough: Adjusted, observations: list[Observation], findings: list[Finding]
) -> ContactFit:
    m = rough["m"]
    gamma = rough["c_s"] / m if "c_s" in rough.names else 1e-3 * rough["k_s"] / m
    found = shoot_contacts(
        evidence.runs["contact"], decay, resolution=evidence.resolution, kappa=rough["k_s"] / m, gamma=gamma
    )
    error = np.sqrt(np.diag(found.covariance))
    findings.append(
        Finding(
            "c_s_contact",
            Estimate(found.values[4] * m, float(error[4] * m), "N s/m", logarithmic=True),
            f"multiple shooting over {found.n_contacts} pieces split at contacts",
            found.fit.samples,
            tuple(run.name for run in found.runs),
            ("one contact is 8 samples at 100 Hz: what is known of c_s comes from many fitted together",),
            {"k_s": Estimate(found.values[3] * m, float(error[3] * m), "N/m")},
        )
    )
    observations.append(
        Observation(("kappa", "gamma"), found.values[3:5], found.covariance[3:5, 3:5], "multiple shooting")
    )  # fmt: skip
    return found


def _estimate(adjusted: Adjusted, name: str) -> Estimate:
    i = adjusted.names.index(name)
    error = float(np.sqrt(adjusted.covariance[i, i]))
    return Estimate(adjusted[name], error, UNKNOWNS[name], logarithmic=name == "c_s")


def _row(adjusted: Adjusted, name: str) -> FloatArray:
    row = np.zeros(len(adjusted.names))
    row[adjusted.names.index(name)] = 1.0
    return row


def _gaps(
    evidence: Evidence, decay: DecayFit, contacts: ContactFit, crank_length: float | None
) -> tuple[Estimate, Estimate, Estimate]:
    """The gap referred to the mean position, at rest, and the shift between, at the most frequent screw reading."""
    readings = [float(run.settings["gap"]) for run in contacts.runs]
    reading = max(set(readings), key=readings.count)
    index = [contacts.place(i, 0) for i, value in enumerate(readings) if value == reading]
    block = contacts.covariance[np.ix_(index, index)]
    weight = np.linalg.solve(block, np.ones(len(index)))
    seen = float(weight @ contacts.values[index] / weight.sum())
    chi2 = float((contacts.values[index] - seen) @ np.linalg.solve(block, contacts.values[index] - seen))
    error = float(np.sqrt(max(chi2 / max(len(index) - 1, 1), 1.0) / weight.sum()))
    zero, zero_error = float(decay.values[3]), decay.error("x_e")
    length = evidence.apparatus.get("string_length")
    shift = mean_shift(
        evidence.runs.get("response", ()), zero, zero_error,
        string_length=length.value if length else None, string_error=length.uncertainty if length else 0.0,
    )  # fmt: skip
    longest = max(float(run.settings["crank_length"]) for run in contacts.runs)
    moved, moved_error = shift.at(longest if crank_length is None else crank_length)
    at_rest = float(np.hypot(error, zero_error))
    return (
        Estimate(seen - zero - moved, float(np.hypot(at_rest, moved_error)), "m"),
        Estimate(seen - zero, at_rest, "m"),
        Estimate(moved, moved_error, "m"),
    )


def _with_gaps(
    estimates: dict[str, Estimate], extra: dict[str, Estimate], covariance: FloatArray, gaps: tuple[Estimate, ...]
) -> tuple[dict[str, Estimate], dict[str, Estimate], FloatArray]:
    """Put the gap behind the parameters and the gap at rest and the shift behind the extras."""
    n, e = len(estimates), len(extra)
    referred, at_rest, shift = gaps
    full = np.zeros((n + e + 3, n + e + 3))
    keep = [*range(n), *range(n + 1, n + 1 + e)]
    full[np.ix_(keep, keep)] = covariance
    g, r, s = n, n + 1 + e, n + 2 + e
    full[r, r], full[s, s] = at_rest.uncertainty**2, shift.uncertainty**2
    full[g, g] = full[r, r] + full[s, s]
    full[g, r] = full[r, g] = full[r, r]
    full[g, s] = full[s, g] = -full[s, s]
    return {**estimates, "g": referred}, {**extra, "gap_at_rest": at_rest, "mean_shift": shift}, full


def _notes(adjusted: Adjusted, evidence: Evidence) -> list[str]:
    notes = []
    if adjusted.birge == adjusted.birge:
        notes.append(f"the procedures agree: Birge ratio {adjusted.birge:.2f}" if adjusted.birge < 2 else
                     f"the procedures disagree: Birge ratio {adjusted.birge:.2f}; largest pull "
                     f"{max(adjusted.pulls.items(), key=lambda row: abs(row[1]))}")  # fmt: skip
    needed = ("springs", "support", "impulse", "drop", "response", "contact")
    if lacking := [name for name in needed if name in evidence.missing]:
        notes.append(f"no recordings of: {', '.join(lacking)}")
    return notes


def _identifiability(adjusted: Adjusted, contacts: ContactFit | None) -> dict[str, str]:
    said = {
        "m": "weighed; no recording tells it but through the force sensor, whose gain is known to a percent",
        "k": "from omega_0 and m; the force sensor's slope agrees within its gain",
        "c": "from the shape of the free decay, together with the dry friction: the rig's own viscous part",
        "k_s": "from the frequency of the test mass and of contacts; the force sensor's slope within its gain",
        "c_s": "from the decay of the drop; a contact lasts 8 samples at 100 Hz and c_s/k_s is 0.5 ms, so a single "
        "contact tells it poorly",
        "g": "from where contacts begin, referred to the mean position under the drive",
    }
    if contacts is not None:
        relative = float(np.sqrt(contacts.covariance[4, 4]) / abs(contacts.values[4]))
        one = float(np.exp(1.96 * relative * np.sqrt(max(contacts.n_contacts, 1))))
        said["c_s"] += (
            f"; {contacts.n_contacts} pieces together know it within a factor {np.exp(1.96 * relative):.4g}, one "
            f"alone about {one:.2g}"
        )
    return {name: said[name] for name in said if name in adjusted.names or name == "g"}


def _check_model(found: ParameterSet, model: Any) -> None:
    names = getattr(model, "parameters", {})
    if lacking := [name for name in found if name not in names]:
        raise ValueError(
            f"the model {getattr(model, 'name', '')!r} has no parameter {', '.join(lacking)}; identify knows the "
            "oscillator with a discontinuous support (m, k, k_s, c, c_s, g)"
        )
