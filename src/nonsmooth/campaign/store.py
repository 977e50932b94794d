"""A Zarr store for the chunks of one work: written chunk by chunk, whole or not at all, marked, gone on with later.

::

    chart.zarr/              a Zarr group; the attribute ``nonsmooth_campaign`` says what the work is
        results/             one array per column, one file per chunk, of zeros too (Zstandard, fixed level)
        run/000017.json      chunk 17 is done: its key and the hash of its content, by whom, when, time worked
        run/started.log      which chunks were begun: one begun twice was lost with its worker

A chunk's key is a hash of the model, the parameters, the options, the source of kernels and rules, and the chunk's
place. Its mark is written after its arrays, so that a chunk cut short counts as missing. Arrays hold results only:
facts about the run (which machine, how long) stay in ``run``, so that equal work gives equal files.

Processes write chunks without knowing of each other, so each chunk has its own hash, and they are compared whenever
the store is read. The hash of a finished store is the hash of these: it says whether two stores hold the same.
"""

from __future__ import annotations

import hashlib
import json
import os
import socket
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.campaign.work import ChunkedWork, Columns, described, difference, places_of, processor_type
from nonsmooth.errors import DataFileError
from nonsmooth.results.store import needs_zarr
from nonsmooth.results.whole import beside, digest, seal, sealed, told, write_whole

ATTRIBUTE = "nonsmooth_campaign"
ANEW = "give another name, and compute it anew there"
KEPT = "finished chunks are whole, run it again to go on"
LEVEL = 3  # of the compression
FACTS = 440  # bytes of the facts about the run that are kept for each chunk


@dataclass(frozen=True)
class ChunkStore:
    """A store that belongs to one work."""

    path: Path
    key: str

    def done(self) -> set[int]:
        """Chunks that are there, whole."""
        return {mark["chunk"] for mark in marks_of(self.path) if mark["key"] == self._key(mark["chunk"])}

    def has(self, chunk: int) -> bool:
        """Return whether a chunk is there, whole."""
        mark = mark_in(self._mark(chunk))
        return mark is not None and mark["key"] == self._key(chunk)

    def compute(self, work: ChunkedWork, chunk: int) -> None:
        """Compute a chunk and keep it, in the thread that calls."""
        line = json.dumps({"chunk": chunk, "host": socket.gethostname(), "process": os.getpid(), "began": time.time()})
        with told(self.path, KEPT), open(self.path / "run" / "started.log", "a", encoding="utf-8") as log:
            log.write(line + "\n")  # what was begun more often than once was lost before
        # of a processor's thread, which other users of the machine do not lengthen; of a GPU those on the wall
        now = time.perf_counter if work.device == "cuda" else time.thread_time
        began = now()
        arrays = work.compute(chunk)
        self.write(work, chunk, arrays, now() - began)

    def write(self, work: ChunkedWork, chunk: int, arrays: Columns, seconds: float) -> None:
        """Keep a chunk: its arrays first, then the mark that it is done.

        DataFileError: the disk is full, or may not be written; what was there before is whole."""
        first, last = work.bounds(chunk)
        with told(self.path, KEPT):
            group = _results(self.path, "r+")
            kept = {name: np.ascontiguousarray(arrays[name], item.dtype) for name, item in work.columns().items()}
            _put(group, kept, first, last)
            mark = {
                "chunk": chunk,
                "key": self._key(chunk),
                "content": _content(kept),
                "cpu": processor_type(work.device),
                "host": socket.gethostname(),
                "process": os.getpid(),
                "seconds": round(seconds, 4),
                "ended": time.time(),
            }
            write_whole(self._mark(chunk), json.dumps(seal(mark)).encode())

    def read(self, work: ChunkedWork) -> dict[str, NDArray[Any]]:
        """All columns, over all places.

        Raises
        ------
        DataFileError
            A chunk that is marked as done is damaged; its mark is taken away, so that the next run computes it again.
            The description of a column was altered.
        """
        group = _results(self.path, "r")
        _check_columns(self.path, group, work)
        with told(self.path, KEPT):
            columns = _whole(group, work)
            there = columns or group
            damaged = [mark["chunk"] for mark in marks_of(self.path) if not self._is_whole(work, mark, there)]
        if damaged:
            for chunk in damaged:
                self._mark(chunk).unlink(missing_ok=True)
            some = ", ".join(map(str, damaged[:5]))
            raise DataFileError(
                f"{self.path}: {len(damaged)} chunks are damaged ({some}); run it again, they will be computed anew"
            )
        return columns or {name: np.asarray(group[name][...]) for name in work.columns()}

    def _is_whole(self, work: ChunkedWork, mark: Mapping[str, Any], columns: Any) -> bool:
        """Return whether a chunk's arrays are those that were written."""
        first, last = work.bounds(mark["chunk"])
        try:
            found = _content({name: np.asarray(columns[name][first:last]) for name in work.columns()})
        except (OSError, MemoryError):
            raise  # the machine's trouble: the chunk may be whole
        except Exception:
            return False
        return bool(found == mark.get("content"))

    def _mark(self, chunk: int) -> Path:
        return self.path / "run" / f"{chunk:06d}.json"

    def _key(self, chunk: int) -> str:
        return hashlib.sha256(f"{self.key}:{chunk}".encode()).hexdigest()


