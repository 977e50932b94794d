"""From traces to a ``Recording``: one clock per sensor, names that fit a tree, and a remark for all that is odd."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.recordings.reading import MAX_COLUMNS, Reading, Trace
from nonsmooth.recordings.recording import Recording, examine, missing_runs, mixed_units

#: A sensor with fewer samples says next to nothing of a motion; below this a remark is made.
SHORT = 32
#: The photogate's channel: one row for each turn, so that few rows are no fault.
EVENTS = "Turn"


def assemble(reading: Reading) -> Recording:
    """Check the traces, group them by run and clock, and label them."""
    traces = []
    for trace in reading.traces:
        if len(trace.values) == 0:
            reading.of(trace.run, trace.name, "holds no value; left out")
        else:
            traces.append(trace)
    if not traces:
        raise reading.error("", "holds no samples; expected at least one channel with values")
    if len(traces) > MAX_COLUMNS:
        raise reading.error("", f"holds {len(traces)} channels; at most {MAX_COLUMNS} are read")
    _compare_units(traces, reading)

    runs: dict[str, dict[str, xr.Dataset]] = {}
    run_attrs: dict[str, dict[str, str]] = {}
    names: dict[str, str] = {}
    for trace in traces:
        if trace.run not in names:
            names[trace.run] = _fit(trace.run or "run", names.values())
            run_attrs[names[trace.run]] = {"long_name": trace.run, **reading.run_attrs.get(trace.run, {})}
    for run, node in names.items():
        sensors: dict[str, xr.Dataset] = {}
        for group in _by_clock([trace for trace in traces if trace.run == run]):
            sensors[_fit(group[0].name or "sensor", sensors)] = _sensor(group, reading)
        runs[node] = sensors
    record = {
        "file": reading.name,
        "format": reading.format,
        "bytes": reading.size,
        "sha256": reading.sha256,
        "options": reading.asked,
        "header": reading.told,
    }
    return Recording.from_runs(
        runs, synthetic=reading.synthetic, source=record, warnings=reading.sentences(), run_attrs=run_attrs
    )


def _by_clock(traces: list[Trace]) -> list[list[Trace]]:
    """Traces sampled at the same instants, in the order in which their first one appears."""
    groups: dict[tuple[int, bytes, str], list[list[Trace]]] = {}
    ordered: list[list[Trace]] = []
    for trace in traces:
        axis = trace.axis
        same = groups.setdefault((len(axis), axis[[0, -1]].tobytes(), trace.axis_unit), [])
        for group in same:
            if group[0].axis is axis or np.array_equal(group[0].axis, axis, equal_nan=True):
                break
        else:
            group = []
            same.append(group)
            ordered.append(group)
        group.append(trace)
    return ordered


def _sensor(group: list[Trace], reading: Reading) -> xr.Dataset:
    first, axis = group[0], reading.axis
    where = f"run {first.run!r}, channel {first.name!r}"
    if len(group) > 1:
        where += f" (and {len(group) - 1} sampled with it)"
    bad = np.flatnonzero(~np.isfinite(first.axis))
    if len(bad):
        raise reading.error(first.place(int(bad[0])), f"{where}: the {axis} is not a finite number")

    def note(sentence: str) -> None:
        for trace in group:
            reading.of(trace.run, trace.name, sentence)

    attrs = _clock(first, where, reading, note) if axis == "time" else {}
    if axis == "time" and len(first.values) < SHORT and any(trace.name != EVENTS for trace in group):
        note(f"only {len(first.values)} samples; too short to identify anything from")
    variables: dict[str, Any] = {}
    for trace in group:
        total, start, longest = missing_runs(trace.values)
        if total:
            at = f"{axis} = {trace.axis[start]:.9g} {trace.axis_unit}".rstrip()
            reading.of(
                trace.run,
                trace.name,
                f"{total} of {len(trace.values)} values are not finite numbers, "
                f"the longest run of them {longest} from {at} on; they are kept as they are",
            )
        name = _fit(trace.name or "channel", [*variables, axis])
        if name != trace.name and name != _clean(trace.name):
            sentence = f"the name stands there twice, or is the axis; this one is called {name!r}"
            reading.of(trace.run, trace.name, sentence)
        variables[name] = (
            axis,
            trace.values,
            {"long_name": trace.name, "units": trace.unit, "origin": trace.origin, **trace.attrs},
        )
    coordinate = (axis, first.axis, {"long_name": axis, "units": first.axis_unit})
    return xr.Dataset(variables, {axis: coordinate}, attrs)


def _clock(trace: Trace, where: str, reading: Reading, note: Callable[[str], None]) -> dict[str, Any]:
    """Attributes of a sensor's clock; remarks on gaps, changes and rounded times."""
    time = trace.axis
    back = np.flatnonzero(np.diff(time) < 0)
    if len(back):
        i = int(back[0])
        raise reading.error(
            trace.place(i + 1),
            f"{where}: time goes back from {time[i]:.9g} s to {time[i + 1]:.9g} s; if a new run begins here, "
            "name the column that numbers the runs, columns={'run': ...}; if a counter begins anew there, say at which "
            "count, wraps={'time': 2**32}",
        )
    clock = examine(time)
    if clock.repeated:
        note(
            f"{clock.repeated} of {len(time) - 1} time steps are zero; the times were written with too few "
            "digits (export more of them, or give rate=) or samples stand twice"
        )
    if clock.change is not None:
        i, before, after = clock.change
        note(
            f"the sample rate changes from {before:.6g} Hz to {after:.6g} Hz near t = {time[i]:.9g} s "
            f"({trace.place(i)}); split the recording there before using methods that need one rate"
        )
    for i, count in clock.gaps[:3]:
        note(f"gap of {count} samples after t = {time[i]:.9g} s ({trace.place(i)}); nothing was filled in")
    if len(clock.gaps) > 3:
        note(f"{len(clock.gaps) - 3} more gaps")
    kind = "regular" if clock.regular else "irregular"
    return {"rate": clock.rate, "sampling": kind}


def _compare_units(traces: list[Trace], reading: Reading) -> None:
    units: dict[str, dict[str, str]] = {}
    runs: dict[str, set[str]] = {}
    for trace in traces:
        runs.setdefault(trace.name, set()).add(trace.run)
        units.setdefault(trace.name, {}).setdefault(trace.unit, trace.run)
    for name, found in units.items():
        if set(found) == {""}:
            (run,) = runs[name] if len(runs[name]) == 1 else ("",)
            reading.of(run, name, f"the file gives no unit; say it with units={{{name!r}: ...}}")
        if len(found) > 1:
            reading.of(
                "",
                name,
                f"has units {mixed_units(found)}; nothing was converted: take each run's own unit, or read the runs "
                "one by one",
            )


def _clean(name: str) -> str:
    """A name that a tree and a file can hold: no slash, nothing that does not print."""
    text = "".join("_" if c == "/" or not c.isprintable() else c for c in name).strip()
    return "_" if text in ("", ".", "..") else text


def _fit(name: str, taken: Any) -> str:
    """``name`` cleaned, numbered if it is taken."""
    base, held, k = _clean(name), set(taken), 1
    while (found := f"{base} ({k})" if k > 1 else base) in held:
        k += 1
    return found
