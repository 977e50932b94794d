"""Write a session: the recordings in the formats of a lab, the notebook, and the truth beside the folder.

PASCO Capstone's CSV exports in both locales and its ``.cap`` experiments are written for computed recordings, so that
what reads a lab's files can be tried without a lab. Everything written here is labelled synthetic: in the header of a
``.cap``, behind each run's name in a CSV. ``load_recording`` reads the label.
"""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np
import xarray as xr

from nonsmooth import Recording
from nonsmooth.arrays import FloatArray
from nonsmooth.recordings import SETTINGS
from nonsmooth_savi2007.rig import sensors
from nonsmooth_savi2007.rig.truth import UNITS

if TYPE_CHECKING:
    from nonsmooth_savi2007.rig.virtual_rig import VirtualRig

RECORD = np.dtype([("valid", "<u4"), ("value", "<f8")])  # of a member of a ``.cap``
_PAGE = 256  # records; Capstone's members are longer than what was measured
_SYNTHETIC = "synthetic"  # the label that the reader of either format looks for


def write_capstone_csv(
    recording: Recording,
    path: str | os.PathLike[str],
    *,
    decimal: str = ".",
    digits: int = 8,
    byte_order_mark: bool = True,
) -> Path:
    """Write a recording as Capstone's CSV export, labelled synthetic.

    One header row, the runs side by side, one time column per run. Sensors of other rates leave blanks, and so does a
    value that is not a finite number. A reader gets back the digits written, not the doubles.

    Parameters
    ----------
    recording : Recording
        Over ``time``.
    path : path
        Replaced if it is there.
    decimal : {".", ","}
        ``","`` writes the other locale: ``;`` between fields.
    digits : int
        Decimals of every number (Capstone writes 8).
    byte_order_mark : bool
        Begin with the mark of UTF-8.

    Raises
    ------
    ValueError
        If the recording has another axis than time, ``decimal`` or ``digits`` is neither of those above, or two
        samples of a channel fall on one printed time.
    """
    if decimal not in (".", ","):
        raise ValueError(f"decimal must be '.' or ',', got {decimal!r}")
    if not 1 <= digits <= 17:
        raise ValueError(f"digits must be 1 to 17, got {digits!r}")
    import pandas as pd

    tables = []
    for run in recording.runs:
        label = f"{recording.tree[run].attrs.get('long_name') or run} [{_SYNTHETIC}]"
        columns = []
        for ds in _sensors(recording, run):
            times = ds["time"].values.round(digits) + 0.0
            if len(np.unique(times)) < len(times):
                raise ValueError(f"run {run!r}: {digits} decimals are too few for its times; samples would coincide")
            for name, array in ds.data_vars.items():
                unit = f" ({array.attrs['units']})" if array.attrs.get("units") else ""
                values = np.where(np.isfinite(array.values), array.values, np.nan)
                values[np.abs(values) < 0.5 * 0.1**digits] = 0.0  # no "-0.00"
                columns.append(pd.Series(values, times, name=f"{array.attrs.get('long_name', name)}{unit} {label}"))
        tables.append(pd.concat(columns, axis=1).sort_index().rename_axis(f"Time (s) {label}").reset_index())
    text = pd.concat(tables, axis=1).to_csv(
        sep=";" if decimal == "," else ",",
        decimal=decimal,
        float_format=f"%.{digits}f",
        index=False,
        lineterminator="\r\n",
    )
    return _put(Path(path), text.encode("utf-8-sig" if byte_order_mark else "utf-8"))


