"""The rule by which a statement agrees or differs, for model and rig, and the rows of the report that it judges."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import NamedTuple, TypeAlias

import xarray as xr

from nonsmooth.identification import Estimate
from nonsmooth_savi2007.figures.resonance import grazing_of
from nonsmooth_savi2007.measure import Interval, with_uncertainty
from nonsmooth_savi2007.printed import Printed

#: Keys of the datasets of both flows.
FLOWS = ("exact", "smoothed")

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
)


class Cause(StrEnum):
    """Why a statement differs."""

    MISPRINT = "misprint"
    TABLE_1 = "Table 1 inconsistent with itself"
    REAL = "real"
    RIG = "the virtual rig"


#: A number with its standard and its expanded uncertainty: a step that holds a change, a quantity identified.
Uncertain: TypeAlias = Interval | Estimate


def agreed(met: bool) -> Verdict:
    """The verdict on a statement that holds or does not."""
    return Verdict.AGREES if met else Verdict.DIFFERS


def judge(printed: float, found: Uncertain | Beside | None, resolution: float = 0.0) -> Verdict:
    """The verdict on a printed number by ``RULE``; a number that was searched and not found differs."""
    if found is None:
        return Verdict.DIFFERS
    distance, tolerance = abs(found.value - printed), max(resolution, 0.01 * CLOSE * abs(printed))
    rounding = 1e-9 * abs(printed)  # of the arithmetic: 4.50 + 0.09 is within 2 %
    if distance + found.expanded <= tolerance + rounding:
        return Verdict.AGREES
    return Verdict.DIFFERS if distance - found.expanded > tolerance + rounding else Verdict.UNDECIDED


def judge_step(closed: float, found: Uncertain | None) -> Verdict:
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
    def of(cls, printed: Printed, found: Uncertain | None) -> Beside | None:
        """None where nothing was found."""
        return None if found is None else cls(printed.value, printed.resolution, found.value, found.expanded)

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


#: Datasets by figure and key.
Data: TypeAlias = Mapping[str, dict[str, xr.Dataset]]


class Cell(NamedTuple):
    """Outcome of the virtual rig for a statement, and its relation to the paper; without a verdict it is not asked.

    ``why`` is added to the row's own; ``beside``: the number, where one was printed.
    """

    text: str
    verdict: Verdict = Verdict.NOT_ASKED
    why: str = ""
    beside: Beside | None = None


@dataclass(frozen=True)
class Statement:
    """One statement: what the paper says (``place``: where), what both flows and the rig give, and what follows.

    ``id`` is that of its claim, which `measure_claims` writes in.
    ``verdict`` is on the exact flow, ``rig_verdict`` on the virtual rig; ``cause``: why one of them differs, where it
    is not real. The numbers beside a printed one are in ``exact_beside``, ``smoothed_beside`` and ``rig_beside``.
    """

    id: str = field(default="", kw_only=True)
    place: str
    says: str
    exact: str
    smoothed: str
    difference: str
    verdict: Verdict
    why: str = ""
    rig: str = "not asked: of the model"
    rig_verdict: Verdict = Verdict.NOT_ASKED
    cause: Cause | None = None
    exact_beside: Beside | None = None
    smoothed_beside: Beside | None = None
    rig_beside: Beside | None = None

    def measured(self, cell: Cell) -> Statement:
        """The row with what the rig says."""
        why = f"{self.why} {cell.why}".strip()
        return replace(self, rig=cell.text, rig_verdict=cell.verdict, why=why, rig_beside=cell.beside)

    @property
    def differs(self) -> bool:
        """Return whether the model or the rig gives something else than the paper says."""
        return Verdict.DIFFERS in (self.verdict, self.rig_verdict)

    @property
    def reason(self) -> Cause | None:
        """Why it differs: what was found out, else the rig where the rig alone differs, else it is real."""
        if not self.differs:
            return None
        if self.cause is not None:
            return self.cause
        return Cause.REAL if self.verdict is Verdict.DIFFERS else Cause.RIG


def of_both(
    place: str,
    says: str,
    found: Iterable[str],
    difference: str,
    verdict: Verdict,
    why: str = "",
    cause: Cause | None = None,
) -> Statement:
    """A statement with what the exact flow and the smoothed one give."""
    exact, smoothed = found
    return Statement(place, says, exact, smoothed, difference, verdict, why, cause=cause)


def printed_cell(
    printed: Printed, found: Uncertain | None, note: str = "", why: str = "", *, put_in: bool = False
) -> Cell:
    """The rig's number beside a printed one; ``put_in``: that the rig was given, or that follows from what it was."""
    verdict = judge(printed.value, found, printed.resolution)
    if put_in and verdict is Verdict.AGREES:
        verdict = Verdict.INPUT
    beside = Beside.of(printed, found)
    if found is None:
        return Cell(f"not found{note}", Verdict.UNDECIDED, why)  # records may be too few or too coarse to show it
    return Cell(f"{_with_unit(found, printed.unit)}{note}; {beside}", verdict, why, beside)


def against_printed(
    says: str,
    printed: Printed,
    found: Sequence[Uncertain | None],
    why: str = "",
    cause: Cause | None = None,
) -> Statement:
    """A printed number beside what both flows give; the verdict is on the exact one."""
    beside = [Beside.of(printed, one) for one in found]
    words = [str(one) if one is not None else "not found" for one in beside]
    row = of_both(
        printed.place,
        says,
        (_with_unit(one, printed.unit) for one in found),
        f"exact {words[0]}, smoothed {words[1]}",
        judge(printed.value, found[0], printed.resolution),
        why,
        cause,
    )
    return replace(row, exact_beside=beside[0], smoothed_beside=beside[1])


def against_grazing(
    says: str,
    swept: Sequence[xr.Dataset],
    which: int,
    met: Sequence[Interval | None],
    why: str = "",
    place: str = "closed form, not printed",
) -> Statement:
    """A closed-form grazing frequency, of the gap and for the smoothed switch of g - eta, beside what was met.

    They agree within a step of the sweeps.
    """
    closed = [grazing_of(one)[which] for one in swept]
    pairs = list(zip(met, closed, strict=True))
    off = ["not found" if found is None else f"{found.value - truth:+.4f} rad/s" for found, truth in pairs]
    verdicts = [judge_step(truth, found) for found, truth in pairs]
    return of_both(
        place,
        f"{says}: {closed[0]:.5f} rad/s (gap g - eta: {closed[1]:.5f})",
        (_with_unit(found, "rad/s") for found in met),
        f"exact {off[0]}, smoothed {off[1]}",
        verdicts[0] if len(set(verdicts)) == 1 else Verdict.IN_PART,
        why,
    )


def _with_unit(found: Uncertain | None, unit: str) -> str:
    return "not found" if found is None else f"{with_uncertainty(found.value, found.uncertainty)} {unit}".rstrip()
