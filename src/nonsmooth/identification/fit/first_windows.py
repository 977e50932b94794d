"""The first windows of a record and their starts: measured states from the samples, hidden ones from a simulation.

The system is simulated window by window at the first guess. At the beginning of each window the states that are
measured, and those whose rate a measured one has, are set to the record; the others, the memory and the mode go on
from the window before. So the simulation follows the record, and hidden states follow the simulation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.identification.fit.window import Window
from nonsmooth.identification.fit.windows import Windows
from nonsmooth.system.system import System

_AROUND = 3  # samples on either side, from which value and slope at a sample are taken
_SWING = 0.15  # of a quantity's range: what counts as a swing
_OF_A_SWING = 0.3  # to and fro: the length of the first windows
WIDE = 3.0  # a start may move by so many times the size of its state


def first_length(problem: Windows) -> float:
    """Length of the first windows: a part of a swing to and fro, and samples enough for a start."""
    found, least = [], 3 * problem.marcher.flow.n + 6  # samples
    for record in problem.records:
        columns = [y[np.isfinite(y)] for y in record.values.T]
        swing = 2.0 * record.duration / max(min(turns_of(y) for y in columns if len(y)), 4)
        found.append(max(_OF_A_SWING * swing, least * record.duration / (len(record.time) - 1)))
    return np.median(found)


def turns_of(y: FloatArray) -> int:
    """Number of turns of a quantity by more than a part of its range."""
    low, high = np.quantile(y, [0.05, 0.95])
    least, turns, rising, extreme = _SWING * (high - low), 0, True, y[0]
    for value in y.tolist():
        if (value > extreme) == rising:
            extreme = value
        elif abs(value - extreme) > least:
            turns, rising, extreme = turns + 1, not rising, value
    return turns


def first_windows(
    problem: Windows, theta: FloatArray, length: float, start: FloatArray | None, free: bool
) -> list[Window]:
    """Windows of about ``length``, each beginning as far as may be from a transition.

    ``start`` (records, n_u): first guess of the states at the beginning of each record, or their values where not
    ``free``.
    """
    n_u, memory = len(problem.system.states), problem.system.memory_vector()
    found: list[Window] = []
    for i, record in enumerate(problem.records):
        here, u = problem.at(theta, i), problem.unknowns
        told = states_from_samples(problem, theta, i, slice(None))
        z = np.concatenate([np.zeros(n_u) if start is None else start[i], memory])
        if here.values is None:
            continue
        sizes = np.abs(np.append(np.max(np.abs(np.nan_to_num(told)), axis=0), memory))
        time, mode, first, windows = record.time, problem.modes[i][0], 0, []
        while first < len(time) - 1:
            rest = time[-1] - time[first]
            until = time[-1] if rest < 1.75 * length else time[first] + 1.25 * length
            # at least two samples, across a gap that is longer than a window
            end = max(np.searchsorted(time, until, "right"), first + 2)
            known = np.append(np.isfinite(told[first]), np.zeros(len(memory), bool))
            set_ = np.where(known, np.append(np.nan_to_num(told[first]), memory), z)
            begin = float(time[first])
            for candidate in [z] if first == 0 and start is not None else [set_, z]:  # beyond a stop: as it was going
                motion = problem.march(theta, i, begin, here.begun(time[first:end]), candidate, mode)
                if motion is not None:
                    break
            if motion is None:  # the samples of this window come back when windows are joined
                first, mode = max(end - 1, first + 1), problem.modes[i][0]
                continue
            sizes = np.maximum(sizes, np.abs(motion.z).max(axis=0))
            last = end if end == len(time) else first + _quiet(motion.time, motion.log.crossing_time, length)
            spread = np.zeros(len(z)) if first == 0 and not free else np.ones(len(z))
            spread[n_u:] = first > 0 or not record.first  # what was written before the run is known
            if np.isfinite(record.values[first:last]).any():  # a gap is bridged where windows are joined
                t, y = time[first:last], record.values[first:last]
                windows.append(Window(i, first, last, begin, candidate, spread, mode, u.places[i], t, y))
            if last == len(time):
                break
            z, mode = motion.z[last - first].copy(), int(motion.mode[last - first])
            first = last
        wide = WIDE * np.where(sizes > 0, sizes, np.append(problem.system.scale_vector(), np.ones(len(memory))))
        wide[problem.system._description.n_own : n_u] = 0.0  # inputs are known
        found += [replace(window, spread=window.spread * wide) for window in windows]
    return found


def _quiet(time: FloatArray, crossings: FloatArray, length: float) -> int:
    """The sample about ``length`` after the first that is farthest from any transition."""
    near = np.flatnonzero(time - time[0] >= 0.75 * length)
    near = near[near < len(time) - 1]
    if not len(near):
        return len(time) - 1
    if not len(crossings):
        return int(near[len(near) // 2])
    return int(near[np.argmax(np.abs(np.subtract.outer(time[near], crossings)).min(axis=1))])


def told_start(problem: Windows, theta: FloatArray, window: Window) -> FloatArray:
    """The start of a window as its samples tell it; NaN where they do not."""
    told = states_from_samples(problem, theta, window.record, slice(window.first, window.first + 1))[0]
    return np.append(told, np.full(len(window.start) - len(told), np.nan))


def states_from_samples(problem: Windows, theta: FloatArray, run: int, which: slice) -> FloatArray:
    """States (N, n_u) that the samples tell: those measured, and those that are the rate of one; NaN elsewhere."""
    record = problem.records[run]
    at, held, sensors = record.time[which], np.isfinite(record.values), problem.at(theta, run).sensors
    measured = {q: (sensor, c) for c, (q, sensor) in enumerate(sensors.items()) if held[:, c].any()}
    system, names = problem.system, list(problem.system.states)
    told = np.full((len(at), len(names)), np.nan)
    known = rates(system)
    for quantity, (sensor, c) in measured.items():
        if quantity not in names:
            continue
        k, have = names.index(quantity), np.flatnonzero(held[:, c])
        t, y = record.time[have], (record.values[have, c] - sensor.offset) / sensor.gain
        value, slope = _local(t, y, at)
        told[:, k] = value
        if k in known and names[known[k]] not in measured:
            told[:, known[k]] = slope
    told[:, system._description.n_own :] = 0.0  # inputs, which each run sets
    return told


def rates(system: System) -> Mapping[int, int]:
    """States whose rate is another state in every mode that has them: position -> velocity."""
    traced, found = system.traced, {}
    for i in range(len(traced.u)):
        fields = {field[i] for field, lacking in zip(traced.fields, traced.lacking, strict=True) if not lacking[i]}
        fields.discard(0)
        if len(fields) == 1 and (rate := next(iter(fields))) in traced.u:
            found[i] = traced.u.index(rate)
    return found


def _local(t: FloatArray, y: FloatArray, at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Value and slope at each instant, of the parabola through the nearest samples."""
    width = min(2 * _AROUND + 1, len(t))
    rows = np.clip(np.searchsorted(t, at) - _AROUND, 0, len(t) - width)[:, None] + np.arange(width)
    s = t[rows] - at[:, None]
    size = np.maximum(np.abs(s).max(axis=1), 1e-300)
    table = np.stack([np.ones_like(s), s / size[:, None], (s / size[:, None]) ** 2], axis=2)
    found = np.linalg.pinv(table) @ y[rows][:, :, None]
    return found[:, 0, 0], found[:, 1, 0] / size
