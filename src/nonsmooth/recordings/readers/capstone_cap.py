"""PASCO Capstone experiments (``.cap``): a ZIP archive with ``main.xml`` and one member per block of data.

``DataSource`` is a measurement, ``DataSet`` one run of it, ``DataSegmentElement`` a block. A member is a row of
12-byte records, a valid flag (u32) and a value (f64), little-endian; the members are longer than what was measured, so
trailing records have the flag 0, and the number of valid ones equals ``DataCacheDataSize``. A flag of 2 begins text
that a user typed into a table; it is no measurement and is left out with a remark. ``BaseUnit`` is a unit, or the
number of one in a table of the file (an element whose name holds ``Unit``, with that number as its ``...ID``).
``main.xml`` is parsed by expat piece by piece, keeping only what is asked for; a document type (and with it every
entity) is refused.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import DataFileError
from nonsmooth.recordings.readers.text_table import number
from nonsmooth.recordings.reading import MAX_COLUMNS, Archive, Reading, Trace

RECORD = np.dtype([("valid", "<u4"), ("value", "<f8")])

#: What computed files have in the header's attribute ``Origin``.
SYNTHETIC = "synthetic"

_TYPED_TEXT = 2


def read(data: bytes, reading: Reading) -> None:
    """Read a Capstone experiment."""
    if reading.says_axes:
        raise ValueError("columns, rate and axis do not concern a Capstone file, which says them itself")
    archive = Archive(data, reading)
    if "main.xml" not in archive.names:
        raise reading.error("", "is a ZIP archive without main.xml; expected a PASCO Capstone experiment")
    experiment = parse(archive.pieces("main.xml"), reading)
    reading.told = {**experiment.header, "sensors": experiment.sensors}
    reading.synthetic = experiment.header.get("Origin", "").startswith(SYNTHETIC)
    for run, name in experiment.empty:
        reading.of(f"Run #{run}", name, "has no stored values (it may be calculated); left out")
    comma = experiment.header.get("DecimalSeparator", ".") == ","
    groups: dict[int, list[Segment]] = {}  # the blocks of one measurement in one run, together
    for segment in experiment.segments:
        if segment.deleted:
            reading.of(f"Run #{segment.run}", segment.measurement, "deleted by the user in Capstone; left out")
        else:
            groups.setdefault(segment.data_set, []).append(segment)
    traces = [_trace(group, archive, comma, experiment.units, reading) for group in groups.values()]
    found = [trace for trace in traces if trace is not None]
    reading.traces = sorted(found, key=lambda trace: int(trace.run.removeprefix("Run #")))


def _trace(
    group: list[Segment], archive: Archive, comma: bool, units: Mapping[str, str], reading: Reading
) -> Trace | None:
    first = group[0]
    place = f"main.xml, line {first.line}"
    if not (first.run.isascii() and first.run.isdigit() and len(first.run) < 10):
        raise reading.error(place, f"DataGroupNumber is {first.run[:40]!r}, expected the number of a run")
    run, name = f"Run #{first.run}", first.measurement
    times, values = [], []
    for segment in group:
        found = _stretch(segment, archive, comma, reading)
        if found is None:
            reading.of(run, name, f"{segment.values} holds text that a user typed, no measurement; left out")
            continue
        times.append(found[0])
        values.append(found[1])
        if blank := len(found[1]) - int(segment.size):
            reading.of(run, name, f"{blank} records between valid ones are marked invalid; they are NaN")
    if not values:
        return None
    # As in the CSV export, so that a channel has one name in both.
    port = first.channel.removeprefix("Ch ")
    name = f"{first.measurement}, Ch {port}" if port else first.measurement
    attrs = {"measurement": first.measurement} | ({"port": port} if port else {})
    origin = ", ".join(segment.values for segment in group[:4]) + (", ..." if len(group) > 4 else "")
    unit = first.unit.strip()
    if unit.isdigit():  # the number of a unit, not a unit
        remedy = f"say it with units={{{name!r}: ...}}"
        unit = units.get(unit, "")
        if not unit:
            reading.of(run, name, f"its unit is number {first.unit} of a table that is not in the file; {remedy}")
    return Trace(run, name, unit, np.concatenate(times), np.concatenate(values), origin, attrs=attrs)


def _stretch(segment: Segment, archive: Archive, comma: bool, reading: Reading) -> tuple[FloatArray, FloatArray] | None:
    """Times and values of a block; None if it holds typed text."""
    place = f"main.xml, line {segment.line}"
    if not (segment.size.isascii() and segment.size.isdigit() and len(segment.size) < 16):
        raise reading.error(place, f"DataCacheDataSize is {segment.size[:40]!r}, expected a number of records")
    size = int(segment.size)
    values = _records(segment.values, size, archive, reading)
    if values is None:
        return None
    if size == 0:
        return values, values
    if segment.times:
        times = _records(segment.times, size, archive, reading)
        if times is None or len(times) != len(values):
            raise reading.error(segment.times, f"does not hold one time for each of the {len(values)} values")
        return times, values
    start, interval = (
        number(text.replace(",", ".") if comma else text, ".") for text in (segment.start, segment.interval)
    )
    if start is None or interval is None or not (math.isfinite(start) and 0 < interval < math.inf):
        raise reading.error(
            place,
            f"the clock of {segment.values} is IntervalCacheStartValue = {segment.start[:40]!r}, "
            f"IntervalCacheInterval = {segment.interval[:40]!r}; expected a time and a step > 0",
        )
    return start + interval * np.arange(len(values), dtype=np.float64), values


def _records(member: str, size: int, archive: Archive, reading: Reading) -> FloatArray | None:
    """The values up to the last valid one (an invalid one before it is NaN); None if the member holds typed text."""
    content = b"".join(archive.pieces(member))
    count, rest = divmod(len(content), RECORD.itemsize)
    table = np.frombuffer(content, RECORD, count)
    valid, marked, odd = table["valid"], np.flatnonzero(table["valid"]), np.flatnonzero(table["valid"] > 1)
    if count and valid[0] == _TYPED_TEXT:
        return None
    if len(odd):
        raise reading.error(f"{member}, record {odd[0] + 1}", f"its valid flag is {valid[odd[0]]}, expected 0 or 1")
    place = f"{member}, record {count}"
    if len(marked) > size:
        raise reading.error(place, f"has more valid records than the {size} of main.xml")
    if rest:
        raise reading.error(f"{member}, record {count + 1}", f"is cut short: {rest} of {RECORD.itemsize} bytes")
    if len(marked) < size:
        raise reading.error(place, f"{len(marked)} of {count} records are valid, main.xml announces {size}")
    end = int(marked[-1]) + 1 if size else 0
    return np.where(valid[:end] == 1, table["value"][:end], math.nan)


_MAX_NESTING = 256
_UNIT_WORDS = ("UnitSymbol", "SymbolName", "Symbol", "ShortName", "UnitName", "Name")


@dataclass
class Segment:
    """One block of one run: the members with its values and, where the clock is not even, its times."""

    measurement: str
    channel: str
    unit: str
    run: str
    data_set: int
    line: int
    deleted: bool
    values: str = ""
    size: str = ""
    times: str = ""
    start: str = ""
    interval: str = ""


@dataclass
class Experiment:
    """Contents of ``main.xml``; ``units`` are those that its own tables name by a number."""

    header: dict[str, str] = field(default_factory=dict)
    sensors: list[dict[str, str]] = field(default_factory=list)
    segments: list[Segment] = field(default_factory=list)
    empty: list[tuple[str, str]] = field(default_factory=list)
    units: dict[str, str] = field(default_factory=dict)


def parse(pieces: Iterable[bytes], reading: Reading) -> Experiment:
    """Read the pieces of ``main.xml``; DataFileError with its line for anything that is not as it should be."""
    parser, found = expat.ParserCreate(), Experiment()
    nested: list[str] = []
    sources: list[dict[str, str]] = []
    run: dict[str, str] | None = None
    segment: Segment | None = None
    runs = 0

    def error(message: str) -> DataFileError:
        return reading.error(f"main.xml, line {parser.CurrentLineNumber}", message)

    def refuse(*_: Any) -> None:
        raise error("declares a document type or entities, which no Capstone file does; refused")

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal run, segment, runs
        if not nested and name != "DSProExperiment":
            raise error(f"the root is {name[:60]!r}, expected DSProExperiment")
        nested.append(name)
        if len(nested) > _MAX_NESTING:
            raise error(f"elements are nested deeper than {_MAX_NESTING}")
        if name == "Header":
            found.header.update({key: attributes[key] for key in list(attributes)[:64]})
        elif name == "Sensor" and len(found.sensors) < MAX_COLUMNS:
            kept = ("Name", "DistanceForFullRotation", "SamplePeriod")
            found.sensors.append({key: attributes[key] for key in kept if key in attributes})
        elif name == "DataSource":
            sources.append(attributes)
        elif "Unit" in name and len(found.units) < MAX_COLUMNS:  # a number, and the symbol or name that it stands for
            code = next((value for key, value in attributes.items() if key.endswith("ID") and value.isdigit()), None)
            text = next((attributes[key] for key in _UNIT_WORDS if attributes.get(key)), None)
            if code is not None and text is not None:
                found.units.setdefault(code, text)
        elif name == "DataSet" and sources:
            run = attributes
            runs += 1
        elif name == "DataSegmentElement" and run is not None:
            segment = Segment(
                measurement=sources[-1].get("MeasurementName", ""),
                channel=sources[-1].get("ChannelIDName", ""),
                unit=sources[-1].get("BaseUnit", ""),
                run=run.get("DataGroupNumber", ""),
                data_set=runs,
                line=parser.CurrentLineNumber,
                deleted=run.get("DataHasBeenDeleted", "").upper() == "TRUE",
            )
        elif segment is not None and name == "DependentStorageElement":
            segment.values = _path(attributes.get("FileName", ""))
            segment.size = attributes.get("DataCacheDataSize", "")
        elif segment is not None and name == "IndependentStorageElement":
            segment.times = _path(attributes.get("FileName", ""))
            segment.start = attributes.get("IntervalCacheStartValue", "")
            segment.interval = attributes.get("IntervalCacheInterval", "")

    def end(name: str) -> None:
        nonlocal run, segment
        nested.pop()
        if name == "DataSegmentElement" and segment is not None:
            place = f"main.xml, line {parser.CurrentLineNumber}"
            reading.few(len(found.segments), "blocks of data", place, 4 * MAX_COLUMNS)
            if segment.values:
                found.segments.append(segment)
            elif len(found.empty) < MAX_COLUMNS:
                found.empty.append((segment.run, segment.measurement))
            segment = None
        elif name == "DataSet":
            run = None
        elif name == "DataSource" and sources:
            sources.pop()

    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    parser.StartElementHandler, parser.EndElementHandler = start, end
    try:
        for piece in pieces:
            parser.Parse(piece, False)
        parser.Parse(b"", True)
    except expat.ExpatError as why:
        raise reading.error(f"main.xml, line {why.lineno}", f"is not well-formed XML ({why})") from None
    return found


def _path(text: str) -> str:
    return text.replace("\\", "/").removeprefix("./")
