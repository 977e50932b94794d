r"""Adjustment of all that was measured to one set of parameters, by generalised least squares.

Motions tell ratios to the mass, the force sensor tells forces but for its gain, the scale tells masses:

.. math::

    S = 2k\,(1+\gamma), \quad S_s = k_s (1+\gamma), \quad \omega_0^2 = 2k/m, \quad b = c/m, \quad f = F_C/m,

    \omega_s^2 = k_s/M, \quad b_s = c_s/M, \quad \kappa = k_s/m, \quad \gamma_s = c_s/m

with :math:`\gamma` known beforehand only to its limits (type B). Every stated uncertainty carries the gain through one
common covariance; where a motion and the scale say more than the sensor, the gain itself becomes known.

References: P.J. Mohr and B.N. Taylor, Rev. Mod. Phys. 72 (2000) 351, appendix E; JCGM 100:2008, 5.2; R.T. Birge,
Phys. Rev. 40 (1932) 207.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import block_diag

from nonsmooth import SolveError
from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, uniform
from nonsmooth_savi2007.identification.cross_checks import birge_ratio, inverse

_ROUNDS = 50
_CONVERGED = 1e-6  # of a standard uncertainty

#: The unknowns of the adjustment, with units.
UNKNOWNS: Mapping[str, str] = {
    "m": "kg",
    "k": "N/m",
    "k_s": "N/m",
    "c": "N s/m",
    "c_s": "N s/m",
    "friction": "N",
    "test_mass": "kg",
    "gain": "",
}

#: What is observed, as a function of the unknowns: products of their powers.
LAWS: Mapping[str, Callable[[Any], Any]] = {
    "mass": lambda u: u["m"],
    "test_mass": lambda u: u["test_mass"],
    "spring_slope": lambda u: 2 * u["k"] * u["gain"],
    "support_slope": lambda u: u["k_s"] * u["gain"],
    "omega_0": lambda u: np.sqrt(2 * u["k"] / u["m"]),
    "b": lambda u: u["c"] / u["m"],
    "f": lambda u: u["friction"] / u["m"],
    "omega_s": lambda u: np.sqrt(u["k_s"] / u["test_mass"]),
    "b_s": lambda u: u["c_s"] / u["test_mass"],
    "kappa": lambda u: u["k_s"] / u["m"],
    "gamma": lambda u: u["c_s"] / u["m"],
    "gain": lambda u: u["gain"],
}


class Observation(NamedTuple):
    """Values measured together: names of `LAWS`, values, covariance."""

    names: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray

    @classmethod
    def of(cls, name: str, value: float, uncertainty: float) -> Observation:
        """A single value with its standard uncertainty."""
        return cls((name,), np.array([value]), np.array([[uncertainty**2]]))


@dataclass(frozen=True, eq=False)
class Adjusted:
    """The unknowns that the observations determine, their covariance, and how well all fits together.

    ``birge`` is the root of chi^2 per degree of ``freedom`` (NaN where nothing is left over), and ``agree`` whether
    chance explains it; ``pulls`` are the residuals of the observations over their standard uncertainties.
    ``influence`` (p, n) is how much each unknown moves with each observed value, ``labels`` their names in order.
    """

    names: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    birge: float
    agree: bool
    freedom: int
    pulls: Mapping[str, float]
    influence: FloatArray
    labels: tuple[str, ...]

    def __getitem__(self, name: str) -> float:
        return self.values[self.names.index(name)]

    def estimate(self, name: str) -> Estimate:
        """An unknown with its standard uncertainty; the support's damping is known to a factor."""
        i = self.names.index(name)
        error = np.sqrt(self.covariance[i, i])
        return Estimate(self[name], error, UNKNOWNS[name], logarithmic=name == "c_s")

    def ratio(self, name: str, other: str) -> Estimate:
        """One unknown over another."""
        i, j, value = self.names.index(name), self.names.index(other), self[name] / self[other]
        row = np.array([1 / self[name], -1 / self[other]])
        return Estimate(value, value * np.sqrt(row @ self.covariance[np.ix_([i, j], [i, j])] @ row))

    def known(self, name: str) -> Estimate | None:
        """The estimate of an unknown that may not be determined."""
        return self.estimate(name) if name in self.names else None


def adjust(observations: list[Observation], *, gain_limit: float) -> Adjusted:
    """Adjust the unknowns to the observations.

    Parameters
    ----------
    observations : list of Observation
    gain_limit : float
        The force sensor's gain lies within 1 +- this.

    Raises
    ------
    ValueError
        If no mass is known, so that nothing has a scale.
    SolveError
        If the adjustment does not converge: the observations contradict each other by far.
    """
    labels = [name for o in observations for name in o.names]
    if "mass" not in labels:
        raise ValueError("the mass of the car is needed: motions tell only ratios to it; weigh it")
    if {"spring_slope", "support_slope"}.intersection(labels):
        observations = [*observations, Observation.of("gain", 1.0, max(uniform(gain_limit), 1e-12))]
        labels.append("gain")
    y = np.concatenate([o.values for o in observations])
    covariance = block_diag(*(o.covariance for o in observations))
    weight, names = inverse(covariance), tuple(UNKNOWNS)

    def expected(u: Any) -> Any:
        at = dict(zip(names, u, strict=True))
        return np.array([LAWS[label](at) for label in labels])

    def slopes(u: FloatArray) -> FloatArray:  # by imaginary parts
        return np.transpose([expected(u + 1e-30j * one).imag for one in np.eye(len(u))]) / 1e-30

    ones = np.ones(len(names))
    powers, factors = slopes(ones) / expected(ones)[:, None], expected(ones)
    names = tuple(name for name, there in zip(names, powers.any(axis=0), strict=True) if there)
    logs = np.log(np.maximum(np.abs(y), 1e-9) / factors)
    u = np.exp(np.linalg.lstsq(powers[:, powers.any(axis=0)], logs, rcond=None)[0])
    told = ", ".join(label for label in labels if label != "gain")
    advice = (
        f"The observations ({told}) contradict each other by far: look at the mass, the wheel and the units, and leave "
        "out what is in doubt"
    )
    for _ in range(_ROUNDS):
        jacobian = slopes(u)
        try:
            found = inverse(jacobian.T @ weight @ jacobian)
        except np.linalg.LinAlgError:
            raise SolveError(f"the adjustment has come to where nothing determines its unknowns. {advice}") from None
        influence = found @ jacobian.T @ weight
        change = influence @ (y - expected(u))
        u, off = u + change, np.abs(change) / np.sqrt(np.diag(found))
        if np.max(off) < _CONVERGED:
            break
    else:
        raise SolveError(
            f"the adjustment has not converged after {_ROUNDS} rounds: {names[np.argmax(off)]!r} still changes by "
            f"{np.max(off):.1g} of its standard uncertainty. {advice}"
        )
    left, freedom = y - expected(u), len(y) - len(names)
    pulls = dict[str, float]()
    for i, (label, pull) in enumerate(zip(labels, left / np.sqrt(np.diag(covariance)), strict=True)):
        if label != "gain":
            pulls[label if label not in pulls else f"{label} ({i})"] = pull
    return Adjusted(
        names, u, found, *birge_ratio(left @ weight @ left, freedom), freedom, pulls, influence, tuple(labels)
    )
