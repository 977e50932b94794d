"""LabVIEW's binary files (``.tdms``), read by npTDMS: a group is a run, its channels follow ``wf_increment``.

A channel without waveform properties follows the group's time channel, where there is one.
"""

from __future__ import annotations

import contextlib
import io
import logging
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import DataFileError
from nonsmooth.recordings.limits import MAX_COLUMNS
from nonsmooth.recordings.needed import needed
from nonsmooth.recordings.readers.tdms_layout import check_layout
from nonsmooth.recordings.reading import Options, Reading, Source, Trace, is_axis_name, scaled_time
from nonsmooth.recordings.remarks import Remarks

__all__ = ["read"]


def read(data: bytes, source: Source, options: Options) -> Reading:
    """Read a TDMS file."""
    if options.columns is not None or options.axis != "time":
        raise ValueError("columns and axis do not concern a .tdms file; take its channels by name")
    nptdms = needed("nptdms", "npTDMS", source)
    check_layout(data, source)
    reading = Reading()
    try:
        with _heard(reading.remarks), nptdms.TdmsFile.open(io.BytesIO(data)) as opened:
            groups = opened.groups()
            reading.header = {"properties": _plain(opened.properties)}
            if sum(len(group.channels()) for group in groups) > MAX_COLUMNS:
                raise source.error("", f"holds more than {MAX_COLUMNS} channels")
            found = [(group.name, _plain(group.properties), list(_channels(group, data, source))) for group in groups]
    except DataFileError:
        raise
    # Damaged metadata surfaces as almost any exception of the library.
    except Exception as error:
        raise source.error("", f"cannot be read as TDMS, it is damaged or cut short ({_short(error)})") from error
    for name, properties, channels in found:
        reading.run_attrs[name] = {f"property_{key}": value for key, value in properties.items()}
        reading.traces += _traces(name, channels, source, options, reading.remarks)
    return reading


@contextlib.contextmanager
def _heard(remarks: Remarks) -> Iterator[None]:
    """Make remarks of what the library would print."""

    def note(record: logging.LogRecord) -> bool:
        remarks.say(f"npTDMS: {record.getMessage()[:200]}")
        return False

    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] == "nptdms"]
    loggers = [logging.getLogger(name) for name in names]
    for logger in loggers:
        logger.addFilter(note)
    try:
        yield
    finally:
        for logger in loggers:
            logger.removeFilter(note)


def _channels(group: Any, data: bytes, source: Source) -> Iterator[tuple[str, dict[str, str], Any]]:
    for channel in group.channels():
        kind = getattr(channel, "dtype", None)
        n = len(channel)
        # What the file says it holds must be there: never more memory than it warrants.
        if kind is not None and n * max(1, np.dtype(kind).itemsize if kind != np.dtype("O") else 1) > 2 * len(data):
            raise source.error(
                f"{group.name}/{channel.name}", f"says it holds {n} values, more than {len(data)} bytes can"
            )
        yield channel.name, _plain(channel.properties), channel[:]


def _traces(
    run: str,
    channels: list[tuple[str, dict[str, str], Any]],
    source: Source,
    options: Options,
    remarks: Remarks,
) -> Iterator[Trace]:
    numeric: list[tuple[str, dict[str, str], FloatArray]] = []
    clock: tuple[str, FloatArray] | None = None
    for name, properties, raw in channels:
        values = np.asarray(raw)
        if values.dtype.kind == "M":
            seconds = (values - values[:1]).astype("timedelta64[ns]").astype(np.int64) * 1e-9
            if clock is None and is_axis_name(name, "time"):
                clock = (name, np.asarray(seconds, np.float64))
                continue
            remarks.of(run, name, "holds dates; left out")
        elif values.dtype.kind not in "fiub" or values.ndim != 1:
            remarks.of(run, name, f"holds {values.dtype.name} values, no real numbers; left out")
        elif clock is None and "wf_increment" not in properties and is_axis_name(name, "time"):
            scaled = scaled_time(values.astype(np.float64), properties.get("unit_string", ""))
            if scaled is None:
                raise source.error(f"{run}/{name}", f"is in {properties['unit_string']!r}, which is no unit of time")
            clock = (name, scaled)
        else:
            numeric.append((name, properties, values.astype(np.float64)))
    for name, properties, column in numeric:
        yield _trace(run, name, properties, column, clock, source, options)


def _trace(
    run: str,
    name: str,
    properties: dict[str, str],
    values: FloatArray,
    clock: tuple[str, FloatArray] | None,
    source: Source,
    options: Options,
) -> Trace:
    origin = f"/{run}/{name}"
    step = _number(properties.get("wf_increment"))
    axis: FloatArray
    if step is not None and step > 0:
        axis = (_number(properties.get("wf_start_offset")) or 0.0) + step * np.arange(len(values), dtype=np.float64)
    elif clock is not None:
        if len(clock[1]) != len(values):
            raise source.error(origin, f"holds {len(values)} values, its time channel {clock[0]!r} {len(clock[1])}")
        axis = clock[1]
    elif options.rate is not None:
        axis = np.arange(len(values)) / options.rate
    elif len(values):
        raise source.error(
            origin, "has no wf_increment, and its group no time channel; give the sample rate in Hz, rate=..."
        )
    else:
        axis = np.empty(0)
    kept = {f"property_{key}": text for key, text in properties.items()}
    return Trace(run, name, properties.get("unit_string", ""), axis, values, origin, attrs=kept)


def _number(text: str | None) -> float | None:
    with contextlib.suppress(TypeError, ValueError):
        value = float(text or "")
        return value if math.isfinite(value) else None
    return None


def _plain(properties: Any) -> dict[str, str]:
    return {str(key): str(value)[:1000] for key, value in list(properties.items())[:256]}


def _short(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"[:200]
