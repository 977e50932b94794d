"""From named fields of a table to traces, for text, sheets and arrays alike: the axis, the runs, blanks, counters."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import BoolArray, FloatArray, IntArray
from nonsmooth.recordings.reading import (
    TIME_SCALES,
    Reading,
    Trace,
    is_axis_name,
    names_of,
)


@dataclass(frozen=True, eq=False)
class Field:
    """One column under our name: numbers, or text or dates of an axis; the rows that hold them (None: all)."""

    name: str
    unit: str
    values: NDArray[Any]
    origin: str
    rows: IntArray | None = None
    attrs: Mapping[str, str] = field(default_factory=dict)


class FieldTable(NamedTuple):
    """Fields over the same rows; ``rate`` where the file itself says how often they were taken."""

    run: str
    fields: list[Field]
    rows: int
    lines: IntArray | None = None
    rate: float | None = None


Runs = list[tuple[str, BoolArray | None]]  # each with the mask of its rows; None: all


def split_unit(text: str, brackets: str = "()") -> tuple[str, str]:
    """``"Force (push) (N/(m/s))"`` -> ``("Force (push)", "N/(m/s)")``: the last balanced bracket is the unit."""
    stripped, depth = text.strip(), 0
    for i in range(len(stripped) - 1, -1, -1):
        depth += (stripped[i] == brackets[1]) - (stripped[i] == brackets[0])
        if depth <= 0:  # where the last bracket opens, or at once where the text ends in none
            name, unit = stripped[:i].strip(), stripped[i + 1 : -1].strip()
            return (name, unit) if name and i + 1 < len(stripped) else (stripped, "")
    return stripped, ""


def label(text: str) -> tuple[str, str]:
    """Name and unit of ``Position (m)``, ``Position [m]`` or ``t_s``; ``pos (1)`` is a name."""
    name, unit = split_unit(text)
    if unit.isdigit():  # a channel's number
        name, unit = text.strip(), ""
    if not unit:
        name, unit = split_unit(text, "[]")
    tail = name.casefold().rpartition("_")[2]
    return (name, tail) if not unit and tail in ("s", "ms", "us") and is_axis_name(name, "time") else (name, unit)


def chosen(header: Sequence[str], reading: Reading) -> dict[str, tuple[int, str]]:
    """Our name -> (column, unit): as ``columns`` says, else every column under its own name."""
    named = [label(text) for text in header]
    picked: dict[str, tuple[int, str]] = {}
    if reading.columns is not None:
        for ours, theirs in reading.columns.items():
            wanted, unit = theirs if isinstance(theirs, tuple) else (theirs, None)
            column = _find(wanted, header, named, reading)
            picked[ours] = (column, named[column][1] if unit is None else unit)
    else:
        for column, (name, unit) in enumerate(named):
            if not header[column].strip():
                continue
            ours = reading.axis if is_axis_name(name, reading.axis) and reading.axis not in picked else name
            picked[ours if ours not in picked else f"{ours} (column {column + 1})"] = (column, unit)
    if reading.axis not in picked and reading.rate is None:
        hint = "or give its sample rate in Hz, rate=..." if reading.axis == "time" else "or another axis="
        raise reading.error(
            "", f"no {reading.axis} column among {names_of(header)}; name it, columns={{{reading.axis!r}: ...}}, {hint}"
        )
    return picked


def _find(wanted: str | int, header: Sequence[str], named: list[tuple[str, str]], reading: Reading) -> int:
    if isinstance(wanted, int):
        if not 0 <= wanted < len(header):
            raise reading.error("", f"has {len(header)} columns; there is no column {wanted} (counted from 0)")
        return wanted
    for exact in ([text.strip() for text in header], [name for name, _ in named]):
        fits = [k for k, text in enumerate(exact) if text == wanted.strip()]
        if len(fits) > 1:
            raise reading.error("", f"{len(fits)} columns are called {wanted!r}; give the place, from 0: {fits}")
        if fits:
            return fits[0]
    raise reading.error("", f"no column {wanted!r}; the columns are {names_of(header)}")


def traces_of(table: FieldTable, reading: Reading) -> Iterator[Trace]:
    """The channels of a table by run, over its axis or at its rate."""
    numbers = next((one for one in table.fields if one.name == "run" and "run" in (reading.columns or {})), None)
    runs = _runs(table, numbers, reading)
    fields = [_unwrapped(one, runs, reading) for one in table.fields if one is not numbers]
    axis, rate = next((one for one in fields if one.name == reading.axis), None), reading.rate or table.rate
    fields = [one for one in fields if one is not axis]
    if axis is not None and reading.rate is not None:
        reading.say(f"{axis.origin} is not used as the time, since rate= is given")
        axis = None
    known, clock, unit = np.full(table.rows, axis is None), np.empty(table.rows), "s"
    if axis is not None:
        held = slice(None) if axis.rows is None else axis.rows
        known[held] = True
        clock[held], unit = _along(axis, table, runs, reading)
    reading.few(len(runs) * (len(fields) + 1), f"columns, {len(fields) + 1} in each of {len(runs)} runs")
    for one in fields:
        rows = np.arange(table.rows) if one.rows is None else one.rows
        if one.values.dtype.kind == "c":
            raise reading.error(one.origin, "holds complex numbers; save its parts as two real vectors")
        for run, inside in runs:
            mine = slice(None) if inside is None else inside[rows]
            at, values = rows[mine], np.ascontiguousarray(one.values[mine], np.float64)
            blank = np.count_nonzero(known if inside is None else known & inside) - len(at)
            if blank and len(at):
                reading.of(run, one.name, f"{blank} blank fields dropped")
            if not known[at].all():
                complaint = f"run {run!r}, channel {one.name!r} has a value where there is no {reading.axis}"
                raise reading.error(row_of(at[~known[at]][0], table.lines), complaint)
            order = at if inside is None else np.cumsum(inside)[at] - 1
            taken = order / (rate or 1.0) if axis is None else clock if len(at) == table.rows else clock[at]
            lines = None if table.lines is None else table.lines[at]
            yield Trace(run, one.name, one.unit, taken, values, one.origin, unit, lines=lines, attrs=one.attrs)


def row_of(row: int, lines: IntArray | None) -> str:
    """Name of a row (from 0) in messages: its line in a text, else its number."""
    return f"row {row + 1}" if lines is None else f"line {lines[row]}"


def _unwrapped(field: Field, runs: Runs, reading: Reading) -> Field:
    """The field, with a counter that begins anew at its period put together in each run."""
    period = (reading.wraps or {}).get(field.name)
    if period is None or field.values.dtype.kind not in "iuf":
        return field
    values = np.array(field.values, float)
    rows: Any = slice(None) if field.rows is None else field.rows
    for _, inside in runs:
        good = np.isfinite(values) & (inside is None or inside[rows])
        values[good] = np.unwrap(values[good], period=period)
    return replace(field, values=values)


def _along(axis: Field, table: FieldTable, runs: Runs, reading: Reading) -> tuple[FloatArray, str]:
    """The axis and its unit: times in seconds."""
    axis = replace(axis, unit=(reading.units or {}).get(reading.axis, axis.unit))
    if reading.axis != "time":
        return np.ascontiguousarray(axis.values, np.float64), axis.unit
    if axis.values.dtype.kind not in "iufb":
        seconds, begun = seconds_of(axis, table.lines, reading)
        if begun:
            reading.run_attrs.setdefault(table.run, {})["started"] = begun
        return _unwrapped(replace(axis, values=seconds), runs, reading).values, "s"
    values, scale = np.asarray(axis.values, float), TIME_SCALES.get(axis.unit.partition(" since ")[0].strip())
    if scale is None:
        raise reading.error(
            "", f"the time column is in {axis.unit!r}, which is no unit of time; say its unit, units={{'time': 'ms'}}"
        )
    if not axis.unit:
        reading.say("the time column has no unit; taken as seconds (else units={'time': 'ms'})")
    if len(values) and (begun := values[0] * scale) > EPOCH:
        reading.say(f"times count from an epoch, {begun:.15g} s ago at the first; they begin at 0 here")
        values = values - values[0]
    return values * scale, "s"


def _runs(table: FieldTable, numbers: Field | None, reading: Reading) -> Runs:
    """The runs, each with the mask of its rows; one run where no column numbers them."""
    if numbers is None:
        return [(table.run, None)]
    if numbers.rows is not None and len(numbers.rows) != table.rows:
        missing = np.setdiff1d(np.arange(table.rows), numbers.rows)[0]
        raise reading.error(row_of(missing, table.lines), "the column that numbers the runs is blank")
    values = np.asarray(numbers.values, float)
    if not np.isfinite(values).all():
        bad = np.flatnonzero(~np.isfinite(values))[0]
        raise reading.error(row_of(bad, table.lines), f"the number of the run is {values[bad]}")
    found, first = np.unique(values, return_index=True)
    reading.few(len(found), "runs")
    return [(f"Run #{value:.12g}", values == value) for value in found[np.argsort(first)]]


#: Seconds: a time that begins later counts from an epoch, and begins at 0 here, so that no digit of it is lost.
EPOCH = 1e8

_ISO = re.compile(r"\d{4}-?\d\d-?\d\d[ T]\d\d.*")
_CLOCK = re.compile(r"(?:(\d+):)?(\d{1,2}):(\d{1,2}(?:[.,]\d*)?)")


def seconds_of(axis: Field, lines: IntArray | None, reading: Reading) -> tuple[FloatArray, str]:
    """Seconds since the first stamp and, where stamps have dates, when that was."""
    import pandas

    if axis.values.dtype.kind in "mM":
        is_date = axis.values.dtype.kind == "M"
        dates = axis.values.astype("datetime64[ns]" if is_date else "timedelta64[ns]")
        nanoseconds = dates.astype(np.int64)
        return np.asarray((nanoseconds - nanoseconds[:1]) * 1e-9), str(dates[0]) if is_date and len(dates) else ""
    texts = [str(text).strip() for text in axis.values]
    given = axis.unit if "%" in axis.unit else None
    if given is None and texts and _CLOCK.fullmatch(texts[0]):
        found = [_CLOCK.fullmatch(text) for text in texts]
        if None in found:
            raise _unread(texts, found.index(None), axis, lines, reading)
        parts = [[float((part or "0").replace(",", ".")) for part in match.groups()] for match in found if match]
        return np.array(parts) @ np.array([3600.0, 60.0, 1.0]), ""
    if given is None and not (texts and _ISO.fullmatch(texts[0])):
        raise _unread(texts, 0, axis, lines, reading)
    plain = [text.replace(",", ".") for text in texts] if given is None else texts
    read = pandas.to_datetime(plain, format=given or "ISO8601", utc=True, errors="coerce")
    if read.hasnans:
        raise _unread(texts, np.flatnonzero(read.isna())[0], axis, lines, reading)
    if not len(read):
        return np.empty(0), ""
    return np.asarray((read - read[0]).total_seconds(), float), str(read[0].isoformat())


def _unread(texts: list[str], place: int, axis: Field, lines: IntArray | None, reading: Reading) -> Exception:
    return reading.error(
        row_of(place if lines is None or axis.rows is None else int(axis.rows[place]), lines),
        f"the time {texts[place][:40]!r} is neither a number nor a stamp as 2026-05-31T14:05:09.25 or 14:05:09.25"
        + (f" nor of the form {axis.unit!r}" if "%" in axis.unit else "")
        + "; say how it is written, units={'time': '%d.%m.%Y %H:%M:%S,%f'}, or give rate=",
    )
