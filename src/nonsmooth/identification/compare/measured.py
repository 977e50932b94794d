"""From a recorded run to what ``compare`` takes: a motion over the drive's phase, a response, a slow rise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.identification.compare.fold import fold

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.experiment.recording import Recording

__all__ = ["measured_motion", "measured_response", "measured_rise", "measured_sections"]

ANGLES = ("rad", "deg", "rev")
LONG = 150.0  # s: of a longer record the support and the smoother's intensity are found in its middle
PIECE = 75.0  # s
FEW = 6  # turns of the drive below which no period number is sought


def measured_motion(
    recording: Recording,
    run: str | None = None,
    *,
    distance_per_turn: float,
    counts_per_turn: int = 1440,
    zero: float = 0.0,
    support: bool = True,
    angle: str = "Angle",
    turn: str = "Turn",
) -> xr.Dataset:
    r"""The motion of one run: position and velocity with their errors, over time and the phase of the drive.

    The rotary sensor's angle becomes a position; a Kalman smoother gives the velocity, contacts with the support being
    found first so that nothing is smoothed across their ends; the photogate's turns give the phase.

    Parameters
    ----------
    recording : Recording
    run : str, optional
        Needed where there are several.
    distance_per_turn : float
        Travel per turn of the sensor's wheel (m).
    counts_per_turn : int
        Counts of the encoder per turn.
    zero : float
        Position (m) that becomes x = 0: the car's mean position under the drive. A string of length L lets it move by
        :math:`a^2 / (8 L)` from where it rested, and the model knows nothing of this.
    support : bool
        Whether the support was mounted.
    angle, turn : str
        Names of the channels; ``turn`` has one row for each turn of the crank, at phase 0.

    Returns
    -------
    xarray.Dataset
        ``u(time, state)``, ``u_error(time, state)`` with the states ``x`` and ``v``; ``phase(time)`` in forcing
        periods; scalars ``omega`` and ``omega_error``; attributes ``synthetic``, ``title``, ``run``.

    Raises
    ------
    ValueError
        A channel that is missing, too short or in another unit; the message names run and channel.
    """
    import xarray as xr

    from nonsmooth.experiment.signals.checks import take
    from nonsmooth.experiment.signals.displacement import position, resolution
    from nonsmooth.experiment.signals.phase import drive_phase

    name = run if run is not None else recording.runs[0]
    turned = take(recording, angle, run, units=ANGLES, samples=64)
    gate = take(recording, turn, run, samples=3)
    turns = gate[gate.dims[0]].values
    x = position(turned, distance_per_turn=distance_per_turn, zero=zero)
    time = x[x.dims[0]].values
    drive = drive_phase(turns, span=(float(time[0]), float(time[-1])))
    step = resolution(distance_per_turn=distance_per_turn, counts_per_turn=counts_per_turn)
    smoothed = _smoothed(time, x, step, drive.omega, support)
    # Beyond the first and last turn the phase would be a guess.
    inside = (time >= turns[0]) & (time <= turns[-1])
    states = ("x", "v")
    u = np.column_stack([smoothed[state].values for state in states])[inside]
    error = np.column_stack([smoothed[f"{state}_error"].values for state in states])[inside]
    units = ["m", "m/s"]
    return xr.Dataset(
        {
            "u": (("time", "state"), u, {"long_name": "measured state"}),
            "u_error": (("time", "state"), error, {"long_name": "standard error of the measured state"}),
            "phase": ("time", drive.phase(time[inside]) / (2 * np.pi), {
                "long_name": "phase of the drive", "units": "forcing periods"}),
        },
        {
            "time": ("time", time[inside], {"long_name": "time", "units": "s"}),
            "state": ("state", list(states)), "state_unit": ("state", units),
            "omega": ((), drive.omega, {"long_name": "frequency of the drive", "units": "rad/s"}),
            "omega_error": ((), drive.omega_error, {"long_name": "standard error of it", "units": "rad/s"}),
        },
        _attributes(recording, name),
    )  # fmt: skip


def _smoothed(time: Any, x: xr.DataArray, step: float, omega: float, support: bool) -> xr.Dataset:
    """The motion by the Kalman smoother, contacts with the support told apart.

    Of a long record a piece in the middle tells the support's place and the intensities of the smoother's noise; to
    find them in the whole would take ten passes over it.
    """
    from nonsmooth.experiment.signals.impacts import contacts
    from nonsmooth.experiment.signals.sections import poincare
    from nonsmooth.experiment.signals.smoothing import smooth

    # Without a support the motion is smooth: no contact is an answer that the smoother takes, too.
    def touching(t: Any, values: Any) -> Any:
        return contacts(t, values, resolution=step, omega=omega) if support else ((), ())

    if time[-1] - time[0] <= LONG:
        return smooth(time, x, resolution=step, contacts=touching(time, x))
    middle = 0.5 * (time[0] + time[-1])
    inside = np.abs(time - middle) <= PIECE / 2
    piece = x.isel({x.dims[0]: inside})
    found = touching(time[inside], piece)
    quiet = smooth(time[inside], piece, resolution=step, contacts=found).attrs
    if not support or not found.sizes["contact"]:
        if not support:
            return smooth(time, x, resolution=step, contacts=((), ()), intensity=quiet["intensity"])
        return smooth(time, x, resolution=step, contacts=touching(time, x))
    gap = float(found["gap"])
    rough = smooth(time[inside], piece, resolution=step).attrs["intensity"]
    first = smooth(time, x, resolution=step, intensity=rough)
    motion = (time, first["x"], first["v"].values)
    begin, end = (poincare(*motion, level=gap, rising=rising)["time"].values for rising in (True, False))
    # A contact that the record cuts off is whole within it.
    begin = np.concatenate([time[:1], begin]) if x.values[0] > gap else begin
    end = np.concatenate([end, time[-1:]]) if len(end) < len(begin) else end
    levels = (quiet["intensity"], quiet["intensity_in_contact"])
    return smooth(time, x, resolution=step, contacts=(begin, end), intensity=levels)


def measured_response(motions: Sequence[xr.Dataset], directions: Sequence[str], *, settle: int = 4) -> xr.Dataset:
    """The frequency response that steady runs make: amplitude over frequency, run by run.

    Parameters
    ----------
    motions : sequence of Dataset
        As from :func:`measured_motion`, one for each step of the frequency.
    directions : sequence of str
        ``"up"`` or ``"down"``: how each step was reached.
    settle : int
        Forcing periods passed over at the beginning of each run.

    Returns
    -------
    xarray.Dataset
        Over ``run``: ``amplitude`` (half the range of x, the mean over forcing periods), ``amplitude_error`` (that of
        the mean: the scatter of the periods, and the error of a sample), ``omega``, ``direction``, and
        ``period_number`` (0: none found, -1: fewer than six turns).
    """
    import xarray as xr

    from nonsmooth.identification.compare.periods import measured_period

    if len(motions) != len(directions) or not len(motions):
        raise ValueError(f"{len(motions)} runs and {len(directions)} directions: each run needs its own")
    heights, errors, periods = [], [], []
    for motion in motions:
        folded = fold(motion["phase"].values, motion["u"].values, 64)
        points, noise = folded[:, 0], np.median(motion["u_error"].values, axis=0)
        points = points[np.isfinite(points).all(axis=1)]
        many = len(points) >= FEW
        periods.append(measured_period(points, noise, max_period=8).number if many else -1)
        whole = folded[:, :, 0]
        whole = whole[min(settle, len(whole) - 1) :]
        whole = whole[np.isfinite(whole).all(axis=1)]
        # Pairs of periods, so that a motion of period two shows its whole range.
        pairs = whole[: len(whole) // 2 * 2].reshape(-1, 2 * whole.shape[1]) if len(whole) > 1 else whole
        half = 0.5 * np.ptp(pairs, axis=1)
        heights.append(float(half.mean()))
        sample = float(np.median(motion["u_error"].values[:, 0])) / np.sqrt(2)
        scatter = float(half.std(ddof=1) / np.sqrt(len(half))) if len(half) > 1 else 0.0
        errors.append(float(np.hypot(scatter, sample / np.sqrt(len(half)))))
    attrs = {key: motions[0].attrs[key] for key in ("synthetic", "file", "sha256") if key in motions[0].attrs}
    attrs["title"] = f"{attrs.get('file') or 'in memory'}, {len(motions)} runs"
    omega = np.array([float(motion["omega"]) for motion in motions])
    return xr.Dataset(
        {
            "amplitude": ("run", np.array(heights), {"long_name": "half the range of x", "units": "m"}),
            "amplitude_error": ("run", np.array(errors), {"long_name": "standard error of it", "units": "m"}),
            "omega": ("run", omega, {"long_name": "frequency of the drive", "units": "rad/s"}),
            "direction": ("run", np.array(directions, dtype=str), {"long_name": "how the run was reached"}),
            "period_number": ("run", np.array(periods, dtype=np.int64), {
                "long_name": "period number (0: none found, -1: too few turns)"}),
        },
        attrs=attrs,
    )  # fmt: skip


def measured_rise(motion: xr.Dataset, parameter: str, first: float, last: float, *, unit: str = "") -> xr.Dataset:
    """The section points of a run in which a parameter rose slowly and evenly from ``first`` to ``last``.

    Parameters
    ----------
    motion : Dataset
        As from :func:`measured_motion`.
    parameter : str
    first, last : float
        Its values at the first and the last sample of the record.
    unit : str

    Returns
    -------
    xarray.Dataset
        ``section(iterate, state)`` at phase 0 with the parameter over ``iterate``, and ``section_error(state)``.
    """
    import xarray as xr

    time, phase = motion["time"].values, motion["phase"].values
    columns = np.column_stack([motion["u"].values, time])
    points = fold(phase, columns, 8)[:, 0]
    at = first + (last - first) * (points[:, 2] - time[0]) / (time[-1] - time[0])
    return xr.Dataset(
        {
            "section": (("iterate", "state"), points[:, :2], {"long_name": "section points"}),
            "section_error": (("state",), np.median(motion["u_error"].values, axis=0)),
            parameter: ("iterate", at, {"long_name": parameter, "units": unit}),
        },
        {"state": motion["state"].values, "state_unit": ("state", motion["state_unit"].values)},
        motion.attrs,
    )  # fmt: skip


def measured_sections(
    motions: Sequence[xr.Dataset], parameter: str, values: Sequence[float], *, unit: str = ""
) -> xr.Dataset:
    """The section points of steady runs over the parameter in which they differ.

    Parameters
    ----------
    motions : sequence of Dataset
        As from :func:`measured_motion`.
    parameter : str
    values : sequence of float
        Its value in each run.
    unit : str

    Returns
    -------
    xarray.Dataset
        ``section(<parameter>, iterate, state)`` at phase 0, in rising order of the parameter (NaN behind the end of a
        shorter run), and ``section_error(state)``.
    """
    import xarray as xr

    order = np.argsort(values)
    clouds = [fold(motions[i]["phase"].values, motions[i]["u"].values, 8)[:, 0] for i in order]
    points = np.full((len(clouds), max(map(len, clouds)), clouds[0].shape[1]), np.nan)
    for row, cloud in zip(points, clouds, strict=True):
        row[: len(cloud)] = cloud
    error = np.median(np.concatenate([motion["u_error"].values for motion in motions]), axis=0)
    first = motions[0]
    attrs = {**first.attrs, "title": f"{first.attrs.get('file') or 'in memory'}, {len(motions)} runs"}
    attrs.pop("run", None)
    return xr.Dataset(
        {
            "section": ((parameter, "iterate", "state"), points, {"long_name": "section points"}),
            "section_error": (("state",), error),
        },
        {
            parameter: (parameter, np.asarray(values, dtype=float)[order], {"long_name": parameter, "units": unit}),
            "state": first["state"].values, "state_unit": ("state", first["state_unit"].values),
        },
        attrs,
    )  # fmt: skip


def _attributes(recording: Recording, run: str) -> dict[str, str]:
    source = recording.source
    return {
        "synthetic": "yes" if recording.synthetic else "no",
        "title": f"{source.get('file') or 'in memory'}, {run}",
        "run": run, "file": str(source.get("file", "")), "sha256": str(source.get("sha256", "")),
    }  # fmt: skip
