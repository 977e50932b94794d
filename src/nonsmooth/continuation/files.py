"""Orbits and branches as Datasets, and back.

The text of the system, the table of signatures and the unknowns of every point stand in the Dataset, so that a branch
read from a file goes on from where it stopped.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.continuation.marches import ENDINGS
from nonsmooth.continuation.records import BranchRecord, PointRecord, SpecialRecord
from nonsmooth.continuation.signature import Signature, Visit

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.continuation.orbit import Orbit
    from nonsmooth.system.system import System

__all__ = ["branch_dataset", "orbit_dataset", "read_branch", "read_orbit", "signature_data", "signature_from",
           "special_row"]  # fmt: skip


def signature_data(signature: Signature) -> list[list[int]]:
    """Visits as lists of integers."""
    return [[v.mode, v.transition, v.row, v.turn] for v in signature.visits]


def signature_from(data: Any) -> Signature:
    """Read `signature_data` back."""
    return Signature(tuple(Visit(*map(int, visit)) for visit in data))


def branch_dataset(system: System, record: BranchRecord, options: dict[str, Any]) -> xr.Dataset:
    """The branch as a Dataset with the dims ``point``, ``state``, ``multiplier``, ``special``, ``unknown``, ``end``."""
    from nonsmooth.results.branches import branch
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance

    traced = system.traced
    points, special = record.points, record.special
    layouts: dict[Signature, int] = {}
    cycles: dict[Any, int] = {}
    texts: list[str] = []
    for point in points:
        layouts.setdefault(point.signature, len(layouts))
        if point.signature.cycle not in cycles:
            cycles[point.signature.cycle] = len(cycles)
            texts.append(point.signature.text(traced))
    width = max(len(point.X) for point in points)
    unknowns, tangents = np.full((len(points), width), np.nan), np.full((len(points), width), np.nan)
    for i, point in enumerate(points):
        unknowns[i, : len(point.X)] = point.X
        tangents[i, : len(point.tangent)] = point.tangent
    jumps = traced.transitions
    contacts = {s: sum(jumps[v.transition].contact for v in s.crossings) for s in layouts}
    turns = max(record.period_number, 1)
    n_mu = len(points[0].multipliers)
    arrays = {
        "section": np.array([p.section for p in points]),
        "maximum": np.array([p.maximum for p in points]),
        "minimum": np.array([p.minimum for p in points]),
        "period": np.array([p.period for p in points]),
        "floquet_multipliers": np.array([p.multipliers for p in points]),
        "stable": np.array([p.stable for p in points]),
        "virtual": np.array([p.virtual for p in points]),
        "signature": np.array([cycles[p.signature.cycle] for p in points]),
        "mode": np.array([p.mode for p in points]),
        "crossings_per_period": np.array([len(p.signature.crossings) / turns for p in points]),
        "contacts_per_period": np.array([contacts[p.signature] / turns for p in points]),
        "clearance": np.array([p.clearance for p in points]).reshape(len(points), len(system.indicators)),
        "layout": np.array([layouts[p.signature] for p in points]),
        "unknowns": unknowns,
        "tangent": tangents,
    }
    names = ["", *system.indicators]
    marks = {
        "kind": [s.kind for s in special],
        "place": np.array([s.place for s in special], dtype=np.int64),
        "indicator": [names[s.indicator + 1] for s in special],
        "grazing": [s.grazing for s in special],
        "bounded": np.array([s.bounded for s in special], dtype=bool),
        "doubled": np.array([s.doubled for s in special], dtype=bool),
        "contact": np.array([np.full(n_mu, np.nan + 0j) if s.contact is None else s.contact for s in special]).reshape(
            len(special), n_mu
        ),
        "determinants": np.array([s.determinants for s in special]).reshape(len(special), 4),
    }
    labels = labels_of(system)
    attrs = provenance(labels, "continue_orbit", options, method="multiple shooting")
    attrs["parameter"] = record.parameter
    attrs["layouts"] = json.dumps([signature_data(s) for s in layouts])
    return branch(
        labels, attrs, record.parameter, np.array([p.value for p in points]), arrays, marks,
        period_number=record.period_number, signatures=texts, endings=list(ENDINGS),
        ended=record.endings, sentences=record.sentences,
    )  # fmt: skip


def read_branch(dataset: xr.Dataset) -> tuple[System, BranchRecord]:
    """The system and the record of a branch."""
    from nonsmooth.results.provenance import read_provenance
    from nonsmooth.system.system import System

    source = read_provenance(dataset)
    system = System.from_text(source["system"]["text"]).with_parameters(source["system"]["parameters"])
    name = str(dataset.attrs["parameter"])
    layouts = [signature_from(data) for data in json.loads(dataset.attrs["layouts"])]
    indicators = ["", *system.indicators]
    get = {key: dataset[key].values for key in (
        name, "layout", "unknowns", "tangent", "mode", "section", "maximum", "minimum", "period",
        "floquet_multipliers", "stable", "clearance", "virtual",
    )}  # fmt: skip
    points = []
    for i in range(dataset.sizes["point"]):
        known = ~np.isnan(get["unknowns"][i])
        points.append(
            PointRecord(
                float(get[name][i]), layouts[int(get["layout"][i])], get["unknowns"][i][known],
                get["tangent"][i][known], int(get["mode"][i]), get["section"][i], get["maximum"][i],
                get["minimum"][i], float(get["period"][i]), get["floquet_multipliers"][i], bool(get["stable"][i]),
                get["clearance"][i], bool(get["virtual"][i]),
            )
        )  # fmt: skip
    special = [
        SpecialRecord(
            str(dataset["special_kind"].values[i]), int(dataset["special_point"].values[i]),
            indicators.index(str(dataset["special_indicator"].values[i])) - 1,
            str(dataset["special_grazing"].values[i]), bool(dataset["special_bounded"].values[i]),
            bool(dataset["special_doubled"].values[i]),
            None if np.isnan(dataset["special_contact_multipliers"].values[i]).all()
            else dataset["special_contact_multipliers"].values[i],
            dataset["special_determinant"].values[i],
        )
        for i in range(dataset.sizes["special"])
    ]  # fmt: skip
    words = list(ENDINGS)
    ended = dataset["ended"].values
    sentences = dataset["ended_because"].values
    low, high = source["options"]["range"]
    return system, BranchRecord(
        name, (float(low), float(high)), int(dataset["period_number"]), points, special,
        (words[int(ended[0])], words[int(ended[1])]), (str(sentences[0]), str(sentences[1])),
    )  # fmt: skip


def orbit_dataset(orbit: Orbit) -> xr.Dataset:
    """An orbit as a Dataset."""
    import xarray as xr

    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance
    from nonsmooth.results.schema import parameter_coords, state_coords

    labels = labels_of(orbit.system)
    attrs: dict[str, Any] = dict(provenance(labels, "find_orbit", {}, method="multiple shooting"))
    attrs["layouts"] = json.dumps([signature_data(orbit.signature)])
    unit = {"units": labels.time_unit}
    names = [*orbit.system.states, *orbit.system.memory]
    variables = {
        "section": ("state", orbit.u, {"long_name": "state at the section"}),
        "memory": ("memory", orbit.memory, {"long_name": "memory at the section"}),
        "maximum": ("state", orbit.maximum, {"long_name": "largest value"}),
        "minimum": ("state", orbit.minimum, {"long_name": "smallest value"}),
        "period": ((), orbit.period, {"long_name": "period", **unit}),
        "period_number": ((), orbit.period_number, {"long_name": "forcing periods once round (0: autonomous)"}),
        "mode": ((), orbit.mode, {"long_name": "mode at the section"}),
        "crossing_time": ("crossing", orbit.crossing_times, {"long_name": "time of the crossing", **unit}),
        "crossing_state": (
            ("crossing", "component"), orbit.crossing_states, {"long_name": "state and memory after the crossing"}
        ),
        "monodromy_matrix": (("component", "column"), orbit.monodromy_matrix, {"long_name": "monodromy matrix"}),
        "floquet_multipliers": ("multiplier", orbit.floquet_multipliers, {"long_name": "Floquet multipliers"}),
        "stable": ((), orbit.stable, {"long_name": "stable"}),
        "virtual": ((), orbit.virtual, {"long_name": "the path goes through a boundary"}),
        "clearance": (
            "indicator", np.array(list(orbit.clearance.values()), dtype=float), {"long_name": "clearance"}
        ),
    }  # fmt: skip
    coords = {
        **state_coords(labels), **parameter_coords(labels),
        "component": ("component", np.array(names, dtype=str)), "column": ("column", np.array(names, dtype=str)),
        "indicator": ("indicator", np.array(list(orbit.clearance), dtype=str)),
    }  # fmt: skip
    return xr.Dataset(variables, coords, attrs)


def read_orbit(dataset: xr.Dataset) -> Orbit:
    """Read `orbit_dataset` back."""
    from nonsmooth.continuation.orbit import Orbit
    from nonsmooth.results.provenance import read_provenance
    from nonsmooth.system.system import System

    source = read_provenance(dataset)
    if source["verb"] != "find_orbit":
        raise ValueError(f"this Dataset was made by {source['verb']!r}; Orbit.from_dataset reads those of find_orbit")
    system = System.from_text(source["system"]["text"]).with_parameters(source["system"]["parameters"])

    def get(name: str) -> Any:
        return dataset[name].values

    signature = signature_from(json.loads(dataset.attrs["layouts"])[0])
    n = len(system.states) + len(system.memory)
    return Orbit(
        system=system, u=get("section"), mode=str(get("mode")), memory=get("memory"), period=float(get("period")),
        period_number=int(get("period_number")), signature=signature, crossing_times=get("crossing_time"),
        crossing_states=get("crossing_state").reshape(-1, n), monodromy_matrix=get("monodromy_matrix"),
        floquet_multipliers=get("floquet_multipliers"), stable=bool(get("stable")), maximum=get("maximum"),
        minimum=get("minimum"),
        clearance={str(k): float(v) for k, v in zip(dataset["indicator"].values, get("clearance"), strict=True)},
        virtual=bool(get("virtual")),
    )  # fmt: skip


def special_row(start: Any, verb: str) -> tuple[System, str, str, PointRecord, int, Any]:
    """One row of ``special_points`` as data: system, kind, parameter, point, period number and the branch's range."""
    from nonsmooth.results.provenance import read_provenance
    from nonsmooth.system.system import System

    if not hasattr(start, "data_vars") or "kind" not in start or "unknowns" not in start:
        raise TypeError(f"{verb} takes one row of special_points, not {type(start).__name__}")
    if "special" in start.dims:
        if start.sizes["special"] != 1:
            raise ValueError(
                f"{verb} takes one special point, not {start.sizes['special']}: choose it, "
                "special_points(branch).isel(special=0)"
            )
        start = start.isel(special=0)
    source = read_provenance(start)
    system = System.from_text(source["system"]["text"]).with_parameters(source["system"]["parameters"])
    own = str(start.attrs["parameter"])
    signature = signature_from(json.loads(start.attrs["layouts"])[int(start["layout"])])
    X = start["unknowns"].values
    known = ~np.isnan(X)
    point = PointRecord(
        float(start[own]), signature, X[known], start["tangent"].values[known], int(start["mode"]),
        start["section"].values, start["maximum"].values, start["minimum"].values, float(start["period"]),
        start["floquet_multipliers"].values, bool(start["stable"]), start["clearance"].values,
    )  # fmt: skip
    return system, str(start["kind"].values), own, point, int(start["period_number"]), source["options"]["range"]
