"""A recording as the page holds it: its runs and channels, and which of them shows which state."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.explorer.state import number_of

if TYPE_CHECKING:
    from nonsmooth.system.system import System

LARGEST = 64 << 20  # bytes of a file that the page takes
_MOST = 6000  # samples that are drawn and compared
_PREFIXES = {"": 1.0, "c": 1e-2, "m": 1e-3, "µ": 1e-6, "μ": 1e-6, "u": 1e-6, "n": 1e-9, "k": 1e3}
_ANGLES = {"deg": math.pi / 180, "°": math.pi / 180, "rev": 2 * math.pi}


@dataclass(frozen=True, eq=False)
class Channel:
    """One channel of one run."""

    unit: str
    time: FloatArray
    values: FloatArray


@dataclass(frozen=True, eq=False)
class RecordedFile:
    """A file that was dropped into the page, as the worker has read it.

    Attributes
    ----------
    axis : str
        ``"time"``, or ``"frequency"`` of a table of amplitudes, whose ``Channel.time`` are then frequencies in Hz.
    """

    file: str
    runs: Mapping[str, Mapping[str, Channel]]
    remarks: tuple[str, ...]
    synthetic: bool
    axis: str = "time"


@dataclass(frozen=True)
class Shown:
    """The channel that shows a state, "" where none does: state = factor * reading + shift."""

    channel: str = ""
    factor: float = 1.0
    shift: float = 0.0


@dataclass(frozen=True, eq=False)
class Setup:
    """The reading of a recording as the motion of a model.

    Attributes
    ----------
    recorded : RecordedFile
    system : System
    run : str
    states : mapping
        How each state is shown.
    turns : str
        Channel with one row for each turn of the drive; "" where there is none.
    begin, end : float
        The piece in use, in seconds.
    """

    recorded: RecordedFile
    system: System
    run: str
    states: Mapping[str, Shown]
    turns: str
    begin: float
    end: float

    @property
    def shown(self) -> dict[str, Channel]:
        """State to channel, of those that are shown."""
        return {state: self.channels[one.channel] for state, one in self.states.items() if one.channel}

    @property
    def channels(self) -> Mapping[str, Channel]:
        """Channels of the run."""
        return self.recorded.runs[self.run]

    def changed(self, name: str, value: Any) -> Setup:
        """The same with another value of a field: ``run``, ``turns``, ``begin``, ``end``, ``channel.STATE``, ....

        ValueError: a field, a state or a channel that does not exist, and text that is no number."""
        if name == "run":
            return matched(self.recorded, self.system, _known(value, self.recorded.runs, "run"))
        if name in ("begin", "end"):
            ends: dict[str, Any] = {name: number_of(value, name)}
            made = replace(self, **ends)
            if not made.begin < made.end:
                raise ValueError(f"the piece from {made.begin:g} to {made.end:g} s is empty")
            return made
        if name == "turns":
            return replace(self, turns=_known(value, ["", *self.channels], "channel"))
        what, _, state = name.partition(".")
        if what not in ("channel", "factor", "shift") or state not in self.states:
            raise ValueError(f"{name[:40]!r} is nothing that a recording has")
        new: dict[str, Any] = {what: value}
        if what != "channel":
            new[what] = number_of(value, name)
        elif _known(value, ["", *self.channels], "channel"):
            new["factor"] = _factor(self.channels[value].unit, self.system.states[state]) or 1.0
        if new == {"factor": 0}:
            raise ValueError(f"{name} = 0 makes every reading equal; give how much of the state one unit shows")
        return replace(self, states={**self.states, state: replace(self.states[state], **new)})

    @cached_property
    def samples(self) -> RecordedStates | None:
        """The piece in use, in the states' units; at most the last ``_MOST`` samples. None where no state is shown."""
        if not self.shown or self.recorded.axis != "time":
            return None
        every = np.unique(np.concatenate([one.time for one in self.shown.values()]))
        time = every[(every >= self.begin) & (every <= self.end)][-_MOST:]
        columns = {}
        for state, one in self.shown.items():
            columns[state], inside = np.full(len(time), np.nan), np.isin(one.time, time)
            readings = self.states[state].factor * one.values[inside] + self.states[state].shift
            columns[state][np.searchsorted(time, one.time[inside])] = readings
        return RecordedStates(time, columns, self.channels[self.turns].time if self.turns else np.empty(0))

    def response(self, values: Mapping[str, float], over: str, state: str) -> tuple[FloatArray, FloatArray]:
        """Measured response of a state: values of the parameter that sets the forcing period, and amplitudes.

        Each run with turns of the drive is one point, half its peak-to-peak value at the mean period of its turns; the
        run in use without them is a point at the model's own period. A table over frequency holds its points. Where
        ``over`` does not set the forcing period, or the state was not recorded, there are none.
        """
        name, factor = self.states[state].channel, abs(self.states[state].factor)
        now = forcing_period(self.system, values)
        points: list[tuple[float, float]] = []
        for run, channels in self.recorded.runs.items():
            if name not in channels or now is None:
                continue
            one = channels[name]
            inside = (one.time >= self.begin) & (one.time <= self.end) if run == self.run else slice(None)
            axis, readings = one.time[inside], one.values[inside]
            turns = channels[self.turns].time if self.turns in channels else ()
            if self.recorded.axis != "time":
                points += [(1 / f, factor * a) for f, a in zip(axis, readings, strict=True) if f > 0 and np.isfinite(a)]
            elif len(readings) and ((counted := len(turns) >= 3) or run == self.run):
                period = float(np.diff(turns).mean()) if counted else now
                points.append((period, 0.5 * factor * float(np.nanmax(readings) - np.nanmin(readings))))
        found = [(frequency_of(self.system, values, period).get(over), height) for period, height in points]
        places, heights = np.array([one for one in found if one[0] is not None], float).reshape(-1, 2).T
        return places, heights

    def unlike(self) -> list[str]:
        """Sentences on channels whose unit is not the state's, while their factor is still 1."""
        return [
            f"{self.states[state].channel} is in {one.unit or 'no unit'}, {state} in {unit}: give the factor"
            for state, one in self.shown.items()
            if self.states[state].factor == 1.0
            and (unit := self.system.states[state]) not in ("", "1")
            and not _factor(one.unit, unit)
        ]


