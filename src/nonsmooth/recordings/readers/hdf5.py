"""HDF5, that of MATLAB 7.3 too: read by h5py, within limits, following nothing out of the file."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from nonsmooth.recordings.reading import MAX_COLUMNS, MAX_DEPTH, Group, Remarks, Source, inflation_limit

#: Attributes that give the sample rate of a group's arrays, in Hz.
_RATES = ("sample_rate", "sampling_rate", "sampling_frequency", "rate", "fs")


def load_hdf5(data: bytes, source: Source, remarks: Remarks, *, matlab: bool) -> dict[str, Any]:
    """The variables of a file, as dicts (structs), lists (cells, arrays of structs), text and arrays."""
    import h5py

    with h5py.File(io.BytesIO(data), "r") as opened:
        return _GroupReader(h5py, opened, source, remarks, inflation_limit(len(data)), matlab).group(opened, 0)


class _GroupReader:
    """An open file, of whose groups so much is read as its limits allow."""

    def __init__(self, h5py: Any, opened: Any, source: Source, remarks: Remarks, limit: int, matlab: bool) -> None:
        self._h5py, self._file, self._source, self._remarks, self._matlab = h5py, opened, source, remarks, matlab
        self._left = self._limit = limit
        self._members = 16 * MAX_COLUMNS

    def group(self, group: Any, depth: int) -> dict[str, Any]:
        if depth > MAX_DEPTH:
            raise self._source.error(str(group.name), f"is nested deeper than {MAX_DEPTH}")
        found = {} if self._matlab else Group(rate=_rate(group))
        for name in group:
            place = f"{group.name.rstrip('/')}/{name}"
            # What MATLAB keeps for itself is reached by references only.
            if name.startswith("#"):
                continue
            if not isinstance(group.get(name, getlink=True), self._h5py.HardLink):
                self._remarks.say(f"{place}: is a link; left out")
                continue
            found[name] = self._value(group[name], place, depth)
            if isinstance(found, Group):
                units = group[name].attrs.get("units", group[name].attrs.get("unit", ""))
                found.units[name] = units.decode("utf-8", "replace") if isinstance(units, bytes) else str(units)
                found.rate = found.rate or _rate(group[name])
        return found

    def _value(self, item: Any, place: str, depth: int) -> Any:
        self._members -= 1
        if self._members < 0:
            raise self._source.error(place, f"the file holds more than {16 * MAX_COLUMNS} arrays")
        if isinstance(item, self._h5py.Group):
            return _rows(self.group(item, depth + 1))
        if not isinstance(item, self._h5py.Dataset):
            self._remarks.say(f"{place}: is neither a group nor an array; left out")
            return None
        return self._array(item, place, depth)

    def _array(self, item: Any, place: str, depth: int) -> Any:
        kind = item.attrs.get("MATLAB_class", b"")
        kind = kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)
        if "MATLAB_empty" in item.attrs:
            return "" if kind == "char" else np.empty(0)
        if item.is_virtual or item.external:
            self._remarks.say(f"{place}: its values are in other files; left out")
            return None
        refers = self._h5py.check_ref_dtype(item.dtype) is not None
        compound = item.dtype.names is not None
        if not refers and not compound and item.dtype.kind not in "fiub":
            self._remarks.say(f"{place}: holds {item.dtype} values, no numbers; left out")
            return None
        if item.shape is None:
            return np.empty(0)
        self._left -= item.size * max(1, item.dtype.itemsize)
        if self._left < 0 or item.size > max(4096, 1100 * item.id.get_storage_size()):
            raise self._source.error(
                place, f"says it holds {item.shape} values, more than a file of {self._source.size} bytes warrants"
            )
        values = item[()]
        if refers:
            flat = np.asarray(values).ravel()
            members = [
                self._value(self._file[ref], f"{place}({k})", depth + 1) if ref else None
                for k, ref in enumerate(flat, 1)
            ]
            if depth > MAX_DEPTH:
                raise self._source.error(place, f"is nested deeper than {MAX_DEPTH}")
            return members if kind == "cell" else _Column(members)
        values = np.asarray(values)
        if compound and not self._matlab:
            return Group({name: values[name] for name in values.dtype.names or ()}, rate=_rate(item))
        if compound:
            if values.dtype.names != ("real", "imag"):
                self._remarks.say(f"{place}: holds compound values; left out")
                return None
            values = values["real"] + 1j * values["imag"]
        if kind == "char":
            codes = values.T.ravel(order="F")
            return codes.astype("<u2").tobytes().decode("utf-16-le", errors="replace")
        return values.T if self._matlab else values  # MATLAB's order


def _rate(item: Any) -> float | None:
    found = [np.asarray(item.attrs[name]) for name in _RATES if name in item.attrs]
    return float(found[0].ravel()[0]) if found and found[0].size == 1 and found[0].dtype.kind in "iuf" else None


class _Column(list[Any]):
    """One field of an array of structs: its values in each of them."""


def _rows(fields: dict[str, Any]) -> Any:
    """A struct, or an array of structs, which is stored by field."""
    columns = list(fields.values())
    if columns and all(isinstance(c, _Column) for c in columns) and len({len(c) for c in columns}) == 1:
        return [{name: column[k] for name, column in fields.items()} for k in range(len(columns[0]))]
    return fields
