"""A session: one folder with the recordings of an experiment and the notebook that says what each run was.

What an experimenter has, and all that ``identify`` and ``compare`` may see: the recorded files, and ``session.toml``
with the procedure and the settings of each run, and what is known of the apparatus. Its keys are strict: a misspelt
setting that is silently ignored makes a wrong parameter.
"""

from __future__ import annotations

import os
import tomllib
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from nonsmooth.errors import Answering, DataFileError, check_keys, unknown
from nonsmooth.recordings.load import ENDINGS, content_of, load_recording
from nonsmooth.recordings.reading import Options
from nonsmooth.recordings.recording import Recording, RecordingWarning
from nonsmooth.system.kinds import reader_of, real_number

NOTEBOOK = "session.toml"

#: What may stand in ``[apparatus]``: unit and meaning.
APPARATUS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "distance_per_turn": ("m", "travel of the car per turn of the rotary sensor's wheel"),
        "counts_per_turn": ("", "counts of the rotary sensor per turn"),
        "sample_rate": ("Hz", "rate of the sensors"),
        "turn_resolution": ("s", "resolution of the photogate's times"),
        "force_gain_limit": ("", "the force sensor's gain lies within 1 +- this (uniform, type B)"),
        "force_resolution": ("N", "step of the force sensor"),
        "force_range": ("N", "the force sensor saturates at +- this"),
        "mass": ("kg", "mass of the car, weighed"),
        "test_mass": ("kg", "mass hung on the support's spring in the drop test, weighed"),
        "string_length": ("m", "string between crank and driven spring"),
    }
)

#: Each procedure, and the settings that its runs must state.
PROCEDURES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "springs": (),
        "support": (),
        "impulse": (),
        "drop": (),
        "response": ("crank_length",),
        "voltage": ("voltage",),
        "crank": ("crank_length",),
        "grazing": ("crank_length", "gap"),
        "contact": ("crank_length", "gap"),
        "rise": ("crank_length", "crank_length_end", "gap"),
        "section": ("crank_length", "gap"),
    }
)

#: What may be set in a run: the type, the unit, the meaning.
SETTINGS: Mapping[str, tuple[Any, str, str]] = MappingProxyType(
    {
        "voltage": (float, "V", "motor voltage"),
        "crank_length": (float, "m", "length of the crank (at the beginning, where it changes)"),
        "crank_length_end": (float, "m", "length of the crank at the end of a slow rise"),
        "gap": (float, "m", "gap of the support as read at its screw"),
        "direction": (Literal["up", "down"], "", "up or down: how the steps follow one another"),
        "figure": (int, "", "number of the published figure whose setting this is"),
        "note": (str, "", "a remark"),
    }
)


@dataclass(frozen=True)
class Quantity:
    """A number from the notebook with its standard uncertainty; 0 where none was stated."""

    value: float
    uncertainty: float = 0.0

    def __float__(self) -> float:
        return self.value


class Entry(NamedTuple):
    """One ``[[recording]]`` of the notebook."""

    file: str
    procedure: str
    runs: tuple[tuple[str, Mapping[str, Any]], ...]
    read: Mapping[str, Any]


def apparatus_of(given: Any, where: str) -> Mapping[str, Quantity]:
    """The table ``[apparatus]``, checked."""
    table = table_of(given, where, APPARATUS)
    known = {}
    for name, value in table.items():
        stated = value if isinstance(value, dict) else {"value": value}
        table_of(stated, f"{where}, {name}", ("value", "uncertainty"))
        if "value" not in stated:
            raise ValueError(f"{where}, {name}: needs `value`")
        quantity = Quantity(**{key: real_number(one, f"{where}, {name}: {key}") for key, one in stated.items()})
        if quantity.value <= 0 or quantity.uncertainty < 0:
            raise ValueError(f"{where}, {name} = {value!r}: must be positive, an uncertainty zero or more")
        known[name] = quantity
    return MappingProxyType(known)


