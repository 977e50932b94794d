"""Claims F11, F13 and F15 to F17: bifurcation diagrams, the strange attractor, basins, on model and rig."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import xarray as xr
from scipy.spatial import cKDTree

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
    of_both,
    printed_cell,
)
from nonsmooth_savi2007.figures.charts import names_of
from nonsmooth_savi2007.figures.measured_diagrams import flip_of, rate_of, slowest
from nonsmooth_savi2007.figures.motions import PHASES
from nonsmooth_savi2007.measure import (
    APERIODIC,
    UNSETTLED,
    Interval,
    changes,
    free_amplitude,
    motion_word,
    parameter_of,
    period_word,
    period_words,
    periods_reached,
    range_of,
    regimes,
    separation_rate,
)
from nonsmooth_savi2007.printed import FIGURE_14, FIGURE_17_TEXT, NUMBERS, Printed


def f11(data: Data) -> Iterator[Statement]:
    """The ranges of period 1, 2, 4 and of chaos over the forcing amplitude (slowly rising)."""
    swept, rise = [data["fig11"][flow] for flow in FLOWS], slowest(data["fig11_rig"])
    late = "A rise passes a flip late, at a larger forcing; how fast the paper's rise is, it does not say."
    for n, says, why, cell in (
        (1, "period 1 for rho of at least", "", _flip(data, rise, 1)),
        (2, "period 2 down to", _hysteresis(swept[0]), _flip(data, rise, 2)),
        (4, "period 4 down to", "Longer periods follow below.", Cell("longer periods pass too quickly in a rise")),
    ):
        printed = NUMBERS[f"period {n} from"]
        found = [max(changes(one, n, 2 * n, "up"), default=None) for one in swept]
        beyond = found[0] is not None and found[0].high < printed.value
        words = f"{late if beyond else ''} {why}".strip()
        yield against_printed(f"{says} {printed}", printed, found, words).measured(cell)
    edges = [_chaos_from(one) for one in swept]
    values, regime = regimes(swept[0], "up")
    inside = regime[values <= edges[0].high] if edges[0] is not None else regime[:0]
    windows = np.unique(inside[inside > 0])
    yield against_printed(
        f"chaos for rho of at most {printed}",
        printed,
        edges,
        f"No period up to 16 at {(inside == APERIODIC).sum()} of {len(inside)} values below; windows of "
        f"period {', '.join(map(str, windows)) or '(none)'} between.",
    ).measured(_below(rise, printed))


def _chaos_from(swept: xr.Dataset) -> Interval | None:
    """The upper end of what has no period, on the rising sweep."""
    found = range_of(swept, APERIODIC, "up")
    if found is None:
        return None
    values, regime = regimes(swept, "up")
    above = values[(values > found[1]) & (regime != UNSETTLED)]
    return Interval(found[1], above[0]) if len(above) else None


def _hysteresis(swept: xr.Dataset) -> str:
    """Ranges in which the periodic motions of the two directions differ."""
    up, down = swept.sel(direction="up"), swept.sel(direction="down")
    periodic = (up["period_number"] > 0) & (down["period_number"] > 0)
    top = [one["section"].sel(state="v").max("iterate") for one in (up, down)]
    differ = periodic & (abs(top[0] - top[1]) > 1e-4)
    at = swept["rho"].values[differ.values & (up["period_number"] == 2).values]
    if not len(at):
        return ""
    return (
        f"Within the range, two motions of period 2 coexist from {at[0]:.4f} to {at[-1]:.4f} N (up and down sweeps "
        "differ), which the paper does not mention."
    )


def _flip(data: Data, rise: xr.Dataset, n: int) -> Cell:
    """Flip of period n of the rig's slowest rise beside the printed end of its range; where told, the model's."""
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


def _below(rise: xr.Dataset, end: Printed) -> Cell:
    """The most frequent period number of the rig's turns at a smaller forcing."""
    numbers = rise["measured_period_number"].values[rise["measured_rho"].values < end.value]
    if not len(numbers):
        return Cell(f"no turn below {end}")
    kinds, counts = np.unique(numbers, return_counts=True)
    kind, share = kinds[counts.argmax()], 100 * counts.max() / counts.sum()
    return Cell(f"{period_word(kind)} in {share:.0f} % of the turns below {end}", agreed(kind == APERIODIC))


