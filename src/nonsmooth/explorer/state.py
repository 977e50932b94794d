"""State of a page: plain values that one line of a URL can hold, and nothing that could be executed."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Annotated, Any
from urllib.parse import parse_qsl, urlencode

from nonsmooth.explorer.kinds import PANELS, SETTINGS
from nonsmooth.system.kinds import above, at_least, reader_of

#: Fields that hold one of these words, with what a person reads for it.
CHOICES: dict[str, dict[str, str]] = {
    "direction": {
        "both": "up and down",
        "up": "up",
        "down": "down",
        "rest": "each from rest",
        "many": "8 starts each",
    },
    "method": {"auto": "exact or Taylor", "smoothed": "smoothed switch", "rkf45": "RKF45"},
    **PANELS,
}
#: Whole numbers, with their limits, and what each number of a page may be.
_WHOLE = {"transient": at_least(0, 100_000), "keep": at_least(4, 2000), "columns": at_least(10, 4000)}
_NUMBERS: dict[str, Any] = {name: Annotated[int, limit] for name, limit in _WHOLE.items()} | {
    "eta": Annotated[float, above(0)],
    **dict.fromkeys(("phase", "low", "high"), float),
}


#: Numbers as they are written; ``float`` takes underscores and the digits of every script besides.
_NUMBER = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?\s*", re.ASCII | re.IGNORECASE)


@dataclass(frozen=True)
class PageState:
    """The contents of a page.

    Attributes
    ----------
    model : str
    values : mapping
        Every parameter of the model.
    over, low, high
        The parameter of the diagram and its range.
    start : tuple of float
        Initial state of the orbit.
    x, y : str
        States of the phase plane.
    shown : str
        State of the diagram's ordinate.
    phase : float
        Of the section, in forcing periods.
    upper, plane, lower : str
        The view that each of these panels shows.
    settings : mapping
        Of the views, by name (see :class:`nonsmooth.explorer.kinds.ViewSetting`); what is not held is the default.
    """

    model: str
    values: Mapping[str, float]
    over: str
    low: float
    high: float
    start: tuple[float, ...]
    x: str
    y: str
    shown: str
    phase: float = 0.0
    eta: float = 1e-5
    direction: str = "both"
    method: str = "auto"
    transient: int = 300
    keep: int = 100
    columns: int = 600
    upper: str = "diagram"
    plane: str = "portrait"
    lower: str = "history"
    settings: Mapping[str, float | str] = field(default_factory=dict)

    def with_value(self, name: str, value: float) -> PageState:
        """The same with another value of a parameter."""
        return replace(self, values={**self.values, name: value})

    def but(self, field: str, value: Any) -> PageState:
        """The same with another value of a field."""
        given: dict[str, Any] = {field: value}
        return replace(self, **given)

    def with_settings(self, values: Mapping[str, float | str | None]) -> PageState:
        """The same with other settings of views, ``view.setting``; None for the default."""
        found = {**self.settings, **values}
        return replace(self, settings={name: value for name, value in found.items() if value is not None})


def to_query(state: PageState) -> str:
    """The state as the query of a URL; a parameter stands under its name with ``p.`` before it."""
    pairs: list[tuple[str, str]] = []
    for one in fields(state):
        value = getattr(state, one.name)
        if one.name == "values":
            pairs += [(f"p.{name}", repr(float(number))) for name, number in value.items()]
        elif one.name == "settings":
            pairs += [(name, str(given)) for name, given in value.items()]
        elif one.name == "start":
            pairs.append(("start", " ".join(repr(float(number)) for number in value)))
        elif one.default != value:
            pairs.append((one.name, repr(value) if isinstance(value, float) else str(value)))
    return urlencode(pairs)


def from_query(query: str | Sequence[tuple[str, str]], default: PageState, states: Sequence[str]) -> PageState:
    """The state that a query describes; what it leaves out is that of ``default``, a state of the same model.

    ValueError: names that the model does not have, and text that is no number."""
    pairs = parse_qsl(query) if isinstance(query, str) else query
    for name, text in pairs:
        default = changed(default, name, text, states)
    return default


def changed(state: PageState, name: str, value: Any, states: Sequence[str]) -> PageState:
    """The state after one field, or a parameter ``p.NAME``, has been given a value in text or as a number.

    ValueError: a field, a parameter or a value that does not exist; the message says what is allowed."""
    if name == "model":
        return state
    if name.startswith("p."):
        parameter = name[2:]
        if parameter not in state.values:
            raise ValueError(f"{parameter!r} is no parameter; there are: {', '.join(state.values)}")
        return state.with_value(parameter, number_of(value, parameter))
    if name in SETTINGS:
        return _with_setting(state, name, value)
    words = {**CHOICES, "over": state.values, **dict.fromkeys(("x", "y", "shown"), states)}
    if name in words:
        if value not in (allowed := [*words[name]]):
            raise ValueError(f"{name} = {str(value)[:40]!r}; allowed: {', '.join(allowed)}")
        return state.but(name, str(value))
    if name.startswith("start."):
        at = [f"start.{one}" for one in states].index(name)
        return changed(state, "start", [*state.start[:at], value, *state.start[at + 1 :]], states)
    if name == "start":
        parts = value.split() if isinstance(value, str) else list(value)
        if len(parts) != len(states):
            raise ValueError(f"start: give {len(states)} numbers, of {', '.join(states)}")
        return state.but(name, tuple(number_of(part, name) for part in parts))
    if name in _NUMBERS:
        number = reader_of(_NUMBERS[name])(number_of(value, name), name)
        return state.but(name, number % 1.0 if name == "phase" else number)
    raise ValueError(f"{name!r} is nothing that a view holds")


def within(name: str, value: int) -> int:
    """The nearest value that the page allows for a field that holds a whole number."""
    return int(min(max(value, _WHOLE[name].low), _WHOLE[name].high))


def number_of(value: Any, name: str) -> float:
    """A finite number from what a browser sent. ValueError: anything else."""
    text = isinstance(value, str)
    try:
        number = math.nan if isinstance(value, bool) or (text and not _NUMBER.fullmatch(value)) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"{name}: {str(value)[:40]!r} is no number; write it as 0.45 or 4.5e-1")
    return number


def _with_setting(state: PageState, name: str, value: Any) -> PageState:
    """Words that a setting has no choice of become its default where it is read."""
    setting = SETTINGS[name]
    found = {key: given for key, given in state.settings.items() if key not in setting.also}
    found[name] = number_of(value, name) if setting.choices is None else str(value)[:60]
    return replace(state, settings=found)


class History:
    """States that can be gone back to. Changes of one field in a row, as by a slider, are one step."""

    LONGEST = 200

    def __init__(self, state: PageState) -> None:
        self.state = state
        self._back: list[PageState] = []
        self._forth: list[PageState] = []
        self._field: str | None = None

    def put(self, state: PageState, field: str | None = None) -> None:
        """Go on to a state; ``field`` names what a slider moves."""
        if state == self.state:
            return
        if field is None or field != self._field:
            self._back.append(self.state)
            del self._back[: -self.LONGEST]
        self._field = field
        self._forth.clear()
        self.state = state

    def undo(self) -> bool:
        """Go one step back, where there is one."""
        return self._move(self._back, self._forth)

    def redo(self) -> bool:
        """Go one step forward again, where there is one."""
        return self._move(self._forth, self._back)

    @property
    def can(self) -> tuple[bool, bool]:
        """Availability of a step back, and of one forward."""
        return bool(self._back), bool(self._forth)

    def end_step(self) -> None:
        """A slider was let go: its next move is a step of its own."""
        self._field = None

    def _move(self, source: list[PageState], target: list[PageState]) -> bool:
        if not source:
            return False
        target.append(self.state)
        self.state = source.pop()
        self._field = None
        return True
