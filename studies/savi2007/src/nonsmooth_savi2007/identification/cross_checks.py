"""Checks between findings: where two procedures tell one quantity, whether they agree, and by how much they do not.

Each is a difference over its standard uncertainty. What both share, a mass that is weighed once, is not in it: it
moves both alike. A difference that chance does not explain
(``consistency.CHANCE``) is said in a sentence of its own, with where to look.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from nonsmooth.identification import Estimate, Finding, uniform
from nonsmooth.recordings import Quantity
from nonsmooth_savi2007.identification.consistency import birge_ratio


class Check(NamedTuple):
    """Two estimates of one quantity, as ``"c: free decay, complex response"``, and what to look at if they differ.

    ``off`` is their difference, the first less the second, over its standard uncertainty.
    """

    name: str
    one: Estimate
    other: Estimate
    off: float
    remedy: str

    @property
    def agrees(self) -> bool:
        """Return whether chance explains the difference."""
        return birge_ratio(self.off**2, 1)[1]


#: What is compared: its name, finding and which of its others ("" for itself), the same of the other, the mass that
#: both share, and what to look at. Beside findings stand what is adjusted, the contacts' gap, and 1.
PAIRS: Sequence[tuple[str, tuple[str, str], tuple[str, str], str, str]] = (
    (
        "omega_0: free decay, complex response",
        ("omega_0", ""),
        ("c_frequency_response", "omega_0"),
        "",
        "the photogate's times or the springs: were they changed between the procedures?",
    ),
    (
        "c: free decay, complex response",
        ("c_decay", ""),
        ("c_frequency_response", ""),
        "mass",
        "the damper, or friction that is not dry: was anything changed between taps and response?",
    ),
    (
        "c: free decay, amplitude over frequency",
        ("c_decay", ""),
        ("c_response", ""),
        "mass",
        "the damper, or the crank's lengths",
    ),
    (
        "friction: free decay, complex response",
        ("c_decay", "friction"),
        ("c_frequency_response", "friction"),
        "mass",
        "friction that is not dry, or a bearing that was moved",
    ),
    (
        "c_s: drop by decrement, drop by fit",
        ("c_s_drop", ""),
        ("c_s_drop", "c_s_fit"),
        "test_mass",
        "damping of the support that depends on amplitude",
    ),
    (
        "c_s: drop, contacts",
        ("c_s_drop", ""),
        ("c_s_contact", ""),
        "",
        "the support's damping, its mounting, or the mass that was hung on it",
    ),
    (
        "c_s: one contact, all contacts",
        ("c_s_one_contact", ""),
        ("c_s_contact", ""),
        "mass",
        "the record of that piece",
    ),
    (
        "drive: complex response over what the crank's length says, 1",
        ("c_frequency_response", "drive_scale"),
        ("one", ""),
        "",
        "the crank's lengths, or springs that are not equal",
    ),
    ("k: crank's force, all others", ("crank_force", ""), ("adjusted", "k"), "", "the crank's lengths"),
    (
        "gain: force sensor against motions and masses, 1 within ±{:g} %",
        ("adjusted", "gain"),
        ("one", "within limits"),
        "",
        "the force sensor's calibration, the mass, or the wheel",
    ),
    (
        "gap at rest: graze, contacts",
        ("gap_grazing", "at_rest"),
        ("contacts", "at_rest"),
        "",
        "the screw: was it turned between the two? a string that slipped, or steps that are too coarse",
    ),
)


def cross_checks(
    findings: Sequence[Finding],
    masses: Mapping[str, Quantity],
    *,
    gain: Estimate | None = None,
    gain_limit: float = 0.0,
    k: Estimate | None = None,
    gap: Estimate | None = None,
) -> list[Check]:
    """All checks that these findings allow.

    Parameters
    ----------
    findings : sequence of Finding
    masses : mapping of str to Quantity
        ``mass`` and ``test_mass`` as weighed, by which damping and friction of a motion are scaled.
    gain, gain_limit : Estimate, float
        The force sensor's gain as adjusted, and how far from 1 it may be.
    k : Estimate, optional
        The stiffness as adjusted, to be compared with that by the crank's force.
    gap : Estimate, optional
        The gap at rest by contacts at the setting of the screw at which the graze was sought.
    """
    known: dict[tuple[str, str], Estimate | None] = {
        ("one", ""): Estimate(1.0, 0.0),
        ("one", "within limits"): Estimate(1.0, uniform(gain_limit), half_width=gain_limit) if gain_limit else None,
        ("adjusted", "k"): k,
        ("adjusted", "gain"): gain,
        ("contacts", "at_rest"): gap,
    }
    for finding in findings:
        known |= {(finding.name, other): one for other, one in {"": finding.estimate, **finding.others}.items()}
    found = []
    for name, first, second, shared, remedy in PAIRS:
        one, other = known.get(first), known.get(second)
        if one is not None and other is not None:
            common = masses[shared].uncertainty / masses[shared].value if shared in masses else 0.0
            words = name.format(100 * other.half_width)
            found.append(Check(words, one, other, _off(one, other, common), remedy))
    return found


def sentences(checks: Sequence[Check]) -> tuple[list[str], list[str]]:
    """Agreements in one sentence, and one sentence for each pair that disagrees."""
    good = [f"{check.name} ({abs(check.off):.1f})" for check in checks if check.agrees]
    agree = [f"in agreement, with the difference in its uncertainties: {'; '.join(good)}"] if good else []
    return agree, [
        f"{check.name} disagree: {check.one} and {check.other}, {abs(check.off):.1f} uncertainties of the difference "
        f"apart. Look at {check.remedy}"
        for check in checks
        if not check.agrees
    ]


def _off(one: Estimate, other: Estimate, common: float) -> float:
    """Difference over its uncertainty, without the relative uncertainty that both share; beyond limits, if any."""
    if (one.logarithmic or other.logarithmic) and one.value > 0 and other.value > 0:
        difference = float(np.log(one.value / other.value))
        square = one.relative**2 + other.relative**2 - 2 * common**2
    else:
        difference = one.value - other.value
        square = one.uncertainty**2 + other.uncertainty**2 - 2 * common**2 * one.value * other.value
    if other.half_width:
        difference = float(np.sign(difference)) * max(abs(difference) - other.half_width, 0.0)
        square = one.uncertainty**2
    if square <= 0:
        return float("inf") * difference if difference else 0.0
    return float(difference / np.sqrt(square))
