"""The branch of an experiment as a Dataset: the schema of ``continue_orbit``, as far as an experiment knows it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.control.holding import STABLE, UNKNOWN, UNSTABLE, values_at
from nonsmooth.control.march import Continuation, MeasuredPoint
from nonsmooth.results.labels import labelled

if TYPE_CHECKING:
    import xarray as xr

TURN = np.linspace(0.0, 1.0, 2048, endpoint=False)
SIGNIFICANT = 4.0  # standard uncertainties
MISFIT = 4.0  # mean square of the normalised differences from a parabola
#: Ways in which such a branch ends.
ENDINGS = {
    "range": "The branch reached the edge of the range.",
    "points": "The largest number of points was reached.",
    "lost": "No motion was found on which the control force vanishes, however small the step.",
    "interrupted": "Interrupted: what was measured until then stands.",
}


@dataclass(frozen=True)
class Names:
    """Names and units of a rig's quantities."""

    frequency: str = "drive_frequency"
    amplitude: str = "drive_amplitude"
    position: str = "x"
    velocity: str = "v"
    units: Mapping[str, str] | None = None

    def unit(self, name: str) -> str:
        """Unit of a quantity; ``1`` where the rig does not say."""
        return (self.units or {}).get(name) or "1"


def branch_dataset(
    march: Continuation,
    points: Sequence[MeasuredPoint],
    released: Sequence[tuple[int, float]],
    names: Names,
    parameter: str,
    ending: str,
    record: Mapping[str, Any],
) -> xr.Dataset:
    """The points in the order in which they were measured."""
    import xarray as xr

    from nonsmooth.results.labels import flag_attributes
    from nonsmooth.results.provenance import attribute
    from nonsmooth.results.schema import strings

    other = names.amplitude if parameter == names.frequency else names.frequency
    held = [point.held for point in points]
    omega, level = np.array([(one.frequency, one.amplitude) for one in held]).reshape(-1, 2).T
    along, fixed = (omega, level) if parameter == names.frequency else (level, omega)
    rows = np.array([_motion(one.position.seen, one.frequency) for one in held]).reshape(-1, 3, 2)
    section, maximum, minimum = rows.transpose(1, 0, 2)
    uncertainty, across = np.array([_uncertainties(march, point) for point in points]).reshape(-1, 2).T
    size = 0.5 * (maximum - minimum)[:, 0]
    uncertainty = np.maximum(uncertainty, _beside_folds(size, along, across))
    unit, own, force = names.unit(names.position), names.unit(parameter), names.unit("force")
    kinds, growths = np.array(released).reshape(-1, 2).T
    harmonics = march.holder.harmonics + 1
    c = np.array([one.position.c for one in held]).reshape(-1, harmonics)
    places, spreads, nearest = np.array(_folds(march, points, along, across)).reshape(-1, 3).T
    tables: dict[Any, dict[str, tuple[Any, ...]]] = {
        ("point", "state"): {
            "section": (section, "state at phase 0 of the drive"),
            "maximum": (maximum, "largest value along the orbit"),
            "minimum": (minimum, "smallest value along the orbit"),
        },
        "point": {
            "amplitude": (size, "half the peak-to-peak value", unit),
            "amplitude_uncertainty": (uncertainty, "standard uncertainty of the amplitude at this parameter", unit),
            "parameter_uncertainty": (across, "standard uncertainty of the parameter at this amplitude", own),
            "period": (2 * np.pi / omega, "period of the drive", "s"),
            "stability": (kinds.astype(np.int8), "motion that was let go: came back, left, or not known", "1"),
            "growth": (growths, "mean factor by which the distance changed per turn when let go", "1"),
            "control_effort": ([one.effort for one in held], "rms of the control force that repeats", force),
            "control_effort_noise": ([one.effort_noise for one in held], "the same of noise alone", force),
            "control_effort_first": ([p.first_effort for p in points], "the same before the first correction", force),
            "control_rms": ([one.force_rms for one in held], "rms of the whole control force", force),
            "measurements": ([p.measurements for p in points], "measurements until the control force vanished", "1"),
            parameter: (along, parameter, own),
        },
        ("point", "harmonic"): {
            "position_cosine": (c.real, "cosine coefficients of the motion", unit),
            "position_sine": (-c.imag, "sine coefficients of the motion", unit),
        },
        "special": {
            "special_kind": (strings(["fold"] * len(places)), "kind of the special point"),
            "special_point": (nearest.astype(np.int64), "nearest of the points"),
            "special_value": (places, f"{parameter} at the special point", own),
            "special_value_uncertainty": (spreads, "its standard uncertainty", own),
        },
        "state": {
            "state": (strings([names.position, names.velocity]), "state"),
            "state_unit": (strings([unit, names.unit(names.velocity)]), "unit"),
        },
        "harmonic": {"harmonic": (np.arange(harmonics), "harmonic of the drive")},
        (): {
            "turns": (np.int64(march.holder.turns), "turns of the drive in all"),
            "ended_because": (ENDINGS.get(ending, ending), "how the branch ends"),
            other: (float(np.mean(fixed)) if points else np.nan, other, names.unit(other)),
        },
    }
    found = {name: labelled(dims, *row) for dims, rows in tables.items() for name, row in rows.items()}
    found["stability"][2].update(flag_attributes(["not_known", "unstable", "stable"], [UNKNOWN, UNSTABLE, STABLE]))
    coords = parameter, other, "state_unit"
    return xr.Dataset(found, attrs=attribute(record) | {"parameter": parameter}).set_coords(coords)


