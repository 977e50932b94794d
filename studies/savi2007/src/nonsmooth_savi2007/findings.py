"""Findings of identification as datasets that stand by themselves: the picture's data, and what was found, as text."""

from __future__ import annotations

import json

import xarray as xr

from nonsmooth import ParameterSet
from nonsmooth.identification import Finding
from nonsmooth_savi2007.laboratory import as_result


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
    result = as_result(data, finding.name, "identify", synthetic=data.attrs.get("synthetic") == "yes")
    return result.assign_attrs(finding=json.dumps(finding.to_record(), ensure_ascii=False, default=float))


def found_in(data: xr.Dataset) -> Finding:
    """Read back what :func:`kept` put into the dataset."""
    return Finding.from_record(json.loads(data.attrs["finding"]))
