"""A recording: the runs of an experiment, each with its sensors, each sensor with its own clock, and how it samples.

The tree is ``/run/sensor``; a sensor is a Dataset whose channels share one axis, mostly ``time`` in seconds. Channels
of one run that were sampled at the same instants form one sensor, named after the first of them.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from nonsmooth.arrays import BoolArray, FloatArray
from nonsmooth.errors import Answering
from nonsmooth.results.provenance import (
    ATTRIBUTE,
    COORDINATE,
    options_as_data,
    package_version,
    read_provenance,
    with_short_record,
)
from nonsmooth.results.representation import cut, html_table

_BLOCK = 16  # steps per block; means over a block see a change of rate through jitter and rounding of the times
_CHANGE = 0.05  # of the rate, between blocks
_GAP = 1.5  # steps; a longer one is a gap


class Sampling(NamedTuple):
    """``rate`` in Hz (NaN for fewer than two distinct times); ``gaps`` as (index before, samples missing)."""

    rate: float
    regular: bool
    repeated: int
    gaps: tuple[tuple[int, int], ...]
    change: tuple[int, float, float] | None  # index, rate before, rate after


def examine(time: FloatArray) -> Sampling:
    """Judge times that do not decrease, in seconds."""
    steps = np.diff(time)
    repeated = int(np.count_nonzero(steps == 0))
    if len(steps) == 0 or time[-1] == time[0]:
        return Sampling(np.nan, True, repeated, (), None)
    change = _change_of_rate(steps)
    typical = np.median(steps)
    if typical == 0 or repeated > len(steps) // 10:
        # Rounded times: only their mean says anything.
        return Sampling(len(steps) / (time[-1] - time[0]), False, repeated, (), change)
    # The lengths of a rate's own steps, not its gaps; a step within rounding of typical counts once.
    counts = np.maximum(np.rint(np.minimum(steps / typical, 1e15)), 1)
    wide = np.flatnonzero(steps > _GAP * typical)
    if change is None and len(wide) <= max(3, len(steps) // 20):
        gaps = tuple((int(i), int(counts[i]) - 1) for i in wide if counts[i] > 1)
        rate = counts.sum() / (time[-1] - time[0])
    else:
        gaps, rate = (), 1.0 / typical
    expected = time[0] + np.concatenate([[0.0], np.cumsum(counts if gaps else np.ones(len(steps)))]) / rate
    regular = change is None and not gaps and (np.max(np.abs(time - expected)) * rate < 0.5)
    return Sampling(rate, regular, repeated, gaps, change)


def missing_said(values: FloatArray, along: FloatArray, axis: str = "t", unit: str = "s") -> str:
    """Sentence on the values that are not finite, and where the longest run of them begins; empty where all are."""
    bad = ~np.isfinite(values)
    if not bad.any():
        return ""
    start, end = max(runs_of(bad), key=lambda run: run[1] - run[0])
    at = f"{axis} = {along[start]:.9g} {unit}".rstrip()
    total = f"{np.count_nonzero(bad)} of {len(values)} values are not finite numbers"
    return f"{total}, the longest run of them {end - start} from {at} on"


def runs_of(mask: BoolArray) -> list[tuple[int, int]]:
    """First place of each run of True, and the place behind its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def _change_of_rate(steps: FloatArray) -> tuple[int, float, float] | None:
    """The first place where the mean step of whole blocks leaves that of the blocks before it, and stays away."""
    block = _BLOCK if len(steps) >= 4 * _BLOCK else 4
    threshold = _CHANGE if block == _BLOCK else 5 * _CHANGE
    count = len(steps) // block
    if count < 2:
        return None
    blocks = steps[: count * block].reshape(count, block)
    # The median of a block passes over a gap; its mean, clipped, passes over rounding of the times.
    middle = np.median(blocks, axis=1, keepdims=True)
    means = np.where(middle > 0, np.minimum(blocks, 2 * middle), blocks).mean(axis=1)
    positive = np.maximum(means, np.finfo(float).tiny)
    reference = np.median(positive[: max(1, min(4, count // 2))])
    away = np.abs(positive / reference - 1) > threshold
    # One block is jitter, a gap, or the change itself inside a block: two in a row, or all of the rest, are a change.
    for i in np.flatnonzero(away):
        rest = away[i:]
        if len(rest) >= 2 and rest[:2].all():
            after = np.median(positive[i + 1 : i + 5])
            if abs(after / reference - 1) > threshold:
                # The block only says about where; the first of its steps that is nearer to the new one says it.
                near = steps[int(i) * block : (int(i) + 2) * block]
                offset = int(np.argmax(np.abs(near - after) < np.abs(near - reference)))
                return int(i) * block + offset, 1.0 / reference, 1.0 / after
    return None


class RecordingWarning(UserWarning):
    """Something in a recording that its user should know: it names the run and the channel."""


@dataclass(frozen=True, eq=False)
class Recording(Answering):
    """Recorded signals by run and sensor, with units, rates and where each channel came from.

    Read one with :func:`nonsmooth.load_recording`, or build one with :meth:`from_runs`.

    Attributes
    ----------
    tree : xarray.DataTree
        ``/run/sensor``: ``tree["Run #1/Angle"]`` holds the channels sampled together with ``Angle``, over their own
        ``time``. Names hold no ``/``; the name as it stands in the file is the attribute ``long_name``.
    source : mapping
        ``file``, ``format``, ``bytes``, ``sha256``, ``options`` and ``header`` (what the file says of itself).
    warnings : tuple of str
        All that was noticed while reading, one sentence each.
    synthetic : bool
        True if the file says that it was computed, not measured. False if it says nothing.
    """

    tree: xr.DataTree
    source: Mapping[str, Any]
    warnings: tuple[str, ...] = ()
    synthetic: bool = False

    @classmethod
    def from_runs(
        cls,
        runs: Mapping[str, Mapping[str, xr.Dataset]],
        *,
        synthetic: bool,
        source: Mapping[str, Any] | None = None,
        warnings: tuple[str, ...] = (),
        run_attrs: Mapping[str, Mapping[str, str]] | None = None,
    ) -> Recording:
        """Build a recording from Datasets, ``{run: {sensor: dataset}}``; each Dataset has one dim, its axis.

        Raises
        ------
        ValueError
            If a Dataset has not exactly one dim with a coordinate, or a name is empty, twice there, or holds ``/``.
        """
        nodes = {"/": xr.Dataset()}
        for run, sensors in runs.items():
            _check_name("run", run)
            nodes[f"/{run}"] = xr.Dataset(attrs=dict((run_attrs or {}).get(run, {})))
            for sensor, dataset in sensors.items():
                _check_name("sensor", sensor)
                if len(dataset.dims) != 1 or set(dataset.dims) - set(dataset.coords):
                    raise ValueError(
                        f"sensor {sensor!r} of run {run!r} must have one dim with its coordinate (time), "
                        f"got dims {tuple(dataset.dims)} and coordinates {tuple(dataset.coords)}"
                    )
                nodes[f"/{run}/{sensor}"] = dataset
        tree = xr.DataTree.from_dict(nodes)
        record = dict(source or {"file": "", "format": "built in memory"})
        told = {
            "version": package_version(),
            "verb": "load_recording",
            "source": options_as_data(record),
            "warnings": list(warnings),
            "synthetic": synthetic,
        }
        text = json.dumps(told, ensure_ascii=False, allow_nan=False)
        tree.attrs = {ATTRIBUTE: text, "synthetic": "yes" if synthetic else "no"}
        return cls(tree, record, tuple(warnings), synthetic)

    @property
    def runs(self) -> tuple[str, ...]:
        """The names of the runs, in the file's order."""
        return tuple(str(name) for name in self.tree.children)

    @property
    def channels(self) -> tuple[str, ...]:
        """The names of the channels over all runs, each once, in the order in which they appear."""
        return tuple(dict.fromkeys(name for _, _, name, _ in self._all()))

    @property
    def units(self) -> dict[str, str]:
        """The unit of each channel ("" where unknown).

        Where runs differ in it the entry begins with ``mixed`` and says which: take each from its own array then.
        """
        found: dict[str, dict[str, str]] = {}
        for run, _, name, array in self._all():
            found.setdefault(name, {}).setdefault(str(array.attrs["units"]), run)
        return {name: next(iter(u)) if len(u) == 1 else mixed_units(u) for name, u in found.items()}

    @property
    def rates(self) -> dict[str, float]:
        """The mean sample rate of each sensor in Hz, by ``run/sensor``; NaN where there is none."""
        return {f"{run}/{sensor}": float(ds.attrs.get("rate", np.nan)) for run, sensor, ds in self._sensors()}

    def _elsewhere(self, name: str) -> str:
        return f": recording.channel({name!r}) is that channel" if name in self.channels else ""

    def channel(self, name: str, run: str | None = None) -> xr.DataArray:
        """One channel of one run, over its own axis.

        Parameters
        ----------
        name : str
            The channel's name, as in :attr:`channels` or as it stands in the file, or the measured quantity where
            only one channel of the run measures it (``"Temperature"`` for ``"Temperature, Ch P3"``).
        run : str, optional
            Needed where the recording has several runs.

        Raises
        ------
        ValueError
            If there is no such run or channel, or the name fits several; the message lists what there is.
        """
        if run is None:
            if len(self.runs) != 1:
                raise ValueError(f"this recording has {len(self.runs)} runs, say which: {', '.join(self.runs)}")
            run = self.runs[0]
        if run not in self.runs:
            raise ValueError(f"no run {run!r}; there are: {', '.join(self.runs)}")
        leaves = [leaf.to_dataset() for leaf in self.tree.children[run].children.values()]
        here = [(str(channel), array) for leaf in leaves for channel, array in leaf.data_vars.items()]
        for attribute in (None, "long_name", "measurement"):
            fits = [a for c, a in here if name == (c if attribute is None else a.attrs.get(attribute))]
            if len(fits) == 1:
                return fits[0]
            if fits:
                raise ValueError(f"{name!r} fits {len(fits)} channels of run {run!r}: {', '.join(c for c, _ in here)}")
        raise ValueError(f"run {run!r} has no channel {name!r}; it has: {', '.join(c for c, _ in here)}")

    def to_dataset(self) -> xr.Dataset:
        """The whole recording as one flat Dataset that ``nonsmooth.save`` takes; :meth:`from_dataset` takes it back.

        Sensor ``i`` has the dim ``sample_i``; its axis is ``axis_i``, its channels are ``channel_i_k``, and their
        names, runs and sensors stand in their attributes.
        """
        variables: dict[str, Any] = {}
        coords: dict[str, Any] = {}
        for i, (run, sensor, ds) in enumerate(self._sensors(), 1):
            dim = f"sample_{i}"
            (axis,) = ds.dims
            here = {"run": run, "sensor": sensor}
            sensor_attrs = {f"sensor_{key}": value for key, value in ds.attrs.items()}
            coords[f"axis_{i}"] = (dim, ds[axis].values, {**ds[axis].attrs, **here, **sensor_attrs, "axis": str(axis)})
            for k, (name, array) in enumerate(ds.data_vars.items(), 1):
                variables[f"channel_{i}_{k}"] = (dim, array.values, {**array.attrs, **here, "channel": str(name)})
        runs = {run: dict(self.tree[run].attrs) for run in self.runs}
        attrs = {**self.tree.attrs, "run_attributes": json.dumps(runs, ensure_ascii=False)}
        return with_short_record(xr.Dataset(variables, coords, attrs))

    @classmethod
    def from_dataset(cls, dataset: xr.Dataset) -> Recording:
        """The recording that :meth:`to_dataset` made the Dataset from; ValueError for any other Dataset."""
        if "run_attributes" not in dataset.attrs or ATTRIBUTE not in dataset.attrs:
            raise ValueError("this Dataset was not made by Recording.to_dataset")
        run_attrs = json.loads(dataset.attrs["run_attributes"])
        runs: dict[str, dict[str, xr.Dataset]] = {run: {} for run in run_attrs}
        for axis_name, axis in dataset.coords.items():
            if axis_name == COORDINATE:
                continue
            own = dict(axis.attrs)
            run, sensor, dim = own.pop("run"), own.pop("sensor"), own.pop("axis")
            attrs = {key.removeprefix("sensor_"): own.pop(key) for key in list(own) if key.startswith("sensor_")}
            prefix = f"channel_{str(axis_name).removeprefix('axis_')}_"
            data = {}
            for name, array in dataset.data_vars.items():
                if str(name).startswith(prefix):
                    kept = {key: value for key, value in array.attrs.items() if key not in ("run", "sensor", "channel")}
                    data[array.attrs["channel"]] = (dim, array.values, kept)
            runs[run][sensor] = xr.Dataset(data, {dim: (dim, axis.values, own)}, attrs)
        record = read_provenance(dataset)
        return cls.from_runs(
            runs,
            synthetic=record["synthetic"],
            source=record["source"],
            warnings=tuple(record["warnings"]),
            run_attrs=run_attrs,
        )

    def __repr__(self) -> str:
        rows = self._rows()
        lines = [
            f"  {run}: {n} samples{f' at {clock}' if clock else ''}: {cut(names)}" for run, n, clock, names in rows[:20]
        ]
        if len(rows) > 20:
            lines.append(f"  and {len(rows) - 20} more sensors")
        if self.warnings:
            lines.append(f"  {len(self.warnings)} warnings: see .warnings")
        return "\n".join([self._title(), *lines])

    def _repr_html_(self) -> str:
        header = ("run", "samples", "rate", "channels")
        return html_table(self._title(), self._rows(), header=header, details=self.warnings, of="warnings")

    def _title(self) -> str:
        name = self.source.get("file") or "in memory"
        return f"Recording of {name} ({self.source.get('format')}{', synthetic' if self.synthetic else ''})"

    def _rows(self) -> list[tuple[str, str, str, str]]:
        """Run, number of samples, rate and channels of each sensor."""
        rows = []
        for run, _, ds in self._sensors():
            (axis,) = ds.dims
            rate = float(ds.attrs.get("rate", np.nan))
            clock = f"{rate:.6g} Hz" if np.isfinite(rate) else ""
            names = ", ".join(f"{c} [{a.attrs['units'] or '?'}]" for c, a in ds.data_vars.items())
            rows.append((run, str(ds.sizes[axis]), clock, names))
        return rows

    def _sensors(self) -> Iterator[tuple[str, str, xr.Dataset]]:
        for run, node in self.tree.children.items():
            for sensor, leaf in node.children.items():
                yield str(run), str(sensor), leaf.to_dataset()

    def _all(self) -> Iterator[tuple[str, str, str, xr.DataArray]]:
        for run, sensor, dataset in self._sensors():
            for name, array in dataset.data_vars.items():
                yield run, sensor, str(name), array


def mixed_units(runs_by_unit: Mapping[str, str]) -> str:
    """Units that differ between runs, each with the first run that has it."""
    return "mixed: " + ", ".join(f"{unit or 'none'} ({run})" for unit, run in runs_by_unit.items())


def _check_name(kind: str, name: str) -> None:
    if not name.strip() or "/" in name or name in (".", ".."):
        raise ValueError(f"{name!r} cannot be the name of a {kind}: it must not be empty, '.' or '..', nor hold '/'")
