"""A session: one folder with the recordings of an experiment and the notebook that says what each run was.

What an experimenter has, and all that ``identify`` and ``compare`` may see: the recorded files, and ``session.toml``
with the procedure and the settings of each run, and what is known of the apparatus (``notebook``).
"""

from __future__ import annotations

import os
import tomllib
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.load import content_of, load_recording
from nonsmooth.recordings.notebook import (
    APPARATUS,
    NOTEBOOK,
    PROCEDURES,
    SETTINGS,
    Entry,
    Quantity,
    apparatus_of,
    entry_of,
    table_of,
)
from nonsmooth.recordings.recording import Recording, RecordingWarning
from nonsmooth.system.names import check_keys, unknown

__all__ = ["APPARATUS", "NOTEBOOK", "PROCEDURES", "SETTINGS", "Quantity", "RecordedRun", "Session", "load_session"]

_DATA_SUFFIXES = (".csv", ".tsv", ".txt", ".cap", ".lvm", ".tdms", ".mat")


class RecordedRun(NamedTuple):
    """One run of a procedure: where its channels are, its name there, and what was set."""

    recording: Recording
    run: str
    settings: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Session:
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
        found = []
        for entry in self.entries:
            if entry.procedure == procedure:
                recording = self._recording(entry)
                found += [RecordedRun(recording, run, settings) for run, settings in entry.runs]
        return found

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
        document = tomllib.loads(content_of(notebook).decode("utf-8"))
    except DataFileError as error:
        raise DataFileError(f"{error}; a session has a {NOTEBOOK}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DataFileError(f"{notebook}: is not a TOML file: {error}") from None
    where = str(notebook)
    check_keys(document, ("session", "apparatus", "recording"), where, "a table")
    head = table_of(document.get("session", {}), f"{where}, [session]")
    check_keys(head, ("title", "synthetic"), f"{where}, [session]", "a key")
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
    unnamed = sorted(p.name for p in place.iterdir() if p.suffix.lower() in _DATA_SUFFIXES and p.name not in files)
    if unnamed:
        warnings.warn(f"{where} does not name {', '.join(unnamed)}; not used", RecordingWarning, stacklevel=2)
    return Session(place, title, synthetic, apparatus, entries)
