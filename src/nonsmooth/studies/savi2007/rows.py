"""A row of the report, and the rules by which a number is called in agreement."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

from nonsmooth.studies.savi2007.measure import Interval
from nonsmooth.studies.savi2007.printed import Printed

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "CLOSE", "NOT_ASKED", "Cell", "Data", "Row", "against_closed_form", "against_printed", "compare", "printed_cell",
]  # fmt: skip

#: Datasets by figure and key.
Data: TypeAlias = "Mapping[str, Mapping[str, xr.Dataset]]"

CLOSE = 2.0  # percent; the paper's own two natural frequencies, 4.50 and 4.60 rad/s, are 2.2 % apart


NOT_ASKED = "not asked"


@dataclass(frozen=True)
class Cell:
    """What the virtual rig says to a statement, and how that stands to the paper; without a verdict it is not asked.

    ``why`` is added to the row's own.
    """

    text: str
    verdict: str = NOT_ASKED
    why: str = ""


@dataclass(frozen=True)
class Row:
    """One statement: what the paper says (``place``: where), what both flows and the rig give, and what follows.

    ``verdict`` is on the exact flow, ``rig_verdict`` on the virtual rig.
    """

    id: str
    place: str
    says: str
    exact: str
    smoothed: str
    difference: str
    verdict: str
    why: str = ""
    rig: str = NOT_ASKED
    rig_verdict: str = NOT_ASKED

    def measured(self, cell: Cell) -> Row:
        """The row with what the rig says."""
        why = f"{self.why} {cell.why}".strip()
        return replace(self, rig=cell.text, rig_verdict=cell.verdict, why=why)


def compare(printed: Printed, found: Interval | None) -> tuple[str, str]:
    """Difference in percent, and the verdict.

    A number agrees when the printed one, with its rounding, lies in the interval of the sweep; within N % up to 2 %.
    """
    if found is None:
        return "not found", "differs"
    percent = 100 * (found.middle / printed.value - 1)
    if abs(found.middle - printed.value) <= found.uncertainty + printed.rounding:
        verdict = "agrees"
    elif abs(percent) <= CLOSE:
        verdict = f"agrees within {math.ceil(10 * abs(percent)) / 10:.1f} %"
    else:
        verdict = f"differs by {abs(percent):.1f} %"
    return f"{round(percent, 1) + 0.0:+.1f} %", verdict  # + 0.0: no negative zero


def printed_cell(printed: Printed, found: Interval | None, note: str = "", why: str = "") -> Cell:
    """The rig's number beside a printed one."""
    difference, verdict = compare(printed, found)
    if found is None:
        return Cell(f"not found{note}", verdict, why)
    return Cell(f"{_with_unit(found, printed.unit)} ({difference}){note}", verdict, why)


def against_printed(
    claim: str, says: str, printed: Printed, exact: Interval | None, smoothed: Interval | None, why: str = ""
) -> Row:
    """A printed number beside what both flows give; the verdict is on the exact one."""
    difference, verdict = compare(printed, exact)
    other, _ = compare(printed, smoothed)
    return Row(
        claim, printed.place, says, _with_unit(exact, printed.unit), _with_unit(smoothed, printed.unit),
        f"exact {difference}, smoothed {other}", verdict, why,
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
    off = ["not found" if found is None else f"{found.middle - truth:+.4f} rad/s" for found, truth in pairs]
    met = [found is not None and abs(found.middle - truth) <= 2 * found.uncertainty for found, truth in pairs]
    verdict = "agrees" if all(met) else "agrees in part" if any(met) else "differs"
    return Row(
        claim, place, f"{says}: {closed[0]:.5f} rad/s (gap g - eta: {closed[1]:.5f})", _with_unit(exact, "rad/s"),
        _with_unit(smoothed, "rad/s"), f"exact {off[0]}, smoothed {off[1]}", verdict, why,
    )  # fmt: skip


def _with_unit(found: Interval | None, unit: str) -> str:
    return "not found" if found is None else f"{found} {unit}".rstrip()
