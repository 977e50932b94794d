"""One JSON string per result that holds its whole input, so that any result can be recomputed.

It is the attribute ``nonsmooth`` of every Dataset. :func:`read_provenance` returns

``{"version", "verb", "system": {"name", "text", "parameters"}, "options", "method", "seed", "created"}``

``text`` is the system's data-only text form (``System.from_text`` reads it), ``options`` the verb's arguments
as given, ``method`` the method that "auto" resolved to.

The attribute itself is at most `LIMIT` characters, so that a result shows well in a notebook: text and parameters of
the system are compressed (``system["zlib"]``, base64 of zlib of JSON), and an option that stands in a coordinate is a
reference to it. A record that is longer all the same (an option of many numbers that stand nowhere else) is the scalar
coordinate ``provenance``, and the attribute says so.
"""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import json
import math
import zlib
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache, lru_cache
from importlib import metadata
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.results.labels import Labels

if TYPE_CHECKING:
    import xarray as xr

ATTRIBUTE = "nonsmooth"
COORDINATE = "provenance"
LIMIT = 2000  # characters of the attribute
_FEW = 6  # numbers that are repeated rather than referred to
_LARGEST = 2**26  # bytes of a system's text: an attribute made to claim more is refused


@cache  # it is read from a file, and every result holds it
def package_version() -> str:
    """The installed version of ``nonsmooth``; "unknown" for files that were copied without being installed."""
    try:
        return metadata.version("nonsmooth")
    except metadata.PackageNotFoundError:
        return "unknown"


def provenance(
    labels: Labels,
    verb: str,
    options: Mapping[str, Any],
    *,
    method: str,
    seed: int | None = None,
    date: bool = False,
) -> dict[str, str]:
    """The attribute to put on a Dataset: ``{"nonsmooth": <JSON>}``.

    With ``date`` the time of the run is recorded too; without it, equal input gives equal files.
    """
    return attribute(
        {
            "version": package_version(),
            "verb": verb,
            "system": {
                "name": labels.name,
                "text": labels.text,
                "parameters": {name: quantity.value for name, quantity in labels.parameters.items()},
            },
            "options": options,
            "method": method,
            "seed": seed,
            "created": datetime.now(UTC).isoformat(timespec="seconds") if date else None,
        }
    )


def attribute(record: Mapping[str, Any]) -> dict[str, str]:
    """The attribute that holds a record, the text of its system compressed, behind what a person reads."""
    plain = _plain(record)
    if isinstance(system := plain.get("system"), dict) and isinstance(system.get("text"), str):
        del plain["system"]
        rest = {key: value for key, value in system.items() if key != "name"}
        plain["system"] = {"name": system.get("name"), "zlib": _compressed(_json(rest))}
    return {ATTRIBUTE: _json(plain)}


def with_short_record(result: xr.Dataset) -> xr.Dataset:
    """The result, its record cut to `LIMIT` characters by what its coordinates hold."""
    if ATTRIBUTE not in result.attrs:
        return result
    text = result.attrs[ATTRIBUTE]
    record = json.loads(text)
    if isinstance(options := record.get("options"), dict):
        shorter = {name: _referred(value, result) for name, value in options.items()}
        if shorter != options:
            text = _json(record | {"options": shorter})
    if len(text) <= LIMIT:
        return result if text == result.attrs[ATTRIBUTE] else result.assign_attrs({ATTRIBUTE: text})
    whole = _json(_opened(record))
    head = {key: record[key] for key in ("version", "verb", "method") if key in record} | {"record": COORDINATE}
    long_name = {"long_name": "record of how the result was made"}
    return result.assign_attrs({ATTRIBUTE: _json(head)}).assign_coords({COORDINATE: ((), whole, long_name)})


