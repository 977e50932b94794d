"""Files and folders that are whole or not there: written beside their place and moved there when complete.

What a process leaves behind that was killed while it wrote is taken away by the next one that writes to the same
place. A folder says in ``writer.json`` whose it is: one without that file is nobody's business here.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import socket
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path
from typing import Any

from nonsmooth.errors import DataFileError

REMEDY = "close it where it is open, make room, or give another name"
WRITTEN = "it could not be written"
_OLD = "old"  # where a folder goes that is about to be replaced
_WRITER = "writer.json"
_DAY = 86400.0  # seconds after which a folder is left behind whose writer cannot be asked (another machine, a restart)


@contextmanager
def beside(target: Path) -> Iterator[Path]:
    """A new folder beside ``target``, gone at the end; folders that killed processes left there are gone before."""
    clear(target)
    with tempfile.TemporaryDirectory(prefix=f".{target.name}-", dir=target.parent) as folder:
        Path(folder, _WRITER).write_text(json.dumps({"place": _place(), "process": os.getpid()}), encoding="utf-8")
        yield Path(folder)


def clear(target: Path) -> None:
    """Take away what killed processes left of ``target``; what they had moved out of its place goes back there."""
    with suppress(OSError):  # a folder that may not be read or changed: its owner's next run clears it
        for folder in target.parent.glob(f".{escape(target.name)}-????????"):
            if not folder.is_symlink() and folder.is_dir() and _stale(folder):
                moved = folder / _OLD
                if moved.exists() and not target.exists():
                    os.replace(moved, target)
                shutil.rmtree(folder, ignore_errors=True)


def replace(target: Path, fresh: Path) -> None:
    """Move ``fresh`` to its place; what stood there stays where that fails."""
    moved = fresh.with_name(_OLD)
    if target.is_dir():  # a folder cannot be replaced in one move
        os.replace(target, moved)
    try:
        os.replace(fresh, target)
    except BaseException:
        if moved.exists():
            os.replace(moved, target)
        raise


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
def placed(target: Path) -> Iterator[Path]:
    """A place to write what goes to ``target`` when it is whole; DataFileError for what cannot be written."""
    if not target.parent.is_dir():
        raise DataFileError(f"{target}: the folder {target.parent} does not exist; create it first")
    with told(target, REMEDY, WRITTEN), beside(target) as folder:
        if target.exists():
            target.open("r+b").close()  # not a folder, nor a file that is held or may not be changed
        yield (fresh := folder / target.name)
        replace(target, fresh)


@contextmanager
def told(path: Path, remedy: str, other: str = "") -> Iterator[None]:
    """Trouble with the disk as one sentence that ends with what to do; ``other`` trouble too where it has words."""
    try:
        yield
    except OSError as error:
        why = {
            errno.ENOSPC: "the disk is full",
            errno.EDQUOT: "the quota of the disk is used up",
            errno.EROFS: "the disk is read-only",
            errno.EACCES: "it may not be written",
            errno.EPERM: "it may not be written",
            errno.EISDIR: "a folder stands there",
            errno.EFBIG: "the file would be larger than the disk allows",
        }.get(error.errno or 0, other)
        if not why:
            raise
        raise DataFileError(f"{path}: {why} ({error}); {remedy}") from error


def _stale(folder: Path) -> bool:
    """Return whether the process that made a folder has ended."""
    try:
        whose = json.loads((folder / _WRITER).read_text(encoding="utf-8"))
        if whose["place"] == _place() and os.name == "posix":
            return not _alive(int(whose["process"]))
        newest = max(item.lstat().st_mtime for item in (folder, *folder.rglob("*")))
    except (OSError, ValueError, TypeError, KeyError):
        return False
    return time.time() - newest > _DAY


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)  # asks only
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _place() -> list[Any]:
    """Within what a process's number is one process's: the machine, since it was started, and the container."""
    boot, space = "", 0
    with suppress(OSError):
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
        space = os.stat("/proc/self/ns/pid").st_ino
    return [socket.gethostname(), boot, space]