def _motion(c: Any, frequency: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """State at phase 0, and the extremes of position and velocity."""
    x, v = values_at(c, TURN), frequency * values_at(c, TURN, 1)
    return np.array([x[0], v[0]]), np.array([x.max(), v.max()]), np.array([x.min(), v.min()])


def _uncertainties(march: Continuation, point: MeasuredPoint) -> tuple[float, float]:
    """Standard uncertainties of the amplitude at this parameter, and of the parameter at this amplitude.

    What is left of the mismatch, and the noise of the measured harmonics, through the measured derivatives. At a fold
    the first is large and the second is not.
    """
    c, u = point.held.position.seen, point.held.position.u
    x = values_at(c, TURN)
    order = np.arange(len(c))
    ends = [np.exp(2j * np.pi * order * TURN[int(pick(x))]) for pick in (np.argmax, np.argmin)]
    wave = 0.5 * (ends[0] - ends[1]) * march.size
    slope = np.concatenate([wave.real, -wave.imag[1:]])  # of the amplitude by the scaled series
    noise = np.concatenate([u, u[1:]]) / march.size
    variance = point.mismatch**2 + noise**2
    n = len(noise)
    parameter, size = np.eye(n + 1)[0], np.concatenate([[0.0], slope / march.size])
    spread = []
    for held, seen, scale in ((parameter, size, march.size), (size, parameter, march.scale)):
        try:
            effect = seen @ np.linalg.inv(np.vstack([point.J, held]))[:, :n]
        except np.linalg.LinAlgError:
            spread.append(float("inf"))
            continue
        direct = float(np.sum((slope * noise) ** 2)) if seen is size else 0.0
        spread.append(float(np.sqrt(scale**2 * np.sum(effect**2 * variance) + direct)))
    return spread[0], spread[1]


def _beside_folds(size: FloatArray, along: FloatArray, across: FloatArray) -> FloatArray:
    """Uncertainty of the amplitude by the slope of the branch between neighbours, and at a fold by its curvature.

    The derivatives at a point, which its corrections have measured, say little there.
    """
    if len(size) < 3:
        return np.zeros(len(size))
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.gradient(along, size, edge_order=2)
        found = np.minimum(across / np.abs(slope), np.sqrt(2.0 * across / np.abs(np.gradient(slope, size))))
    return np.nan_to_num(found, posinf=0.0)


def _folds(
    march: Continuation, points: Sequence[MeasuredPoint], along: FloatArray, across: FloatArray
) -> list[tuple[float, float, int]]:
    """Turning points of the parameter: value, standard uncertainty, nearest point.

    The vertex of a parabola over the length of the branch, by least squares through five points; where they lie on
    none, the corner of the straight lines through two points on each side. A turn that noise may have made is none.
    """
    place = np.array([march.plane @ point.y for point in points]).reshape(-1, 3)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(place, axis=0), axis=1))])
    found = []
    for i in _turns(along, across):
        if not 0 < i < len(points) - 1:
            continue
        near = slice(max(i - 2, 0), i + 3)
        s, weight = length[near] - length[i], 1.0 / across[near]
        fit, covariance = np.polyfit(s, along[near], 2, w=weight, cov="unscaled")
        misfit = float(np.sum((weight * (along[near] - np.polyval(fit, s))) ** 2)) / max(len(s) - 3, 1)
        if len(s) > 3 and misfit < MISFIT:
            at = -fit[1] / (2 * fit[0])
            slope = np.array([at**2, at, 1.0])  # of the vertex by the coefficients, which moves with none of them
            spread = float(np.sqrt(max(misfit, 1.0) * slope @ covariance @ slope))
            found.append((float(np.polyval(fit, at)), spread, i))
            continue
        value, spread = _corner(place, i)
        near_by = 0.5 * float(np.min(np.abs(np.diff(along[i - 1 : i + 2]))))
        found.append((value * march.scale, float(np.linalg.norm([across[i], spread * march.scale, near_by])), i))
    return found


