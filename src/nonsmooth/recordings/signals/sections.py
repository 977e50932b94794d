"""Section points of a sampled motion: stroboscopic by the drive's phase, Poincare by a surface, with their errors.

Between two samples the motion is the polynomial that has their positions, velocities (and accelerations, where given):
order 3 or 5. An impact between two samples is not interpolated across: each side is continued to it.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypedDict, Unpack

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings.signals.checks import signal, unit_of, whose
from nonsmooth.recordings.signals.phase import DrivePhase
from nonsmooth.results.labels import labelled
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Default, at_least


def first_zero(x: FloatArray, y: FloatArray) -> float:
    """The first zero of y over x, straight between two samples of other signs; NaN where there is none."""
    found = np.flatnonzero(np.sign(y[:-1]) != np.sign(y[1:]))
    if not len(found):
        return np.nan
    i = found[0]
    return x[i] + (x[i + 1] - x[i]) * y[i] / (y[i] - y[i + 1])


class Known(TypedDict, total=False):
    """Of a motion, beside its positions and velocities; ``impacts`` are times at which the velocity jumps."""

    a: ArrayLike | None
    x_error: ArrayLike | None
    v_error: ArrayLike | None
    impacts: Annotated[ArrayLike, Default(())]


@checked
def stroboscopic(
    time: ArrayLike,
    x: Any,
    v: ArrayLike,
    drive_phase: DrivePhase,
    phase: Annotated[float, at_least(0, 1)] = 0.0,
    **known: Unpack[Known],
) -> xr.Dataset:
    """Position and velocity once per turn of the drive.

    Parameters
    ----------
    time, x, v : array_like, shape (N,)
        A smoothed motion.
    drive_phase : DrivePhase
    phase : float
        In turns, 0 to 1, as in ``ns.Stroboscopic``.
    a, x_error, v_error : array_like, shape (N,), optional
        As ``smooth`` gives them.
    impacts : array_like, optional
        Times at which v jumps.

    Returns
    -------
    Dataset
        ``section(iterate, state)`` with the states x and v, ``section_error`` likewise (that of the signal, and of
        the phase times how fast the states change; NaN where not given), ``time(iterate)``.

    Raises
    ------
    ValueError
        If the record holds no instant of this phase.
    """
    between = _Between(time, x, v, **known)
    instants = drive_phase.times(phase)
    instants = instants[(instants >= between.t[0]) & (instants <= between.t[-1])]
    if len(instants) == 0:
        raise ValueError(
            f"{whose(x)}: the record from {between.t[0]:.6g} to {between.t[-1]:.6g} s holds no instant of phase "
            f"{phase:g}; the drive's phase is known from {drive_phase.span[0]:.6g} to {drive_phase.span[1]:.6g} s"
        )
    instant_error = np.full(len(instants), drive_phase.t_0_error)
    return _points(between, instants, instant_error, {"section": f"stroboscopic, phase {phase:g}"}, along=True)


@checked
def poincare(
    time: ArrayLike,
    x: Any,
    v: ArrayLike,
    *,
    surface: Literal["x", "v"] = "x",
    level: float = 0.0,
    rising: bool | None = True,
    **known: Unpack[Known],
) -> xr.Dataset:
    """Position and velocity where x (or v) passes a level.

    Parameters
    ----------
    time, x, v, a, x_error, v_error, impacts
        As in :func:`stroboscopic`.
    surface : {"x", "v"}
    level : float
    rising : bool or None
        Upwards, downwards, or both.

    Returns
    -------
    Dataset
        As :func:`stroboscopic`, and ``time_error(iterate)``. It may hold no point.
    """
    between = _Between(time, x, v, **known)
    which = 0 if surface == "x" else 1
    values = between.states[:, which] - level
    # A sample on the level belongs to the side it goes to.
    up = (values[:-1] < 0) & (values[1:] >= 0)
    down = (values[:-1] > 0) & (values[1:] <= 0)
    wanted = up | down if rising is None else up if rising else down
    instants = between.passing(np.flatnonzero(wanted), which, level)
    rate = np.abs(between.at(instants, derivative=1)[:, which])
    own = between.error_at(instants)[:, which]
    with np.errstate(divide="ignore", invalid="ignore"):
        instant_error = own / rate
    result = _points(between, instants, instant_error, {"section": f"poincare, {surface} = {level:g}"}, along=False)
    # On the surface itself the level is exact; what the signal is uncertain there is the time.
    result["section_error"][:, which] = 0.0
    result["time_error"] = ("iterate", instant_error, {"units": "s"})
    return result


class _Between:
    """A motion between its samples."""

    def __init__(
        self,
        time: ArrayLike,
        x: Any,
        v: ArrayLike,
        a: ArrayLike | None = None,
        x_error: ArrayLike | None = None,
        v_error: ArrayLike | None = None,
        impacts: ArrayLike = (),
    ) -> None:
        self.t, position = signal(time, x, least=4, purpose="section points")
        columns = [position]
        for name, given in (("v", v), ("a", a), ("x_error", x_error), ("v_error", v_error)):
            column = np.full(len(self.t), np.nan) if given is None else np.asarray(given, float)
            if column.shape != self.t.shape:
                raise ValueError(f"{whose(x)}: {name} must have one value per time, got shape {column.shape}")
            if given is not None and not np.isfinite(column).all():
                raise ValueError(f"{whose(x)}: {name} holds values that are not finite numbers; cut the record there")
            columns.append(column)
        self.states = np.column_stack(columns[:2])
        self.errors = np.column_stack(columns[3:])
        self.unit = unit_of(x)
        hits = np.unique(np.asarray(impacts, float).ravel())
        self.polynomial = _polynomial(self.t, columns[0], columns[1], None if a is None else columns[2], hits)

    def at(self, times: FloatArray, derivative: int = 0) -> FloatArray:
        """x and v (or their derivatives) at these times, shape (n, 2)."""
        return np.column_stack([self.polynomial(times, derivative + k) for k in range(2)])

    def passing(self, i: NDArray[np.intp], which: int, level: float) -> FloatArray:
        """The times in steps i at which x or v passes a level, by halving until no number lies between."""
        low, high = self.t[i], self.t[i + 1]
        before = self.states[i, which] < level
        while True:
            middle = low + 0.5 * (high - low)
            inside = (middle > low) & (middle < high)
            if not inside.any():
                return high
            value = self.at(middle)[:, which] - level
            behind = inside & (np.where(before, -value, value) > 0)
            low, high = np.where(behind, middle, low), np.where(inside & ~behind, middle, high)

    def error_at(self, times: FloatArray) -> FloatArray:
        """Errors of x and v between samples: the larger one of the two ends."""
        i = np.clip(np.searchsorted(self.t, times, side="right") - 1, 0, len(self.t) - 2)
        return np.maximum(self.errors[i], self.errors[i + 1])


def _polynomial(t: FloatArray, x: FloatArray, v: FloatArray, a: FloatArray | None, hits: FloatArray) -> Any:
    """Hermite's polynomial of order 3 in each step, or 5 with accelerations; in a step with impacts the samples at its
    ends are continued to them."""
    from scipy.interpolate import CubicHermiteSpline, PPoly

    if a is None:
        terms, bend = CubicHermiteSpline(t, x, v).c, np.zeros_like(x)
    else:
        h, bend = np.diff(t), 0.5 * a
        d = np.diff(x) - v[:-1] * h - bend[:-1] * h**2  # what the sample at the beginning leaves, and its derivatives
        dv, da = (np.diff(v) - a[:-1] * h) * h, np.diff(bend) * h**2
        highest = (6 * d - 3 * dv + da) / h**5, (7 * dv - 15 * d - 2 * da) / h**4, (10 * d - 4 * dv + da) / h**3
        terms = np.array([*highest, bend[:-1], v[:-1], x[:-1]])
    step = np.searchsorted(t, hits) - 1  # an impact at a sample is none between two
    inside = (step >= 0) & (step < len(t) - 1) & (hits < t[np.minimum(step + 1, len(t) - 1)])
    hits, step = hits[inside], step[inside]
    terms[:-3, step] = 0.0
    terms[-3:, step] = bend[step], v[step], x[step]
    since, ends = hits - t[step + 1], step + 1
    behind = np.zeros((len(terms), len(hits)))
    behind[-3:] = bend[ends], v[ends] + 2 * bend[ends] * since, x[ends] + (v[ends] + bend[ends] * since) * since
    return PPoly(np.insert(terms, ends, behind, axis=1), np.insert(t, ends, hits))


def _points(
    between: _Between, times: FloatArray, instant_error: FloatArray, attrs: dict[str, str], *, along: bool
) -> xr.Dataset:
    section = between.at(times)
    error = between.error_at(times)
    moved = np.abs(between.at(times, derivative=1)) * instant_error[:, None]
    error = np.hypot(error, moved if along else np.nan_to_num(moved))
    units = [between.unit, f"{between.unit}/s"]
    return xr.Dataset(
        {
            "section": labelled(("iterate", "state"), section, "section points"),
            "section_error": labelled(("iterate", "state"), error, "standard error of the section points"),
            "time": labelled("iterate", times, "time", "s"),
        },
        {
            "iterate": np.arange(len(times)),
            "state": ("state", ["x", "v"]),
            "state_unit": labelled("state", units, "unit"),
        },
        attrs,
    )
