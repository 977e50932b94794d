"""``load_recording`` and the table of all formats: find out which one a file has, read it, return a ``Recording``.

From traces to a ``Recording``: one clock per sensor, names that fit a tree, and a remark for all that is odd.
"""

from __future__ import annotations

import gzip
import hashlib
import io
import os
import re
import stat
import warnings
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.reading import (
    MAX_FILE_BYTES,
    Options,
    Reading,
    Trace,
    inflation_limit,
    names_of,
    readable,
)
from nonsmooth.recordings.recording import Recording, RecordingWarning, examine, missing_said, mixed_units
from nonsmooth.results.labels import labelled
from nonsmooth.system.arguments import checked

#: Each format, and the module whose ``read`` reads it.
FORMATS = {
    "capstone-csv": "capstone_csv",
    "capstone-cap": "capstone_cap",
    "csv": "delimited",
    "lvm": "lvm",
    "tdms": "arrays",
    "mat": "arrays",
    "hdf5": "arrays",
    "npy": "arrays",
    "xlsx": "sheets",
    "arrow": "arrays",
    "wav": "arrays",
    "uff": "arrays",
    "mf4": "arrays",
}
#: Endings by which such a file is known before it is read; its content tells the format.
ENDINGS = {".csv", ".tsv", ".txt", ".cap", ".lvm", ".tdms", ".xlsx", ".mat", ".h5", ".hdf5", ".npy", ".npz"}
ENDINGS |= {".parquet", ".arrow", ".feather", ".wav", ".uff", ".unv", ".mf4"}
#: Formats by the first bytes of a file, and of an archive by a member's name.
_BEGINS = {
    b"PK\x03\x04": "zip",
    b"TDSm": "tdms",
    b"MATLAB ": "mat",
    b"\x89HDF\r\n\x1a\n": "hdf5",
    b"\x93NUMPY": "npy",
    b"PAR1": "arrow",
    b"ARROW1": "arrow",
    b"RIFF": "wav",
    b"MDF     ": "mf4",
}
_MEMBERS = {b"xl/workbook.xml": "xlsx", b".npy": "npy"}
_SPOKEN = 20  # warnings shown one by one; the rest is counted, and all are in Recording.warnings