def read_provenance(result: xr.Dataset) -> dict[str, Any]:
    """The record of how a result was made.

    An option that stands in a coordinate is read from there. Where the coordinate is no longer the one that the result
    was computed with (a part was selected, its order changed), the option stays the reference
    ``{"coordinate": name, "sha256": ...}``.

    ValueError: the Dataset carries no record, or one that cannot be read."""
    text = result.attrs.get(ATTRIBUTE)
    if not isinstance(text, str):
        raise ValueError(
            f"this Dataset has no attribute {ATTRIBUTE!r}: it was not made by nonsmooth, or lost it on the way"
        )
    record = _object(text, f"attribute {ATTRIBUTE!r}")
    if record.get("record") == COORDINATE:
        if COORDINATE not in result.coords:
            raise ValueError(
                f"the record of this Dataset was its coordinate {COORDINATE!r}, which has been dropped; take it from "
                "the result as it was computed"
            )
        record = _object(str(result.coords[COORDINATE].values), f"coordinate {COORDINATE!r}")
    record = _opened(record)
    if isinstance(options := record.get("options"), dict):
        record["options"] = {name: _resolved(value, result) for name, value in options.items()}
    return record


def _object(text: str, where: str) -> dict[str, Any]:
    try:
        record = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"the {where} of this Dataset is not JSON ({error})") from None
    if not isinstance(record, dict):
        raise ValueError(f"the {where} of this Dataset is a {type(record).__name__}, not a JSON object")
    return record


def _json(data: Any) -> str:
    return json.dumps(data, ensure_ascii=False, allow_nan=False)


@lru_cache(maxsize=16)  # every call of a verb on one system writes the same
def _compressed(text: str) -> str:
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode()


def _opened(record: dict[str, Any]) -> dict[str, Any]:
    """The record with the text of its system as it was."""
    system = record.get("system")
    if not (isinstance(system, dict) and isinstance(system.get("zlib"), str)):
        return record
    try:
        reader = zlib.decompressobj()
        data = reader.decompress(base64.b64decode(system["zlib"], validate=True), _LARGEST)
        if not reader.eof:
            raise ValueError(f"it is cut short, or of more than {_LARGEST} bytes")
        rest = _object(data.decode(), "compressed system")
    except (ValueError, zlib.error) as error:  # binascii.Error and UnicodeDecodeError are ValueErrors
        raise ValueError(f"the compressed system in the record of this Dataset cannot be read ({error})") from None
    return record | {"system": {"name": system.get("name"), **rest}}


def _referred(value: Any, result: xr.Dataset) -> Any:
    """An option, its long lists of numbers replaced by the coordinate that holds the same."""
    if isinstance(value, dict):
        return {key: _referred(item, result) for key, item in value.items()}
    if not isinstance(value, list) or len(_json(value)) <= 16 * _FEW:
        return value
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):  # None, text, rows of unequal length
        return value
    for name, coordinate in result.coords.items():
        if coordinate.shape == array.shape and coordinate.dtype.kind == "f" and np.array_equal(coordinate, array):
            return {"coordinate": str(name), "sha256": _digest(array)}
    return value


def _resolved(value: Any, result: xr.Dataset) -> Any:
    if not isinstance(value, dict):
        return value
    if set(value) != {"coordinate", "sha256"}:
        return {key: _resolved(item, result) for key, item in value.items()}
    coordinate = result.coords.get(value["coordinate"])
    if coordinate is None or coordinate.dtype.kind != "f" or _digest(coordinate.values) != value["sha256"]:
        return value
    return coordinate.values.tolist()


def _digest(array: np.ndarray[Any, Any]) -> str:
    return hashlib.sha256(np.ascontiguousarray(array, dtype="<f8").tobytes()).hexdigest()[:16]


def options_as_data(options: Mapping[str, Any]) -> dict[str, Any]:
    """Options as plain data: arrays become lists, sections ``{"type": "Poincare", "indicator": ...}``."""
    return {str(name): _plain(value) for name, value in options.items()}


def _plain(value: Any) -> Any:
    """Plain JSON data. A number that JSON cannot write becomes the string that ``float`` reads ("nan", "inf")."""
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else repr(value)
    if isinstance(value, np.generic | np.ndarray):
        return _plain(value.tolist())
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {item.name: _plain(getattr(value, item.name)) for item in dataclasses.fields(value)}
        return {"type": type(value).__name__, **fields}
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | range):
        return [_plain(item) for item in value]
    raise TypeError(
        f"an option of type {type(value).__name__} cannot be written down as data; "
        "pass numbers, strings, sequences, mappings or frozen dataclasses of these"
    )
