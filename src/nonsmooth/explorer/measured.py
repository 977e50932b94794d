"""Computations on recordings, in the worker's process: reading a file, laying it over a motion, fitting a model."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

import nonsmooth as ns
from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.explorer.recorded import Channel, RecordedFile, RecordedStates
from nonsmooth.identification.compare.orbits import fold
from nonsmooth.identification.fit.first_windows import rates
from nonsmooth.recordings.load import parse_recording
from nonsmooth.recordings.reading import Options

if TYPE_CHECKING:
    from nonsmooth.explorer.work import Job

_GRID = 64  # phases per forcing period at which motions are compared
_STRANDS = 60  # forcing periods of a record, and of a motion without a period, that are compared
_FITTED = 1500  # samples that a fit takes


def read(job: Mapping[str, Any]) -> dict[str, Any]:
    """The recording in the bytes of a file, read by the package's own readers; nothing of it is executed."""
    data, name = job["content"], job["name"]
    try:
        recording = parse_recording(data, name)
    except ns.DataFileError as error:
        try:
            recording = parse_recording(data, name, Options(axis="frequency"))
        except (ns.DataFileError, ValueError):
            raise ValueError(f"no recording was found in it. {error}") from None
    axis = next(str(dim) for node in recording.tree.leaves for dim in node.dims)
    runs: dict[str, dict[str, Channel]] = {}
    for run, node in recording.tree.children.items():
        runs[str(run)] = {
            str(channel): Channel(array.attrs["units"], array[array.dims[0]].values, array.values)
            for leaf in node.children.values()
            for channel, array in leaf.to_dataset().data_vars.items()
        }
    return {"recorded": RecordedFile(name, runs, tuple(recording.warnings), recording.synthetic, axis)}


def laid_over(job: Job) -> dict[str, Any]:
    """A recording beside the motion from a start: curve, section points at a phase, and the distance of the two.

    Returns
    -------
    dict
        ``curve``, ``section`` and ``history`` (beside the motion in time), columns by state; ``distance``: ``of`` (a
        state), ``rms`` in its unit, ``part`` of the recorded motion's own size, ``shift`` of the recording's phase,
        ``periods`` compared; ``drive``, the recorded forcing period where turns of the drive were recorded. Without a
        distance ``why`` says why.
    """
    samples, system = job["samples"], job.system
    job.heard(0.0)
    curve = _with_rates(job["text"], samples)
    found: dict[str, Any] = {"curve": curve, "section": {}, "history": {}, "distance": None, "why": ""}
    period = system.period()
    if period is None:
        return {**found, "why": "no distance: nothing forces this model, so that there is no phase to compare at"}
    phase = samples.time / period
    if len(samples.turns) >= 3:
        from nonsmooth.recordings.signals.phase import drive_phase

        drive = drive_phase(samples.turns, span=(float(samples.time[0]), float(samples.time[-1])))
        phase, found["drive"] = drive.phase(samples.time) / (2 * np.pi), drive.period
    states = list(samples.columns)
    try:
        recorded = fold(phase, np.column_stack([curve[state] for state in states]), _GRID)
    except ValueError as error:
        return {**found, "why": f"no distance: {error}"}
    recorded = recorded[np.isfinite(recorded).all(axis=(1, 2))][-_STRANDS:]
    if not len(recorded):
        return {**found, "why": "no distance: every forcing period of the record lacks readings"}
    count = job["period"] or _STRANDS
    run = ns.simulate(
        system, periods=count, transient=job["transient"], start=job["start"], samples=count * _GRID, **job.options
    )
    at = [list(system.states).index(state) for state in states]
    size = recorded.reshape(-1, len(states)).std(axis=0)
    size = np.where(size > 0, size, 1.0)
    motion = run["time"].values / period, run["u"].values[:, at]
    far, shift = strand_distance(recorded, motion, size, closed=bool(job["period"]))
    own = states.index(job["shown"]) if job["shown"] in states else 0
    found["distance"] = {
        "of": states[own],
        "rms": float(far[own]),
        "part": float(far[own] / size[own]),
        "shift": shift,
        "periods": len(recorded),
    }
    known = [state for state in curve if np.isfinite(curve[state]).any()]
    aligned = phase - shift
    points = fold(aligned - job["phase"], np.column_stack([curve[state] for state in known]), 8)[:, 0]
    points = points[np.isfinite(points).all(axis=1)]
    found["section"] = {state: points[:, k] for k, state in enumerate(known)}
    beside = _beside(aligned, np.column_stack([samples.columns[state] for state in states]), motion, size)
    inside = (aligned - beside >= 0) & (aligned - beside <= job["periods"])
    begin = float(run["time"].values[0])
    found["history"] = {"time": begin + (aligned - beside)[inside] * period} | {
        state: curve[state][inside] for state in known
    }
    return found


