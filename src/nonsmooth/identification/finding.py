"""Outcome of one procedure: a value, from which samples and how, and its uncertainty by the guide's rules.

Residuals of an encoder are not white: where the car is slow the same rounding error stays for many samples. So a fit's
covariance is scaled by the residuals' own correlation (:func:`correlated`), never by the number of samples alone.

References: JCGM 100:2008 (GUM), 4.3.7 for limits without a distribution, 5.2.2 for correlated inputs; JCGM 101:2008.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings.signals.spectrum import correlation_times
from nonsmooth.results.representation import cut, html_table


def uniform(half_width: float) -> float:
    r"""Standard uncertainty (type B) of a quantity known to lie within +- ``half_width``: :math:`a / \sqrt 3`.

    Raises
    ------
    ValueError
        If the half width is negative or not finite.
    """
    if not 0 <= half_width < np.inf:
        raise ValueError(f"half_width = {half_width!r} must be finite and not negative")
    return float(half_width) / np.sqrt(3.0)


def coverage_factor(level: float) -> float:
    """Number of standard uncertainties that hold a normal quantity with this probability: 1.96 for 0.95."""
    from scipy.special import ndtri

    if not 0 < level < 1:
        raise ValueError(f"level = {level!r} must lie between 0 and 1, as 0.95")
    return float(ndtri(0.5 + level / 2))


def reach_of(normal: float, half_width: float, level: float) -> float:
    """Half the symmetric interval of a normal quantity plus an independent uniform one, from their exact convolution.

    With z = r/s, w = a/s: P(|.| < r) = [M(z + w) - M(z - w)] / w - 1 with M(u) = u Phi(u) + phi(u), the integral of
    the normal distribution function.
    """
    from scipy.optimize import brentq
    from scipy.special import ndtr

    if half_width < 1e-6 * normal or half_width == 0:
        return coverage_factor(level) * normal
    if normal < 1e-6 * half_width:
        return level * half_width
    w = half_width / normal

    def excess(z: float) -> float:
        u = np.array([z + w, z - w])
        above, below = u * ndtr(u) + np.exp(-u * u / 2) / np.sqrt(2 * np.pi)
        return (above - below) / w - 1.0 - level

    return normal * float(brentq(excess, 0.0, w + 10.0, xtol=1e-10))


def normal_draws(mean: Any, covariance: FloatArray, n: int, seed: Any, logarithmic: Any = False) -> FloatArray:
    """``n`` rows drawn from a normal law; of a quantity that is ``logarithmic`` the logarithm is normal."""
    mean, sizes = np.asarray(mean, float), np.sqrt(np.diag(covariance))
    if np.isinf(sizes).any():
        raise ValueError(
            "a quantity with an infinite uncertainty has no law to draw from: give its value, and take the others by "
            "found.only([...])"
        )
    scale = np.where(sizes > 0, sizes, 1.0)  # parameters differ by 10^5 in size: draw in units of their own errors
    unit = np.random.default_rng(seed).multivariate_normal(
        np.zeros(len(mean)), covariance / np.outer(scale, scale), n, method="eigh"
    )
    relative = np.where(logarithmic, scale / np.where(logarithmic, mean, 1.0), 0.0)  # d ln x = dx / x
    return np.where(logarithmic, mean * np.exp(unit * relative), mean + unit * scale)


def newey_west(scores: FloatArray, times: float) -> FloatArray:
    """Sum of the scores' products (p, p) up to a lag of a few correlation ``times``, with Bartlett's weights."""
    found = scores.T @ scores
    lags = min(len(scores) - 1, int(np.ceil(4 * times)) + 2)
    for k in range(1, lags + 1):
        cross = scores[k:].T @ scores[:-k]
        found += (1.0 - k / (lags + 1)) * (cross + cross.T)
    return found


def not_below(covariance: FloatArray, least: FloatArray) -> FloatArray:
    """The covariance with no variance below that of ``least``, its correlations as they are, where it has any.

    A short record can make a sum of few products small by chance, and residuals that are zero have no scatter.
    """
    shape = covariance if np.diag(covariance).all() else least
    raised = np.sqrt(np.maximum(np.diag(least), np.diag(covariance)) / np.maximum(np.diag(shape), 1e-300))
    return shape * np.outer(raised, raised)


def correlated(jacobian: Any, residuals: Any, pieces: Sequence[int] | None = None) -> FloatArray:
    r"""Covariance of a least-squares estimate whose residuals are correlated in time.

    .. math::

        C = H^{-1} \left[\sum_{|k| \le K} w_k \sum_i J_i r_i \, r_{i+k} J_{i+k}^T\right] H^{-1}, \qquad H = J^T J

    with Bartlett's weights (Newey and West, Econometrica 55 (1987) 703) and K from the residuals' own correlation.

    Parameters
    ----------
    jacobian : array (n, p)
        Derivatives of the weighted residuals.
    residuals : array (n,)
        Weighted residuals, in the order of time.
    pieces : sequence of int, optional
        Lengths of independent records that follow one another; no correlation is assumed across them.

    Returns
    -------
    array (p, p)
        Never smaller, along any parameter, than the covariance of white residuals of the same size.
    """
    j = np.asarray(jacobian, float)
    r = np.asarray(residuals, float)
    n, p = j.shape
    lengths = [n] if pieces is None else list(map(int, pieces))
    if sum(lengths) != n or len(r) != n:
        raise ValueError(f"pieces {lengths} must add up to the {n} rows of the Jacobian and the {len(r)} residuals")
    scale = np.linalg.norm(j, axis=0)
    scale[scale == 0] = 1.0
    inverse = np.linalg.pinv((j / scale).T @ (j / scale))
    white = inverse * (r @ r) / max(n - p, 1)
    meat, ends = np.zeros((p, p)), np.cumsum(lengths)[:-1]
    for left, score in zip(np.split(r, ends), np.split(j / scale * r[:, None], ends), strict=True):
        meat += newey_west(score, correlation_times(left))
    return not_below(inverse @ meat @ inverse * n / max(n - p, 1), white) / np.outer(scale, scale)


@dataclass(frozen=True)
class Estimate:
    """A number with its standard uncertainty, its unit, and how it is distributed.

    Attributes
    ----------
    value, uncertainty : float
        ``uncertainty`` is the standard uncertainty of everything together.
    unit : str
    half_width : float
        Part of it that is uniform (type B), as a half width.
    logarithmic : bool
        Whether its logarithm is normal: then :attr:`factor` says how well it is known.
    """

    value: float
    uncertainty: float
    unit: str = ""
    half_width: float = 0.0
    logarithmic: bool = False

    def __post_init__(self) -> None:
        for name in ("value", "uncertainty", "half_width"):
            object.__setattr__(self, name, float(getattr(self, name)))  # NumPy's numbers would show as such
        if self.uncertainty != self.uncertainty:
            raise ValueError("the data leave a value undetermined: its standard uncertainty would not be a number")
        if not self.uncertainty >= 0:
            raise ValueError(f"a standard uncertainty is zero or more, not {self.uncertainty!r}")

    def __float__(self) -> float:
        return self.value

    def times(self, size: float, error: float = 0.0, unit: str | None = None) -> Estimate:
        """The product with a number of its own standard uncertainty: c = m b."""
        value = self.value * size
        return Estimate(
            value,
            np.hypot(self.uncertainty * size, self.value * error),
            self.unit if unit is None else unit,
            self.half_width * abs(size),
            self.logarithmic,
        )

    @property
    def relative(self) -> float:
        """Standard uncertainty over the value's size."""
        return self.uncertainty / abs(self.value) if self.value else np.inf

    @property
    def expanded(self) -> float:
        """The expanded uncertainty: half the 95 % interval, or its wider side."""
        low, high = self.interval()
        return max(high - self.value, self.value - low)

    @property
    def factor(self) -> float:
        """The factor by which the value is uncertain at 95 %."""
        return self._factor(0.95)

    def _factor(self, level: float) -> float:
        return float(np.exp(coverage_factor(level) * self.relative))

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """The interval that holds the quantity with this probability."""
        if self.logarithmic and self.value > 0:
            factor = self._factor(level)
            return self.value / factor, self.value * factor
        normal = np.sqrt(max(self.uncertainty**2 - self.half_width**2 / 3, 0.0))
        reach = reach_of(float(normal), self.half_width, level)
        return self.value - reach, self.value + reach

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        if self.logarithmic and self.value > 0:
            return f"{self.value:.4g}{unit} within a factor {self.factor:.4g} (95 %)"
        known = 0 < self.uncertainty < np.inf
        digits = max(0, 1 - int(np.floor(np.log10(self.uncertainty)))) if known else 10
        if digits > 9 or abs(self.value) >= 1e6:
            return f"{self.value:.6g} ± {self.uncertainty:.2g}{unit}"
        return f"{self.value:.{digits}f} ± {self.uncertainty:.{digits}f}{unit}"


