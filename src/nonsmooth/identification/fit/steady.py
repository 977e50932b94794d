r"""Readings of steady states beside records over time: amplitudes of a response, points of a section.

The steady states are those that sweeps up and down the runs reach, each run from where the one before it ended; a
reading is of the one nearest to it, so that a run that jumped a little early is no error of the model. The derivatives
are those of its periodic orbit, :math:`\partial z^* / \partial p = (I - M)^{-1} \partial P / \partial p` with the
return map P and M its derivative. An extreme moves with the motion at its instant t; where the rate jumps there (an
impact), from s to s', with :math:`x_p + s (x'_p - x_p) / (s - s')`, which is x_p at a smooth extreme.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from nonsmooth.arrays import BoolArray, FloatArray, IntArray
from nonsmooth.attractors.settled import usable
from nonsmooth.attractors.settler import Settler
from nonsmooth.errors import unknown
from nonsmooth.flow.sections import Stroboscopic, section_plan
from nonsmooth.flow.starts import start_states
from nonsmooth.identification.fit.sensors import Sensor
from nonsmooth.identification.measured_units import compare_units_of_readings, units_of
from nonsmooth.system.kinds import float_array
from nonsmooth.system.system import System

KEPT, LONGEST = 33, 16  # section points looked at, and the longest period number looked for
if TYPE_CHECKING:
    from nonsmooth.flow.sampled import SampledRun
    from nonsmooth.identification.fit.motion import Marcher

TRANSIENT = 300
ROUNDING = 1e-13  # of the largest reading: none has less noise
ROUGHLY = 0.05  # of the largest reading: the noise at first, where none is known
_FINE = 256  # instants of a period among which an extreme is looked for
_BESIDE = 1e-6  # of a period: on either side of an extreme
_COLUMNS = ("amplitude", "section", "amplitude_error", "section_error", "period_number")


@dataclass(frozen=True, eq=False)
class SteadyReadings:
    """Amplitudes, or section points at phase 0, of R runs.

    Attributes
    ----------
    name : str
    quantities : tuple of str
        States that were measured.
    amplitude : bool
    places : array (k,) of int
        The system's parameters that were set in each run.
    values, setting : array (S, k), (R,)
        The different settings of these, and which of them each run has.
    settings : mapping of str to float
        Parameters that were set in all runs.
    run, iterate, quantity : array (N,) of int
        Of each reading; ``measured`` (N,), and ``error`` (N,), NaN where it is not known.
    noise : array (N,)
        Standard deviation of each reading, known or found.
    used : array (N,) of bool
        Readings where the model's motion has a period number: the amplitude of another one is drawn by chance.
    left : int
        Runs without a period number, of which nothing is used.
    """

    name: str
    quantities: tuple[str, ...]
    amplitude: bool
    places: IntArray
    values: FloatArray
    setting: IntArray
    settings: Mapping[str, float]
    run: IntArray
    iterate: IntArray
    quantity: IntArray
    measured: FloatArray
    error: FloatArray
    noise: FloatArray
    used: BoolArray
    left: int

    def only(self, some: BoolArray) -> SteadyReadings:
        """The same with some of its readings, of a motion through all the settings."""
        names = ("run", "iterate", "quantity", "measured", "error", "noise", "used")
        return replace(self, **{name: getattr(self, name)[some] for name in names})

    def with_noise(self, fitted: FloatArray, periodic: BoolArray, unknowns: int) -> SteadyReadings:
        """The same, used where the motion is periodic, with the noise that residuals show where it is not known."""
        noise, residual = self.error.copy(), self.measured - fitted
        for q in range(len(self.quantities)):
            mine = (self.quantity == q) & np.isnan(self.error) & periodic
            if (n := int(mine.sum())) and np.isfinite(residual[mine]).all():
                noise[mine] = np.sqrt(np.sum(residual[mine] ** 2) / max(n - unknowns, 0.1 * n))
        least = ROUNDING * np.max(np.abs(self.measured))
        noise = np.maximum(np.where(np.isnan(noise), self.noise, noise), max(least, 1e-300))
        return replace(self, used=periodic, noise=noise)


def is_steady(one: Any) -> bool:
    """Return whether this is a response or sections, not a record over time."""
    held = {str(name): name for name in getattr(one, "variables", one)} if hasattr(one, "keys") else {}
    kinds = [] if "time" in held else [one[held[kind]] for kind in ("amplitude", "section") if kind in held]
    pairs = [isinstance(kind, list | tuple) and len(kind) == 2 and np.ndim(kind[0]) > 0 for kind in kinds]
    return bool(kinds) and not any(pairs)  # a pair (t, y) is a channel of this name


def of_table(system: System, one: Any, name: str) -> xr.Dataset:
    """Readings of steady states of a table, or of a mapping, as a Dataset over ``run``."""
    if isinstance(one, xr.Dataset):
        return one
    one = one.reset_index() if hasattr(one, "reset_index") else one
    told = [key for key in (*_COLUMNS, *system.values) if key in one]
    columns = {key: float_array(one[key], f"run {name!r}: {key}") for key in told}
    if {column.shape for column in columns.values()} != {(columns[told[0]].size,)}:
        sizes = ", ".join(f"{key} of {column.size}" for key, column in columns.items())
        raise ValueError(f"run {name!r} must hold one number of each kind for every reading; it has {sizes}")
    words = {"direction": np.asarray(one["direction"], str)} if "direction" in one else {}
    return xr.Dataset({key: ("run", column) for key, column in {**columns, **words}.items()})


def read_steady(system: System, one: Any, name: str, measured: Any, settings: Mapping[str, float]) -> SteadyReadings:
    """Readings of a response or of sections; ValueError that says what is missing of them, or of the system."""
    if system.period() is None or system.inputs:
        why = "inputs" if system.inputs else "no forcing period"
        raise ValueError(f"{system.name!r} has {why}; a response and sections are of steady states under a forcing")
    one = of_table(system, one, name)
    kind = "amplitude" if "amplitude" in one else "section"
    over = [str(dim) for dim in one[kind].dims if dim not in ("state", "iterate")]
    set_ = [key for key in system.values if key in one.variables and {*one[key].dims} & {*over}]
    extra = [each for each in (f"{kind}_error", "period_number") if each in one]
    frame = one[[kind, *extra, *set_]].to_dataframe().reset_index()
    compare_units_of_readings(one, units_of(system))
    if not set_:
        raise ValueError(
            f"run {name!r} does not say at which values of a parameter its {kind} was read: give them under the "
            f"parameter's name; parameters: {', '.join(system.values)}"
        )
    if kind == "section" and "period_number" not in frame:
        raise ValueError(f"run {name!r}: sections need `period_number` for each run, as nonsmooth.sweep gives it")
    named = [measured] if isinstance(measured, str) else list(measured or system.states)
    named = [q for q in named if q in system.states] or named
    usual = {"state": named[0], "iterate": 0, f"{kind}_error": np.nan, "period_number": 1}
    frame = frame.assign(**{key: of for key, of in usual.items() if key not in frame})
    states = list(dict.fromkeys(frame["state"]))
    wanted = [state for state in named if state in states] or states
    for state in wanted:
        if state not in system.states or state not in named:
            raise ValueError(f"run {name!r}: {unknown(state, 'a measured state', repr(system.name), system.states)}")
    runs, rows, left = list[Any](), list[Any](), 0
    set_at, held, errors, numbers = (frame[k].to_numpy(float) for k in (set_, kind, f"{kind}_error", "period_number"))
    which, order = frame["state"].to_numpy(), np.unique(frame["iterate"], return_inverse=True)[1]
    for some in sorted(frame.groupby(over).indices.values(), key=lambda some: (*set_at[some[0]], some[0])):
        points, size = np.full((1 + order.max(), len(wanted)), np.nan), np.full(len(wanted), np.nan)
        for c, state in enumerate(wanted):
            mine = some[which[some] == state]
            points[order[mine], c] = held[mine]
            size[c] = next((one for one in errors[mine] if one == one), np.nan)
        points = points[~np.isnan(points).any(axis=1)]
        at, q = set_at[some[0]], numbers[some[0]]
        q = 1 if kind == "amplitude" and q else q
        if not 0 < q <= min(LONGEST, len(points)) or not np.isfinite(at).all():
            left += 1
            continue
        for k in range(int(q)):
            cycle = points[k :: int(q)]
            each = zip(cycle.mean(axis=0), size / np.sqrt(len(cycle)), strict=True)
            rows += [(len(runs), k, c, y, error) for c, (y, error) in enumerate(each)]
        runs.append(at)
    if not runs:
        raise ValueError(f"run {name!r} has no {kind} that can be used: numbers, with a period number from 1 on")
    (run, iterate, quantity), (y, error) = np.array(rows)[:, :3].T.astype(np.int64), np.array(rows)[:, 3:].T
    if (error < 0.0).any():
        raise ValueError(f"run {name!r}: {kind}_error has the negative number {np.nanmin(error):g}; NaN: not known")
    error = np.where(error > 0.0, error, np.nan)
    values, setting = np.unique(np.array(runs), axis=0, return_inverse=True)
    first = max(ROUGHLY * np.max(np.abs(y)), 1e-300)
    return SteadyReadings(
        name,
        tuple(wanted),
        kind == "amplitude",
        np.array([list(system.values).index(key) for key in set_]),
        values,
        setting.reshape(-1),
        settings,
        run,
        iterate,
        quantity,
        y,
        error,
        np.where(np.isnan(error), first, error),
        np.ones(len(y), bool),
        left,
    )


def predicted(
    one: SteadyReadings, marcher: Marcher, values: FloatArray, sensors: Sequence[Sensor], slopes: bool
) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Predicted readings of the sensors (N,), whether the motion is periodic, and the derivatives
    (N, n_active + 2): in the active parameters, in the sensor's gain and in its offset. NaN where no motion comes to
    its end."""
    system, count, a = marcher.system, len(one.values), marcher.flow.n_active
    points = np.tile(values, (count, 1))
    points[:, one.places] = one.values
    plan = section_plan(system, Stroboscopic(0.0))[1]
    settler = Settler(system, marcher.engine, plan, TRANSIENT, KEPT, LONGEST, False)
    rows = np.concatenate([np.arange(count), np.arange(count)[::-1]])
    starts = np.repeat(start_states(system, None)[:1], len(rows), axis=0)
    found = marcher.once(points.tobytes(), len(rows), lambda: settler.run(points, rows, starts, carried=True))
    columns = [list(system.states).index(name) for name in one.quantities]
    gain, offset = (np.array([getattr(sensor, word) for sensor in sensors]) for word in ("gain", "offset"))
    if one.amplitude:
        gain, offset = np.abs(gain), 0.0 * offset
    fitted, of = np.full(len(one.measured), np.nan), np.zeros((len(one.measured), (a + 2) * slopes))
    periodic, good = np.zeros(len(fitted), bool), usable(found.status)
    tables: dict[tuple[int, int, int], FloatArray] = {}
    acts = ~np.isin(marcher.flow.places, one.places)
    for run, i in enumerate(one.setting):
        mine = np.flatnonzero(one.run == run)
        if not len(mine):
            continue
        shape = len(mine) // len(columns), len(columns)
        least, chosen = np.inf, None
        for job in (i, 2 * count - 1 - i):
            if not good[job]:
                continue
            raw, ahead = 0.5 * (found.maximum[job] - found.minimum[job])[None], 1
            if not one.amplitude:
                raw, ahead = _points(settler, points[i], found, job, shape[0]), int(found.period_number[job])
            raw = raw[:, columns]
            for shift in range(max(ahead, 1)):
                y = raw[shift : shift + shape[0]]
                far = np.sum(((one.measured[mine] - (gain * y + offset).ravel()) / one.noise[mine]) ** 2)
                if far < least:
                    least, chosen = far, (job, shift, y)
        if chosen is None:
            continue
        job, shift, y = chosen
        fitted[mine], periodic[mine] = (gain * y + offset).ravel(), found.period_number[job] > 0
        if slopes:
            key = job, shift, shape[0]
            if key not in tables:
                tables[key] = _slopes(one, marcher, points[i], found, *key)[:, columns]
            table = tables[key]
            of[mine, :a] = (gain[:, None] * table).reshape(len(mine), a) * acts
            of[mine, a] = y.ravel() * (np.tile(np.sign([s.gain for s in sensors]), shape[0]) if one.amplitude else 1.0)
            of[mine, a + 1] = 0.0 if one.amplitude else 1.0
    return fitted, periodic, of


