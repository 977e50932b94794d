"""Checks between findings: each agrees where the numbers do, and fails where one of them is moved."""

import numpy as np
import pytest

from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.recordings.session import Quantity
from nonsmooth_savi2007.identification.cross_checks import PAIRS, cross_checks, sentences

MASSES = {"mass": Quantity(0.84, 1e-3), "test_mass": Quantity(1.33, 1e-3)}


def told(value, error, mass="", logarithmic=False):
    """An estimate with the uncertainty of a mass in it, where it is scaled by one."""
    common = MASSES[mass].uncertainty / MASSES[mass].value if mass else 0.0
    return Estimate(value, float(np.hypot(error, common * value)), logarithmic=logarithmic)


def numbers():
    """All that is compared, by finding and which of its others."""
    return {
        ("omega_0", ""): told(4.5, 1e-3),
        ("c_frequency_response", "omega_0"): told(4.5005, 1e-3),
        ("c_decay", ""): told(0.87, 1e-3, "mass"),
        ("c_frequency_response", ""): told(0.871, 1e-3, "mass"),
        ("c_response", ""): told(0.869, 1e-3, "mass"),
        ("c_decay", "friction"): told(0.010, 1e-4, "mass"),
        ("c_frequency_response", "friction"): told(0.0101, 1e-4, "mass"),
        ("c_frequency_response", "drive_scale"): told(1.001, 1e-3),
        ("c_s_drop", ""): told(0.6, 2e-3, "test_mass", True),
        ("c_s_drop", "c_s_fit"): told(0.601, 1e-3, "test_mass"),
        ("c_s_contact", ""): told(0.61, 1e-2, "mass", True),
        ("c_s_one_contact", ""): told(0.7, 0.2, "mass", True),
        ("crank_force", ""): told(8.5, 0.05),
        ("gap_grazing", "at_rest"): told(1.8e-3, 1e-5),
    }


def checked(moved=None, by=8.0, **beside):
    rows = numbers()
    if moved is not None:
        one = rows[moved]
        rows[moved] = Estimate(one.value + by * one.uncertainty, one.uncertainty, logarithmic=one.logarithmic)
    findings = []
    for name in {key[0] for key in rows}:
        others = {key[1]: row for key, row in rows.items() if key[0] == name and key[1]}
        findings.append(Finding(name, rows.get((name, ""), Estimate(0, 1)), "", 1, others=others))
    given = {
        "gain": Estimate(1.004, 1e-3),
        "gain_limit": 0.01,
        "k": Estimate(8.52, 0.01),
        "gap": Estimate(1.805e-3, 1e-6),
    } | beside
    return cross_checks(findings, MASSES, **given)


def test_numbers_that_agree_are_said_to():
    found = checked()
    assert len(found) == len(PAIRS) and all(check.agrees for check in found)
    agree, disagree = sentences(found)
    assert disagree == [] and all(check.name in agree[0] for check in found)


@pytest.mark.parametrize("moved", list(numbers()))
def test_every_number_that_is_moved_is_seen(moved):
    failed = [check for check in checked(moved) if not check.agrees]
    assert failed
    _, said = sentences(failed)
    assert len(said) == len(failed) and all("disagree" in s and "Look at" in s for s in said)


@pytest.mark.parametrize(
    ("beside", "name"),
    [
        ({"gain": Estimate(1.016, 1e-3)}, "gain"),
        ({"gain": Estimate(0.984, 1e-3)}, "gain"),
        ({"k": Estimate(9.0, 0.01)}, "k"),
        ({"gap": Estimate(1.9e-3, 1e-6)}, "gap at rest"),
    ],
)
def test_what_is_adjusted_is_compared_too(beside, name):
    (failed,) = [check for check in checked(**beside) if not check.agrees]
    assert failed.name.startswith(name)


def test_a_mass_that_both_share_is_no_excuse():
    # both are exact but for a mass known to 4 %, which moves their difference by 4 % of itself
    rows = [Finding(name, Estimate(c, 0.04 * c), "", 1) for name, c in (("c_decay", 0.87), ("c_response", 0.8787))]
    (check,) = cross_checks(rows, {"mass": Quantity(0.84, 0.04 * 0.84)})
    assert check.off == pytest.approx(-1 / 0.04, rel=1e-6)


def test_the_difference_is_in_combined_uncertainties():
    other = {"omega_0": Estimate(4.51, 4e-3)}
    rows = [
        Finding("omega_0", Estimate(4.5, 3e-3), "", 1),
        Finding("c_frequency_response", Estimate(1, 0.1), "", 1, others=other),
    ]
    (check,) = cross_checks(rows, {})
    assert check.off == pytest.approx(-2.0)
    rows = [
        Finding("c_s_drop", Estimate(0.6, 0.06, logarithmic=True), "", 1),
        Finding("c_s_contact", Estimate(0.3, 0.03, logarithmic=True), "", 1),
    ]
    (check,) = cross_checks(rows, {})
    assert check.off == pytest.approx(np.log(2) / np.hypot(0.1, 0.1))
