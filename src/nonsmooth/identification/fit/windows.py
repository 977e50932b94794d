"""Windows of records, each with its own free start, as a problem for the iteration of ``arrow.settle``.

The rows of a window are its readings in the order of time, then one for each state of its start: how far the start has
moved from where it was set, in units of a spread so wide that it only matters for what the window does not determine.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import BoolArray, FloatArray, IntArray
from nonsmooth.errors import SystemDefinitionError
from nonsmooth.flow.sampled import SampledRun
from nonsmooth.identification.arrow import Residuals
from nonsmooth.identification.fit.jumps import Sides, sided
from nonsmooth.identification.fit.motion import Marcher
from nonsmooth.identification.fit.records import Record
from nonsmooth.identification.fit.sensors import Observable, Sensor, Unknowns
from nonsmooth.identification.fit.steady import ROUNDING, SteadyReadings, predicted
from nonsmooth.identification.fit.window import Window
from nonsmooth.system.system import System


class There(NamedTuple):
    """A run at some unknowns: the system's parameters (None where its equations do not allow them), its sensors, the
    system's time over that of the recording, and the phase."""

    values: FloatArray | None
    sensors: dict[str, Sensor]
    clock: float
    phase: float

    @property
    def delays(self) -> FloatArray:
        """Delay of each sensor."""
        return np.array([sensor.delay for sensor in self.sensors.values()])

    def begun(self, time: Any) -> Any:
        """The instants of the system that samples at these times of the recording show first: by the longest delay."""
        return self.clock * time - self.delays.max()


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows of all records with the system, its sensors and the unknowns.

    ``noise``: standard deviation of a reading of each quantity, rounding included. ``modes``: in which each record
    may begin, the first guess first. ``colour``: correlation of readings of each quantity over its ``step``. ``loss``:
    noise deviations from which on a residual counts linearly (Huber). ``reach``: steps within which a reading may lie
    on the other side of a transition at which it jumps. ``steady``: readings of steady states, which are runs behind
    the records.
    """

    system: System
    marcher: Marcher
    records: list[Record]
    sensors: Mapping[str, Sensor]
    unknowns: Unknowns
    noise: FloatArray
    modes: list[tuple[int, ...]]
    colour: FloatArray
    loss: float = np.inf
    reach: float = 1.0
    pieces: list[Window] = field(default_factory=list)
    steady: tuple[SteadyReadings, ...] = ()

    def of(self, pieces: list[Window]) -> Windows:
        """The same problem with other windows."""
        return replace(self, pieces=pieces)

    @property
    def plain(self) -> Windows:
        """The problem of the records alone, with readings taken for independent."""
        return replace(self, colour=np.zeros(len(self.sensors)), steady=())

    @cached_property
    def steps(self) -> FloatArray:
        """Median time from reading to reading (records, quantities); infinite where there are not two."""
        times = [[record.time[np.isfinite(y)] for y in record.values.T] for record in self.records]
        return np.array([[np.median(np.diff(t)) if len(t) > 1 else np.inf for t in each] for each in times])

    @cached_property
    def step(self) -> FloatArray:
        """The shortest of these of each quantity."""
        return self.steps.min(axis=0, initial=np.inf)

    def gaps(self, c: int, time: FloatArray) -> FloatArray:
        """Times between readings of a quantity, in its steps."""
        return np.maximum(np.diff(time) / self.step[c], 0.2)

    @cached_property
    def least(self) -> FloatArray:
        """Least noise of a reading of each quantity: its sensor's rounding, or that of the arithmetic."""
        largest = [np.nanmax(np.abs(record.values), axis=0, initial=0.0) for record in self.records]
        floors = [sensor.floor for sensor in self.sensors.values()]
        return np.maximum(np.maximum(floors, ROUNDING * np.max(largest, axis=0, initial=0.0)), 1e-300)

    @property
    def rounded(self) -> float:
        """Part of the variances of all readings' noise that is the least."""
        of = [window.readings[1] for window in self.pieces]
        return float(np.mean(((self.least / self.noise) ** 2)[np.concatenate(of)])) if of else 0.0

    @cached_property
    def counts(self) -> NDArray[np.intp]:
        """Number of readings of each window."""
        return np.array([len(window.readings[0]) for window in self.pieces], np.intp)

    @cached_property
    def readouts(self) -> list[Observable]:
        return [Observable(self.system, name, self.marcher.flow.places) for name in self.sensors]

    @cached_property
    def jumps(self) -> bool:
        """Mark of readings of which one may jump at a transition."""
        return any(one.jumps for one in self.readouts)

    @cached_property
    def starts(self) -> FloatArray:
        """Starts of the windows as they are set (windows, n)."""
        return np.array([window.start for window in self.pieces]).reshape(-1, self.marcher.flow.n)

    def at(self, theta: FloatArray, run: int) -> There:
        """A run at these values of the unknowns; kept, since many windows ask at the same unknowns."""
        u, key, places = self.unknowns, theta.tobytes(), self.unknowns.places[run]
        if run in self._kept and self._kept[run][0] == key:
            return self._kept[run][1]
        sensors = dict(self.sensors)
        for i, (quantity, what) in zip(places[len(u.active) :], u.sensors, strict=False):
            value: Any = float(theta[i]) or (1e-300 if what == "gain" else 0.0)
            sensors[quantity] = replace(sensors[quantity], **{what: value})
        own = dict(zip(u.active, map(float, theta[places]), strict=False))
        values: FloatArray | None = None
        with suppress(SystemDefinitionError, ValueError):
            values = self.system.with_parameters({**own, **self.runs[run].settings}).parameter_vector()
        clock = float(theta[u.clock_place(run)]) if u.clock else 1.0
        there = There(values, sensors, clock, float(theta[places[-1]]) if u.phases else 0.0)
        self._kept[run] = key, there
        return there

    @cached_property
    def _kept(self) -> dict[int, tuple[bytes, There]]:
        return {}

    @property
    def runs(self) -> list[Record | SteadyReadings]:
        return [*self.records, *self.steady]

    def acts(self, run: int) -> BoolArray:
        """Marks of the active parameters that are not set in a run."""
        return np.array([name not in self.runs[run].settings for name in self.unknowns.active], bool)

    def marched(self, theta: FloatArray, window: Window, start: FloatArray) -> SampledRun | None:
        """The motion of a window at its samples; where delays differ, at the instants of each quantity in turn."""
        times = self.instants(theta, window)
        return self.march(theta, window.record, window.begin, times, start, window.mode)

    def motion(
        self, theta: FloatArray, window: Window, start: FloatArray, derivatives: bool = False
    ) -> SampledRun | None:
        """The motion as the readings tell it: within reach of a transition at which one jumps, they stand on the side
        that they fit."""
        found = self.marched(theta, window, start)
        if found is not None and len(found.log.crossing_time) and self.jumps:
            found = self._sided(theta, window, found)
        if found is None or not derivatives:
            return found
        return self.marcher.differentiated(self._values(theta, window), found)

    def _sided(self, theta: FloatArray, window: Window, motion: SampledRun) -> SampledRun:
        sensors, values = self.at(theta, window.record).sensors.values(), self._values(theta, window)

        def jumps(time: FloatArray, sides: Sides) -> BoolArray:
            """Mark the transitions at which a reading jumps by more than its noise."""
            found = np.zeros(len(time), bool)
            for noise, readout, sensor in zip(self.noise, self.readouts, sensors, strict=True):
                before, after = (readout.value(time, z, mode, values) for z, mode in sides)
                found |= np.abs(sensor.gain * (after - before)) > noise
            return found

        def misfit(one: SampledRun) -> FloatArray:
            """Sum of the squared residuals of each sample, over the noise."""
            left = window.values[window.readings] - self.readings(theta, window, one, False)[0]
            left, _ = self._censored(window, left, left[:0])
            squares = (left / self.noise[window.readings[1]]) ** 2
            return np.bincount(self.samples_of(theta, window), squares, len(one.time)).astype(float)

        return sided(self.marcher.flow, values, motion, self.reach * self.steps[window.record].min(), jumps, misfit)

    def _values(self, theta: FloatArray, window: Window) -> FloatArray:
        values = self.at(theta, window.record).values
        assert values is not None
        return values

    def samples_of(self, theta: FloatArray, window: Window) -> IntArray:
        """The sample of the motion of each reading."""
        (k, c), there = window.readings, self.at(theta, window.record)
        return np.searchsorted(self.instants(theta, window), there.clock * window.time[k] - there.delays[c])

    def march(
        self,
        theta: FloatArray,
        run: int,
        begin: float,
        times: FloatArray,
        start: FloatArray,
        mode: int,
    ) -> SampledRun | None:
        """A motion from what a sample at ``begin`` shows to times of the corrected clock; None where it comes to no
        end."""
        there = self.at(theta, run)
        if there.values is None or not np.isfinite(theta).all() or not np.isfinite(start).all():
            return None
        period = self.system.period_at(there.values)
        shift = 0.0 if period is None else there.phase * period
        at = there.begun(begin) + shift
        return self.marcher.run(there.values, at, times + shift, start, mode, self.records[run].drive)

    def instants(self, theta: FloatArray, window: Window) -> FloatArray:
        """Times on the record's corrected clock at which the motion is needed."""
        there = self.at(theta, window.record)
        delays, time = there.delays, there.clock * window.time
        return time - delays[0] if (delays == delays[0]).all() else np.unique(time[:, None] - np.unique(delays))

    def readings(
        self, theta: FloatArray, window: Window, motion: SampledRun, slopes: bool
    ) -> tuple[FloatArray, FloatArray]:
        """Predicted readings (R,), and their derivatives (R, unknowns of the window + n) where asked for."""
        values, sensors, _, phase = self.at(theta, window.record)
        assert values is not None
        u, (k, c) = self.unknowns, window.readings
        n, a, p = self.marcher.flow.n, len(u.active), len(window.which)
        longest = max(sensors, key=lambda name: sensors[name].delay)
        period, of_period = self.marcher.flow.period(values)
        predicted, table = np.empty(len(k)), np.zeros((len(k) if slopes else 0, p + n))
        of_reading = self.samples_of(theta, window)
        for j, (name, sensor) in enumerate(sensors.items()):
            rows = np.flatnonzero(c == j) if len(sensors) > 1 else slice(None)
            at = of_reading[rows]
            t, z, mode = motion.time[at], motion.z[at], motion.mode[at]
            readout = self.readouts[j]
            raw = readout.value(t, z, mode, values)
            predicted[rows] = sensor.gain * raw + sensor.offset
            if not slopes:
                continue
            assert motion.D is not None and motion.rate is not None and motion.of_time is not None
            along = motion.D[at], motion.rate[at], motion.of_time[at]
            of_all, now, of_shift = readout.slopes(t, z, mode, values, *along)
            table[rows, p:], table[rows, :a] = sensor.gain * of_all[:, :n], sensor.gain * of_all[:, n:]
            for i, (quantity, what) in enumerate(u.sensors, start=a):
                if what == "delay":  # of the reading, and with the longest one the motion begins
                    late, begun = quantity == name, quantity == longest
                    table[rows, i] = sensor.gain * ((begun - late) * now - begun * of_shift)
                elif quantity == name:
                    table[rows, i] = raw if what == "gain" else 1.0
            if u.clock:
                since = window.time[k[rows]] - window.begin
                table[rows, a + len(u.sensors)] = sensor.gain * (now * since + of_shift * window.begin)
            if u.phases:
                table[rows, :a] += sensor.gain * phase * of_shift[:, None] * of_period
                table[rows, p - 1] = sensor.gain * period * of_shift
        table[:, :a] *= self.acts(window.record)
        return predicted, table

    def limits(self, window: Window) -> FloatArray:
        """1 for each reading at the upper limit of its sensor, -1 at the lower one, else 0."""
        k, c = window.readings
        if all(sensor.range is None for sensor in self.sensors.values()):
            return np.zeros(len(k))
        at = np.stack([sensor.limit(window.values[:, j]) for j, sensor in enumerate(self.sensors.values())], axis=1)
        return at[k, c]

    def shown(self, window: Window, predicted: FloatArray) -> FloatArray:
        """Predicted readings as their sensors show them, which end at their limits."""
        limits = np.array([sensor.range or (-np.inf, np.inf) for sensor in self.sensors.values()])
        return np.clip(predicted, *limits[window.readings[1]].T)

    def _censored(self, window: Window, r: FloatArray, table: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals and derivatives where those at a limit are of the likelihood of being there or beyond."""
        side = self.limits(window)
        at = np.flatnonzero(side)
        if not len(at):
            return r, table
        from scipy.special import log_ndtr

        noise = self.noise[window.readings[1][at]]
        z = -side[at] * r[at] / noise
        far = np.sqrt(np.maximum(-2.0 * log_ndtr(z), 1e-300))
        r, table = r.copy(), table.copy()
        r[at] = side[at] * noise * far
        ratio = np.exp(-0.5 * z**2 - log_ndtr(z)) / np.sqrt(2.0 * np.pi)  # density over probability
        if len(table):
            table[at] *= (ratio / far)[:, None]
        return r, table

    def _whitened(self, window: Window, rows: FloatArray) -> FloatArray:
        """Rows of the readings as independent ones of the same size: each less what the one before tells of it."""
        if not self.colour.any():
            return rows
        (k, c), plain, out = window.readings, self.limits(window) == 0, rows.copy()
        for j in np.flatnonzero(self.colour).tolist():
            at = np.flatnonzero((c == j) & plain)
            if len(at) < 2:
                continue
            told = self.colour[j] ** self.gaps(j, window.time[k[at]])[:, None]
            out[at[1:]] = (rows[at[1:]] - told * rows[at[:-1]]) / np.sqrt(1.0 - told**2)
        return out

    def rows(self, state: Residuals) -> list[tuple[Window, FloatArray]]:
        """The windows with the residuals of their readings."""
        return [(w, r[:n]) for w, n, r in zip(self.pieces, self.counts, state.residuals, strict=True)]

    def cost(self, theta: FloatArray, starts: FloatArray) -> float:
        """Sum of squares, or of the loss, priors included."""
        state, away = self.residuals(theta, starts), theta - self.unknowns.centre
        return state.chi2(self.weights(state, summed=True)) + float(away @ self.unknowns.precision @ away)

    def residuals(self, theta: FloatArray, starts: FloatArray, slopes: bool = False) -> Residuals:
        """Residuals of all windows, not finite where a motion does not come to its end; with derivatives on request."""
        state = Residuals([], [], [])
        for window, start in zip(self.pieces, starts, strict=True):
            motion = self.motion(theta, window, start, slopes)
            free, n, p = window.free, len(window.readings[0]), len(window.which)
            rows = n + len(free)
            left, in_parameters, in_start = np.full(rows, np.inf), np.zeros((rows, p)), np.zeros((rows, len(start)))
            if motion is not None:
                predicted, table = self.readings(theta, window, motion, slopes)
                r, table = self._censored(window, window.values[window.readings] - predicted, table)
                left[:n], left[n:] = self._whitened(window, r[:, None])[:, 0], (window.start - start)[free]
                if slopes:
                    table[~np.isfinite(table).all(axis=1)] = 0.0  # behind a graze, where there are no derivatives
                    table = self._whitened(window, table)
                    in_parameters[:n], in_start[:n, free] = table[:, :p], table[:, p:][:, free]
                    in_start[range(n, rows), free] = 1.0
            state.residuals.append(left)
            state.in_parameters.append(in_parameters)
            state.in_start.append(in_start)
        if not self.steady:
            return state
        parts = []
        for i, one in enumerate(self.steady):
            fitted, _, table = self.of_steady(theta, i, slopes)
            r, table = ((one.measured - fitted) / one.noise)[one.used], table[one.used]
            far = np.abs(r) > self.loss  # of the root of Huber's loss, which is linear there
            root = np.sqrt(np.where(far, self.loss * (2.0 * np.abs(r) - self.loss), r**2)) if far.any() else np.abs(r)
            slope = np.where(far, self.loss / np.where(far, root, 1.0), 1.0) / one.noise[one.used]
            parts.append((np.where(np.isnan(r), np.inf, np.sign(r) * root), slope[:, None] * table))
        return replace(
            state, alone=np.concatenate([r for r, _ in parts]), of_alone=np.vstack([table for _, table in parts])
        )

    def of_steady(self, theta: FloatArray, i: int, slopes: bool = False) -> tuple[FloatArray, BoolArray, FloatArray]:
        """Predictions of steady readings (NaN: none), where they are periodic, and their derivatives in all
        unknowns."""
        one, run, u = self.steady[i], len(self.records) + i, self.unknowns
        values, sensors, *_ = self.at(theta, run)
        table = np.zeros((len(one.measured), len(theta) * slopes))
        if values is None or not np.isfinite(theta).all():
            return np.full(len(one.measured), np.nan), np.zeros(len(one.measured), bool), table
        own = [sensors.get(q, Sensor()) for q in one.quantities]
        fitted, periodic, of = predicted(one, self.marcher, values, own, slopes)
        if slopes:
            places, a = u.places[run], len(u.active)
            table[:, places[:a]] = of[:, :a] * self.acts(run)
            for k, (quantity, what) in zip(places[a:], u.sensors, strict=False):
                if quantity in one.quantities and what != "delay":
                    mine = one.quantity == one.quantities.index(quantity)
                    table[mine, k] = of[mine, a if what == "gain" else a + 1]
        return fitted, periodic, table

    def weights(self, state: Residuals | None, starts: bool = True, summed: bool = False) -> list[FloatArray]:
        """One over the standard deviation of each row; less for those that the loss weighs down: so that the sum of
        squares falls as the loss does, or is the loss where it is ``summed``. Those of the ``starts``, which hold what
        a window does not determine, are no readings, and 0 on request."""
        found = []
        for i, w in enumerate(self.pieces):
            weight = 1.0 / self.noise[w.readings[1]]
            if state is not None and np.isfinite(self.loss):
                part = self.loss / np.maximum(np.abs(state.residuals[i][: len(weight)] * weight), self.loss)
                weight = weight * np.sqrt(part * (2.0 - part) if summed else part)
            found.append(np.concatenate([weight, starts / w.spread[w.free]]))
        return found