@dataclass(frozen=True, eq=False)
class RecordedStates:
    """Recorded states of a model, for the worker.

    Attributes
    ----------
    time : array (N,)
        Seconds.
    columns : mapping of state to array (N,)
        In the states' units; NaN where there is no reading.
    turns : array
        Times at which the drive passed its mark; empty where they were not recorded.
    """

    time: FloatArray
    columns: Mapping[str, FloatArray]
    turns: FloatArray

    @cached_property
    def key(self) -> str:
        """Hash of all values."""
        digest = hashlib.sha256()
        for name, values in {"": self.time, **self.columns, "turns": self.turns}.items():
            digest.update(name.encode() + b"\0" + np.ascontiguousarray(values).tobytes())
        return digest.hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RecordedStates) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


def matched(recorded: RecordedFile, system: System, run: str = "") -> Setup:
    """The setup that names and units suggest."""
    run = run or next(iter(recorded.runs))
    channels = recorded.runs[run]
    turns = next((name for name in channels if name.casefold().startswith("turn")), "")
    free = [name for name in channels if name != turns]
    found: dict[str, str] = {}
    for state in system.states:
        if same := [name for name in free if name.casefold() == state.casefold()]:
            found[state] = same[0]
    for state, unit in system.states.items():
        left = [name for name in free if name not in found.values() and _factor(channels[name].unit, unit)]
        if state not in found and unit not in ("", "1") and left:
            found[state] = left[0]
    if not found and free:
        likely = [name for name in free if recorded.axis != "time" and "amplitude" in name.casefold()]
        found[next(iter(system.states))] = (likely or free)[0]
    shown = dict.fromkeys(system.states, Shown()) | {
        state: Shown(name, _factor(channels[name].unit, system.states[state]) or 1.0) for state, name in found.items()
    }
    times = np.concatenate([channels[name].time for name in found.values()] or [np.array([0.0, 1.0])])
    return Setup(recorded, system, run, shown, turns, float(times.min()), float(times.max()))


def frequency_of(system: System, values: Mapping[str, float], period: float) -> dict[str, float]:
    """The parameter that alone sets the forcing period, at the value that makes it this long; empty where none does.

    Frequencies, whose period is inversely proportional to them, and periods themselves are found.
    """
    now = forcing_period(system, values)
    if now is None:
        return {}
    from nonsmooth.diagrams.response import forcing_parameters

    for name in forcing_parameters(system):
        for other in (values[name] * now / period, values[name] * period / now):
            if abs((forcing_period(system, {**values, name: other}) or 0.0) - period) < 1e-9 * period:
                return {name: other}
    return {}


def forcing_period(system: System, values: Mapping[str, float]) -> float | None:
    """The forcing period; None where there is none, as at the frequency 0."""
    try:
        period = system.period_at(values)
    except ZeroDivisionError:
        return None
    return period if period is not None and 0 < period < math.inf else None


def _factor(unit: str, wanted: str) -> float | None:
    """Size of one unit in another; None where they do not measure the same."""
    if wanted == "rad" and unit in _ANGLES:
        return _ANGLES[unit]
    return next((size for prefix, size in _PREFIXES.items() if unit == prefix + wanted), None)


def _known(value: Any, allowed: Any, what: str) -> str:
    if value not in allowed:
        names = ", ".join(repr(one) for one in allowed)
        raise ValueError(f"{str(value)[:40]!r} is no {what} of this recording; there are: {names}")
    return str(value)