@checked(of=Options, read=False)
def load_recording(path: str | os.PathLike[str], *, format: str | None = None, **options: Any) -> Recording:
    """Read what an instrument recorded: runs, channels, units, sample rates, and where each came from.

    PASCO Capstone (``.csv`` exports in both locales, ``.cap``), any table (CSV, TSV, ``.xlsx``), LabVIEW (``.lvm``,
    ``.tdms``), and files of arrays: MATLAB (``.mat``, v5 to v7.3), HDF5, NumPy (``.npy``, ``.npz``), Parquet and
    Feather, ``.wav``, universal files (data sets 58) and ASAM MDF (``.mf4``); packed by gzip too. The format is told by
    the content, not by the file's name.

    Parameters
    ----------
    path : path
        The file.
    format : str, optional
        One of ``"capstone-csv"``, ``"capstone-cap"``, ``"csv"``, ``"xlsx"``, ``"lvm"``, ``"tdms"``, ``"mat"``,
        ``"hdf5"``, ``"npy"``, ``"arrow"``, ``"wav"``, ``"uff"``, ``"mf4"``, where the content is not to be asked.
    columns : mapping, optional
        For tables and arrays: our name -> the file's column, by its header, or its place counted from 0, or
        ``(column, unit)``; in files of arrays by path. ``"time"`` (or ``axis``) names the time column and ``"run"`` a
        column that numbers the runs. Columns that are not named are left out.
    axis : str
        What the samples stand over; ``"time"`` in seconds, or e.g. ``"frequency"`` for a table of responses.
    rate : float, optional
        Sample rate in Hz, for files that have no time column, or one not to be used; time then begins at 0.
    units : mapping, optional
        Units of channels, for what the file does not say; they replace what it says. By channel (``"Angle, Ch P2"``),
        or by quantity for all channels that measure it (``"Angle"``). That of ``"time"`` is a unit of time, or the
        form of its stamps in the letters of ``strptime``: ``{"time": "%d.%m.%Y %H:%M:%S,%f"}``. Stamps as
        ``2026-05-31T14:05:09.25`` and ``14:05:09.25`` need none.
    delimiter, decimal, thousands : str, optional
        For tables: the character between fields, the decimal mark, and the mark between thousands, where they are not
        to be guessed (the last one never is).
    header, units_row : int, optional
        For tables: the lines, counted from 1, of the column names and of a row of units below them.
    skip : int, str or sequence of str
        For tables: the number of lines to leave out at the top, or the beginnings of lines to leave out anywhere.
    na : str or sequence of str
        For tables: texts that stand for a missing value, ``"#N/A"``.
    wraps : mapping, optional
        Channels (or ``"time"``) that are counters, and where each begins anew: ``{"angle": 65536}``; in the unit of the
        file, seconds for time stamps (``{"time": 86400}`` for a clock that passes midnight). Two neighbouring samples
        are taken to differ by less than half of it.

    Returns
    -------
    Recording
        The runs and their sensors as an ``xarray.DataTree``. What was noticed on the way is in ``.warnings`` and is
        shown as :class:`~nonsmooth.recordings.RecordingWarning`.

    Raises
    ------
    DataFileError
        If the file cannot be read as what it is: the message names the file, the line or record, and what was
        expected.
    ValueError, TypeError
        If an argument is not one of those above, or does not concern this format.

    Examples
    --------
    >>> recording = ns.load_recording("pulls.csv")                                  # doctest: +SKIP
    >>> recording.channel("Position", run="Run #1")                                 # doctest: +SKIP
    >>> ns.load_recording("log.csv", columns={"time": "t", "x": ("pos", "mm")})     # doctest: +SKIP
    """
    if format is not None and format not in FORMATS:
        raise ValueError(f"format must be one of {', '.join(FORMATS)}, got {format!r}")
    file, asked = Path(path), Options(**options)
    recording = parse_recording(content_of(file), file.name, asked, format=format)
    for remark in recording.warnings[:_SPOKEN]:
        warnings.warn(f"{file.name}: {remark}", RecordingWarning, stacklevel=3)
    if (more := len(recording.warnings) - _SPOKEN) > 0:
        warnings.warn(f"{file.name}: {more} more; see Recording.warnings", RecordingWarning, stacklevel=3)
    return recording


def parse_recording(data: bytes, name: str, options: Options | None = None, *, format: str | None = None) -> Recording:
    """The recording in ``data``; ``name`` is what errors call it."""
    digest = hashlib.sha256(data).hexdigest()
    reading = Reading(name=name, size=len(data), sha256=digest, **vars(options or Options()))
    if data.startswith(b"\x1f\x8b"):
        with readable("unpacked", reading), gzip.open(io.BytesIO(data)) as packed:
            data = packed.read(reading.left + 1)
        reading.warrant(len(data), f"unpacks to more than {reading.left} bytes")
        reading.left = inflation_limit(len(data))
    reading.format = format if format is not None else _detect(data, reading)
    read = import_module(f"nonsmooth.recordings.readers.{FORMATS[reading.format]}").read
    # Numbers from elsewhere may lie at both ends of the range of doubles; what is not finite is judged by assemble.
    with np.errstate(all="ignore"):
        read(data, reading)
        _replace_units(reading)
        return assemble(reading)


def content_of(file: Path) -> bytes:
    """The bytes of a regular file of at most 1 GiB; DataFileError for any other: a pipe would wait for who writes
    into it.
    """
    try:
        waiting = getattr(os, "O_NONBLOCK", 0)  # for the other end of a pipe
        with open(file, "rb", opener=lambda path, flags: os.open(path, flags | waiting)) as opened:
            state = os.fstat(opened.fileno())
            if not stat.S_ISREG(state.st_mode):
                raise DataFileError(f"{file}: is a pipe, a socket or a device, no file; copy what it gives into a file")
            data = opened.read(MAX_FILE_BYTES + 1) if state.st_size <= MAX_FILE_BYTES else b""
    except OSError as error:
        raise DataFileError(f"{file}: cannot be opened ({error.strerror or error})") from error
    size = max(state.st_size, len(data))
    if size > MAX_FILE_BYTES:
        raise DataFileError(f"{file}: has {size} bytes; at most {MAX_FILE_BYTES} are read: export fewer runs per file")
    if not data:
        raise DataFileError(f"{file}: is empty")
    return data