def _beside(phase: FloatArray, u: FloatArray, motion: tuple[FloatArray, FloatArray], size: FloatArray) -> int:
    """The whole number of periods after which the record is most like a motion that begins at phase 0."""
    turns, model = motion
    a, b = fold(phase, u, _GRID) / size, fold(turns - turns[0], model, _GRID) / size
    length = min(len(a), len(b))
    far = [np.nanmean((a[k : k + length] - b[:length]) ** 2) for k in range(len(a) - length + 1)]
    return int(np.ceil(phase[0] - 1e-9)) + int(np.argmin(far))


def strand_distance(
    recorded: FloatArray, motion: tuple[FloatArray, FloatArray], size: FloatArray, *, closed: bool
) -> tuple[FloatArray, float]:
    r"""Distance of a record from a motion in each state, and the shift of the record's phase at which it is least.

    Both are cut into forcing periods a_k and b_j. With the mean over phase and, for the choice of j and k, over the
    states in units of ``size``,

    .. math:: d^2 = \tfrac12 \Big( \operatorname{mean}_k \min_j \langle (a_k - b_j)^2 \rangle
        + \operatorname{mean}_j \min_k \langle (a_k - b_j)^2 \rangle \Big) .

    Parameters
    ----------
    recorded : array (periods, grid, states)
    motion : (array (N,), array (N, states))
        Phase in forcing periods, and states.
    size : array (states,)
    closed : bool
        Whether the motion ends where it began.

    Returns
    -------
    distance : array (states,)
    shift : float
        In forcing periods, -1/2 to 1/2.
    """
    from scipy.optimize import minimize_scalar

    grid = recorded.shape[1]
    phase, u = motion
    if closed:  # once more, so that every shift finds whole periods
        phase, u = np.concatenate([phase, phase[1:] + phase[-1] - phase[0]]), np.concatenate([u, u[1:]])
    a = recorded / size
    whole = max(round(phase[-1] - phase[0]) // (2 if closed else 1), 1)

    def squares(shift: float) -> FloatArray:
        """Mean squares over phase, (recorded periods, the motion's periods, states)."""
        b = fold(phase - phase[0] + shift, u, grid)[: whole if closed else None] / size
        mixed = np.einsum("kgs,jgs->kjs", a, b) / grid
        return ((a**2).mean(axis=1)[:, None] + (b**2).mean(axis=1) - 2 * mixed).clip(0)

    def nearest(shift: float) -> FloatArray:
        each = squares(shift)
        total = each.sum(axis=-1)
        k, j = np.arange(total.shape[0]), np.arange(total.shape[1])
        of_record, of_motion = each[k, total.argmin(axis=1)], each[total.argmin(axis=0), j]
        return np.asarray(0.5 * (of_record.mean(axis=0) + of_motion.mean(axis=0)))

    coarse = [float(nearest(i / 32).sum()) for i in range(32)]
    best = int(np.argmin(coarse)) / 32
    fine = minimize_scalar(
        lambda s: float(nearest(s).sum()),
        bounds=(best - 1 / 32, best + 1 / 32),
        method="bounded",
        options={"xatol": 1e-6},
    )
    shift = float(fine.x) if fine.fun <= min(coarse) else best
    return np.sqrt(nearest(shift)) * size, (shift + 0.5) % 1.0 - 0.5


def fitted(job: Job) -> dict[str, Any]:
    """The parameters that the recording tells, by ``nonsmooth.fit``, with sentences on what it does not tell."""
    samples: RecordedStates = job["samples"]
    step = -(-len(samples.time) // _FITTED)
    take = slice(None, None, step)
    table = {state: (samples.time[take], column[take]) for state, column in samples.columns.items()}
    unknown = [*job["parameters"], *(["phase"] if job.forced else [])]
    found = ns.fit(job.system, table, unknown, progress=job.heard)
    return {
        "values": dict(found),
        "told": {
            name: str(one) if np.isfinite(one.uncertainty) else found.identifiability[name]
            for name, one in found.estimates.items()
        },
        "anomalies": [*found.anomalies],
        "samples": sum(int(np.isfinite(column).sum()) for _, column in table.values()),
        "step": step,
    }


@lru_cache(maxsize=2)
def _with_rates(text: str, samples: RecordedStates) -> dict[str, FloatArray]:
    """Columns by state: those recorded, and velocities of recorded positions."""
    from nonsmooth.recordings.signals.smoothing import smooth

    system = ns.System.from_text(text)
    names = list(system.states)
    columns = dict(samples.columns)
    for i, k in rates(system).items():
        if names[i] in columns and names[k] not in columns:
            have = np.isfinite(columns[names[i]])
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    velocity = smooth(samples.time[have], columns[names[i]][have], resolution=None)["v"].values
            except (ValueError, SolveError):
                continue
            columns[names[k]] = np.full(len(samples.time), np.nan)
            columns[names[k]][have] = velocity
    return {name: columns[name] for name in names if name in columns}
