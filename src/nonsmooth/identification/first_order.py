"""Special points of a branch to first order in uncertain parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.identification.compare.draws import Setting
from nonsmooth.identification.gathered import matched

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System

__all__ = ["to_first_order"]

DIFFERENCE = 0.1  # of a standard uncertainty, to either side


def _sources(found: Any, settings: Mapping[str, Setting], system: System) -> tuple[list[tuple[str, float]], FloatArray]:
    """Uncertain parameters with their standard uncertainties, and their covariance."""
    covariance = getattr(found, "covariance", None)
    names = [] if covariance is None else [str(n) for n in covariance[covariance.dims[0]].values]
    held = [i for i, n in enumerate(names) if n in found and n in system.values and n not in settings]
    joint = np.zeros((0, 0)) if covariance is None else np.asarray(covariance.values, float)[np.ix_(held, held)]
    own = [(n, one.uncertainty) for n, one in settings.items() if one.uncertainty > 0 and not one.follows]
    matrix = np.zeros((len(held) + len(own), len(held) + len(own)))
    matrix[: len(held), : len(held)] = joint
    matrix[range(len(held), len(matrix)), range(len(held), len(matrix))] = [error**2 for _, error in own]
    return [(names[i], float(np.sqrt(joint[k, k]))) for k, i in enumerate(held)] + own, matrix


def to_first_order(
    branch: xr.Dataset, found: Any, settings: Mapping[str, Setting], system: System, call: Callable[..., Any]
) -> dict[str, Any]:
    """Derivatives of special points in the uncertain parameters, and their standard uncertainties."""
    from nonsmooth.continuation.special import special_points

    if "special_point" not in branch:
        raise ValueError("first_order concerns the special points of a branch: give continue_orbit as the verb")
    if any(one.follows for one in settings.values()):
        raise ValueError("first_order takes settings with values: one that is a function is left to the draws")
    sources, covariance = _sources(found, settings, system)
    some = [i for i, (_, error) in enumerate(sources) if error > 0]
    sources, covariance = [sources[i] for i in some], covariance[np.ix_(some, some)]
    own = str(branch.attrs["parameter"])
    table = special_points(branch)
    slope = np.array([
        [0.0 if name == own else _slope(table.isel(special=i), name) for name, _ in sources]
        for i in range(table.sizes["special"])
    ]).reshape(table.sizes["special"], len(sources))  # fmt: skip
    for i, (name, error) in enumerate(sources):
        if (lost := np.isnan(slope[:, i])).any():  # of equilibria: by differences of whole branches
            value, h = system.values[name], DIFFERENCE * error
            ends = [call(system.with_parameters({name: value + sign * h}), coarse=True) for sign in (1, -1)]
            ahead, behind = (matched(branch, one, "special") for one in ends)
            slope[lost, i] = ((ahead - behind) / (2 * h))[lost]
    variance = np.einsum("si,ij,sj->s", slope, covariance, slope)
    unit = system.parameters[own].unit or "1"
    return {
        "source": ("source", [name for name, _ in sources]),
        "special_slope": (("special", "source"), slope, {"long_name": f"derivative of {own} at a special point"}),
        "special_first_order": ("special", np.sqrt(variance), {
            "long_name": f"standard uncertainty of {own} to first order", "units": unit}),
    }  # fmt: skip


def _slope(row: xr.Dataset, name: str) -> float:
    """Derivative of a special point in another parameter: the tangent of its curve in both; NaN where it has none."""
    from nonsmooth.continuation.branches.reading import special_row
    from nonsmooth.continuation.events.codimension_two import KINDS
    from nonsmooth.continuation.problems.locus import Locus
    from nonsmooth.continuation.problems.orbits import size_of
    from nonsmooth.continuation.problems.shooting import Shooting

    if "unknowns" not in row or str(row["kind"].values) not in KINDS:
        return np.nan
    system, kind, own, point, period_number, span = special_row(row, "propagate")
    system = system.with_parameters({own: point.value})
    shooting = Shooting(system, point.signature, period_number, (name, own))
    size = size_of(point.maximum, point.minimum, system)
    X = np.concatenate([point.X[: shooting.size], [system.values[name], point.value]])
    shooting.prepare(X, size)
    widths = (abs(system.values[name]) or 1.0, abs(span[1] - span[0]))
    locus = Locus(shooting, kind, size, point.period, widths)
    first = locus.first(X)
    if first is None or first.tangent[-2] == 0.0:
        return np.nan
    return float(first.tangent[-1] * locus.scale[-1] / (first.tangent[-2] * locus.scale[-2]))
