"""Matter of every reader: its options, and its result: traces, remarks, and the file they came from.

A reader is a function ``read(data: bytes, source: Source, options: Options) -> Reading``. It takes the whole file as
bytes, touches no disk, raises only ``DataFileError``, and leaves rates, grouping and labels to ``assemble``. Recordings
come from elsewhere: what a file claims is checked against its size.
"""

from __future__ import annotations

import io
import re
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from importlib import import_module
from types import ModuleType
from typing import Any, TypedDict

from nonsmooth.arrays import FloatArray, IntArray
from nonsmooth.errors import DataFileError, check_keys, not_installed
from nonsmooth.system.kinds import real_number, whole_number

MAX_FILE_BYTES = 1 << 30  # read whole into memory, so that the hash is that of what was read
MAX_COLUMNS = 4096  # over all runs of one file; each becomes a labelled array
MAX_DEPTH = 32  # of nested containers

_FLOOR = 16 << 20  # small files may hold long constant signals, which compress without bound
_RATIO = 100


def inflation_limit(n_bytes: int) -> int:
    """The most bytes that the compressed parts of a file of ``n_bytes`` may become, all together."""
    return max(_FLOOR, _RATIO * n_bytes)


_NAMED = 4  # channels named in one remark
_ALIKE = 3  # more runs than this of which the same is to be said, but for numbers, share one sentence


class Remarks:
    """Sentences on a file, a run, or a channel of a run."""

    def __init__(self) -> None:
        self._channels: dict[tuple[str, str], list[str]] = {}

    def say(self, sentence: str) -> None:
        """Something about the file as a whole."""
        self._channels.setdefault(("", sentence), [])

    def of(self, run: str, channel: str, sentence: str) -> None:
        """Something about a channel of a run ("" where it concerns all runs)."""
        self._channels.setdefault((run, sentence), []).append(channel)

    def sentences(self) -> tuple[str, ...]:
        """All of them; channels of one run of which the same is to be said stand together, and so do many runs."""
        alike: dict[tuple[str, ...], list[tuple[str, list[str], str]]] = {}
        for (run, text), channels in self._channels.items():
            kind = (re.sub(r"\d+", "#", text), *channels) if run else (run, text)
            alike.setdefault(kind, []).append((run, channels, text))
        said: list[str] = []
        for group in alike.values():
            if len(group) <= _ALIKE:
                said += [_sentence(*one) for one in group]
            else:
                said.append(f"{_sentence(*group[0])} (and likewise {len(group) - 1} more runs, to {group[-1][0]!r})")
        return tuple(said)


def _sentence(run: str, channels: list[str], text: str) -> str:
    channels = list(dict.fromkeys(channels))
    named = ", ".join(map(repr, channels[:_NAMED]))
    more = f" and {len(channels) - _NAMED} more" if len(channels) > _NAMED else ""
    which = f"channel{'s' if len(channels) > 1 else ''} {named}{more}" if channels else ""
    place = ", ".join(part for part in (f"run {run!r}" if run else "", which) if part)
    return f"{place}: {text}" if place else text


#: What instruments call the time column, lower case, in the languages their programs speak.
TIME_WORDS = frozenset(
    [
        "time",
        "t",
        "timestamp",
        "datetime",
        "zeit",
        "temps",
        "tiempo",
        "tempo",
        "tid",
        "tijd",
        "aika",
        "czas",
        "čas",
        "laiks",
        "laikas",
        "время",
        "时间",
        "時間",
        "시간",
    ]
)

#: Time units and their length in seconds. The empty unit is taken for seconds, with a remark.
TIME_SCALES = {
    "s": 1.0,
    "sec": 1.0,
    "seconds": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "µs": 1e-6,
    "μs": 1e-6,
    "ns": 1e-9,
    "min": 60.0,
    "h": 3600.0,
    "d": 86400.0,
}

#: A column of a file: its name there or its place (from 0), and its unit where the file does not say it.
Column = str | int | tuple[str | int, str]


@dataclass(frozen=True)
class Source:
    """The file being read; errors and provenance speak of it."""

    name: str
    size: int
    sha256: str
    format: str

    def error(self, place: str, message: str) -> DataFileError:
        """The exception for something wrong at ``place`` (a line, a record, a member; may be empty)."""
        return DataFileError(": ".join(part for part in (self.name, place, message) if part))


