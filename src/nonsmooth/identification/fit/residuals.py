"""Residuals of a fit with the place in the motion of each: its mode, a transition, a graze."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.arrays import IntArray
from nonsmooth.flow.sampled import SampledRun
from nonsmooth.identification.fit.growth import Grown
from nonsmooth.results.labels import labels_of
from nonsmooth.system.symbolic.numeric import numeric
from nonsmooth.system.system import System

_NEAR = 1.5  # sampling steps from a transition or a graze
_GRAZING = 0.03  # clearance over the largest size of the indicator, below which a touch is a graze


def residual_data(grown: Grown, options: Mapping[str, Any]) -> xr.Dataset:
    """Readings, fit and residuals over ``sample``, each with its run, quantity, window, mode and place."""
    problem, theta = grown.problem, grown.theta
    system = _nominal(grown)
    labels, marks = _places(system)
    parts: list[dict[str, Any]] = []
    for i, (window, start) in enumerate(zip(problem.pieces, grown.starts, strict=True)):
        motion = problem.motion(theta, window, start)
        assert motion is not None
        predicted, _ = problem.readings(theta, window, motion, False)
        k, c = window.readings
        here = problem.samples_of(theta, window)
        shown = problem.shown(window, predicted)
        parts.append(
            {
                "time": window.time[k],
                "run": np.full(len(k), window.record),
                "quantity": c,
                "window": np.full(len(k), i),
                "mode": motion.mode[here],
                "place": _of_samples(system, motion, marks)[here],
                "measured": window.values[k, c],
                "fitted": shown,
                "beyond": predicted - shown,
                "noise": problem.noise[c],
                "residual": (window.values[k, c] - shown) / problem.noise[c],
            }
        )
    quantities = list(problem.sensors)
    flags = {
        "run": [record.name for record in problem.records],
        "quantity": quantities,
        "mode": list(system.modes),
        "place": labels,
    }
    units = dict.fromkeys(("measured", "fitted", "beyond", "noise"), _unit(system, quantities))
    words = {"beyond": "how far the motion goes beyond the limits of the sensor", "time": "time"}
    told = units | {"time": labels_of(system).time_unit}
    return _table(parts, grown, system, options, flags, told, words).set_coords("time")


def steady_data(grown: Grown, options: Mapping[str, Any]) -> xr.Dataset:
    """Readings of steady states, fit and residuals over ``sample``, each with its run, quantity, settings and place in
    the cycle."""
    problem, system = grown.problem, _nominal(grown)
    names = [*system.values]
    set_ = sorted({int(place) for one in problem.steady for place in one.places})
    parts: list[dict[str, Any]] = []
    quantities = [*dict.fromkeys(q for one in problem.steady for q in one.quantities)]
    for i, one in enumerate(problem.steady):
        fitted, count = problem.of_steady(grown.theta, i)[0], len(one.measured)
        at = np.full((count, len(names)), np.nan)
        at[:, one.places] = one.values[one.setting[one.run]]
        parts.append(
            {
                "run": np.full(count, i),
                "quantity": np.array([quantities.index(q) for q in one.quantities])[one.quantity],
                "iterate": one.iterate,
                "measured": one.measured,
                "fitted": fitted,
                "measured_error": one.noise,
                "used": one.used,
                "residual": (one.measured - fitted) / one.noise,
                **{names[place]: at[:, place] for place in set_},
            }
        )
    units = {names[place]: system.parameters[names[place]].unit for place in set_}
    units |= dict.fromkeys(("measured", "fitted", "measured_error"), _unit(system, quantities))
    kinds = {one.amplitude for one in problem.steady}
    words = {"measured": "reading" if len(kinds) > 1 else "amplitude" if True in kinds else "section"}
    flags = {"run": [one.name for one in problem.steady], "quantity": quantities}
    return _table(parts, grown, system, options, flags, units, words)


def _unit(system: System, quantities: list[str]) -> str:
    units = {**system.states, **system.outputs}
    return units[quantities[0]] if len(quantities) == 1 else "that of the quantity"


def _table(
    parts: list[dict[str, Any]],
    grown: Grown,
    system: System,
    options: Mapping[str, Any],
    flags: Mapping[str, list[str]],
    units: Mapping[str, str],
    words: Mapping[str, str],
) -> xr.Dataset:
    """Columns over ``sample`` with their units and words, those of flags, and the record of the fit."""
    from nonsmooth.results.provenance import provenance

    data = xr.Dataset({name: ("sample", np.concatenate([part[name] for part in parts])) for name in parts[0]})
    for name, text in {**words, "residual": "residual over its standard deviation"}.items():
        data[name].attrs["long_name"] = text
    for name, text in {**units, "residual": "1"}.items():
        data[name].attrs["units"] = text
    for name, meant in flags.items():
        meanings = " ".join(word.replace(" ", "_") for word in meant)
        data[name].attrs = {"flag_values": np.arange(len(meant)), "flag_meanings": meanings}
    method = grown.problem.marcher.engine.name
    return data.assign_attrs(provenance(labels_of(system), "fit", dict(options), method=method))


def by_place(data: xr.Dataset) -> list[tuple[str, float, int]]:
    """Places of the motion with the rms of the normalized residuals there and their number, the worst first."""
    names = data["place"].attrs["flag_meanings"].split()
    r, place = data["residual"].values, data["place"].values
    rows = [(names[i], np.sqrt(np.mean(r[place == i] ** 2)), int(np.sum(place == i))) for i in np.unique(place)]
    return sorted(rows, key=lambda row: -row[1])


def _nominal(grown: Grown) -> System:
    u = grown.problem.unknowns
    found = {name: float(value) for name, value in zip(u.names, grown.theta, strict=True) if name in u.active}
    return grown.problem.system.with_parameters(found)


def _places(system: System) -> tuple[list[str], dict[tuple[str, int], int]]:
    """Names of the places, and the place of each mode, transition and touched indicator."""
    names: list[str] = []
    marks: dict[tuple[str, int], int] = {}
    for m, mode in enumerate(system.modes):
        marks["mode", m] = len(names)
        names.append(mode)
    for k, jump in enumerate(system.transitions):
        label = f"{system.modes[jump.source]}->{system.modes[jump.target]}"
        if label not in names:
            names.append(label)
        marks["transition", k] = names.index(label)
    for i, indicator in enumerate(system.indicators):
        marks["graze", i] = len(names)
        names.append(f"graze of {indicator}")
    return names, marks


def _of_samples(system: System, motion: SampledRun, marks: Mapping[tuple[str, int], int]) -> IntArray:
    """The place of each sample of a motion: the nearest transition, a graze, else its mode."""
    found = np.array([marks["mode", int(m)] for m in motion.mode], np.int64)
    if len(motion.time) < 2:
        return found
    near = _NEAR * np.median(np.diff(motion.time))
    log, traced = motion.log, system.traced
    u, memory = np.split(motion.z, [len(traced.u)], axis=1)
    for i in np.unique(log.touch_indicator):
        size = np.abs(numeric(traced, (traced.indicators[i],))(system.parameter_vector(), motion.time, u, memory)).max()
        for t in log.touch_time[(log.touch_indicator == i) & (log.touch_clearance < _GRAZING * size)]:
            found[np.abs(motion.time - t) <= near] = marks["graze", int(i)]
    for t, k in zip(log.crossing_time, log.crossing_transition, strict=True):
        found[np.abs(motion.time - t) <= near] = marks["transition", int(k)]
    return found
