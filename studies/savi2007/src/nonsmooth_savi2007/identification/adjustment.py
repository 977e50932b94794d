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

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import block_diag

from nonsmooth import SolveError
from nonsmooth.identification import Estimate, uniform
from nonsmooth_savi2007.arrays import FloatArray

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
    "omega_0": lambda u: np.sqrt(2 * u["k"] / u["m"]),
    "b": lambda u: u["c"] / u["m"],
    "f": lambda u: u["friction"] / u["m"],
    "omega_s": lambda u: np.sqrt(u["k_s"] / u["test_mass"]),
    "b_s": lambda u: u["c_s"] / u["test_mass"],
    "kappa": lambda u: u["k_s"] / u["m"],
    "gamma": lambda u: u["c_s"] / u["m"],
    "gain": lambda u: u["gain"],
}

#: First values of the unknowns, each by the first row of which all was seen.
_FIRST: Sequence[tuple[str, tuple[str, ...], Callable[..., float]]] = (
    ("m", ("mass",), lambda m: m),
    ("k", ("mass", "omega_0"), lambda m, omega: m * omega**2 / 2),
    ("k", ("spring_slope",), lambda slope: slope / 2),
    ("c", ("mass", "b"), lambda m, b: m * b),
    ("friction", ("mass", "f"), lambda m, f: m * f),
    ("test_mass", ("test_mass",), lambda m: m),
    ("k_s", ("test_mass", "omega_s"), lambda m, omega: m * omega**2),
    ("k_s", ("support_slope",), lambda slope: slope),
    ("k_s", ("mass", "kappa"), lambda m, kappa: m * kappa),
    ("c_s", ("test_mass", "b_s"), lambda m, b: m * b),
    ("c_s", ("mass", "gamma"), lambda m, gamma: m * gamma),
    ("gain", ("gain",), lambda gain: gain),
)


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
    seen, first = dict(zip(labels, y.tolist(), strict=True)), dict[str, float]()
    for name, needed, law in _FIRST:
        if name not in first and seen.keys() >= set(needed):
            first[name] = law(*(seen[label] for label in needed))
    names = tuple(name for name in UNKNOWNS if name in first)
    u = np.array([first[name] for name in names])
    scale, size = np.where(u != 0, u, 1.0), np.sqrt(np.diag(covariance))
    weight = np.linalg.inv(covariance / np.outer(size, size))

    def expected(u: Any) -> Any:
        at = dict(zip(names, u, strict=True))
        return np.array([LAWS[label](at) for label in labels])

    for _ in range(_ROUNDS):
        # derivatives by imaginary parts
        jacobian = np.transpose([expected(row).imag for row in u + 1e-30j * np.diag(scale)]) / (1e-30 * size[:, None])
        normal = jacobian.T @ weight @ jacobian
        change = np.linalg.solve(normal, jacobian.T @ weight @ ((y - expected(u)) / size))
        u = u + change * scale
        off = np.abs(change) / np.sqrt(np.diag(np.linalg.inv(normal)))
        if np.max(off) < _CONVERGED:
            break
    else:
        raise SolveError(
            f"the adjustment has not converged after {_ROUNDS} rounds: {names[np.argmax(off)]!r} still changes by "
            f"{np.max(off):.1g} of its standard uncertainty. The observations "
            f"({', '.join(label for label in labels if label != 'gain')}) contradict each other by far: look at the "
            "mass, the wheel and the units, and leave out what is in doubt"
        )
    left = (y - expected(u)) / size
    chi2 = float(left @ weight @ left)
    freedom = len(y) - len(names)
    pulls = dict[str, float]()
    for i, label in enumerate(labels):
        if label != "gain":
            pulls[label if label not in pulls else f"{label} ({i})"] = left[i]
    birge = float(np.sqrt(chi2 / freedom)) if freedom > 0 else float("nan")
    influence = np.linalg.solve(normal, jacobian.T @ weight) * scale[:, None] / size
    found = np.linalg.inv(normal) * np.outer(scale, scale)
    return Adjusted(names, u, found, birge, freedom, pulls, influence, tuple(labels))