def _detect(data: bytes, reading: Reading) -> str:
    """The format, by the first bytes."""
    for begin, kind in _BEGINS.items():
        if data.startswith(begin):
            if kind == "zip":
                return next((k for part, k in _MEMBERS.items() if part in data), "capstone-cap")
            return "mat" if kind == "hdf5" and reading.name.endswith(".mat") else kind
    if data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"LabVIEW Measurement"):
        return "lvm"
    if re.match(rb"\s*-1\s*\n\s+\d+", data[:200]):
        return "uff"
    if b"\0" in data[:4096] and not data.startswith((b"\xff\xfe", b"\xfe\xff")):
        hint = " (a .mat file of version 4 is not read: save it again with -v7)"
        raise reading.error(
            "",
            "is none of the formats known: Capstone .csv and .cap, tables, .xlsx, LabVIEW .lvm and .tdms, MATLAB .mat, "
            "HDF5, .npy and .npz, Parquet and Feather, .wav, universal files, .mf4; give format= if it is one of them"
            + (hint if reading.name.endswith(".mat") else ""),
        )
    from nonsmooth.recordings.readers.capstone_csv import looks_like_capstone

    return "csv" if reading.says_axes or not looks_like_capstone(data, replace(reading)) else "capstone-csv"


def _replace_units(reading: Reading) -> None:
    names, units = {trace.name for trace in reading.traces}, reading.units or {}
    quantities = {trace.attrs.get("measurement", trace.name) for trace in reading.traces}
    for option, allowed in (("wraps", names), ("units", names | quantities)):
        for name in (getattr(reading, option) or {}).keys() - allowed - {reading.axis}:
            there = names_of(sorted(names))
            raise reading.error("", f"{option} names {name!r}, which is no channel; there are: {there}")
    if units:
        of = [units.get(one.name, units.get(one.attrs.get("measurement", ""), one.unit)) for one in reading.traces]
        reading.traces = [replace(trace, unit=unit) for trace, unit in zip(reading.traces, of, strict=True)]


#: A sensor with fewer samples says next to nothing of a motion; below this a remark is made.
SHORT = 32
#: The photogate's channel: one row for each turn, so that few rows are no fault.
EVENTS = "Turn"


def assemble(reading: Reading) -> Recording:
    """Check the traces, group them by run and clock, and label them."""
    traces = []
    for trace in reading.traces:
        if len(trace.values) == 0:
            reading.of(trace.run, trace.name, "holds no value; left out")
        else:
            traces.append(trace)
    if not traces:
        raise reading.error("", "holds no samples; expected at least one channel with values")
    reading.few(len(traces), "channels")
    _compare_units(traces, reading)

    runs: dict[str, dict[str, xr.Dataset]] = {}
    run_attrs: dict[str, dict[str, str]] = {}
    held: dict[str, dict[Any, list[Trace]]] = {}  # by run and clock
    for trace in traces:
        held.setdefault(trace.run, {}).setdefault((trace.axis_unit, trace.axis.tobytes()), []).append(trace)
    for run, by_clock in held.items():
        node = _fit(run or "run", runs)
        run_attrs[node] = {"long_name": run, **reading.run_attrs.get(run, {})}
        sensors = runs[node] = {}
        for group in by_clock.values():
            sensors[_fit(group[0].name or "sensor", sensors)] = _sensor(group, reading)
    record = {
        "file": reading.name,
        "format": reading.format,
        "bytes": reading.size,
        "sha256": reading.sha256,
        "options": reading.asked,
        "header": reading.told,
    }
    return Recording.from_runs(
        runs, synthetic=reading.synthetic, source=record, warnings=reading.sentences(), run_attrs=run_attrs
    )


