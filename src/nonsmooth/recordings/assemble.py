"""From traces to a ``Recording``: one clock per sensor, names that fit a tree, and a remark for all that is odd."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.recordings.reading import MAX_COLUMNS, Reading, Trace
from nonsmooth.recordings.recording import Recording, examine, missing_said, mixed_units
from nonsmooth.results.labels import labelled

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
    held: dict[str, dict[Any, list[Trace]]] = {}  # by run and clock
    for trace in traces:
        held.setdefault(trace.run, {}).setdefault((trace.axis_unit, trace.axis.tobytes()), []).append(trace)
    for run, by_clock in held.items():
        node = _fit(run or "run", runs)
        run_attrs[node] = {"long_name": run, **reading.run_attrs.get(run, {})}
        sensors = runs[node] = {}
        for group in by_clock.values():
            sensors[_fit(group[0].name or "sensor", sensors)] = _sensor(group, reading)
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


def _sensor(group: list[Trace], reading: Reading) -> xr.Dataset:
    first, axis = group[0], reading.axis
    where = f"run {first.run!r}, channel {first.name!r}"
    if len(group) > 1:
        where += f" (and {len(group) - 1} sampled with it)"
    bad = np.flatnonzero(~np.isfinite(first.axis))
    if len(bad):
        raise reading.error(first.place(bad[0]), f"{where}: the {axis} is not a finite number")

    def note(sentence: str) -> None:
        for trace in group:
            reading.of(trace.run, trace.name, sentence)

    attrs = _clock(first, where, reading, note) if axis == "time" else {}
    if axis == "time" and len(first.values) < SHORT and any(trace.name != EVENTS for trace in group):
        note(f"only {len(first.values)} samples; too short to identify anything from")
    variables: dict[str, Any] = {}
    for trace in group:
        if said := missing_said(trace.values, trace.axis, axis, trace.axis_unit):
            reading.of(trace.run, trace.name, f"{said}; they are kept as they are")
        name = _fit(trace.name or "channel", [*variables, axis])
        if name != trace.name and name != _clean(trace.name):
            sentence = f"the name stands there twice, or is the axis; this one is called {name!r}"
            reading.of(trace.run, trace.name, sentence)
        variables[name] = labelled(axis, trace.values, trace.name, trace.unit)
        variables[name][2].update(origin=trace.origin, **trace.attrs)
    return xr.Dataset(variables, {axis: labelled(axis, first.axis, axis, first.axis_unit)}, attrs)


def _clock(trace: Trace, where: str, reading: Reading, note: Callable[[str], None]) -> dict[str, Any]:
    """Attributes of a sensor's clock; remarks on gaps, changes and rounded times."""
    time = trace.axis
    back = np.flatnonzero(np.diff(time) < 0)
    if len(back):
        i = back[0]
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
    return {"rate": clock.rate, "sampling": "regular" if clock.regular else "irregular"}


def _compare_units(traces: list[Trace], reading: Reading) -> None:
    units: dict[str, dict[str, list[str]]] = {}  # by channel, each with its runs
    for trace in traces:
        units.setdefault(trace.name, {}).setdefault(trace.unit, []).append(trace.run)
    for name, found in units.items():
        if len(found) == 1 and "" in found:
            run, *others = dict.fromkeys(found[""])
            said = f"the file gives no unit; say it with units={{{name!r}: ...}}"
            reading.of("" if others else run, name, said)
        if len(found) > 1:
            first = {unit: runs[0] for unit, runs in found.items()}
            reading.of(
                "",
                name,
                f"has units {mixed_units(first)}; nothing was converted: take each run's own unit, or read the runs "
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
