"""Where compiled code is kept on disk: the folder, whole files only, and what nothing has used for long goes."""

from __future__ import annotations

import contextlib
import getpass
import os
import sys
import tempfile
import time
import uuid
from functools import cache
from pathlib import Path

__all__ = ["cache_folder", "mark_used", "prune", "usable_folder", "write_atomically"]

UNUSED_DAYS = 90.0


def cache_folder() -> Path:
    """The folder of compiled code; it is made if need be.

    Returns
    -------
    Path
        The environment variable ``NONSMOOTH_CACHE_DIR`` where set, else the user's cache folder of the
        platform, else (neither can be written) a private folder among the temporary files.

    Raises
    ------
    PermissionError
        ``NONSMOOTH_CACHE_DIR`` is set and cannot be written.
    """
    return usable_folder(os.environ.get("NONSMOOTH_CACHE_DIR", ""))


@cache
def usable_folder(chosen: str) -> Path:
    if chosen:
        folder = Path(chosen).expanduser().absolute()
        if not _writable(folder):
            raise PermissionError(f"NONSMOOTH_CACHE_DIR={chosen} cannot be written: choose another folder or unset it")
        return folder
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = base / "nonsmooth"
    if _writable(folder):
        return folder
    # Compiled code is executed, so a folder that somebody else could have made must not be trusted.
    folder = Path(tempfile.gettempdir()) / f"nonsmooth-{getpass.getuser()}"
    if _writable(folder, mode=0o700) and (not hasattr(os, "getuid") or folder.stat().st_uid == os.getuid()):
        return folder
    return Path(tempfile.mkdtemp(prefix="nonsmooth-"))


def _writable(folder: Path, mode: int = 0o777) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=mode)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def write_atomically(path: Path, data: bytes) -> None:
    """Another process sees the whole file or none; the last of several writers of the same content wins."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f"{path.name}.{uuid.uuid4().hex[:12]}.tmp")
    try:
        unfinished.write_bytes(data)
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
    """Remove what no process has used for a long time: edits of the source leave entries behind."""
    oldest = time.time() - 86400.0 * UNUSED_DAYS
    for path in folder.iterdir():
        with contextlib.suppress(OSError):
            if path.is_file() and path.stat().st_mtime < oldest:
                path.unlink()
