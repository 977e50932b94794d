"""Orbits and branches as Datasets; ``reading`` takes them back.

The text of the system, the table of signatures and the unknowns of every point stand in the Dataset, so that a branch
read from a file goes on from where it stopped.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.continuation.branches.records import BranchRecord
from nonsmooth.continuation.march.marches import ENDINGS, unless_interrupted
from nonsmooth.continuation.signature.signature import Signature

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.continuation.branches.orbit import Orbit
    from nonsmooth.system.system import System

__all__ = ["branch_dataset", "orbit_dataset", "signature_data"]


def signature_data(signature: Signature) -> list[list[int]]:
    """Visits as lists of integers."""
    return [[v.mode, v.transition, v.row, v.turn] for v in signature.visits]


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
        "sliding": [s.sliding for s in special],
        "bounded": np.array([s.bounded for s in special], dtype=bool),
        "doubled": np.array([s.doubled for s in special], dtype=bool),
        "contact": np.array(
            [np.full(n_mu, np.nan) if s.contact is None else s.contact for s in special], dtype=complex
        ).reshape(len(special), n_mu),
        "determinants": np.array([s.determinants for s in special], dtype=float).reshape(len(special), 4),
    }
    labels = labels_of(system)
    attrs = provenance(labels, "continue_orbit", options, method="multiple shooting")
    attrs["parameter"] = record.parameter
    attrs["layouts"] = json.dumps([signature_data(s) for s in layouts])
    found = branch(
        labels, attrs, record.parameter, np.array([p.value for p in points]), arrays, marks,
        period_number=record.period_number, signatures=texts, endings=list(ENDINGS),
        ended=record.endings, sentences=record.sentences,
    )  # fmt: skip
    return unless_interrupted(found, record.endings)


def orbit_dataset(orbit: Orbit) -> xr.Dataset:
    """An orbit as a Dataset."""
    import xarray as xr

    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance, with_short_record
    from nonsmooth.results.schema import parameter_coords, state_coords

    labels = labels_of(orbit.system)
    attrs: dict[str, Any] = dict(provenance(labels, "find_orbit", orbit.options, method="multiple shooting"))
    attrs["layouts"] = json.dumps([signature_data(orbit.signature)])
    unit = {"units": labels.time_unit}
    names = [*orbit.system.states, *orbit.system.memory]
    variables = {
        "section": ("state", orbit.u, {"long_name": "state at the section"}),
        "memory": ("memory", orbit.memory, {"long_name": "memory at the section"}),
        "maximum": ("state", orbit.maximum, {"long_name": "largest value"}),
        "minimum": ("state", orbit.minimum, {"long_name": "smallest value"}),
        "period": ((), orbit.period, {"long_name": "period", **unit}),
        "period_number": ((), orbit.period_number, {"long_name": f"{labels.turn}s once round (0: autonomous)"}),
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
    return with_short_record(xr.Dataset(variables, coords, attrs))
