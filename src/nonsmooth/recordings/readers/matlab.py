"""MATLAB files of all versions, and HDF5, within limits, with shapes they claim checked, following nothing out.

SciPy's reader makes room for as many cells and structs as a file claims. Here each number of elements is compared with
the bytes that are there before it sees them. Variables of classes that hold no plain data (sparse, objects, functions)
are left out.
"""

from __future__ import annotations

import io
import math
import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from nonsmooth.recordings.reading import MAX_COLUMNS, MAX_DEPTH, Group, Reading, readable

_HEADER = 128
_INT8, _INT32, _MATRIX, _COMPRESSED = 1, 5, 14, 15
_NUMERIC, _TEXT = {1, 2, 3, 4, 5, 6, 7, 9, 12, 13}, {1, 2, 3, 4, 16, 17, 18}
_CELL, _STRUCT, _CHAR, _NUMBERS = 1, 2, 4, range(6, 16)  # classes


class _LeftOut(Exception):
    """The variable is of a class that holds no plain data."""


def load_v5(data: bytes, reading: Reading) -> dict[str, Any]:
    """The variables of a file, as dicts (structs), lists (cells, arrays of structs), text and arrays."""
    from scipy.io import loadmat

    if len(data) < _HEADER or data[126:128] not in (b"IM", b"MI"):
        raise reading.error("byte 126", "expected the byte order mark of a MATLAB file of version 5")
    order = "<" if data[126:128] == b"IM" else ">"
    # The offset of a part that only objects use is cleared with them.
    plain = bytearray(data[:116] + b"\0" * 8 + data[124:_HEADER])
    for kind, body, position in _elements(memoryview(data), order, "variable at ", reading, _HEADER):
        place = f"variable at byte {position}"
        if kind == _COMPRESSED:
            unpacker = zlib.decompressobj()
            with readable("unpacked", reading, place):
                unpacked = unpacker.decompress(body, reading.left + 1)
            reading.warrant(len(unpacked), f"unpacks to more than {reading.left} bytes", place)
            if not unpacker.eof:
                raise reading.error(place, "cannot be unpacked, it is cut short")
            kind, body, _ = next(_elements(memoryview(unpacked), order, f"{place}, ", reading), (0, body, 0))
        if kind != _MATRIX:
            raise reading.error(place, f"is of type {kind}, expected a matrix (14) or a packed one (15)")
        try:
            name = _name(body, order, place, reading)
        except _LeftOut as why:
            reading.say(f"{place}: holds {why}; left out")
            continue
        if name:
            plain += struct.pack(order + "II", _MATRIX, len(body)) + body
    found = loadmat(io.BytesIO(bytes(plain)), struct_as_record=True, squeeze_me=False, mat_dtype=False)
    return {name: _plain(value) for name, value in found.items() if not name.startswith("__")}


def _elements(
    body: memoryview, order: str, place: str, reading: Reading, position: int = 0
) -> Iterator[tuple[int, memoryview, int]]:
    """Type, content and place of each data element."""
    while position < len(body):
        if len(body) - position < 8:
            raise reading.error(f"{place}byte {position}", "an element is cut short")
        kind, size = struct.unpack_from(order + "II", body, position)
        begin, following = position + 8, position + 8 + size
        if kind >> 16:  # a small element: up to four bytes inside its own tag
            kind, size, begin, following = kind & 0xFFFF, kind >> 16, position + 4, position + 8
        elif kind != _COMPRESSED:
            following += -size % 8
        if begin + size > min(max(following, begin), len(body)):
            left = min(following, len(body)) - begin
            message = f"is {size} bytes long, only {left} follow: the file is cut short"
            raise reading.error(f"{place}byte {position}", message)
        yield kind, body[begin : begin + size], position
        position = following


