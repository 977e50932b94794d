"""Claims F11 to F18: bifurcation diagrams, phase portraits, the strange attractor, basins."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth_savi2007.claims.verdicts import (
    Cause,
    Data,
    Statement,
    Verdict,
    against_closed_form,
    against_printed,
    agreed,
)
from nonsmooth_savi2007.figures.coexisting import names_of
from nonsmooth_savi2007.figures.gap import PHASES
from nonsmooth_savi2007.figures.portraits import chosen_start, words_of
from nonsmooth_savi2007.figures.resonance import grazing_of
from nonsmooth_savi2007.grazing import free_amplitude
from nonsmooth_savi2007.measure import (
    APERIODIC,
    UNSETTLED,
    Interval,
    changes,
    highest,
    lowest,
    periods_reached,
    range_of,
    regimes,
    separation_rate,
)
from nonsmooth_savi2007.printed import FIGURE_12, FIGURE_14, FIGURE_14_TEXT, FIGURE_17_TEXT, FIGURE_18, NUMBERS

if TYPE_CHECKING:
    import xarray as xr

FLOWS = ("exact", "smoothed")


def f11(data: Data) -> list[Statement]:
    """The ranges of period 1, 2, 4 and of chaos over the forcing amplitude (slowly rising)."""
    swept = [data["fig11"][flow] for flow in FLOWS]
    why = {1: "", 2: _hysteresis(swept[0]), 4: "Longer periods follow below."}
    late = "A rise passes a flip late, at a larger forcing; how fast the paper's rise is, it does not say."
    says = {1: "period 1 for rho of at least", 2: "period 2 down to", 4: "period 4 down to"}
    rows = []
    for n in (1, 2, 4):
        printed = NUMBERS[f"period {n} from"]
        found = [highest(changes(one, n, 2 * n, "up")) for one in swept]
        beyond = found[0] is not None and found[0].high < printed.value
        words = f"{late if beyond else ''} {why[n]}".strip()
        rows.append(against_printed("F11", f"{says[n]} {printed}", printed, found[0], found[1], words))
    printed = NUMBERS["period 4 from"]
    edges = [_chaos_from(one) for one in swept]
    values, regime = regimes(swept[0], "up")
    inside = regime[values <= edges[0].high] if edges[0] is not None else regime[:0]
    windows = sorted({int(n) for n in inside if n > 0})
    rows.append(
        against_printed(
            "F11",
            f"chaos for rho of at most {printed}",
            printed,
            edges[0],
            edges[1],
            f"No period up to 16 at {int((inside == APERIODIC).sum())} of {len(inside)} values below; windows of "
            f"period {', '.join(map(str, windows)) or '(none)'} between.",
        )
    )
    return rows


def _chaos_from(swept: xr.Dataset) -> Interval | None:
    """The upper end of what has no period, on the rising sweep."""
    found = range_of(swept, APERIODIC, "up")
    if found is None:
        return None
    values, regime = regimes(swept, "up")
    above = values[(values > found[1]) & (regime != UNSETTLED)]
    return Interval(found[1], float(above[0])) if len(above) else None


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


def _reached(survey: xr.Dataset, values: Mapping[float, int]) -> str:
    return "; ".join(f"{value:g}: {words_of(periods_reached(survey, value))}" for value in values)


def _apart(data: Data, figure: str, shown: Mapping[float, int]) -> str:
    """Largest distance between the section points of the exact and the smoothed periodic orbits drawn."""
    worst = 0.0
    for value, wanted in shown.items():
        if wanted == APERIODIC:
            continue
        points = []
        for flow in FLOWS:
            survey = data[figure][flow]
            parameter = str(survey["maximum"].dims[0])
            one = survey.sel({parameter: value}, method="nearest").isel(start=chosen_start(survey, value, wanted))
            points.append(one["section"].transpose("iterate", "state").values[-wanted:])
        distance = np.abs(points[0][:, None, :] - points[1][None, :, :])
        worst = max(worst, float(distance[..., 0].min(axis=1).max()))
    return f"section points of both flows within {1e6 * worst:.2g} micrometres"


def f12(data: Data) -> list[Statement]:
    """Portraits at four amplitudes."""
    surveys = [data["fig12"][flow] for flow in FLOWS]
    met = all(periods_reached(surveys[0], rho).keys() == {period} for rho, period in FIGURE_12.items())
    wanted = ", ".join(f"{rho:g}: period {period}" for rho, period in FIGURE_12.items())
    return [
        Statement(
            "F12",
            "Fig. 12 with the ranges of Fig. 11",
            f"orbits and section points at rho = {wanted}",
            _reached(surveys[0], FIGURE_12),
            _reached(surveys[1], FIGURE_12),
            _apart(data, "fig12", FIGURE_12),
            agreed(met),
            "The phase of the paper's section is not stated; 0 here.",
        )
    ]


def f13(data: Data) -> list[Statement]:
    """Periodic and chaotic responses over the gap, and what coexists with them."""
    texts, others = [], []
    for flow in FLOWS:
        values, regime = regimes(data["fig13"][flow], "up")
        parts = [_span(values, regime, n) for n in (1, 2, 4, 8)]
        chaos = range_of(data["fig13"][flow], APERIODIC, "up")
        parts.append("no chaos" if chaos is None else f"no period from {chaos[0]:.5f} m")
        texts.append(", ".join(part for part in parts if part))
        others.append(_coexisting(data["fig13"][f"{flow}_starts"], data["fig13"][flow]))
    return [
        Statement(
            "F13",
            "Section 4, on Fig. 13",
            "periodic and chaotic responses as the gap varies",
            texts[0],
            texts[1],
            "none in kind",
            agreed("no period" in texts[0]),
        ),
        Statement(
            "F13",
            "not in the paper",
            "coexisting motions (several starts)",
            others[0],
            others[1],
            "none in kind",
            Verdict.ADDS,
            "One sweep follows one motion; the paper shows one at each gap.",
        ),
    ]


def _span(values: np.ndarray, regime: np.ndarray, n: int) -> str:
    at = np.flatnonzero(regime == n)
    return f"period {n} to {values[at[-1]]:.5f} m" if len(at) else ""


def _coexisting(many: xr.Dataset, swept: xr.Dataset) -> str:
    """Ranges in which several starts reach more than one regime."""
    parameter = str(swept["maximum"].dims[0])
    values = many[parameter].values
    several = [len({n for n in periods_reached(many, value) if n != UNSETTLED}) > 1 for value in values]
    if not any(several):
        return "none found"
    at = values[np.array(several)]
    return f"more than one motion at {len(at)} of {len(values)} gaps, from {at[0]:.5f} to {at[-1]:.5f} m"


def f14(data: Data) -> list[Statement]:
    """Period numbers at the gaps of the caption, and at those printed in the text."""
    exact, smoothed = (data["fig14"][flow] for flow in FLOWS)
    rows = []
    for g, period in FIGURE_14.items():
        reached = periods_reached(exact, g)
        alone = reached.keys() == {period}
        verdict = agreed(period in reached)
        why = "" if alone else "Motions coexist here; which is met depends on the start."
        rows.append(
            Statement(
                "F14",
                "Fig. 14, caption",
                f"g = {g:g} m: {_name(period)}",
                words_of(reached),
                words_of(periods_reached(smoothed, g)),
                "none" if period in reached else "other period",
                verdict,
                why,
            )
        )
    right = [g for g, period in FIGURE_14_TEXT.items() if period in periods_reached(exact, g)]
    rows.append(
        Statement(
            "F14",
            "Section 4, on Fig. 14",
            "the text's gaps: " + ", ".join(f"{g:g}: {_name(period)}" for g, period in FIGURE_14_TEXT.items()),
            _reached(exact, FIGURE_14_TEXT),
            _reached(smoothed, FIGURE_14_TEXT),
            f"{len(right)} of {len(FIGURE_14_TEXT)} as printed",
            agreed(len(right) == len(FIGURE_14_TEXT)),
            "The text prints other gaps than the caption; the caption's are those that show what is claimed.",
            cause=Cause.MISPRINT if all(row.verdict is Verdict.AGREES for row in rows) else None,
        )
    )
    return rows


def _name(period: int) -> str:
    return "chaos" if period == APERIODIC else f"period {period}"


def f15(data: Data) -> list[Statement]:
    """The strange attractor: neighbouring trajectories separate, and both flows draw the same set."""
    from scipy.spatial import cKDTree

    rates = [separation_rate(data["fig15"][f"{flow}_twins"]) for flow in FLOWS]
    worst = 0.0
    for key in PHASES:
        exact, smoothed = (
            data["fig15"][f"{flow}_{key}"]["section"].transpose("iterate", "state").values for flow in FLOWS
        )
        size = exact.max(axis=0) - exact.min(axis=0)
        distance, _ = cKDTree(exact / size).query(smoothed / size)
        worst = max(worst, float(np.quantile(distance, 0.99)))
    texts = [
        f"neighbouring trajectories separate by a factor exp({rate:.3f} ± {error:.3f}) per period"
        for rate, error in rates
    ]
    chaotic = all(rate > 5 * error for rate, error in rates)
    return [
        Statement(
            "F15",
            "Fig. 15",
            "g = 0.0018 m: a strange attractor, sections at four phases",
            texts[0],
            texts[1],
            f"99 % of the smoothed points within {100 * worst:.2f} % of the attractor's size of an exact point",
            agreed(chaotic and worst < 0.05),
            "A mean over the first returns of pairs of neighbours; not a Lyapunov exponent with its error.",
        )
    ]


def f17(data: Data) -> list[Statement]:
    """Three responses over the frequency, contact or not, and the transitions between them."""
    return [*(_response_at(data, omega, says) for omega, says in FIGURE_17_TEXT.items()), _abrupt(data)]


def _response_at(data: Data, omega: float, says: str) -> Statement:
    texts, contacts, kinds = [], [], []
    for flow in FLOWS:
        one = data["fig17"][flow].sel(direction="up").sel(omega=omega, method="nearest")
        contacts.append(float(one["contacts_per_period"]))
        kinds.append(int(one["period_number"]))
        texts.append(f"{_name(kinds[-1])}, {contacts[-1]:.2f} contacts per period")
    chaos = "chaotic" in says
    right_kind = (kinds[0] == APERIODIC) == chaos
    swapped = not chaos and (contacts[0] > 0) != ("with contact" in says)
    difference = "another motion" if not right_kind else "contact and no contact swapped" if swapped else "none"
    return Statement(
        "F17",
        "Section 4, on Fig. 17",
        f"omega = {omega:g} rad/s: {says}",
        texts[0],
        texts[1],
        difference,
        agreed(difference == "none"),
        "Rising sweep; other motions coexist (Fig. 18)." if chaos else _without_support(data, omega, swapped),
        cause=Cause.MISPRINT if right_kind and swapped else None,
    )


def _without_support(data: Data, omega: float, swapped: bool) -> str:
    """The linear amplitude against the gap."""
    swept = data["fig17"]["exact"]
    parameters = {name: float(swept[name]) for name in ("m", "k", "c", "rho")}
    linear, gap = free_amplitude({**parameters, "omega": omega}), float(swept["g"])
    more = linear > gap
    return (
        f"Without the support the amplitude would be {1e3 * linear:.2f} mm, {'more' if more else 'less'} than the gap "
        f"of {1e3 * gap:g} mm: {'contact is certain' if more else 'motion without contact exists'}."
        + (' The text has "contact" and "no contact" swapped.' if swapped else "")
    )


def _abrupt(data: Data) -> Statement:
    texts = []
    for flow in FLOWS:
        swept = data["fig17"][flow]
        first = lowest(changes(swept, 1, 2, "up"))
        chaos = [range_of(swept, APERIODIC, direction) for direction in ("up", "down")]
        if first is None or None in chaos:
            texts.append("not found")
            continue
        (begin, up), (_, down) = (ends for ends in chaos if ends is not None)
        texts.append(
            f"into chaos by period doublings from {first.value:.3f} to {begin:.3f} rad/s; out of it at once, rising "
            f"after {up:.4f}, falling into it at {down:.4f} rad/s"
        )
    return Statement(
        "F17",
        "Section 4, on Fig. 17",
        "abrupt transitions from periodic to chaotic and from chaotic to periodic",
        texts[0],
        texts[1],
        "one of two is abrupt",
        Verdict.DIFFERS if "not found" in texts else Verdict.IN_PART,
        f"{_lasting(data)} The other is a cascade of flips that looks abrupt on the scale of the figure.",
    )


def _lasting(data: Data) -> str:
    """Duration of chaos just above grazing."""
    short, long = (data["fig17"][f"exact_{word}"] for word in ("short", "long"))
    omega = float(short["omega"][0])
    left = [periods_reached(survey, omega).get(APERIODIC, 0) for survey in (short, long)]
    waited = [survey.attrs["transient"] for survey in (short, long)]
    return (
        "The transition at the higher frequency is abrupt. Above grazing chaos is a transient, which looks like "
        f"hysteresis: at {omega:g} rad/s {left[0]} of {short.sizes['start']} starts have no period after {waited[0]} "
        f"periods, {left[1]} after {waited[1]}."
    )


def f17_grazing(data: Data) -> list[Statement]:
    """Falling frequency: motion without contact ends, in chaos, where it grazes."""
    exact, smoothed = (data["fig17"][flow] for flow in FLOWS)
    return [
        against_closed_form(
            "F17",
            "closed form, not printed",
            "the abrupt transition is grazing (falling)",
            (grazing_of(exact)[-1], grazing_of(smoothed)[-1]),
            highest(changes(exact, 1, APERIODIC, "down")),
            highest(changes(smoothed, 1, APERIODIC, "down")),
        )
    ]


def f18(data: Data) -> list[Statement]:
    """Portraits at three frequencies."""
    surveys = [data["fig18"][flow] for flow in FLOWS]
    met = all(period in periods_reached(surveys[0], omega) for omega, period in FIGURE_18.items())
    rate, error = separation_rate(data["fig18"]["exact_twins"])
    wanted = ", ".join(f"{omega:g}: {_name(period)}" for omega, period in FIGURE_18.items())
    return [
        Statement(
            "F18",
            "Fig. 18, caption",
            f"orbits at omega = {wanted}",
            _reached(surveys[0], FIGURE_18),
            _reached(surveys[1], FIGURE_18),
            _apart(data, "fig18", FIGURE_18),
            agreed(met),
            "Neighbouring trajectories on the chaotic orbit separate by a factor "
            f"exp({rate:.2f} ± {error:.2f}) per period (exact).",
        )
    ]


def f13_basins(data: Data) -> list[Statement]:
    """Attractors at g = 0.0014 m with their shares."""
    return [_row(data, "basins13", "F13", "Fig. 14(c)", "g = 0.0014 m: period 3", 3)]


def f17_basins(data: Data) -> list[Statement]:
    """Attractors at omega = 9.55 rad/s with their shares."""
    return [_row(data, "basins17", "F17", "Fig. 18(b)", "omega = 9.55 rad/s: chaotic", APERIODIC)]


def _row(data: Data, figure: str, claim: str, place: str, says: str, period: int) -> Statement:
    found = data[figure]["basins"]
    names = names_of(found)
    periods = found["period_number"].values.tolist()
    alone = len(names) == 1
    first, second = (str(dim) for dim in found["label"].dims)
    starts = found.sizes[first] * found.sizes[second]
    lost = int((found["label"].values < 0).sum())
    ranges = " and ".join(
        f"{name} in {float(found[name][0]):g} ... {float(found[name][-1]):g} {found[name].attrs['units']}"
        for name in (first, second)
    )
    others = ", ".join(name for name, number in zip(names, periods, strict=True) if number != period)
    return Statement(
        claim,
        place,
        says,
        f"attractors of {starts} starts: {'; '.join(names)}; none reached by {lost}",
        "not asked: of the exact flow",
        "none" if alone else f"not alone: {others}",
        Verdict.DIFFERS if period not in periods else Verdict.AGREES if alone else Verdict.IN_PART,
        f"Starts at phase 0 with {ranges}; the shares, with their binomial standard errors, are those of this plane.",
    )
