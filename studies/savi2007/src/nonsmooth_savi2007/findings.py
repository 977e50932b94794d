"""Findings of identification as datasets that stand by themselves: the picture's data, and what was found, as text."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

import xarray as xr

from nonsmooth import ParameterSet
from nonsmooth.identification import Estimate, Finding
from nonsmooth_savi2007.laboratory import as_result
from nonsmooth_savi2007.measure import with_uncertainty


@dataclass(frozen=True)
class Number:
    """A value with its standard uncertainty and its 95 % interval."""

    value: float
    uncertainty: float
    low: float
    high: float
    unit: str

    @property
    def expanded(self) -> float:
        """The expanded uncertainty: half the 95 % interval; where it is not even, the wider side counts."""
        return max(self.high - self.value, self.value - self.low)

    def times(self, factor: float, unit: str = "") -> Number:
        """The number in another unit."""
        low, high = sorted((self.low * factor, self.high * factor))
        return Number(self.value * factor, self.uncertainty * abs(factor), low, high, unit or self.unit)

    def __str__(self) -> str:
        return f"{with_uncertainty(self.value, self.uncertainty)} {self.unit}".rstrip()


@dataclass(frozen=True)
class Found:
    """Outcome of one procedure: its number, what came with it, and what there is to say."""

    name: str
    number: Number
    others: Mapping[str, Number]
    method: str
    notes: tuple[str, ...]
    samples: int
    runs: int


def the_finding(identified: ParameterSet, name: str) -> Finding:
    """The finding of that name; ValueError where the session did not tell it."""
    for finding in identified.findings:
        if finding.name == name:
            return finding
    known = ", ".join(finding.name for finding in identified.findings)
    raise ValueError(f"identification made no finding {name!r}; it made: {known}")


def kept(finding: Finding) -> xr.Dataset:
    """The finding's data for its picture, with the finding itself in the attribute ``finding``."""
    data = xr.Dataset(attrs={"synthetic": "yes"}) if finding.data is None else finding.data.copy()
    record = {
        "name": finding.name,
        "number": _plain(finding.estimate),
        "method": finding.method,
        "others": {name: _plain(other) for name, other in finding.others.items()},
        "notes": list(finding.notes),
        "samples": finding.samples_used,
        "runs": len(finding.runs),
    }
    result = as_result(data, finding.name, "identify", synthetic=data.attrs.get("synthetic") == "yes")
    return result.assign_attrs(finding=json.dumps(record, ensure_ascii=False))


def found_in(data: xr.Dataset) -> Found:
    """Read back what :func:`kept` put into the dataset."""
    record = json.loads(data.attrs["finding"])
    others = {name: Number(*row) for name, row in record["others"].items()}
    return Found(
        record["name"],
        Number(*record["number"]),
        others,
        record["method"],
        tuple(record["notes"]),
        record["samples"],
        record["runs"],
    )


def estimates_of(dataset: xr.Dataset) -> dict[str, Number]:
    """All parameters of a saved ``ParameterSet``, with their 95 % intervals."""

    found = ParameterSet.from_dataset(dataset)
    rows = {**found.estimates, **found.extra}
    return {name: Number(*_plain(row)) for name, row in rows.items()}


def _plain(estimate: Estimate) -> tuple[float, float, float, float, str]:
    low, high = estimate.interval()
    return float(estimate.value), float(estimate.uncertainty), float(low), float(high), estimate.unit