class TableOptions(TypedDict, total=False):
    """Options of ``load_recording`` for tables and counters; see there."""

    delimiter: str | None
    decimal: str | None
    thousands: str | None
    header: int | None
    units_row: int | None
    skip: int | str | Sequence[str]
    na: str | Sequence[str]
    wraps: Mapping[str, float] | None


@dataclass(frozen=True)
class Options:
    """The options of ``load_recording`` that concern readers; lines are 0 and texts () where none are given."""

    columns: Mapping[str, Column] | None = None
    axis: str = "time"
    rate: float | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    delimiter: str | None = None
    decimal: str | None = None
    thousands: str | None = None
    header: int = 0
    units_row: int = 0
    skip: int | tuple[str, ...] = 0
    na: tuple[str, ...] = ()
    wraps: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Options:
        """The options of a call, checked.

        Raises
        ------
        ValueError, TypeError
            An option that is not known, or a value that it cannot have.
        """
        check_keys(given, [one.name for one in fields(cls)], "load_recording", "an option")
        read = {name: value for name, value in given.items() if value is not None}
        for name in {"header", "units_row", "skip"} & set(read):
            if name != "skip" or isinstance(read[name], int):
                read[name] = whole_number(read[name], f"{name}, the number of a line,", int(name != "skip"))
        for name in {"skip", "na"} & set(read):
            if not isinstance(texts := read[name], int):
                read[name] = (texts,) if isinstance(texts, str) else tuple(texts)
                if not all(isinstance(text, str) and text.strip() for text in read[name]):
                    raise TypeError(f"{name} must be a text or several, {name}='#N/A', got {texts!r}")
        return cls(**read)

    def __post_init__(self) -> None:
        columns, axis, rate, decimal, marks = self.columns or {}, self.axis, self.rate, self.decimal, self.thousands
        if self.columns is not None and (not isinstance(columns, Mapping) or not columns):
            raise TypeError("columns must map our names to the file's, as {'time': 't', 'x': ('pos', 'mm')}")
        for ours, theirs in columns.items():
            given = theirs[0] if isinstance(theirs, tuple) and len(theirs) == 2 else theirs
            if isinstance(given, bool) or not isinstance(given, str | int) or not isinstance(ours, str):
                raise TypeError(
                    f"columns[{ours!r}] must be a header, a place from 0, or (one of these, unit): {theirs!r}"
                )
        if not isinstance(axis, str) or not axis.isidentifier() or axis == "run":
            raise ValueError(f"axis must be a name such as 'time' or 'frequency', got {axis!r}")
        if rate is not None and not real_number(rate, "rate") > 0:
            raise ValueError(f"rate must be a positive number of samples per second, got {rate!r}")
        if rate is not None and (axis != "time" or axis in columns):
            raise ValueError("rate makes a time axis where the file has none; give it without columns['time'] and axis")
        if (cut := self.delimiter) is not None and (not isinstance(cut, str) or len(cut) != 1 or cut in '"\r\n'):
            raise ValueError(f"delimiter must be one character such as ',', ';' or a tab, got {cut!r}")
        if decimal not in (None, ".", ","):
            raise ValueError(f"decimal must be '.' or ',', got {decimal!r}")
        if decimal == "," == cut:
            raise ValueError("delimiter and decimal cannot both be ','")
        if marks is not None and (marks not in (".", ",", " ", "'", "\u00a0", "\u202f") or marks == decimal):
            raise ValueError(f"thousands must be one of . , ' or a space, and not the decimal mark, got {marks!r}")
        for name, period in self.wraps.items():
            if not real_number(period, f"wraps[{name!r}]") > 0:
                raise ValueError(f"wraps[{name!r}] must be the count at which it begins anew, as 65536, got {period!r}")


@dataclass(frozen=True, eq=False)
class Trace:
    """One channel of one run: its values and where on the axis (mostly time, in seconds) they were taken.

    ``lines`` holds the line of each sample in a text file; ``record`` says what a sample is called in a binary one.
    """

    run: str
    name: str
    unit: str
    axis: FloatArray
    values: FloatArray
    origin: str
    axis_unit: str = "s"
    lines: IntArray | None = None
    attrs: Mapping[str, str] = field(default_factory=dict)

    def place(self, index: int) -> str:
        """Place of sample ``index`` in the file, in words."""
        if self.lines is not None:
            return f"line {self.lines[index]}"
        return f"{self.origin}, sample {index + 1}"


