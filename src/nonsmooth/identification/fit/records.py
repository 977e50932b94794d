"""Recordings of every kind as records: instants, and one column for each measured quantity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import check_keys, shortened, unknown
from nonsmooth.flow.inputs import Driven, Input, driven
from nonsmooth.identification.fit.sensors import Sensor, read_sensors
from nonsmooth.identification.fit.steady import SteadyReadings, is_steady, read_steady
from nonsmooth.identification.measured_units import compare_units
from nonsmooth.recordings.recording import Recording
from nonsmooth.system.kinds import float_array, real_number
from nonsmooth.system.system import System

FORMS = (
    "a Recording, a Dataset over time, a DataFrame with a column of time (or time as its index), a mapping of channel "
    "to (t, y), or a list of these"
)


@dataclass(frozen=True, eq=False)
class Record:
    """One run: samples of all measured quantities and the parameters that were set in it.

    Attributes
    ----------
    name : str
    time : array (N,)
        Instants at which at least one quantity was sampled, increasing.
    values : array (N, c)
        Readings; NaN where there is none.
    settings : mapping of str to float
    drive : Driven or None
        The inputs of the system in this run.
    first : bool
        Whether it is no later part of a run, before which the system may have written what nobody knows.
    """

    name: str
    time: FloatArray
    values: FloatArray
    settings: Mapping[str, float]
    drive: Driven | None = None
    first: bool = True

    @property
    def duration(self) -> float:
        return self.time[-1] - self.time[0]


def irregularity(y: FloatArray, moving: bool = False) -> float:
    """Standard deviation of white noise that explains the third differences (where it is ``moving``, those that are not
    zero); a motion adds to it."""
    third = np.diff(y[np.isfinite(y)], 3)
    third = third[third != 0.0] if moving else third
    return np.sqrt(np.median(third**2) / (20.0 * 0.4549)) if len(third) else 0.0


def read_records(
    system: System, recording: Any, options: Mapping[str, Any], inputs: Any = None
) -> tuple[dict[str, Sensor], list[Record], tuple[SteadyReadings, ...]]:
    """The sensors and the records of a recording, and its readings of steady states; ``options`` as of `Recorded`."""
    runs, measured = options.get("runs"), options.get("measured")
    given = list(recording) if isinstance(recording, list | tuple) else [recording]
    if not given:
        raise ValueError(f"the list of recordings is empty; give {FORMS}")
    tables: dict[str, dict[str, tuple[FloatArray, FloatArray]]] = {}
    still = {f"{i}" if len(given) > 1 else "steady": one for i, one in enumerate(given) if is_steady(one)}
    clock = options.get("time", "time")
    for i, one in enumerate(given):
        found = {} if is_steady(one) else _tables(one, runs, clock)
        for name, table in found.items():
            label = name if len(given) == 1 else f"{i}" if len(found) == 1 else f"{i} {name}"
            tables[label] = table
    if runs is not None and not tables:
        raise ValueError("runs= chooses runs of a Recording; what is given here is none, so leave it out")
    per_run = _settings(system, options.get("settings"), [*tables, *still])
    steady = tuple(read_steady(system, one, name, measured, per_run[name]) for name, one in still.items())
    channels = list(dict.fromkeys(name for table in tables.values() for name in table))
    quantities = [] if tables else [q for one in steady for q in one.quantities]
    sensors = read_sensors(system, measured, channels or quantities)
    units = [_units(one) for one in given]
    ours = {**system.states, **system.outputs}
    _compare_units("recording", clock, units, "s" if any(system.states.values()) else "", "times in that unit")
    for quantity, sensor in sensors.items():
        _compare_units(
            f"measured[{quantity!r}]", sensor.channel, units, ours[quantity], "Sensor(gain=...)", sensor.gain
        )
    for name, unit in system.inputs.items():
        one = (inputs or {}).get(name) if isinstance(inputs, Mapping | None) else None
        channel = one.time if isinstance(one, Input) else name if inputs is None else one
        if isinstance(channel, str):
            _compare_units(f"inputs[{name!r}]", channel, units, unit, "Input(time, values) in that unit")
    records = []
    for label, table in tables.items():
        columns = []
        for quantity, sensor in sensors.items():
            check_keys([sensor.channel], table, f"measured[{quantity!r}]", "a channel", f"run {label!r}")
            columns.append(table[sensor.channel])
        records.append(replace(_joined(label, columns, per_run[label]), drive=_driven(system, inputs, label, table)))
    for c, (quantity, sensor) in enumerate(sensors.items()):
        if records and not any(np.isfinite(one.values[:, c]).any() for one in records):
            raise ValueError(f"measured[{quantity!r}]: channel {sensor.channel!r} holds no number; leave it out")
    return sensors, records, steady


def _units(recording: Any) -> dict[str, str]:
    """Units of the channels and of the time, as far as a recording says them."""
    if isinstance(recording, Recording):
        return recording.units
    return {str(name): str(one.attrs.get("units", "")) for name, one in getattr(recording, "variables", {}).items()}


def _compare_units(
    what: str, channel: str, units: Sequence[Mapping[str, str]], ours: str, remedy: str, gain: float = 1.0
) -> None:
    """Compare the unit of a channel in any of the recordings."""
    for theirs in dict.fromkeys(one.get(channel, "") for one in units):
        compare_units(f"{what}: channel {channel!r}", theirs, ours, remedy, gain)


def _driven(
    system: System, inputs: Any, label: str, table: Mapping[str, tuple[FloatArray, FloatArray]]
) -> Driven | None:
    """The inputs of a run: channels of its table by their names, or as they are given."""
    if inputs is None and system.inputs:
        inputs = {name: name for name in system.inputs if name in table}
    if not isinstance(inputs, Mapping):
        return driven(system, inputs)
    found = {}
    for name, one in inputs.items():
        one = Input(one) if isinstance(one, str) else one
        if isinstance(one, Input) and isinstance(one.time, str):
            check_keys([one.time], table, f"inputs[{name!r}]", "a channel", f"run {label!r}")
            one = replace(one, time=table[one.time][0], values=table[one.time][1])
        found[name] = one
    return driven(system, found)


def _joined(label: str, columns: list[tuple[FloatArray, FloatArray]], settings: Mapping[str, float]) -> Record:
    """Channels on the union of their clocks."""
    kept = [(t[ok], y[ok]) for t, y in columns for ok in [np.isfinite(t) & np.isfinite(y)]]
    time = np.unique(np.concatenate([t for t, _ in kept]))
    if len(time) < 8:
        raise ValueError(f"run {label!r} has {len(time)} samples; a fit needs at least 8: give a longer record")
    values = np.full((len(time), len(kept)), np.nan)
    for c, (t, y) in enumerate(kept):
        if len(back := np.flatnonzero(np.diff(t) <= 0)):
            where = back[0]
            raise ValueError(
                f"run {label!r}: the time must increase from sample to sample; sample {where + 1} is at "
                f"{t[where + 1]:.9g} after {t[where]:.9g}: sort the samples, or give each run by itself"
            )
        values[np.searchsorted(time, t), c] = y
    return Record(label, time, values, settings)


def _tables(one: Any, runs: Sequence[str] | None, time: str) -> dict[str, dict[str, tuple[FloatArray, FloatArray]]]:
    """Channels of each run as (t, y)."""
    if isinstance(one, Recording):
        wanted = one.runs if runs is None else [runs] if isinstance(runs, str) else runs
        found: dict[str, dict[str, tuple[FloatArray, FloatArray]]] = {}
        check_keys(wanted, one.runs, "runs", "a run", "this recording")
        for run in wanted:
            found[run] = {}
            for leaf in one.tree.children[run].children.values():
                for name, array in leaf.to_dataset().data_vars.items():
                    found[run][str(name)] = _pair(array[array.dims[0]].values, array.values, str(name))
        return found
    if runs is not None:
        raise ValueError("runs= chooses runs of a Recording; what is given here is one run, so leave it out")
    if hasattr(one, "data_vars"):
        return {"run": _of_dataset(one, time)}
    if hasattr(one, "columns") and hasattr(one, "index") and time not in one:
        one = one.rename_axis(index=time).reset_index()
    if hasattr(one, "items") and time in one:
        numbers = {k: y for k, y in one.items() if k != time and not isinstance(next(iter(np.ravel(y)), 0.0), str)}
        return {"run": {str(k): _between_ticks(*_pair(one[time], y, str(k))) for k, y in numbers.items()}}
    if isinstance(one, Mapping):
        made = {}
        for name, pair in one.items():
            if not isinstance(pair, list | tuple) or len(pair) != 2:
                raise TypeError(
                    f"channel {name!r} must be a pair (t, y), not {shortened(pair)}; or give the instants of all "
                    f"channels once, under {time!r}"
                )
            made[str(name)] = _between_ticks(*_pair(pair[0], pair[1], str(name)))
        return {"run": made}
    of_a_file = "; read a file with ns.load_recording" if isinstance(one, str | PathLike) else ""
    raise TypeError(f"a recording is {FORMS}, not {shortened(one)}{of_a_file}")


def _of_dataset(one: Any, time: str) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Channels of a Dataset; of a result of ``simulate`` its states and outputs, but for the instants of its crossings.

    No reading is taken there: a speed that jumps has two values, and is on either side of the model's own crossing.
    """
    if time not in one.coords:
        raise ValueError(f"the Dataset has no coordinate {time!r}; it has {', '.join(map(str, one.coords)) or 'none'}")
    t = np.asarray(one[time].values)
    again = (t[1:] == t[:-1]) & ("segment" in one)  # of a run: both limits of a crossing stand there
    kept = ~(np.append(again, False) | np.append(False, again)) if len(t) else np.ones(0, bool)
    found = {}
    if "u" in one and one["u"].dims == (time, "state"):
        for k, name in enumerate(one["state"].values):
            found[str(name)] = _pair(t[kept], one["u"].values[kept, k], str(name))
    for name, array in one.data_vars.items():
        if array.dims == (time,) and array.dtype.kind in "fiu":
            found[str(name)] = _pair(t[kept], array.values[kept], str(name))
    return found