@dataclass(frozen=True, eq=False)
class Finding:
    """The outcome of one procedure.

    Attributes
    ----------
    name : str
        The quantity, as ``"k"`` or ``"omega_0"``.
    estimate : Estimate
        Also as :attr:`value`, :attr:`uncertainty`, :attr:`interval`.
    method : str
        One sentence: how it was found, with the procedure's source.
    samples_used : int
    runs : tuple of str
        The runs that entered.
    notes : tuple of str
        What a reader should know: what was left out, what the method does not see, what biases it.
    others : mapping of str to Estimate
        What the same fit found besides.
    covariance : array (p, p), optional
        Of :attr:`estimate` and then :attr:`others`, in that order.
    data : xarray.Dataset, optional
        What its picture needs; ``plot`` names the function of ``nonsmooth.plot`` that draws it.
    """

    name: str
    estimate: Estimate
    method: str
    samples_used: int
    runs: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    others: Mapping[str, Estimate] = field(default_factory=dict)
    covariance: Any = None
    data: xr.Dataset | None = None
    plot: str = ""

    @property
    def value(self) -> float:
        """The estimate's value."""
        return self.estimate.value

    @property
    def uncertainty(self) -> float:
        """Its standard uncertainty."""
        return self.estimate.uncertainty

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """The interval that holds the quantity with this probability."""
        return self.estimate.interval(level)

    def to_record(self) -> dict[str, Any]:
        """Return what a file holds of it, as mappings: all but data and covariance."""
        return asdict(replace(self, data=None, covariance=None))

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Finding:
        """Return the finding of such a record; a number may be a text there, as ``"inf"``."""

        def estimate(one: Any) -> Estimate:  # a list in the first files
            return Estimate(**one) if isinstance(one, Mapping) else Estimate(*one)

        read = {
            "estimate": estimate(record["estimate"]),
            "others": {name: estimate(one) for name, one in record["others"].items()},
            **{name: tuple(record[name]) for name in ("runs", "notes")},
        }
        return cls(**{**record, **read})

    def __str__(self) -> str:
        lines = [f"{self.name} = {self.estimate}", f"  {self.method}", f"  from {self.used}"]
        lines += [f"  besides: {name} = {other}" for name, other in self.others.items()]
        return "\n".join(lines + [f"  note: {note}" for note in self.notes])

    def __repr__(self) -> str:
        notes = f"; {len(self.notes)} notes: see .notes" if self.notes else ""
        return f"<Finding {self.name} = {self.estimate}: {cut(self.method, 80)}; from {self.used}{notes}>"

    def _repr_html_(self) -> str:
        rows = [("method", self.method), ("from", self.used)]
        rows += [(f"besides: {name}", str(other)) for name, other in self.others.items()]
        return html_table(f"{self.name} = {self.estimate}", rows, details=self.notes, of="notes")

    @property
    def used(self) -> str:
        """Number of samples, and of runs, in words."""
        return f"{self.samples_used} samples" + (f" of {len(self.runs)} runs" if self.runs else "")
