"""Tables as text: encoding, separators, and numbers read strictly, column by column.

Blank fields are dropped per column, never per row: each column keeps the rows in which it has a value.
"""

from __future__ import annotations

import csv
import io
import itertools
import re
from array import array
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import IntArray
from nonsmooth.recordings.reading import Reading

#: Line number and fields.
Row = tuple[int, list[str]]

_LONGEST_NUMBER = 64  # characters; a double has at most 24 that matter
_CHUNK = 4096  # rows read at once
_SNIFFED = 20  # rows looked at to tell the decimal mark


def decoded(data: bytes, reading: Reading) -> io.TextIOWrapper:
    """The text of a file: UTF-8 or UTF-16 with or without mark, else Windows-1252 (with a remark)."""
    encoding = "utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig"
    if encoding != "utf-16" and (nul := data.find(b"\0")) >= 0:
        raise reading.error(f"line {_line_of(data, nul)}", "holds a zero byte; this is not a text table")
    try:
        data.decode(encoding)
    except UnicodeDecodeError as error:
        where = f"line {_line_of(data, error.start)}"
        if encoding == "utf-16":
            raise reading.error(where, "is not valid UTF-16, as its mark says; the file may be cut short") from None
        encoding = "cp1252"
        try:
            data.decode(encoding)
        except UnicodeDecodeError:
            raise reading.error(where, "is neither UTF-8 nor Windows-1252 text") from None
        reading.say(f"{where}: the text is not UTF-8; read as Windows-1252, so check names and units")
    return io.TextIOWrapper(io.BytesIO(data), encoding=encoding, newline="")


def sniffed(line: str) -> str:
    """The character between the fields of a line, " " where it holds none."""
    outside = "".join(line.split('"')[::2])
    return next((d for d in "\t;,|" if d in outside), " ")


def rows(lines: Iterable[str], delimiter: str, reading: Reading, first_line: int = 1) -> Iterator[Row]:
    """Line number and fields of each row that is not empty. A delimiter of " " stands for any white space."""
    if delimiter == " ":
        yield from ((line, text.split()) for line, text in enumerate(lines, first_line) if text.strip())
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
            raise reading.error(f"line {begin}", message) from None
        if fields:
            yield begin, fields


def checked_header(fields: list[str], line: int, reading: Reading) -> list[str]:
    """The names of the columns, stripped; DataFileError if there are absurdly many."""
    reading.few(len(fields), "columns", f"line {line}")
    return [field.strip() for field in fields]


def number(field: str, decimal: str, thousands: str | None = None) -> float | None:
    """The number in a field, strictly; None if it is none. Underscores and foreign digits are none; 1.5D+00 is 1.5."""
    text = field.strip()
    if thousands and thousands in text:
        if not re.fullmatch(rf"[+-]?\d{{1,3}}(?:{re.escape(thousands)}\d{{3}})+(?:\D.*)?", text):
            return None
        text = text.replace(thousands, "")
    if len(text) > _LONGEST_NUMBER or not text.isascii() or "_" in text:
        return None
    if decimal == ",":
        if "." in text:
            return None
        text = text.replace(",", ".")
    try:
        return float(text.replace("D", "E").replace("d", "e"))
    except ValueError:
        return None


class Numerals(NamedTuple):
    """Marks of the numbers in a table: decimal (None: unknown), between thousands, and texts for a missing one."""

    decimal: str | None = None
    thousands: str | None = None
    na: Sequence[str] = ()

    @classmethod
    def of(cls, delimiter: str, reading: Reading) -> Numerals:
        """As they are asked for; a mark that separates fields or thousands is no decimal mark."""
        taken = delimiter if reading.thousands not in (".", ",") else reading.thousands
        return cls(reading.decimal or {",": ".", ".": ","}.get(taken), reading.thousands, reading.na or ())

    def some(self, field: str) -> bool:
        """Return whether it is a number, or the mark of a missing one."""
        text = field.strip()
        return text in self.na or any(number(text, d, self.thousands) is not None for d in (self.decimal or ".,"))


class Cells(NamedTuple):
    """Columns of a table by place: values, and the rows (from 0) in which each has one; the line of every row."""

    values: dict[int, NDArray[Any]]
    rows: dict[int, IntArray]
    lines: IntArray


