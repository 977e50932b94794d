r"""Agreement of measurements: of repeated ones, and between findings of two procedures that tell one quantity.

Each is a difference over its standard uncertainty. What both share, a mass that is weighed once, is not in it: it
moves both alike. A difference that chance does not explain (`CHANCE`) is said in a sentence of its own, with where to
look.

Each run tells the same quantities :math:`\theta_i` with its own covariance :math:`C_i`. About their weighted mean

.. math::

    \bar\theta = \Big(\sum_i C_i^{-1}\Big)^{-1} \sum_i C_i^{-1} \theta_i, \qquad
    \chi^2 = \sum_i (\theta_i - \bar\theta)^T C_i^{-1} (\theta_i - \bar\theta)

has :math:`(n - 1)\,p` degrees of freedom, and the Birge ratio is :math:`\sqrt{\chi^2/(n-1)p}`. Where it is too large to
be chance, the run without which the others agree best is left out, and so on, as long as a majority is kept. Where no
majority agrees, none is left out, and the scatter of the measurements is the uncertainty of their mean.

References: R.T. Birge, Phys. Rev. 40 (1932) 207; M.G. Cox, Metrologia 44 (2007) 187 (largest consistent subset).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2 as distribution

from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, Finding, uniform
from nonsmooth.recordings import Quantity

#: Probability of a chi^2 this large by chance, below which measurements disagree.
CHANCE = 1e-4


class Consistent(NamedTuple):
    """Measurements that agree with each other.

    Attributes
    ----------
    used : array of bool (n,)
        All of them where no majority agrees.
    birge : float
        Birge ratio of those used; NaN for a single one.
    agree : bool
        Whether those used agree.
    mean, covariance : array (p,), (p, p)
        Weighted mean of those used, and its covariance by the stated uncertainties.
    scatter : array (p, p)
        Covariance of a single one of those used, by how they differ: the uncertainty of the mean where they disagree,
        since a fault that several share does not average out.
    """

    used: NDArray[np.bool_]
    birge: float
    agree: bool
    mean: FloatArray
    covariance: FloatArray
    scatter: FloatArray

    def off(self, value: Any, covariance: Any) -> FloatArray:
        """Distance of another measurement from the mean, in the combined standard uncertainties, one per quantity."""
        return (value - self.mean) / np.sqrt(np.diag(np.asarray(covariance) + self.covariance))


def birge_ratio(chi2: float, freedom: int) -> tuple[float, bool]:
    """Root of chi^2 per degree of freedom, and whether chance explains it; NaN and True without any freedom."""

    if freedom < 1:
        return np.nan, True
    return np.sqrt(chi2 / freedom), bool(distribution.sf(chi2, freedom) >= CHANCE)


def inverse(matrix: Any) -> FloatArray:
    """Inverse of covariances (..., p, p), of quantities whose uncertainties differ by orders of magnitude."""
    size = np.sqrt(np.diagonal(matrix, axis1=-2, axis2=-1))
    unit = size[..., None] * size[..., None, :]
    return np.linalg.inv(matrix / unit) / unit


def consistent(values: Any, covariances: Any) -> Consistent:
    """Largest set of measurements that agree, found by leaving out one after another.

    Parameters
    ----------
    values : sequence of array (p,)
    covariances : sequence of array (p, p)

    Examples
    --------
    >>> from nonsmooth_savi2007.identification.cross_checks import consistent
    >>> found = consistent([[1.0], [1.1], [0.9], [7.0]], [[[0.01]]] * 4)
    >>> found.used
    array([ True,  True,  True, False])
    """
    given = np.asarray(values, float)
    known = np.asarray(covariances, float)
    weights, (n, p) = inverse(known), given.shape

    def chi2(rows: list[int]) -> tuple[float, FloatArray, FloatArray]:
        covariance = inverse(weights[rows].sum(axis=0))
        mean = covariance @ np.einsum("ijk,ik->j", weights[rows], given[rows])
        off = given[rows] - mean
        return np.einsum("ij,ijk,ik->", off, weights[rows], off), mean, covariance

    rows = list(range(n))
    while True:
        total, mean, covariance = chi2(rows)
        birge, agree = birge_ratio(total, (len(rows) - 1) * p)
        if agree:
            break
        if 2 * (len(rows) - 1) <= n:  # one fewer would be no majority
            rows = list(range(n))
            total, mean, covariance = chi2(rows)
            birge, _ = birge_ratio(total, (n - 1) * p)
            break
        rows = min(([i for i in rows if i != out] for out in rows), key=lambda kept: chi2(kept)[0])
    used = np.zeros(n, bool)
    used[rows] = True
    variances = np.diagonal(known[rows], axis1=1, axis2=2)
    share, off = 1.0 / np.sum(variances / variances.mean(axis=0), axis=1), given[rows] - mean
    scatter = np.einsum("i,ij,ik->jk", share / share.sum(), off, off) * len(rows) / max(len(rows) - 1, 1)
    return Consistent(used, birge, agree, mean, covariance, scatter)


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
    known = {
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
        difference = np.log(one.value / other.value)
        square = one.relative**2 + other.relative**2 - 2 * common**2
    else:
        difference = one.value - other.value
        square = one.uncertainty**2 + other.uncertainty**2 - 2 * common**2 * one.value * other.value
    if other.half_width:
        difference = np.sign(difference) * max(abs(difference) - other.half_width, 0.0)
        square = one.uncertainty**2
    if square <= 0:
        return np.inf * difference if difference else 0.0
    return difference / np.sqrt(square)
