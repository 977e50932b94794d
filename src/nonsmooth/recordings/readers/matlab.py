"""MATLAB files: structs and cells with vectors in them become runs and channels.

A container (the file itself, a struct, an element of an array of structs or of a cell) that holds a vector with the
name of the axis is a run; its other vectors of that length, and the columns of its matrices, are the channels. Text
and single numbers beside them are kept as attributes of the run. A text ``units`` with one word per vector, separated
by commas, gives their units in order.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings.limits import MAX_COLUMNS, MAX_DEPTH
from nonsmooth.recordings.readers.matlab_v5 import load_v5
from nonsmooth.recordings.readers.matlab_v73 import load_v73
from nonsmooth.recordings.reading import Options, Reading, Source, Trace, is_axis_name, names_of, scaled_time
from nonsmooth.recordings.remarks import Remarks

__all__ = ["read"]

_PICK = re.compile(r"(?P<path>.*?)\((?:(?P<column>:,(?P<k>\d{1,6}))|(?P<row>(?P<j>\d{1,6}),:))\)")
_TOP = "Run #1"


def read(data: bytes, source: Source, options: Options) -> Reading:
    """Read a MATLAB file."""
    reading = Reading()
    is_hdf5 = data.startswith(b"\x89HDF") or data[512:516] == b"\x89HDF"
    variables = (load_v73 if is_hdf5 else load_v5)(data, source, reading.remarks)
    # An HDF5 file that another program wrote has no text before its own mark.
    text = b"" if data.startswith(b"\x89HDF") else data[:116].split(b"\0")[0]
    reading.header = {"version": "7.3" if is_hdf5 else "5", "text": text.decode("ascii", "replace")}
    if options.columns is not None:
        reading.traces = list(_chosen(variables, options, source, reading.remarks))
        return reading
    containers = [(path, node) for path, node in _containers("", variables, 0)]
    found: list[tuple[str, Mapping[str, Any], str | None]] = [
        (path, node, key) for path, node in containers if (key := _axis_of(node, options.axis)) is not None
    ]
    vectors = [(path, node) for path, node in containers if any(_is_vector(v) for v in node.values())]
    if options.rate is not None:
        found = [(path, node, None) for path, node in vectors]
    if not found:
        names = [f"{path}.{key}".lstrip(".") for path, node in vectors for key, v in node.items() if _is_vector(v)]
        raise source.error(
            "",
            f"no vector {options.axis!r} beside others; there are {names_of(names) or 'no vectors at all'}. Name "
            f"them, columns={{{options.axis!r}: 'data.t', 'x': 'data.x'}}, or give axis= or rate=",
        )
    used = {path for path, _, _ in found}
    for path, _ in vectors:
        if path not in used:
            reading.remarks.say(f"{path or 'the file itself'}: holds vectors, but no {options.axis!r}; left out")
    for path, node, key in found:
        run = path or _TOP
        notes = {name: _note(v) for name, v in node.items() if _note(v)}
        reading.run_attrs[run] = {f"note_{name}": text for name, text in notes.items()}
        reading.traces += _traces(run, path, node, key, options, source, reading.remarks)
        if len(reading.traces) > MAX_COLUMNS:
            raise source.error("", f"holds more than {MAX_COLUMNS} channels")
    return reading


def _containers(path: str, node: Any, depth: int) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Every dict, with its path in MATLAB's notation."""
    if depth > MAX_DEPTH:
        return
    if isinstance(node, dict):
        yield path, node
        for name, member in node.items():
            yield from _containers(f"{path}.{name}" if path else name, member, depth + 1)
    elif isinstance(node, list):
        for k, member in enumerate(node, 1):
            yield from _containers(f"{path}({k})", member, depth + 1)


def _axis_of(node: Mapping[str, Any], axis: str) -> str | None:
    """The vector that is the axis, where another array stands beside it."""
    names = [name for name, value in node.items() if _is_vector(value)]
    keys = [name for name in names if name.casefold() == axis] or [name for name in names if is_axis_name(name, axis)]
    return keys[0] if keys and sum(_is_numbers(v) and v.size > 1 for v in node.values()) > 1 else None


def _is_numbers(value: Any) -> bool:
    return isinstance(value, np.ndarray)


def _is_vector(value: Any) -> bool:
    return _is_numbers(value) and value.size > 1 and max(value.shape) == value.size


def _note(value: Any) -> str:
    if isinstance(value, str):
        return value[:1000]
    return str(value.ravel()[0]) if _is_numbers(value) and value.size == 1 else ""


