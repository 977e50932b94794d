"""Verdicts of the virtual rig on the claims F9 and F10: one cell for each row of the model, in the same order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.studies.savi2007.claims.rows import Cell, Data, printed_cell
from nonsmooth.studies.savi2007.claims.verdicts import Verdict, agreed, judge
from nonsmooth.studies.savi2007.grazing import grazing_frequencies
from nonsmooth.studies.savi2007.measure import Interval, measured_jumps, measured_periods
from nonsmooth.studies.savi2007.printed import FIGURE_9, FIGURE_10, NUMBERS, TABLE_1

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "against", "f9a", "f9b", "f9c", "f10", "grazing_behind_both", "grazing_of_paper", "main_jump", "small_jump",
]  # fmt: skip

_FEWEST_APART = 0.05  # of the amplitude: two motions that differ by more are two


def main_jump(runs: xr.Dataset, direction: str) -> Interval | None:
    """The jump with the largest step, as measured."""
    found = measured_jumps(runs, direction)
    return max(found, key=lambda jump: _step(runs, direction, jump)) if found else None


def small_jump(runs: xr.Dataset, direction: str) -> Interval | None:
    """The smallest of several jumps, as measured."""
    found = measured_jumps(runs, direction)
    return min(found, key=lambda jump: _step(runs, direction, jump)) if len(found) > 1 else None


def _step(runs: xr.Dataset, direction: str, jump: Interval) -> float:
    mine = runs.isel(run=runs["direction"].values.astype(str) == direction)
    order = np.argsort(mine["omega"].values)
    heights = mine["amplitude"].values[order]
    i = int(np.searchsorted(mine["omega"].values[order], jump.value))
    return float(abs(heights[i] - heights[i - 1]))


def _doubled(runs: xr.Dataset, direction: str) -> Interval | None:
    """From the first to the last frequency with period 2."""
    omega, number = measured_periods(runs, direction)
    at = omega[number == 2]
    return Interval(float(at[0]), float(at[-1])) if len(at) else None


def _range_cell(runs: xr.Dataset, direction: str, wanted: float | None = None) -> Cell:
    found = _doubled(runs, direction)
    if found is None:
        return Cell("no run with period 2", Verdict.UNDECIDED)
    omega, number = measured_periods(runs, direction)
    n = int(np.count_nonzero(number == 2))
    text = f"period 2 from {found.low:.3f} to {found.high:.3f} rad/s ({n} run{'s' if n > 1 else ''})"
    if wanted is None or found.low <= wanted <= found.high:
        return Cell(text, Verdict.AGREES)
    below, above = omega[omega < found.low], omega[omega > found.high]  # the range ends between two runs
    outside = (len(below) and wanted <= below[-1]) or (len(above) and wanted >= above[0])
    return Cell(text, Verdict.DIFFERS if outside else Verdict.UNDECIDED)


def against(found: Interval | None, truth: float) -> Cell:
    """A jump beside a closed form with the paper's parameters."""
    if found is None:
        return Cell("not found", Verdict.UNDECIDED)
    return Cell(f"{found} rad/s ({found.value - truth:+.3f} rad/s)", judge(truth, found))


def grazing_of_paper(figure: Mapping[str, float]) -> list[float]:
    """Closed-form grazing frequencies (rad/s) with the printed parameters."""
    return grazing_frequencies({**{name: TABLE_1[name].value for name in ("m", "k", "c")}, **figure})


def f9a(data: Data) -> list[Cell]:
    """Period 2, and the rising jump."""
    runs = data["fig09_rig"]["runs"]
    return [
        _range_cell(runs, "up", NUMBERS["period 2 near"].value),
        printed_cell(NUMBERS["jump rising"], main_jump(runs, "up")),
    ]


def f9b(data: Data) -> list[Cell]:
    """The falling jump, beside the paper and beside the closed form, and period 2 again."""
    runs = data["fig09_rig"]["runs"]
    falling = main_jump(runs, "down")
    return [
        printed_cell(NUMBERS["jump falling"], falling), against(falling, grazing_of_paper(FIGURE_9)[-1]),
        _range_cell(runs, "down"),
    ]  # fmt: skip


def f9c(data: Data) -> list[Cell]:
    """Two motions between the jumps."""
    runs = data["fig09_rig"]["runs"]
    up, down = main_jump(runs, "up"), main_jump(runs, "down")
    if up is None or down is None:
        return [Cell("jumps not found", Verdict.UNDECIDED)]
    values = {}
    for direction in ("up", "down"):
        mine = runs.isel(run=runs["direction"].values.astype(str) == direction)
        inside = (mine["omega"].values > down.high + 1e-6) & (mine["omega"].values < up.low - 1e-6)
        values[direction] = np.sort(mine["amplitude"].values[inside])
    if not all(len(heights) for heights in values.values()):
        return [Cell("no run between the jumps", Verdict.UNDECIDED)]
    apart = 1 - values["down"].max() / values["up"].min()
    return [
        Cell(
            f"{down.value:.3f} ... {up.value:.3f} rad/s: two motions, amplitudes apart by {100 * apart:.0f} % at "
            "least",
            Verdict.IN_PART if apart > _FEWEST_APART else Verdict.DIFFERS,
        )
    ]  # fmt: skip


def f10(data: Data) -> list[Cell]:
    """Jumps, no period 2, a small jump."""
    runs = data["fig10_rig"]["runs"]
    up, down, small = main_jump(runs, "up"), main_jump(runs, "down"), small_jump(runs, "up")
    grazing = grazing_of_paper(FIGURE_10)
    words = [str(jump) if jump is not None else "none found" for jump in (small, small_jump(runs, "down"))]
    return [
        Cell(f"rising {up}, falling {down} rad/s", Verdict.UNDECIDED if up is None or down is None else Verdict.AGREES),
        against(down, grazing[-1]),
        _no_doubled(runs),
        Cell(f"rising {words[0]}, falling {words[1]} rad/s", Verdict.UNDECIDED if small is None else Verdict.AGREES),
        against(small, grazing[0]),
    ]


def _no_doubled(runs: xr.Dataset) -> Cell:
    """No range of period 2: a response has it where neighbouring runs of one direction do."""
    doubled = {direction: measured_periods(runs, direction)[1] == 2 for direction in ("up", "down")}
    count = sum(int(here.sum()) for here in doubled.values())
    ranges = any((here[1:] & here[:-1]).any() for here in doubled.values())
    text = f"{count} of {runs.sizes['run']} runs with period 2" + ("" if ranges or not count else ", no two neighbours")
    why = "" if ranges or not count else "Rig: a record of some eight turns can show a motion that is still settling."
    return Cell(text, agreed(not ranges), why)


def grazing_behind_both(data: Data) -> list[Cell]:
    """The lower end of period 2 beside the lower grazing frequency."""
    omega, number = measured_periods(data["fig09_rig"]["runs"], "up")
    at = np.flatnonzero(number == 2)
    first = Interval(float(omega[at[0] - 1]), float(omega[at[0]])) if len(at) and at[0] else None
    return [against(first, grazing_of_paper(FIGURE_9)[0])]
