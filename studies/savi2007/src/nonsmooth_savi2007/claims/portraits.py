"""Claims F12, F14 and F18: phase portraits, on model and rig."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np
import xarray as xr

from nonsmooth_savi2007.claims.verdicts import (
    FLOWS,
    Cause,
    Cell,
    Data,
    Statement,
    Verdict,
    agreed,
    of_both,
)
from nonsmooth_savi2007.figures.motions import measured_periods_at
from nonsmooth_savi2007.figures.portraits import chosen_points, words_of
from nonsmooth_savi2007.measure import (
    APERIODIC,
    motion_word,
    period_words,
    periods_reached,
    separation_rate,
)
from nonsmooth_savi2007.printed import FIGURE_12, FIGURE_14, FIGURE_14_TEXT, FIGURE_18


def f12(data: Data) -> Iterator[Statement]:
    """Portraits at four amplitudes."""
    met = all(periods_reached(data["fig12"]["exact"], rho).keys() == {period} for rho, period in FIGURE_12.items())
    yield _portraits(
        data,
        "fig12",
        FIGURE_12,
        "Fig. 12 with the ranges of Fig. 11",
        "orbits and section points at rho = ",
        met,
        "The phase of the paper's section is not stated; 0 here.",
    )


def f18(data: Data) -> Iterator[Statement]:
    """Portraits at three frequencies."""
    met = all(period in periods_reached(data["fig18"]["exact"], omega) for omega, period in FIGURE_18.items())
    rate, error = separation_rate(data["fig18"]["exact_exponents"])
    why = "Neighbouring trajectories on the chaotic orbit separate by a factor "
    why += f"exp({rate:.2f} ± {error:.2f}) per period (exact)."
    yield _portraits(data, "fig18", FIGURE_18, "Fig. 18, caption", "orbits at omega = ", met, why)


def _portraits(
    data: Data, figure: str, shown: Mapping[float, int], place: str, says: str, met: bool, why: str
) -> Statement:
    """The period numbers shown, beside those that starts of both flows and the rig's records have."""
    found = {value: measured_periods_at(data[f"{figure}_rig"], value) for value in shown}
    right = [period in found[value] for value, period in shown.items()]
    return of_both(
        place,
        says + _named(shown),
        (_reached(data[figure][flow], shown) for flow in FLOWS),
        _apart(data[figure], shown),
        agreed(met),
        why,
    ).measured(
        Cell(
            "; ".join(f"{value:g}: {period_words(numbers)}" for value, numbers in found.items()),
            Verdict.AGREES if all(right) else Verdict.IN_PART if any(right) else Verdict.DIFFERS,
        )
    )


def _named(shown: Mapping[float, int]) -> str:
    return ", ".join(f"{value:g}: {motion_word(period)}" for value, period in shown.items())


def _reached(survey: xr.Dataset, values: Iterable[float]) -> str:
    return "; ".join(f"{value:g}: {words_of(periods_reached(survey, value))}" for value in values)


def _apart(data: Mapping[str, xr.Dataset], shown: Mapping[float, int]) -> str:
    """Largest distance between the section points of the exact and the smoothed periodic orbits drawn."""
    worst = 0.0
    for value, wanted in shown.items():
        if wanted == APERIODIC:
            continue
        points = []
        for flow in FLOWS:
            points.append(
                chosen_points(data[flow], value, wanted)["section"].transpose("iterate", "state").values[-wanted:]
            )
        worst = max(worst, np.abs(points[0][:, None, :] - points[1][None, :, :])[..., 0].min(axis=1).max())
    return f"section points of both flows within {1e6 * worst:.2g} micrometres"


def f14(data: Data) -> Iterator[Statement]:
    """Period numbers at the gaps of the caption, and at those printed in the text."""
    both, as_printed = [data["fig14"][flow] for flow in FLOWS], True
    for g, period in FIGURE_14.items():
        reached = periods_reached(both[0], g)
        as_printed = as_printed and period in reached
        yield of_both(
            "Fig. 14, caption",
            f"g = {g:g} m: {motion_word(period)}",
            (words_of(periods_reached(one, g)) for one in both),
            "none" if period in reached else "other period",
            agreed(period in reached),
            "" if reached.keys() == {period} else "Motions coexist here; which is met depends on the start.",
        ).measured(at_gap(data["fig14_rig"], g, period))
    right = sum(period in periods_reached(both[0], g) for g, period in FIGURE_14_TEXT.items())
    yield of_both(
        "Section 4, on Fig. 14",
        f"the text's gaps: {_named(FIGURE_14_TEXT)}",
        (_reached(one, FIGURE_14_TEXT) for one in both),
        f"{right} of {len(FIGURE_14_TEXT)} as printed",
        agreed(right == len(FIGURE_14_TEXT)),
        "The text prints other gaps than the caption; the caption's are those that show what is claimed.",
        cause=Cause.MISPRINT if as_printed else None,
    ).measured(Cell("not recorded at the text's gaps"))


def at_gap(data: dict[str, xr.Dataset], g: float, period: int) -> Cell:
    """Period numbers of the rig's records at a gap."""
    found = measured_periods_at(data, g)
    return Cell(period_words(found), agreed(period in found))
