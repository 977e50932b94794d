"""Claims F9a, F9b, F9c and F10: the frequency responses, their jumps, and the grazing behind them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth import special_points
from nonsmooth.studies.savi2007.claims.rows import Data, Row, against_closed_form, against_printed
from nonsmooth.studies.savi2007.claims.verdicts import Cause, Verdict, agreed, judge
from nonsmooth.studies.savi2007.figures.resonance import grazing_of
from nonsmooth.studies.savi2007.grazing import grazing_frequencies
from nonsmooth.studies.savi2007.measure import Interval, changes, jumps, lowest, range_of
from nonsmooth.studies.savi2007.printed import FIGURE_9, NATURAL_FREQUENCY, NUMBERS, TABLE_1

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["f9a", "f9b", "f9c", "f10", "grazing_behind_both", "main_jump", "small_jump"]

_9, _10 = "Section 4, on Fig. 9", "Section 4, on Fig. 10"


def main_jump(response: xr.Dataset, direction: str) -> Interval | None:
    """The jump above resonance: that with the largest step in amplitude."""
    return _by_size(response, direction, largest=True)


def small_jump(response: xr.Dataset, direction: str) -> Interval | None:
    """The smallest of several jumps."""
    return _by_size(response, direction, largest=False) if len(jumps(response, direction)) > 1 else None


def _by_size(response: xr.Dataset, direction: str, largest: bool) -> Interval | None:
    mine = response["jump_direction"].values.astype(str) == direction
    if "jump_variable" in response:
        mine &= response["jump_variable"].values.astype(str) == "x"
    here = response.isel(jump=np.flatnonzero(mine))
    if not here.sizes["jump"]:
        return None
    size = np.abs(here["jump_after"].values - here["jump_before"].values)
    at = here.isel(jump=int(size.argmax() if largest else size.argmin()))
    value, step = float(at["jump_value"]), float(at["jump_step"])
    return Interval(value - 0.5 * step, value + 0.5 * step)


def f9a(data: Data) -> list[Row]:
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
        Row(
            "F9a", _9, f"rising frequency: a small period-2 region near {printed}", _range(exact, "up"),
            _range(smoothed, "up"), f"{printed.text} lies {'inside' if inside else 'outside'}",
            agreed(inside), why,
        ),
        against_printed(
            "F9a", f"rising frequency: dynamical jump near {rising}", rising, main_jump(exact, "up"),
            main_jump(smoothed, "up"),
            "The motion with contact ends in a fold there. Both flows jump at the same place; the printed value "
            "comes out of neither.",
        ),
    ]  # fmt: skip


def _with_printed_frequency() -> list[list[float]]:
    """Grazing frequencies of Fig. 9 (rad/s) were omega_0 of Table 1 right, and its k, or its m, wrong."""
    table = {name: TABLE_1[name].value for name in ("m", "k", "c")}
    ratio = (TABLE_1["omega_0"].value / NATURAL_FREQUENCY) ** 2
    changes = {"k": table["k"] * ratio}, {"m": table["m"] / ratio}
    return [grazing_frequencies({**table, **FIGURE_9, **changed}) for changed in changes]


def f9b(data: Data) -> list[Row]:
    """Falling frequency: the jump at grazing, and period 2 again."""
    exact, smoothed = data["fig09"]["exact"], data["fig09"]["smoothed"]
    closed = grazing_of(exact)[-1]
    falling = NUMBERS["jump falling"]
    (below, stiffer), (under, lighter) = _with_printed_frequency()
    met = [judge(falling.value, Interval(one, one), falling.resolution) for one in (stiffer, lighter)]
    found = range_of(exact, 2, "down")
    return [
        against_printed(
            "F9b", f"falling frequency: dynamical jump at {falling}", falling, main_jump(exact, "down"),
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
            "F9b", "closed form, not printed", "falling jump at grazing", (closed, grazing_of(smoothed)[-1]),
            main_jump(exact, "down"), main_jump(smoothed, "down"),
            "Within one step of the sweep; read from its amplitudes alone.",
        ),
        Row(
            "F9b", _9, "falling frequency: period 2 appears again", _range(exact, "down"), _range(smoothed, "down"),
            "none", agreed(found is not None),
        ),
    ]  # fmt: skip


def f9c(data: Data) -> list[Row]:
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
        Row(
            "F9c", _9, "an unstable region between the jumps with rising and falling frequency", texts[0], texts[1],
            "none in kind", Verdict.AGREES if two and unstable else Verdict.IN_PART if two else Verdict.DIFFERS, why,
        )
    ]  # fmt: skip


def f10(data: Data) -> list[Row]:
    """No period 2, a small jump in its place."""
    exact, smoothed = data["fig10"]["exact"], data["fig10"]["smoothed"]
    grazing = list(zip(grazing_of(exact), grazing_of(smoothed), strict=True))
    doubled = [int((one["period_number"] == 2).sum()) for one in (exact, smoothed)]
    count = exact["period_number"].size, smoothed["period_number"].size
    small = small_jump(exact, "up")
    return [
        Row(
            "F10", _10, "jumps as in Fig. 9, elsewhere with rising than with falling frequency",
            _both(exact), _both(smoothed), "no number printed",
            agreed(None not in (main_jump(exact, "up"), main_jump(exact, "down"))),
        ),
        against_closed_form(
            "F10", "closed form, not printed", "falling jump at grazing", grazing[-1], main_jump(exact, "down"),
            main_jump(smoothed, "down"),
        ),
        Row(
            "F10", _10, "no period-2 response", f"{doubled[0]} of {count[0]} points with period 2",
            f"{doubled[1]} of {count[1]} points with period 2", "none", agreed(not any(doubled)),
        ),
        Row(
            "F10", _10, "a small jump instead", _small(exact), _small(smoothed), "no number printed",
            agreed(small is not None),
            "With rising frequency at the grazing of the motion without contact, with falling at a fold of the "
            "motion with contact.",
        ),
        against_closed_form(
            "F10", "closed form, not printed", "small jump, rising, at grazing", grazing[0], small,
            small_jump(smoothed, "up"),
        ),
    ]  # fmt: skip


def grazing_behind_both(data: Data) -> list[Row]:
    """Period 2 of Fig. 9 and the small jump of Fig. 10 begin where the motion without contact grazes."""
    exact, smoothed = data["fig09"]["exact"], data["fig09"]["smoothed"]
    return [
        against_closed_form(
            "F10", _10, "both (period 2 in Fig. 9, the small jump in Fig. 10) are probably related to grazing; closed "
            "form of Fig. 9's lower grazing", (grazing_of(exact)[0], grazing_of(smoothed)[0]),
            lowest(changes(exact, 1, 2, "up")), lowest(changes(smoothed, 1, 2, "up")),
            "The period-2 range of Fig. 9 begins where the motion without contact grazes, as does the small jump of "
            "Fig. 10.",
        )
    ]  # fmt: skip


def _range(response: xr.Dataset, direction: str) -> str:
    found = range_of(response, 2, direction)
    return "no period 2" if found is None else f"period 2 from {found[0]:.4f} to {found[1]:.4f} rad/s"


def _both(response: xr.Dataset) -> str:
    up, down = main_jump(response, "up"), main_jump(response, "down")
    return f"rising {up}, falling {down} rad/s"


def _small(response: xr.Dataset) -> str:
    found = [small_jump(response, direction) or "none found" for direction in ("up", "down")]
    return f"rising {found[0]}, falling {found[1]} rad/s"
