"""Outcome of one procedure: a value, its standard uncertainty, how, and from which samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.identification.uncertainty import factor_interval, interval
from nonsmooth.results.representation import cut, html_table

if TYPE_CHECKING:
    import xarray as xr


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
            float(np.hypot(self.uncertainty * size, self.value * error)),
            self.unit if unit is None else unit,
            self.half_width * abs(size),
            self.logarithmic,
        )

    @property
    def relative(self) -> float:
        """Standard uncertainty over the value's size."""
        return self.uncertainty / abs(self.value) if self.value else float("inf")

    @property
    def factor(self) -> float:
        """The factor by which the value is uncertain at 95 %."""
        return factor_interval(self.value, self.relative)[2]

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """The interval that holds the quantity with this probability."""
        if self.logarithmic and self.value > 0:
            return factor_interval(self.value, self.relative, level)[:2]
        normal = np.sqrt(max(self.uncertainty**2 - self.half_width**2 / 3, 0.0))
        return interval(self.value, float(normal), self.half_width, level)

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        if self.logarithmic and self.value > 0:
            return f"{self.value:.4g}{unit} within a factor {self.factor:.4g} (95 %)"
        if not 0 < self.uncertainty < np.inf:
            return f"{self.value:.6g} ± {self.uncertainty:.2g}{unit}"
        digits = max(0, 1 - int(np.floor(np.log10(self.uncertainty))))
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

    def __str__(self) -> str:
        lines = [f"{self.name} = {self.estimate}", f"  {self.method}", f"  from {self._used()}"]
        lines += [f"  besides: {name} = {other}" for name, other in self.others.items()]
        return "\n".join(lines + [f"  note: {note}" for note in self.notes])

    def __repr__(self) -> str:
        notes = f"; {len(self.notes)} notes: see .notes" if self.notes else ""
        return f"<Finding {self.name} = {self.estimate}: {cut(self.method, 80)}; from {self._used()}{notes}>"

    def _repr_html_(self) -> str:
        rows = [("method", self.method), ("from", self._used())]
        rows += [(f"besides: {name}", str(other)) for name, other in self.others.items()]
        return html_table(f"{self.name} = {self.estimate}", rows, details=self.notes, of="notes")

    def _used(self) -> str:
        return f"{self.samples_used} samples" + (f" of {len(self.runs)} runs" if self.runs else "")
