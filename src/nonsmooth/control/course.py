"""The way of a continuation through the settings of a drive: what is varied, from where, over which range."""

from __future__ import annotations

from dataclasses import dataclass

from nonsmooth.control.holding import Held
from nonsmooth.control.outcome import Names
from nonsmooth.errors import unknown


@dataclass(frozen=True)
class Course:
    """The drive at the beginning, and which of its two settings is varied over which range."""

    parameter: str  # "frequency" or "amplitude"
    low: float
    high: float
    frequency: float
    amplitude: float
    rising: bool

    def setting(self, value: float) -> tuple[float, float]:
        """Frequency and amplitude of the drive at a value of the parameter."""
        return (value, self.amplitude) if self.parameter == "frequency" else (self.frequency, value)

    def of(self, held: Held) -> float:
        """The parameter that was really set."""
        return float(getattr(held, self.parameter))

    def inside(self, value: float) -> bool:
        """Return whether a value lies in the range."""
        return self.low <= value <= self.high


def course_of(
    names: Names, parameter: str, range: tuple[float, float], frequency: float, amplitude: float, direction: str
) -> Course:
    """The course that was asked for, checked.

    Raises
    ------
    ValueError, TypeError
        Settings that do not fit the drive or each other.
    """
    own = {"frequency": "frequency", "amplitude": "amplitude"}
    known = own | {names.frequency: "frequency", names.amplitude: "amplitude"}
    if parameter not in known:
        raise ValueError(unknown(parameter, "a parameter", "the drive", known))
    (low, high), varied = range, known[parameter]
    begin = {"frequency": frequency, "amplitude": amplitude}
    if not low <= begin[varied] <= high:
        raise ValueError(f"{varied} = {begin[varied]!r} lies outside the range {low:g} ... {high:g}: begin within it")
    return Course(varied, low, high, rising=direction == "up", **begin)