def write_cap(recording: Recording, path: str | os.PathLike[str], *, sensors: Sequence[Mapping[str, str]] = ()) -> Path:
    """Write a recording as a Capstone experiment, labelled synthetic; values and times come back bit for bit.

    Runs are numbered from 1 in the recording's order: the format has no names for them. An even clock is written as
    start and interval where these give back every time exactly, else as a member of its own.

    Parameters
    ----------
    recording : Recording
        Over ``time``.
    path : path
        Replaced if it is there.
    sensors : sequence of mappings
        Attributes of ``Sensor`` elements, such as ``{"Name": "Rotary Motion Sensor", "SamplePeriod": "0.01"}``.

    Raises
    ------
    ValueError
        If the recording has another axis than time.
    """
    members: dict[str, bytes] = {}
    sources: dict[tuple[str, str, str], list[str]] = {}
    for group, run in enumerate(recording.runs, 1):
        for ds in _sensors(recording, run):
            time = ds["time"].values.astype(np.float64)
            clock = _even(time)
            if clock is None:
                times = f"data/{len(members) + 1:08d}.tmp"
                members[times] = _records(time)
                independent = f'FileName="{times}"'
            else:
                independent = f'IntervalCacheStartValue="{clock[0]!r}" IntervalCacheInterval="{clock[1]!r}"'
            for name, array in ds.data_vars.items():
                values = f"data/{len(members) + 1:08d}.tmp"
                members[values] = _records(array.values.astype(np.float64))
                port = str(array.attrs.get("port", ""))
                measurement = str(array.attrs.get("measurement", array.attrs.get("long_name", name)))
                key = (measurement, port, str(array.attrs.get("units", "")))
                sources.setdefault(key, []).append(
                    f'      <DataSet DataGroupNumber="{group}">\n        <DataSegmentElement>\n'
                    f'          <DependentStorageElement FileName="{values}" DataCacheDataSize="{array.size}"/>\n'
                    f"          <IndependentStorageElement {independent}/>\n"
                    "        </DataSegmentElement>\n      </DataSet>\n"
                )
    lines = [
        '<?xml version="1.0" encoding="utf-8"?>\n<DSProExperiment>\n',
        f'  <Header Version="1" DecimalSeparator="." Origin="{_SYNTHETIC}: computed by nonsmooth, not measured"/>\n',
        *(f"  <Sensor {_attributes(sensor)}/>\n" for sensor in sensors),
        "  <DataRepository>\n",
    ]
    for (measurement, port, unit), sets in sources.items():
        named = {"MeasurementName": measurement, "ChannelIDName": port, "BaseUnit": unit}
        shown = _attributes({key: value for key, value in named.items() if value})
        lines += [f"    <DataSource {shown}>\n", *sets, "    </DataSource>\n"]
    xml = "".join([*lines, "  </DataRepository>\n</DSProExperiment>\n"])
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        # A fixed date: equal recordings give equal files.
        for name, content in {"main.xml": xml.encode("utf-8"), **members}.items():
            info = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, content)
    return _put(Path(path), packed.getvalue())


def _attributes(given: Mapping[str, str]) -> str:
    return " ".join(f"{key}={quoteattr(str(value))}" for key, value in given.items())


def _sensors(recording: Recording, run: str) -> Iterator[xr.Dataset]:
    for sensor, leaf in recording.tree[run].children.items():
        dataset = leaf.to_dataset()
        if tuple(dataset.dims) != ("time",):
            raise ValueError(f"run {run!r}, sensor {sensor!r} is over {tuple(dataset.dims)}; only time can be written")
        yield dataset


