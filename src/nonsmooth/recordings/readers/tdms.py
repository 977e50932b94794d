"""LabVIEW's binary files (``.tdms``), read by npTDMS: a group is a run, its channels follow ``wf_increment``.

A channel without waveform properties follows the group's time channel, where there is one.
"""

from __future__ import annotations

import contextlib
import io
import logging
import math
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np

from nonsmooth.recordings.reading import MAX_COLUMNS, Group, Reading, is_axis_name, needed


def load_tdms(data: bytes, reading: Reading) -> tuple[dict[str, Any], dict[str, Any]]:
    """The groups of a file by clock, and its properties."""
    nptdms = needed("nptdms", "npTDMS", reading)
    check_layout(data, reading)
    with _heard(reading), nptdms.TdmsFile.open(io.BytesIO(data)) as opened:
        if sum(len(group.channels()) for group in opened.groups()) > MAX_COLUMNS:
            raise reading.error("", f"holds more than {MAX_COLUMNS} channels")
        found = {}
        for group in opened.groups():
            notes = {f"property_{key}": value for key, value in _plain(group.properties).items()}
            for k, clocked in enumerate(_by_clock(group, data, reading)):
                clocked.run, clocked.notes = group.name, notes
                found[f"{group.name} ({k + 1})" if k else group.name] = clocked
        return found, {"properties": _plain(opened.properties)}


@contextlib.contextmanager
def _heard(reading: Reading) -> Iterator[None]:
    """Make remarks of what the library would print."""

    def note(record: logging.LogRecord) -> bool:
        reading.say(f"npTDMS: {record.getMessage()[:200]}")
        return False

    with contextlib.ExitStack() as stack:
        for name in list(logging.root.manager.loggerDict):
            if name.split(".")[0] == "nptdms":
                logging.getLogger(name).addFilter(note)
                stack.callback(logging.getLogger(name).removeFilter, note)
        yield


def _by_clock(group: Any, data: bytes, reading: Reading) -> list[Group]:
    """The channels of a group: those with a waveform by their clock, the others together."""
    groups: dict[Any, Group] = {}
    for channel in group.channels():
        kind, n, place = getattr(channel, "dtype", None), len(channel), f"{group.name}/{channel.name}"
        # What the file says it holds must be there: never more memory than it warrants.
        if kind is not None and n * max(1, np.dtype(kind).itemsize if kind != np.dtype("O") else 1) > 2 * len(data):
            raise reading.error(place, f"says it holds {n} values, more than {len(data)} bytes can")
        values, properties = np.asarray(channel[:]), _plain(channel.properties)
        step, begin = (_number(properties.get(key)) for key in ("wf_increment", "wf_start_offset"))
        clock = (step, begin or 0.0, n) if step is not None and step > 0 else None
        kinds = "fiub" if clock or not is_axis_name(channel.name, "time") else "fiubM"
        if values.ndim != 1 or values.dtype.kind not in kinds:
            reading.of(group.name, channel.name, f"holds {values.dtype.name} values, no real numbers; left out")
            continue
        held = groups.setdefault(clock, Group())
        if clock is not None:
            held["time"], held.units["time"] = clock[1] + clock[0] * np.arange(n, dtype=np.float64), "s"
        name = channel.name if channel.name != "time" or clock is None else "time (channel)"
        held[name], held.units[name] = values, properties.get("unit_string", "")
        held.attrs[name] = {f"property_{key}": text for key, text in properties.items()}
    return list(groups.values())


def _number(text: str | None) -> float | None:
    with contextlib.suppress(TypeError, ValueError):
        value = float(text or "")
        return value if math.isfinite(value) else None
    return None


def _plain(properties: Any) -> dict[str, str]:
    return {str(key): str(value)[:1000] for key, value in list(properties.items())[:256]}


_LEAD_IN = 28
_UNFINISHED = 0xFFFF_FFFF_FFFF_FFFF  # the writer was stopped before it could say where the segment ends
_MAX_SEGMENTS = 100_000


def check_layout(data: bytes, reading: Reading) -> None:
    """DataFileError with the segment whose lead-in is damaged or points outside the file."""
    position = 0
    for segment in range(1, _MAX_SEGMENTS + 1):
        place = f"segment {segment}, byte {position}"
        if len(data) - position < _LEAD_IN:
            raise reading.error(place, f"its lead-in of {_LEAD_IN} bytes is cut short")
        tag, contents, _, end, raw = struct.unpack_from("<4sIIQQ", data, position)
        if tag != b"TDSm":
            raise reading.error(place, f"begins with {tag!r}, expected b'TDSm'")
        if contents & (1 << 6):
            raise reading.error(place, "is written in big-endian order, which is not read; save it again on a PC")
        left = len(data) - position - _LEAD_IN
        end = left if end == _UNFINISHED else end
        if end > left or raw > end:
            raise reading.error(
                place, f"says it is {end} bytes long with data from {raw} on, but {left} bytes follow: it is cut short"
            )
        position += _LEAD_IN + end
        if position == len(data):
            return
    raise reading.error("", f"holds more than {_MAX_SEGMENTS} segments")
