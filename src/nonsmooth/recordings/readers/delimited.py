"""Any table as text: CSV, TSV, columns separated by white space, with a header or without one.

Which column is the time is told by its name, or by ``columns``; a column may number the runs.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from nonsmooth.recordings.limits import MAX_COLUMNS
from nonsmooth.recordings.readers.text_table import (
    Cells,
    Row,
    checked_header,
    decoded,
    number,
    read_cells,
    rows,
    split_unit,
)
from nonsmooth.recordings.reading import Options, Reading, Source, Trace, is_axis_name, names_of, scaled_time
from nonsmooth.recordings.remarks import Remarks

__all__ = ["read"]

_COMMENT = ("#", "%")


def read(data: bytes, source: Source, options: Options) -> Reading:
    """Read a table."""
    reading = Reading()
    stream = decoded(data, source, reading.remarks)
    comments, first, first_line = [], "", 1
    for line, text in enumerate(stream, 1):
        if text.strip() and not text.lstrip().startswith(_COMMENT):
            first, first_line = text, line
            break
        if text.strip():
            comments.append(text.strip())
    if not first:
        raise source.error("", "holds no table, only blank lines or comments")
    delimiter = options.delimiter or _delimiter(first)
    decimal = options.decimal or ("." if delimiter == "," else None)
    # The first line was taken to find the delimiter; put it back before the rest.
    table = rows(itertools.chain([first], stream), delimiter, source, first_line)
    _, fields = next(table)
    top = checked_header(fields, first_line, source)
    header, body = _header(top, table, first_line, decimal, source, options)
    chosen = _choose(header, source, options)
    wanted = list(dict.fromkeys(column for column, _ in chosen.values()))
    cells = read_cells(
        body, header, wanted, decimal, source, reading.remarks, ends_with_newline=data.endswith((b"\n", b"\r"))
    )
    place = {column: k for k, column in enumerate(wanted)}
    picked = {name: (place[column], unit) for name, (column, unit) in chosen.items()}
    left = [text for k, text in enumerate(header) if k not in wanted and text.strip()]
    if left:
        reading.remarks.say(f"columns not asked for are left out: {names_of(left)}")
    origins = {name: f"column {column + 1} ({header[column]})" for name, (column, _) in chosen.items()}
    reading.traces = list(_traces(picked, origins, cells, source, options, reading.remarks))
    reading.header = {"delimiter": delimiter, "columns": len(header), "rows": len(cells.lines), "comments": comments}
    return reading


def _header(
    top: list[str],
    table: Iterator[Row],
    line: int,
    decimal: str | None,
    source: Source,
    options: Options,
) -> tuple[list[str], Iterator[Row]]:
    """The header's fields and the rows below; a first row of numbers only is data, its columns have places."""
    if not all(f.strip() == "" or any(number(f, d) is not None for d in (decimal or ".,")) for f in top):
        return top, table
    if options.columns is None and options.rate is None:
        raise source.error(
            f"line {line}",
            "the table has no header, so its columns are not known; name them by place, columns={'time': 0, 'x': 1}",
        )
    return [f"column {k + 1}" for k in range(len(top))], itertools.chain([(line, top)], table)


def _choose(header: list[str], source: Source, options: Options) -> dict[str, tuple[int, str]]:
    """Our name -> (column, unit): as ``columns`` says, else every column under its own name."""
    named = [_label(text) for text in header]
    if options.columns is not None:
        chosen = {}
        for ours, theirs in options.columns.items():
            wanted, unit = theirs if isinstance(theirs, tuple) else (theirs, None)
            column = _find(wanted, header, named, source)
            chosen[ours] = (column, named[column][1] if unit is None else unit)
    else:
        chosen = {}
        for column, (name, unit) in enumerate(named):
            if not header[column].strip():
                continue
            ours = options.axis if is_axis_name(name, options.axis) and options.axis not in chosen else name
            chosen[ours if ours not in chosen else f"{ours} (column {column + 1})"] = (column, unit)
    if options.axis not in chosen and options.rate is None:
        hint = "or give its sample rate in Hz, rate=..." if options.axis == "time" else "or another axis="
        raise source.error(
            "", f"no {options.axis} column among {names_of(header)}; name it, columns={{{options.axis!r}: ...}}, {hint}"
        )
    return chosen