def entry_of(given: Any, folder: Path, where: str) -> Entry:
    """One table ``[[recording]]``, checked; its file must be there."""
    table = table_of(given, where, ("file", "procedure", "runs", "read"))
    for key in ("file", "procedure", "runs"):
        if key not in table:
            raise ValueError(f"{where}: needs `{key}`")
    file, procedure = table["file"], table["procedure"]
    if not isinstance(file, str) or file != Path(file).name or file in ("", ".", ".."):
        raise ValueError(f"{where}: file = {file!r} must be the name of a file in the folder of the notebook")
    if not (folder / file).is_file():
        raise DataFileError(f"{folder / file}: no such file (named in {where})")
    if not isinstance(procedure, str) or procedure not in PROCEDURES:
        raise ValueError(f"{where}: {unknown(procedure, 'a procedure', 'a session', PROCEDURES.keys())}")
    if not isinstance(table["runs"], list) or not table["runs"]:
        raise ValueError(f'{where}: runs must be a list of tables as {{ run = "Run #1", voltage = 4.2 }}')
    runs: dict[str, Mapping[str, Any]] = {}
    for i, item in enumerate(table["runs"], 1):
        name, settings = _run(item, procedure, f"{where} ({file}), run {i}")
        if name in runs:
            raise ValueError(f"{where}: run {name!r} is named twice")
        runs[name] = settings
    known = "format", *vars(Options())
    read = table_of(table.get("read", {}), f"{where}, read", known, "an option of load_recording")
    options = dict(read)
    if isinstance(options.get("columns"), dict):  # TOML has lists where load_recording takes (column, unit)
        options["columns"] = {k: tuple(v) if isinstance(v, list) else v for k, v in options["columns"].items()}
    return Entry(file, procedure, tuple(runs.items()), options)


def _run(given: Any, procedure: str, where: str) -> tuple[str, Mapping[str, Any]]:
    table = dict(table_of(given, where, ("run", *SETTINGS), "a setting"))
    name = table.pop("run", None)
    if not isinstance(name, str) or not name:
        raise ValueError(f'{where}: needs run = "..." with the name of the run in the file')
    if missing := [key for key in PROCEDURES[procedure] if key not in table]:
        raise ValueError(f"{where}: a run of {procedure!r} must state {', '.join(missing)}")
    for key, value in table.items():
        kind, what = SETTINGS[key][0], f"{where}: {key}"
        table[key] = real_number(value, what) if kind is float else reader_of(kind)(value, what)
    return name, MappingProxyType(table)


def table_of(value: Any, where: str, known: Iterable[str], kind: str = "a key") -> Mapping[str, Any]:
    """``value`` where it is a table of known keys."""
    if not isinstance(value, dict):
        raise ValueError(f"{where} must be a table with keys, got {value!r}")
    check_keys(value, known, where, kind)
    return value


