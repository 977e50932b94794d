"""The line above the views: a motion in a few words and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.explorer.figures import MOST
from nonsmooth.explorer.labels import number, plain_of, symbols_of
from nonsmooth.plot.labels import in_words

if TYPE_CHECKING:
    from nonsmooth.explorer.state import State
    from nonsmooth.system.system import System

__all__ = ["distinct", "readout"]


def readout(
    system: System, state: State, results: Mapping[str, Any], stability: Mapping[str, Any]
) -> list[tuple[str, str]]:
    """Headings and texts: period number, section points, contacts, extremes, and the largest multiplier or exponent."""
    judged = results["judged"]
    period = int(judged["period_number"].values[0])
    status = str(np.ravel(in_words(judged["status"]))[0])
    fields = [("motion", f"period {period}" if period else "no period found")]
    if status not in ("ok", "not_periodic"):
        fields.append(("status", status.replace("_", " ")))
    section = results.get("section")
    if section is not None:
        n = int(distinct(section["section"].values).sum())
        fields.append(("section points", str(n) if n <= MOST else f"{section.sizes['iterate']}, no two alike"))
    contacts = float(judged["contacts_per_period"].values[0])
    if np.isfinite(contacts):
        fields.append(("contacts per period", f"{contacts:.3g}"))
    ends = [float(judged[name].sel(state=state.x).values[0]) for name in ("minimum", "maximum")]
    if np.isfinite(ends).all():
        unit = system.states[state.x]
        fields.append((plain_of(symbols_of(system)[state.x]), f"{number(ends[0], unit)} … {number(ends[1], unit)}"))
    if "multipliers" in stability:
        fields.append(("largest |multiplier|", f"{float(np.abs(stability['multipliers']).max()):.4f}"))
    elif stability:
        names = "exponents", "standard_error"
        largest, error = (float(stability["exponents"][name].values.max()) for name in names)
        fields.append(("largest exponent", f"{number(largest)} ± {error:.1g}"))
    return fields


def distinct(points: Any) -> Any:
    """Marks of the points among the last 256 that differ from those before them by 1e-5 of their size or more."""
    last = points[-256:]
    close = 1e-5 * np.maximum(np.ptp(last, axis=0), np.abs(last).max(axis=0))
    apart = np.ones(len(last), dtype=bool)
    for k in range(1, len(last)):
        apart[k] = not (np.abs(last[:k][apart[:k]] - last[k]) <= close).all(axis=1).any()
    return apart
