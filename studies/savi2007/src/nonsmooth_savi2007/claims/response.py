"""Claims F9a, F9b, F9c and F10: the frequency responses, their jumps, and the grazing behind them, on model and rig."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import xarray as xr

from nonsmooth import special_points
from nonsmooth_savi2007.claims.verdicts import (
    FLOWS,
    Cause,
    Cell,
    Data,
    Statement,
    Verdict,
    against_grazing,
    against_printed,
    agreed,
    judge,
    of_both,
    printed_cell,
)
from nonsmooth_savi2007.figures.branches import branches_of
from nonsmooth_savi2007.figures.resonance import grazing_of
from nonsmooth_savi2007.measure import (
    Interval,
    changes,
    grazing_frequencies,
    main_jump,
    measured_periods,
    range_of,
    small_jump,
)
from nonsmooth_savi2007.printed import FIGURE_9, FIGURE_10, NATURAL_FREQUENCY, NUMBERS, TABLE_1

_FEWEST_APART = 0.05  # of the amplitude: two motions that differ by more are two
_9, _10 = "Section 4, on Fig. 9", "Section 4, on Fig. 10"


def _responses(data: Data, figure: str) -> tuple[list[xr.Dataset], xr.Dataset]:
    """The responses of both flows, and the runs of the rig."""
    return [data[figure][flow] for flow in FLOWS], data[f"{figure}_rig"]["runs"]


def f9a(data: Data) -> Iterator[Statement]:
    """Rising frequency: period 2, and a jump."""
    both, runs = _responses(data, "fig09")
    printed, rising = NUMBERS["period 2 near"], NUMBERS["jump rising"]
    found = range_of(both[0], 2, "up")
    inside = found is not None and found[0] <= printed.value <= found[1]
    why = "no period 2 found"
    if found is not None:
        why = (
            f"The range is {found[1] - found[0]:.2f} rad/s wide and begins at the lower grazing frequency, "
            f"{grazing_of(both[0])[0]:.5f} rad/s in closed form; {printed.text} lies at "
            f"{100 * (printed.value - found[0]) / (found[1] - found[0]):.0f} % of it."
        )
    yield of_both(
        _9,
        f"rising frequency: a small period-2 region near {printed}",
        _ranges(both, "up"),
        f"{printed.text} lies {'inside' if inside else 'outside'}",
        agreed(inside),
        why,
    ).measured(doubled_cell(runs, "up", printed.value))
    yield against_printed(
        f"rising frequency: dynamical jump near {rising}",
        rising,
        [main_jump(one, "up") for one in both],
        "The motion with contact ends in a fold there. Both flows jump at the same place; the printed value "
        "comes out of neither.",
    ).measured(printed_cell(rising, main_jump(runs, "up")))


def f9b(data: Data) -> Iterator[Statement]:
    """Falling frequency: the jump at grazing, and period 2 again."""
    both, runs = _responses(data, "fig09")
    closed, jumps = grazing_of(both[0])[-1], [main_jump(one, "down") for one in both]
    falling, on_rig = NUMBERS["jump falling"], main_jump(runs, "down")
    # were omega_0 of Table 1 right, and its k, or its m, wrong
    ratio = (TABLE_1["omega_0"].value / NATURAL_FREQUENCY) ** 2
    below, stiffer = grazing_of_paper({**FIGURE_9, "k": TABLE_1["k"].value * ratio})
    under, lighter = grazing_of_paper({**FIGURE_9, "m": TABLE_1["m"].value / ratio})
    met = [judge(falling.value, Interval(one, one), falling.resolution) for one in (stiffer, lighter)]
    yield against_printed(
        f"falling frequency: dynamical jump at {falling}",
        falling,
        jumps,
        f"Falling, the motion without contact ends where it meets the support. With Table 1 that is {closed:.5f} "
        "rad/s, in closed form and without any integration; both flows jump there. Table 1 also prints omega_0 = "
        f"{TABLE_1['omega_0']}, where its k and m say {NATURAL_FREQUENCY:.3f}: with a stiffer spring, or a lighter "
        f"car, to give that, the closed form is {stiffer:.3f} or {lighter:.3f} rad/s "
        f"({100 * (stiffer / falling.value - 1):+.1f} or {100 * (lighter / falling.value - 1):+.1f} %); but the "
        f"range of period 2 would then begin at {below:.2f} or {under:.2f}, above the printed "
        f"{NUMBERS['period 2 near']}.",
        cause=Cause.TABLE_1 if Verdict.AGREES in met else None,
    ).measured(printed_cell(falling, on_rig))
    yield against_grazing(
        "falling jump at grazing",
        both,
        -1,
        jumps,
        "Within one step of the sweep; read from its amplitudes alone.",
    ).measured(grazing_cell(on_rig, FIGURE_9, -1))
    yield of_both(
        _9,
        "falling frequency: period 2 appears again",
        _ranges(both, "down"),
        "none",
        agreed(range_of(both[0], 2, "down") is not None),
    ).measured(doubled_cell(runs, "down"))


def f9c(data: Data) -> Iterator[Statement]:
    """The region between the two jumps: the branch from fold to fold."""
    both, runs = _responses(data, "fig09")
    texts, wide = [], []
    for response in both:
        down, up = main_jump(response, "down"), main_jump(response, "up")
        if down is None or up is None:
            texts.append("jumps not found")
            continue
        x = response["amplitude"].sel(state="x", omega=slice(down.high, up.low))
        apart = np.abs(x.sel(direction="up") - x.sel(direction="down")) / x.max("direction")
        wide.append(apart.min().item())
        texts.append(
            f"{down.value:.3f} ... {up.value:.3f} rad/s: two stable motions, amplitudes apart by "
            f"{100 * wide[-1]:.0f} % at least"
        )
    two = len(wide) == 2 and min(wide) > _FEWEST_APART
    branch = branches_of(data["fig09"])[0]
    table = special_points(branch)
    folds = table["point"].values[table["kind"].values == "fold"]
    first, last = folds.min(), folds.max()
    between = branch.isel(point=slice(first + 1, last))
    unstable = not between["stable"].values.any()
    ends = sorted(branch["omega"].values[[first, last]])
    largest = np.abs(between["floquet_multipliers"].values).max()
    heights = 1e3 * 0.5 * (between["maximum"] - between["minimum"]).sel(state="x").values
    texts[0] += (
        f"; the branch between them, from fold to fold, {ends[0]:.8f} ... {ends[1]:.8f} rad/s: "
        f"{'unstable throughout' if unstable else 'stable in part'}, largest multiplier up to {largest:.3f}"
    )
    below = grazing_of(both[0])[-1] - ends[0]
    yield of_both(
        _9,
        "an unstable region between the jumps with rising and falling frequency",
        texts,
        "none in kind",
        Verdict.AGREES if two and unstable else Verdict.IN_PART if two else Verdict.DIFFERS,
        "Two stable motions coexist between the jumps. The period-1 branch, continued from one orbit, turns at "
        f"{ends[1]:.5f} rad/s, where rising frequency jumps, runs back with amplitudes of {heights.min():.2f} to "
        f"{heights.max():.2f} mm, and turns again at {ends[0]:.5f} rad/s, {below:.5f} rad/s "
        "below the grazing of the motion without contact, where falling frequency jumps.",
    ).measured(between_cell(runs))


def f10(data: Data) -> Iterator[Statement]:
    """No period 2, a small jump in its place."""
    both, runs = _responses(data, "fig10")
    falling, small = ([find(one, way) for one in both] for find, way in ((main_jump, "down"), (small_jump, "up")))
    rig_up, rig_down, rig_small = main_jump(runs, "up"), main_jump(runs, "down"), small_jump(runs, "up")
    doubled = [int((one["period_number"] == 2).sum()) for one in both]
    yield of_both(
        _10,
        "jumps as in Fig. 9, elsewhere with rising than with falling frequency",
        map(_main, both),
        "no number printed",
        agreed(None not in (main_jump(both[0], "up"), falling[0])),
    ).measured(Cell(_main(runs), Verdict.UNDECIDED if None in (rig_up, rig_down) else Verdict.AGREES))
    yield against_grazing("falling jump at grazing", both, -1, falling).measured(grazing_cell(rig_down, FIGURE_10, -1))
    yield of_both(
        _10,
        "no period-2 response",
        (f"{n} of {one['period_number'].size} points with period 2" for n, one in zip(doubled, both, strict=True)),
        "none",
        agreed(not any(doubled)),
    ).measured(no_doubled_cell(runs))
    yield of_both(
        _10,
        "a small jump instead",
        map(_small, both),
        "no number printed",
        agreed(small[0] is not None),
        "With rising frequency at the grazing of the motion without contact, with falling at a fold of the "
        "motion with contact.",
    ).measured(Cell(_small(runs), Verdict.UNDECIDED if rig_small is None else Verdict.AGREES))
    yield against_grazing("small jump, rising, at grazing", both, 0, small).measured(
        grazing_cell(rig_small, FIGURE_10, 0)
    )


def grazing_behind_both(data: Data) -> Iterator[Statement]:
    """Period 2 of Fig. 9 and the small jump of Fig. 10 begin where the motion without contact grazes."""
    both, runs = _responses(data, "fig09")
    omega, number = measured_periods(runs, "up")
    at = np.flatnonzero(number == 2)
    first = Interval(omega[at[0] - 1], omega[at[0]]) if len(at) and at[0] else None
    yield against_grazing(
        "both (period 2 in Fig. 9, the small jump in Fig. 10) are probably related to grazing; closed "
        "form of Fig. 9's lower grazing",
        both,
        0,
        [min(changes(one, 1, 2, "up"), default=None) for one in both],
        "The period-2 range of Fig. 9 begins where the motion without contact grazes, as does the small jump of "
        "Fig. 10.",
        place=_10,
    ).measured(grazing_cell(first, FIGURE_9, 0))


def _ranges(both: Sequence[xr.Dataset], direction: str) -> list[str]:
    found = [range_of(one, 2, direction) for one in both]
    return ["no period 2" if one is None else "period 2 from {:.4f} to {:.4f} rad/s".format(*one) for one in found]


def _main(response: xr.Dataset) -> str:
    up, down = main_jump(response, "up"), main_jump(response, "down")
    return f"rising {up}, falling {down} rad/s"


def _small(response: xr.Dataset) -> str:
    found = [small_jump(response, direction) or "none found" for direction in ("up", "down")]
    return f"rising {found[0]}, falling {found[1]} rad/s"


def doubled_cell(runs: xr.Dataset, direction: str, wanted: float | None = None) -> Cell:
    """The rig's range of period 2 in one direction, and whether a frequency lies in it."""
    omega, number = measured_periods(runs, direction)
    at = omega[number == 2]
    if not len(at):
        return Cell("no run with period 2", Verdict.UNDECIDED)
    text = f"period 2 from {at[0]:.3f} to {at[-1]:.3f} rad/s ({len(at)} run{'s' if len(at) > 1 else ''})"
    if wanted is None or at[0] <= wanted <= at[-1]:
        return Cell(text, Verdict.AGREES)
    below, above = omega[omega < at[0]], omega[omega > at[-1]]  # the range ends between two runs
    outside = (len(below) and wanted <= below[-1]) or (len(above) and wanted >= above[0])
    return Cell(text, Verdict.DIFFERS if outside else Verdict.UNDECIDED)


