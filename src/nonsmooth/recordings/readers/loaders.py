"""One loader per format of named arrays, each over its library: claims are checked before the library acts on them.

A loader returns the file's arrays as nested dicts and lists, and what the file says of itself.
"""

from __future__ import annotations

import contextlib
import io
import logging
import math
import struct
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from nonsmooth.recordings.readers.matlab import load_hdf5, load_v5
from nonsmooth.recordings.readers.text_table import number
from nonsmooth.recordings.reading import (
    Archive,
    Group,
    Reading,
    is_axis_name,
    needed,
    readable,
)

Loaded = tuple[Mapping[str, Any], dict[str, Any]]


def _matlab(data: bytes, reading: Reading) -> Loaded:
    is_hdf5 = data.startswith(b"\x89HDF") or data[512:516] == b"\x89HDF"
    variables = load_hdf5(data, reading, matlab=True) if is_hdf5 else load_v5(data, reading)
    # An HDF5 file that another program wrote has no text before its own mark.
    text = b"" if data.startswith(b"\x89HDF") else data[:116].split(b"\0")[0]
    return variables, {"version": "7.3" if is_hdf5 else "5", "text": text.decode("ascii", "replace")}


def _numpy(data: bytes, reading: Reading) -> Loaded:
    if not data.startswith(b"PK"):
        return Group({"values": _array(data, "values", reading)}), {}
    archive = Archive(data, reading)
    found = {name.removesuffix(".npy"): b"".join(archive.pieces(name)) for name in archive.names}
    return Group({name: _array(content, name, reading) for name, content in found.items()}), {"arrays": len(found)}


def _array(data: bytes, name: str, reading: Reading) -> Any:
    """The array of one .npy file; a structured one as a group of its fields."""
    stream = io.BytesIO(data)
    form = np.lib.format
    with readable("read as a .npy array", reading, name):
        version = form.read_magic(stream)
        shape, _, kind = (form.read_array_header_1_0 if version == (1, 0) else form.read_array_header_2_0)(stream)
        if kind.hasobject or math.prod(shape) * kind.itemsize > len(data):
            raise reading.error(name, f"says it holds {kind} values of shape {shape}; expected numbers that fit it")
        stream.seek(0)
        values = np.load(stream, allow_pickle=False)
    return Group({field: values[field] for field in values.dtype.names}) if values.dtype.names else values


def _arrow(data: bytes, reading: Reading) -> Loaded:
    # In this thread and from its own memory: else threads may go on behind the error of a damaged file.
    pyarrow = needed("pyarrow", "pyarrow", reading)
    held = pyarrow.BufferReader(data)
    if data.startswith(b"PAR1"):
        opened = needed("pyarrow.parquet", "pyarrow", reading).ParquetFile(held)
        shape = (opened.metadata.num_rows, opened.metadata.num_columns)
        reading.few(shape[1], "columns")
        reading.warrant(8 * math.prod(shape), f"says it holds {shape[0]} rows of {shape[1]} columns")
        table = opened.read(use_threads=False)
    else:
        table = pyarrow.ipc.open_file(held, options=pyarrow.ipc.IpcReadOptions(use_threads=False)).read_all()
    units = {}
    for field in table.schema:
        said = {key.decode().lower(): value.decode() for key, value in (field.metadata or {}).items()}
        units[field.name] = said.get("units", said.get("unit", ""))
    columns = {name: table.column(name).to_numpy(zero_copy_only=False) for name in table.column_names}
    return Group(columns, units), {"columns": len(columns), "rows": table.num_rows}


def _wave(data: bytes, reading: Reading) -> Loaded:
    from scipy.io import wavfile

    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        rate, samples = wavfile.read(io.BytesIO(data))
    for warning in said:
        reading.say(f"SciPy: {warning.message}"[:200])
    kind = samples.dtype
    if kind.kind in "iu":  # as parts of full scale, as audio programs show them
        least, half = np.iinfo(kind).min, 0.5 * (np.iinfo(kind).max - np.iinfo(kind).min + 1)
        samples = (samples - (least + half)) / half
    columns = samples.reshape(len(samples), -1)
    reading.say("values are parts of full scale; multiply by what full scale stands for")
    names = [f"channel {k + 1}" for k in range(columns.shape[1])]
    found = Group(dict(zip(names, columns.T, strict=True)), dict.fromkeys(names, "1"), float(rate))
    return found, {"rate": float(rate), "samples": str(kind)}