class RecordedRun(NamedTuple):
    """One run of a procedure: where its channels are, its name there, and what was set."""

    recording: Recording
    run: str
    settings: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Session(Answering):
    """The recordings of one experiment by procedure, and its notebook. Read one with :func:`load_session`.

    Attributes
    ----------
    folder : Path
    title : str
    synthetic : bool
        Whether the notebook says that the recordings were computed.
    apparatus : mapping of str to Quantity
        What is known of the apparatus; names and units are those of ``APPARATUS``.
    """

    folder: Path
    title: str
    synthetic: bool
    apparatus: Mapping[str, Quantity]
    entries: tuple[Entry, ...] = ()
    _read: dict[str, Recording] = field(default_factory=dict, repr=False)

    @property
    def procedures(self) -> tuple[str, ...]:
        """The procedures of which there are recordings, in the notebook's order."""
        return tuple(dict.fromkeys(entry.procedure for entry in self.entries))

    @property
    def files(self) -> tuple[str, ...]:
        """The files that the notebook names."""
        return tuple(entry.file for entry in self.entries)

    def recordings(self, procedure: str) -> list[RecordedRun]:
        """The runs of a procedure, each ``(recording, run, settings)``; empty where there are none.

        Files are read when first asked for, and kept.

        Raises
        ------
        ValueError
            If there is no such procedure, a run of the notebook is not in its file, or a file that says that it
            was computed stands in a session that does not.
        DataFileError
            If a file cannot be read.
        """
        if procedure not in PROCEDURES:
            raise ValueError(unknown(procedure, "a procedure", "a session", PROCEDURES.keys()))
        read = [(self._recording(entry), entry.runs) for entry in self.entries if entry.procedure == procedure]
        return [RecordedRun(recording, *run) for recording, runs in read for run in runs]

    def _recording(self, entry: Entry) -> Recording:
        if entry.file in self._read:
            return self._read[entry.file]
        recording = load_recording(self.folder / entry.file, **entry.read)
        if recording.synthetic and not self.synthetic:
            raise ValueError(
                f"{self.folder / entry.file} says that it is synthetic, the notebook does not: "
                f"put `synthetic = true` under [session] of {NOTEBOOK}"
            )
        named = [run for run, _ in entry.runs]
        for run in named:
            if run not in recording.runs:
                raise ValueError(
                    f"{self.folder / NOTEBOOK}: {entry.file} has no run {run!r}; it has: {', '.join(recording.runs)}"
                )
        if idle := [run for run in recording.runs if run not in named]:
            warnings.warn(
                f"{entry.file}: the notebook does not name {', '.join(idle)}; not used", RecordingWarning, stacklevel=4
            )
        self._read[entry.file] = recording
        return recording

    def __repr__(self) -> str:
        lines = [f"Session {self.title!r} in {self.folder}{' (synthetic)' if self.synthetic else ''}"]
        lines += [f"  {entry.procedure}: {entry.file}, {len(entry.runs)} runs" for entry in self.entries]
        return "\n".join(lines)


def load_session(folder: str | os.PathLike[str]) -> Session:
    """Read the notebook of a session folder; the recordings are read when they are asked for.

    Parameters
    ----------
    folder : path
        The folder that holds ``session.toml`` and the files it names.

    Returns
    -------
    Session

    Raises
    ------
    DataFileError
        If there is no such folder, notebook or named file, or the notebook is not TOML.
    ValueError, TypeError
        If the notebook has a key that is not known, lacks one, or has a value of the wrong kind; the message says
        which, and what is allowed.

    Examples
    --------
    >>> session = ns.recordings.load_session("rig_03")                       # doctest: +SKIP
    >>> for recording, run, settings in session.recordings("response"):      # doctest: +SKIP
    ...     angle = recording.channel("Angle", run)
    """
    place = Path(folder)
    notebook = place / NOTEBOOK
    try:
        document = tomllib.loads(content_of(notebook).decode("utf-8-sig"))
    except DataFileError as error:
        raise DataFileError(f"{error}; a session has a {NOTEBOOK}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DataFileError(f"{notebook}: is not a TOML file: {error}") from None
    where = str(notebook)
    table_of(document, where, ("session", "apparatus", "recording"), "a table")
    head = table_of(document.get("session", {}), f"{where}, [session]", ("title", "synthetic"))
    title, synthetic = head.get("title", place.name), head.get("synthetic", False)
    if not isinstance(title, str) or not isinstance(synthetic, bool):
        raise TypeError(f"{where}, [session]: title is a text and synthetic true or false, got {dict(head)!r}")
    apparatus = apparatus_of(document.get("apparatus", {}), f"{where}, [apparatus]")
    listed = document.get("recording", [])
    if not isinstance(listed, list) or not listed:
        raise ValueError(f"{where}: needs at least one [[recording]] with file, procedure and runs")
    entries = tuple(entry_of(item, place, f"{where}, recording {i}") for i, item in enumerate(listed, 1))
    files = [entry.file for entry in entries]
    if twice := sorted({file for file in files if files.count(file) > 1}):
        raise ValueError(f"{where}: {', '.join(twice)} is named twice; put all of its runs under one [[recording]]")
    unnamed = sorted(p.name for p in place.iterdir() if p.suffix.lower() in ENDINGS and p.name not in files)
    if unnamed:
        warnings.warn(f"{where} does not name {', '.join(unnamed)}; not used", RecordingWarning, stacklevel=2)
    return Session(place, title, synthetic, apparatus, entries)