@dataclass
class Reading:
    """All that a reader found."""

    traces: list[Trace] = field(default_factory=list)
    remarks: Remarks = field(default_factory=Remarks)
    header: dict[str, Any] = field(default_factory=dict)
    run_attrs: dict[str, dict[str, str]] = field(default_factory=dict)
    synthetic: bool = False


def is_axis_name(name: str, axis: str) -> bool:
    """Return whether a column of this name is the axis: its own name, or any word for time when the axis is time."""
    word = name.strip().casefold()
    if word == axis.casefold():
        return True
    stem, _, unit = word.rpartition("_")  # t_s
    return axis == "time" and (word in TIME_WORDS or (stem in TIME_WORDS and unit in ("s", "ms", "us")))


def scaled_time(values: FloatArray, unit: str) -> FloatArray | None:
    """Times in seconds; None if ``unit`` is no unit of time."""
    scale = 1.0 if unit == "" else TIME_SCALES.get(unit.partition(" since ")[0].strip())
    if scale is None:
        return None
    return values if scale == 1.0 else values * scale


def names_of(candidates: Sequence[str], most: int = 12) -> str:
    """A list for a message, cut where it would be long."""
    shown = ", ".join(repr(name if len(name) <= 60 else name[:57] + "...") for name in candidates[:most])
    return shown + (f", and {len(candidates) - most} more" if len(candidates) > most else "")


def needed(module: str, package: str, source: Source, extra: str = "experiment") -> ModuleType:
    """Import ``module``; where it is missing, a DataFileError that says how to get it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise source.error("", f"reading it needs {not_installed(package, extra)}") from error


@contextmanager
def readable(what: str, source: Source, place: str = "") -> Iterator[None]:
    """Turn what a damaged file makes a library raise, almost anything, into a DataFileError."""
    try:
        yield
    except DataFileError:
        raise
    except Exception as error:
        message = f"cannot be read as {what}, it is damaged or cut short ({type(error).__name__}: {error})"
        raise source.error(place, message[:300]) from error


class Group(dict[str, Any]):
    """Arrays by name: their units and attributes, the rate at which they were sampled, the run they belong to."""

    def __init__(
        self,
        members: Mapping[str, Any] | None = None,
        units: Mapping[str, str] | None = None,
        rate: float | None = None,
    ) -> None:
        super().__init__(members or {})
        self.units, self.rate, self.run = dict(units or {}), rate, ""
        self.attrs: dict[str, dict[str, str]] = {}
        self.notes: dict[str, str] = {}


_PIECE = 1 << 16
_MAX_MEMBERS = 20_000


class Archive:
    """A ZIP file in memory. All pieces ever taken out of it, together, stay below ``inflation_limit``.

    What its directory says of sizes is not believed: bytes are counted as they come out.
    """

    def __init__(self, data: bytes, source: Source) -> None:
        self._source = source
        self._left = self._limit = inflation_limit(len(data))
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(data))
            infos = self._zip.infolist()
        # A damaged directory surfaces as almost any exception of zipfile.
        except Exception as error:
            raise source.error("", f"is not a whole ZIP archive ({error})") from error
        if len(infos) > _MAX_MEMBERS:
            raise source.error("", f"holds {len(infos)} members; at most {_MAX_MEMBERS} are read")
        self._infos = {info.filename.replace("\\", "/"): info for info in infos}

    @property
    def names(self) -> tuple[str, ...]:
        """The members, with forward slashes."""
        return tuple(self._infos)

    def pieces(self, name: str) -> Iterator[bytes]:
        """The bytes of a member, piece by piece."""
        info = self._infos.get(name)
        if info is None:
            raise self._source.error(name, "is not in the archive, though main.xml names it")
        if info.flag_bits & 1:
            raise self._source.error(name, "is encrypted; save the experiment without a password")
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise self._source.error(name, f"is packed by method {info.compress_type}; expected stored or deflated")
        try:
            with self._zip.open(info) as opened:
                while piece := opened.read(_PIECE):
                    self._left -= len(piece)
                    if self._left < 0:
                        raise self._source.error(
                            name,
                            f"unpacks to more than {self._limit} bytes, more than a file of {self._source.size} bytes "
                            "warrants; it may be made to exhaust memory",
                        )
                    yield piece
        except DataFileError:
            raise
        # zipfile raises NotImplementedError for a compression or a version of the format that it does not know.
        except (zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, NotImplementedError) as error:
            raise self._source.error(name, f"cannot be unpacked, it is damaged or cut short ({error})") from error
