"""A row of the report: a statement of the paper, what model and rig give, and the verdicts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

from nonsmooth.studies.savi2007.claims.verdicts import Beside, Cause, Known, Verdict, judge, judge_step
from nonsmooth.studies.savi2007.measure import Interval, with_uncertainty
from nonsmooth.studies.savi2007.printed import Printed

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Cell", "Data", "Row", "against_closed_form", "against_printed", "printed_cell"]

#: Datasets by figure and key.
Data: TypeAlias = "Mapping[str, dict[str, xr.Dataset]]"


@dataclass(frozen=True)
class Cell:
    """Outcome of the virtual rig for a statement, and its relation to the paper; without a verdict it is not asked.

    ``why`` is added to the row's own; ``beside``: the number, where one was printed.
    """

    text: str
    verdict: Verdict = Verdict.NOT_ASKED
    why: str = ""
    beside: Beside | None = None


@dataclass(frozen=True)
class Row:
    """One statement: what the paper says (``place``: where), what both flows and the rig give, and what follows.

    ``verdict`` is on the exact flow, ``rig_verdict`` on the virtual rig; ``cause``: why one of them differs, where it
    is not real. The numbers beside a printed one are in ``exact_beside``, ``smoothed_beside`` and ``rig_beside``.
    """

    id: str
    place: str
    says: str
    exact: str
    smoothed: str
    difference: str
    verdict: Verdict
    why: str = ""
    rig: str = "not asked"
    rig_verdict: Verdict = Verdict.NOT_ASKED
    cause: Cause | None = None
    exact_beside: Beside | None = None
    smoothed_beside: Beside | None = None
    rig_beside: Beside | None = None

    def measured(self, cell: Cell) -> Row:
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


def printed_cell(printed: Printed, found: Known | None, note: str = "", why: str = "", *, put_in: bool = False) -> Cell:
    """The rig's number beside a printed one; ``put_in``: that the rig was given, or that follows from what it was."""
    verdict = judge(printed.value, found, printed.resolution)
    if put_in and verdict is Verdict.AGREES:
        verdict = Verdict.INPUT
    beside = Beside.of(printed.value, printed.resolution, found)
    if found is None:
        return Cell(f"not found{note}", Verdict.UNDECIDED, why)  # records may be too few or too coarse to show it
    return Cell(f"{_with_unit(found, printed.unit)}{note}; {beside}", verdict, why, beside)


def against_printed(
    claim: str,
    says: str,
    printed: Printed,
    exact: Known | None,
    smoothed: Known | None,
    why: str = "",
    cause: Cause | None = None,
) -> Row:
    """A printed number beside what both flows give; the verdict is on the exact one."""
    found = [Beside.of(printed.value, printed.resolution, one) for one in (exact, smoothed)]
    words = [str(one) if one is not None else "not found" for one in found]
    return Row(
        claim, printed.place, says, _with_unit(exact, printed.unit), _with_unit(smoothed, printed.unit),
        f"exact {words[0]}, smoothed {words[1]}", judge(printed.value, exact, printed.resolution), why, cause=cause,
        exact_beside=found[0], smoothed_beside=found[1],
    )  # fmt: skip


def against_closed_form(
    claim: str,
    place: str,
    says: str,
    closed: tuple[float, float],
    exact: Interval | None,
    smoothed: Interval | None,
    why: str = "",
) -> Row:
    """A frequency known in closed form, in rad/s, beside the sweeps: they agree within one of their steps.

    ``closed`` holds it for the gap g and, to compare the smoothed switch with, for g - eta.
    """
    pairs = list(zip((exact, smoothed), closed, strict=True))
    off = ["not found" if found is None else f"{found.value - truth:+.4f} rad/s" for found, truth in pairs]
    verdicts = [judge_step(truth, found) for found, truth in pairs]
    verdict = verdicts[0] if len(set(verdicts)) == 1 else Verdict.IN_PART
    return Row(
        claim, place, f"{says}: {closed[0]:.5f} rad/s (gap g - eta: {closed[1]:.5f})", _with_unit(exact, "rad/s"),
        _with_unit(smoothed, "rad/s"), f"exact {off[0]}, smoothed {off[1]}", verdict, why,
    )  # fmt: skip


def _with_unit(found: Known | None, unit: str) -> str:
    return "not found" if found is None else f"{with_uncertainty(found.value, found.uncertainty)} {unit}".rstrip()
