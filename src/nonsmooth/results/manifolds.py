"""Builder of the labelled result of ``manifolds``: curves in the section, one after the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.results.labels import Labels
from nonsmooth.results.provenance import with_short_record
from nonsmooth.results.schema import columns, parameter_coords, state_coords, table
from nonsmooth.results.statuses import flag_attributes

__all__ = ["KINDS", "manifolds"]

KINDS = ("unstable", "stable")
_POINT = table(
    ("section", "point state", "own", "state at the section"),
    ("arc_length", "point", "own", "length from the orbit, in scaled states"),
    ("iterate", "point", "own", "which image of the first segment"),
    ("piece", "point", "own", "number of jumps of the section map before it"),
    ("arc", "point", "own", "which arc"),
    ("side", "arc", "yes", "side of the orbit"),
    ("orbit_point", "arc", "place", "point of the orbit"),
    ("multiplier", "arc", "", "multiplier once round"),
    ("orbit_section", "return state", "", "points of the orbit"),
    ("size", "state", "", "what a scaled state of 1 is"),
    ("ended_because", "arc", "text", "sentence"),
)


def manifolds(
    labels: Labels, attrs: Mapping[str, Any], arrays: Mapping[str, ArrayLike], *, kinds: Sequence[str],
    sides: ArrayLike, orbit_points: ArrayLike, multipliers: ArrayLike, orbit_section: ArrayLike, scale: ArrayLike,
    endings: Mapping[str, str], ended: Sequence[str],
) -> xr.Dataset:  # fmt: skip
    """The result of ``manifolds``: points over ``point`` in order along each arc, what they are over ``arc``."""
    variables = columns(labels, _POINT, {
        **arrays, "side": sides, "orbit_point": orbit_points, "multiplier": multipliers,
        "orbit_section": orbit_section, "size": scale, "ended_because": [endings[word] for word in ended],
    })  # fmt: skip
    # The dim's own name would make an index of it.
    variables["arc_number"] = variables.pop("arc")
    for name, words, known, chosen in (
        ("manifold", "manifold", KINDS, kinds), ("ended", "how the arc ends", tuple(endings), ended),
    ):  # fmt: skip
        codes = np.array([known.index(word) for word in chosen], dtype=np.int8)
        variables[name] = ("arc", codes, {"long_name": words, **flag_attributes(known)})
    coords = state_coords(labels) | parameter_coords(labels)
    return with_short_record(xr.Dataset(variables, coords, dict(attrs)))
