"""Results on disk: NetCDF (``.nc``) and Zarr (``.zarr``), both ways, with nothing lost and nothing altered.

What the file formats cannot hold is converted on the way out and back on the way in: complex variables get
a last dim ``part`` = re, im; strings keep NumPy's fixed-width type; integer flags keep their type.
Files are written beside their place and moved there when whole, so an interrupted save leaves the old file. Each
carries the hash of its content, which ``save`` compares with what it wrote and ``load`` with what it read.
For readers without this package a file tells system, verb, parameters and states in plain attributes too, which
``load`` leaves out again.
"""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Hashable, Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.errors import DataFileError, not_installed
from nonsmooth.results import memory
from nonsmooth.results.memory import room_for
from nonsmooth.results.provenance import ATTRIBUTE, read_provenance
from nonsmooth.results.whole import beside, bytes_as_written, content, digest, replace, stamp, told, trailer, unstamp

_EXPECTED = "expected a result written by nonsmooth.save (.nc or .zarr)"
_ALTERED = (
    "its content is not what was written there: bytes were altered, by a fault or by another program; take a copy that "
    "is whole, or compute the result again"
)
_KEPT = (
    "make room or give another place; the result is not lost: it is the attribute `result` of this error, "
    "nonsmooth.save(error.result, PATH)"
)
_COMPRESS_FROM = 4096  # elements; smaller arrays do not gain
_PLAIN = f"{ATTRIBUTE}_"  # begins the names of the plain attributes


def save(result: xr.Dataset, path: str | os.PathLike[str]) -> Path:
    """Write a result to ``path``: NetCDF if it ends in ``.nc``, a Zarr store if it ends in ``.zarr``.

    An existing result at that place is replaced. Returns the path.

    Raises
    ------
    ImportError
        If the path ends in ``.zarr`` and the package zarr is not installed.
    TypeError
        If ``result`` is not a Dataset, or holds something that files do not give back as it is.
    ValueError
        If the path ends in neither ``.nc`` nor ``.zarr``, or ``result`` is not a result of this package.
    DataFileError
        If the folder does not exist, something other than a saved result stands at the path, or the disk is full or
        read-only. The result is the attribute ``result`` of the error.
    """
    if not isinstance(result, xr.Dataset):
        raise TypeError(
            f"save takes an xarray.Dataset, got {type(result).__name__}: of an orbit or a fit give .to_dataset(), of "
            "an array or a table the result that it was taken from; a system stands in every result made with it "
            "(ns.system_of), or is text, system.to_text()"
        )
    target = Path(path)
    try:
        check_place(target)
        record = result.attrs.get(ATTRIBUTE)
        if not isinstance(record, str):
            raise ValueError(
                f"{target}: this Dataset has no attribute {ATTRIBUTE!r}, so load would refuse it; where a calculation "
                f"lost it, copy it from the result: new.attrs[{ATTRIBUTE!r}] = result.attrs[{ATTRIBUTE!r}]"
            )
        variables = ((str(name), name in result.coords, one) for name, one in result.variables.items())
        held = content(result.attrs, variables)
        encoded = _encode(result).assign_attrs({ATTRIBUTE: stamp(record, digest(held)), **_plain(result)})
        with told(target, _KEPT), beside(target) as folder:
            fresh = folder / f"new{target.suffix}"
            if target.suffix == ".nc":
                # Made in memory: the HDF5 library does not survive a disk that is full.
                written = encoded.to_netcdf(
                    None, engine="h5netcdf", format="NETCDF4", encoding=_netcdf_encoding(encoded)
                )
                with open(fresh, "wb") as file:
                    file.write(written)
                    file.write(trailer(written))
            else:
                # Made in memory: where a disk is full, zarr's threads go on and make anew the folder that was cleared.
                # Every chunk is written, empty or not, so that `load` can tell a missing one from zeros.
                chunks: dict[str, Any] = {}
                encoded.to_zarr(chunks, zarr_format=2, consolidated=True, write_empty_chunks=True)
                for name, chunk in chunks.items():
                    (fresh / name).parent.mkdir(parents=True, exist_ok=True)
                    (fresh / name).write_bytes(chunk.to_bytes())
            _compare(target, fresh, held)
            replace(target, fresh)
    except DataFileError as error:
        error.result = result
        raise
    return target


