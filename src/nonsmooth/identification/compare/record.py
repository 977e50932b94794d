"""A record under measured inputs against theory: over its own time, from its beginning on.

Such a motion has no period, and so neither an orbit nor sections: reading by reading the record lies over the motion
from its start, which a fit has found or the caller knows. Readings beside a jump stand on the side that they fit, as in
a fit (:mod:`nonsmooth.identification.fit.jumps`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.flow.starts import first_state
from nonsmooth.identification.compare.draws import Model
from nonsmooth.identification.compare.measured import only_run, told_sensors
from nonsmooth.identification.finding import normal_draws
from nonsmooth.identification.fit.fit import problem_of
from nonsmooth.identification.fit.window import Window
from nonsmooth.identification.fit.windows import Windows
from nonsmooth.results.labels import labelled
from nonsmooth.system.system import System


def read_record(system: System, recording: Any, channels: Any, run: str | None, inputs: Any, found: Any) -> Windows:
    """The one run as a fit sees it, without unknowns, its sensors as a fit has found them."""
    problem = problem_of(system, recording, None, {"measured": channels, "runs": run}, inputs=inputs)
    sensors, told = told_sensors(problem.sensors, only_run(problem.records), getattr(found, "extra", {}), system)
    noise = np.array([told[f"{q}.noise"] for q in sensors])
    return replace(problem, sensors=sensors, noise=np.where(np.isfinite(noise), noise, problem.noise))


def compare_record(problem: Windows, model: Model, start: Any) -> dict[str, Any]:
    """The variables of the comparison; see :func:`nonsmooth.compare`."""
    (record,), sensors = problem.records, problem.sensors.values()
    found = {} if start is not None else _found_start(problem, model.parameters)
    begun = first_state(problem.system, found if start is None else start)
    window = Window(
        0,
        0,
        len(record.time),
        float(record.time[0]),
        np.concatenate([begun.u, begun.memory]),
        np.zeros(problem.marcher.flow.n),
        int(begun.counters[0]),
        problem.unknowns.places[0],
        record.time,
        record.values,
    )
    gain, offset = (np.array([getattr(one, name) for one in sensors]) for name in ("gain", "offset"))

    def predicted(system: System, window: Window) -> FloatArray | None:
        now = replace(problem, system=problem.system.with_parameters(dict(system.values)))
        motion = now.motion(problem.unknowns.guess, window, window.start)
        if motion is None:
            return None
        whole = np.full(record.values.shape, np.nan)
        whole[window.readings] = now.readings(problem.unknowns.guess, window, motion, False)[0]
        return (whole - offset) / gain

    assert model.system is not None
    theory = predicted(model.system, window)
    if theory is None:
        raise SolveError(f"the motion of {model.system.name!r} from its start does not come to the end of the record")
    measured, noise = (record.values - offset) / gain, model.noise
    left = measured - theory
    rms = np.sqrt(np.nanmean(left**2, axis=0))
    low = high = theory
    variables = {
        "measured": labelled(("time", "state"), measured, "measured"),
        "theory": labelled(("time", "state"), theory, "predicted at the readings"),
        "noise": labelled("state", noise, "standard deviation of a reading"),
        "difference": labelled("state", rms, "root mean square of measured less predicted"),
        "difference_over_noise": labelled("state", rms / noise, "the same over the noise"),
        "time": labelled("time", record.time, "time of the record", "s" if any(model.theory.states.values()) else "1"),
    }
    if model.draws:
        systems, drawn = model.drawn()
        starts = _drawn_starts(problem, model, found, drawn)
        rows = [
            predicted(system, replace(window, start=np.concatenate([u, window.start[len(u) :]])))
            for system, u in zip(systems, starts, strict=True)
        ]
        kept = [row for row in rows if row is not None]
        variables |= drawn | {
            "band_share": labelled((), len(kept) / len(rows), "share of the draws whose motion ends with the record")
        }
        if kept:
            band = model.band(kept)
            low, high = band["low"], band["high"]
            for word, values in band.items():
                variables[f"theory_{word}"] = labelled(("time", "state"), values, f"{word} of the band")
    there = np.isfinite(left)
    inside = (measured + 2 * noise >= low) & (measured - 2 * noise <= high) & there
    variables["inside_band"] = labelled(
        "state", inside.sum(axis=0) / there.sum(axis=0), "share of the readings within two standard errors of the band"
    )
    return variables


def _found_start(problem: Windows, found: Any) -> dict[str, float]:
    """The start that a fit has found of these very readings; ValueError where it has none of some states."""
    extra, (record,) = getattr(found, "extra", {}) if _of_fit(problem, found) else {}, problem.records
    own = [*problem.system.states][: problem.system._description.n_own]  # those of inputs are set by the run
    known = {name: _row_of(name, record.name, extra) for name in own}
    if missing := [name for name, row in known.items() if row not in extra]:
        raise ValueError(
            f"under measured inputs a motion begins where the record does, and nothing says with which "
            f"{', '.join(missing)}: give start=, or parameters= as the fit of these readings returns them"
        )
    return {name: extra[row].value for name, row in known.items()}


def _of_fit(problem: Windows, found: Any) -> bool:
    """Return whether the readings of a fit, in this session, are those of this record: another begins elsewhere."""
    try:
        fitted = found.residuals
    except (AttributeError, ValueError):
        return False
    runs, quantities = (fitted[name].attrs["flag_meanings"].split() for name in ("run", "quantity"))
    (record,) = problem.records
    name, known = record.name.replace(" ", "_"), [quantities.index(q) for q in problem.sensors if q in quantities]
    run = runs.index(name) if name in runs else 0 if len(runs) == 1 else -1
    mine = (fitted["run"].values == run) & np.isin(fitted["quantity"].values, known)
    read = fitted["time"].values + 1j * fitted["measured"].values  # each reading as one number
    return bool(mine.any() and np.isin(read[mine], record.time[:, None] + 1j * record.values).all())


def _row_of(state: str, run: str, extra: Mapping[str, Any]) -> str:
    return f"{state}(0), {run}" if f"{state}(0), {run}" in extra else f"{state}(0)"


def _drawn_starts(problem: Windows, model: Model, found: Mapping[str, float], drawn: Mapping[str, Any]) -> FloatArray:
    """Starts that go with the drawn parameters: by the covariance that a fit gives of both."""
    parameters, (record,) = model.parameters, problem.records
    rows = [_row_of(name, record.name, getattr(parameters, "extra", {})) for name in found]
    table = np.array([*found.values()])
    if not found or not hasattr(parameters, "full_covariance"):
        return np.tile(table, (model.draws, 1))
    names = [name for name in parameters if f"drawn_{name}" in drawn and name not in model.settings]
    whole = parameters.full_covariance.sel(parameter=[*names, *rows], other=[*names, *rows]).values
    whole = np.where(np.isfinite(whole), whole, 0.0)
    m = len(names)
    follow = whole[m:, :m] @ np.linalg.pinv(whole[:m, :m], hermitian=True)
    off = np.array([drawn[f"drawn_{name}"][1] - parameters[name] for name in names]).reshape(m, model.draws)
    rest = whole[m:, m:] - follow @ whole[:m, m:]
    return normal_draws([*table], rest, model.draws, model.seed + 1) + (follow @ off).T
