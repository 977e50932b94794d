"""One JSON string per result that holds its whole input, so that any result can be recomputed.

It is the attribute ``nonsmooth`` of every Dataset:

``{"version", "verb", "system": {"name", "text", "parameters"}, "options", "method", "seed", "created"}``

``text`` is the system's data-only text form (``System.from_text`` reads it), ``options`` the verb's arguments
as given, ``method`` the method that "auto" resolved to.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.results.labels import Labels

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ATTRIBUTE", "options_as_data", "package_version", "provenance", "read_provenance"]

ATTRIBUTE = "nonsmooth"


@cache  # it is read from a file, and every result holds it
def package_version() -> str:
    """The installed version of ``nonsmooth``."""
    return metadata.version("nonsmooth")


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
    record = {
        "version": package_version(),
        "verb": verb,
        "system": {
            "name": labels.name,
            "text": labels.text,
            "parameters": {name: quantity.value for name, quantity in labels.parameters.items()},
        },
        "options": options_as_data(options),
        "method": method,
        "seed": seed,
        "created": datetime.now(UTC).isoformat(timespec="seconds") if date else None,
    }
    return {ATTRIBUTE: json.dumps(_plain(record), ensure_ascii=False, allow_nan=False)}


def read_provenance(result: xr.Dataset) -> dict[str, Any]:
    """The record written by :func:`provenance`; ValueError if the Dataset carries none, or one that cannot be read."""
    text = result.attrs.get(ATTRIBUTE)
    if not isinstance(text, str):
        raise ValueError(
            f"this Dataset has no attribute {ATTRIBUTE!r}: it was not made by nonsmooth, or lost it on the way"
        )
    try:
        record = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"the attribute {ATTRIBUTE!r} of this Dataset is not JSON ({error})") from None
    if not isinstance(record, dict):
        raise ValueError(f"the attribute {ATTRIBUTE!r} of this Dataset is a {type(record).__name__}, not a JSON object")
    return record


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
