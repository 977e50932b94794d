"""PASCO Capstone's CSV export: one header row, the columns of all runs side by side.

A header reads ``<measurement>[, Ch <port>] (<unit>) <run>``; the unit may be missing and the run's name is free text.
What ends a header can therefore not be told from that header alone: the ``Time`` columns begin with a known word, so
they give the names of the runs, and every other header must end with one of these. Fields are separated by ``,`` with
a decimal point, or by ``;`` with a decimal comma.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import replace

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.readers.fields import Field, FieldTable, split_unit, traces_of
from nonsmooth.recordings.readers.text_table import Numerals, Row, checked_header, decoded, read_cells, rows, sniffed
from nonsmooth.recordings.reading import MAX_COLUMNS, TIME_WORDS, Reading, names_of

#: What computed files have behind a run's name: the only free text of the format.
SYNTHETIC = " [synthetic]"

_TIME = re.compile(
    rf"(?:{'|'.join(sorted(map(re.escape, TIME_WORDS - {'t'}), key=len, reverse=True))})"
    r"(?:\s*\((?P<unit>[^()]*)\))?(?:\s+(?P<run>.*\S))?\s*",
    re.IGNORECASE | re.DOTALL,
)
_PORT = re.compile(r"(?P<measurement>.+), Ch (?P<port>[^,]+)", re.DOTALL)


def looks_like_capstone(data: bytes, reading: Reading) -> bool:
    """Return whether the first line holds a ``Time`` column with a run's name, and another column of that run."""
    begin = data[: 1 << 20]
    end = begin.find(b"\n") + 1 or len(begin)
    if begin.startswith((b"\xff\xfe", b"\xfe\xff")):
        begin, end = begin[: len(begin) // 2 * 2], len(begin) // 2 * 2
    try:
        header = next(_rows(begin[:end], reading)[1], (1, []))[1]
    except DataFileError:
        return False
    # Stripped first: on much white space at the end the expression would try every way to share it out.
    names = [text.strip() for text in header[: MAX_COLUMNS + 1]]
    runs = [match["run"] for match in map(_TIME.fullmatch, names) if match and match["run"]]
    return any(name.endswith(" " + run) and not _TIME.fullmatch(name) for run in runs for name in names)


def read(data: bytes, reading: Reading) -> None:
    """Read a Capstone CSV export."""
    if reading.says_axes:
        raise ValueError("columns, rate and axis do not concern a Capstone file; read it with format='csv' to use them")
    delimiter, table = _rows(data, reading)
    numerals = Numerals.of(delimiter, reading)
    line, fields = next(table, (1, []))
    header = checked_header(fields, line, reading)
    times, channels = _layout(header, reading)
    cells = read_cells(table, header, range(len(header)), numerals, reading, ends_with_newline=data.endswith(b"\n"))
    tables: dict[int, list[Field]] = {}
    for column, (run, label) in channels.items():
        own = [k for k, (r, _) in times.items() if r == run]
        time_at = max((k for k in own if k < column), default=own[0])  # the one before this column, else the first
        name, unit = split_unit(label)
        match = _PORT.fullmatch(name)
        attrs = {"measurement": match["measurement"], "port": match["port"]} if match else {"measurement": name}
        held = Field(name, unit, cells.values[column], f"column {column + 1}", cells.rows[column], attrs)
        tables.setdefault(time_at, []).append(held)
    for column, (run, unit) in times.items():
        if column in tables:
            time = Field("time", unit, cells.values[column], f"column {column + 1}", cells.rows[column])
            whole = FieldTable(run, [time, *tables[column]], len(cells.lines), cells.lines)
            reading.traces += traces_of(whole, reading)
        else:
            reading.of(run, header[column], "is the time of no channel")
    runs = {run for run, _ in times.values()}
    reading.synthetic = any(run.endswith(SYNTHETIC) for run in runs)
    if reading.synthetic:
        reading.traces = [replace(trace, run=trace.run.removesuffix(SYNTHETIC)) for trace in reading.traces]
    reading.told = {"delimiter": delimiter, "columns": len(header), "rows": len(cells.lines)}


def _layout(header: list[str], reading: Reading) -> tuple[dict[int, tuple[str, str]], dict[int, tuple[str, str]]]:
    """Columns of time as (run, unit), and columns of values as (run, header without the run)."""
    times: dict[int, tuple[str, str]] = {}
    for column, text in enumerate(header):
        match = _TIME.fullmatch(text.strip())
        if match and match["run"]:
            times[column] = (match["run"], (match["unit"] or "").strip())
    if not times:
        raise reading.error(
            "line 1",
            f"no time column with a run's name, as 'Time (s) Run #1'; the columns are {names_of(header)}. "
            "Export the time too, or read the file with format='csv' and columns= or rate=",
        )
    runs = sorted(dict.fromkeys(run for run, _ in times.values()), key=len, reverse=True)
    channels: dict[int, tuple[str, str]] = {}
    for column, text in enumerate(header):
        if column in times or not text.strip():
            continue
        run = next((run for run in runs if text.strip().endswith(" " + run)), None)
        if run is None:
            raise reading.error(
                "line 1",
                f"column {column + 1} ({text!r}) belongs to no run that has a time column "
                f"({names_of(sorted(runs, key=len))}); export the time of its run too",
            )
        channels[column] = (run, text.strip().removesuffix(run).strip())
    if not channels:
        raise reading.error("line 1", "holds time columns only; expected channels such as 'Position (m) Run #1'")
    return times, channels


def _rows(data: bytes, reading: Reading) -> tuple[str, Iterator[Row]]:
    """The character between fields, as the first line tells it, and the rows."""
    stream = decoded(data, reading)
    first = stream.readline()
    delimiter = reading.delimiter or sniffed(first)
    if delimiter == " " and first.strip('" \r\n'):
        raise reading.error("line 1", "holds one field only; expected fields separated by ',' or ';'")
    return delimiter, rows(itertools.chain([first], stream), delimiter, reading)
