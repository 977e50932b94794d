"""Result of every reader: traces (one channel of one run), remarks, and the file they came from.

A reader is a function ``read(data: bytes, source: Source, options: Options) -> Reading``. It takes the whole file as
bytes, touches no disk, raises only ``DataFileError``, and leaves rates, grouping and labels to ``assemble``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import DataFileError
from nonsmooth.recordings.remarks import Remarks

__all__ = [
    "TIME_SCALES", "TIME_WORDS", "Column", "Options", "Reading", "Source", "Trace", "is_axis_name", "names_of",
    "scaled_time",
]  # fmt: skip

#: What instruments call the time column, lower case, in the languages their programs speak.
TIME_WORDS = frozenset(
    ["time", "t", "timestamp", "datetime", "zeit", "temps", "tiempo", "tempo", "tid", "tijd", "aika", "czas", "čas",
     "laiks", "laikas",
     "время", "时间", "時間", "시간"]
)  # fmt: skip

#: Time units and their length in seconds. The empty unit is taken for seconds, with a remark.
TIME_SCALES = {
    "s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9, "min": 60.0,
    "h": 3600.0, "d": 86400.0,
}  # fmt: skip

#: A column of a file: its name there or its place (from 0), and its unit where the file does not say it.
Column = str | int | tuple[str | int, str]


@dataclass(frozen=True)
class Source:
    """The file being read; errors and provenance speak of it."""

    name: str
    size: int
    sha256: str
    format: str

    def error(self, place: str, message: str) -> DataFileError:
        """The exception for something wrong at ``place`` (a line, a record, a member; may be empty)."""
        return DataFileError(": ".join(part for part in (self.name, place, message) if part))


@dataclass(frozen=True)
class Options:
    """The arguments of ``load_recording`` that concern readers."""

    columns: Mapping[str, Column] | None = None
    axis: str = "time"
    rate: float | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    delimiter: str | None = None
    decimal: str | None = None
    thousands: str | None = None
    header: int = 0
    units_row: int = 0
    skip: int = 0
    leave: tuple[str, ...] = ()
    na: tuple[str, ...] = ()
    wraps: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Trace:
    """One channel of one run: its values and where on the axis (mostly time, in seconds) they were taken.

    ``lines`` holds the line of each sample in a text file; ``record`` says what a sample is called in a binary one.
    """

    run: str
    name: str
    unit: str
    axis: FloatArray
    values: FloatArray
    origin: str
    axis_unit: str = "s"
    lines: NDArray[np.int64] | None = None
    attrs: Mapping[str, str] = field(default_factory=dict)

    def place(self, index: int) -> str:
        """Place of sample ``index`` in the file, in words."""
        if self.lines is not None:
            return f"line {self.lines[index]}"
        return f"{self.origin}, sample {index + 1}"


@dataclass
class Reading:
    """All that a reader found."""

    traces: list[Trace] = field(default_factory=list)
    remarks: Remarks = field(default_factory=Remarks)
    header: dict[str, Any] = field(default_factory=dict)
    run_attrs: dict[str, dict[str, str]] = field(default_factory=dict)
    synthetic: bool = False


def is_axis_name(name: str, axis: str) -> bool:
    """Return whether a column of this name is the axis: its own name, or any word for time when the axis is time."""
    word = name.strip().casefold()
    if word == axis.casefold():
        return True
    stem, _, unit = word.rpartition("_")  # t_s
    return axis == "time" and (word in TIME_WORDS or (stem in TIME_WORDS and unit in ("s", "ms", "us")))


def scaled_time(values: FloatArray, unit: str) -> FloatArray | None:
    """Times in seconds; None if ``unit`` is no unit of time."""
    scale = 1.0 if unit == "" else TIME_SCALES.get(unit.partition(" since ")[0].strip())
    if scale is None:
        return None
    return values if scale == 1.0 else values * scale


def names_of(candidates: Sequence[str], most: int = 12) -> str:
    """A list for a message, cut where it would be long."""
    shown = ", ".join(repr(name if len(name) <= 60 else name[:57] + "...") for name in candidates[:most])
    return shown + (f", and {len(candidates) - most} more" if len(candidates) > most else "")
