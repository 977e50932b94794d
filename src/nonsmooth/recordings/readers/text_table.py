"""Tables as text: encoding, separators, and numbers read strictly, column by column.

Blank fields are dropped per column, never per row: each column keeps the rows in which it has a value.
"""

from __future__ import annotations

import csv
import io
import itertools
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings.limits import MAX_COLUMNS
from nonsmooth.recordings.reading import Source
from nonsmooth.recordings.remarks import Remarks

__all__ = ["Cells", "Row", "checked_header", "decoded", "number", "read_cells", "rows", "split_unit"]

#: Line number and fields.
Row = tuple[int, list[str]]

_LONGEST_NUMBER = 64  # characters; a double has at most 24 that matter
_SNIFFED = 20  # rows looked at to tell the decimal mark


def decoded(data: bytes, source: Source, remarks: Remarks) -> io.TextIOWrapper:
    """The text of a file: UTF-8 or UTF-16 with or without mark, else Windows-1252 (with a remark)."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    else:
        encoding = "utf-8-sig"
        nul = data.find(b"\0")
        if nul >= 0:
            raise source.error(f"line {_line_of(data, nul)}", "holds a zero byte; this is not a text table")
    try:
        data.decode(encoding)
    except UnicodeDecodeError as error:
        where = f"line {_line_of(data, error.start)}"
        if encoding == "utf-16":
            raise source.error(where, "is not valid UTF-16, as its mark says; the file may be cut short") from None
        encoding = "cp1252"
        try:
            data.decode(encoding)
        except UnicodeDecodeError:
            raise source.error(where, "is neither UTF-8 nor Windows-1252 text") from None
        remarks.say(f"{where}: the text is not UTF-8; read as Windows-1252, so check names and units")
    return io.TextIOWrapper(io.BytesIO(data), encoding=encoding, newline="")


def rows(lines: Iterable[str], delimiter: str, source: Source, first_line: int = 1) -> Iterator[Row]:
    """Line number and fields of each row that is not empty. A delimiter of " " stands for any white space."""
    if delimiter == " ":
        for line, text in enumerate(lines, first_line):
            fields = text.split()
            if fields:
                yield line, fields
        return
    reader = csv.reader(lines, delimiter=delimiter, strict=True)
    while True:
        begin = first_line + reader.line_num
        try:
            fields = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            message = f"cannot be split into fields ({error}); a quote may be missing, or the file is cut short"
            raise source.error(f"line {begin}", message) from None
        if fields:
            yield begin, fields


def checked_header(fields: list[str], line: int, source: Source) -> list[str]:
    """The names of the columns, stripped; DataFileError if there are absurdly many."""
    if len(fields) > MAX_COLUMNS:
        raise source.error(f"line {line}", f"has {len(fields)} columns; at most {MAX_COLUMNS} are read")
    return [field.strip() for field in fields]


def number(field: str, decimal: str) -> float | None:
    """The number in a field, strictly; None if it is none. Underscores and foreign digits are none."""
    text = field.strip()
    if len(text) > _LONGEST_NUMBER or not text.isascii() or "_" in text:
        return None
    if decimal == ",":
        if "." in text:
            return None
        text = text.replace(",", ".")
    try:
        return float(text)
    except ValueError:
        return None


@dataclass(frozen=True, eq=False)
class Cells:
    """The columns of a table: values, and the rows (from 0) in which each has one; the line of every row."""

    values: list[FloatArray]
    rows: list[NDArray[np.int64]]
    lines: NDArray[np.int64]

    def places(
        self, held: NDArray[np.int64], axis: NDArray[np.int64], source: Source, complaint: str
    ) -> NDArray[np.int64]:
        """Place among the rows of the axis of each row in which a channel has a value; all must be there."""
        place = np.searchsorted(axis, held)
        missing = np.flatnonzero(axis[np.minimum(place, len(axis) - 1)] != held) if len(axis) else np.arange(len(held))
        if len(missing):
            raise source.error(f"line {self.lines[held[missing[0]]]}", complaint)
        return place

    def blanks(self, column: int) -> tuple[int, int]:
        """Number of blank rows after a column's last value, and before it."""
        held = self.rows[column]
        if len(held) == 0:
            return len(self.lines), 0
        last = int(held[-1])
        return len(self.lines) - 1 - last, last + 1 - len(held)


def read_cells(
    table: Iterator[Row],
    labels: Sequence[str],
    wanted: Sequence[int],
    decimal: str | None,
    source: Source,
    remarks: Remarks,
    *,
    ends_with_newline: bool,
) -> Cells:
    """Read the rows below a header. Only ``wanted`` columns must hold numbers.

    A row with more fields than the header is an error, one with fewer is remarked; a last line with fewer and no
    line end means that the file is cut short.
    """
    n = len(labels)
    if decimal is None:
        head = [row for _, row in zip(range(_SNIFFED), table, strict=False)]
        decimal = _decimal_of(head, wanted)
        table = itertools.chain(head, table)
    values = [array("d") for _ in wanted]
    held = [array("q") for _ in wanted]
    lines = array("q")
    pairs = sorted(enumerate(wanted), key=lambda pair: pair[1])
    short, first_short, last_short = 0, 0, False
    for row, (line, fields) in enumerate(table):
        if len(fields) > n and any(field.strip() for field in fields[n:]):
            raise source.error(f"line {line}", f"has {len(fields)} fields, the header has {n}")
        last_short = len(fields) < n
        if last_short:
            short, first_short = short + 1, first_short or line
        lines.append(line)
        for k, column in pairs:
            # A short row costs what it weighs, however many columns the header announces.
            if column >= len(fields):
                break
            field = fields[column]
            if field and not field.isspace():
                value = number(field, decimal)
                if value is None:
                    shown = field if len(field) <= 40 else field[:37] + "..."
                    raise source.error(
                        f"line {line}",
                        f"column {column + 1} ({labels[column]!r}) holds {shown!r}, expected a number with the "
                        f"decimal mark {decimal!r}, or nothing",
                    )
                values[k].append(value)
                held[k].append(row)
    if last_short and not ends_with_newline:
        raise source.error(f"line {lines[-1]}", f"ends after fewer than {n} fields: the file is cut short")
    if short:
        remarks.say(f"{short} rows have fewer fields than the header, first line {first_short}; taken as blank")
    return Cells(
        [np.asarray(v) for v in values], [np.asarray(h) for h in held], np.asarray(lines),
    )  # fmt: skip


def split_unit(text: str, brackets: str = "()") -> tuple[str, str]:
    """``"Force (push) (N/(m/s))"`` -> ``("Force (push)", "N/(m/s)")``: the last balanced bracket is the unit."""
    stripped = text.strip()
    opening, closing = brackets[0], brackets[1]
    if not stripped.endswith(closing):
        return stripped, ""
    depth = 0
    for i in range(len(stripped) - 1, -1, -1):
        depth += (stripped[i] == closing) - (stripped[i] == opening)
        if depth == 0:
            name = stripped[:i].strip()
            return (name, stripped[i + 1 : -1].strip()) if name else (stripped, "")
    return stripped, ""


def _decimal_of(head: list[Row], wanted: Sequence[int]) -> str:
    """A comma, if there are fields that are numbers with one and none that are numbers with a point."""
    fields = [row[k] for _, row in head for k in wanted if k < len(row)]
    commas = any("," in f and number(f, ",") is not None for f in fields)
    points = any("." in f and number(f, ".") is not None for f in fields)
    return "," if commas and not points else "."


def _line_of(data: bytes, position: int) -> int:
    return data.count(b"\n", 0, position) + 1
