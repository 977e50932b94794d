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
from typing import Any

import numpy as np

from nonsmooth import SolveError
from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, uniform

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

#: What is observed, as a function of the unknowns.
LAWS: Mapping[str, Callable[[Any], Any]] = {
    "mass": lambda u: u["m"],
    "test_mass": lambda u: u["test_mass"],
    "spring_slope": lambda u: 2 * u["k"] * u["gain"],
    "support_slope": lambda u: u["k_s"] * u["gain"],
    "crank_slope": lambda u: u["k"] * u["gain"],
    "omega_0": lambda u: np.sqrt(2 * u["k"] / u["m"]),
    "b": lambda u: u["c"] / u["m"],
    "f": lambda u: u["friction"] / u["m"],
    "omega_s": lambda u: np.sqrt(u["k_s"] / u["test_mass"]),
    "b_s": lambda u: u["c_s"] / u["test_mass"],
    "kappa": lambda u: u["k_s"] / u["m"],
    "gamma": lambda u: u["c_s"] / u["m"],
}


@dataclass(frozen=True, eq=False)
class Observation:
    """Values measured together: names of `LAWS`, values, covariance, and where they come from."""

    names: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    source: str = ""


@dataclass(frozen=True, eq=False)
class Adjusted:
    """The unknowns that the observations determine, their covariance, and how well all fits together.

    ``birge`` is the root of chi^2 per degree of ``freedom`` (NaN where nothing is left over); ``pulls`` are the
    residuals of the observations over their standard uncertainties. ``influence`` (p, n) is how much each unknown moves
    with each observed value, ``labels`` their names in order.
    """

    names: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    birge: float
    freedom: int
    pulls: Mapping[str, float]
    influence: FloatArray
    labels: tuple[str, ...]

    def __getitem__(self, name: str) -> float:
        return float(self.values[self.names.index(name)])

    def estimate(self, name: str) -> Estimate:
        """An unknown with its standard uncertainty; the support's damping is known to a factor."""
        i = self.names.index(name)
        error = float(np.sqrt(self.covariance[i, i]))
        return Estimate(self[name], error, UNKNOWNS[name], logarithmic=name == "c_s")


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
    y = np.concatenate([o.values for o in observations])
    n = len(y)
    covariance = np.zeros((n, n))
    begin = 0
    for o in observations:
        rows = slice(begin, begin + len(o.values))
        covariance[rows, rows] = o.covariance
        begin += len(o.values)
    first = _first(dict(zip(labels, y, strict=True)))
    names = tuple(name for name in UNKNOWNS if name in first)
    scale = np.array([first[name] if first[name] else 1.0 for name in names])
    u = np.array([first[name] for name in names])
    size = np.sqrt(np.diag(covariance))
    weight = np.linalg.inv(covariance / np.outer(size, size))
    prior = np.zeros((len(names), len(names)))
    known = u.copy()
    if "gain" in names:
        i = names.index("gain")
        known[i] = 1.0
        prior[i, i] = (scale[i] / max(uniform(gain_limit), 1e-12)) ** 2
    for _ in range(_ROUNDS):
        at = dict(zip(names, u, strict=True))
        left = (y - np.array([LAWS[label](at) for label in labels])) / size
        beside = u + 1e-30j * np.diag(scale)  # derivatives by imaginary parts
        jacobian = np.array(
            [[LAWS[label](dict(zip(names, row, strict=True))).imag for row in beside] for label in labels]
        ) / (1e-30 * size[:, None])
        normal = jacobian.T @ weight @ jacobian + prior
        change = np.linalg.solve(normal, jacobian.T @ weight @ left - prior @ ((u - known) / scale))
        u = u + change * scale
        off = np.abs(change) / np.sqrt(np.diag(np.linalg.inv(normal)))
        if np.max(off) < _CONVERGED:
            break
    else:
        raise SolveError(
            f"the adjustment has not converged after {_ROUNDS} rounds: {names[int(np.argmax(off))]!r} still changes by "
            f"{np.max(off):.1g} of its standard uncertainty. The observations ({', '.join(labels)}) contradict each "
            "other by far: look at the mass, the wheel and the units, and leave out what is in doubt"
        )
    found = np.linalg.inv(normal) * np.outer(scale, scale)
    at = dict(zip(names, u, strict=True))
    residual = y - np.array([LAWS[label](at) for label in labels])
    chi2 = float((residual / size) @ weight @ (residual / size)) + float(
        ((u - known) / scale) @ prior @ ((u - known) / scale)
    )
    freedom = n + int("gain" in names) - len(names)
    pulls = {}
    for i, label in enumerate(labels):
        pulls[label if label not in pulls else f"{label} ({i})"] = float(residual[i] / np.sqrt(covariance[i, i]))
    birge = float(np.sqrt(chi2 / freedom)) if freedom > 0 else float("nan")
    influence = np.linalg.solve(normal, jacobian.T @ weight) * scale[:, None] / size
    return Adjusted(names, u, np.asarray(found, dtype=np.float64), birge, freedom, pulls, influence, tuple(labels))


def _first(seen: Mapping[str, float]) -> dict[str, float]:
    """First values of the unknowns that what was seen determines."""
    m = seen["mass"]
    found = {"m": m}
    if "omega_0" in seen:
        found["k"] = m * seen["omega_0"] ** 2 / 2
    elif "spring_slope" in seen:
        found["k"] = seen["spring_slope"] / 2
    elif "crank_slope" in seen:
        found["k"] = seen["crank_slope"]
    if "b" in seen:
        found["c"] = m * seen["b"]
    if "f" in seen:
        found["friction"] = m * seen["f"]
    if "test_mass" in seen and "omega_s" in seen:
        found["test_mass"] = seen["test_mass"]
        found["k_s"] = seen["test_mass"] * seen["omega_s"] ** 2
        found["c_s"] = seen["test_mass"] * seen["b_s"]
    elif "test_mass" in seen:
        found["test_mass"] = seen["test_mass"]
    if "k_s" not in found and "support_slope" in seen:
        found["k_s"] = seen["support_slope"]
    if "k_s" not in found and "kappa" in seen:
        found["k_s"] = m * seen["kappa"]
    if "c_s" not in found and "gamma" in seen:
        found["c_s"] = m * seen["gamma"]
    if any(name in seen for name in ("spring_slope", "support_slope", "crank_slope")):
        found["gain"] = 1.0
    return found
