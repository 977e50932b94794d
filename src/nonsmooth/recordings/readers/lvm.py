"""LabVIEW measurement files (``.lvm``): a header, then segments of ``Samples``, ``X0``, ``Delta_X`` and rows of values.

Each segment is a run. ``Samples`` counts the first write only, so rows are read on to the next header or the end.
Channels may have unequal numbers of samples; the k-th value of a channel is its k-th sample, whatever row it is
printed in. The ``X_Value`` column is the clock of the first channel. A channel with the same step follows it, shifted
by the difference of their ``X0`` (the column does not add up the rounding of ``Delta_X``); any other has
X0 + k Delta_X.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings.readers.fields import Field, FieldTable, traces_of
from nonsmooth.recordings.readers.text_table import Cells, Numerals, decoded, number, read_cells
from nonsmooth.recordings.reading import MAX_COLUMNS, Reading, Trace

_END = "***End_of_Header***"
_MAX_SEGMENTS = 1024
_MAX_COMMENTS = 64  # kept per segment

Lines = Iterator[tuple[int, list[str]]]


@dataclass
class _Segment:
    """A segment's header, the names of its channels, its columns as read, and the comments behind its rows."""

    line: int
    names: list[str]
    fields: dict[str, list[str]]
    cells: Cells
    comments: list[str]


def read(data: bytes, reading: Reading) -> None:
    """Read a LabVIEW measurement file."""
    if reading.columns is not None or reading.rate is not None:
        raise ValueError("columns and rate do not concern a .lvm file, which says them itself; take channels by name")
    separator, lines = _lines(data, reading)
    header = _keys(lines, reading, "the file's header")
    reading.told = {key: " ".join(values) for key, values in header.items() if key}
    decimal = _word(header, "Decimal_Separator", ".") or "."
    if decimal not in ".," or len(decimal) != 1 or decimal == separator:
        raise reading.error("", f"Decimal_Separator is {decimal[:20]!r}, expected '.' or ','")
    clocks = _word(header, "X_Columns", "One")
    if clocks not in ("One", "No", "Multi"):
        raise reading.error("", f"X_Columns is {clocks[:20]!r}, expected One, No or Multi")
    ends, numerals = data.endswith(b"\n"), Numerals(decimal, reading.thousands, reading.na or ())
    for k, segment in enumerate(_segments(lines, clocks, numerals, reading, ends), 1):
        run = f"Segment {k}"
        if segment.comments:
            more = len(segment.comments) - _MAX_COMMENTS
            said = segment.comments[:_MAX_COMMENTS] + ([f"(and {more} more)"] if more > 0 else [])
            reading.run_attrs[run] = {"comments": "\n".join(said)}
        reading.traces += _traces(run, segment, clocks, decimal, reading)
    if not reading.traces:
        raise reading.error("", f"holds no segment of data after its header; expected one that ends in {_END}")


def _lines(data: bytes, reading: Reading) -> tuple[str, Lines]:
    """The separator, and the lines split by it, with their numbers."""
    stream = decoded(data, reading)
    top: list[str] = []
    separator = "\t"
    for text in stream:
        top.append(text)
        if text.startswith("Separator"):
            separator = "," if text.rstrip().endswith("Comma") else "\t"
        if text.startswith(_END) or len(top) > 200:
            break
    if not top or not top[0].lstrip().startswith("LabVIEW Measurement"):
        raise reading.error("line 1", "expected 'LabVIEW Measurement'")

    def split() -> Lines:
        special = False
        for number_, text in enumerate(itertools.chain(top, stream), 1):
            # Blocks of other programs' data; their own business.
            if text.startswith("***Start_Special***"):
                special = True
            if not special:
                yield number_, text.rstrip("\r\n").split(separator)
            if text.startswith("***End_Special***"):
                special = False

    return separator, split()


def _keys(lines: Lines, reading: Reading, what: str, first: list[str] | None = None) -> dict[str, list[str]]:
    """Key and values of each line up to the end of a header."""
    found = {first[0].strip(): first[1:]} if first else {}
    for _, fields in lines:
        if fields[0].startswith(_END):
            return found
        if len(found) > 256:
            break
        if fields[0].strip():
            found[fields[0].strip()] = fields[1:]
    raise reading.error("", f"{what} has no end; expected {_END}")


def _word(header: dict[str, list[str]], key: str, default: str) -> str:
    values = header.get(key) or [default]
    return values[0].strip() if len(values[0].strip()) else values[0][:1] or default


def _segments(lines: Lines, clocks: str, numerals: Numerals, reading: Reading, ends: bool) -> Iterator[_Segment]:
    """Each segment: its header, the names of its columns, and the rows up to the next header."""
    count, channels, decimal = 0, 0, numerals.decimal or "."
    begun = next(((line, fields) for line, fields in lines if any(f.strip() for f in fields)), None)
    while begun is not None:
        line, fields = begun
        if not _is_key(fields[0], decimal):
            raise reading.error(f"line {line}", "holds values before any segment's header")
        count += 1
        if count > _MAX_SEGMENTS:
            raise reading.error(f"line {line}", f"holds more than {_MAX_SEGMENTS} segments")
        header, names = _begin(line, fields, lines, clocks, reading)
        channels += len(names)
        if channels > MAX_COLUMNS:
            raise reading.error(
                f"line {line}", f"its {count} segments hold {channels} channels so far; at most {MAX_COLUMNS} are read"
            )
        labels = (
            [text for name in names for text in (f"X_Value of {name}", name)]
            if clocks == "Multi"
            else (["X_Value", *names])
        )
        rows = _Rows(lines, len(labels), decimal)
        wanted = range(clocks == "No", len(labels))
        cells = read_cells(iter(rows), labels, wanted, numerals, replace(reading), ends_with_newline=True)
        if not ends and rows.following is None and len(cells.lines) and rows.last < len(labels):
            raise reading.error(f"line {cells.lines[-1]}", "ends in the middle of a row: the file is cut short")
        yield _Segment(line, names, header, cells, rows.comments)
        begun = rows.following


