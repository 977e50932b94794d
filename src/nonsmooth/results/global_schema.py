"""Builders of the results that span a plane: charts over two parameters, basins over two states.

::

    chart(d, attrs, {"omega": (A,), "rho": (B,)}, arrays, starts=(S, n), one_start=True)
        # arrays: leading dims (A, B), or (A, B, S) where several starts were given; maximum and minimum end in (n,).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.results.labels import Labels
from nonsmooth.results.schema import _attributes, _floats, _parameter_coords, _start_coords, _state_coords
from nonsmooth.results.statuses import status_attributes

__all__ = ["chart"]

_LONG_NAMES = {
    "period_number": "period number (0: none found)",
    "crossings_per_period": "transitions per return",
    "contacts_per_period": "entries into contact per return",
    "maximum": "largest value on the attractor",
    "minimum": "smallest value on the attractor",
    "n_attractors": "number of attractors that the starts reached",
    "confidence": "probability that the label is right",
    "computed": "1 where the point was computed, 0 where its label was inferred",
}


def chart(
    labels: Labels,
    attrs: Mapping[str, str],
    grid: Mapping[str, ArrayLike],
    arrays: Mapping[str, Any],
    *,
    starts: ArrayLike,
    one_start: bool,
) -> xr.Dataset:
    """The result of ``chart``: everything known per point of the plane of two parameters."""
    plane = tuple(grid)
    each = plane if one_start else (*plane, "start")
    variables: dict[str, Any] = {}
    for name, array in arrays.items():
        dims: tuple[str, ...] = each
        if name in ("maximum", "minimum"):
            dims = (*each, "state")
        elif name in ("n_attractors", "confidence", "computed"):
            dims = plane
        if name == "status":
            attributes: dict[str, Any] = status_attributes()
        elif name.startswith("lyapunov"):
            words = "standard error of the largest" if name.endswith("error") else "largest"
            attributes = {"long_name": f"{words} Lyapunov exponent", "units": f"1/{labels.time_unit}"}
        else:
            attributes = {"long_name": _LONG_NAMES[name]}
        variables[name] = (dims, array, attributes)
    coords: dict[str, Any] = _parameter_coords(labels)
    for name, values in grid.items():
        coords[name] = (name, _floats(values), _attributes(name, labels.parameters[name]))
    coords |= _state_coords(labels)
    result = xr.Dataset(variables, coords | _start_coords(starts), dict(attrs))
    return result.squeeze("start") if one_start else result
