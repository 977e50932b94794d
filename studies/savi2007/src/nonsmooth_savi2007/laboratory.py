"""The experimental side: one virtual rig with the paper's parameters, its sessions, and what is identified from them.

The rig writes session folders as a lab would, everything labelled synthetic; its truth goes into a file beside them.
Identification and comparison read the folders only.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth import ParameterSet, Recording, __version__, compare
from nonsmooth.identification import Finding
from nonsmooth.models import discontinuous_support
from nonsmooth.recordings import Session, load_session
from nonsmooth.recordings.signals.displacement import found_resolution
from nonsmooth_savi2007.comparison import GapReference, gap_offset, gap_reference, session_measurement
from nonsmooth_savi2007.identification.chain import identify
from nonsmooth_savi2007.rig import IDENTIFICATION, VirtualRig
from nonsmooth_savi2007.rig.notebook import write_session

SEED = 0  # of the rig's noise; its parameters are the published ones
TRUTH = "truth.toml"

#: Shorter procedures for a quick run: fewer taps, frequency steps, drops and records with contact.
_FEWER = {
    "impulse": {"velocities": (0.5, -0.35, 0.2)},
    "response": {"voltages": (3.9, 4.2, 4.4, 4.6, 4.8, 5.1, 5.6)},
    "drop": {"n": 3, "duration": 12.0},
    "contact": {"regimes": ((11.15, 0.039), (9.88, 0.027), (6.0, 0.0165)), "duration": 9.0},
}


class Laboratory:
    """A virtual rig and who measures with it.

    Parameters
    ----------
    folder : path
        Holds one session folder for each figure (``fig09``, ...), the one that identification reads
        (``identification``), and ``truth.toml``.
    quick : bool
        Shorter records and fewer steps.
    procedures : collection of str, optional
        Those that are recorded for identification; all where not given.
    """

    def __init__(self, folder: Path, quick: bool = False, procedures: Collection[str] = IDENTIFICATION) -> None:
        self.folder, self.quick, self.procedures = Path(folder), quick, procedures
        self.folder.mkdir(parents=True, exist_ok=True)
        self._references: dict[Path, GapReference] = {}

    @cached_property
    def rig(self) -> VirtualRig:
        """The rig of Table 1, with more physics than the model: friction, strings, an uneven motor, sensors."""
        return VirtualRig.published(SEED)

    @cached_property
    def identified(self) -> ParameterSet:
        """The parameters, from the folder ``identification`` alone."""
        return identify(self._identification)

    @cached_property
    def session(self) -> Session:
        """The session that identification reads."""
        return load_session(self._identification)

    @cached_property
    def _identification(self) -> Path:
        options: dict[str, Any] = _FEWER if self.quick else {}
        names = [one for one in IDENTIFICATION if one in self.procedures and not (self.quick and one == "grazing")]
        return self._write("identification", {name: self.rig.record(name, **options.get(name, {})) for name in names})

    def _write(self, name: str, made: Mapping[str, Recording]) -> Path:
        title = f"virtual rig with the published parameters, {name}"
        return write_session(self.rig, self.folder / name, made, self.folder / TRUTH, title=title)

    def sensors(self) -> xr.Dataset:
        """Sensors as the files of the session describe them: rate, steps, ranges used."""

        def channels(procedure: str, name: str) -> list[xr.DataArray]:
            return [one.recording.channel(name, one.run) for one in self.session.recordings(procedure)]

        angle, force = (channels("springs", name)[0] for name in ("Angle", "Force"))
        volts = [one.settings["voltage"] for one in self.session.recordings("voltage")]
        pushed, taps = channels("support", "Force"), channels("impulse", "Angle")
        turning = max(np.abs(np.diff(tap.values) / np.diff(tap["time"].values)).max() for tap in taps)
        values = {
            "rate": (1 / np.median(np.diff(angle["time"].values)), "Hz", "sample rate"),
            "angle_step": (np.degrees(found_resolution(angle)), "deg", "step of the rotary sensor"),
            "force_step": (found_resolution(force), "N", "step of the force sensor"),
            "force_used": (max(np.abs(one.values).max() for one in pushed), "N", "largest force recorded"),
            "turning": (turning / (2 * np.pi), "1/s", "fastest turning of the rotary sensor after a tap"),
            "volts_low": (min(volts), "V", "lowest motor voltage"),
            "volts_high": (max(volts), "V", "highest"),
        }
        columns = {
            name: ((), value, {"units": unit, "long_name": text}) for name, (value, unit, text) in values.items()
        }
        return as_result(xr.Dataset(columns), "what the files say of the sensors")

    def record(self, name: str, made: Mapping[str, Recording]) -> Session:
        """Write recordings, by procedure, into the session folder ``name`` and read it."""
        return load_session(self._write(name, made))

    def measured(self, session: Session, procedure: str, runs: str | None = None) -> tuple[xr.Dataset, dict[str, Any]]:
        """Arguments of ``compare``: a measurement, and the settings of the model that belong to it."""
        if session.folder not in self._references:  # once for all runs of a session: its decays are fitted for it
            offset = gap_offset(self.identified, self.session)
            self._references[session.folder] = gap_reference(session, offset=offset)
        reference = self._references[session.folder]
        return session_measurement(session, procedure, runs, k=self.identified["k"], reference=reference)

    def compare(self, measured: xr.Dataset, settings: Mapping[str, Any], **options: Any) -> xr.Dataset:
        """The measurement over the model with the identified parameters."""
        return compare(
            measured, discontinuous_support(), parameters=self.identified, settings=settings, draws=0, **options
        )


def as_result(dataset: xr.Dataset, what: str, verb: str = "rig", *, synthetic: bool = True) -> xr.Dataset:
    """A dataset that was put together here, with the record that ``nonsmooth.load`` asks for."""
    record = {"version": __version__, "verb": verb, "what": what, "synthetic": synthetic}
    return dataset.assign_attrs({"nonsmooth": json.dumps(record)} | ({"synthetic": "yes"} if synthetic else {}))


def the_finding(identified: ParameterSet, name: str) -> Finding:
    """The finding of that name; ValueError where the session did not tell it."""
    for finding in identified.findings:
        if finding.name == name:
            return finding
    known = ", ".join(finding.name for finding in identified.findings)
    raise ValueError(f"identification made no finding {name!r}; it made: {known}")


def kept(finding: Finding) -> xr.Dataset:
    """The finding's data for its picture, with the finding itself in the attribute ``finding``."""
    data = xr.Dataset(attrs={"synthetic": "yes"}) if finding.data is None else finding.data.copy()
    result = as_result(data, finding.name, "identify", synthetic=data.attrs.get("synthetic") == "yes")
    return result.assign_attrs(finding=json.dumps(finding.to_record(), ensure_ascii=False, default=float))


def found_in(data: xr.Dataset) -> Finding:
    """Read back what :func:`kept` put into the dataset."""
    return Finding.from_record(json.loads(data.attrs["finding"]))
