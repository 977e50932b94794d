"""A recording as the page holds it: its runs and channels, and which of them shows which state."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.explorer.state import number_of

if TYPE_CHECKING:
    from nonsmooth.system.system import System

FloatArray = NDArray[np.float64]
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


@dataclass(frozen=True)
class Setup:
    """The reading of a recording as the motion of a model.

    Attributes
    ----------
    run : str
    states : mapping
        How each state is shown.
    turns : str
        Channel with one row for each turn of the drive; "" where there is none.
    begin, end : float
        The piece in use, in seconds.
    """

    run: str
    states: Mapping[str, Shown]
    turns: str
    begin: float
    end: float

    @property
    def channels(self) -> dict[str, str]:
        """State to channel, of those that are shown."""
        return {state: one.channel for state, one in self.states.items() if one.channel}

    def changed(self, name: str, value: Any, recorded: RecordedFile, system: System) -> Setup:
        """The same with another value of a field: ``run``, ``turns``, ``begin``, ``end``, ``channel.STATE``, ....

        Raises
        ------
        ValueError
            A field, a state or a channel that does not exist, and text that is no number.
        """
        if name == "run":
            return matched(recorded, system, _known(value, recorded.runs, "run"))
        channels = recorded.runs[self.run]
        if name in ("begin", "end"):
            ends: dict[str, Any] = {name: number_of(value, name)}
            made = replace(self, **ends)
            if not made.begin < made.end:
                raise ValueError(f"the piece from {made.begin:g} to {made.end:g} s is empty")
            return made
        if name == "turns":
            return replace(self, turns=_known(value, ["", *channels], "channel"))
        what, _, state = name.partition(".")
        if what not in ("channel", "factor", "shift") or state not in self.states:
            raise ValueError(f"{name[:40]!r} is nothing that a recording has")
        new: dict[str, Any]
        if what == "channel":
            new = {what: _known(value, ["", *channels], "channel")}
            if value:
                new["factor"] = _factor(channels[value].unit, system.states[state]) or 1.0
        else:
            new = {what: number_of(value, name)}
            if new == {"factor": 0}:
                raise ValueError(f"{name} = 0 makes every reading equal; give how much of the state one unit shows")
        return replace(self, states={**self.states, state: replace(self.states[state], **new)})


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
    key: str = field(init=False)

    def __post_init__(self) -> None:
        digest = hashlib.sha256()
        for name, values in {"": self.time, **self.columns, "turns": self.turns}.items():
            digest.update(name.encode() + b"\0" + np.ascontiguousarray(values).tobytes())
        object.__setattr__(self, "key", digest.hexdigest())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RecordedStates) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


def matched(recorded: RecordedFile, system: System, run: str = "") -> Setup:
    """The setup that names and units suggest."""
    run = run or next(iter(recorded.runs))
    channels = recorded.runs[run]
    turns = next((name for name, one in channels.items() if name.casefold().startswith("turn")), "")
    free = [name for name in channels if name != turns]
    found: dict[str, str] = {}
    for state in system.states:
        same = [name for name in free if name.casefold() == state.casefold()]
        if same:
            found[state] = same[0]
    for state, unit in system.states.items():
        alike = [
            name
            for name in free
            if name not in found.values() and unit not in ("", "1") and _factor(channels[name].unit, unit)
        ]
        if state not in found and alike:
            found[state] = alike[0]
    if not found and free:
        likely = [name for name in free if recorded.axis != "time" and "amplitude" in name.casefold()]
        found[next(iter(system.states))] = (likely or free)[0]
    shown = dict.fromkeys(system.states, Shown()) | {
        state: Shown(name, _factor(channels[name].unit, system.states[state]) or 1.0) for state, name in found.items()
    }
    times = [channels[name].time for name in found.values()]
    begin, end = (min(t[0] for t in times), max(t[-1] for t in times)) if times else (0.0, 1.0)
    return Setup(run, shown, turns, float(begin), float(end))


def samples_of(recorded: RecordedFile, setup: Setup) -> RecordedStates | None:
    """The piece in use, in the states' units; at most the last ``_MOST`` samples. None where no state is shown."""
    channels = recorded.runs[setup.run]
    if not setup.channels or recorded.axis != "time":
        return None
    clocks = {state: channels[name].time for state, name in setup.channels.items()}
    every = np.unique(np.concatenate(list(clocks.values())))
    time = every[(every >= setup.begin) & (every <= setup.end)][-_MOST:]
    columns = {}
    for state, name in setup.channels.items():
        column = np.full(len(time), np.nan)
        own, inside = clocks[state], np.isin(clocks[state], time)
        values = channels[name].values[inside]
        column[np.searchsorted(time, own[inside])] = setup.states[state].factor * values + setup.states[state].shift
        columns[state] = column
    return RecordedStates(time, columns, channels[setup.turns].time if setup.turns else np.empty(0))


def response_points(
    recorded: RecordedFile, setup: Setup, system: System, values: Mapping[str, float], over: str, state: str
) -> tuple[FloatArray, FloatArray]:
    """Measured response of a state: values of the parameter that sets the forcing period, and amplitudes.

    Each run with turns of the drive is one point, half its peak-to-peak value at the mean period of its turns; the run
    in use without them is a point at the model's own period. A table over frequency holds its points. Where ``over``
    does not set the forcing period, or the state was not recorded, there are none.
    """
    nothing = np.empty(0), np.empty(0)
    name, factor = setup.states[state].channel, abs(setup.states[state].factor)
    now = forcing_period(system, values)
    if not name or now is None:
        return nothing
    points: list[tuple[float, float]] = []
    for run, channels in recorded.runs.items():
        if name not in channels:
            continue
        one = channels[name]
        inside = (one.time >= setup.begin) & (one.time <= setup.end) if run == setup.run else slice(None)
        axis, readings = one.time[inside], one.values[inside]
        turns = channels[setup.turns].time if setup.turns in channels else ()
        if recorded.axis != "time":
            points += [(1 / f, factor * a) for f, a in zip(axis, readings, strict=True) if f > 0 and np.isfinite(a)]
        elif len(readings) and ((counted := len(turns) >= 3) or run == setup.run):
            period = float(np.diff(turns).mean()) if counted else now
            points.append((period, 0.5 * factor * float(np.nanmax(readings) - np.nanmin(readings))))
    found = [(frequency_of(system, values, period).get(over), height) for period, height in points]
    there = [(place, height) for place, height in found if place is not None]
    return (np.array([place for place, _ in there]), np.array([height for _, height in there])) if there else nothing


def frequency_of(system: System, values: Mapping[str, float], period: float) -> dict[str, float]:
    """The parameter that alone sets the forcing period, at the value that makes it this long; empty where none does.

    Frequencies, whose period is inversely proportional to them, and periods themselves are found.
    """
    now = forcing_period(system, values)
    if now is None:
        return {}
    for name, value in values.items():
        if not value or forcing_period(system, {**values, name: 1.01 * value}) == now:
            continue
        for other in (value * now / period, value * period / now):
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


def unlike(recorded: RecordedFile, setup: Setup, system: System) -> list[str]:
    """Sentences on channels whose unit is not the state's, while their factor is still 1."""
    channels = recorded.runs[setup.run]
    return [
        f"{name} is in {channels[name].unit or 'no unit'}, {state} in {system.states[state]}: give the factor"
        for state, name in setup.channels.items()
        if setup.states[state].factor == 1.0
        and system.states[state] not in ("", "1")
        and not _factor(channels[name].unit, system.states[state])
    ]


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
