"""Builder of the labelled result of ``manifolds``: curves in the section, one after the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.results.labels import Labels
from nonsmooth.results.provenance import with_short_record
from nonsmooth.results.schema import parameter_coords, state_coords
from nonsmooth.results.statuses import flag_attributes

__all__ = ["KINDS", "manifolds"]

KINDS = ("unstable", "stable")
_POINT = {
    "section": "state at the section",
    "arc_length": "length from the orbit, in scaled states",
    "iterate": "which image of the first segment",
    "piece": "number of jumps of the section map before it",
    "arc": "which arc",
}


def manifolds(
    labels: Labels,
    attrs: Mapping[str, Any],
    arrays: Mapping[str, ArrayLike],
    *,
    kinds: Sequence[str],
    sides: ArrayLike,
    orbit_points: ArrayLike,
    multipliers: ArrayLike,
    orbit_section: ArrayLike,
    scale: ArrayLike,
    endings: Mapping[str, str],
    ended: Sequence[str],
) -> xr.Dataset:
    """The result of ``manifolds``: points over ``point`` in order along each arc, what they are over ``arc``."""
    variables: dict[str, Any] = {
        name: (("point", "state") if name == "section" else "point", np.asarray(array), {"long_name": _POINT[name]})
        for name, array in arrays.items()
    }
    # The dim's own name would make an index of it.
    variables["arc_number"] = variables.pop("arc")
    codes = np.array([KINDS.index(kind) for kind in kinds], dtype=np.int8)
    variables["manifold"] = ("arc", codes, {"long_name": "manifold", **flag_attributes(KINDS)})
    variables["side"] = ("arc", np.asarray(sides, np.int8), {"long_name": "side of the orbit"})
    variables["orbit_point"] = ("arc", np.asarray(orbit_points, np.int64), {"long_name": "point of the orbit"})
    variables["multiplier"] = ("arc", np.asarray(multipliers, float), {"long_name": "multiplier once round"})
    outcome = np.array([list(endings).index(word) for word in ended], dtype=np.int8)
    variables["ended"] = ("arc", outcome, {"long_name": "how the arc ends", **flag_attributes(list(endings))})
    sentences = np.array([endings[word] for word in ended], dtype=str)
    variables["ended_because"] = ("arc", sentences, {"long_name": "sentence"})
    variables["orbit_section"] = (
        ("return", "state"), np.asarray(orbit_section, float), {"long_name": "points of the orbit"},
    )  # fmt: skip
    variables["size"] = ("state", np.asarray(scale, float), {"long_name": "what a scaled state of 1 is"})
    coords = state_coords(labels) | parameter_coords(labels)
    return with_short_record(xr.Dataset(variables, coords, dict(attrs)))
