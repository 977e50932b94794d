"""The quantities of a result by name, each an array over the result's rows.

A variable over the states or the indicators is one quantity for each of them: ``x_maximum``, ``x_minimum``,
``penetration_clearance``; of ``u`` it is the state's own name (``x``, ``x_before``). Half the difference of a maximum
and a minimum is an amplitude: ``x_amplitude``, ``contact_force_amplitude``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.errors import unknown

#: Dims whose entries are columns of a table, not rows.
_SPREAD = ("state", "indicator", "multiplier", "eigenvalue", "exponent", "harmonic", "memory", "component")
_FIRST = ("time", "point", "special", "frequency")  # dims of rows where a result has them
_INNER = ("layout",)  # what continuation goes on from


def dataset_of(result: Any) -> xr.Dataset:
    """A result as a Dataset; TypeError for what is none."""
    if not isinstance(result, xr.Dataset) and hasattr(result, "to_dataset"):
        result = result.to_dataset()
    if not isinstance(result, xr.Dataset):
        kind = type(result).__name__
        raise TypeError(f"a result is wanted (an xarray.Dataset, an Orbit or a ParameterSet), not {kind}")
    return result


def rows_of(result: xr.Dataset, over: str | None = None) -> tuple[str, ...]:
    """The dims whose entries are the rows of a result: instants, points, or values of parameters.

    ``over``: another dim of the result, such as ``"crossing"`` or ``"iterate"``; what it stands under comes with it."""
    if over is not None:
        if over not in result.dims:
            raise ValueError(unknown(over, "a dim", "this result", map(str, result.dims)))
        return _dims([array for array in result.data_vars.values() if over in array.dims], over)
    for first in _FIRST:
        if first in result.dims:
            return (first,)
    status = tuple(map(str, result["status"].dims)) if "status" in result else ()
    if "section" in result and "period_number" not in result and "iterate" in result.dims:
        return (*status, "iterate")  # section points of one system
    if status or "status" in result or ("period_number" in result and not result["period_number"].dims):
        return status  # none of one orbit or one spectrum: a single row
    for array in result.data_vars.values():
        if dims := _dims([array]):
            return dims
    return tuple(str(dim) for dim in list(result.dims)[:1])


def _dims(arrays: list[xr.DataArray], keep: str = "") -> tuple[str, ...]:
    """The dims of arrays that are rows, those that belong together first; ``keep`` is one of them in any case."""
    found = [tuple(str(d) for d in array.dims if d == keep or d not in _SPREAD) for array in arrays]
    return max(found, key=lambda dims: -len(dims), default=())


def quantities_of(result: xr.Dataset, rows: tuple[str, ...] | None = None) -> dict[str, xr.DataArray]:
    """All quantities over some of the rows, by name, with units."""
    rows = rows_of(result) if rows is None else rows
    found: dict[str, xr.DataArray] = {}
    for key, array in result.data_vars.items():
        name, beside = str(key), [dim for dim in array.dims if dim not in rows]
        foreign = rows and not set(array.dims) & set(rows)
        if foreign or len(beside) > 1 or any(dim not in _SPREAD for dim in beside) or name in _INNER:
            continue
        for label, one in _spread(result, name, array, *map(str, beside)):
            for suffix, part in _parts(one):
                found.setdefault(label + suffix, part)
    for name in [name.removesuffix("_maximum") for name in found if name.endswith("_maximum")]:
        if (least := found.get(f"{name}_minimum")) is not None and f"{name}_amplitude" not in found:
            half = 0.5 * (found[f"{name}_maximum"] - least)
            told = {"long_name": f"amplitude of {name}", "units": least.attrs.get("units", "1")}
            found[f"{name}_amplitude"] = half.assign_attrs(told)
    return found


def _spread(result: xr.Dataset, name: str, array: xr.DataArray, dim: str = "") -> list[tuple[str, xr.DataArray]]:
    """A variable as one array for each entry of a dim."""
    if not dim:
        return [(name, array)]
    labels = result[dim].values if dim in result.coords else np.arange(1, array.sizes[dim] + 1)
    text = labels.dtype.kind == "U"
    counted = array.dtype.kind in "iu"  # of a state, without its unit
    own = result["state_unit"].values if dim == "state" and "state_unit" in result.coords and not counted else None
    parts = []
    for i, label in enumerate(labels):
        one = array.isel({dim: i}, drop=True)
        attrs = dict(array.attrs)
        if own is not None:
            attrs = {"units": str(own[i]), **attrs}
        if text:
            attrs["long_name"] = str(label) if name == "u" else f"{attrs.get('long_name', name)} of {label}"
        of = "_".join(word for word in name.split("_") if word != "u")  # the states themselves, before, after, ...
        key = f"{label}_{of}".rstrip("_") if text else f"{name}_{label}"
        parts.append((key, one.drop_vars([c for c in one.coords if c == dim], errors="ignore").assign_attrs(attrs)))
    return parts


def _parts(array: xr.DataArray) -> list[tuple[str, xr.DataArray]]:
    """A complex quantity as two."""
    if array.dtype.kind != "c":
        return [("", array)]
    return [("_real", array.real.assign_attrs(array.attrs)), ("_imag", array.imag.assign_attrs(array.attrs))]


def coordinates_of(result: xr.Dataset, rows: tuple[str, ...]) -> dict[str, xr.DataArray]:
    """The coordinates over the rows: what is varied."""
    return {str(name): array for name, array in result.coords.items() if array.dims and set(array.dims) <= set(rows)}


def quantity(
    result: xr.Dataset, name: str, known: Mapping[str, xr.DataArray] | None = None, also: Iterable[str] = ()
) -> xr.DataArray:
    """The quantity of that name, over the result's rows; ValueError that lists these and what else is taken."""
    known = quantities_of(result) if known is None else known
    if name in known:
        return known[name]
    if name in result.coords and result[name].dtype.kind in "iuf":
        return result[name]
    hint = (
        ""
        if any(one.endswith("_impulse") for one in known) or "status" not in result
        else ("; loads of elements (forces, impact speeds, energies) are there with loads=True")
    )
    every = [*also, *known, *coordinates_of(result, rows_of(result))]
    raise ValueError(unknown(name, "a quantity", "this result", every) + hint)