def grazing_of_paper(figure: Mapping[str, float]) -> list[float]:
    """Closed-form grazing frequencies (rad/s) with the printed parameters."""
    return grazing_frequencies({**{name: TABLE_1[name].value for name in ("m", "k", "c")}, **figure})


def grazing_cell(found: Interval | None, figure: Mapping[str, float], which: int) -> Cell:
    """A jump of the rig beside a closed-form grazing of the paper's parameters."""
    if found is None:
        return Cell("not found", Verdict.UNDECIDED)
    truth = grazing_of_paper(figure)[which]
    return Cell(f"{found} rad/s ({found.value - truth:+.3f} rad/s)", judge(truth, found))


def between_cell(runs: xr.Dataset) -> Cell:
    """Two motions of the rig between the jumps."""
    up, down = main_jump(runs, "up"), main_jump(runs, "down")
    if up is None or down is None:
        return Cell("jumps not found", Verdict.UNDECIDED)
    omega, direction = runs["omega"].values, runs["direction"].values.astype(str)
    inside = (omega > down.high + 1e-6) & (omega < up.low - 1e-6)
    low, high = (runs["amplitude"].values[inside & (direction == way)] for way in ("down", "up"))
    if not len(low) or not len(high):
        return Cell("no run between the jumps", Verdict.UNDECIDED)
    apart = 1 - low.max() / high.min()
    return Cell(
        f"{down.value:.3f} ... {up.value:.3f} rad/s: two motions, amplitudes apart by {100 * apart:.0f} % at least",
        Verdict.IN_PART if apart > _FEWEST_APART else Verdict.DIFFERS,
    )


def no_doubled_cell(runs: xr.Dataset) -> Cell:
    """No range of period 2: a response has it where neighbouring runs of one direction do."""
    doubled = [measured_periods(runs, direction)[1] == 2 for direction in ("up", "down")]
    count = sum(here.sum() for here in doubled)
    ranges = any((here[1:] & here[:-1]).any() for here in doubled)
    text = f"{count} of {runs.sizes['run']} runs with period 2" + ("" if ranges or not count else ", no two neighbours")
    why = "" if ranges or not count else "Rig: a record of some eight turns can show a motion that is still settling."
    return Cell(text, agreed(not ranges), why)
