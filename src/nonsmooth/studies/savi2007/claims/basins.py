"""Attractors beside the motions that the paper names, at g = 0.0014 m (Fig. 14) and omega = 9.55 rad/s (Fig. 18)."""

from __future__ import annotations

from nonsmooth.studies.savi2007.claims.rows import Data, Row
from nonsmooth.studies.savi2007.claims.verdicts import Verdict
from nonsmooth.studies.savi2007.figures.coexisting import names_of
from nonsmooth.studies.savi2007.measure import APERIODIC

__all__ = ["f13_basins", "f17_basins"]


def f13_basins(data: Data) -> list[Row]:
    """Attractors at g = 0.0014 m with their shares."""
    return [_row(data, "basins13", "F13", "Fig. 14(c)", "g = 0.0014 m: period 3", 3)]


def f17_basins(data: Data) -> list[Row]:
    """Attractors at omega = 9.55 rad/s with their shares."""
    return [_row(data, "basins17", "F17", "Fig. 18(b)", "omega = 9.55 rad/s: chaotic", APERIODIC)]


def _row(data: Data, figure: str, claim: str, place: str, says: str, period: int) -> Row:
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
    return Row(
        claim, place, says, f"attractors of {starts} starts: {'; '.join(names)}; none reached by {lost}",
        "not asked: of the exact flow", "none" if alone else f"not alone: {others}",
        Verdict.DIFFERS if period not in periods else Verdict.AGREES if alone else Verdict.IN_PART,
        f"Starts at phase 0 with {ranges}; the shares, with their binomial standard errors, are those of this plane.",
    )  # fmt: skip
