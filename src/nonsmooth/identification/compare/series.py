"""From several measured motions, or one that drifts, to what ``compare`` takes: a response, a rise, sections."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.arrays import FloatArray
from nonsmooth.identification.compare.orbits import fold
from nonsmooth.identification.compare.periods import measured_period
from nonsmooth.identification.compare.response import jumps_of_runs
from nonsmooth.results.labels import labelled

_JUMPS = {
    "value": ("middle of the step in which the amplitude jumps", "rad/s"),
    "step": ("width of the step", "rad/s"),
    "before": ("amplitude before it", "m"),
    "after": ("amplitude behind it", "m"),
}
_NUMBER = "period number (0: none found, -1: too few turns)"
FEW = 6  # turns of the drive below which no period number is sought


def _period_of(motion: xr.Dataset, folded: FloatArray, longest: int) -> int:
    """The period number of a folded motion; 0: none found, -1: too few turns."""
    enough = np.isfinite(folded).all(axis=(1, 2)).sum() >= FEW
    return measured_period(folded, _noise(motion), max_period=longest).number if enough else -1


def _noise(*motions: xr.Dataset) -> FloatArray:
    """The standard error of most samples in each state."""
    return np.median(np.concatenate([motion["u_error"].values for motion in motions]), axis=0)


def measured_response(motions: Sequence[xr.Dataset], directions: Sequence[str], *, settle: int = 4) -> xr.Dataset:
    """The frequency response that steady runs make: amplitude over frequency, run by run.

    Parameters
    ----------
    motions : sequence of Dataset
        As from :func:`nonsmooth.identification.compare.measured_motion`, one for each step of the frequency.
    directions : sequence of str
        ``"up"`` or ``"down"``: how each step was reached.
    settle : int
        Forcing periods passed over at the beginning of each run.

    Returns
    -------
    xarray.Dataset
        Over ``run``: ``amplitude`` (half the range of x, the mean over forcing periods), ``amplitude_error`` (that of
        the mean: the scatter of the periods, and the error of a sample), ``omega``, ``direction``, and
        ``period_number`` (at most 8; 0: none found, -1: fewer than six turns). Over ``jump``, as
        :func:`nonsmooth.frequency_response` has them: ``jump_direction``, ``jump_value``, ``jump_step``,
        ``jump_before`` and ``jump_after``.
    """
    if len(motions) != len(directions) or not len(motions):
        raise ValueError(f"{len(motions)} runs and {len(directions)} directions: each run needs its own")
    heights, errors, periods = [], [], []
    for motion in motions:
        folded = fold(motion["phase"].values, motion["u"].values, 64)
        periods.append(_period_of(motion, folded, 8))
        whole = folded[min(settle, len(folded) - 1) :, :, 0]
        whole = whole[np.isfinite(whole).all(axis=1)]
        # Pairs of periods, so that a motion of period two shows its whole range.
        pairs = whole[: len(whole) // 2 * 2].reshape(-1, 2 * whole.shape[1]) if len(whole) > 1 else whole
        half = 0.5 * np.ptp(pairs, axis=1)
        heights.append(half.mean())
        sample = _noise(motion)[0] / np.sqrt(2)
        scatter = half.std(ddof=1) / np.sqrt(len(half)) if len(half) > 1 else 0.0
        errors.append(np.hypot(scatter, sample / np.sqrt(len(half))))
    omega = np.array([float(motion["omega"]) for motion in motions])
    words = np.array(directions, str)
    jumps = jumps_of_runs(omega, np.array(heights), np.array(errors), words)
    met = [word for word, found in jumps.items() for _ in found]
    steps = np.array([one for found in jumps.values() for one in found], float).reshape(-1, 4).T
    return xr.Dataset(
        {
            "amplitude": labelled("run", np.array(heights), "half the range of x", "m"),
            "amplitude_error": labelled("run", np.array(errors), "standard error of it", "m"),
            "omega": labelled("run", omega, "frequency of the drive", "rad/s"),
            "direction": labelled("run", words, "how the run was reached"),
            "period_number": labelled("run", np.array(periods, np.int64), _NUMBER),
            "jump_direction": labelled("jump", np.array(met, str), "how it was met"),
            **{
                f"jump_{name}": labelled("jump", column, *words_of)
                for (name, words_of), column in zip(_JUMPS.items(), steps, strict=True)
            },
        },
        attrs=_attributes(motions),
    )


def _attributes(motions: Sequence[xr.Dataset]) -> dict[str, Any]:
    kept = {key: value for key, value in motions[0].attrs.items() if key != "run"}
    return kept | {"title": f"{kept.get('file') or 'in memory'}, {len(motions)} runs"}


def measured_rise(motion: xr.Dataset, parameter: str, first: float, last: float, *, unit: str = "") -> xr.Dataset:
    """The section points of a run in which a parameter rose slowly and evenly from ``first`` to ``last``.

    Parameters
    ----------
    motion : Dataset
        As from :func:`nonsmooth.identification.compare.measured_motion`.
    parameter : str
    first, last : float
        Its values at the first and the last sample of the record.
    unit : str

    Returns
    -------
    xarray.Dataset
        ``section(iterate, state)`` at phase 0 with the parameter over ``iterate``, and ``section_error(state)``.
    """
    time, phase = motion["time"].values, motion["phase"].values
    points = fold(phase, np.column_stack([motion["u"].values, time]), 8)[:, 0]
    at = first + (last - first) * (points[:, -1] - time[0]) / (time[-1] - time[0])
    return xr.Dataset(
        {
            "section": labelled(("iterate", "state"), points[:, :-1], "section points"),
            "section_error": ("state", _noise(motion)),
            parameter: labelled("iterate", at, parameter, unit),
        },
        {"state": motion["state"].values, "state_unit": ("state", motion["state_unit"].values)},
        motion.attrs,
    )


def measured_sections(
    motions: Sequence[xr.Dataset], parameter: str, values: Sequence[float], *, unit: str = ""
) -> xr.Dataset:
    """The section points of steady runs over the parameter in which they differ.

    Parameters
    ----------
    motions : sequence of Dataset
        As from :func:`nonsmooth.identification.compare.measured_motion`.
    parameter : str
    values : sequence of float
        Its value in each run.
    unit : str

    Returns
    -------
    xarray.Dataset
        ``section(<parameter>, iterate, state)`` at phase 0, in rising order of the parameter (NaN behind the end of a
        shorter run), ``section_error(state)`` and ``period_number(<parameter>)`` (at most 16; 0: none
        found, -1: too few turns).
    """
    order = np.argsort(values, kind="stable")
    clouds = [fold(motions[i]["phase"].values, motions[i]["u"].values, 8) for i in order]
    points = np.full((len(clouds), max(map(len, clouds)), clouds[0].shape[2]), np.nan)
    for row, cloud in zip(points, clouds, strict=True):
        row[: len(cloud)] = cloud[:, 0]
    numbers = [_period_of(motions[i], cloud, 16) for i, cloud in zip(order, clouds, strict=True)]
    first = motions[0]
    return xr.Dataset(
        {
            "section": labelled((parameter, "iterate", "state"), points, "section points"),
            "section_error": ("state", _noise(*motions)),
            "period_number": labelled(parameter, np.array(numbers, np.int64), _NUMBER),
        },
        {
            parameter: labelled(parameter, np.asarray(values, float)[order], parameter, unit),
            "state": first["state"].values,
            "state_unit": ("state", first["state_unit"].values),
        },
        _attributes(motions),
    )
