"""The table of flips, folds and grazing points of Figs. 9, 10, 11, 13 and 17, with closed forms where they exist."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from nonsmooth_savi2007.claims.verdicts import Data
from nonsmooth_savi2007.figures.branches import VARIED, branches_of, rows_of
from nonsmooth_savi2007.figures.resonance import grazing_of
from nonsmooth_savi2007.report.pages import Written, table

_UNITS = {"omega": ("rad/s", 8), "rho": ("N", 8), "g": ("m", 11)}  # decimals: eight digits at least


class SpecialPoint(NamedTuple):
    """One point: its figure and branch, its value, its largest multiplier (at a graze that without the contact).

    ``contact``: the largest multiplier with the contact, in the limit; ``closed``: the value in closed form.
    """

    figure: str
    period: int
    kind: str
    parameter: str
    value: float
    multiplier: complex
    contact: complex | None = None
    closed: float | None = None


def table_of_points(data: Data) -> list[SpecialPoint]:
    """All special points of the figures that are there, by figure and period; along their branches."""
    return [
        point
        for figure in VARIED
        if figure in data
        for branch in branches_of(data[figure])
        for point in _points(figure, branch)
    ]


def _points(figure: str, branch: xr.Dataset) -> list[SpecialPoint]:
    parameter = str(branch.attrs["parameter"])
    special = rows_of(branch)
    contacts = branch["contacts_per_period"].values
    found = []
    for i in range(special.sizes["special"]):
        row = special.isel(special=i)
        kind, value, at = str(row["kind"].values), float(row[parameter]), int(row["point"])
        contact = closed = None
        if kind == "grazing":
            contact = _largest(row["contact_multipliers"].values) if row["bounded"] else None
            free = contacts[max(at - 1, 0) : at + 2].min() == 0  # on one side there is no contact at all
            if free and parameter == "omega" and int(branch["period_number"]) == 1:
                closed = min(grazing_of(branch), key=lambda omega: abs(omega - value))
        found.append(
            SpecialPoint(
                figure,
                int(branch["period_number"]),
                kind,
                parameter,
                value,
                _largest(row["floquet_multipliers"].values),
                contact,
                closed,
            )
        )
    return found


def _largest(multipliers: np.ndarray) -> complex:
    known = multipliers[~np.isnan(multipliers)]
    return complex(known[np.argmax(np.abs(known))])


def special_table(points: Sequence[SpecialPoint]) -> Written:
    """The points as a table of the report."""
    header = (
        "figure",
        "period of the orbit",
        "point",
        "at",
        "largest multiplier",
        "with the contact, in the limit",
        "closed form",
        "distance",
    )
    rows, last = [], ("", 0)
    for one in points:
        unit, decimals = _UNITS[one.parameter]
        here = (one.figure, one.period)
        rows.append(
            (
                f"Fig. {int(one.figure[3:])}" if one.figure != last[0] else "",
                str(one.period) if here != last else "",
                "Neimark-Sacker" if one.kind == "neimark_sacker" else one.kind,
                f"{one.parameter} = {one.value:.{decimals}f} {unit}",
                _number(one.multiplier),
                "" if one.contact is None else _number(one.contact),
                "" if one.closed is None else f"{one.closed:.{decimals}f} {unit}",
                "" if one.closed is None else f"{abs(one.value - one.closed):.0e} {unit}",
            )
        )
        last = here
    return table(header, rows)


def _number(value: complex) -> str:
    if abs(value.imag) < 1e-9:
        return f"{value.real:+.6f}"
    return f"{value.real:.6f} + {abs(value.imag):.6f}i and its conjugate, modulus {abs(value):.6f}"


def ratios(points: Sequence[SpecialPoint]) -> Mapping[str, list[float]]:
    """Ratios of successive intervals between the flips of periods 1, 2, 4 and 8 in each cascade."""
    found = {}
    for figure in dict.fromkeys(one.figure for one in points):
        flips = [one for one in points if one.figure == figure and one.kind == "flip"]
        first: dict[int, float] = {}
        for one in flips:  # the first flip along each branch is where the cascade goes on
            first.setdefault(one.period, one.value)
        steps = np.diff([first[period] for period in (1, 2, 4, 8) if period in first])
        if len(steps) > 1:
            found[figure] = [float(ratio) for ratio in steps[:-1] / steps[1:]]
    return found
