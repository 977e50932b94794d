"""Claims M1 to M4 and C1: the model itself, its smoothing, and the paper's conclusions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from nonsmooth_savi2007.claims.response import grazing_cell
from nonsmooth_savi2007.claims.verdicts import CLOSE, FLOWS, Cell, Data, Statement, Verdict, agreed, judge_step, of_both
from nonsmooth_savi2007.figures.band import FITTED, order_in_eta
from nonsmooth_savi2007.figures.measured_diagrams import slowest
from nonsmooth_savi2007.figures.resonance import grazing_of
from nonsmooth_savi2007.flows import ETA
from nonsmooth_savi2007.measure import APERIODIC, jumps, main_jump, regimes, separation_rate, small_jump
from nonsmooth_savi2007.printed import FIGURE_9, FIGURE_10, FIGURE_12, NUMBERS

ON_A_BORDER = 1e-10  # m; samples nearer to a border than this (the limits at a transition) are of neither side


def _orbits(data: Data, flow: str) -> list[xr.Dataset]:
    return [data["fig12"][f"{flow}_{rho:g}"] for rho in FIGURE_12]


def m1(data: Data) -> Iterator[Statement]:
    """The support pushes, never pulls, and lets go at zero force."""
    texts, pulls = [], []
    for flow in FLOWS:
        force = np.concatenate([orbit["contact_force"].values for orbit in _orbits(data, flow)])
        peak, push = force.min(), force.max()
        pulls.append(push / -peak)
        texts.append(f"force from {peak:.3f} to {push:.0e} N")
    p = _orbits(data, "exact")[0]
    stated, printed_formula = (float(np.sqrt(n * p["k"] / p["m"])) for n in (2, 1))
    yield of_both(
        "Eqs. 1-2",
        "two modes; the support's force f_s < 0 in contact, and zero at release",
        texts,
        "none",
        agreed(max(pulls) < 1e-6),
        f"Over the orbits of Fig. 12. By Eq. 2 the natural frequency is sqrt(2k/m) = {stated:.3f} rad/s, the "
        f"paper's {NUMBERS['natural frequency'].text}; "
        f"the formula printed in Section 3.1, sqrt(k/m), gives {printed_formula:.2f}.",
    )


#: Of each flow: the place, the statement, the regions, and what is to be said of the check.
_REGIONS = {
    "exact": (
        "Eqs. 3-5, Fig. 2a",
        "in contact exactly where h_a > 0 and h_b < 0",
        "region",
        "The mode is stored and changed by transitions, not computed from the state: this is a check.",
    ),
    "smoothed": (
        "Eqs. 6-10, Fig. 2b",
        "smoothed: bands of half width eta, S_a and S_b, between G- and G+",
        "region of Eqs. 9-10",
        "S_a holds the velocity at its entry (Eq. 8a) as memory. Eq. 8a interpolates the forces at the band's "
        "ends; it is not the (1 - q) f- + q f+ of the text above it.",
    ),
}


def in_regions(data: Data, flow: str) -> Iterator[Statement]:
    """The mode of a flow is the region of the state (Eqs. 3-5; smoothed, Eqs. 9-10)."""
    right = total = 0
    for orbit in _orbits(data, flow):
        x, v = (orbit["u"].sel(state=name).values for name in "xv")
        eta = float(orbit["eta"]) if "eta" in orbit.coords else 0.0
        h_a = x - float(orbit["g"])
        h_b = -h_a - float(orbit["c_s"] / orbit["k_s"]) * v
        region = np.select(
            [(np.abs(h_a) < eta) & (h_b <= -h_a), (np.abs(h_b) < eta) & (h_a > -h_b), (h_a >= eta) & (h_b <= -eta)],
            [2, 3, 1],
        )
        edges = [h_a - eta, h_a + eta, h_b - eta, h_b + eta] + [h_a + h_b] * (eta > 0)
        clear = (np.abs(edges) > ON_A_BORDER).all(axis=0)
        right += (region == orbit["mode"].values)[clear].sum()
        total += clear.sum()
    place, says, regions, why = _REGIONS[flow]
    found = f"mode = {regions} at {right} of {total} samples"
    texts = (found, "see M3") if flow == "exact" else ("see M2", found)
    yield of_both(place, says, texts, "none", agreed(right == total), why)


def m4(data: Data) -> Iterator[Statement]:
    """Effect of eta: order 2 away from grazing, and a shift of grazing."""
    errors, grazing = data["eta"]["error"], data["eta"]["grazing"]
    at = errors["error"].sel(eta=ETA, method="nearest")
    order = order_in_eta(errors, "paper")
    fine, coarse = (float(at.sel(form=form).max()) for form in ("paper", "paper, coarse"))
    moved = grazing.sel(eta=ETA, method="nearest")
    shift, closed = (float(moved[name] - grazing["closed_form"][0]) for name in ("grazing", "closed_form"))
    narrow = float(grazing["grazing"][0] - grazing["closed_form"][0])
    yield Statement(
        "Section 4",
        "Runge-Kutta-Fehlberg with eta = 1e-5 in all simulations",
        "reference",
        f"after 4 periods off by at most {coarse:.1e} (in 1 mm, 1 cm/s) at rtol 1e-6, {fine:.1e} by eta alone",
        f"at most {1e3 * coarse:.2f} micrometres or {1e4 * coarse:.1f} micrometres/s",
        Verdict.INPUT,
        "The paper names no tolerance; rtol 1e-6 here. On orbits that cross transversally.",
    )
    yield Statement(
        "Section 4",
        "the choice of eta is important",
        "reference",
        f"error proportional to eta^{order.mean():.2f} for eta between "
        f"{max(FITTED[0], float(errors['eta'].min())):.0e} "
        f"and {FITTED[1]:.0e}",
        f"order {order.min():.3f} ... {order.max():.3f}",
        agreed((np.abs(order - 2) < 0.1).all()),
        "Away from grazing it matters little: a tenth of the band makes a hundredth of the error.",
    )
    yield Statement(
        "closed form, not printed",
        f"near grazing contact begins at g - eta: Fig. 9's falling jump moves by {closed:+.2e} rad/s at eta = 1e-5",
        f"{narrow:+.1e} rad/s off the closed form of g",
        f"moves by {shift:+.2e} rad/s",
        f"{shift - closed:+.1e} rad/s",
        agreed(abs(shift - closed) < 1e-6),
        "Near grazing the effect is proportional to eta itself. Bisected on both models to 1e-7 rad/s.",
    )


#: Jumps of Figs. 9 (0) and 10 (1) at grazing: which jump, with which direction, at which of the grazing frequencies.
_AT_GRAZING = ((0, main_jump, "down", -1), (1, main_jump, "down", -1), (1, small_jump, "up", 0))


def _jumps(both: Sequence[xr.Dataset]) -> int:
    """Number of jumps in Figs. 9 and 10."""
    return sum(len(jumps(one, direction)) for one in both for direction in ("up", "down"))


def c1(data: Data) -> Iterator[Statement]:
    """Jumps, bifurcations, chaos; abrupt changes by grazing."""
    texts, seen, at_grazing = [], [], []
    for flow in FLOWS:
        both = [data[name][flow] for name in ("fig09", "fig10")]
        met = _jumps(both)
        periods = [n for n in np.unique(regimes(data["fig11"][flow], "up")[1]) if n > 0]
        rate, error = separation_rate(data["fig15"][f"{flow}_exponents"])
        texts.append(
            f"{met} jumps in Figs. 9-10; periods {', '.join(map(str, periods))} in Fig. 11; neighbouring trajectories "
            f"separate by a factor exp({rate:.2f} ± {error:.2f}) per period in Fig. 15"
        )
        seen.append(met > 0 and len(periods) > 1 and rate > 5 * error)
        steps = (judge_step(grazing_of(both[i])[at], find(both[i], way)) for i, find, way, at in _AT_GRAZING)
        at_grazing.append(sum(step is Verdict.AGREES for step in steps))
    runs = [data[name]["runs"] for name in ("fig09_rig", "fig10_rig")]
    count = _jumps(runs)
    flips = np.isfinite(slowest(data["fig11_rig"])["measured_flip"].values).sum()
    chaos = int(data["fig16"]["attractor"]["measured_period_number"]) == APERIODIC
    cells = (grazing_cell(find(runs[i], way), (FIGURE_9, FIGURE_10)[i], at) for i, find, way, at in _AT_GRAZING)
    near = sum(cell.verdict is Verdict.AGREES for cell in cells)
    yield of_both(
        "Section 5",
        "dynamical jumps, bifurcations and chaos",
        texts,
        "none in kind",
        agreed(all(seen)),
    ).measured(
        Cell(
            f"{count} jumps in Figs. 9-10, {flips} flips in Fig. 11, {'no period' if chaos else 'a period'} in Fig. 16",
            Verdict.AGREES if count and flips and chaos else Verdict.IN_PART,
        )
    )
    yield of_both(
        "Section 5",
        "grazing causes abrupt changes (falling jumps of Figs. 9 and 10, small rising one)",
        (f"{n} of 3 within one step of the closed-form grazing" for n in at_grazing),
        "none",
        Verdict.AGREES if min(at_grazing) == 3 else Verdict.IN_PART,
        "The support is soft: grazing as such is passed continuously, and the jump is a fold that follows closer "
        "than the steps of these sweeps.",
    ).measured(
        Cell(
            f"{near} of 3 within {CLOSE:g} % of the closed-form grazing",
            Verdict.AGREES if near == 3 else Verdict.IN_PART if near else Verdict.UNDECIDED,
        )
    )


def c1_other_systems(data: Data) -> Iterator[Statement]:
    """The smoothing in the form that fits other systems."""
    order = order_in_eta(data["eta"]["error"], "general")
    yield Statement(
        "Section 5",
        "the procedure may be useful for other non-smooth systems",
        "not a number",
        f"the general form, (1 - q) f- + q f+, converges with order {order.min():.2f} ... {order.max():.2f} on "
        "this oscillator",
        "none",
        Verdict.IN_PART if order.min() > 1 else Verdict.DIFFERS,
        "Shown here on the paper's oscillator only, with the general form in place of Eq. 8.",
    )
