"""Files of named arrays: containers with vectors in them become runs and channels.

A container (the file itself, a struct, a group, an element of an array of structs or of a cell) that holds a vector
with the name of the axis is a run; its other vectors of that length, and the columns of its matrices, are the channels.
Text and single numbers beside them are kept as attributes of the run. Units are those that the file gives each array,
or a text ``units`` with one word per vector, separated by commas.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.recordings.readers.fields import Field, FieldTable, label, traces_of
from nonsmooth.recordings.readers.loaders import load
from nonsmooth.recordings.reading import (
    MAX_DEPTH,
    Group,
    Reading,
    is_axis_name,
    names_of,
)

_PICK = re.compile(r"(?P<path>.*?)\((?:(?P<column>:,(?P<k>\d{1,6}))|(?P<row>(?P<j>\d{1,6}),:))\)")
_TOP = "Run #1"


def read(data: bytes, reading: Reading) -> None:
    """Read the arrays of a file."""
    variables, reading.told = load(data, reading)
    if reading.columns is not None:
        reading.traces = list(traces_of(_chosen(variables, reading), reading))
        return
    containers = list(_containers("", variables, 0))
    holds = _is_vector if reading.rate is None else _is_array

    def rated(node: Group) -> bool:
        return bool(node.rate or node.rates)

    vectors = [
        (path, node) for path, node in containers if any(map(_is_array if rated(node) else holds, node.values()))
    ]
    keys = [(path, node, _axis_of(node, reading.axis)) for path, node in vectors]
    found = [(path, node, key) for path, node, key in keys if key is not None or reading.rate or rated(node)]
    if not found:
        names = [f"{path}.{key}".lstrip(".") for path, node in vectors for key, v in node.items() if _is_vector(v)]
        raise reading.error(
            "",
            f"no vector {reading.axis!r} beside others; there are {names_of(names) or 'no vectors at all'}. Name "
            f"them, columns={{{reading.axis!r}: 'data.t', 'x': 'data.x'}}, or give axis= or rate=",
        )
    used = {path for path, _, _ in found}
    for path, _ in vectors:
        if path not in used:
            reading.say(f"{path or 'the file itself'}: holds vectors, but no {reading.axis!r}; left out")
    for path, node, key in found:
        run = node.run or path or _TOP
        notes = {f"note_{name}": text for name, v in node.items() if (text := _note(v))}
        reading.run_attrs.setdefault(run, {}).update(node.notes | notes)
        for part in [node] if key or reading.rate else _by_rate(run, node, reading):
            reading.traces += traces_of(_table(run, path, part, key, reading), reading)
        reading.few(len(reading.traces), "channels")


def _by_rate(run: str, node: Group, reading: Reading) -> list[Group]:
    """The arrays of a container, those of one rate together; one without a rate has that of another of its length."""
    if not node.rates:
        return [node]
    parts = dict[float, Group]()
    arrays = {name: value for name, value in node.items() if _is_array(value)}
    lengths = {max(arrays[name].shape): rate for name, rate in node.rates.items() if name in arrays}
    for name, value in arrays.items():
        if rate := node.rates.get(name) or node.rate or lengths.get(max(value.shape)):
            parts.setdefault(rate, Group({}, node.units, rate))[name] = value
        else:
            reading.of(run, name, "has no rate, and none of the others has its length; left out (give rate=)")
    return list(parts.values())


def _containers(path: str, node: Any, depth: int) -> Iterator[tuple[str, Group]]:
    """Every dict, with its path in MATLAB's notation."""
    if depth > MAX_DEPTH:
        return
    if isinstance(node, dict):
        yield path, node if isinstance(node, Group) else Group(node)
        for name, member in node.items():
            yield from _containers(f"{path}.{name}" if path else name, member, depth + 1)
    elif isinstance(node, list):
        for k, member in enumerate(node, 1):
            yield from _containers(f"{path}({k})", member, depth + 1)


def _axis_of(node: Mapping[str, Any], axis: str) -> str | None:
    """The vector that is the axis, where another array stands beside it."""
    names = [name for name, value in node.items() if _is_vector(value)]
    keys = [name for name in names if name.casefold() == axis]
    keys = keys or [name for name in names if is_axis_name(label(name)[0], axis)]
    return keys[0] if keys and sum(map(_is_array, node.values())) > 1 else None