def _pair(t: Any, y: Any, name: str) -> tuple[FloatArray, FloatArray]:
    both = float_array(t, f"the time of channel {name!r}"), float_array(y, f"channel {name!r}")
    if both[0].ndim != 1 or both[0].shape != both[1].shape:
        raise ValueError(
            f"channel {name!r} must be as many numbers as its time, in one row; got shapes {both[1].shape} and "
            f"{both[0].shape}"
        )
    return both


def _between_ticks(t: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A channel without both limits of jumps, as a run of ``simulate`` has them in a table too: an instant that stands
    twice within one step of the clock. Of a clock with too few digits it stands within two."""
    step = np.diff(t, prepend=-np.inf, append=np.inf)
    twice = np.flatnonzero(step[1:-1] == 0)
    twice = twice[step[twice] + step[twice + 2] < 1.5 * np.median(step[step > 0])]
    kept = np.ones(len(t), dtype=bool)
    kept[twice], kept[twice + 1] = False, False
    return t[kept], y[kept]


def _settings(system: System, settings: Any, labels: list[str]) -> dict[str, dict[str, float]]:
    """Parameters that were set, by run: one mapping for all runs, or ``{run: mapping}``, or a list in their order."""
    if settings is None:
        return {label: {} for label in labels}
    if isinstance(settings, list | tuple):
        if len(settings) != len(labels):
            raise ValueError(
                f"settings lists {len(settings)} runs, the recording has {len(labels)}: {', '.join(labels)}"
            )
        settings = dict(zip(labels, settings, strict=True))
    if not isinstance(settings, Mapping):
        raise TypeError(
            f"settings = {shortened(settings)}: allowed are a mapping of parameter to value, a mapping of run to such "
            "a mapping, and a list of them"
        )
    if not all(isinstance(one, Mapping) for one in settings.values()):
        settings = dict.fromkeys(labels, settings)
    units = {key: parameter.unit for key, parameter in system.parameters.items()}
    check_keys(settings, labels, "settings", "a run", "this recording")
    for own in settings.values():
        for name in own:
            if name not in system.values:
                raise ValueError(f"settings: {unknown(name, 'a parameter', repr(system.name), units)}")
    return {
        label: {name: real_number(value, name) for name, value in settings.get(label, {}).items()} for label in labels
    }
