"""Files and folders that are whole or not there, and unaltered: written beside their place, with a hash of contents.

What a process leaves behind that was killed while it wrote is taken away by the next one that writes to the same
place. A folder says in ``writer.json`` whose it is: one without that file is nobody's business here.

The hash goes over names, roles (coordinate or not), dims, types, shapes, values and attributes of every variable and
over the attributes of the Dataset, in a form that does not depend on the file format: byte order, the width of strings,
compression and the order of variables leave it as it is.

A NetCDF file also ends in a hash of its bytes, which is compared before the file is opened: the HDF5 library does not
end on some damaged files. Programs that read NetCDF do not look at what follows the end that the file states.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import shutil
import socket
import tempfile
import time
from collections.abc import Hashable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.errors import DataFileError

if TYPE_CHECKING:
    import xarray as xr

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


#: A stamped provenance begins with its hash; one from before hashes were written begins with the version.
_STAMPED = re.compile(r'\{"sha256": "([0-9a-f]{64})", ')
_UNSTAMPED = '{"version": '
_TRAILER = re.compile(rb"\nnonsmooth sha256 ([0-9a-f]{64})\n")
_TRAILER_LENGTH = 83  # bytes
_BLOCK = 1 << 20


def content(attributes: Mapping[Any, Any], variables: Iterable[tuple[str, bool, xr.Variable]]) -> dict[str, Any]:
    """Content of a Dataset in short, as plain data: an entry for each variable, with the hash of its values.

    The variables (name, coordinate or not, variable) are taken one at a time, so that a file need not be in memory
    whole. Equal contents have equal :func:`digest`.

    Raises
    ------
    ValueError
        A text that cannot be written to a file (it holds NUL, or half a surrogate pair).
    TypeError
        An attribute that is neither text nor numbers, or a variable of a type that files cannot hold.
    """
    found: dict[str, Any] = {"the attributes": _attributes("the Dataset", attributes)}
    for name, coordinate, variable in variables:
        where = f"variable {_text(name, 'a name')!r}"
        found[where] = [
            coordinate,
            [_text(dim, "a name") for dim in variable.dims],
            _kind(where, variable.dtype),
            list(variable.shape),
            _attributes(where, variable.attrs),
            _values(where, variable),
        ]
    return found


def digest(data: Any) -> str:
    """Hash of plain data, whatever the order of its keys."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def stamp(provenance: str, found: str) -> str:
    """The provenance (a JSON object) with the content's hash as its first entry.

    One attribute holds both, and :func:`unstamp` knows it by how it begins: no altered byte makes a stamped file look
    like one from before hashes were written.
    """
    if not provenance.startswith("{") or len(provenance) < 3:
        raise ValueError(f"the provenance of a result is a JSON object, got {provenance[:40]!r}")
    return f'{{"sha256": "{found}", {provenance[1:]}'


def unstamp(stamped: str) -> tuple[str | None, str]:
    """Hash (None where the file was written before there were hashes) and provenance; ValueError if it is neither."""
    found = _STAMPED.match(stamped)
    if found is None and not stamped.startswith(_UNSTAMPED):
        raise ValueError("its provenance does not begin as it was written")
    return (None, stamped) if found is None else (found[1], "{" + stamped[found.end() :])


def trailer(data: bytes | memoryview) -> bytes:
    """The end of a file that holds ``data``."""
    return f"\nnonsmooth sha256 {hashlib.sha256(data).hexdigest()}\n".encode()


def bytes_as_written(path: Path) -> bool:
    """Return whether a file's bytes are those before its :func:`trailer`; True where it has none."""
    found, left = hashlib.sha256(), path.stat().st_size - _TRAILER_LENGTH
    if left < 0:
        return True
    with open(path, "rb") as file:
        file.seek(left)
        end = _TRAILER.fullmatch(file.read())
        if end is None:
            return True
        file.seek(0)
        while left > 0 and (block := file.read(min(left, _BLOCK))):
            found.update(block)
            left -= len(block)
    return found.hexdigest() == end[1].decode()


def seal(record: Mapping[str, Any]) -> dict[str, Any]:
    """A record of plain data with its own hash as the entry ``sha256``."""
    return {**record, "sha256": digest(record)}


def sealed(record: Any) -> bool:
    """Return whether a record is as :func:`seal` made it."""
    if not isinstance(record, dict) or "sha256" not in record:
        return False
    return bool(digest({name: value for name, value in record.items() if name != "sha256"}) == record["sha256"])


def _attributes(owner: str, attributes: Mapping[Any, Any]) -> list[list[Any]]:
    return sorted(
        [_text(key, f"the name of an attribute of {owner}"), _entry(owner, key, value)]
        for key, value in attributes.items()
    )


def _entry(owner: str, key: Hashable, value: Any) -> list[Any]:
    """An attribute as its kind and its entries: files do not tell one entry from a sequence of one."""
    where = f"attribute {key!r} of {owner}"
    if value is None or isinstance(value, bool | np.bool_ | dict):
        raise TypeError(
            f"{where} is a {type(value).__name__}, which files cannot hold; "
            "use a number, a string or an array of numbers"
        )
    array = np.asarray(value)
    entries, shape = array.ravel().tolist(), list(array.shape) if array.size > 1 else []
    if not entries:
        return ["empty"]
    if array.dtype.kind in "iu":
        return ["integer", shape, entries]
    if array.dtype.kind == "f":
        return ["number", shape, [float(number).hex() for number in entries]]
    if not all(isinstance(word, str) for word in entries):
        raise TypeError(f"{where} is of type {type(value).__name__}; use a number, a string or an array of numbers")
    return ["text", shape, [_text(word, where) for word in entries]]


def _kind(where: str, dtype: np.dtype[Any]) -> str:
    if dtype.kind in ("O", "T", "U"):
        return "text"
    if dtype.kind in "biufc":
        return f"{dtype.kind}{dtype.itemsize}"
    raise TypeError(f"{where} is of type {dtype}, which files do not give back; use numbers or text")


def _values(where: str, variable: xr.Variable) -> str:
    values: NDArray[Any] = np.asarray(variable.values)
    if values.dtype.kind in ("O", "T", "U"):
        words = [_text(word, where) for word in values.ravel().tolist()]
        return hashlib.sha256("\0".join(words).encode()).hexdigest()
    ordered = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
    return hashlib.sha256(ordered.reshape(-1).view(np.uint8).data).hexdigest()


def _text(word: Any, where: str) -> str:
    if not isinstance(word, str):
        raise TypeError(f"{where} holds a {type(word).__name__}; files hold numbers or text")
    if "\0" in word:
        raise ValueError(f"{where} holds the character NUL, which files cannot hold; take it out")
    try:
        word.encode()
    except UnicodeEncodeError as error:
        raise ValueError(f"{where} is not valid text ({error}); take the character out") from None
    return word