def _points(settler: Settler, point: FloatArray, found: Any, job: int, wanted: int) -> FloatArray:
    """Section points of a job, from its last on: so many, from each of a cycle on."""
    further = wanted - 1 + max(int(found.period_number[job]) - 1, 0)
    n = len(settler.system.states)
    first = found.last[job][None, :n]
    if not further:
        return first
    trace = settler.trace(point[None], found.last[job], int(found.mode[job]), 0, further)
    return np.vstack([first, trace.points, np.full((further - len(trace.points), n), np.nan)])


def _slopes(
    one: SteadyReadings, marcher: Marcher, values: FloatArray, found: Any, job: int, shift: int, wanted: int
) -> FloatArray:
    """Derivatives (wanted, n, n_active) of a job's amplitudes or section points; zero where it is no periodic orbit."""
    flow, number = marcher.flow, int(found.period_number[job])
    n, none = flow.n, np.zeros((wanted, flow.n, flow.n_active))
    if not number:
        return none
    period, of_period = flow.period(values)
    z, mode, length = np.nan_to_num(found.last[job][:n]), int(found.mode[job]), number * period

    def along(times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """Derivatives (N, n, n_active) at fixed times, and rates (N, n); derivatives of the start."""
        at: FloatArray = np.unique(np.append(times, length))
        there = marcher.run(values, 0.0, at, z, mode)
        if there is None or (there := marcher.differentiated(values, there)) is None:
            return None
        assert there.D is not None and there.rate is not None
        end, here, D, rate = np.searchsorted(at, length), np.searchsorted(at, times), there.D, there.rate
        moved = D[end, :, n:] + np.outer(rate[end], number * of_period)
        try:
            of_start = np.linalg.solve(np.eye(n) - D[end, :, :n], moved)
        except np.linalg.LinAlgError:  # on a fold
            return None
        D = D[:, :, :n] @ of_start + D[:, :, n:]
        return D[here], rate[here], np.asarray(of_start)

    if not one.amplitude:
        k = shift + np.arange(wanted)
        at = along(period * np.maximum(k, 1))
        if at is None:
            return none
        table = at[0] + at[1][:, :, None] * k[:, None, None] * of_period
        return np.where((k > 0)[:, None, None], table, at[2])
    grid: Any = np.arange(1, _FINE * number + 3) * (period / _FINE)  # a whole cycle lies within its ends
    full = marcher.run(values, 0.0, grid, z, mode)
    if full is not None and len(hits := full.log.crossing_time):
        full = marcher.run(values, 0.0, np.union1d(grid, hits[(hits > 0.0) & (hits < grid[-1])]), z, mode)
    if full is None:
        return none
    instants = np.array([[_extreme(full, k, sign) for sign in (1.0, -1.0)] for k in range(n)])
    beside = np.array([-_BESIDE, _BESIDE]) * period
    wanted_at, back = np.unique(
        np.clip(instants[..., None] + beside, 0.1 * _BESIDE * period, None), return_inverse=True
    )
    at = along(wanted_at)
    if at is None:
        return none
    back, k = back.reshape(n, 2, 2), np.arange(n)[:, None]
    before, behind = (at[0][back[..., side], k] for side in (0, 1))
    rate, rate_behind = (at[1][back[..., side], k] for side in (0, 1))
    turn = rate - rate_behind
    part = np.where(np.abs(turn) > 0, rate / np.where(turn == 0, 1.0, turn), 0.0)
    ends = before + np.clip(part, 0.0, 1.0)[..., None] * (behind - before)
    return 0.5 * (ends[:, 0] - ends[:, 1])[None]


def _extreme(motion: SampledRun, k: int, sign: float) -> float:
    """The instant of the largest (sign 1) or least (-1) value of a state: between samples where it is smooth there."""
    y, t = sign * motion.z[:, k], motion.time
    i = 1 + np.argmax(y[1:-1])
    if motion.segment[i - 1] != motion.segment[i + 1]:
        return t[i]
    one, other = np.diff(t[i - 1 : i + 2])
    down, up = np.diff(y[i - 1 : i + 2]) / (one, other)
    return t[i] + 0.5 * (down * other + up * one) / (down - up) if down > up else t[i]
