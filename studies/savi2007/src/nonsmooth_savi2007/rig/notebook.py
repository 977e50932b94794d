"""Write a session: the recordings in the formats of a lab, the notebook, and the truth beside the folder."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nonsmooth import Recording
from nonsmooth.recordings import SETTINGS
from nonsmooth_savi2007.rig import sensors
from nonsmooth_savi2007.rig.truth import UNITS
from nonsmooth_savi2007.rig.writers import write_cap, write_capstone_csv

if TYPE_CHECKING:
    from nonsmooth_savi2007.rig.virtual_rig import VirtualRig

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
