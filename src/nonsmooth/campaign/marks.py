"""Marks of finished chunks and the log of those begun: small files, whole or not there, and trouble with the disk."""

from __future__ import annotations

import errno
import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from nonsmooth.errors import DataFileError

__all__ = ["mark_in", "marks_of", "started", "told", "write_whole"]


def marks_of(path: Path) -> Iterator[dict[str, Any]]:
    """The marks of a store's finished chunks."""
    for file in sorted((path / "run").glob("*.json")):
        mark = mark_in(file)
        if mark is not None:
            yield mark


def started(log: Path) -> list[int]:
    """The chunks that were begun, in their order; a line cut short by a crash of the machine is passed over."""
    found = []
    for line in log.read_text(encoding="utf-8").splitlines():
        with suppress(ValueError, KeyError, TypeError):
            found.append(int(json.loads(line)["chunk"]))
    return found


def mark_in(file: Path) -> dict[str, Any] | None:
    """A mark; None where there is none, or it was cut short by a crash of the machine."""
    try:
        mark = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return mark if isinstance(mark, dict) and {"chunk", "key", "seconds"} <= set(mark) else None


def write_whole(path: Path, data: bytes) -> None:
    """Another process sees the whole file or none."""
    handle, unfinished = tempfile.mkstemp(prefix=f".{path.name}-", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.replace(unfinished, path)
    except BaseException:
        Path(unfinished).unlink(missing_ok=True)
        raise


@contextmanager
def told(path: Path) -> Iterator[None]:
    """Trouble with the disk as one sentence."""
    try:
        yield
    except OSError as error:
        why = {
            errno.ENOSPC: "the disk is full", errno.EDQUOT: "the quota of the disk is used up",
            errno.EROFS: "the disk is read-only", errno.EACCES: "it may not be written",
            errno.EPERM: "it may not be written",
        }.get(error.errno or 0)  # fmt: skip
        if why is None:
            raise
        raise DataFileError(f"{path}: {why} ({error}); finished chunks are whole, run it again to go on") from error
