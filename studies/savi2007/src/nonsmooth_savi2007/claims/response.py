"""Claims F9a, F9b, F9c and F10: the frequency responses, their jumps, and the grazing behind them.

Rows of the model, and for each a cell of the virtual rig.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth import special_points
from nonsmooth_savi2007.claims.verdicts import (
    Cause,
    Cell,
    Data,
    Statement,
    Verdict,
    against_closed_form,
    against_printed,
    agreed,
    judge,
    printed_cell,
)
from nonsmooth_savi2007.figures.resonance import grazing_of
from nonsmooth_savi2007.grazing import grazing_frequencies
from nonsmooth_savi2007.measure import (
    Interval,
    changes,
    lowest,
    main_jump,
    measured_periods,
    range_of,
    small_jump,
)
from nonsmooth_savi2007.printed import FIGURE_9, FIGURE_10, NATURAL_FREQUENCY, NUMBERS, TABLE_1

if TYPE_CHECKING:
    import xarray as xr

_FEWEST_APART = 0.05  # of the amplitude: two motions that differ by more are two
_9, _10 = "Section 4, on Fig. 9", "Section 4, on Fig. 10"


def f9a(data: Data) -> list[Statement]:
    """Rising frequency: period 2, and a jump."""
    exact, smoothed = data["fig09"]["exact"], data["fig09"]["smoothed"]
    printed, rising = NUMBERS["period 2 near"], NUMBERS["jump rising"]
    found = range_of(exact, 2, "up")
    inside = found is not None and found[0] <= printed.value <= found[1]
    why = "no period 2 found"
    if found is not None:
        why = (
            f"The range is {found[1] - found[0]:.2f} rad/s wide and begins at the lower grazing frequency, "
            f"{grazing_of(exact)[0]:.5f} rad/s in closed form; {printed.text} lies at "
            f"{100 * (printed.value - found[0]) / (found[1] - found[0]):.0f} % of it."
        )
    return [
        Statement(
            "F9a",
            _9,
            f"rising frequency: a small period-2 region near {printed}",
            _range(exact, "up"),
            _range(smoothed, "up"),
            f"{printed.text} lies {'inside' if inside else 'outside'}",
            agreed(inside),
            why,
        ),
        against_printed(
            "F9a",
            f"rising frequency: dynamical jump near {rising}",
            rising,
            main_jump(exact, "up"),
            main_jump(smoothed, "up"),
            "The motion with contact ends in a fold there. Both flows jump at the same place; the printed value "
            "comes out of neither.",
        ),
    ]


def _with_printed_frequency() -> list[list[float]]:
    """Grazing frequencies of Fig. 9 (rad/s) were omega_0 of Table 1 right, and its k, or its m, wrong."""
    table = {name: TABLE_1[name].value for name in ("m", "k", "c")}
    ratio = (TABLE_1["omega_0"].value / NATURAL_FREQUENCY) ** 2
    changes = {"k": table["k"] * ratio}, {"m": table["m"] / ratio}
    return [grazing_frequencies({**table, **FIGURE_9, **changed}) for changed in changes]


def f9b(data: Data) -> list[Statement]:
    """Falling frequency: the jump at grazing, and period 2 again."""
    exact, smoothed = data["fig09"]["exact"], data["fig09"]["smoothed"]
    closed = grazing_of(exact)[-1]
    falling = NUMBERS["jump falling"]
    (below, stiffer), (under, lighter) = _with_printed_frequency()
    met = [judge(falling.value, Interval(one, one), falling.resolution) for one in (stiffer, lighter)]
    found = range_of(exact, 2, "down")
    return [
        against_printed(
            "F9b",
            f"falling frequency: dynamical jump at {falling}",
            falling,
            main_jump(exact, "down"),
            main_jump(smoothed, "down"),
            f"Falling, the motion without contact ends where it meets the support. With Table 1 that is {closed:.5f} "
            "rad/s, in closed form and without any integration; both flows jump there. Table 1 also prints omega_0 = "
            f"{TABLE_1['omega_0']}, where its k and m say {NATURAL_FREQUENCY:.3f}: with a stiffer spring, or a lighter "
            f"car, to give that, the closed form is {stiffer:.3f} or {lighter:.3f} rad/s "
            f"({100 * (stiffer / falling.value - 1):+.1f} or {100 * (lighter / falling.value - 1):+.1f} %); but the "
            f"range of period 2 would then begin at {below:.2f} or {under:.2f}, above the printed "
            f"{NUMBERS['period 2 near']}.",
            cause=Cause.TABLE_1 if Verdict.AGREES in met else None,
        ),
        against_closed_form(
            "F9b",
            "closed form, not printed",
            "falling jump at grazing",
            (closed, grazing_of(smoothed)[-1]),
            main_jump(exact, "down"),
            main_jump(smoothed, "down"),
            "Within one step of the sweep; read from its amplitudes alone.",
        ),
        Statement(
            "F9b",
            _9,
            "falling frequency: period 2 appears again",
            _range(exact, "down"),
            _range(smoothed, "down"),
            "none",
            agreed(found is not None),
        ),
    ]


def f9c(data: Data) -> list[Statement]:
    """The region between the two jumps: the branch from fold to fold."""
    texts, wide = [], []
    for key in ("exact", "smoothed"):
        response = data["fig09"][key]
        down, up = main_jump(response, "down"), main_jump(response, "up")
        if down is None or up is None:
            texts.append("jumps not found")
            continue
        x = response["amplitude"].sel(state="x", omega=slice(down.high, up.low))
        apart = np.abs(x.sel(direction="up") - x.sel(direction="down")) / x.max("direction")
        wide.append(float(apart.min()))
        texts.append(
            f"{down.value:.3f} ... {up.value:.3f} rad/s: two stable motions, amplitudes apart by "
            f"{100 * float(apart.min()):.0f} % at least"
        )
    texts += [""] * (2 - len(texts))
    two = len(wide) == 2 and min(wide) > 0.05
    branch = data["fig09"]["branch"]
    table = special_points(branch)
    folds = table["point"].values[table["kind"].values == "fold"]
    between = branch.isel(point=slice(int(folds.min()) + 1, int(folds.max())))
    unstable = not bool(between["stable"].any())
    ends = sorted(branch["omega"].values[[folds.min(), folds.max()]])
    largest = float(np.abs(between["floquet_multipliers"]).max())
    heights = 1e3 * 0.5 * (between["maximum"] - between["minimum"]).sel(state="x").values
    texts[0] += (
        f"; the branch between them, from fold to fold, {ends[0]:.8f} ... {ends[1]:.8f} rad/s: "
        f"{'unstable throughout' if unstable else 'stable in part'}, largest multiplier up to {largest:.3f}"
    )
    below = grazing_of(data["fig09"]["exact"])[-1] - ends[0]
    why = (
        "Two stable motions coexist between the jumps. The period-1 branch, continued from one orbit, turns at "
        f"{ends[1]:.5f} rad/s, where rising frequency jumps, runs back with amplitudes of {heights.min():.2f} to "
        f"{heights.max():.2f} mm, and turns again at {ends[0]:.5f} rad/s, {below:.5f} rad/s "
        "below the grazing of the motion without contact, where falling frequency jumps."
    )
    return [
        Statement(
            "F9c",
            _9,
            "an unstable region between the jumps with rising and falling frequency",
            texts[0],
            texts[1],
            "none in kind",
            Verdict.AGREES if two and unstable else Verdict.IN_PART if two else Verdict.DIFFERS,
            why,
        )
    ]


def f10(data: Data) -> list[Statement]:
    """No period 2, a small jump in its place."""
    exact, smoothed = data["fig10"]["exact"], data["fig10"]["smoothed"]
    grazing = list(zip(grazing_of(exact), grazing_of(smoothed), strict=True))
    doubled = [int((one["period_number"] == 2).sum()) for one in (exact, smoothed)]
    count = exact["period_number"].size, smoothed["period_number"].size
    small = small_jump(exact, "up")
    return [
        Statement(
            "F10",
            _10,
            "jumps as in Fig. 9, elsewhere with rising than with falling frequency",
            _both(exact),
            _both(smoothed),
            "no number printed",
            agreed(None not in (main_jump(exact, "up"), main_jump(exact, "down"))),
        ),
        against_closed_form(
            "F10",
            "closed form, not printed",
            "falling jump at grazing",
            grazing[-1],
            main_jump(exact, "down"),
            main_jump(smoothed, "down"),
        ),
        Statement(
            "F10",
            _10,
            "no period-2 response",
            f"{doubled[0]} of {count[0]} points with period 2",
            f"{doubled[1]} of {count[1]} points with period 2",
            "none",
            agreed(not any(doubled)),
        ),
        Statement(
            "F10",
            _10,
            "a small jump instead",
            _small(exact),
            _small(smoothed),
            "no number printed",
            agreed(small is not None),
            "With rising frequency at the grazing of the motion without contact, with falling at a fold of the "
            "motion with contact.",
        ),
        against_closed_form(
            "F10",
            "closed form, not printed",
            "small jump, rising, at grazing",
            grazing[0],
            small,
            small_jump(smoothed, "up"),
        ),
    ]


def grazing_behind_both(data: Data) -> list[Statement]:
    """Period 2 of Fig. 9 and the small jump of Fig. 10 begin where the motion without contact grazes."""
    exact, smoothed = data["fig09"]["exact"], data["fig09"]["smoothed"]
    return [
        against_closed_form(
            "F10",
            _10,
            "both (period 2 in Fig. 9, the small jump in Fig. 10) are probably related to grazing; closed "
            "form of Fig. 9's lower grazing",
            (grazing_of(exact)[0], grazing_of(smoothed)[0]),
            lowest(changes(exact, 1, 2, "up")),
            lowest(changes(smoothed, 1, 2, "up")),
            "The period-2 range of Fig. 9 begins where the motion without contact grazes, as does the small jump of "
            "Fig. 10.",
        )
    ]


def _range(response: xr.Dataset, direction: str) -> str:
    found = range_of(response, 2, direction)
    return "no period 2" if found is None else f"period 2 from {found[0]:.4f} to {found[1]:.4f} rad/s"


def _both(response: xr.Dataset) -> str:
    up, down = main_jump(response, "up"), main_jump(response, "down")
    return f"rising {up}, falling {down} rad/s"


def _small(response: xr.Dataset) -> str:
    found = [small_jump(response, direction) or "none found" for direction in ("up", "down")]
    return f"rising {found[0]}, falling {found[1]} rad/s"


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


def f9a_rig(data: Data) -> list[Cell]:
    """Period 2, and the rising jump."""
    runs = data["fig09_rig"]["runs"]
    return [
        _range_cell(runs, "up", NUMBERS["period 2 near"].value),
        printed_cell(NUMBERS["jump rising"], main_jump(runs, "up")),
    ]


def f9b_rig(data: Data) -> list[Cell]:
    """The falling jump, beside the paper and beside the closed form, and period 2 again."""
    runs = data["fig09_rig"]["runs"]
    falling = main_jump(runs, "down")
    return [
        printed_cell(NUMBERS["jump falling"], falling),
        against(falling, grazing_of_paper(FIGURE_9)[-1]),
        _range_cell(runs, "down"),
    ]


def f9c_rig(data: Data) -> list[Cell]:
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
            f"{down.value:.3f} ... {up.value:.3f} rad/s: two motions, amplitudes apart by {100 * apart:.0f} % at least",
            Verdict.IN_PART if apart > _FEWEST_APART else Verdict.DIFFERS,
        )
    ]


def f10_rig(data: Data) -> list[Cell]:
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


def grazing_behind_both_rig(data: Data) -> list[Cell]:
    """The lower end of period 2 beside the lower grazing frequency."""
    omega, number = measured_periods(data["fig09_rig"]["runs"], "up")
    at = np.flatnonzero(number == 2)
    first = Interval(float(omega[at[0] - 1]), float(omega[at[0]])) if len(at) and at[0] else None
    return [against(first, grazing_of_paper(FIGURE_9)[0])]