def open_store(path: str | os.PathLike[str], work: ChunkedWork, *, any_cpu: bool = False) -> ChunkStore:
    """The store at ``path`` for this work; it is made where there is none.

    Parameters
    ----------
    any_cpu : bool
        Go on with a store that was begun on another type of processor (or of GPU): its numbers may differ in the last
        digits.

    Raises
    ------
    ImportError
        Where the package zarr is not installed.
    ValueError
        A name that does not end in .zarr.
    DataFileError
        The store of another work, or of another type of processor; something else that stands there; a folder that
        does not exist or may not be written. Nothing is changed then.
    """
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"store = {path!r}; give the name of a folder that ends in .zarr")
    target = Path(path)
    if target.suffix != ".zarr":
        raise ValueError(f"{target}: the name of a store must end in .zarr")
    needs_zarr(target)
    wanted = described(work)
    key = hashlib.sha256(json.dumps(wanted).encode()).hexdigest()  # places lie in the order of a grid's names
    if not target.exists():
        if not target.parent.is_dir():
            raise DataFileError(f"{target}: the folder {target.parent} does not exist; create it first")
        _make(target, work, wanted, key)
    record = describe_store(target)
    if record["key"] != key:
        why = difference(record, wanted)
        raise DataFileError(f"{target}: is the store of another work: {why}; give another name")
    here = processor_type(work.device)
    if record["cpu"] != here and not any_cpu:
        raise DataFileError(
            f"{target}: was begun on a processor of type {record['cpu']!r}, this is {here!r}; results may "
            "differ in the last digits. Go on with any_cpu=True, or begin another store"
        )
    return ChunkStore(target, key)