def _corner(place: FloatArray, i: int) -> tuple[float, float]:
    """Parameter (scaled) where the lines through the points before and after a turn are nearest; its uncertainty.

    The outermost point itself lies on one of the lines: on the one whose next point is nearer to it; by how far both
    ways to say so differ is the uncertainty.
    """
    found, last = [], len(place) - 1
    for before, after, beyond in (((i - 1, i), (i + 1, i + 2), i - 2), ((i - 2, i - 1), (i, i + 1), i + 2)):
        if before[0] < 0 or after[1] > last:
            continue
        a, b = place[before[1]] - place[before[0]], place[after[0]] - place[after[1]]
        along, *_ = np.linalg.lstsq(np.column_stack([a, -b]), place[after[0]] - place[before[1]], rcond=None)
        meeting = (place[before[1]] + along[0] * a, place[after[0]] + along[1] * b)
        line, third = a if beyond < i else b, place[min(max(beyond, 0), last)] - place[i]
        off = float(np.linalg.norm(third - (third @ line) / (line @ line) * line))
        found.append((off, 0.5 * float(meeting[0][0] + meeting[1][0])))
    if not found:
        return float(place[i][0]), float(np.ptp(place[i - 1 : i + 2, 0]))
    values = [value for _, value in sorted(found)]
    return values[0], max(abs(values[0] - values[-1]), 0.5 * abs(values[0] - float(place[i][0])))


def _turns(values: FloatArray, uncertainty: FloatArray) -> list[int]:
    """Places of the extremes from which the values go back significantly, in turn maxima and minima.

    Compared are all pairs since the last extreme: an extreme that is itself badly known hides no turn.
    """
    found: list[int] = []
    begin, sign = 0, 0.0
    for i in range(1, len(values)):
        away = values[i] - values[begin:i]
        back = (np.abs(away) > SIGNIFICANT * np.hypot(uncertainty[i], uncertainty[begin:i])) & (sign * away <= 0)
        if not back.any():
            continue
        if sign:
            begin += int(np.argmax(sign * values[begin:i]))
            found.append(begin)
        sign = float(np.sign(away[back][0]))
    return found
