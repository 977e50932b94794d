"""Statements of ``identify``: agreement of the procedures, what each parameter rests on, what a model takes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from nonsmooth import ParameterSet, System
from nonsmooth.errors import unknown
from nonsmooth.identification import Estimate, Finding
from nonsmooth_savi2007.identification.adjustment import Adjusted
from nonsmooth_savi2007.identification.evidence import Evidence
from nonsmooth_savi2007.identification.multiple_shooting import ContactFit
from nonsmooth_savi2007.identification.referral import Referred

#: What must have been recorded to know a parameter.
_RESTS_ON = {
    "m": "the notebook's mass",
    "k": "impulse (taps) or springs (pulls)",
    "k_s": "support (pushes), drop or contact",
    "c": "impulse (taps)",
    "c_s": "drop or contact",
    "g": "contact, impulse, and support or drop",
}
_NEEDED = ("springs", "support", "impulse", "drop", "response", "contact")


def agreement(adjusted: Adjusted, evidence: Evidence) -> list[str]:
    """That the procedures agree, and which were not recorded."""
    notes = []
    if adjusted.freedom > 0 and adjusted.agree:
        notes.append(
            f"the procedures agree: Birge ratio {adjusted.birge:.2f}, {adjusted.freedom} degree"
            f"{'s' if adjusted.freedom > 1 else ''} of freedom"
        )
    if lacking := [name for name in _NEEDED if not evidence.runs[name]]:
        notes.append(f"no recordings of: {', '.join(lacking)}")
    return notes


def disagreement(adjusted: Adjusted) -> str:
    """A sentence where the procedures disagree by more than chance, else an empty one."""
    if adjusted.agree:
        return ""
    name, pull = max(adjusted.pulls.items(), key=lambda row: abs(row[1]))
    return (
        f"the procedures disagree: Birge ratio {adjusted.birge:.2f}; {name} is off by {pull:+.1f} of its "
        "uncertainties. Something is not as the notebook says: a crank, a wheel, a mass"
    )


def impossible(adjusted: Adjusted) -> list[str]:
    """A sentence for each value that no rig has: below zero, or a support softer than the springs."""
    said = []
    for name in ("m", "k", "k_s", "c", "c_s"):
        if name in adjusted.names:
            found = adjusted.estimate(name)
            if not np.isfinite([found.value, found.uncertainty]).all() or found.value < -3 * found.uncertainty:
                said.append(f"{name} = {found} cannot be")
    if {"k", "k_s"} <= set(adjusted.names) and 0 < adjusted["k_s"] < 2 * adjusted["k"]:
        said.append(
            f"the support ({adjusted['k_s']:.4g} N/m) is softer than the car's springs (2k = {2 * adjusted['k']:.4g} "
            "N/m): are recordings of the car and of the support exchanged?"
        )
    return said


def identifiability(adjusted: Adjusted, contacts: ContactFit | None, single: Finding | None) -> dict[str, str]:
    """For each parameter a sentence: what its value rests on and what the records do not say."""
    moved = "omega_0" in adjusted.labels
    said = {
        "m": "weighed; no recording tells it but through the force sensor, whose gain is known to a percent",
        "k": "from omega_0 and m; the force sensor's slope tells its gain"
        if moved
        else "from the force sensor, whose gain is known to a percent only: taps of the car would tell it better",
        "c": "from the shape of the free decay, together with the dry friction: the rig's own viscous part",
        "k_s": "from the frequency of the test mass and of contacts; the force sensor's slope but for its gain",
        "c_s": "from the decay of the drop; a contact lasts 8 samples at 100 Hz and c_s/k_s is 0.5 ms, so no sample "
        "shows it: a single contact tells it by the speed that it takes",
        "g": "from where contacts begin, referred to the mean position under the drive",
    }
    if contacts is not None:
        relative = np.sqrt(contacts.covariance[4, 4]) / abs(contacts.values[4])
        said["c_s"] += (
            f"; {contacts.n_contacts} contacts together know it within a factor {np.exp(1.96 * relative):.4g}"
        )
        if single is not None:
            said["c_s"] += f", one alone: {single.estimate}"
    return {name: said[name] for name in said if name in adjusted.names or (name == "g" and contacts is not None)}


def for_model(found: ParameterSet, model: Any) -> ParameterSet:
    """The set with only those parameters that the model has; a note says which it has not.

    Raises
    ------
    TypeError
        If it is no model with parameters.
    ValueError
        If it has none of them, or one of the same name in another unit.
    """
    if not isinstance(model, System):
        raise TypeError(
            f"model must be a System, as nonsmooth.models.discontinuous_support() returns one; got {model!r}"
        )
    name, units = model.name, model.parameters
    shared = [key for key in found if key in units]
    if not shared:
        raise ValueError(
            f"{name!r} has none of the parameters {', '.join(found)}; identify knows the oscillator with a "
            "discontinuous support"
        )
    for key in shared:
        if (unit := units[key].unit) not in ("", found.estimates[key].unit):
            raise ValueError(
                f"the parameter {key!r} of {name!r} is in {unit}, the one identified in {found.estimates[key].unit}: "
                "they are not the same quantity"
            )
    dropped = [key for key in found if key not in units]
    return found.only(shared, note=f"{name!r} has no parameter {', '.join(dropped)}: kept in extra" if dropped else "")


def require(found: ParameterSet, names: Iterable[str]) -> None:
    """Check that these parameters were identified.

    Raises
    ------
    ValueError
        If one was not: the message says which procedures would tell it, and which were not recorded.
    """
    for name in names:
        if name not in _RESTS_ON:
            raise ValueError(unknown(name, "a parameter", "identify", _RESTS_ON))
        if name not in found and name not in found.extra:
            lacking = next((note for note in found.notes if note.startswith("no recordings of")), "")
            raise ValueError(f"{name!r} was not identified: it needs {_RESTS_ON[name]}; {lacking or 'see the notes'}")


_BESIDE = ("friction", "gain", "omega_0", "gap_at_rest", "mean_shift", "rest_position")


def joined(adjusted: Adjusted, gap: Referred | None, **beside: Any) -> ParameterSet:
    """The model's parameters, then what is beside them: rows over the unknowns of the adjustment, and the gap as it is.

    Parameters
    ----------
    adjusted : Adjusted
    gap : Referred, optional
        With its covariance with the unknowns.
    **beside
        What the :class:`ParameterSet` holds beside the numbers: findings, notes and the like.
    """
    names, size = adjusted.names, len(adjusted.names)
    matrix, unit = np.zeros((size + 4, size + 4)), np.eye(size + 4)
    matrix[:size, :size] = adjusted.covariance
    told = {name: (adjusted.estimate(name), unit[i]) for i, name in enumerate(names)}
    if {"m", "k"} <= told.keys():
        omega = np.sqrt(2 * adjusted["k"] / adjusted["m"])
        row = omega / 2 * (unit[names.index("k")] / adjusted["k"] - unit[names.index("m")] / adjusted["m"])
        told["omega_0"] = Estimate(omega, np.sqrt(row @ matrix @ row), "rad/s"), row
    if gap is not None:
        found = gap.finding
        matrix[size:, :size], matrix[:size, size:], matrix[size:, size:] = gap.cross, gap.cross.T, found.covariance
        estimates = {found.name: found.estimate, **found.others}
        told |= {name: (one, row) for (name, one), row in zip(estimates.items(), unit[size:], strict=True)}
    inner, outer = ([name for name in some if name in told] for some in (_RESTS_ON, _BESIDE))
    jacobian = np.array([told[name][1] for name in (*inner, *outer)])
    return ParameterSet(
        {name: told[name][0] for name in inner},
        jacobian @ matrix @ jacobian.T,
        extra={name: told[name][0] for name in outer},
        **beside,
    )
