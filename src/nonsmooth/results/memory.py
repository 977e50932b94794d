"""Memory is looked up before it is taken, by a call or for a file; what claims more than there is is refused.

A file may also point out of itself (an external link, data kept in another file): that is never followed.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from nonsmooth.errors import DataFileError

LIMITS = Path("/sys/fs/cgroup")  # of a container, on Linux
FACTS = Path("/proc/meminfo")
SMALL = 2**24  # bytes that are not asked for: to ask takes a tenth of a millisecond, as long as a short run


def free_memory() -> int | None:
    """Bytes that this process may still take; None where the machine does not tell."""
    known = []
    try:
        for line in FACTS.read_text().splitlines():
            if line.startswith("MemAvailable:"):
                known.append(int(line.split()[1]) * 1024)
        limit, used = ((LIMITS / f"memory.{name}").read_text().strip() for name in ("max", "current"))
        if limit != "max":
            known.append(int(limit) - int(used) + _cached())
    except (OSError, ValueError, IndexError):
        pass
    if not known and hasattr(os, "sysconf"):
        try:
            known.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
        except (OSError, ValueError):
            return None
    return min(known) if known else None


def _cached() -> int:
    """Bytes of files that a container's use counts too, and that the system drops when memory is asked for."""
    facts = LIMITS / "memory.stat"
    lines = facts.read_text().splitlines() if facts.exists() else []
    return sum(int(line.split()[1]) for line in lines if line.startswith("inactive_file "))


def room_for(n_bytes: float, what: str, remedy: str) -> None:
    """MemoryError where ``what`` would take more bytes than there are free.

    Parameters
    ----------
    n_bytes : float
        A lower bound of what is needed.
    remedy : str
        What to do then.
    """
    if n_bytes < SMALL:
        return
    free = free_memory()
    if free is not None and n_bytes > free:
        raise MemoryError(
            f"{what} takes at least {n_bytes / 2**30:.3g} GiB of memory, and {free / 2**30:.3g} GiB are free: {remedy}"
        )


_DEFLATED = 1032  # bytes that a byte of deflated data stands for, at most
_COMPRESSED = 65536  # the same for the codecs of Zarr, whose best blocks hold 128 KiB of equal bytes in a few
_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable."
_CODECS = {"blosc", "zstd", "zlib", "gzip", "lz4", "lzma", "bz2"}


def of_netcdf(source: Path) -> int:
    """Bytes of all variables of a NetCDF (HDF5) file in memory.

    DataFileError: a variable that is larger than what the file holds of it, or lies outside the file."""
    import h5py

    total = 0
    with h5py.File(source, "r") as opened:
        for name in opened:
            if not isinstance(opened.get(name, getlink=True), h5py.HardLink):
                raise DataFileError(f"{source}: {name!r} is a link, which is not followed")
            item = opened[name]
            if not isinstance(item, h5py.Dataset) or _NO_VARIABLE in str(item.attrs.get("NAME")):
                continue
            if item.external or item.is_virtual:
                raise DataFileError(f"{source}: the data of {name!r} lie in another file, which is not read")
            claimed = item.size * item.id.get_type().get_size()
            _refuse(source, name, claimed, item.id.get_storage_size(), _DEFLATED)
            total += claimed
    return total


def of_zarr(source: Path) -> int:
    """Bytes of all arrays of a Zarr store in memory, whole chunks counted.

    Raises
    ------
    DataFileError
        An array that is larger than what the store holds of it, has chunks missing, or is to be decoded by what
        :func:`nonsmooth.save` never uses (some such codecs run code).
    """
    import zarr

    total = 0
    for name, array in zarr.open_group(source, mode="r").arrays():
        strange = [codec for codec in _codecs(array) if codec not in _CODECS]
        if strange:
            raise DataFileError(f"{source}: {name!r} is to be decoded by {strange[0]!r}, which is not done")
        folder = source / array.path
        files = [file for file in folder.rglob("*") if not file.name.startswith(".z") and file.name != "zarr.json"]
        missing = array.nchunks - len(files)
        if missing > 0:
            raise DataFileError(f"{source}: {missing} of {array.nchunks} chunks of {name!r} are missing")
        chunk = array.dtype.itemsize
        for length in array.chunks:
            chunk *= length
        claimed = max(array.nbytes, array.nchunks * chunk)
        _refuse(source, name, claimed, sum(file.stat().st_size for file in files), _COMPRESSED)
        total += claimed
    return total


def _refuse(source: Path, name: str, claimed: int, held: int, best: int) -> None:
    if claimed > best * held:
        raise DataFileError(
            f"{source}: {name!r} claims {claimed} bytes, and the file holds {held} bytes of it: it is damaged or was "
            "not finished"
        )


def _codecs(array: Any) -> list[str]:
    """Names of what decodes a chunk besides its own type."""
    described = array.metadata.to_dict()
    if described["zarr_format"] == 2:
        steps = [described.get("compressor"), *(described.get("filters") or [])]
        return [str(step["id"]) for step in steps if step]
    steps = [step for step in described["codecs"] if step["name"] not in ("bytes", "crc32c")]
    return [str(step["name"]) for step in steps]
