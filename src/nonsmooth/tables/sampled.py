"""A run at other instants: computed anew from its record, else by splines between its crossings."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.arrays import FloatArray
from nonsmooth.flow.simulate import simulate
from nonsmooth.results.provenance import ATTRIBUTE, read_provenance
from nonsmooth.system.kinds import float_array, real_number, whole_number
from nonsmooth.system.origin import recorded_system

_SAME = 1e-6  # of the largest value of a state: the motion computed anew is that of the run


def once(run: xr.Dataset) -> xr.Dataset:
    """A run with each instant once: of a crossing the limit after it."""
    time = run["time"].values
    return run.isel(time=np.append(np.diff(time) > 0, True)[: len(time)])


def sampled(run: xr.Dataset, step: float | None, samples: Any) -> xr.Dataset:
    """A run at instants every ``step``, or at ``samples``: a number of them, or the instants."""
    instants = _instants(run["time"].values, step, samples)
    again = _anew(run, instants)
    if again is None:
        warnings.warn(
            "the record of this run does not tell how to compute it anew: values are interpolated by cubic splines "
            "between its samples",
            stacklevel=3,
        )
        return _interpolated(run, instants)
    return again


def _instants(time: FloatArray, step: float | None, samples: Any) -> FloatArray:
    if step is not None and samples is not None:
        raise ValueError("give the instants once: step=... or samples=...")
    first, last = float(time[0]), float(time[-1])
    if step is not None:
        size = real_number(step, "step")
        if not 0 < size <= last - first:
            raise ValueError(f"step = {step!r} must be positive, and at most the length of the run, {last - first:.6g}")
        if (last - first) / size > 1e8:
            raise ValueError(f"step = {step!r} makes more than 1e8 rows of a run of length {last - first:.6g}")
        return np.minimum(first + size * np.arange(int((last - first) / size * (1 + 1e-12)) + 1), last)
    if np.ndim(samples) == 0:
        return np.linspace(first, last, whole_number(samples, "samples", 2))
    instants = float_array(samples, "samples")
    if instants.ndim != 1 or not len(instants) or (np.diff(instants) <= 0).any():
        raise ValueError("samples must be a number, or increasing instants")
    if instants[0] < first or instants[-1] > last:
        raise ValueError(
            f"samples from {instants[0]:.6g} to {instants[-1]:.6g} lie outside the run, {first:.6g} ... {last:.6g}"
        )
    return instants


def _anew(run: xr.Dataset, instants: FloatArray) -> xr.Dataset | None:
    """The same motion at the instants; None where the record does not give it."""
    record = read_provenance(run) if ATTRIBUTE in run.attrs else {}
    options = record.get("options") or {}
    ramps = options.get("ramps") or {}
    if record.get("verb") != "simulate" or options.get("inputs") or any(isinstance(one, str) for one in ramps.values()):
        return None
    known = {key: value for key, value in options.items() if value is not None}
    last = run["time"].values[-1:]
    known["samples"] = np.append(instants, last[instants[-1] < last])  # with the end, to be compared
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the run has said it
        again = simulate(recorded_system(record), **known)
    size = np.nanmax(np.abs(run["u"].values), axis=0)
    end, *rows = np.searchsorted(again["time"].values, [last[0], *instants], side="right") - 1
    same = np.abs(again["u"].values[end] - run["u"].values[-1]) <= _SAME * size
    if again.sizes["crossing"] != run.sizes["crossing"] or not (same | np.isnan(run["u"].values[-1])).all():
        return None  # memory or a start that the record does not hold
    return again.isel(time=rows)


def _interpolated(run: xr.Dataset, instants: FloatArray) -> xr.Dataset:
    from scipy.interpolate import CubicSpline

    time, segment = run["time"].values, run["segment"].values
    nearest = np.searchsorted(time, instants, side="right") - 1
    own = segment[nearest]
    found = run.isel(time=nearest).assign_coords(time=("time", instants, dict(run["time"].attrs)))
    for name, array in run.data_vars.items():
        if "time" not in array.dims or array.dtype.kind != "f":
            continue
        values = array.transpose("time", ...).values
        new = values[nearest].copy()
        for k in np.unique(own):
            rows, at = np.flatnonzero(segment == k), own == k
            rows = rows[np.append(True, np.diff(time[rows]) > 0)]
            if len(rows) > 1:
                spline = CubicSpline(time[rows], np.nan_to_num(values[rows]))
                new[at] = np.where(np.isnan(values[rows[0]]), np.nan, spline(instants[at]))
        found[name] = (("time", *[d for d in array.dims if d != "time"]), new, dict(array.attrs))
    return found
