"""Verdicts of the virtual rig on the claims F11 to F18 and C1: a cell for each row of the model, in the same order."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth_savi2007.claims.response import against, grazing_of_paper
from nonsmooth_savi2007.claims.verdicts import CLOSE, Cell, Data, Statement, Verdict, agreed, printed_cell
from nonsmooth_savi2007.figures.amplitude import flip_of, rate_of, slowest
from nonsmooth_savi2007.figures.motions import measured_periods_at
from nonsmooth_savi2007.measure import APERIODIC, Interval, jumps, main_jump, period_word, small_jump
from nonsmooth_savi2007.printed import (
    FIGURE_9,
    FIGURE_10,
    FIGURE_12,
    FIGURE_14,
    FIGURE_17_TEXT,
    FIGURE_18,
    NUMBERS,
)

if TYPE_CHECKING:
    import xarray as xr


def of_the_model(n: int) -> list[Cell]:
    """Cells of claims that no rig can decide."""
    return [Cell("not asked: of the model")] * n


def f11(data: Data) -> list[Cell]:
    """The flips of the slowest rise."""
    rise = slowest(data["fig11_rig"])
    cells = [_flip(data, rise, n) for n in (1, 2)]
    cells.append(Cell("longer periods pass too quickly in a rise"))
    end = NUMBERS["period 4 from"]
    numbers = rise["measured_period_number"].values[rise["measured_rho"].values < end.value]
    if not len(numbers):
        return [*cells, Cell(f"no turn below {end}")]
    kinds, counts = np.unique(numbers, return_counts=True)
    kind, share = int(kinds[counts.argmax()]), float(counts.max() / counts.sum())
    text = f"{period_word(kind)} in {100 * share:.0f} % of the turns below {end}"
    return [*cells, Cell(text, agreed(kind == APERIODIC))]


def _flip(data: Data, rise: xr.Dataset, n: int) -> Cell:
    """Flip of period n beside the printed end of its range; where the records show it, beside the model's."""
    name, printed = f"{n}-{2 * n}", NUMBERS[f"period {n} from"]
    kinds = ("measured_flip", "measured_flip_error", "theory_flip")
    value, error, theory = (flip_of(rise, name, kind) for kind in kinds)
    found = Interval(value - 2 * error, value + 2 * error) if np.isfinite([value, error]).all() else None
    read = [(rate_of(one), flip_of(one, name, "measured_flip_read")) for one in data["fig11_rig"].values()]
    seen = ", ".join(f"{at:.3f} N at {1e3 * rate:.3f} mN/s" for rate, at in read if np.isfinite(at))
    words = [f"Rig: rising at {1e3 * rate_of(rise):.3f} mN/s, the delay of the flip taken out."]
    if seen:
        words.append(f"The records themselves double late: {seen}.")
    if np.isfinite(theory):
        words.append(
            "The rig's gap is set at rest and its mean position moves with the forcing: the model with that gap flips "
            f"at {theory:.4f} N."
        )
    return printed_cell(printed, found, why=" ".join(words))


def _words(numbers: Iterable[int]) -> str:
    return " and ".join(map(period_word, numbers))


def _at_all(data: dict[str, xr.Dataset], shown: Mapping[float, int]) -> Cell:
    """All of the periods wanted, each at its value."""
    met = [period in measured_periods_at(data, value) for value, period in shown.items()]
    text = "; ".join(f"{value:g}: {_words(measured_periods_at(data, value))}" for value in shown)
    return Cell(text, Verdict.AGREES if all(met) else Verdict.IN_PART if any(met) else Verdict.DIFFERS)


def f12(data: Data) -> list[Cell]:
    """Period numbers at the four amplitudes."""
    return [_at_all(data["fig12_rig"], FIGURE_12)]


def f13(data: Data) -> list[Cell]:
    """Kinds of motion over the gap; how many of them each gap has."""
    runs = data["fig13_rig"]["runs"]
    numbers = {g: _counted(runs["period_number"].values[runs["setting"].values == g]) for g in FIGURE_14}
    reached = {n for one in numbers.values() for n in one}
    several = [g for g, one in numbers.items() if len(one) > 1]
    starts = max(sum(one.values()) for one in numbers.values())
    return [
        Cell(
            "; ".join(f"{g:g}: {_words(one)}" for g, one in numbers.items()),
            agreed(APERIODIC in reached and len(reached) > 1),
        ),
        Cell(
            f"more than one motion at {len(several)} of {len(numbers)} gaps, {starts} starts each",
            Verdict.ADDS if several else Verdict.NOT_ASKED,
        )
        if starts > 1
        else Cell("one start at each gap"),
    ]


def _counted(numbers: np.ndarray) -> dict[int, int]:
    return {int(n): int((numbers == n).sum()) for n in np.unique(numbers)}