def f13(data: Data) -> Iterator[Statement]:
    """Periodic and chaotic responses over the gap, and what coexists with them."""
    texts, others = [], []
    for flow in FLOWS:
        values, regime = regimes(data["fig13"][flow], "up")
        ends = {n: values[regime == n] for n in (1, 2, 4, 8)}
        parts = [f"period {n} to {at[-1]:.5f} m" for n, at in ends.items() if len(at)]
        chaos = range_of(data["fig13"][flow], APERIODIC, "up")
        parts.append("no chaos" if chaos is None else f"no period from {chaos[0]:.5f} m")
        texts.append(", ".join(parts))
        others.append(_coexisting(data["fig13"][f"{flow}_starts"]))
    runs = data["fig13_rig"]["runs"]
    numbers = {g: runs["period_number"].values[runs["setting"].values == g].tolist() for g in FIGURE_14}
    reached = {n for one in numbers.values() for n in one}
    several = sum(len(set(one)) > 1 for one in numbers.values())
    starts = max(map(len, numbers.values()))
    yield of_both(
        "Section 4, on Fig. 13",
        "periodic and chaotic responses as the gap varies",
        texts,
        "none in kind",
        agreed("no period" in texts[0]),
    ).measured(
        Cell(
            "; ".join(f"{g:g}: {period_words(sorted(set(one)))}" for g, one in numbers.items()),
            agreed(APERIODIC in reached and len(reached) > 1),
        )
    )
    yield of_both(
        "not in the paper",
        "coexisting motions (several starts)",
        others,
        "none in kind",
        Verdict.ADDS,
        "One sweep follows one motion; the paper shows one at each gap.",
    ).measured(
        Cell(
            f"more than one motion at {several} of {len(numbers)} gaps, {starts} starts each",
            Verdict.ADDS if several else Verdict.NOT_ASKED,
        )
        if starts > 1
        else Cell("one start at each gap")
    )


def _coexisting(many: xr.Dataset) -> str:
    """Ranges in which several starts reach more than one regime."""
    values = many[parameter_of(many)].values
    at = [value for value in values if len(periods_reached(many, value).keys() - {UNSETTLED}) > 1]
    if not at:
        return "none found"
    return f"more than one motion at {len(at)} of {len(values)} gaps, from {at[0]:.5f} to {at[-1]:.5f} m"


def f15(data: Data) -> Iterator[Statement]:
    """The strange attractor: neighbouring trajectories separate, and both flows draw the same set."""

    rates = [separation_rate(data["fig15"][f"{flow}_exponents"]) for flow in FLOWS]
    worst = 0.0
    for key in PHASES:
        exact, smoothed = (
            data["fig15"][f"{flow}_{key}"]["section"].transpose("iterate", "state").values for flow in FLOWS
        )
        size = exact.max(axis=0) - exact.min(axis=0)
        distance, _ = cKDTree(exact / size).query(smoothed / size)
        worst = max(worst, np.quantile(distance, 0.99))
    yield of_both(
        "Fig. 15",
        "g = 0.0018 m: a strange attractor, sections at four phases",
        (
            f"neighbouring trajectories separate by a factor exp({rate:.3f} ± {error:.3f}) per period"
            for rate, error in rates
        ),
        f"99 % of the smoothed points within {100 * worst:.2f} % of the attractor's size of an exact point",
        agreed(all(rate > 5 * error for rate, error in rates) and worst < 0.05),
        "By the largest Lyapunov exponent.",
    ).measured(Cell("not asked: see F16"))


def f16(data: Data) -> Iterator[Statement]:
    """The rig's attractor beside the model's, at four phases."""
    result = data["fig16"]["attractor"]
    ratio = result["energy_distance_matched"].values / result["measured_halves_p95"].values
    number = int(result["measured_period_number"])
    yield Statement(
        "Fig. 16",
        "the same attractor from the apparatus, at four phases",
        "see F15",
        "see F15",
        f"energy distance {', '.join(f'{r:.2f}' for r in ratio)} of the 95th percentile of the record's halves",
        Verdict.NOT_ASKED,
        "At phases 0, pi/2, pi, 3 pi/2, to the exact model with the parameters identified; below 2 the clouds can "
        "hardly be told apart by a record of this length.",
        f"{period_word(number)}, {result.sizes['measured_iterate']} turns",
        agreed(number == APERIODIC and ratio.max() < 2),
    )


def f17(data: Data) -> Iterator[Statement]:
    """Three responses over the frequency, contact or not, and the transitions between them."""
    runs = data["fig17_rig"]["runs"]
    for omega, says in FIGURE_17_TEXT.items():
        texts, kinds, contacts = [], [], []
        for flow in FLOWS:
            one = data["fig17"][flow].sel(direction="up").sel(omega=omega, method="nearest")
            kinds.append(int(one["period_number"]))
            contacts.append(float(one["contacts_per_period"]))
            texts.append(f"{motion_word(kinds[-1])}, {contacts[-1]:.2f} contacts per period")
        right, swapped = _as_stated(says, kinds[0], contacts[0] > 0)
        difference = "another motion" if not right else "contact and no contact swapped" if swapped else "none"
        near = runs.isel(run=np.abs(runs["value"].values - omega).argmin())
        number, touches = int(near["period_number"]), bool(near["contact"])
        text = f"{period_word(number)}, {'contact' if touches else 'no contact'} (at {float(near['value']):.3f} rad/s)"
        yield of_both(
            "Section 4, on Fig. 17",
            f"omega = {omega:g} rad/s: {says}",
            texts,
            difference,
            agreed(difference == "none"),
            "Rising sweep; other motions coexist (Fig. 18)."
            if "chaotic" in says
            else _without_support(data["fig17"]["exact"], omega, swapped),
            cause=Cause.MISPRINT if right and swapped else None,
        ).measured(Cell(text, agreed(_as_stated(says, number, touches) == (True, False))))
    yield _abrupt(data["fig17"]).measured(_transitions(runs))