def _is_array(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.size > 1


def _is_vector(value: Any) -> bool:
    return _is_array(value) and max(value.shape) == value.size


def _note(value: Any) -> str:
    if isinstance(value, str):
        return value[:1000]
    return str(value.ravel()[0]) if isinstance(value, np.ndarray) and value.size == 1 else ""


def _table(run: str, path: str, node: Group, key: str | None, reading: Reading) -> FieldTable:
    arrays = {name: value for name, value in node.items() if _is_array(value)}
    units = _units(node, list(arrays), reading, run)
    lengths = [v.size for v in arrays.values() if _is_vector(v)] or [max(v.shape) for v in arrays.values()]
    n = max(set(lengths), key=lengths.count) if key is None else arrays[key].size
    fields = []
    for name, value in arrays.items():
        origin = f"{path}.{name}".lstrip(".")
        said, unit = label(name)
        columns = _columns(value, n)
        if columns is None:
            misfit = f"has the shape {value.shape}, which does not fit the {n} of {reading.axis}; left out"
            reading.of(run, name, misfit)
        elif value.dtype.kind not in "biufc" and name != key:
            reading.of(run, name, f"holds {value.dtype} values, no numbers; left out")
        else:
            ours = reading.axis if name == key else said if unit else name
            for k, column in enumerate(columns, 1):
                number = f"({k})" if len(columns) > 1 else ""
                attrs = node.attrs.get(name, {})
                fields.append(Field(ours + number, units.get(name, "") or unit, column, origin + number, attrs=attrs))
    return FieldTable(run, fields, n, rate=node.rate)


def _columns(value: NDArray[Any], n: int) -> list[NDArray[Any]] | None:
    if value.size == n and max(value.shape) == n:
        return [value.ravel()]
    if value.ndim == 2 and n in value.shape:
        return list(value.T if value.shape[0] == n else value)
    return None


def _units(node: Group, names: list[str], reading: Reading, run: str) -> dict[str, str]:
    if node.units:
        return node.units
    text = next((v for name, v in node.items() if name.casefold() in ("units", "unit") and isinstance(v, str)), "")
    words = [word.strip() for word in text.split(",")]
    if not text:
        return {}
    if len(words) != len(names):
        reading.say(f"run {run!r}: units are {text[:80]!r}, which is not one for each of {names_of(names)}; not used")
        return {}
    return dict(zip(names, words, strict=True))


def _chosen(variables: Mapping[str, Any], reading: Reading) -> FieldTable:
    """The channels that ``columns`` names by path: ``"data.x"``, ``"runs(2).x"``, ``"M(:,3)"``."""
    held = {
        f"{path}.{name}".lstrip("."): (value, node.units.get(name, ""), node.rates.get(name, node.rate))
        for path, node in _containers("", variables, 0)
        for name, value in node.items()
        if _is_array(value)
    }
    arrays = {path: value for path, (value, *_) in held.items()}
    fields, taken = [], dict[float, str]()
    for ours, theirs in (reading.columns or {}).items():
        wanted, unit = theirs if isinstance(theirs, tuple) else (theirs, None)
        path, values = _pick(wanted, arrays, reading)
        _, own, rate = held[path]
        if rate:
            taken.setdefault(rate, path)
        fields.append(Field(ours, own if unit is None else unit, values, str(wanted)))
    axis = next((field for field in fields if field.name == reading.axis), None)
    if axis is None and reading.rate is None and len(taken) > 1:
        each = ", ".join(f"{path!r} at {rate:g} Hz" for rate, path in taken.items())
        raise reading.error("", f"columns names arrays of several rates, {each}; choose those of one, or leave it out")
    rate = reading.rate or next(iter(taken), None)
    if axis is None and rate is None:
        raise reading.error("", f"columns names no {reading.axis!r}; add it, or give the sample rate in Hz, rate=...")
    n = len((axis or fields[0]).values)
    for field in fields:
        if len(field.values) != n:
            raise reading.error(field.origin, f"has {len(field.values)} values, the {reading.axis} has {n}")
    return FieldTable(_TOP, fields, n, rate=rate)


def _pick(wanted: str | int, arrays: Mapping[str, NDArray[Any]], reading: Reading) -> tuple[str, NDArray[Any]]:
    """The path of an array, and the vector that it is or that is chosen of it."""
    path = list(arrays)[wanted] if isinstance(wanted, int) and 0 <= wanted < len(arrays) else str(wanted)
    if path in arrays and _is_vector(arrays[path]):
        return path, arrays[path].ravel()
    match = _PICK.fullmatch(path)
    if match and (whole := arrays.get(match["path"])) is not None and whole.ndim == 2:
        table, k = whole if match["column"] else whole.T, int(match["k"] or match["j"])
        if 1 <= k <= table.shape[1]:
            return match["path"], table[:, k - 1]
    shown = [f"{name} {value.shape}" for name, value in arrays.items()]
    raise reading.error("", f"no vector {path!r}; there are {names_of(shown)} (columns of a matrix as 'M(:,2)')")