def _traces(
    run: str, path: str, node: Mapping[str, Any], key: str | None, options: Options, source: Source, remarks: Remarks
) -> Iterator[Trace]:
    arrays = {name: value for name, value in node.items() if _is_numbers(value) and value.size > 1}
    units = _units(node, list(arrays), remarks, run)
    if key is None:
        lengths = [v.size for v in arrays.values() if _is_vector(v)]
        n = max(set(lengths), key=lengths.count)
        axis, unit = np.arange(n) / float(options.rate or 1), "s"
    else:
        axis, unit = _real(arrays[key], f"{path}.{key}".lstrip("."), source).ravel(), units.get(key, "")
        if options.axis == "time":
            axis, unit = _seconds(axis, unit, run, key, source, remarks)
    for name, value in arrays.items():
        if name == key:
            continue
        origin = f"{path}.{name}".lstrip(".")
        columns = _columns(value, len(axis))
        if columns is None:
            wanted = f"{len(axis)} of {options.axis}"
            remarks.of(run, name, f"has the shape {value.shape}, which does not fit the {wanted}; left out")
            continue
        for k, column in enumerate(columns, 1):
            numbers = f"({k})" if len(columns) > 1 else ""
            yield Trace(
                run, name + numbers, units.get(name, ""), axis, _real(column, origin, source), origin + numbers, unit
            )


def _columns(value: NDArray[Any], n: int) -> list[NDArray[Any]] | None:
    if value.size == n and max(value.shape) == n:
        return [value.ravel()]
    if value.ndim == 2 and value.shape[0] == n:
        return list(value.T)
    if value.ndim == 2 and value.shape[1] == n:
        return list(value)
    return None


def _units(node: Mapping[str, Any], names: list[str], remarks: Remarks, run: str) -> dict[str, str]:
    text = next((v for name, v in node.items() if name.casefold() in ("units", "unit") and isinstance(v, str)), "")
    words = [word.strip() for word in text.split(",")]
    if not text:
        return {}
    if len(words) != len(names):
        remarks.say(f"run {run!r}: units are {text[:80]!r}, which is not one for each of {names_of(names)}; not used")
        return {}
    return dict(zip(names, words, strict=True))


def _chosen(variables: dict[str, Any], options: Options, source: Source, remarks: Remarks) -> Iterator[Trace]:
    """The channels that ``columns`` names by path: ``"data.x"``, ``"runs(2).x"``, ``"M(:,3)"``."""
    arrays = {
        f"{path}.{name}".lstrip("."): value
        for path, node in _containers("", variables, 0)
        for name, value in node.items()
        if _is_numbers(value) and value.size > 1
    }
    picked: dict[str, tuple[str, FloatArray, str]] = {}
    for ours, theirs in (options.columns or {}).items():
        wanted, unit = theirs if isinstance(theirs, tuple) else (theirs, "")
        picked[ours] = (str(wanted), _pick(str(wanted), arrays, source), unit)
    axis_name = options.axis
    if axis_name in picked:
        _, axis, unit = picked.pop(axis_name)
        if axis_name == "time":
            axis, unit = _seconds(axis, unit, _TOP, axis_name, source, remarks)
    elif options.rate is not None and picked:
        n = len(next(iter(picked.values()))[1])
        axis, unit = np.arange(n) / options.rate, "s"
    else:
        raise source.error("", f"columns names no {axis_name!r}; add it, or give the sample rate in Hz, rate=...")
    for ours, (path, values, own) in picked.items():
        if len(values) != len(axis):
            raise source.error(path, f"has {len(values)} values, the {axis_name} has {len(axis)}")
        yield Trace(_TOP, ours, own, axis, values, path, unit)


def _pick(path: str, arrays: Mapping[str, NDArray[Any]], source: Source) -> FloatArray:
    if path in arrays and _is_vector(arrays[path]):
        return _real(arrays[path].ravel(), path, source)
    match = _PICK.fullmatch(path)
    if match and match["path"] in arrays and arrays[match["path"]].ndim == 2:
        table = arrays[match["path"]] if match["column"] else arrays[match["path"]].T
        k = int(match["k"] or match["j"])
        if 1 <= k <= table.shape[1]:
            return _real(table[:, k - 1], path, source)
    shown = [f"{name} {value.shape}" for name, value in arrays.items()]
    raise source.error("", f"no vector {path!r}; there are {names_of(shown)} (columns of a matrix as 'M(:,2)')")


def _seconds(
    axis: FloatArray, unit: str, run: str, key: str, source: Source, remarks: Remarks
) -> tuple[FloatArray, str]:
    scaled = scaled_time(axis, unit)
    if scaled is None:
        raise source.error("", f"run {run!r}: {key!r} is in {unit!r}, which is no unit of time")
    if not unit:
        remarks.of(run, key, "the time has no unit; taken as seconds")
    return scaled, "s"


def _real(values: NDArray[Any], path: str, source: Source) -> FloatArray:
    if values.dtype.kind == "c":
        raise source.error(path, "holds complex numbers; save its parts as two real vectors")
    return np.ascontiguousarray(values, dtype=np.float64)
