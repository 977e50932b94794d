"""One parameter set of what the adjustment found and of the gap, with one covariance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from nonsmooth import ParameterSet
from nonsmooth.identification import Estimate, Finding
from nonsmooth.studies.savi2007.identification.adjustment import Adjusted
from nonsmooth.studies.savi2007.identification.referral import Referred

__all__ = ["joined"]

_PARAMETERS = ("m", "k", "k_s", "c", "c_s")
_BESIDE = ("friction", "gain")


def joined(
    adjusted: Adjusted, gap: Referred | None, *, findings: Sequence[Finding], identifiability: Mapping[str, str],
    notes: Sequence[str], synthetic: bool, anomalies: Sequence[str] = (),
) -> ParameterSet:  # fmt: skip
    """The model's parameters, then what is beside them: rows over the unknowns of the adjustment, and the gap as it is.

    Parameters
    ----------
    adjusted : Adjusted
    gap : Referred, optional
        With its covariance with the unknowns.
    findings, identifiability, notes, anomalies, synthetic
        Of the :class:`ParameterSet`.
    """
    size, names = len(adjusted.names), adjusted.names
    unit = np.eye(size)
    rows = {name: (adjusted.estimate(name), unit[names.index(name)]) for name in names}
    if {"m", "k"} <= set(names):
        omega, row = float(np.sqrt(2 * adjusted["k"] / adjusted["m"])), np.zeros(size)
        row[names.index("k")], row[names.index("m")] = omega / (2 * adjusted["k"]), -omega / (2 * adjusted["m"])
        error = float(np.sqrt(row @ adjusted.covariance @ row))
        rows["omega_0"] = (Estimate(omega, error, "rad/s"), row)
    inner = [name for name in _PARAMETERS if name in rows]
    outer = [name for name in (*_BESIDE, "omega_0") if name in rows]
    jacobian = np.array([rows[name][1] for name in inner + outer]).reshape(-1, size)
    estimates = {name: rows[name][0] for name in inner}
    extra = {name: rows[name][0] for name in outer}
    covariance = jacobian @ adjusted.covariance @ jacobian.T
    if gap is not None:
        n = len(inner)
        cross = gap.cross @ jacobian.T
        stacked = np.block([[covariance, cross.T], [cross, gap.covariance]])
        m = len(covariance)
        order = [*range(n), m, *range(n, m), *range(m + 1, m + 4)]
        covariance = stacked[np.ix_(order, order)]
        estimates["g"] = gap.gap
        extra |= {"gap_at_rest": gap.at_rest, "mean_shift": gap.shift, "rest_position": gap.rest}
    return ParameterSet(
        estimates, covariance, extra=extra, findings=findings, identifiability=identifiability, notes=notes,
        anomalies=anomalies, synthetic=synthetic,
    )
