"""Any table as text: CSV, TSV, columns separated by white space, with a header or without one.

Which column is the time is told by its name, or by ``columns``; a column may number the runs. Sheets of a workbook are
read as such text.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.readers.fields import Field, FieldTable, chosen, traces_of
from nonsmooth.recordings.readers.text_table import Numerals, Row, checked_header, decoded, read_cells, rows, sniffed
from nonsmooth.recordings.reading import Reading, Trace, names_of

_COMMENT = ("#", "%")
_STAMP = re.compile(r"[\d:/.,+\-TZ ]*\d:\d[\d:/.,+\-TZ ]*")
_LABELLED = re.compile(r"([^\W\d][^:=]*?)\s*[:=]\s*(\S*)")
_ARROW = re.compile(r"(\d\d:\d\d:\d\d\.\d+) -> ")  # the serial monitor's clock before each line
_SEARCHED = 60  # lines searched for the first of numbers, where a table cannot be read


def read(data: bytes, reading: Reading) -> None:
    """Read a table."""
    read_lines(decoded(data, reading), "Run #1", reading, ends=data.endswith((b"\n", b"\r")))


def read_lines(
    stream: Iterable[str],
    run: str,
    reading: Reading,
    *,
    ends: bool = True,
    delimiter: str | None = None,
) -> None:
    """Read a table line by line; where that fails, say which options its first lines ask for."""
    stream = iter(stream)
    top: list[str] = []
    comments: list[str] = []
    kept = _kept(stream, reading, top, comments)
    try:
        first = next((text for text in kept if text.strip()), "")
        at = len(top)
        if match := re.fullmatch(r'"?sep=(.)"?\s*', first):  # of spreadsheets
            delimiter, first = match[1], next((text for text in kept if text.strip()), "")
            at = len(top)
        if not first:
            raise reading.error("", "holds no table, only blank lines or comments")
        delimiter = reading.delimiter or delimiter or sniffed(first)
        lines: Iterator[str] = itertools.chain([first], kept)
        if _ARROW.match(first):
            lines = (_ARROW.sub(rf"\1{delimiter}", text) for text in lines)
        reading.traces += _table(rows(lines, delimiter, reading, at), run, delimiter, reading, ends)
    except DataFileError as error:
        advice = "" if reading.header else _advice([*top, *itertools.islice(stream, max(0, _SEARCHED - len(top)))])
        raise DataFileError(f"{error}{advice}") from error
    reading.told.setdefault("comments", comments)


def _kept(stream: Iterable[str], reading: Reading, top: list[str], comments: list[str]) -> Iterator[str]:
    """The lines of the table; others are blank, so that lines keep their numbers."""
    begun = False
    skip, leave = (reading.skip, ()) if isinstance(reading.skip, int) else (0, tuple(reading.skip))
    for line, text in enumerate(stream, 1):
        top += [text] if line <= _SEARCHED or not begun else []
        begin = text.lstrip()
        above = line <= skip or line < (reading.header or 0)
        begun = begun or not (above or begin == "" or begin.startswith(_COMMENT))
        if not begun and line > skip and begin.startswith(_COMMENT):
            comments.append(text.strip())
        left = not begun or (line != reading.header and bool(leave) and begin.startswith(leave))
        yield "\n" if left else text
        if begun and not leave and line >= _SEARCHED:
            yield from stream


def _table(table: Iterator[Row], run: str, delimiter: str, reading: Reading, ends: bool) -> Iterator[Trace]:
    numerals = Numerals.of(delimiter, reading)
    line, fields = next(table)
    header, table = _header(checked_header(fields, line, reading), table, line, numerals, reading)
    if reading.units_row:
        units = _units(table, reading.units_row, reading) + [""] * len(header)
        header = [f"{name} ({unit})" if unit else name for name, unit in zip(header, units, strict=False)]
    picked = chosen(header, reading)
    if reading.columns is not None and set(picked) <= {"time", "run"}:
        there = names_of([name for name in header if name.strip()])
        raise reading.error(
            "", f"columns= names no channel, and leaves out what it does not name; the columns are {there}"
        )
    wanted = list(dict.fromkeys(column for column, _ in picked.values()))
    stamped = picked.get("time", (-1, ""))[0] if reading.axis == "time" else -1
    cells = read_cells(table, header, wanted, numerals, reading, ends_with_newline=ends, stamped=stamped)
    left = [text for k, text in enumerate(header) if k not in wanted and text.strip()]
    if left:
        reading.say(f"columns not asked for are left out: {names_of(left)}")
    found = [
        Field(name, unit, cells.values[c], f"column {c + 1} ({header[c]})", cells.rows[c])
        for name, (c, unit) in picked.items()
    ]
    reading.told.update(delimiter=delimiter, columns=len(header), rows=len(cells.lines))
    yield from traces_of(FieldTable(run, found, len(cells.lines), cells.lines), reading)


def _header(
    top: list[str], table: Iterator[Row], line: int, numerals: Numerals, reading: Reading
) -> tuple[list[str], Iterator[Row]]:
    """The header's fields and the rows below; a first row of numbers only is data, its columns have places."""
    labelled = [_LABELLED.fullmatch(text) for text in top]
    if len(top) > 1 and all(match and (not match[2] or numerals.some(match[2])) for match in labelled):
        names = [match[1] for match in labelled if match]
        whole = itertools.chain([(line, top)], table)
        return names, ((at, [re.sub(r"^[^:=]*[:=]", "", text) for text in fields]) for at, fields in whole)
    plain = all(text == "" or _STAMP.fullmatch(text) or numerals.some(text) for text in top)
    if reading.header or not plain or not any(map(numerals.some, top)):
        return top, table
    if reading.columns is None and reading.rate is None:
        raise reading.error(
            f"line {line}",
            "the table has no header, so its columns are not known; name them by place, columns={'time': 0, 'x': 1}",
        )
    return [f"column {k + 1}" for k in range(len(top))], itertools.chain([(line, top)], table)


def _units(table: Iterator[Row], at: int, reading: Reading) -> list[str]:
    """The row of units, without brackets; those above it are passed over."""
    line, fields = next((row for row in table if row[0] >= at), (0, []))
    if line == at:
        return [text.strip().strip("[]()").strip() for text in fields]
    raise reading.error(f"line {at}", "is no row of units below the header, as units_row says")


def _advice(head: list[str]) -> str:
    """Options that would fit a table whose numbers begin further down."""

    def fields(text: str) -> list[str]:
        return [field.strip().strip('"') for field in re.split(r"[\t;,|]|\s+", text.strip())]

    def numeric(text: str) -> bool:
        found, some = fields(text), Numerals().some
        return any(map(some, found)) and all(not f or some(f) or bool(_STAMP.fullmatch(f)) for f in found)

    words = [bool(text.strip()) and not text.lstrip().startswith(_COMMENT) for text in head]
    first = next((k for k, text in enumerate(head) if words[k] and numeric(text)), 0)
    above = [k for k in range(first) if words[k]]
    if len(above) < 2:
        return ""
    two = f", or header={above[-2] + 1}, units_row={above[-1] + 1} where the units stand there"
    return f"; numbers begin in line {first + 1}: give header={above[-1] + 1}{two}"
