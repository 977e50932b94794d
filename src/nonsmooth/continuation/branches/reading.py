"""Orbits, branches and rows of special points read back from their Datasets, and refused where they are damaged.

An index that points nowhere would end in a traceback, a negative one silently in another orbit; so the signatures
are checked against the system, and the unknowns against the signatures.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.branches.records import BranchRecord, PointRecord, SpecialRecord
from nonsmooth.continuation.march.marches import ENDINGS
from nonsmooth.continuation.signature.signature import AT_ONCE, SECTION, Signature, Visit

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.continuation.branches.orbit import Orbit
    from nonsmooth.system.system import System

__all__ = ["hopf_row", "one_row", "read_branch", "read_orbit", "recorded", "special_row"]

#: What is read of one point, beside its parameter.
_POINT = ("layout", "unknowns", "tangent", "mode", "section", "maximum", "minimum", "period", "floquet_multipliers",
          "stable", "clearance", "virtual")  # fmt: skip


@contextmanager
def _undamaged(what: str) -> Iterator[None]:
    """Turn what is missing or does not fit together into one sentence."""
    try:
        yield
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        raise ValueError(
            f"this {what} is damaged and cannot be read back ({type(error).__name__}: {error}); load its file again, "
            "or compute it anew"
        ) from error


def recorded(dataset: xr.Dataset, what: str) -> tuple[dict[str, Any], System]:
    """The record of how a result was made, and its system at the parameters of the record."""
    from nonsmooth.results.provenance import read_provenance
    from nonsmooth.system.origin import recorded_system

    if not hasattr(dataset, "data_vars"):
        raise TypeError(f"this {what} is read from its Dataset, not from {type(dataset).__name__}")
    source = read_provenance(dataset)
    with _undamaged(what):
        system = recorded_system(source)
    return source, system


def one_row(start: xr.Dataset, verb: str) -> xr.Dataset:
    """The one row of a table of special points.

    Raises
    ------
    ValueError
        Several rows, or none.
    """
    if "special" not in start.dims:
        return start
    if start.sizes["special"] != 1:
        raise ValueError(
            f"{verb} takes one special point, not {start.sizes['special']}: choose it, "
            "special_points(branch).isel(special=0)"
        )
    return start.isel(special=0)


def read_branch(dataset: xr.Dataset) -> tuple[System, BranchRecord]:
    """The system and the record of a branch.

    Raises
    ------
    ValueError
        A Dataset that is damaged.
    """
    source, system = recorded(dataset, "branch")
    with _undamaged("branch"):
        name, period_number = str(dataset.attrs["parameter"]), int(dataset["period_number"])
        layouts = _layouts(dataset, system)
        columns = {key: dataset[key].values for key in (name, *_POINT)}
        points = [
            _point(system, layouts, period_number, name, {key: column[i] for key, column in columns.items()})
            for i in range(dataset.sizes["point"])
        ]
        special = [_special(dataset.isel(special=i), system, len(points)) for i in range(dataset.sizes["special"])]
        words = list(ENDINGS)
        first, last = (words[_place(int(code), len(words), "ending")] for code in dataset["ended"].values)
        begun, ended = (str(text) for text in dataset["ended_because"].values)
        low, high = (float(end) for end in source["options"]["range"])
        if not points:
            raise ValueError("it has no points")
    return system, BranchRecord(name, (low, high), period_number, points, special, (first, last), (begun, ended))


def read_orbit(dataset: xr.Dataset) -> Orbit:
    """Read ``files.orbit_dataset`` back.

    Raises
    ------
    ValueError
        A result of another verb, or one that is damaged.
    """
    from nonsmooth.continuation.branches.orbit import Orbit

    source, system = recorded(dataset, "orbit")
    if source["verb"] != "find_orbit":
        raise ValueError(f"this Dataset was made by {source['verb']!r}; Orbit.from_dataset reads those of find_orbit")

    def get(name: str) -> Any:
        return dataset[name].values

    with _undamaged("orbit"):
        (signature,) = _layouts(dataset, system)
        n = len(system.states) + len(system.memory)
        return Orbit(
            system=system, u=get("section"), mode=str(get("mode")), memory=get("memory"), period=float(get("period")),
            period_number=int(get("period_number")), signature=signature, crossing_times=get("crossing_time"),
            crossing_states=get("crossing_state").reshape(len(signature.crossings), n),
            monodromy_matrix=get("monodromy_matrix"), floquet_multipliers=get("floquet_multipliers"),
            stable=bool(get("stable")), maximum=get("maximum"), minimum=get("minimum"),
            clearance={str(k): float(v) for k, v in zip(dataset["indicator"].values, get("clearance"), strict=True)},
            virtual=bool(get("virtual")), options=source["options"],
        )  # fmt: skip


def special_row(start: Any, verb: str) -> tuple[System, str, str, PointRecord, int, Any]:
    """One row of ``special_points`` as data: system, kind, parameter, point, period number and the branch's range.

    Raises
    ------
    TypeError, ValueError
        Something else, several rows, or a row that is damaged.
    """
    if not hasattr(start, "data_vars") or "kind" not in start:
        raise TypeError(f"{verb} takes one row of special_points, not {type(start).__name__}")
    if "unknowns" not in start:
        raise TypeError(f"{verb} takes a special point of orbits (of continue_orbit), not one of equilibria")
    start = one_row(start, verb)
    source, system = recorded(start, "special point")
    with _undamaged("special point"):
        own, period_number = str(start.attrs["parameter"]), int(start["period_number"])
        row = {key: start[key].values for key in (own, *_POINT)}
        point = _point(system, _layouts(start, system), period_number, own, row)
        return system, str(start["kind"].values), own, point, period_number, source["options"]["range"]


def hopf_row(start: xr.Dataset) -> tuple[System, str, float, int, FloatArray, tuple[float, float]]:
    """System, parameter, its value, mode, equilibrium and range of one Hopf point of ``continue_equilibrium``."""
    source, system = recorded(start, "special point")
    with _undamaged("special point"):
        name = str(start.attrs["parameter"])
        value, mode = float(start[name]), _place(int(start["mode"]), len(system.modes), "mode")
        u = np.asarray(start["u"].values, dtype=float)
        low, high = (float(end) for end in source["options"]["range"])
        if u.shape != (len(system.states),) or not np.isfinite(u).all():
            raise ValueError(f"its equilibrium is {u}")
    return system.with_parameters({name: value}), name, value, mode, u, (low, high)


def _layouts(dataset: xr.Dataset, system: System) -> list[Signature]:
    """The table of signatures, each one a way that the system's transitions allow."""
    traced = system.traced
    found = []
    for data in json.loads(dataset.attrs["layouts"]):
        visits = tuple(Visit(*map(int, visit)) for visit in data)
        for here, after in pairwise(visits):
            jump = traced.transitions[_place(here.transition, len(traced.transitions), "transition")]
            rows = (-1,) if jump.at is not None else (AT_ONCE, *range(len(jump.rows)))
            if jump.source != here.mode or jump.target != after.mode or here.row not in rows:
                raise ValueError(f"no transition of {system.name!r} ends the visit {here}")
        if visits[-1].transition != SECTION or visits[-1].row != -1:
            raise ValueError(f"the last visit, {visits[-1]}, does not end at the section")
        _place(visits[0].mode, len(traced.mode_names), "mode")
        found.append(Signature(visits))
    return found