def _universal(data: bytes, reading: Reading) -> Loaded:
    """Data sets 58; those over the same abscissa are one group."""
    pyuff = needed("pyuff", "pyuff", reading)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "data.uff"
        path.write_bytes(data)
        opened = pyuff.UFF(str(path))
        kinds = [int(kind) for kind in opened.get_set_types()]
        sets = [opened.read_sets(k) for k, kind in enumerate(kinds) if kind == 58]
    groups: list[Group] = []
    for k, one in enumerate(sets, 1):
        axis = {17: "time", 18: "frequency"}.get(int(one.get("abscissa_spec_data_type", 0)), "abscissa")
        group = next((g for g in groups if axis in g and np.array_equal(g[axis], one["x"])), None)
        if group is None:
            group = Group({axis: np.asarray(one["x"], float)})
            group.units[axis] = _unit(one, "abscissa") or {"time": "s", "frequency": "Hz"}.get(axis, "")
            groups.append(group)
        name = f"{one.get('rsp_node', k)}{_direction(one.get('rsp_dir', 0))}"
        name = name if name not in group else f"{name} (set {k})"
        group[name], group.units[name] = np.asarray(one["data"]), _unit(one, "ordinate")
    return {f"group {k}": group for k, group in enumerate(groups, 1)}, {"sets": len(sets)}


def _unit(one: Mapping[str, Any], of: str) -> str:
    text = str(one.get(f"{of}_axis_units_lab", "")).strip()
    return "" if text.upper() == "NONE" else text


def _direction(number: Any) -> str:
    return f"{'-' if number < 0 else '+'}{' XYZ'[abs(int(number))]}" if 1 <= abs(int(number)) <= 3 else ""


def _measured(data: bytes, reading: Reading) -> Loaded:
    """Channel groups of an MDF file: one run, each group with the clock of its master."""
    asammdf = needed("asammdf", "asammdf", reading, "mdf")
    groups: dict[str, Any] = {}
    with asammdf.MDF(io.BytesIO(data)) as opened:
        cycles = sum(group.channel_group.cycles_nr * len(group.channels) for group in opened.groups)
        reading.warrant(8 * cycles, f"says it holds {cycles} samples")
        for k, held in enumerate(opened.groups):
            group = Group()
            group.run = "Run #1"
            for i in range(len(held.channels)):
                signal = opened.get(group=k, index=i)
                if i != opened.masters_db.get(k):
                    group[signal.name], group.units[signal.name] = np.asarray(signal.samples), signal.unit or ""
                    group["time"], group.units["time"] = np.asarray(signal.timestamps, float), "s"
            groups[f"group {k + 1}"] = group
    return groups, {"version": str(opened.version)}


def _tdms(data: bytes, reading: Reading) -> Loaded:
    """The groups of a LabVIEW file, each a run, by clock: that of ``wf_increment``, else the group's time channel."""
    nptdms = needed("nptdms", "npTDMS", reading)
    check_layout(data, reading)
    with _heard(reading), nptdms.TdmsFile.open(io.BytesIO(data)) as opened:
        reading.few(sum(len(group.channels()) for group in opened.groups()), "channels")
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
        step, begin = (number(properties.get(key, ""), ".") for key in ("wf_increment", "wf_start_offset"))
        begin = begin if begin is not None and math.isfinite(begin) else 0.0
        clock = (step, begin, n) if step is not None and 0 < step < math.inf else None
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


def load(data: bytes, reading: Reading) -> Loaded:
    """The arrays of a file."""
    loader, what = _LOADERS[reading.format]
    with readable(f"read as {what}", reading):
        return loader(data, reading)


#: What loads each format of arrays, and its name in messages.
_LOADERS: dict[str, tuple[Callable[[bytes, Reading], Loaded], str]] = {
    "mat": (_matlab, "a MATLAB file"),
    "hdf5": (lambda data, reading: (load_hdf5(data, reading, matlab=False), {}), "HDF5"),
    "tdms": (_tdms, "TDMS"),
    "npy": (_numpy, "NumPy's arrays"),
    "arrow": (_arrow, "Parquet or Arrow"),
    "wav": (_wave, "a WAV file"),
    "uff": (_universal, "a universal file"),
    "mf4": (_measured, "a measurement of ASAM MDF"),
}
