"""Results of draws, brought to the dims of one: plain values, points of branches, listed jumps and special points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.arrays import FloatArray
from nonsmooth.attractors.basins_matching import CLOSE
from nonsmooth.identification.compare.draws import drawn_variables, quantiles
from nonsmooth.identification.compare.response import nearest_alike
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.labels import labelled
from nonsmooth.results.schema import with_amplitude
from nonsmooth.system.system import System

#: Dims over which results list what they found, however much it was: the value of each and what its rows share.
LISTS = {
    "jump": ("jump_value", ("jump_variable", "jump_direction")),
    "special": ("special_value", ("special_kind", "kind")),
}
EVENTS = (("crossing",), ("touch",))  # dims of what happened in a run, one after the other
FINER = 8  # points to a step of a drawn branch, on a cubic
MOST = 10**8  # numbers kept over all draws
FAILURES = 3  # reasons that are repeated
MOVES = (codes.OK, codes.SLOW, codes.NOT_PERIODIC, codes.NOT_GUARANTEED)  # a motion, with a period number or without


class Gathered:
    """The results of draws, brought to the dims of the one at the parameters found."""

    def __init__(self, centre: xr.Dataset) -> None:
        self.centre = centre = with_amplitude(centre)  # its quantiles do not follow from those of the extremes
        self.branch = str(centre.attrs.get("parameter", "")) if "point" in centre.dims else ""
        names = [*centre.data_vars, *([self.branch] if self.branch else [])]
        held = [str(name) for name in names if centre[name].size and name != "status"]
        numbers = [name for name in held if centre[name].dtype.kind in "fiub"]
        listed = {str(name) for name in numbers if set(centre[name].dims) & set(LISTS)}
        along = {name for name in numbers if "point" in centre[name].dims}
        self.plain = [name for name in numbers if name not in listed | along]
        left = {self.branch, "unknowns", "tangent", "layout", "mode"}
        self.along = [] if "branch" in centre else [name for name in along if name not in left]  # one branch alone
        self.lists = [dim for dim in LISTS if centre.sizes.get(dim) and (dim != "special" or self.branch)]
        self.rows: list[dict[str, Any]] = []
        self.failures: list[str] = []

    def add(self, result: xr.Dataset) -> None:
        """Keep what a draw gave."""
        result = _same_attractors(self.centre, with_amplitude(result), self.plain)
        there = {name: _at_same(self.centre[name], result[name]) for name in self.plain if name in result}
        named = [one for one in self.centre.values() if one.dims in EVENTS and one.dtype.kind in "iuU"]
        other = {dim for one in named for dim in one.dims if not np.array_equal(one, result.get(one.name, np.nan))}
        alike = {name: array for name, array in there.items() if not other & set(array.dims)}
        row = {name: array.values for name, array in alike.items() if array.shape == self.centre[name].shape}
        if "period_number" in row and "status" in result and result["status"].shape == row["period_number"].shape:
            row["period_number"] = np.where(np.isin(result["status"], MOVES), row["period_number"], np.nan)
        if self.along:
            row |= _along_sheets(self.centre, result, self.branch, self.along)
        row |= {dim: matched(self.centre, result, dim) for dim in self.lists}
        if len(self.rows) * sum(np.size(values) for values in row.values()) > MOST:
            raise ValueError("the draws hold more than 1e8 numbers: take fewer draws, or a smaller result")
        self.rows.append(row)

    def fail(self, reason: str) -> None:
        """Count a draw for which the verb failed."""
        self.failures.append(reason)
        self.rows.append({})

    def banded(
        self, edges: list[float], more: dict[str, Any], drawn: Mapping[str, FloatArray], system: System, seed: int
    ) -> xr.Dataset:
        """The result at the parameters found with its bands, of the draws until now, and the draws."""
        n, reasons = len(self.rows), "; ".join(dict.fromkeys(self.failures[:FAILURES]))
        variables = self.variables(edges) | more
        variables |= drawn_variables({name: values[:n] for name, values in drawn.items()}, system)
        words = {"long_name": "draws for which the verb failed", "comment": reasons}
        result = self.centre.assign({**variables, "failed": ((), len(self.failures), words)})
        result = result.assign_coords(quantile=("quantile", edges))
        return result.assign_attrs(propagated=f"{n} draws from seed {seed}")

    def variables(self, edges: list[float]) -> dict[str, Any]:
        """Quantiles, shares and probabilities."""
        found: dict[str, Any] = {}
        for name in (*self.plain, *self.along):
            if kept := [row[name] for row in self.rows if name in row]:
                found |= self._of(name, np.stack(kept), edges)
        for dim in self.lists:
            value = LISTS[dim][0]
            dims, size = self.centre[value].dims, self.centre[value].shape
            kept = [row.get(dim, np.full(size, np.nan)) for row in self.rows]
            if kept:
                attrs = {**self.centre[value].attrs, "long_name": f"{dim} for drawn parameters"}
                found[f"{value}_draws"] = (("draw", *dims), np.stack(kept), attrs)
                found |= self._numbers(value, np.stack(kept), edges)
        return found

    def _of(self, name: str, stack: FloatArray, edges: list[float]) -> dict[str, Any]:
        array = self.centre[name]
        if name.rpartition("_")[2] == "stable" or array.dtype.kind == "b":
            of_all = np.nansum(stack, axis=0) / len(self.rows)
            told = labelled(array.dims, of_all, f"share of draws: {name}")
            return self._share(name, stack) | {f"{name}_probability": told}
        if name == "period_number":
            every = np.append(stack, array.values)
            numbers = np.unique(every[np.isfinite(every)]).astype(array.dtype)
            shares = np.stack([np.sum(stack == number, axis=0) for number in numbers]) / len(self.rows)
            return self._share(name, stack) | {
                "period_number_probability": labelled(
                    ("period_value", *array.dims), shares, "share of draws with this period number (0: none found)"
                ),
                "period_value": labelled("period_value", numbers, "period number"),
            }
        return self._numbers(name, stack, edges) if array.dtype.kind == "f" else {}

    def _numbers(self, name: str, stack: FloatArray, edges: list[float]) -> dict[str, Any]:
        array = self.centre[name]
        attrs = {key: value for key, value in array.attrs.items() if isinstance(value, str)}
        found = {f"{name}_quantiles": (("quantile", *array.dims), quantiles(stack, edges), attrs)}
        return found | self._share(name, stack)

    def _share(self, name: str, stack: FloatArray) -> dict[str, Any]:
        share = np.isfinite(stack).sum(axis=0) / len(self.rows)
        if not (share < 1).any():
            return {}
        return {f"{name}_share": labelled(self.centre[name].dims, share, f"share of draws that have {name} here")}


def _same_attractors(centre: xr.Dataset, result: xr.Dataset, names: list[str]) -> xr.Dataset:
    """A draw with its attractors, whose numbers are its own, in the places of those near which they lie; NaN where the
    draw has none."""
    from scipy.optimize import linear_sum_assignment

    if "attractor" not in centre.dims or not result.sizes.get("attractor") or "maximum" not in centre:
        return result
    own = centre[["maximum", "minimum"]].rename(attractor="own")
    others = set(own["maximum"].dims) - {"state"}
    size = own["maximum"].max(others) - own["minimum"].min(others)
    away = (abs(own["maximum"] - result["maximum"]) + abs(own["minimum"] - result["minimum"])) / size
    away = away.mean(set(away.dims) - {"own", "attractor"}).transpose("own", "attractor").fillna(np.inf)
    places, pairs = np.full(len(away), -1), linear_sum_assignment(np.minimum(away, 1e9))
    for k, j in zip(*pairs, strict=True):
        places[k] = j if away[k, j] < CLOSE else -1
    taken, there = result.isel(attractor=places), xr.DataArray(places >= 0, dims="attractor")
    of_them = [name for name in names if name in taken and "attractor" in taken[name].dims]
    return taken.assign({name: taken[name].where(there) for name in of_them})


def _at_same(centre: xr.DataArray, array: xr.DataArray) -> xr.DataArray:
    """A variable of a draw at the instants, frequencies, ... of the result itself; NaN where the draw has none."""
    for dim, own in array.indexes.items():
        if dim in centre.indexes and own.dtype.kind == "f" and not own.equals(centre.indexes[dim]):
            array = array.drop_duplicates(dim, keep="last").reindex({dim: centre[dim].values})
    return array


def _along_sheets(centre: xr.Dataset, result: xr.Dataset, name: str, along: list[str]) -> dict[str, Any]:
    """Values of a drawn branch at the points of the branch itself, between the same turning points; NaN where its sheet
    does not reach."""
    value, drawn = centre[name].values, result[name].values
    sheet, finer = _sheet_numbers(value), _finer(_length(result, name))
    dense = finer(drawn)
    of = np.repeat(_sheet_numbers(drawn), FINER)[: len(dense)]
    # A draw may have fewer turning points before the same one.
    first = int((np.sign(np.diff(value[:2])) != np.sign(np.diff(drawn[:2]))).any())
    found = {}
    for key in along:
        if key not in result:
            continue
        values = np.asarray(result[key].values, float)
        rows = np.full((len(value), *values.shape[1:]), np.nan)
        flag = result[key].dtype.kind in "iub"
        other = np.repeat(values, FINER, axis=0)[: len(dense)] if flag else finer(values)
        for k in np.unique(sheet):
            here, there = sheet == k, of == k - first
            if np.count_nonzero(there) > 1:
                rows[here] = _at(value[here], dense[there], other[there], flag)
        found[key] = rows
    return found


def _sheet_numbers(value: FloatArray) -> FloatArray:
    """The number of turning points before each point."""
    up = np.sign(np.diff(value))
    turns = np.cumsum(up[1:] * up[:-1] < 0)
    return np.pad(turns, (1, len(value) - 1 - len(turns)), mode="edge") if len(turns) else np.zeros(len(value), int)


def _length(branch: xr.Dataset, name: str) -> FloatArray:
    """Length along a branch, its parameter and the amplitudes of the states scaled to one."""
    columns = [branch[name].values[:, None]]
    columns += [branch[key].values for key in ("maximum", "minimum", "u") if key in branch]
    whole = np.concatenate(columns, axis=1)
    sizes = np.ptp(whole, axis=0)
    steps = np.linalg.norm(np.diff(whole / np.where(sizes > 0, sizes, 1.0), axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(np.maximum(steps, 1e-12))])


def _finer(length: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Values at FINER points to a step, by cubics that do not overshoot."""
    from scipy.interpolate import PchipInterpolator, interp1d

    fine = np.interp(np.arange((len(length) - 1) * FINER + 1) / FINER, np.arange(len(length)), length)

    def finer(values: FloatArray) -> FloatArray:
        if len(length) < 2:
            return values
        if np.isfinite(values).all():
            return PchipInterpolator(length, values, axis=0)(fine)
        return interp1d(length, values, axis=0)(fine)

    return finer


