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
from dataclasses import replace

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings.readers.fields import Field, FieldTable, traces_of
from nonsmooth.recordings.readers.text_table import Cells, Numerals, Row, decoded, number, read_cells
from nonsmooth.recordings.reading import MAX_COLUMNS, Reading, Trace

_END = "***End_of_Header***"
_MAX_SEGMENTS = 1024
_MAX_COMMENTS = 64  # kept per segment

Header = dict[str, list[str]]


def read(data: bytes, reading: Reading) -> None:
    """Read a LabVIEW measurement file."""
    if reading.columns is not None or reading.rate is not None:
        raise ValueError("columns and rate do not concern a .lvm file, which says them itself; take channels by name")
    separator, lines = _lines(data, reading)
    header = _keys(lines, reading, "the file's header")
    reading.told = {key: " ".join(values) for key, values in header.items() if key}
    decimal = _word(header, "Decimal_Separator", ".")
    if decimal not in (".", ",") or decimal == separator:
        raise reading.error("", f"Decimal_Separator is {decimal[:20]!r}, expected '.' or ','")
    clocks = _word(header, "X_Columns", "One")
    if clocks not in ("One", "No", "Multi"):
        raise reading.error("", f"X_Columns is {clocks[:20]!r}, expected One, No or Multi")
    numerals = Numerals(decimal, reading.thousands, reading.na or ())
    rows, count, channels = _Rows(lines, decimal), 0, 0
    for line, _ in rows.to_header(1):
        raise reading.error(f"line {line}", "holds values before any segment's header")
    while rows.following is not None:
        line, first = rows.following
        place, count = f"line {line}", count + 1
        reading.few(count, "segments", place, _MAX_SEGMENTS)
        header = _keys(lines, reading, f"the segment's header that begins in {place}", first)
        names = _names(header, lines, line, clocks, reading)
        channels += len(names)
        reading.few(channels, f"channels in {count} segments so far", place)
        pairs = [text for name in names for text in (f"X_Value of {name}", name)]
        labels = pairs if clocks == "Multi" else ["X_Value", *names]
        wanted = range(clocks == "No", len(labels))
        table = rows.to_header(len(labels))
        cells = read_cells(table, labels, wanted, numerals, replace(reading), ends_with_newline=True)
        cut = rows.following is None and not data.endswith(b"\n") and rows.last < len(labels)
        if cut and len(cells.lines):
            raise reading.error(f"line {cells.lines[-1]}", "ends in the middle of a row: the file is cut short")
        run = f"Segment {count}"
        if rows.comments:
            more = len(rows.comments) - _MAX_COMMENTS
            said = rows.comments[:_MAX_COMMENTS] + ([f"(and {more} more)"] if more > 0 else [])
            reading.run_attrs[run] = {"comments": "\n".join(said)}
        reading.traces += _traces(run, line, header, names, cells, clocks, decimal, reading)
    if not reading.traces:
        raise reading.error("", f"holds no segment of data after its header; expected one that ends in {_END}")


def _lines(data: bytes, reading: Reading) -> tuple[str, Iterator[Row]]:
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

    def split() -> Iterator[Row]:
        special = False
        for line, text in enumerate(itertools.chain(top, stream), 1):
            # Blocks of other programs' data; their own business.
            special = special or text.startswith("***Start_Special***")
            if not special:
                yield line, text.rstrip("\r\n").split(separator)
            special = special and not text.startswith("***End_Special***")

    return separator, split()


def _keys(lines: Iterator[Row], reading: Reading, what: str, first: list[str] | None = None) -> Header:
    """Key and values of each line up to the end of a header."""
    found = {first[0].strip(): first[1:]} if first else {}
    for _, fields in lines:
        if fields[0].startswith(_END):
            return found
        if len(found) > 256:
            break
        if key := fields[0].strip():
            found[key] = fields[1:]
    raise reading.error("", f"{what} has no end; expected {_END}")


def _word(header: Header, key: str, default: str) -> str:
    value = (header.get(key) or [""])[0]
    return value.strip() or value[:1] or default


class _Rows:
    """Rows of a file without their comments, from one header to the next."""

    def __init__(self, lines: Iterator[Row], decimal: str) -> None:
        self.lines, self.decimal = lines, decimal
        self.comments: list[str] = []
        self.following: Row | None = None
        self.last = 0

    def to_header(self, width: int) -> Iterator[Row]:
        """The rows up to the header that follows, without what stands behind ``width`` fields."""
        self.comments, self.following, self.last = [], None, 0
        for line, fields in self.lines:
            key = fields[0].strip()
            if (key[:1].isalpha() or key.startswith("*")) and number(key, self.decimal) is None:
                self.following = line, fields
                return
            if any(map(str.strip, fields)):
                said = " ".join(text.strip() for text in fields[width:] if text.strip())
                self.comments += [f"line {line}: {said[:400]}"] if said else []
                self.last = len(fields)
                yield line, fields[:width]


def _names(header: Header, lines: Iterator[Row], line: int, clocks: str, reading: Reading) -> list[str]:
    """The names of a segment's channels."""
    said = _word(header, "Channels", "")
    if not (said.isascii() and said.isdigit()) or not 0 < int(said[:9]) <= MAX_COLUMNS:
        raise reading.error(f"line {line}", f"Channels is {said[:20]!r}, expected a number from 1 to {MAX_COLUMNS}")
    n = int(said)
    at, top = next(lines, (line, [""]))
    if top[0].strip() != "X_Value":
        raise reading.error(f"line {at}", "expected the names of the columns, beginning with X_Value")
    names = top[1:] if clocks != "Multi" else top[1::2]
    if len(names) < n:
        raise reading.error(f"line {at}", f"names {len(names)} columns, the segment has {n} channels")
    return [name.strip() for name in names[:n]]


def _traces(
    run: str, line: int, header: Header, names: list[str], cells: Cells, clocks: str, decimal: str, reading: Reading
) -> Iterator[Trace]:
    at = f"line {line}"

    def texts(key: str) -> list[str]:
        return ([text.strip() for text in header.get(key, [])] + [""] * len(names))[: len(names)]

    def numbers(key: str, default: float) -> FloatArray:
        found = [number(text, decimal) if text else default for text in texts(key)]
        for k, (text, value) in enumerate(zip(texts(key), found, strict=True), 1):
            if text and (value is None or not math.isfinite(value)):
                raise reading.error(at, f"{key} of channel {k} is {text[:40]!r}, expected a number")
        return np.array(found, float)

    start, step, said = numbers("X0", 0.0), numbers("Delta_X", math.nan), numbers("Samples", math.nan)
    units, dates, times = map(texts, ("Y_Unit_Label", "Date", "Time"))
    dimension = texts("X_Dimension")[0] or "Time"
    if dimension.casefold() != reading.axis.casefold():
        raise reading.error(at, f"its channels are over {dimension!r}; read it with axis={dimension.lower()!r}")
    unit = "s" if reading.axis == "time" else texts("X_Unit_Label")[0]
    for k, name in enumerate(names):
        column = 2 * k + 1 if clocks == "Multi" else k + 1
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
        if start[k] != start[0]:
            reading.of(run, name, f"its clock begins at X0 = {start[k]:g}, that of the first channel at {start[0]:g}")
        begun, origin = f"{dates[k]} {times[k]}".strip(), f"column {k + 2} from line {line} on"
        clock = Field(reading.axis, unit, axis, f"X_Value of {name}", held)
        channel = Field(name, units[k], values, origin, rows, {"started": begun} if begun else {})
        yield from traces_of(FieldTable(run, [clock, channel], len(cells.lines), cells.lines), reading)