def _find(wanted: str | int, header: list[str], named: list[tuple[str, str]], source: Source) -> int:
    if isinstance(wanted, int):
        if not 0 <= wanted < len(header):
            raise source.error("", f"has {len(header)} columns; there is no column {wanted} (counted from 0)")
        return wanted
    for exact in ([text.strip() for text in header], [name for name, _ in named]):
        fits = [k for k, text in enumerate(exact) if text == wanted.strip()]
        if len(fits) > 1:
            raise source.error("", f"{len(fits)} columns are called {wanted!r}; give the place, from 0: {fits}")
        if fits:
            return fits[0]
    raise source.error("", f"no column {wanted!r}; the columns are {names_of(header)}")


def _label(text: str) -> tuple[str, str]:
    """Name and unit of ``Position (m)``, ``Position [m]`` or ``t_s``."""
    name, unit = split_unit(text)
    if not unit:
        name, unit = split_unit(text, "[]")
    return (name, "s") if not unit and name.casefold().endswith("_s") and is_axis_name(name, "time") else (name, unit)


def _traces(
    chosen: dict[str, tuple[int, str]],
    origins: dict[str, str],
    cells: Cells,
    source: Source,
    options: Options,
    remarks: Remarks,
) -> Iterator[Trace]:
    axis = options.axis
    n = len(cells.lines)
    runs = _run_of_rows(chosen, cells, source)
    if len(runs) * len(chosen) > MAX_COLUMNS:
        raise source.error("", f"holds {len(chosen)} columns in {len(runs)} runs; at most {MAX_COLUMNS} are read")
    if axis in chosen:
        column, unit = chosen[axis]
        held, along = cells.rows[column], cells.values[column]
        if axis == "time":
            seconds = scaled_time(along, unit)
            if seconds is None:
                raise source.error("", f"the time column is in {unit!r}, which is no unit of time")
            if not unit:
                remarks.say("the time column has no unit; taken as seconds")
            along, unit = seconds, "s"
    else:
        held, along, unit = np.arange(n), np.empty(0), "s"
    for name, (column, own) in chosen.items():
        if name in (axis, "run") or column == chosen.get("run", (-1, ""))[0]:
            continue
        for run, inside in runs:
            mine = inside[cells.rows[column]]
            at, values = cells.rows[column][mine], cells.values[column][mine]
            complaint = f"run {run!r}, channel {name!r} has a value where there is no {axis}"
            place = cells.places(at, held, source, complaint)
            taken = along[place] if axis in chosen else (at - int(np.flatnonzero(inside)[0])) / float(options.rate or 1)
            blank = int(np.count_nonzero(inside)) - len(at)
            if blank and len(at):
                remarks.of(run, name, f"{blank} blank fields dropped")
            yield Trace(
                run, name, own, np.asarray(taken, np.float64), values, origins[name], unit, lines=cells.lines[at]
            )


def _run_of_rows(
    chosen: dict[str, tuple[int, str]], cells: Cells, source: Source
) -> list[tuple[str, NDArray[np.bool_]]]:
    """The runs, each with the mask of its rows; one run where no column numbers them."""
    n = len(cells.lines)
    if "run" not in chosen:
        return [("Run #1", np.ones(n, dtype=bool))]
    column = chosen["run"][0]
    if len(cells.rows[column]) != n:
        missing = np.setdiff1d(np.arange(n), cells.rows[column])
        raise source.error(f"line {cells.lines[missing[0]]}", "the column that numbers the runs is blank")
    values = cells.values[column]
    if not np.isfinite(values).all():
        bad = int(np.flatnonzero(~np.isfinite(values))[0])
        raise source.error(f"line {cells.lines[bad]}", f"the number of the run is {values[bad]}")
    numbers, first = np.unique(values, return_index=True)
    if len(numbers) > MAX_COLUMNS:
        raise source.error("", f"holds {len(numbers)} runs; at most {MAX_COLUMNS} are read")
    return [(f"Run #{value:.12g}", values == value) for value in numbers[np.argsort(first)]]


def _delimiter(line: str) -> str:
    outside = "".join(line.split('"')[::2])
    return next((d for d in ("\t", ";", ",") if d in outside), " ")
