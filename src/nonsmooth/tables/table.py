"""``table``: any result as a tidy pandas table, and as a file of another program."""

from __future__ import annotations

import os
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from nonsmooth.results.labels import in_words
from nonsmooth.results.provenance import ATTRIBUTE, read_provenance
from nonsmooth.results.whole import placed
from nonsmooth.system.arguments import checked
from nonsmooth.tables.quantities import coordinates_of, dataset_of, quantities_of, quantity, rows_of
from nonsmooth.tables.sampled import once, sampled

_WRITERS = {".csv": "", ".xlsx": "openpyxl", ".parquet": "pyarrow"}
_BESIDE = ("segment", "start_state", "provenance")


@checked
def table(
    result: Any,
    columns: Sequence[str] | None = None,
    *,
    over: str | None = None,
    step: float | None = None,
    samples: Any = None,
    units: bool = True,
    file: str | os.PathLike[str] | None = None,
) -> pd.DataFrame:
    """A result as a tidy table: one row per instant, point or value, one column per quantity, units in the header.

    Parameters
    ----------
    result : xarray.Dataset, Orbit or ParameterSet
        Of any verb.
    columns : sequence of str, optional
        Names of quantities, all where not given: ``"x"`` of a run, ``"x_maximum"``, ``"x_amplitude"``,
        ``"stop_force_maximum"`` of a sweep, a chart or a branch. What is varied stands before them.
    over : str, optional
        Rows of another kind: ``"crossing"`` or ``"touch"`` of a run, ``"jump"`` of a response, ``"iterate"`` (section
        points) of a sweep, ``"special"`` of a branch.
    step, samples : float, int or array, optional
        Of a run: its motion every ``step`` of time, at so many equidistant instants, or at the instants given. They are
        computed anew, as the run was, so that no value is interpolated; where the run's record does not tell how it was
        made (measured inputs, a ramp that is a function), by cubic splines between crossings, with a warning.
    units : bool
        False: names alone in the header.
    file : path, optional
        Write it there too: ``.csv``, ``.xlsx`` (with the parameters in a second sheet) or ``.parquet``.

    Returns
    -------
    pandas.DataFrame
        Headers are ``name (unit)``; what has no unit has no brackets. Integers with a table of words, such as modes,
        are words. In a run a crossing stands once, with the state after it. Parameters that are not varied are in
        ``.attrs["parameters"]``.

    Raises
    ------
    TypeError, ValueError
        What is no result; a name that it does not have; instants outside the run.
    ImportError
        A file whose package is not installed.
    DataFileError
        A folder that does not exist, a file that is open elsewhere, a full disk.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> run = ns.simulate(ns.models.discontinuous_support(), periods=2)
    >>> ns.table(run, ["x", "contact_force"], step=0.5).columns.tolist()
    ['time (s)', 'x (m)', 'contact_force (N)']
    """
    data = dataset_of(result)
    target = None if file is None else _target(file)
    rows = rows_of(data, over)
    if step is not None or samples is not None:
        if rows != ("time",):
            raise ValueError("step= and samples= are for a result of simulate: other results have no motion in between")
        data = sampled(data, step, samples)
    elif rows == ("time",):
        data = once(data)
    known = quantities_of(data, rows)
    if over is not None:
        known = {name: array for name, array in known.items() if over in array.dims}
    varied = {name: one for name, one in coordinates_of(data, rows).items() if name not in _BESIDE}
    if (along := data.attrs.get("parameter")) in known:  # of special points
        varied[along] = known[along]
    names = [name for name in known if name not in varied] if columns is None else list(columns)
    found = varied | {name: quantity(data, name, known) for name in names}
    frame = pd.DataFrame(_columns(data, rows, found, units))
    if rows == ("parameter",) and "units" in (record := _record(data)):
        frame["unit"] = record["units"]
    frame.attrs = _about(data)
    if target is not None:
        with placed(target) as fresh:
            _write(frame, fresh)
    return frame


def _columns(
    data: xr.Dataset, rows: tuple[str, ...], found: dict[str, xr.DataArray], units: bool
) -> dict[str, np.ndarray]:
    """Flat columns over all rows, headers as keys."""
    numbered = [dim for dim in rows if dim not in found and len(rows) > 1]
    every = {dim: xr.DataArray(np.arange(data.sizes[dim]), dims=dim) for dim in numbered} | found
    flat: dict[str, np.ndarray] = {}
    for name, array in every.items():
        plain = xr.DataArray(in_words(array) if "flag_values" in array.attrs else array.values, dims=array.dims)
        missing = [dim for dim in rows if dim not in plain.dims]
        full = plain.expand_dims({dim: data.sizes[dim] for dim in missing}).transpose(*rows)
        unit = array.attrs.get("units", "1")
        flat[f"{name} ({unit})" if units and unit not in ("", "1") else name] = np.asarray(full.values).ravel()
    return flat


def _record(data: xr.Dataset) -> dict[str, Any]:
    return read_provenance(data) if ATTRIBUTE in data.attrs else {}


def _about(data: xr.Dataset) -> dict[str, Any]:
    """The system, the verb, and the parameters that are not varied, with units."""
    record = _record(data)
    system = record.get("system") or {}
    fixed = {
        f"{name} ({array.attrs['units']})" if array.attrs["units"] != "1" else str(name): float(array)
        for name, array in data.coords.items()
        if array.ndim == 0 and array.dtype.kind == "f" and "units" in array.attrs
    }
    about = {"system": system.get("name"), "verb": record.get("verb"), "parameters": fixed}
    return {key: value for key, value in about.items() if value}


def _target(file: str | os.PathLike[str]) -> Path:
    path = Path(file)
    if path.suffix not in _WRITERS:
        matlab = "; MATLAB and Octave read .csv, and .nc by ncread" if path.suffix == ".mat" else ""
        raise ValueError(
            f"{path}: a table is written to .csv, .xlsx or .parquet; nonsmooth.save writes .nc and .zarr{matlab}"
        )
    package = _WRITERS[path.suffix]
    if package and find_spec(package) is None:
        raise ImportError(
            f"{path}: {path.suffix} needs the package {package}, which is not installed: python -m pip install "
            f"{package}; a .csv needs nothing"
        )
    return path


def _write(frame: pd.DataFrame, path: Path) -> None:
    if path.suffix == ".csv":
        frame.to_csv(path, index=False)
    elif path.suffix == ".parquet":
        frame.to_parquet(path, index=False)
    else:
        with pd.ExcelWriter(path, engine="openpyxl") as writer:
            frame.to_excel(writer, sheet_name="table", index=False)
            about = {key: value for key, value in frame.attrs.items() if key != "parameters"}
            pairs = [*about.items(), *frame.attrs.get("parameters", {}).items()]
            pd.DataFrame(pairs, columns=["name", "value"]).to_excel(writer, sheet_name="parameters", index=False)