def _as_stated(says: str, number: int, touches: bool) -> tuple[bool, bool]:
    """Return whether a motion is of the kind stated, and whether contact and no contact are swapped."""
    chaos = "chaotic" in says
    return (number == APERIODIC) == chaos, not chaos and touches != ("with contact" in says)


def _without_support(swept: xr.Dataset, omega: float, swapped: bool) -> str:
    """The linear amplitude against the gap."""
    parameters = {name: float(swept[name]) for name in ("m", "k", "c", "rho")}
    linear, gap = free_amplitude({**parameters, "omega": omega}), float(swept["g"])
    more = linear > gap
    return (
        f"Without the support the amplitude would be {1e3 * linear:.2f} mm, {'more' if more else 'less'} than the gap "
        f"of {1e3 * gap:g} mm: {'contact is certain' if more else 'motion without contact exists'}."
        + (' The text has "contact" and "no contact" swapped.' if swapped else "")
    )


def _abrupt(data: Mapping[str, xr.Dataset]) -> Statement:
    texts = []
    for flow in FLOWS:
        first = min(changes(data[flow], 1, 2, "up"), default=None)
        rising, falling = (range_of(data[flow], APERIODIC, direction) for direction in ("up", "down"))
        if first is None or rising is None or falling is None:
            texts.append("not found")
            continue
        texts.append(
            f"into chaos by period doublings from {first.value:.3f} to {rising[0]:.3f} rad/s; out of it at once, "
            f"rising after {rising[1]:.4f}, falling into it at {falling[1]:.4f} rad/s"
        )
    short, long = (data[f"exact_{word}"] for word in ("short", "long"))  # how long chaos lasts just above grazing
    omega = float(short["omega"][0])
    left = [periods_reached(survey, omega).get(APERIODIC, 0) for survey in (short, long)]
    return of_both(
        "Section 4, on Fig. 17",
        "abrupt transitions from periodic to chaotic and from chaotic to periodic",
        texts,
        "one of two is abrupt",
        Verdict.DIFFERS if "not found" in texts else Verdict.IN_PART,
        "The transition at the higher frequency is abrupt. Above grazing chaos is a transient, which looks like "
        f"hysteresis: at {omega:g} rad/s {left[0]} of {short.sizes['start']} starts have no period after "
        f"{short.attrs['transient']} periods, {left[1]} after {long.attrs['transient']}. The other is a cascade of "
        "flips that looks abrupt on the scale of the figure.",
    )


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


def f17_grazing(data: Data) -> Iterator[Statement]:
    """Falling frequency: motion without contact ends, in chaos, where it grazes."""
    both = [data["fig17"][flow] for flow in FLOWS]
    met = [max(changes(one, 1, APERIODIC, "down"), default=None) for one in both]
    yield against_grazing("the abrupt transition is grazing (falling)", both, -1, met).measured(
        Cell("not recorded with falling frequency")
    )


#: Where basins were computed: the place of the motion that the paper shows there, what it is, and its period number.
_BASINS = {
    "basins13": ("Fig. 14(c)", "g = 0.0014 m: period 3", 3),
    "basins17": ("Fig. 18(b)", "omega = 9.55 rad/s: chaotic", APERIODIC),
}


def attractors(data: Data, name: str) -> Iterator[Statement]:
    """Attractors beside one that the paper shows, with their shares."""
    found, (place, says, period) = data[name]["basins"], _BASINS[name]
    names = names_of(found)
    periods = found["period_number"].values.tolist()
    alone = len(names) == 1
    label = found["label"]
    ranges = " and ".join(
        f"{name} in {float(found[name][0]):g} ... {float(found[name][-1]):g} {found[name].attrs['units']}"
        for name in label.dims
    )
    others = ", ".join(name for name, number in zip(names, periods, strict=True) if number != period)
    yield Statement(
        place,
        says,
        f"attractors of {label.size} starts: {'; '.join(names)}; none reached by {(label.values < 0).sum()}",
        "not asked: of the exact flow",
        "none" if alone else f"not alone: {others}",
        Verdict.DIFFERS if period not in periods else Verdict.AGREES if alone else Verdict.IN_PART,
        f"Starts at phase 0 with {ranges}; the shares, with their binomial standard errors, are those of this plane.",
    )
