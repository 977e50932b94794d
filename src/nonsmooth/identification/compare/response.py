"""A measured frequency response against theory: amplitudes run by run, jumps, and the band."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.diagrams.response import jumps_in
from nonsmooth.diagrams.sweep import sweep
from nonsmooth.identification.compare.draws import Model
from nonsmooth.identification.compare.jumps import AmplitudeJump, Jumps, jumps_of_runs, match_jumps
from nonsmooth.results.labels import labelled

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System

FINE = 301  # values of the predicted curve


def compare_response(measured: xr.Dataset, model: Model, *, name: str, state: str) -> dict[str, Any]:
    """The variables of the comparison, ``{name: (dims, values, attributes)}``; see :func:`compare` for each."""
    runs = _runs(measured, name, state)
    unit = measured[name].attrs.get("units", "1")
    directions = [word for word in ("up", "down") if (runs["direction"] == word).any()]
    if model.system is None:
        values, curves = _given(model.theory, name, state, directions)
        at_runs = np.full(len(runs["value"]), np.nan)
        for d, word in enumerate(directions):
            mine = runs["direction"] == word
            at_runs[mine] = np.interp(runs["value"][mine], values, curves[:, d])
    else:
        values = np.linspace(runs["value"].min(), runs["value"].max(), FINE)
        curves, at_runs = _curves(model.system, model, name, state, values, runs, directions)
    variables: dict[str, Any] = {
        f"measured_{name}": labelled("run", runs["value"], f"measured {name}", unit),
        "measured_direction": labelled("run", runs["direction"], "direction in which the run was reached"),
        "measured_amplitude": labelled("run", runs["amplitude"], "measured amplitude"),
        "measured_amplitude_error": labelled("run", runs["error"], "standard error of it"),
        "measured_period_number": labelled(
            "run", runs["period"], "measured period number (0: none found, -1: not known)"
        ),
        "theory_amplitude": labelled((name, "direction"), curves, "predicted amplitude"),
        "theory_at_run": labelled("run", at_runs, "predicted amplitude at the run"),
        "relative_difference": labelled("run", at_runs / runs["amplitude"] - 1, "prediction over measurement, minus 1"),
        name: labelled(name, values, name, unit),
        "direction": labelled("direction", np.array(directions), "direction of the sweep"),
    }
    expected = _jumps(values, curves, directions)
    seen = _measured_jumps(measured, runs, directions)
    drawn_jumps: list[Jumps] = []
    if model.system is not None and model.draws:
        systems, drawn = model.drawn()
        stack, stack_runs = [], []
        for one in systems:
            curve, points = _curves(one, model, name, state, values, runs, directions)
            stack.append(curve)
            stack_runs.append(points)
            drawn_jumps.append(_jumps(values, curve, directions))
        for word, curve in model.band(stack).items():
            variables[f"theory_{word}"] = labelled((name, "direction"), curve, f"{word} of the band")
        band, reach = model.band(stack_runs), 2 * np.nan_to_num(runs["error"])
        inside = (runs["amplitude"] + reach >= band["low"]) & (runs["amplitude"] - reach <= band["high"])
        variables["inside_band"] = labelled(
            (), float(inside.mean()), "share of the runs within two standard errors of the band"
        )
        variables |= drawn
    return variables | match_jumps(seen, expected, drawn_jumps, unit, model.level)


def _runs(measured: xr.Dataset, name: str, state: str) -> dict[str, NDArray[Any]]:
    """One row for each run: value, direction, amplitude, error, period number, sorted by direction and value."""
    one = measured.sel(state=state) if "state" in measured["amplitude"].dims else measured
    over = {*one["amplitude"].dims} - {"direction"}
    if name not in one.variables or len(over) != 1 or {*one[name].dims} != over:
        raise ValueError(
            f"a measured response holds `amplitude` over its runs, with `{name}` (and `direction`) for each; this "
            f"one has {one['amplitude'].dims} and {', '.join(map(str, measured.variables))}"
        )
    absent = {"direction": "up", "amplitude_error": np.nan, "period_number": -1}
    held = [key for key in ("amplitude", name, *absent) if key in one.variables]
    frame = one[held].to_dataframe().reset_index().assign(**{key: absent[key] for key in {*absent} - {*held}})
    frame = frame[np.isfinite(frame[name]) & np.isfinite(frame["amplitude"])].sort_values(["direction", name])
    if frame.empty:
        raise ValueError("the measured response has no run with a finite amplitude")
    columns = {"value": name, "amplitude": "amplitude", "error": "amplitude_error", "period": "period_number"}
    direction = {"direction": frame["direction"].to_numpy(str)}
    return direction | {key: frame[column].to_numpy() for key, column in columns.items()}


def _curves(
    system: System,
    model: Model,
    name: str,
    state: str,
    values: FloatArray,
    runs: dict[str, NDArray[Any]],
    directions: list[Any],
) -> tuple[FloatArray, FloatArray]:
    """The predicted curve on a regular grid, and at the runs: one carried sweep over both for each direction."""
    curves = np.empty((len(values), len(directions)))
    at_runs = np.full(len(runs["value"]), np.nan)
    for d, word in enumerate(directions):
        mine = runs["direction"] == word
        every = np.union1d(values, runs["value"][mine])
        result = sweep(
            system, name, every, direction=word, transient=model.transient, keep=32, progress=False, **model.options
        )
        heights = 0.5 * (result["maximum"] - result["minimum"]).sel(state=state).values
        curves[:, d] = heights[np.searchsorted(every, values)]
        at_runs[mine] = heights[np.searchsorted(every, runs["value"][mine])]
    return curves, at_runs


def _given(theory: xr.Dataset, name: str, state: str, directions: list[str]) -> tuple[FloatArray, FloatArray]:
    if "amplitude" not in theory or name not in theory["amplitude"].dims:
        raise ValueError(
            f"the theory must be a System or a result of frequency_response over {name}; it holds "
            f"{', '.join(map(str, theory.data_vars))}"
        )
    heights = theory["amplitude"].sel(state=state)
    heights = heights.expand_dims([d for d in ("direction",) if d not in heights.dims]).sortby(name)
    words = np.atleast_1d(heights["direction"].values).astype(str).tolist()
    if missing := [word for word in directions if word not in words]:
        raise ValueError(f"runs were made {' and '.join(missing)}, the theory has only: {', '.join(words)}")
    chosen = heights.transpose(name, "direction").isel(direction=[words.index(word) for word in directions])
    return np.asarray(chosen[name].values, dtype=float), np.asarray(chosen.values, dtype=float)


def _jumps(values: FloatArray, curves: FloatArray, directions: list[str]) -> Jumps:
    """The jumps of each direction: middle of the step in which they lie, half of it, amplitude before and after."""
    found = {}
    for d, word in enumerate(directions):
        x, heights = (values, curves[:, d]) if word == "up" else (values[::-1], curves[::-1, d])
        steps = [(x[i : i + 2], heights[i : i + 2].tolist()) for i in jumps_in(heights)]
        found[word] = [AmplitudeJump(float(at.mean()), 0.5 * float(np.ptp(at)), *both) for at, both in steps]
    return found


def _measured_jumps(measured: xr.Dataset, runs: dict[str, NDArray[Any]], directions: list[str]) -> Jumps:
    """The jumps that the measurement states, else those in its steps; the prediction has no say in it."""
    stated = "jump_value" in measured and "jump_before" not in measured  # as the experimenter read them off
    if stated and "run" in measured["amplitude"].dims:
        found: dict[str, list[AmplitudeJump]] = {}
        words = measured["jump_direction"].values.astype(str)
        half = 0.5 * measured["jump_step"].values if "jump_step" in measured else np.zeros(len(words))
        for word in directions:
            rows = zip(measured["jump_value"].values, half, words, strict=True)
            named = [AmplitudeJump(float(value), float(step), np.nan, np.nan) for value, step, w in rows if w == word]
            found[word] = sorted(named, key=lambda jump: jump.value, reverse=word == "down")
        return found
    return jumps_of_runs(*(runs[key] for key in ("value", "amplitude", "error", "direction")))
