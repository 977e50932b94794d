"""``main.xml`` of a Capstone experiment: which member of the archive holds which run of which measurement.

Parsed by expat piece by piece, keeping only what is asked for; a document type (and with it every entity) is refused.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.limits import MAX_COLUMNS
from nonsmooth.recordings.reading import Source

__all__ = ["Experiment", "Segment", "parse"]

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


def parse(pieces: Iterable[bytes], source: Source) -> Experiment:
    """Read the pieces of ``main.xml``; DataFileError with its line for anything that is not as it should be."""
    handler = _Handler(source)
    parser = handler.parser
    try:
        for piece in pieces:
            parser.Parse(piece, False)
        parser.Parse(b"", True)
    except expat.ExpatError as error:
        raise source.error(f"main.xml, line {error.lineno}", f"is not well-formed XML ({error})") from None
    if not handler.rooted:
        raise source.error("main.xml", "holds no element; expected the root DSProExperiment")
    return handler.found


class _Handler:
    def __init__(self, source: Source) -> None:
        self.found = Experiment()
        self.rooted = False
        self.parser = expat.ParserCreate()
        self._source = source
        self._open: list[str] = []
        self._data_sources: list[dict[str, Any]] = []
        self._data_set: dict[str, str] | None = None
        self._data_sets = 0
        self._segment: Segment | None = None
        self.parser.StartDoctypeDeclHandler = self._refuse
        self.parser.EntityDeclHandler = self._refuse
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end

    def _error(self, message: str) -> DataFileError:
        return self._source.error(f"main.xml, line {self.parser.CurrentLineNumber}", message)

    def _refuse(self, *_: Any) -> None:
        raise self._error("declares a document type or entities, which no Capstone file does; refused")

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        if not self.rooted:
            if name != "DSProExperiment":
                raise self._error(f"the root is {name[:60]!r}, expected DSProExperiment")
            self.rooted = True
        self._open.append(name)
        if len(self._open) > _MAX_NESTING:
            raise self._error(f"elements are nested deeper than {_MAX_NESTING}")
        if name == "Header":
            self.found.header.update({key: attributes[key] for key in list(attributes)[:64]})
        elif name == "Sensor" and len(self.found.sensors) < MAX_COLUMNS:
            kept = ("Name", "DistanceForFullRotation", "SamplePeriod")
            self.found.sensors.append({key: attributes[key] for key in kept if key in attributes})
        elif name == "DataSource":
            self._data_sources.append(attributes)
        elif "Unit" in name and len(self.found.units) < MAX_COLUMNS:
            self._unit(attributes)
        elif name == "DataSet" and self._data_sources:
            self._data_set = attributes
            self._data_sets += 1
        elif name == "DataSegmentElement" and self._data_set is not None:
            self._begin(self._data_sources[-1], self._data_set)
        elif self._segment is not None and name == "DependentStorageElement":
            self._segment.values = _path(attributes.get("FileName", ""))
            self._segment.size = attributes.get("DataCacheDataSize", "")
        elif self._segment is not None and name == "IndependentStorageElement":
            self._segment.times = _path(attributes.get("FileName", ""))
            self._segment.start = attributes.get("IntervalCacheStartValue", "")
            self._segment.interval = attributes.get("IntervalCacheInterval", "")

    def _unit(self, attributes: dict[str, str]) -> None:
        """A row of a table of units: a number, and the symbol or name that it stands for."""
        code = next((value for key, value in attributes.items() if key.endswith("ID") and value.isdigit()), None)
        text = next((attributes[key] for key in _UNIT_WORDS if attributes.get(key)), None)
        if code is not None and text is not None:
            self.found.units.setdefault(code, text)

    def _begin(self, data_source: dict[str, Any], data_set: dict[str, str]) -> None:
        self._segment = Segment(
            measurement=data_source.get("MeasurementName", ""),
            channel=data_source.get("ChannelIDName", ""),
            unit=data_source.get("BaseUnit", ""),
            run=data_set.get("DataGroupNumber", ""),
            data_set=self._data_sets,
            line=self.parser.CurrentLineNumber,
            deleted=data_set.get("DataHasBeenDeleted", "").upper() == "TRUE",
        )

    def _end(self, name: str) -> None:
        self._open.pop()
        if name == "DataSegmentElement" and self._segment is not None:
            if len(self.found.segments) >= 4 * MAX_COLUMNS:
                raise self._error(f"holds more than {4 * MAX_COLUMNS} blocks of data")
            if self._segment.values:
                self.found.segments.append(self._segment)
            elif len(self.found.empty) < MAX_COLUMNS:
                self.found.empty.append((self._segment.run, self._segment.measurement))
            self._segment = None
        elif name == "DataSet":
            self._data_set = None
        elif name == "DataSource" and self._data_sources:
            self._data_sources.pop()


def _path(text: str) -> str:
    return text.replace("\\", "/").removeprefix("./")
