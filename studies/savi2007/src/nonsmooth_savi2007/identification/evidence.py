"""Input of ``identify``: the runs of each procedure as plain arrays in SI units, and the notebook's apparatus.

Beside it the data of the findings' pictures: each variable in the unit that it has wherever it is shown.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth import Recording
from nonsmooth.arrays import FloatArray
from nonsmooth.errors import unknown
from nonsmooth.identification import Estimate
from nonsmooth.recordings import PROCEDURES, SETTINGS, Quantity, Session, load_session
from nonsmooth.recordings.signals.checks import take
from nonsmooth.recordings.signals.displacement import position
from nonsmooth.recordings.signals.phase import DrivePhase, drive_phase
from nonsmooth_savi2007.identification.directions import oriented

#: Channels that a procedure cannot do without.
NEEDS: Mapping[str, tuple[str, ...]] = {
    "springs": ("Angle", "Force"),
    "support": ("Angle", "Force"),
    "impulse": ("Angle",),
    "drop": ("Angle",),
    "response": ("Angle", "Turn"),
    "voltage": ("Turn",),
    "crank": ("Force", "Turn"),
    "grazing": ("Angle", "Turn"),
    "contact": ("Angle", "Turn"),
    "rise": ("Angle", "Turn"),
    "section": ("Angle", "Turn"),
}
_PASSAGES = 3  # of the photogate: fewer give no frequency and no scatter


@dataclass(frozen=True, eq=False)
class Run:
    """One run: settings, position x (m) and force (N) each over its time (s), times of the photogate (s).

    ``x`` is a DataArray that knows its run and channel; ``time`` and ``positions`` are its arrays. ``resolution``:
    length of a count of the rotary sensor (m); ``backwards``: the photogate's count falls.
    """

    procedure: str
    name: str
    settings: Mapping[str, Any]
    resolution: float
    x: Any = None
    force: Any = None
    turns: FloatArray | None = None
    synthetic: bool = False
    backwards: bool = False

    @property
    def time(self) -> FloatArray:
        """Times of the position (s)."""
        return self.x["time"].values

    @property
    def positions(self) -> FloatArray:
        """Position (m), as counted."""
        return self.x.values

    @property
    def passages(self) -> FloatArray:
        """Times at which the photogate saw the crank (s)."""
        if self.turns is None:
            raise ValueError(f"{self.label}: has no channel 'Turn'; record the photogate with it")
        return self.turns

    @cached_property
    def drive(self) -> DrivePhase:
        """The crank's angle over time."""
        return drive_phase(self.passages)

    @property
    def gap(self) -> float:
        """Reading of the support's screw (m)."""
        return self.settings["gap"]

    @property
    def crank(self) -> float:
        """Length of the crank (m)."""
        return self.settings["crank_length"]

    @property
    def mounted(self) -> bool:
        """True where the support was mounted."""
        return "gap" in self.settings

    @property
    def label(self) -> str:
        """``response Run #3``."""
        return f"{self.procedure} {self.name}"


@dataclass(frozen=True, eq=False)
class Evidence:
    """Runs of every procedure, what is known of the apparatus, and what was turned (`oriented`).

    ``resolution`` is the length of a count (m); ``direction`` is -1 where the rotary sensor counts away from the
    support: positions have the other sign then.
    """

    runs: Mapping[str, tuple[Run, ...]]
    apparatus: Mapping[str, Quantity]
    resolution: float
    synthetic: bool
    direction: int
    notes: tuple[str, ...]

    def quantity(self, name: str) -> Quantity:
        """A number from the notebook.

        Raises
        ------
        ValueError
            If the notebook does not state it.
        """
        if name not in self.apparatus:
            raise ValueError(f"the notebook does not state `{name}`, which is needed; write it under [apparatus]")
        return self.apparatus[name]


def gather(
    recordings: Session | str | os.PathLike[str] | Mapping[str, Any],
    *,
    apparatus: Mapping[str, Any] | None = None,
    procedures: Sequence[str] | None = None,
) -> Evidence:
    """Take the channels of all runs out of a session or a mapping of recordings, sensors brought to one direction.

    Parameters
    ----------
    recordings : Session, path, or mapping
        ``{"impulse": recording, "response": [(recording, run, settings), ...]}`` in place of a session; settings may
        also stand in the attributes of a run.
    apparatus : mapping, optional
        What is known, as in a notebook's ``[apparatus]``: numbers, or pairs of value and standard uncertainty.
        Needed with a mapping; with a session it replaces single entries.
    procedures : sequence of str, optional
        Of a session, those whose files are read; all where not given.

    Raises
    ------
    ValueError, TypeError
        A procedure that is not known, a run without a channel or setting that its procedure needs: the message names
        run and channel. Sensors that count one way in some runs and the other way in others, recordings of springs and
        support that look swapped.
    """
    if isinstance(recordings, str | os.PathLike):
        recordings = load_session(recordings)
    taken: dict[str, list[Any]]
    if isinstance(recordings, Session):
        known = dict(recordings.apparatus)
        names = [name for name in recordings.procedures if procedures is None or name in procedures]
        taken = {name: [tuple(row) for row in recordings.recordings(name)] for name in names}
        synthetic = recordings.synthetic
    elif isinstance(recordings, Mapping):
        known, synthetic = {}, False
        taken = {str(name): _rows(str(name), given) for name, given in recordings.items()}
    else:
        raise TypeError(
            "recordings must be a session folder, a Session, or a mapping of procedure to recordings, got "
            f"{type(recordings).__name__}"
        )
    for name, value in (apparatus or {}).items():
        known[name] = value if isinstance(value, Quantity) else Quantity(*np.atleast_1d(value).tolist())
    for name, default in (("counts_per_turn", 1440.0), ("turn_resolution", 1e-4), ("force_gain_limit", 0.01)):
        known.setdefault(name, Quantity(default))
    if "distance_per_turn" not in known:
        raise ValueError("the apparatus must state `distance_per_turn` (m): the car's travel per turn of the wheel")
    travel, counts = known["distance_per_turn"].value, round(known["counts_per_turn"].value)
    runs = {}
    for procedure, rows in taken.items():
        if procedure not in PROCEDURES:
            raise ValueError(unknown(procedure, "a procedure", "the experiment", PROCEDURES.keys()))
        runs[procedure] = _told_apart([_run(procedure, travel, counts, *row) for row in rows], [row[0] for row in rows])
    runs, direction, notes = oriented(runs)
    synthetic = synthetic or any(run.synthetic for rows in runs.values() for run in rows)
    runs |= {procedure: () for procedure in PROCEDURES if procedure not in runs}
    return Evidence(runs, known, abs(travel) / counts, synthetic, direction, notes)