class _Rows:
    """Rows of a segment without their comments, up to the header that follows."""

    def __init__(self, lines: Lines, width: int, decimal: str) -> None:
        self.lines, self.width, self.decimal = lines, width, decimal
        self.comments: list[str] = []
        self.following: tuple[int, list[str]] | None = None
        self.last = 0

    def __iter__(self) -> Iterator[tuple[int, list[str]]]:
        for line, fields in self.lines:
            if not any(f.strip() for f in fields):
                continue
            if _is_key(fields[0], self.decimal):
                self.following = line, fields
                return
            said = " ".join(text.strip() for text in fields[self.width :] if text.strip())
            self.comments += [f"line {line}: {said[:400]}"] if said else []
            self.last = len(fields)
            yield line, fields[: self.width]


def _is_key(text: str, decimal: str) -> bool:
    key = text.strip()
    return bool(key) and (key[0].isalpha() or key.startswith("*")) and number(key, decimal) is None


def _begin(
    line: int, fields: list[str], lines: Lines, clocks: str, reading: Reading
) -> tuple[dict[str, list[str]], list[str]]:
    """The header of a segment, and the names of its channels."""
    header = _keys(lines, reading, f"the segment's header that begins in line {line}", fields)
    said = _word(header, "Channels", "")
    if not (said.isascii() and said.isdigit()) or not 0 < int(said[:9]) <= MAX_COLUMNS:
        raise reading.error(f"line {line}", f"Channels is {said[:20]!r}, expected a number from 1 to {MAX_COLUMNS}")
    n = int(said)
    at, top = next(lines, (line, []))
    if not top or top[0].strip() != "X_Value":
        raise reading.error(f"line {at}", "expected the names of the columns, beginning with X_Value")
    names = top[1:] if clocks != "Multi" else top[1::2]
    if len(names) < n:
        raise reading.error(f"line {at}", f"names {len(names)} columns, the segment has {n} channels")
    return header, [name.strip() for name in names[:n]]


def _traces(run: str, segment: _Segment, clocks: str, decimal: str, reading: Reading) -> Iterator[Trace]:
    at = f"line {segment.line}"
    n, cells = len(segment.names), segment.cells
    start, step, said = (
        _numbers(segment, key, default, decimal, at, reading)
        for key, default in (("X0", 0.0), ("Delta_X", math.nan), ("Samples", math.nan))
    )
    units, dates, times = (_texts(segment, key, n) for key in ("Y_Unit_Label", "Date", "Time"))
    dimension = (_texts(segment, "X_Dimension", n)[0] or "Time").strip()
    if dimension.casefold() != reading.axis.casefold():
        raise reading.error(at, f"its channels are over {dimension!r}; read it with axis={dimension.lower()!r}")
    unit = "s" if reading.axis == "time" else _texts(segment, "X_Unit_Label", n)[0]
    for k, name in enumerate(segment.names):
        column = 2 * k + 1 if clocks == "Multi" else k + (clocks != "No")
        rows, values = cells.rows[column], cells.values[column]
        if clocks == "Multi":
            axis, held = cells.values[column - 1], cells.rows[column - 1]
        elif clocks == "One" and np.array_equal(step[k], step[0], equal_nan=True) and len(cells.values[0]):
            axis, held = cells.values[0] + (start[k] - start[0]), cells.rows[0]
        else:
            if len(values) > 1 and not step[k] > 0:
                raise reading.error(at, f"run {run!r}, channel {name!r}: Delta_X is {step[k]:g}, expected a step > 0")
            axis, held = start[k] + np.arange(len(values)) * (step[k] if step[k] > 0 else 1.0), rows
        if said[k] < len(values):
            reading.of(run, name, f"Samples says {said[k]:g} (its first write), {len(values)} were read")
        elif said[k] > len(values):
            reading.of(run, name, f"Samples says {said[k]:g}, only {len(values)} follow; the file may be cut short")
        if k and start[k] != start[0]:
            reading.of(run, name, f"its clock begins at X0 = {start[k]:g}, that of the first channel at {start[0]:g}")
        begun, origin = f"{dates[k]} {times[k]}".strip(), f"column {k + 2} from line {segment.line} on"
        clock = Field(reading.axis, unit, axis, f"X_Value of {name}", held)
        channel = Field(name, units[k], values, origin, rows, {"started": begun} if begun else {})
        yield from traces_of(FieldTable(run, [clock, channel], len(cells.lines), cells.lines), reading)


def _texts(segment: _Segment, key: str, n: int) -> list[str]:
    return ([text.strip() for text in segment.fields.get(key, [])] + [""] * n)[:n]


def _numbers(segment: _Segment, key: str, default: float, decimal: str, place: str, reading: Reading) -> FloatArray:
    found = np.full(len(segment.names), default)
    for k, text in enumerate(_texts(segment, key, len(segment.names))):
        if text:
            value = number(text, decimal)
            if value is None or not math.isfinite(value):
                raise reading.error(place, f"{key} of channel {k + 1} is {text[:40]!r}, expected a number")
            found[k] = value
    return found
