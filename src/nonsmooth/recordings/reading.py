"""Matter of every reader: the file, what is asked of it, and what is found: traces and remarks.

A reader is a function ``read(data: bytes, reading: Reading)``. It takes the whole file as bytes, touches no disk,
raises only ``DataFileError``, adds to the reading, and leaves rates, grouping and labels to ``assemble``. Recordings
come from elsewhere: what a file claims is checked against its size.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from importlib import import_module
from types import ModuleType
from typing import Annotated, Any, Literal

from nonsmooth.arrays import FloatArray, IntArray
from nonsmooth.errors import DataFileError, not_installed
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import above, at_least

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


@dataclass(kw_only=True)
class Remarks:
    """Sentences on a file, a run, or a channel of a run."""

    _channels: dict[tuple[str, str], list[str]] = field(default_factory=dict, init=False)

    def say(self, sentence: str) -> None:
        """Something about the file as a whole."""
        self._channels.setdefault(("", sentence), [])

    def of(self, run: str, channel: str, sentence: str) -> None:
        """Something about a channel of a run ("" where it concerns all runs)."""
        self._channels.setdefault((run, sentence), []).append(channel)

    def sentences(self) -> tuple[str, ...]:
        """All of them; channels of one run of which the same is to be said stand together, and so do many runs."""
        alike: dict[tuple[str, ...], list[tuple[str, str]]] = {}  # runs, each with its sentence
        for (run, text), channels in self._channels.items():
            kind = (re.sub(r"\d+", "#", text), *channels) if run else (run, text)
            each = list(dict.fromkeys(channels))
            named = ", ".join(map(repr, each[:_NAMED])) + (f" and {len(each) - _NAMED} more" if each[_NAMED:] else "")
            of = [f"run {run!r}"] * bool(run) + [f"channel{'s' if len(each) > 1 else ''} {named}"] * bool(each)
            alike.setdefault(kind, []).append((run, f"{', '.join(of)}: {text}" if of else text))
        said: list[str] = []
        for group in alike.values():
            (_, first), (last, _), more = group[0], group[-1], len(group) - 1
            few = [text for _, text in group]
            said += few if more < _ALIKE else [f"{first} (and likewise {more} more runs, to {last!r})"]
        return tuple(said)


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
    "": 1.0,
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


@checked
@dataclass
class Options:
    """Options of ``load_recording``, which says what each is."""

    columns: (
        Annotated[Mapping[str, Any], "it maps our names to the file's, {'time': 't', 'x': ('pos', 'mm')}"] | None
    ) = None
    axis: str = "time"
    rate: Annotated[float, above(0)] | None = None
    units: Mapping[str, str] | None = None
    delimiter: str | None = None
    decimal: Literal[".", ",", None] = None
    thousands: Literal[".", ",", " ", "'", "\u00a0", "\u202f", None] = None
    header: Annotated[int, at_least(1)] | None = None
    units_row: Annotated[int, at_least(1)] | None = None
    skip: Annotated[int, at_least(0)] | Sequence[str] = 0
    na: Sequence[str] | None = None
    wraps: Annotated[Mapping[str, Annotated[float, above(0)]], "counts at which channels begin anew"] | None = None

    def __post_init__(self) -> None:
        columns, cut = self.columns or {}, self.delimiter
        for ours, theirs in columns.items():
            given = theirs[0] if isinstance(theirs, tuple) and len(theirs) == 2 else theirs
            if isinstance(given, bool) or not isinstance(given, str | int) or not isinstance(ours, str):
                raise TypeError(
                    f"columns[{ours!r}] must be a header, a place from 0, or (one of these, unit): {theirs!r}"
                )
        if not self.axis.isidentifier() or self.axis == "run":
            raise ValueError(f"axis must be a name such as 'time' or 'frequency', got {self.axis!r}")
        if self.rate is not None and (self.axis != "time" or self.axis in columns):
            raise ValueError("rate makes a time axis where the file has none; give it without columns['time'] and axis")
        if cut is not None and (len(cut) != 1 or cut in '"\r\n'):
            raise ValueError(f"delimiter must be one character such as ',', ';' or a tab, got {cut!r}")
        if self.decimal is not None and self.decimal in (cut, self.thousands):
            raise ValueError(f"decimal = {self.decimal!r} cannot be the delimiter or the mark between thousands too")


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


@dataclass(kw_only=True)
class Reading(Options, Remarks):
    """A file as it is read: its name and size, what is asked of it, and all that was found; errors speak of it."""

    name: str
    size: int
    sha256: str = ""
    format: str = ""
    traces: list[Trace] = field(default_factory=list)
    told: dict[str, Any] = field(default_factory=dict)  # by the file, of itself
    run_attrs: dict[str, dict[str, str]] = field(default_factory=dict)
    synthetic: bool = False
    left: int = field(init=False)  # bytes that it may still become

    def __post_init__(self) -> None:
        super().__post_init__()
        self.left = inflation_limit(self.size)

    @property
    def says_axes(self) -> bool:
        """Return whether options say what a Capstone file says itself."""
        return self.columns is not None or self.rate is not None or self.axis != "time"

    @property
    def asked(self) -> dict[str, Any]:
        """The options that differ from their defaults."""
        return {one.name: said for one in fields(Options) if (said := getattr(self, one.name)) != one.default}

    def error(self, place: str, message: str) -> DataFileError:
        """The exception for something wrong at ``place`` (a line, a record, a member; may be empty)."""
        return DataFileError(": ".join(part for part in (self.name, place, message) if part))

    def warrant(self, n_bytes: float, said: str, place: str = "") -> None:
        """Take bytes off what the file may become, all its parts together; DataFileError where it warrants no more."""
        if n_bytes > self.left:
            why = f"{said}, more than a file of {self.size} bytes warrants; it may be made to exhaust memory"
            raise self.error(place, why)
        self.left -= int(n_bytes)

    def few(self, count: int, what: str, place: str = "", most: int = MAX_COLUMNS) -> None:
        """DataFileError where the file holds more of something than are read."""
        if count > most:
            raise self.error(place, f"holds {count} {what}; at most {most} are read")


def is_axis_name(name: str, axis: str) -> bool:
    """Return whether a column of this name is the axis: its own name, or any word for time when the axis is time."""
    word = name.strip().casefold()
    if word == axis.casefold():
        return True
    stem, _, unit = word.rpartition("_")  # t_s
    return axis == "time" and (word in TIME_WORDS or (stem in TIME_WORDS and unit in ("s", "ms", "us")))


def names_of(candidates: Sequence[str], most: int = 12) -> str:
    """A list for a message, cut where it would be long."""
    shown = ", ".join(repr(name if len(name) <= 60 else name[:57] + "...") for name in candidates[:most])
    return shown + (f", and {len(candidates) - most} more" if len(candidates) > most else "")


def needed(module: str, package: str, reading: Reading, extra: str = "experiment") -> ModuleType:
    """Import ``module``; where it is missing, a DataFileError that says how to get it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise reading.error("", f"reading it needs {not_installed(package, extra)}") from error