def _rows(procedure: str, given: Any) -> list[Any]:
    rows: list[Any] = []
    for item in [given] if isinstance(given, Recording) else given:
        if isinstance(item, Recording):
            attrs = {run: item.tree[run].attrs for run in item.runs}
            rows += [(item, run, {key: told[key] for key in SETTINGS if key in told}) for run, told in attrs.items()]
        else:
            rows.append(tuple(item))
    if not rows:
        raise ValueError(f"there are no recordings of {procedure!r}; leave the procedure out")
    return rows


def _told_apart(runs: Sequence[Run], recordings: Sequence[Recording]) -> tuple[Run, ...]:
    """The runs; those of one name, as files of separate exports have them, with the number of their recording.

    ValueError: a run is given twice."""
    number = {one: 1 + k for k, one in enumerate(dict.fromkeys(map(id, recordings)))}
    often, found = Counter(run.name for run in runs), {}
    for run, recording in zip(runs, recordings, strict=True):
        key = number[id(recording)], run.name
        if key in found:
            raise ValueError(f"{run.label} is given twice; it would count as two runs")
        found[key] = replace(run, name=f"{run.name} of recording {key[0]}") if often[run.name] > 1 else run
    return tuple(found.values())


def _run(
    procedure: str, travel: float, counts: int, recording: Recording, name: str, settings: Mapping[str, Any]
) -> Run:
    if lacking := [key for key in PROCEDURES[procedure] if key not in settings]:
        raise ValueError(f"{procedure}, run {name!r} must state {', '.join(lacking)} in its settings")

    def has(channel: str) -> bool:
        try:
            recording.channel(channel, name)
        except ValueError:
            return channel in NEEDS[procedure]
        return True

    found: dict[str, Any] = {}
    if has("Angle"):
        found["x"] = position(take(recording, "Angle", name), distance_per_turn=travel, counts_per_turn=counts)
    if has("Force"):
        found["force"] = take(recording, "Force", name, units=("N",))
    if has("Turn"):
        passages = take(recording, "Turn", name, samples=_PASSAGES)
        found["turns"] = passages["time"].values
        found["backwards"] = np.all(np.diff(passages.values) < 0)
    return Run(procedure, name, dict(settings), abs(travel) / counts, synthetic=recording.synthetic, **found)


#: Variables by unit; those that are not here are ratios, counts or logarithms.
_MEASURED = {
    "m": (
        "amplitude",
        "crank",
        "crank_length",
        "displacement",
        "envelope_both",
        "envelope_viscous",
        "fitted",
        "joint_amplitude",
        "peak_height",
        "viscous_amplitude",
        "x",
    ),
    "m s": ("magnitude", "fine_magnitude"),
    "rad/s": ("grazing_high", "grazing_low", "omega", "omega_fine", "setting"),
    "Hz": ("fine_frequency", "grid_peak", "grid_step"),
    "s": ("peak_time",),
    "N": ("force",),
}
_UNITS = {name: unit for unit, names in _MEASURED.items() for name in names}
_WORDS = {"setting": "frequency", "force": "force without the hand's inertia"}


def picture_data(runs: Iterable[Run], over: Mapping[Any, Mapping[str, Any]], **numbers: float | Estimate) -> xr.Dataset:
    """Return variables over dims, and numbers; an estimate stands in its own unit, with its error beside it."""
    data: dict[str, Any] = {}

    def put(name: str, dim: Any, values: Any, unit: str) -> None:
        told = {"units": unit, "long_name": _WORDS.get(name, "")}
        data[name] = dim, values, {key: text for key, text in told.items() if text}

    for dim, columns in over.items():
        for name, values in columns.items():
            put(name, dim, values, _UNITS.get(name.removesuffix("_error"), ""))
    for name, one in numbers.items():
        if isinstance(one, Estimate):
            put(name, (), one.value, one.unit)
            put(f"{name}_error", (), one.uncertainty, one.unit)
        else:
            put(name, (), one, _UNITS.get(name, ""))
    return xr.Dataset(data, attrs={"synthetic": "yes" if any(run.synthetic for run in runs) else "no"})