def describe_store(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Describe a store's work and its progress: ``verb``, ``system``, ``options``, ``chunks``, ``done``, ``seconds``.

    ``content``: once all chunks are there, the hash of their hashes; else None.

    DataFileError: not a store of chunks, or its description was altered."""
    target = Path(path)
    needs_zarr(target)
    import zarr

    try:
        record: dict[str, Any] = dict(json.loads(str(zarr.open_group(target, mode="r").attrs[ATTRIBUTE])))
    except Exception as error:
        raise DataFileError(f"{target}: is not a store of chunks ({error})") from error
    if not sealed(record):
        raise DataFileError(f"{target}: what it says of its work was altered, or is of an older version; {ANEW}")
    marks = list(marks_of(target))
    contents = {mark["chunk"]: mark["content"] for mark in marks}
    record["done"] = len(contents)
    record["content"] = digest(sorted(contents.items())) if len(contents) == record["chunks"] else None
    record["seconds"] = sum(mark["seconds"] for mark in marks)
    record["started"] = len(started(target)) or record["done"]
    return record


def stored_bytes(work: ChunkedWork, samples: Sequence[Columns], kept: int) -> int:
    """Bytes that a store of the whole work takes, by what a sample of its places takes in a store in memory.

    ``kept``: places of a chunk of the store.
    """
    import zarr
    from zarr.storage import MemoryStore

    taken: dict[str, Any] = {}
    group = zarr.open_group(MemoryStore(taken), mode="w", zarr_format=3)
    columns = {name: np.concatenate([sample[name] for sample in samples]) for name in work.columns()}
    there = len(next(iter(columns.values())))
    _create(group, work, there, min(kept, there))
    _put(group, columns, 0, there)
    places = places_of(work)
    heads = sum(len(data) for name, data in taken.items() if name.endswith("zarr.json"))
    heads += len(json.dumps(json.dumps(described(work))))
    chunks = sum(len(data) for name, data in taken.items() if not name.endswith("zarr.json"))
    return heads + round(chunks * places / there) + -(-places // kept) * FACTS


def _make(target: Path, work: ChunkedWork, wanted: Mapping[str, Any], key: str) -> None:
    """A whole empty store, or none."""
    import zarr

    with told(target, "nothing was begun; make room, or give another place"), beside(target) as folder:
        fresh = folder / "new.zarr"
        root = zarr.open_group(fresh, mode="w", zarr_format=3)
        facts = {"key": key, "device": work.device, "cpu": processor_type(work.device), "made": time.time()}
        root.attrs[ATTRIBUTE] = json.dumps(seal({**wanted, **facts}))
        results = root.create_group("results")
        first, last = work.bounds(0)
        _create(results, work, wanted["places"], last - first)
        (fresh / "run").mkdir()
        try:
            os.replace(fresh, target)
        except OSError:
            if not target.is_dir():  # else another process was faster
                raise


def _create(group: Any, work: ChunkedWork, places: int, chunk: int) -> None:
    """One array per column, in chunks of so many places."""
    from zarr.codecs import ZstdCodec

    for name, item in work.columns().items():
        shape, chunks, compressors = (places, *item.shape), (chunk, *item.shape), ZstdCodec(level=LEVEL)
        group.create_array(name, shape=shape, chunks=chunks, dtype=item.dtype, compressors=compressors)


def _put(group: Any, arrays: Columns, first: int, last: int) -> None:
    """Write places of each column, zeros too.

    That zeros are written is a setting of an opened array, not of the file. It is set for each array: the library's
    configuration is one for the whole process, the user's threads included.
    """
    import zarr

    for name, values in arrays.items():
        found = group[name]
        array = zarr.Array(zarr.AsyncArray(found.metadata, found.store_path, {"write_empty_chunks": True}))
        array[first:last] = values


def _results(path: Path, mode: Any) -> Any:
    import zarr

    try:
        return zarr.open_group(path / "results", mode=mode)
    except OSError:
        raise
    except Exception as error:
        raise DataFileError(f"{path}: the description of its results is damaged ({error}); {ANEW}") from error


def _check_columns(path: Path, group: Any, work: ChunkedWork) -> None:
    """Refuse columns whose description was altered: their type and shape follow from the work."""
    places = places_of(work)
    for name, item in work.columns().items():
        try:
            array = group[name]
            found = (array.shape, array.dtype)
        except Exception as error:
            raise DataFileError(f"{path}: the description of column {name!r} is damaged ({error}); {ANEW}") from error
        if found != ((places, *item.shape), np.dtype(item.dtype)):
            raise DataFileError(f"{path}: the description of column {name!r} was altered; {ANEW}")


def _whole(group: Any, work: ChunkedWork) -> dict[str, NDArray[Any]]:
    """All columns; none where a chunk is damaged: that comes up as almost anything from the codecs."""
    try:
        return {name: np.asarray(group[name][...]) for name in work.columns()}
    except (OSError, MemoryError):
        raise
    except Exception:
        return {}


def _content(arrays: Columns) -> str:
    found = hashlib.sha256()
    for name in sorted(arrays):
        found.update(f"{name} {arrays[name].dtype.str} {arrays[name].shape} ".encode())
        found.update(np.ascontiguousarray(arrays[name]).reshape(-1).view(np.uint8).data)
    return found.hexdigest()


def marks_of(path: Path) -> Iterator[dict[str, Any]]:
    """The marks of a store's finished chunks."""
    for file in sorted((path / "run").glob("*.json")):
        mark = mark_in(file)
        if mark is not None:
            yield mark


def started(path: Path) -> list[int]:
    """The chunks that were begun, in their order; a line that was cut short or altered is passed over."""
    found, log = list[int](), path / "run" / "started.log"
    text = log.read_text(encoding="utf-8", errors="replace") if log.exists() else ""
    for line in text.splitlines():
        with suppress(ValueError, KeyError, TypeError):
            found.append(int(json.loads(line)["chunk"]))
    return found


def mark_in(file: Path) -> dict[str, Any] | None:
    """A mark; None where there is none, or it was cut short or altered."""
    try:
        mark = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return mark if sealed(mark) else None
