"""Results on disk: NetCDF (``.nc``) and Zarr (``.zarr``), both ways, with nothing lost.

What the file formats cannot hold is converted on the way out and back on the way in: complex variables get
a last dim ``part`` = re, im; strings keep NumPy's fixed-width type; integer flags keep their type.
Files are written beside their place and moved there when whole, so an interrupted save leaves the old file.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.errors import DataFileError
from nonsmooth.results.provenance import ATTRIBUTE

__all__ = ["load", "save"]

_EXPECTED = "expected a result written by nonsmooth.save (.nc or .zarr)"
_COMPRESS_FROM = 4096  # elements; smaller arrays do not gain


def save(result: xr.Dataset, path: str | os.PathLike[str]) -> Path:
    """Write a result to ``path``: NetCDF if it ends in ``.nc``, a Zarr store if it ends in ``.zarr``.

    An existing result at that place is replaced. Returns the path.

    Raises
    ------
    TypeError
        If ``result`` is not a Dataset.
    ValueError
        If the path ends in neither ``.nc`` nor ``.zarr``.
    DataFileError
        If the folder does not exist, or something other than a saved result stands at a ``.zarr`` path.
    """
    if not isinstance(result, xr.Dataset):
        raise TypeError(f"save takes an xarray.Dataset, got {type(result).__name__}")
    target = Path(path)
    suffix = _suffix(target)
    if not target.parent.is_dir():
        raise DataFileError(f"{target}: the folder {target.parent} does not exist; create it first")
    encoded = _encode(result)
    with tempfile.TemporaryDirectory(prefix=f".{target.name}-", dir=target.parent) as folder:
        fresh = Path(folder) / f"new{suffix}"
        if suffix == ".nc":
            encoded.to_netcdf(fresh, engine="netcdf4", format="NETCDF4", encoding=_netcdf_encoding(encoded))
            os.replace(fresh, target)
        else:
            # Every chunk is written, empty or not, so that `load` can tell a missing one from zeros.
            encoded.to_zarr(fresh, zarr_format=2, consolidated=True, write_empty_chunks=True)
            if target.exists():
                if not _is_result(target):
                    raise DataFileError(
                        f"{target}: what stands there is no saved result of this package (a store of chunks, another "
                        "Zarr store, a file); it was left alone: give another name"
                    )
                os.replace(target, Path(folder) / "old.zarr")
            os.replace(fresh, target)
    return target


def load(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read a result written by :func:`save`, whole, into memory.

    Raises
    ------
    ValueError
        If the path ends in neither ``.nc`` nor ``.zarr``.
    DataFileError
        If the file is missing, truncated, unreadable, or not a result of this package.
    """
    source = Path(path)
    suffix = _suffix(source)
    if not source.exists():
        raise DataFileError(f"{source}: no such file; {_EXPECTED}")
    try:
        raw = _read_netcdf(source) if suffix == ".nc" else _read_zarr(source)
    except DataFileError:
        raise
    # Damaged files surface as almost any exception of the libraries below, HDF5's own among them.
    except Exception as error:
        raise DataFileError(f"{source}: cannot be read, it is damaged or cut short ({error}); {_EXPECTED}") from error
    if ATTRIBUTE not in raw.attrs:
        raise DataFileError(
            f"{source}: has no attribute {ATTRIBUTE!r}, so it is not a result of this package; {_EXPECTED}"
        )
    return _decode(raw)


def _suffix(path: Path) -> str:
    if path.suffix not in (".nc", ".zarr"):
        given = path.suffix or "no ending"
        raise ValueError(f"{path}: the name must end in .nc (NetCDF) or .zarr (Zarr), got {given!r}")
    return path.suffix


def _is_zarr(path: Path) -> bool:
    return path.is_dir() and any((path / name).exists() for name in (".zgroup", "zarr.json"))


def _is_result(path: Path) -> bool:
    """Whether a Zarr store holds a result that :func:`save` has written."""
    import json

    for name in (".zattrs", "zarr.json"):
        try:
            attributes = json.loads((path / name).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        if ATTRIBUTE in attributes.get("attributes", attributes):
            return True
    return False


def _read_netcdf(source: Path) -> xr.Dataset:
    with xr.open_dataset(source, engine="netcdf4", decode_times=False, decode_timedelta=False) as opened:
        return opened.load()


def _read_zarr(source: Path) -> xr.Dataset:
    import zarr

    if not _is_zarr(source):
        raise DataFileError(f"{source}: is not a Zarr store; {_EXPECTED}")
    group = zarr.open_group(source, mode="r")
    for name, array in group.arrays():
        if array.nchunks_initialized < array.nchunks:
            missing = array.nchunks - array.nchunks_initialized
            raise DataFileError(f"{source}: {missing} of {array.nchunks} chunks of {name!r} are missing; {_EXPECTED}")
    with xr.open_zarr(source, decode_times=False, decode_timedelta=False) as opened:
        return opened.load()


def _encode(result: xr.Dataset) -> xr.Dataset:
    """What both formats can hold. Encodings left by an earlier read are dropped."""
    encoded = result.drop_encoding()
    for name, variable in list(encoded.variables.items()):
        if variable.dtype.kind == "c":
            encoded[name] = _split(encoded[name])
    _refuse_bad_attributes(encoded)
    return encoded


def _split(array: xr.DataArray) -> xr.DataArray:
    parts = xr.concat([array.real, array.imag], dim="part").transpose(..., "part")
    return parts.assign_coords(part=["re", "im"]).assign_attrs(array.attrs)


def _refuse_bad_attributes(result: xr.Dataset) -> None:
    """NetCDF has no bool, None or mapping attributes; say so here rather than deep below."""
    owners: list[tuple[Hashable, dict[Any, Any]]] = [("the Dataset", result.attrs)]
    owners += [(name, variable.attrs) for name, variable in result.variables.items()]
    for owner, attrs in owners:
        for key, value in attrs.items():
            if value is None or isinstance(value, bool | np.bool_ | dict):
                raise TypeError(
                    f"attribute {key!r} of {owner!r} is a {type(value).__name__}, which files cannot hold; "
                    "use a number, a string or an array of numbers"
                )


def _netcdf_encoding(result: xr.Dataset) -> dict[Hashable, dict[str, Any]]:
    encoding: dict[Hashable, dict[str, Any]] = {}
    for name, variable in result.variables.items():
        if variable.dtype.kind in "fiu":
            compress = {"zlib": True, "complevel": 4} if variable.size >= _COMPRESS_FROM else {}
            encoding[name] = {"_FillValue": None, **compress}
    return encoding


def _decode(raw: xr.Dataset) -> xr.Dataset:
    result = raw.drop_encoding()
    for name in list(result.variables):
        array = result[name]
        if array.dtype.kind in ("O", "T"):
            result[name] = (array.dims, np.array(array.values.tolist(), dtype=str).reshape(array.shape), array.attrs)
        elif "part" in array.dims and name != "part":
            result[name] = _join(array)
    if "part" in result.coords:
        result = result.drop_vars("part")
    for variable in result.variables.values():
        if "flag_values" in variable.attrs:
            variable.attrs["flag_values"] = np.atleast_1d(np.asarray(variable.attrs["flag_values"], variable.dtype))
    return result


def _join(array: xr.DataArray) -> xr.DataArray:
    values = np.empty(array.shape[:-1], dtype=np.complex128)
    values.real, values.imag = array.isel(part=0).values, array.isel(part=1).values
    kept = {name: coord for name, coord in array.coords.items() if "part" not in coord.dims}
    return xr.DataArray(values, kept, array.dims[:-1], attrs=array.attrs)