def _point(
    system: System, layouts: list[Signature], period_number: int, name: str, row: Mapping[str, Any]
) -> PointRecord:
    """One point of a branch, whose unknowns are as many as its signature has."""
    signature = layouts[_place(int(row["layout"]), len(layouts), "signature")]
    known = ~np.isnan(row["unknowns"])
    n = len(system.states) + len(system.memory)
    size = n + len(signature.crossings) * (n + 1) + (1 if period_number else 2)
    if not known[:size].all() or known[size:].any() or not np.isfinite(row["tangent"][:size]).all():
        raise ValueError(f"a point has not the {size} unknowns of its signature")
    return PointRecord(
        float(row[name]), signature, row["unknowns"][:size], row["tangent"][:size],
        _place(int(row["mode"]), len(system.modes), "mode"), row["section"], row["maximum"], row["minimum"],
        float(row["period"]), row["floquet_multipliers"], bool(row["stable"]), row["clearance"], bool(row["virtual"]),
    )  # fmt: skip


def _special(row: xr.Dataset, system: System, points: int) -> SpecialRecord:
    def get(name: str) -> Any:
        return row[f"special_{name}"].values

    contact = get("contact_multipliers")
    return SpecialRecord(
        str(get("kind")), _place(int(get("point")), points, "point"),
        ["", *system.indicators].index(str(get("indicator"))) - 1, str(get("grazing")), str(get("sliding")),
        bool(get("bounded")), bool(get("doubled")), None if np.isnan(contact).all() else contact, get("determinant"),
    )  # fmt: skip


def _place(i: int, n: int, what: str) -> int:
    """An index that is one: a negative one would read something else."""
    if not 0 <= i < n:
        raise ValueError(f"{what} {i} of {n}")
    return i
