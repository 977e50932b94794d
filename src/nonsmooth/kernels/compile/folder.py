"""The folder of compiled code on disk: nobody else may write it, files are whole, and unused ones are removed.

What stands there is executed. So a folder, or a file in it, that belongs to another user or that others may write is
not used, and new ones are made for the user alone.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import stat
import sys
import tempfile
import time
import uuid
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path

UNUSED_DAYS = 90.0
#: Names that `cache` gives: of code, and of a generated module by the hash of its text; unfinished ones have more.
_ENTRY = re.compile(r".+(-[0-9a-f]{32}\.nbc|_(?P<module>[0-9a-f]{20})\.py)(?P<unfinished>\.[0-9a-f]{12}\.tmp)?")
PARTS = ("", "compiled", "generated", "generated/__pycache__")


def cache_folder() -> Path:
    """The folder of compiled code; it is made if need be.

    Returns
    -------
    Path
        The environment variable ``NONSMOOTH_CACHE_DIR`` where set, else the user's cache folder of the
        platform, else (there is none, it cannot be written, or others may write it) a private folder among the
        temporary files.

    Raises
    ------
    PermissionError
        ``NONSMOOTH_CACHE_DIR`` is set and cannot be written, or others may write it.
    """
    return usable_folder(os.environ.get("NONSMOOTH_CACHE_DIR", ""))


@cache
def usable_folder(chosen: str) -> Path:
    if chosen:
        folder = Path(os.path.expanduser(chosen)).absolute()
        if not _writable(folder):
            raise PermissionError(f"NONSMOOTH_CACHE_DIR={chosen} cannot be written: choose another folder or unset it")
        if not _private(folder):
            raise PermissionError(
                f"NONSMOOTH_CACHE_DIR={chosen} belongs to another user, or others may write it or a folder in it, and "
                f"what stands there is executed: choose another folder, or empty this one and `chmod go-w` it"
            )
        return folder
    found = _of_the_user()
    if found is not None and _writable(found):
        if _private(found):
            return found
        warnings.warn(
            f"compiled code is not kept in {found}: it belongs to another user, or others may write it or a folder in "
            f"it, and what stands there is executed; remove it, and it will be made anew",
            stacklevel=2,
        )
    user = os.getuid() if hasattr(os, "getuid") else "user"
    folder = Path(tempfile.gettempdir()) / f"nonsmooth-{user}"
    if _writable(folder) and _private(folder):
        return folder
    warnings.warn(
        "no folder for compiled code: it is compiled again in each process; "
        "set NONSMOOTH_CACHE_DIR to a folder that only you can write",
        stacklevel=2,
    )
    return Path(tempfile.mkdtemp(prefix="nonsmooth-"))


def _of_the_user() -> Path | None:
    """The platform's folder; None for a user without a home."""
    try:
        if sys.platform == "win32":
            base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
        elif sys.platform == "darwin":
            base = Path.home() / "Library" / "Caches"
        else:
            base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:
        return None
    return base / "nonsmooth"


def _writable(folder: Path) -> bool:
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(exist_ok=True, mode=0o700)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _private(folder: Path) -> bool:
    """Return whether only this user (and root) may write the folder and those of ours in it."""
    return all(_own(path.stat()) for path in (folder / part for part in PARTS) if path.exists())


def _own(found: os.stat_result) -> bool:
    if not hasattr(os, "getuid"):  # Windows: a user's folders are private by inheritance
        return True
    return found.st_uid in (os.getuid(), 0) and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def read_private(path: Path) -> bytes:
    """The content of a file that only this user may write; empty where there is none."""
    try:
        with path.open("rb") as file:
            return file.read() if _own(os.fstat(file.fileno())) else b""
    except OSError:
        return b""


def make_private(folder: Path) -> None:
    with _room_in(folder.parent):
        folder.mkdir(exist_ok=True, mode=0o700)


@contextlib.contextmanager
def _room_in(folder: Path) -> Iterator[None]:
    """One sentence for a disk that is full, or not to be written."""
    try:
        yield
    except OSError as error:
        raise OSError(
            f"compiled code cannot be written to {folder} ({error.strerror}): make room there, or set the environment "
            "variable NONSMOOTH_CACHE_DIR to a folder on another disk"
        ) from error


def write_atomically(path: Path, data: bytes) -> None:
    """Another process sees the whole file or none; the last of several writers of the same content wins."""
    make_private(path.parent)
    unfinished = path.with_name(f"{path.name}.{uuid.uuid4().hex[:12]}.tmp")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    with _room_in(path.parent):
        try:
            with os.fdopen(os.open(unfinished, flags, 0o600), "wb") as file:
                file.write(data)
            os.replace(unfinished, path)
        except OSError:
            with contextlib.suppress(OSError):
                unfinished.unlink()
            if not path.exists():  # Windows refuses to replace a file that another process reads
                raise


def mark_used(path: Path) -> None:
    with contextlib.suppress(OSError):
        if time.time() - path.stat().st_mtime > 86400.0:
            os.utime(path)


def prune(folder: Path) -> None:
    """Remove entries that no process has used for a long time: edits of the source leave them behind."""
    oldest = time.time() - 86400.0 * UNUSED_DAYS
    for path in folder.iterdir():
        with contextlib.suppress(OSError):
            if path.stat().st_mtime < oldest and _is_ours(path):
                path.unlink()


def _is_ours(path: Path) -> bool:
    """Return whether a file has an entry's name and holds what was written under it: all else is the user's.

    Code begins with the hash of what follows, a module is named by its own; of an unfinished one the name is enough."""
    name = _ENTRY.fullmatch(path.name)
    if name is None or path.is_symlink() or not path.is_file():
        return False
    if name["unfinished"]:
        return True
    content = path.read_bytes()
    if name["module"]:
        return hashlib.sha256(content).hexdigest().startswith(name["module"])
    return hashlib.sha256(content[32:]).digest() == content[:32]
