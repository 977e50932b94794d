"""The notebook of a session, ``session.toml``: what may stand in it, and its tables read and checked.

Keys are strict: a misspelt setting that is silently ignored makes a wrong parameter.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.reading import Options
from nonsmooth.system.names import check_keys, unknown

__all__ = [
    "APPARATUS", "NOTEBOOK", "PROCEDURES", "SETTINGS", "Entry", "Quantity", "apparatus_of", "entry_of", "table_of",
]  # fmt: skip

NOTEBOOK = "session.toml"

#: What may stand in ``[apparatus]``: unit and meaning.
APPARATUS: Mapping[str, tuple[str, str]] = MappingProxyType({
    "distance_per_turn": ("m", "travel of the car per turn of the rotary sensor's wheel"),
    "counts_per_turn": ("", "counts of the rotary sensor per turn"),
    "sample_rate": ("Hz", "rate of the sensors"),
    "turn_resolution": ("s", "resolution of the photogate's times"),
    "force_gain_limit": ("", "the force sensor's gain lies within 1 +- this (uniform, type B)"),
    "force_resolution": ("N", "step of the force sensor"),
    "force_range": ("N", "the force sensor saturates at +- this"),
    "mass": ("kg", "mass of the car, weighed"),
    "test_mass": ("kg", "mass hung on the support's spring in the drop test, weighed"),
    "string_length": ("m", "string between crank and driven spring"),
})  # fmt: skip

#: Each procedure, and the settings that its runs must state.
PROCEDURES: Mapping[str, tuple[str, ...]] = MappingProxyType({
    "springs": (), "support": (), "impulse": (), "drop": (),
    "response": ("crank_length",), "voltage": ("voltage",), "crank": ("crank_length",),
    "grazing": ("crank_length", "gap"), "contact": ("crank_length", "gap"),
    "rise": ("crank_length", "crank_length_end", "gap"), "section": ("crank_length", "gap"),
})  # fmt: skip

#: What may be set in a run: the type, the unit, the meaning.
SETTINGS: Mapping[str, tuple[type, str, str]] = MappingProxyType({
    "voltage": (float, "V", "motor voltage"),
    "crank_length": (float, "m", "length of the crank (at the beginning, where it changes)"),
    "crank_length_end": (float, "m", "length of the crank at the end of a slow rise"),
    "gap": (float, "m", "gap of the support as read at its screw"),
    "direction": (str, "", "up or down: how the steps follow one another"),
    "figure": (int, "", "number of the published figure whose setting this is"),
    "note": (str, "", "a remark"),
})  # fmt: skip


@dataclass(frozen=True)
class Quantity:
    """A number from the notebook with its standard uncertainty; 0 where none was stated."""

    value: float
    uncertainty: float = 0.0

    def __float__(self) -> float:
        return self.value


@dataclass(frozen=True)
class Entry:
    """One ``[[recording]]`` of the notebook."""

    file: str
    procedure: str
    runs: tuple[tuple[str, Mapping[str, Any]], ...]
    read: Mapping[str, Any]


def apparatus_of(given: Any, where: str) -> Mapping[str, Quantity]:
    """The table ``[apparatus]``, checked."""
    table = table_of(given, where)
    check_keys(table, APPARATUS, where, "a key")
    known = {}
    for name, value in table.items():
        stated = value if isinstance(value, dict) else {"value": value}
        check_keys(stated, ("value", "uncertainty"), f"{where}, {name}", "a key")
        if "value" not in stated:
            raise ValueError(f"{where}, {name}: needs `value`")
        numbers = [_number(stated.get(key, 0.0), f"{where}, {name}: {key}") for key in ("value", "uncertainty")]
        quantity = Quantity(*numbers)
        if quantity.value <= 0 or quantity.uncertainty < 0:
            raise ValueError(f"{where}, {name} = {value!r}: must be positive, an uncertainty zero or more")
        known[name] = quantity
    return MappingProxyType(known)


def entry_of(given: Any, folder: Path, where: str) -> Entry:
    """One table ``[[recording]]``, checked; its file must be there."""
    table = table_of(given, where)
    check_keys(table, ("file", "procedure", "runs", "read"), where, "a key")
    for key in ("file", "procedure", "runs"):
        if key not in table:
            raise ValueError(f"{where}: needs `{key}`")
    file, procedure = table["file"], table["procedure"]
    if not isinstance(file, str) or file != Path(file).name or file in ("", ".", ".."):
        raise ValueError(f"{where}: file = {file!r} must be the name of a file in the folder of the notebook")
    if not (folder / file).is_file():
        raise DataFileError(f"{folder / file}: no such file (named in {where})")
    if not isinstance(procedure, str) or procedure not in PROCEDURES:
        raise ValueError(f"{where}: {unknown(procedure, 'a procedure', 'a session', PROCEDURES.keys())}")
    if not isinstance(table["runs"], list) or not table["runs"]:
        raise ValueError(f'{where}: runs must be a list of tables as {{ run = "Run #1", voltage = 4.2 }}')
    runs: dict[str, Mapping[str, Any]] = {}
    for i, item in enumerate(table["runs"], 1):
        name, settings = _run(item, procedure, f"{where} ({file}), run {i}")
        if name in runs:
            raise ValueError(f"{where}: run {name!r} is named twice")
        runs[name] = settings
    read = table_of(table.get("read", {}), f"{where}, read")
    check_keys(read, ("format", *vars(Options())), f"{where}, read", "an option of load_recording")
    options = dict(read)
    if isinstance(options.get("columns"), dict):  # TOML has lists where load_recording takes (column, unit)
        options["columns"] = {k: tuple(v) if isinstance(v, list) else v for k, v in options["columns"].items()}
    return Entry(file, procedure, tuple(runs.items()), options)


def _run(given: Any, procedure: str, where: str) -> tuple[str, Mapping[str, Any]]:
    table = dict(table_of(given, where))
    check_keys(table, ("run", *SETTINGS), where, "a setting")
    name = table.pop("run", None)
    if not isinstance(name, str) or not name:
        raise ValueError(f'{where}: needs run = "..." with the name of the run in the file')
    if missing := [key for key in PROCEDURES[procedure] if key not in table]:
        raise ValueError(f"{where}: a run of {procedure!r} must state {', '.join(missing)}")
    for key, value in table.items():
        kind = SETTINGS[key][0]
        if kind is float:
            table[key] = _number(value, f"{where}: {key}")
        elif not isinstance(value, kind) or isinstance(value, bool):
            raise TypeError(f"{where}: {key} = {value!r} must be of type {kind.__name__}")
    if table.get("direction", "up") not in ("up", "down"):
        raise ValueError(f"{where}: direction = {table['direction']!r} must be 'up' or 'down'")
    return name, MappingProxyType(table)


def _number(value: Any, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{what} = {value!r} must be a number")
    if value - value != 0:
        raise ValueError(f"{what} = {value!r} must be finite")
    return float(value)


def table_of(value: Any, where: str) -> Mapping[str, Any]:
    """``value`` where it is a table."""
    if not isinstance(value, dict):
        raise ValueError(f"{where} must be a table with keys, got {value!r}")
    return value