def f14(data: Data) -> list[Cell]:
    """Period numbers at the gaps of the caption; the text's other gaps were not set."""
    cells = []
    for g, period in FIGURE_14.items():
        found = measured_periods_at(data["fig14_rig"], g)
        cells.append(Cell(_words(found), agreed(period in found)))
    return [*cells, Cell("not recorded at the text's gaps")]


def f15(data: Data) -> list[Cell]:
    """Numerical; the rig's is F16."""
    return [Cell("not asked: see F16")]


def f16(data: Data) -> list[Statement]:
    """The rig's attractor beside the model's, at four phases."""
    result = data["fig16"]["attractor"]
    far, halves = result["energy_distance_matched"].values, result["measured_halves_p95"].values
    ratio = far / halves
    worst = float(ratio.max())
    number = int(result["measured_period_number"])
    alike = number == APERIODIC and worst < 2
    return [
        Statement(
            "F16",
            "Fig. 16",
            "the same attractor from the apparatus, at four phases",
            "see F15",
            "see F15",
            f"energy distance {', '.join(f'{r:.2f}' for r in ratio)} of the 95th percentile of the record's halves",
            Verdict.NOT_ASKED,
            "At phases 0, pi/2, pi, 3 pi/2, to the exact model with the parameters identified; below 2 the clouds can "
            "hardly be told apart by a record of this length.",
            f"{period_word(number)}, {result.sizes['measured_iterate']} turns",
            agreed(alike),
        )
    ]


def f17(data: Data) -> list[Cell]:
    """Three responses on rising steps, and the transitions between them."""
    runs = data["fig17_rig"]["runs"]
    cells = []
    for omega, says in FIGURE_17_TEXT.items():
        one = runs.isel(run=int(np.abs(runs["value"].values - omega).argmin()))
        number, touches = int(one["period_number"]), bool(one["contact"])
        right = (number == APERIODIC) == ("chaotic" in says)
        swapped = "chaotic" not in says and touches != ("with contact" in says)
        text = f"{period_word(number)}, {'contact' if touches else 'no contact'} (at {float(one['value']):.3f} rad/s)"
        cells.append(Cell(text, agreed(right and not swapped)))
    return [*cells, _transitions(runs)]


def _transitions(runs: xr.Dataset) -> Cell:
    order = np.argsort(runs["value"].values)
    omega, number = runs["value"].values[order], runs["period_number"].values[order]
    chaos = np.flatnonzero(number == APERIODIC)
    if not len(chaos) or chaos[-1] + 1 == len(omega):
        return Cell("no chaos with an end", Verdict.DIFFERS)
    doubled = omega[number == 2]
    into = f"period 2 from {doubled[0]:.2f}, " if len(doubled) else ""
    text = (
        f"{into}no period from {omega[chaos[0]]:.2f} rad/s; out of it at once between {omega[chaos[-1]]:.2f} and "
        f"{omega[chaos[-1] + 1]:.2f} rad/s"
    )
    return Cell(text, Verdict.IN_PART if len(doubled) else Verdict.AGREES)


def f17_grazing(data: Data) -> list[Cell]:
    """The rig's steps rise."""
    return [Cell("not recorded with falling frequency")]


def f18(data: Data) -> list[Cell]:
    """Period numbers at the three frequencies."""
    return [_at_all(data["fig18_rig"], FIGURE_18)]


def c1(data: Data) -> list[Cell]:
    """Jumps, flips and chaos; jumps at grazing."""
    ninth, tenth = (data[name]["runs"] for name in ("fig09_rig", "fig10_rig"))
    count = sum(len(jumps(runs, d)) for runs in (ninth, tenth) for d in ("up", "down"))
    flips = int(np.isfinite(slowest(data["fig11_rig"])["measured_flip"].values).sum())
    chaos = int(data["fig16"]["attractor"]["measured_period_number"]) == APERIODIC
    pairs = [
        (main_jump(ninth, "down"), grazing_of_paper(FIGURE_9)[-1]),
        (main_jump(tenth, "down"), grazing_of_paper(FIGURE_10)[-1]),
        (small_jump(tenth, "up"), grazing_of_paper(FIGURE_10)[0]),
    ]
    near = sum(against(found, truth).verdict is Verdict.AGREES for found, truth in pairs)
    kind = "no period" if chaos else "a period"
    return [
        Cell(
            f"{count} jumps in Figs. 9-10, {flips} flips in Fig. 11, {kind} in Fig. 16",
            Verdict.AGREES if count and flips and chaos else Verdict.IN_PART,
        ),
        Cell(
            f"{near} of 3 within {CLOSE:g} % of the closed-form grazing",
            Verdict.AGREES if near == 3 else Verdict.IN_PART if near else Verdict.UNDECIDED,
        ),
    ]