def _sensor(group: list[Trace], reading: Reading) -> xr.Dataset:
    first, axis = group[0], reading.axis
    where = f"run {first.run!r}, channel {first.name!r}"
    if len(group) > 1:
        where += f" (and {len(group) - 1} sampled with it)"
    bad = np.flatnonzero(~np.isfinite(first.axis))
    if len(bad):
        raise reading.error(first.place(bad[0]), f"{where}: the {axis} is not a finite number")

    def note(sentence: str) -> None:
        for trace in group:
            reading.of(trace.run, trace.name, sentence)

    attrs = _clock(first, where, reading, note) if axis == "time" else {}
    if axis == "time" and len(first.values) < SHORT and any(trace.name != EVENTS for trace in group):
        note(f"only {len(first.values)} samples; too short to identify anything from")
    variables: dict[str, Any] = {}
    for trace in group:
        if said := missing_said(trace.values, trace.axis, axis, trace.axis_unit):
            reading.of(trace.run, trace.name, f"{said}; they are kept as they are")
        name = _fit(trace.name or "channel", [*variables, axis])
        if name != trace.name and name != _clean(trace.name):
            sentence = f"the name stands there twice, or is the axis; this one is called {name!r}"
            reading.of(trace.run, trace.name, sentence)
        variables[name] = labelled(axis, trace.values, trace.name, trace.unit)
        variables[name][2].update(origin=trace.origin, **trace.attrs)
    return xr.Dataset(variables, {axis: labelled(axis, first.axis, axis, first.axis_unit)}, attrs)


def _clock(trace: Trace, where: str, reading: Reading, note: Callable[[str], None]) -> dict[str, Any]:
    """Attributes of a sensor's clock; remarks on gaps, changes and rounded times."""
    time = trace.axis
    back = np.flatnonzero(np.diff(time) < 0)
    if len(back):
        i = back[0]
        raise reading.error(
            trace.place(i + 1),
            f"{where}: time goes back from {time[i]:.9g} s to {time[i + 1]:.9g} s; if a new run begins here, "
            "name the column that numbers the runs, columns={'run': ...}; if a counter begins anew there, say at which "
            "count, wraps={'time': 2**32}",
        )
    clock = examine(time)
    if clock.repeated:
        note(
            f"{clock.repeated} of {len(time) - 1} time steps are zero; the times were written with too few "
            "digits (export more of them, or give rate=) or samples stand twice"
        )
    if clock.change is not None:
        i, before, after = clock.change
        note(
            f"the sample rate changes from {before:.6g} Hz to {after:.6g} Hz near t = {time[i]:.9g} s "
            f"({trace.place(i)}); split the recording there before using methods that need one rate"
        )
    for i, count in clock.gaps[:3]:
        note(f"gap of {count} samples after t = {time[i]:.9g} s ({trace.place(i)}); nothing was filled in")
    if len(clock.gaps) > 3:
        note(f"{len(clock.gaps) - 3} more gaps")
    return {"rate": clock.rate, "sampling": "regular" if clock.regular else "irregular"}


def _compare_units(traces: list[Trace], reading: Reading) -> None:
    units: dict[str, dict[str, list[str]]] = {}  # by channel, each with its runs
    for trace in traces:
        units.setdefault(trace.name, {}).setdefault(trace.unit, []).append(trace.run)
    for name, found in units.items():
        if len(found) == 1 and "" in found:
            run, *others = dict.fromkeys(found[""])
            said = f"the file gives no unit; say it with units={{{name!r}: ...}}"
            reading.of("" if others else run, name, said)
        if len(found) > 1:
            first = {unit: runs[0] for unit, runs in found.items()}
            reading.of(
                "",
                name,
                f"has units {mixed_units(first)}; nothing was converted: take each run's own unit, or read the runs "
                "one by one",
            )


def _clean(name: str) -> str:
    """A name that a tree and a file can hold: no slash, nothing that does not print."""
    text = "".join("_" if c == "/" or not c.isprintable() else c for c in name).strip()
    return "_" if text in ("", ".", "..") else text


def _fit(name: str, taken: Any) -> str:
    """``name`` cleaned, numbered if it is taken."""
    base, held, k = _clean(name), set(taken), 1
    while (found := f"{base} ({k})" if k > 1 else base) in held:
        k += 1
    return found