def _name(body: memoryview, order: str, place: str, reading: Reading, depth: int = 0) -> bytes:
    """The name of a matrix, whose number of elements, and of those of its members, fits the bytes it has."""
    if depth > MAX_DEPTH:
        raise reading.error(place, f"is nested deeper than {MAX_DEPTH}")
    parts = _elements(body, order, f"{place}, ", reading)
    (_, flags, _), (kind, shape, _), (_, name, _) = (next(parts, (0, body[:0], 0)) for _ in range(3))
    dims = struct.unpack(f"{order}{len(shape) // 4}i", shape[: len(shape) // 4 * 4])
    if len(flags) != 8 or kind != _INT32 or not 2 <= len(dims) <= 32 or min(dims) < 0:
        raise reading.error(place, f"expected the flags and the dimensions of a matrix, got {dims[:4]}")
    (word, _), n, rest = struct.unpack(order + "II", flags), math.prod(dims), [*parts]
    class_, held = word & 0xFF, [kind for kind, *_ in rest]
    if class_ not in (_CELL, _STRUCT, _CHAR, *_NUMBERS):
        raise _LeftOut(f"a MATLAB array of class {class_} (sparse, object or function)")
    if class_ == _STRUCT:
        named = held[:2] == [_INT32, _INT8] and len(rest[0][1]) == 4
        width = max(struct.unpack(order + "i", rest[0][1])[0], 1) if named else 1
        fits = named and _are_matrices(held[2:], n * (len(rest[1][1]) // width))
    elif class_ == _CELL:
        fits = _are_matrices(held, n)
    else:
        parts_of, count = (_TEXT, 1) if class_ == _CHAR else (_NUMERIC, 2 if word & 0x0800 else 1)
        fits = n <= len(body) and len(held) == count and set(held) <= parts_of
    if not fits:
        raise reading.error(place, f"says it has {n} elements, which are not what its {len(body)} bytes hold")
    for kind, member, _ in rest:
        if kind == _MATRIX and len(member):
            _name(member, order, place, reading, depth + 1)
    return bytes(name).split(b"\0")[0]


def _are_matrices(kinds: list[int], count: int) -> bool:
    return len(kinds) == count and set(kinds) <= {_MATRIX}


def _plain(value: Any) -> Any:
    """SciPy's arrays as dicts, lists, text and numbers."""
    if not isinstance(value, np.ndarray):
        return value if isinstance(value, str) else None
    if value.dtype.names:
        rows = [{name: _plain(row[name]) for name in value.dtype.names} for row in value.ravel(order="F")]
        return rows[0] if len(rows) == 1 else rows
    if value.dtype.kind == "O":
        return [_plain(member) for member in value.ravel(order="F")]
    if value.dtype.kind == "U":
        return "\n".join(str(text) for text in value.ravel())
    return value if value.dtype.kind in "fiubc" else None


#: Attributes that give the sample rate of a group's arrays, in Hz, and those that give the time between samples.
_RATES = ("sample_rate", "sampling_rate", "sampling_frequency", "rate", "fs")
_STEPS = ("dt", "sample_interval", "sampling_interval")


def load_hdf5(data: bytes, reading: Reading, *, matlab: bool) -> dict[str, Any]:
    """The variables of a file, as dicts (structs), lists (cells, arrays of structs), text and arrays."""
    import h5py

    members = 16 * MAX_COLUMNS  # that a file may hold

    def of_group(group: Any, depth: int) -> dict[str, Any]:
        if depth > MAX_DEPTH:
            raise reading.error(str(group.name), f"is nested deeper than {MAX_DEPTH}")
        found = {} if matlab else Group(rate=_rate(group))
        for name in group:
            place = f"{group.name.rstrip('/')}/{name}"
            # What MATLAB keeps for itself is reached by references only.
            if name.startswith("#"):
                continue
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                reading.say(f"{place}: is a link; left out")
                continue
            found[name] = value_of(group[name], place, depth)
            if isinstance(found, Group):
                attrs = group[name].attrs
                found.units[name] = _word(attrs.get("units", attrs.get("unit", "")))
                if own := _rate(group[name]):
                    found.rates[name] = own
        return found

    def value_of(item: Any, place: str, depth: int) -> Any:
        nonlocal members
        members -= 1
        if members < 0:
            raise reading.error(place, f"the file holds more than {16 * MAX_COLUMNS} arrays")
        if isinstance(item, h5py.Group):
            return _rows(of_group(item, depth + 1))
        if not isinstance(item, h5py.Dataset):
            reading.say(f"{place}: is neither a group nor an array; left out")
            return None
        kind = _word(item.attrs.get("MATLAB_class", b""))
        if "MATLAB_empty" in item.attrs:
            return "" if kind == "char" else np.empty(0)
        if item.is_virtual or item.external:
            reading.say(f"{place}: its values are in other files; left out")
            return None
        refers, names = h5py.check_ref_dtype(item.dtype) is not None, item.dtype.names
        if not refers and names is None and item.dtype.kind not in "fiub":
            reading.say(f"{place}: holds {item.dtype} values, no numbers; left out")
            return None
        if item.shape is None:
            return np.empty(0)
        stored = item.size <= max(4096, 1100 * item.id.get_storage_size())
        claimed = item.size * max(1, item.dtype.itemsize) if stored else math.inf
        reading.warrant(claimed, f"says it holds {item.shape} values", place)
        values = np.asarray(item[()])
        if refers:
            held = [
                value_of(opened[ref], f"{place}({k})", depth + 1) if ref else None
                for k, ref in enumerate(values.ravel(), 1)
            ]
            if depth > MAX_DEPTH:
                raise reading.error(place, f"is nested deeper than {MAX_DEPTH}")
            return held if kind == "cell" else _Column(held)
        if names is not None and not matlab:
            return Group({name: values[name] for name in names}, rate=_rate(item))
        if names is not None:
            if names != ("real", "imag"):
                reading.say(f"{place}: holds compound values; left out")
                return None
            values = values["real"] + 1j * values["imag"]
        if kind == "char":
            return values.T.ravel(order="F").astype("<u2").tobytes().decode("utf-16-le", errors="replace")
        return values.T if matlab else values  # MATLAB's order

    with h5py.File(io.BytesIO(data), "r") as opened:
        return of_group(opened, 0)


def _word(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _rate(item: Any) -> float | None:
    for name in (*_RATES, *_STEPS):
        said = np.asarray(item.attrs.get(name, ""))
        if said.size == 1 and said.dtype.kind in "iuf" and float(said.ravel()[0]) > 0:
            return float(said.ravel()[0]) ** (-1 if name in _STEPS else 1)
    return None


class _Column(list[Any]):
    """One field of an array of structs: its values in each of them."""


def _rows(fields: dict[str, Any]) -> Any:
    """A struct, or an array of structs, which is stored by field."""
    columns = list(fields.values())
    if columns and all(isinstance(c, _Column) for c in columns) and len({len(c) for c in columns}) == 1:
        return [{name: column[k] for name, column in fields.items()} for k in range(len(columns[0]))]
    return fields
