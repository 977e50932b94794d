"""Hash of a result's content, so that a file whose bytes were altered is refused.

The hash goes over names, roles (coordinate or not), dims, types, shapes, values and attributes of every variable and
over the attributes of the Dataset, in a form that does not depend on the file format: byte order, the width of strings,
compression and the order of variables leave it as it is.

A NetCDF file also ends in a hash of its bytes, which is compared before the file is opened: the HDF5 library does not
end on some damaged files. Programs that read NetCDF do not look at what follows the end that the file states.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Hashable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

#: A stamped provenance begins with its hash; one from before hashes were written begins with the version.
_STAMPED = re.compile(r'\{"sha256": "([0-9a-f]{64})", ')
_UNSTAMPED = '{"version": '
_TRAILER = re.compile(rb"\nnonsmooth sha256 ([0-9a-f]{64})\n")
_TRAILER_LENGTH = 83  # bytes
_BLOCK = 1 << 20


def content(attributes: Mapping[Any, Any], variables: Iterable[tuple[str, bool, xr.Variable]]) -> dict[str, Any]:
    """Content of a Dataset in short, as plain data: an entry for each variable, with the hash of its values.

    The variables (name, coordinate or not, variable) are taken one at a time, so that a file need not be in memory
    whole. Equal contents have equal :func:`digest`.

    Raises
    ------
    ValueError
        A text that cannot be written to a file (it holds NUL, or half a surrogate pair).
    TypeError
        An attribute that is neither text nor numbers, or a variable of a type that files cannot hold.
    """
    found: dict[str, Any] = {"the attributes": _attributes("the Dataset", attributes)}
    for name, coordinate, variable in variables:
        where = f"variable {_text(name, 'a name')!r}"
        found[where] = [
            coordinate,
            [_text(dim, "a name") for dim in variable.dims],
            _kind(where, variable.dtype),
            list(variable.shape),
            _attributes(where, variable.attrs),
            _values(where, variable),
        ]
    return found


def digest(data: Any) -> str:
    """Hash of plain data, whatever the order of its keys."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def stamp(provenance: str, found: str) -> str:
    """The provenance (a JSON object) with the content's hash as its first entry.

    One attribute holds both, and :func:`unstamp` knows it by how it begins: no altered byte makes a stamped file look
    like one from before hashes were written.
    """
    if not provenance.startswith("{") or len(provenance) < 3:
        raise ValueError(f"the provenance of a result is a JSON object, got {provenance[:40]!r}")
    return f'{{"sha256": "{found}", {provenance[1:]}'


def unstamp(stamped: str) -> tuple[str | None, str]:
    """Hash (None where the file was written before there were hashes) and provenance; ValueError if it is neither."""
    found = _STAMPED.match(stamped)
    if found is None and not stamped.startswith(_UNSTAMPED):
        raise ValueError("its provenance does not begin as it was written")
    return (None, stamped) if found is None else (found[1], "{" + stamped[found.end() :])


def trailer(data: bytes | memoryview) -> bytes:
    """The end of a file that holds ``data``."""
    return f"\nnonsmooth sha256 {hashlib.sha256(data).hexdigest()}\n".encode()


def bytes_as_written(path: Path) -> bool:
    """Return whether a file's bytes are those before its :func:`trailer`; True where it has none."""
    found, left = hashlib.sha256(), path.stat().st_size - _TRAILER_LENGTH
    if left < 0:
        return True
    with open(path, "rb") as file:
        file.seek(left)
        end = _TRAILER.fullmatch(file.read())
        if end is None:
            return True
        file.seek(0)
        while left > 0 and (block := file.read(min(left, _BLOCK))):
            found.update(block)
            left -= len(block)
    return found.hexdigest() == end[1].decode()


def seal(record: Mapping[str, Any]) -> dict[str, Any]:
    """A record of plain data with its own hash as the entry ``sha256``."""
    return {**record, "sha256": digest(record)}


def sealed(record: Any) -> bool:
    """Return whether a record is as :func:`seal` made it."""
    if not isinstance(record, dict) or "sha256" not in record:
        return False
    return bool(digest({name: value for name, value in record.items() if name != "sha256"}) == record["sha256"])


def _attributes(owner: str, attributes: Mapping[Any, Any]) -> list[list[Any]]:
    return sorted(
        [_text(key, f"the name of an attribute of {owner}"), _entry(owner, key, value)]
        for key, value in attributes.items()
    )


def _entry(owner: str, key: Hashable, value: Any) -> list[Any]:
    """An attribute as its kind and its entries: files do not tell one entry from a sequence of one."""
    where = f"attribute {key!r} of {owner}"
    if value is None or isinstance(value, bool | np.bool_ | dict):
        raise TypeError(
            f"{where} is a {type(value).__name__}, which files cannot hold; "
            "use a number, a string or an array of numbers"
        )
    array = np.asarray(value)
    entries, shape = array.ravel().tolist(), list(array.shape) if array.size > 1 else []
    if not entries:
        return ["empty"]
    if array.dtype.kind in "iu":
        return ["integer", shape, entries]
    if array.dtype.kind == "f":
        return ["number", shape, [float(number).hex() for number in entries]]
    if not all(isinstance(word, str) for word in entries):
        raise TypeError(f"{where} is of type {type(value).__name__}; use a number, a string or an array of numbers")
    return ["text", shape, [_text(word, where) for word in entries]]


def _kind(where: str, dtype: np.dtype[Any]) -> str:
    if dtype.kind in ("O", "T", "U"):
        return "text"
    if dtype.kind in "biufc":
        return f"{dtype.kind}{dtype.itemsize}"
    raise TypeError(f"{where} is of type {dtype}, which files do not give back; use numbers or text")


def _values(where: str, variable: xr.Variable) -> str:
    values: NDArray[Any] = np.asarray(variable.values)
    if values.dtype.kind in ("O", "T", "U"):
        words = [_text(word, where) for word in values.ravel().tolist()]
        return hashlib.sha256("\0".join(words).encode()).hexdigest()
    ordered = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
    return hashlib.sha256(ordered.reshape(-1).view(np.uint8).data).hexdigest()


def _text(word: Any, where: str) -> str:
    if not isinstance(word, str):
        raise TypeError(f"{where} holds a {type(word).__name__}; files hold numbers or text")
    if "\0" in word:
        raise ValueError(f"{where} holds the character NUL, which files cannot hold; take it out")
    try:
        word.encode()
    except UnicodeEncodeError as error:
        raise ValueError(f"{where} is not valid text ({error}); take the character out") from None
    return word