def load(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read a result written by :func:`save`, whole, into memory.

    A file from before hashes of the content were written is loaded with a warning.

    Raises
    ------
    ValueError
        If the path ends in neither ``.nc`` nor ``.zarr``.
    DataFileError
        If the file is missing, truncated, unreadable, altered, or not a result of this package.
    MemoryError
        If it takes more memory than there is.
    """
    source = Path(path)
    _suffix(source)
    if not source.exists():
        raise DataFileError(f"{source}: no such file; {_EXPECTED}")
    with _readable(source):
        n_bytes = _claimed(source)
    room_for(n_bytes, f"the content of {source}", "load it where there is more memory")
    with _readable(source), _opened(source) as raw:
        if ATTRIBUTE not in raw.attrs:
            raise DataFileError(
                f"{source}: has no attribute {ATTRIBUTE!r}, so it is not a result of this package; {_EXPECTED}; "
                "the store of a chart (store=) is read by the call that made it"
            )
        expected, record = unstamp(str(raw.attrs[ATTRIBUTE]))
        attributes = _own(raw.attrs) | {ATTRIBUTE: record}
        variables = list(_decoded(raw))
        if expected is not None and digest(content(attributes, variables)) != expected:
            raise DataFileError(f"{source}: {_ALTERED}")
        coords = {name: variable for name, coordinate, variable in variables if coordinate}
        data = {name: variable for name, coordinate, variable in variables if not coordinate}
        result = xr.Dataset(data, coords, attributes)
    if expected is None:
        warnings.warn(
            f"{source}: was written without a hash of its content, so altered bytes would not be noticed; save it "
            "again to add one",
            stacklevel=2,
        )
    return result


def check_place(target: Path) -> None:
    """Refuse a path that :func:`save` cannot write to.

    Raises
    ------
    ValueError
        If the path ends in neither ``.nc`` nor ``.zarr``.
    DataFileError
        If its folder does not exist, or something other than a saved result stands there.
    """
    suffix = _suffix(target)
    if not target.parent.is_dir():
        raise DataFileError(f"{target}: the folder {target.parent} does not exist; create it first")
    if target.exists() and not (_is_result(target) if suffix == ".zarr" else target.is_file()):
        raise DataFileError(
            f"{target}: what stands there is no saved result of this package (a store of chunks, another "
            "Zarr store, a file, a folder); it was left alone: give another name"
        )


def needs_zarr(path: Path) -> None:
    """Refuse a Zarr store where the package zarr is not installed: ImportError that names the extra."""
    if find_spec("zarr") is None:
        raise ImportError(f"{path}: a Zarr store needs {not_installed('zarr', 'zarr')}")


def _suffix(path: Path) -> str:
    if path.suffix not in (".nc", ".zarr"):
        given = path.suffix or "no ending"
        matlab = "; MATLAB and Octave read .nc by ncread" if path.suffix == ".mat" else ""
        raise ValueError(f"{path}: the name must end in .nc (NetCDF) or .zarr (Zarr), got {given!r}{matlab}")
    if path.suffix == ".zarr":
        needs_zarr(path)
    return path.suffix


def _is_result(path: Path) -> bool:
    """Return whether a Zarr store holds a result that :func:`save` has written."""
    for name in (".zattrs", "zarr.json"):
        try:
            attributes = json.loads((path / name).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        if ATTRIBUTE in attributes.get("attributes", attributes):
            return True
    return False


@contextmanager
def _readable(source: Path) -> Iterator[None]:
    """One sentence for what a damaged file causes: almost any exception of the libraries below, HDF5's among them."""
    try:
        yield
    except DataFileError:
        raise
    except Exception as error:
        raise DataFileError(f"{source}: cannot be read, it is damaged or cut short ({error}); {_EXPECTED}") from error


def _claimed(source: Path) -> int:
    if source.suffix == ".nc":
        if not source.is_file():
            raise DataFileError(f"{source}: is not a file; {_EXPECTED}")
        if not bytes_as_written(source):
            raise DataFileError(f"{source}: {_ALTERED}")
        return memory.of_netcdf(source)
    if not (source.is_dir() and any((source / name).exists() for name in (".zgroup", "zarr.json"))):
        raise DataFileError(f"{source}: is not a Zarr store; {_EXPECTED}")
    return memory.of_zarr(source)


@contextmanager
def _opened(source: Path) -> Iterator[xr.Dataset]:
    """The Dataset of a file as it is encoded there, its variables not read yet."""
    as_it_is: dict[str, Any] = {"decode_times": False, "decode_timedelta": False}
    if source.suffix == ".nc":
        with xr.open_dataset(source, engine="h5netcdf", **as_it_is) as raw:
            yield raw
    else:
        with xr.open_zarr(source, chunks=None, **as_it_is) as raw:
            yield raw


def _compare(target: Path, fresh: Path, held: Mapping[str, Any]) -> None:
    """Read what was written, one variable after the other: a file that would come back as something else is no file."""
    with _opened(fresh) as raw:
        found = content(_own(raw.attrs) | {ATTRIBUTE: unstamp(raw.attrs[ATTRIBUTE])[1]}, _decoded(raw))
    if found != held:
        names = sorted(name for name in {**held, **found} if held.get(name) != found.get(name))
        raise TypeError(
            f"{target}: was not written, because this format would not give back as it is: {', '.join(names)}; "
            "use names without spaces, numbers and text"
        )


def _own(attributes: Mapping[Any, Any]) -> dict[Any, Any]:
    """The attributes of a file that are the result's."""
    return {name: value for name, value in attributes.items() if not str(name).startswith(_PLAIN)}


def _plain(result: xr.Dataset) -> dict[str, str]:
    """System, verb, version, parameters that are not varied and states, as ``ncdump -h`` shows them."""
    try:
        record = read_provenance(result)
    except ValueError:  # a part of it was dropped
        record = {}
    pairs = [
        f"{name} = {float(one):.15g} {one.attrs['units']}".removesuffix(" 1")
        for name, one in result.coords.items()
        if not one.dims and one.dtype.kind == "f" and "units" in one.attrs
    ]
    told: dict[str, str] = {key: str(record[key]) for key in ("verb", "version") if key in record}
    if isinstance(system := record.get("system"), dict):
        told["system"] = str(system.get("name"))
    if pairs:
        told["parameters"] = ", ".join(pairs)
    if "state_unit" in result.coords:
        states = zip(result["state"].values.ravel(), result["state_unit"].values.ravel(), strict=True)
        told["states"] = ", ".join(f"{name} ({unit})" if unit != "1" else str(name) for name, unit in states)
    return {_PLAIN + key: text for key, text in told.items()}


def _encode(result: xr.Dataset) -> xr.Dataset:
    """Return a Dataset that both formats can hold. Encodings left by an earlier read are dropped."""
    encoded = result.drop_encoding()
    for name, variable in list(encoded.variables.items()):
        if variable.dtype.kind == "c":
            parts = xr.concat([encoded[name].real, encoded[name].imag], dim="part").transpose(..., "part")
            encoded[name] = parts.assign_coords(part=["re", "im"]).assign_attrs(variable.attrs)
    return encoded


def _netcdf_encoding(result: xr.Dataset) -> dict[Hashable, dict[str, Any]]:
    packed: dict[str, Any] = {"zlib": True, "complevel": 4}
    return {
        name: {"_FillValue": None, **(packed if variable.size >= _COMPRESS_FROM else {})}
        for name, variable in result.variables.items()
        if variable.dtype.kind in "fiu"
    }


def _decoded(raw: xr.Dataset) -> Iterator[tuple[str, bool, xr.Variable]]:
    """Name, coordinate or not, and variable as it was before it was encoded, read one after the other."""
    for name, lazy in raw.variables.items():
        if name == "part":
            continue
        variable = lazy.to_base_variable().load()
        variable.encoding = {}
        if variable.dtype.kind in ("O", "T"):
            words = np.array(variable.values.tolist(), dtype=str).reshape(variable.shape)
            variable = xr.Variable(variable.dims, words, variable.attrs)
        elif variable.dims[-1:] == ("part",):
            parts = variable.values
            values = np.empty(parts.shape[:-1], np.result_type(parts.dtype, np.complex64))
            values.real, values.imag = parts[..., 0], parts[..., 1]
            variable = xr.Variable(variable.dims[:-1], values, variable.attrs)
        if "flag_values" in variable.attrs:
            variable.attrs["flag_values"] = np.atleast_1d(np.asarray(variable.attrs["flag_values"], variable.dtype))
        yield str(name), name in raw.coords, variable
