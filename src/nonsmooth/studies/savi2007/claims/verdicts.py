"""The rule by which a statement agrees or differs: in one place, for model and rig, and as the report states it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

__all__ = ["CLOSE", "MEANING", "RULE", "Beside", "Cause", "Known", "Verdict", "agreed", "judge", "judge_step"]

CLOSE = 2.0  # percent; the paper's own two natural frequencies, 4.50 and 4.60 rad/s, are 2.2 % apart


class Verdict(StrEnum):
    """All verdicts, in the order of the report; each statement has one from the model and one from the rig."""

    AGREES = "agrees"
    IN_PART = "agrees in part"
    UNDECIDED = "undecided"
    DIFFERS = "differs"
    INPUT = "input"
    ADDS = "adds to the paper"
    NOT_ASKED = "not asked"


#: What each verdict means, as the report says it.
MEANING = {
    Verdict.AGREES: "the difference, with its uncertainty, lies within the tolerance; the motion is the one stated",
    Verdict.IN_PART: "a statement of several parts, of which some hold",
    Verdict.UNDECIDED: "the uncertainty reaches across the tolerance: the number is not known well enough to tell",
    Verdict.DIFFERS: "the difference, less its uncertainty, exceeds the tolerance; the motion is another one",
    Verdict.INPUT: "a value that was put in and is read back: it counts neither for nor against the paper",
    Verdict.ADDS: "found here, not stated in the paper",
    Verdict.NOT_ASKED: "not a question to the model (or to the rig)",
}

#: The rule as the report prints it.
RULE = (
    "a ± u: u is the standard uncertainty (GUM) everywhere in this report; of a change that lies somewhere in a step "
    "of a sweep (or between two runs of the rig) it is the step over the square root of 12.",
    "d is the distance of the number found from the printed one, U its expanded uncertainty: half the step that holds "
    "the change, or half the 95 % interval of a quantity identified.",
    f"The tolerance is {CLOSE:g} % of the printed number (the paper's own two natural frequencies, 4.50 and 4.60 "
    "rad/s, are 2.2 % apart), or the resolution of the printed number where that is coarser: half a unit of its last "
    "digit; of what is read off a discrete Fourier transform half the distance of its lines.",
    "Agrees: d + U is within the tolerance. Differs: d - U exceeds it. Undecided: all else. So a larger uncertainty "
    "can turn either verdict into undecided, and never into the other.",
    "A jump agrees with a closed form when that lies in the step of the jump or within half a step beside it.",
    "A value that was put into the rig and comes back is an input, not an agreement; where it does not come back, it "
    "differs.",
)  # fmt: skip


class Cause(StrEnum):
    """Why a statement differs."""

    MISPRINT = "misprint"
    TABLE_1 = "Table 1 inconsistent with itself"
    REAL = "real"
    RIG = "the virtual rig"


class Judged(Protocol):
    """A number with its expanded uncertainty."""

    @property
    def value(self) -> float: ...

    @property
    def expanded(self) -> float: ...


class Known(Judged, Protocol):
    """A number with its standard uncertainty too: a step that holds a change, a quantity identified."""

    @property
    def uncertainty(self) -> float: ...


def agreed(met: bool) -> Verdict:
    """The verdict on a statement that holds or does not."""
    return Verdict.AGREES if met else Verdict.DIFFERS


def judge(printed: float, found: Judged | None, resolution: float = 0.0) -> Verdict:
    """The verdict on a printed number by ``RULE``; a number that was searched and not found differs."""
    if found is None:
        return Verdict.DIFFERS
    distance, tolerance = abs(found.value - printed), max(resolution, 0.01 * CLOSE * abs(printed))
    rounding = 1e-9 * abs(printed)  # of the arithmetic: 4.50 + 0.09 is within 2 %
    if distance + found.expanded <= tolerance + rounding:
        return Verdict.AGREES
    return Verdict.DIFFERS if distance - found.expanded > tolerance + rounding else Verdict.UNDECIDED


def judge_step(closed: float, found: Judged | None) -> Verdict:
    """The verdict on a closed form by the step that holds the change; a step wider than the tolerance tells nothing."""
    if found is None or abs(found.value - closed) > 2 * found.expanded:
        return Verdict.DIFFERS
    return Verdict.AGREES if found.expanded <= 0.01 * CLOSE * abs(closed) else Verdict.UNDECIDED


@dataclass(frozen=True)
class Beside:
    """A printed number and one found: what the report draws and writes of it."""

    printed: float
    resolution: float
    value: float
    expanded: float

    @classmethod
    def of(cls, printed: float, resolution: float, found: Judged | None) -> Beside | None:
        """None where nothing was found."""
        return None if found is None else cls(printed, resolution, found.value, found.expanded)

    @property
    def percent(self) -> float:
        """(found - printed) / printed."""
        return 100 * (self.value / self.printed - 1)

    @property
    def expanded_percent(self) -> float:
        """The expanded uncertainty over the printed number."""
        return 100 * self.expanded / abs(self.printed)

    def __str__(self) -> str:
        """``-3.6 %``, with the distances that its uncertainty leaves where these differ: ``-3.6 % (3.1 to 4.1)``."""
        text = f"{round(self.percent, 1) + 0.0:+.1f} %"  # + 0.0: no negative zero
        low, high = (max(0.0, abs(self.percent) + sign * self.expanded_percent) for sign in (-1, 1))
        return text if f"{low:.1f}" == f"{high:.1f}" else f"{text} ({low:.1f} to {high:.1f})"
