"""Orbits, branches and rows of special points read back from their Datasets, and refused where they are damaged.

An index that points nowhere would end in a traceback, a negative one silently in another orbit; so the signatures
are checked against the system, and the unknowns against the signatures.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.continuation.branches.records import BranchRecord, PointRecord, RestRecord, SpecialRecord
from nonsmooth.continuation.events.of_orbits import ENDINGS
from nonsmooth.continuation.problems.signature import AT_ONCE, SECTION, Signature, Visit
from nonsmooth.system.system import System

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.results.branches import Column


@contextmanager
def undamaged(what: str) -> Iterator[None]:
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
    with undamaged(what):
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


def fields_of(dataset: xr.Dataset, table: Sequence[Column], dim: str = "") -> Iterator[dict[str, Any]]:
    """Fields of the records in a result, by the table of its variables, one after the other along a dim."""
    from nonsmooth.results.branches import STEMS
    from nonsmooth.results.schema import typed

    every = []
    for column in table:
        variable = dataset[column.name if column.name in dataset else STEMS[column.name]]
        every.append(typed(column, variable.values if dim in variable.dims else variable.values[None]))
    for values in zip(*every, strict=True):
        yield {
            column.field: value if column.dims else value.item() for column, value in zip(table, values, strict=True)
        }


def read_branch(dataset: xr.Dataset) -> tuple[System, BranchRecord]:
    """The system and the record of a branch.

    Raises
    ------
    ValueError
        A Dataset that is damaged.
    """
    from nonsmooth.results.branches import with_marks_in_place

    source, system = recorded(dataset, "branch")
    with undamaged("branch"):
        name, period_number = str(dataset.attrs["parameter"]), int(dataset["period_number"])
        points = _points(dataset, system, name, period_number)
        if with_marks_in_place(dataset) is not dataset:
            raise ValueError("special points are not where they were: only some of its points are there")
        for mark in marks_of(dataset, system):
            points[_place(mark.point, len(points), "point")].marks.append(mark)
        words = list(ENDINGS)
        endings = [words[_place(int(code), len(words), "ending")] for code in dataset["ended"].values]
        said = [str(text) for text in dataset["ended_because"].values]
        low, high = (float(end) for end in source["options"]["range"])
        if not points or len(endings) != 2 or len(said) != 2:
            raise ValueError("it has no points, or not two ends")
    return system, BranchRecord(points, endings, said, name, (low, high), period_number)


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
    with undamaged("special point"):
        own, period_number = str(start.attrs["parameter"]), int(start["period_number"])
        (point,) = _points(start, system, own, period_number)
        return system, str(start["kind"].values), own, point, period_number, source["options"]["range"]


def hopf_row(start: xr.Dataset) -> tuple[System, str, RestRecord, Any]:
    """System at one Hopf point of ``continue_equilibrium``, the parameter, the equilibrium there, and the range."""
    from nonsmooth.results.branches import EQUILIBRIUM

    source, system = recorded(start, "special point")
    with undamaged("special point"):
        name, (fields,) = str(start.attrs["parameter"]), fields_of(start, EQUILIBRIUM)
        rest = RestRecord(float(start[name]), **fields)
        _place(rest.mode, len(system.modes), "mode")
        if rest.u.shape != (len(system.states),) or not np.isfinite(rest.u).all():
            raise ValueError(f"its equilibrium is {rest.u}")
        return system.with_parameters({name: rest.value}), name, rest, source["options"]["range"]


def layout_attributes(signatures: Iterable[Signature], system: System) -> dict[str, str]:
    """The table of signatures as attributes; of transitions that were found on the way what they are, by number."""
    layouts = [one.data for one in signatures]
    attrs, known = {"layouts": json.dumps(layouts)}, system.traced.known
    if known is not None:
        visits = [Visit(*data) for one in layouts for data in one]
        modes = {v.mode: known.told_mode(v.mode) for v in visits}
        jumps = {v.transition: known.told(v.transition) for v in visits if v.transition != SECTION}
        attrs["visited"] = json.dumps([modes, {k: data for k, data in jumps.items() if data is not None}])
    return attrs


def layouts_of(dataset: xr.Dataset, system: System) -> list[Signature]:
    """The table of signatures, each one a way that the system's transitions allow."""
    known = system.traced.known
    told = ({}, {}) if known is None else json.loads(dataset.attrs.get("visited", "[{}, {}]"))
    modes = {int(k): known.retold_mode(data) for k, data in told[0].items()}
    jumps = {int(k): known.retold(*data) for k, data in told[1].items()}
    traced = system.traced
    found = []
    for data in json.loads(dataset.attrs["layouts"]):
        visits = tuple(Visit(*map(int, visit)) for visit in data)
        visits = tuple(  # with the numbers that modes and transitions have in this process
            replace(v, mode=modes.get(v.mode, v.mode), transition=jumps.get(v.transition, v.transition)) for v in visits
        )
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


def renumbered(dataset: xr.Dataset, system: System) -> xr.Dataset:
    """A branch with the numbers that modes and transitions have in ``system``: those found on the way differ."""
    layouts = layouts_of(dataset, system)
    modes = [layouts[i].visits[0].mode for i in dataset["layout"].values]
    renamed = dataset.assign(mode=dataset["mode"].copy(data=np.array(modes, dtype=dataset["mode"].dtype)))
    return renamed.assign_attrs(layout_attributes(layouts, system))


def _points(dataset: xr.Dataset, system: System, name: str, period_number: int) -> list[PointRecord]:
    """The points of a branch, or the one of a row; each has as many unknowns as its signature."""
    from nonsmooth.results.branches import ORBIT

    layouts, written = layouts_of(dataset, system), json.loads(dataset.attrs["layouts"])
    values, n = np.atleast_1d(dataset[name].values), len(system.states) + len(system.memory)
    found = []
    for value, fields in zip(values, fields_of(dataset, ORBIT, "point"), strict=True):
        layout = _place(fields["layout"], len(layouts), "signature")
        signature = layouts[layout]
        if fields["mode"] != written[layout][0][0]:
            raise ValueError(f"mode {fields['mode']} is not that of its signature")
        known, size = ~np.isnan(fields["X"]), n + len(signature.crossings) * (n + 1) + (1 if period_number else 2)
        if not known[:size].all() or known[size:].any() or not np.isfinite(fields["tangent"][:size]).all():
            raise ValueError(f"a point has not the {size} unknowns of its signature")
        fields |= {"X": fields["X"][:size], "tangent": fields["tangent"][:size], "mode": signature.visits[0].mode}
        found.append(PointRecord(float(value), signature, **fields))
    return found


def marks_of(dataset: xr.Dataset, system: System) -> Iterator[SpecialRecord]:
    """The special points of a branch, or that of a row of it or of `special_points`."""
    from nonsmooth.results.branches import SPECIAL_ORBIT

    for fields in fields_of(dataset, SPECIAL_ORBIT, "special"):
        if fields["indicator"] not in ("", *system.indicators):
            raise ValueError(f"no indicator {fields['indicator']!r}")
        yield SpecialRecord(**fields)


def _place(i: int, n: int, what: str) -> int:
    """An index that is one: a negative one would read something else."""
    if not 0 <= i < n:
        raise ValueError(f"{what} {i} of {n}")
    return i