def read_cells(
    table: Iterator[Row],
    labels: Sequence[str],
    wanted: Sequence[int],
    numerals: Numerals,
    reading: Reading,
    *,
    ends_with_newline: bool,
    stamped: int = -1,
) -> Cells:
    """Read the rows below a header. Only ``wanted`` columns must hold numbers; ``stamped`` may hold time stamps.

    A row with more fields than the header is an error, one with fewer is remarked; a last line with fewer and no
    line end means that the file is cut short.
    """
    n = len(labels)
    head = [row for _, row in zip(range(_SNIFFED), table, strict=False)]
    decimal, thousands, na = numerals.decimal, numerals.thousands, {*numerals.na}
    if decimal is None:  # a comma, if there are fields that are numbers with one and none that are with a point
        fields = [row[k] for _, row in head for k in wanted if k < len(row)]
        commas, points = (any(mark in f and number(f, mark, thousands) is not None for f in fields) for mark in ",.")
        decimal = "," if commas and not points else "."
    begins = next((row[stamped] for _, row in head if len(row) > stamped >= 0 and row[stamped].strip()), "0")
    stamps: list[str] | None = None if number(begins, decimal, thousands) is not None else []
    values = {column: array("d") for column in wanted}
    held = {column: array("q") for column in wanted}
    lines, ordered = array("q"), sorted(wanted)
    short, first_short, last_short = 0, 0, False
    table = itertools.chain(head, table)
    while chunk := list(itertools.islice(table, _CHUNK)):
        begin, slow = len(lines), ordered
        lines.extend(line for line, _ in chunk)
        if all(len(fields) == n for _, fields in chunk):
            last_short, slow = False, []
            for column in ordered:
                texts = [] if stamps is not None and column == stamped else [fields[column] for _, fields in chunk]
                plain = None if not na.isdisjoint(map(str.strip, texts)) else _plain(texts, decimal)
                if plain is None:
                    slow.append(column)
                else:
                    values[column].extend(plain)
                    held[column].extend(range(begin, begin + len(chunk)))
        for row, (line, fields) in enumerate(chunk, begin) if slow else ():
            if len(fields) > n and any(field.strip() for field in fields[n:]):
                raise reading.error(f"line {line}", f"has {len(fields)} fields, the header has {n}")
            last_short = len(fields) < n
            if last_short:
                short, first_short = short + 1, first_short or line
            for column in slow:
                # A short row costs what it weighs, however many columns the header announces.
                if column >= len(fields):
                    break
                field = fields[column]
                if not field or field.isspace() or field.strip() in na:
                    continue
                if stamps is not None and column == stamped:
                    stamps.append(field)
                else:
                    value = number(field, decimal, thousands)
                    if value is None:
                        raise reading.error(f"line {line}", _no_number(column, fields, labels, decimal, line, row == 0))
                    values[column].append(value)
                held[column].append(row)
    if last_short and not ends_with_newline:
        raise reading.error(f"line {lines[-1]}", f"ends after fewer than {n} fields: the file is cut short")
    if short:
        reading.say(f"{short} rows have fewer fields than the header, first line {first_short}; taken as blank")
    columns = {column: np.asarray(found) for column, found in values.items()}
    if stamps is not None:
        columns[stamped] = np.array(stamps, object)
    return Cells(columns, {column: np.asarray(rows) for column, rows in held.items()}, np.asarray(lines))


def _plain(texts: list[str], decimal: str) -> list[float] | None:
    """The numbers, where all fields hold plain ones; None leaves it to a closer look at each."""
    joined = "".join(texts)
    if not texts or not joined.isascii() or "_" in joined or len(joined) > _LONGEST_NUMBER * len(texts):
        return None
    if decimal == ",":
        if "." in joined:
            return None
        texts = [text.replace(",", ".") for text in texts]
    try:
        return list(map(float, texts))
    except ValueError:
        return None


def _no_number(column: int, fields: list[str], labels: Sequence[str], decimal: str, line: int, first: bool) -> str:
    """A field that is no number, and the option that would make it one or leave it out."""
    field = fields[column]
    shown = field if len(field) <= 40 else field[:37] + "..."
    marks = [(d, t) for d in ".," for t in ".,' " if d != t and number(field, d, t) is not None]
    if marks:
        options = f"if it is one, decimal={marks[0][0]!r}, thousands={marks[0][1]!r}"
    elif not any(number(text, decimal) is not None for text in fields):
        options = f"if units stand in this line, units_row={line}; else " if first else ""
        options += f"leave out the lines that begin like this one, skip={fields[0].strip()[:12]!r}"
    else:
        options = f"if it marks a missing value, na={shown.strip()!r}"
    said = f"column {column + 1} ({labels[column]!r}) holds {shown!r}, expected a number with the decimal mark"
    return f"{said} {decimal!r}, or nothing; {options}"


def _line_of(data: bytes, position: int) -> int:
    return data.count(b"\n", 0, position) + 1