def _at(wanted: FloatArray, value: FloatArray, other: FloatArray, flag: bool) -> FloatArray:
    """``other`` where ``value``, which rises or falls, has the wanted values; NaN beyond its ends."""
    order = np.argsort(value, kind="stable")
    value, flat = value[order], other[order].reshape(len(value), -1)
    if flag:
        rows = flat[np.clip(np.searchsorted(value, wanted), 0, len(value) - 1)]
    else:
        rows = np.stack([np.interp(wanted, value, column) for column in flat.T], axis=-1)
    near = 1e-9 * (abs(value[0]) + abs(value[-1]))  # an edge of the range, to rounding
    rows[(wanted < value[0] - near) | (wanted > value[-1] + near)] = np.nan
    return rows.reshape(len(wanted), *other.shape[1:])


def matched(centre: xr.Dataset, result: xr.Dataset, dim: str) -> FloatArray:
    """The value of each listed row in a draw: the nearest of the same kind; NaN where it has none."""
    value, shared = LISTS[dim]
    found = np.full(centre[value].shape, np.nan)
    if value not in result or not result[value].size or not found.size:
        return found
    keys, both = [key for key in shared if key in centre], (centre, result)
    kinds = (list(zip(*(one[key].values.astype(str) for key in keys), strict=True)) for one in both)
    for i, j in nearest_alike(*(one[value].values for one in both), *kinds).items():
        found[i] = result[value].values[j]
    return found