@contextmanager
def readable(done: str, reading: Reading, place: str = "") -> Iterator[None]:
    """Turn what a damaged file makes a library raise, almost anything, into a DataFileError: it cannot be ``done``."""
    try:
        yield
    except DataFileError:
        raise
    except Exception as error:
        message = f"cannot be {done}, it is damaged or cut short ({type(error).__name__}: {error})"
        raise reading.error(place, message[:300]) from error


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
        self.rates: dict[str, float] = {}  # of arrays that have one of their own
        self.attrs: dict[str, dict[str, str]] = {}
        self.notes: dict[str, str] = {}


_PIECE = 1 << 16
_MAX_MEMBERS = 20_000


class Archive:
    """A ZIP file in memory. All pieces ever taken out of it, together, are no more than its size warrants.

    What its directory says of sizes is not believed: bytes are counted as they come out.
    """

    def __init__(self, data: bytes, reading: Reading) -> None:
        self._reading, self._most = reading, reading.left
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(data))
            infos = self._zip.infolist()
        except Exception as error:  # of a damaged directory almost any
            raise reading.error("", f"is not a whole ZIP archive ({error})") from error
        reading.few(len(infos), "members", most=_MAX_MEMBERS)
        self._infos = {info.filename.replace("\\", "/"): info for info in infos}

    @property
    def names(self) -> tuple[str, ...]:
        """The members, with forward slashes."""
        return tuple(self._infos)

    def pieces(self, name: str) -> Iterator[bytes]:
        """The bytes of a member, piece by piece."""
        info = self._infos.get(name)
        if info is None:
            raise self._reading.error(name, "is not in the archive, though main.xml names it")
        if info.flag_bits & 1:
            raise self._reading.error(name, "is encrypted; save the experiment without a password")
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise self._reading.error(name, f"is packed by method {info.compress_type}; expected stored or deflated")
        with readable("unpacked", self._reading, name), self._zip.open(info) as opened:
            while piece := opened.read(_PIECE):
                self._reading.warrant(len(piece), f"unpacks to more than {self._most} bytes", name)
                yield piece