def _records(values: FloatArray) -> bytes:
    table = np.zeros(-(-max(len(values), 1) // _PAGE) * _PAGE, RECORD)
    table["valid"][: len(values)] = 1
    table["value"][: len(values)] = values
    return table.tobytes()


def _even(time: FloatArray) -> tuple[float, float] | None:
    """Start and interval that give back every time exactly, as the reader computes them."""
    if len(time) < 2:
        return (float(time[0]), 1.0) if len(time) else (0.0, 1.0)
    start, mean = float(time[0]), float((time[-1] - time[0]) / (len(time) - 1))
    index = np.arange(len(time))
    for interval in (mean, float(time[1] - time[0]), float(f"{mean:.6g}"), float(f"{mean:.12g}")):
        if interval > 0 and np.array_equal(start + interval * index, time):
            return start, interval
    return None


def _put(target: Path, content: bytes) -> Path:
    fresh = target.with_name(f".{target.name}.part")  # what stands there stays until all is written
    try:
        fresh.write_bytes(content)
        return fresh.replace(target)
    finally:
        fresh.unlink(missing_ok=True)


_toml = json.dumps  # of strings and numbers, which TOML writes alike
_CAP = ("impulse",)  # the instrument's own format
_COMMA = ("voltage",)  # an export under the other locale


def write_session(
    rig: VirtualRig,
    folder: str | os.PathLike[str],
    made: Mapping[str, Recording],
    truth: str | os.PathLike[str] | None = None,
    *,
    title: str,
) -> Path:
    """Write recordings by procedure; see ``VirtualRig.write_session``.

    Raises
    ------
    ValueError
        If there are none, or the truth would come to lie in the folder.
    """
    place = Path(folder)
    beside = truth_path(place, truth)
    if place.resolve() in beside.resolve().parents:
        raise ValueError(f"truth = {beside}: must not lie in the session's folder; who identifies must not see it")
    if not made:
        raise ValueError("a session needs at least one procedure")
    place.mkdir(parents=True, exist_ok=True)
    lines = ["[session]", f"title = {_toml(title)}", "synthetic = true", "", *_apparatus(rig)]
    for procedure, recording in made.items():
        name = f"{procedure}.cap" if procedure in _CAP else f"{procedure}.csv"
        if procedure in _CAP:
            write_cap(recording, place / name, sensors=[_ROTARY])
        else:
            write_capstone_csv(recording, place / name, decimal="," if procedure in _COMMA else ".")
        lines += ["", "[[recording]]", f"file = {_toml(name)}", f"procedure = {_toml(procedure)}", "runs = ["]
        lines += [f"    {_run(run, recording.tree[run].attrs)}," for run in recording.runs]
        lines.append("]")
    (place / "session.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    beside.parent.mkdir(parents=True, exist_ok=True)
    on = ", ".join(rig.on) or "none"
    lines = [f"# What the virtual rig with seed {rig.seed} really is. Features that are on: {on}.", "[truth]"]
    lines += [f"{name} = {value!r}    # {UNITS[name]}".rstrip(" #") for name, value in rig.truth.items()]
    beside.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return place


def truth_path(folder: Path, truth: str | os.PathLike[str] | None = None) -> Path:
    """Path of the file with the truth of the rig recorded into ``folder``: ``truth``, or a file beside the folder."""
    return folder.with_name(f"{folder.name}.truth.toml") if truth is None else Path(truth)


_ROTARY = {
    "Name": "Rotary Motion Sensor",
    "DistanceForFullRotation": str(sensors.DISTANCE_PER_TURN),
    "SamplePeriod": str(1 / sensors.RATE),
}


def _apparatus(rig: VirtualRig) -> list[str]:
    """Apparatus as an experimenter knows it: makers' data, and what was weighed and measured with a ruler."""
    rng = rig.generator("springs", 9999)
    spread = 1.0 if rig.noise else 0.0
    weighed = round(rig.truth["m"] + spread * 1e-3 * rng.standard_normal(), 4)
    known = [
        "[apparatus]",
        f"distance_per_turn = {sensors.DISTANCE_PER_TURN}    # m, wheel of the rotary sensor",
        f"counts_per_turn = {sensors.COUNTS_PER_TURN}",
        f"sample_rate = {sensors.RATE}    # Hz",
        f"turn_resolution = {sensors.TURN_STEP}    # s, photogate at the crank",
        "force_gain_limit = 0.01    # +-1 %, uniform",
        f"force_resolution = {sensors.FORCE_STEP}    # N",
        f"force_range = {sensors.FORCE_RANGE}    # N",
        f"mass = {{ value = {weighed}, uncertainty = 0.001 }}    # kg, weighed",
        "test_mass = { value = 1.33, uncertainty = 0.001 }    # kg, weighed",
    ]
    length = rig.truth["string_length"]
    if length != float("inf"):
        ruler = round(max(length + spread * 5e-3 * rng.standard_normal(), 0.01), 3)
        known.append(f"string_length = {{ value = {ruler}, uncertainty = 0.005 }}    # m, by ruler")
    return known


def _run(name: str, attrs: Mapping[Any, Any]) -> str:
    stated = {"run": name, **{key: attrs[key] for key in SETTINGS if key in attrs}}
    return "{ " + ", ".join(f"{key} = {_toml(value)}" for key, value in stated.items()) + " }"
