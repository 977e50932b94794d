"""``continue_curve``: follow a special point in two parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.continuation.branches.reading import special_row
from nonsmooth.continuation.march.begin import largest_step, limits, size_of
from nonsmooth.continuation.march.march import march
from nonsmooth.continuation.march.marches import Limits, Row, both_ways, in_turn, unless_interrupted
from nonsmooth.continuation.march.physical import allowed_range
from nonsmooth.continuation.problems.anchor import anchor_at
from nonsmooth.continuation.problems.locus import KINDS, Locus
from nonsmooth.continuation.problems.orbits import OrbitPoint
from nonsmooth.continuation.problems.shooting import Shooting
from nonsmooth.continuation.problems.surfaces import look_at_surfaces
from nonsmooth.errors import SolveError, shortened
from nonsmooth.flow.arguments import whole_number
from nonsmooth.system.names import by_name

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System

__all__ = ["continue_curve"]


@by_name
def continue_curve(
    special_point: Any, ranges: Mapping[str, tuple[float, float]], *, step: float = 0.05, points: int = 1000
) -> xr.Dataset:
    """Follow a fold, flip, Neimark-Sacker or grazing point in two parameters.

    Parameters
    ----------
    special_point : xarray.Dataset
        One row of :func:`nonsmooth.special_points`.
    ranges : mapping of two parameters to (low, high)
        The box in which the curve is followed, both ways.
    step : float
        The largest step, in units of the curve's own size (each range is 1).
    points : int
        The largest number of points each way.

    Returns
    -------
    xarray.Dataset
        Over ``point``: both parameters, ``section``, ``period``, ``floquet_multipliers``; the curve's ``kind``; over
        ``special`` the points of codimension two: ``special_kind`` and ``special_point``. Kinds: ``cusp``,
        ``fold_flip``, ``generalised_flip`` (its cubic coefficient vanishes), ``chenciner`` (that of the torus),
        ``resonance_1_1`` to ``resonance_1_4``, ``fold_neimark_sacker``, ``flip_neimark_sacker``; ``grazing_fold``,
        ``grazing_flip``, ``grazing_neimark_sacker`` where such a curve meets a grazing curve or Feigin's signs change,
        ``double_grazing`` (a second touch), ``corner``. Over ``end`` how the curve ends: ``ended`` and, in a sentence,
        ``ended_because``.

    Raises
    ------
    ValueError, TypeError
        A kind that has no curve, parameters that do not exist, a special point outside the box.
    SolveError
        The curve could not be begun.
    Interrupted
        Ctrl-C; what was found until then is its ``result``.
    """
    largest, most = largest_step(step), whole_number(points, "points", 1)
    system, kind, own, point, period_number, _ = special_row(special_point, "continue_curve")
    if kind not in KINDS:
        raise ValueError(f"a {kind} has no curve here; possible: {', '.join(KINDS)}")
    start = system.with_parameters({own: point.value})
    names, box = _box(start, ranges)
    shooting = Shooting(start, point.signature, period_number, names)
    size = size_of(point.maximum, point.minimum, system)
    anchor_at(shooting, start.parameter_vector(), point.X[: shooting.n], size)
    X = np.concatenate([point.X[: shooting.size], [start.values[name] for name in names]])
    look_at_surfaces(shooting, X)
    widths = (box[0][1] - box[0][0], box[1][1] - box[1][0])
    locus = Locus(shooting, kind, size, point.period, widths)
    first = locus.first(X)
    if first is None:
        raise SolveError(f"the curve of the {kind} could not be begun at this point", status="no_convergence")
    allowed = tuple((i - 2, *allowed_range(start, names[i], *ends)) for i, ends in enumerate(box))
    closed = locus.landmark(first)
    ahead, back = in_turn(
        lambda: march(locus, first, Limits(allowed, largest, most, closed)),
        lambda: march(locus, first.turned(), Limits(allowed, largest, most)),
    )
    rows, special = both_ways(back, Row(locus, first), ahead)
    places = [row.point for row in rows]
    return _dataset(system, locus, names, places, special, (back.ending, ahead.ending), {
        "ranges": {name: list(ends) for name, ends in zip(names, box, strict=True)}, "step": largest, "points": most,
        "kind": kind,
    })  # fmt: skip


def _box(system: System, ranges: Any) -> tuple[tuple[str, str], list[tuple[float, float]]]:
    """The two parameters and their ranges, which hold the system's own values."""
    if not isinstance(ranges, Mapping) or len(ranges) != 2:
        raise ValueError(
            'ranges names two parameters with their ends, {"omega": (3, 7), "rho": (0.1, 0.3)}; '
            f"not {shortened(ranges)}"
        )
    box = [
        limits(system, name, ends, system.values.get(name), word=f"the range of {name}", what="the special point")
        for name, ends in ranges.items()
    ]
    first, second = ranges
    return (str(first), str(second)), box


def _dataset(
    system: System, locus: Locus, names: tuple[str, str], places: list[OrbitPoint], special: list[tuple[str, int]],
    ended: tuple[str, str], options: dict[str, Any],
) -> xr.Dataset:  # fmt: skip
    from nonsmooth.results.branches import curve
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance

    n_u = len(system.states)
    labels = labels_of(system)
    arrays = {
        "section": np.array([place.X[:n_u] for place in places]),
        "maximum": np.array([place.path.maximum for place in places]),
        "minimum": np.array([place.path.minimum for place in places]),
        "period": np.array([place.solved.times[-1] for place in places]),
        "floquet_multipliers": np.array([place.multipliers for place in places]),
    }
    attrs = provenance(labels, "continue_curve", options, method="multiple shooting")
    found = curve(
        labels, attrs, {name: [float(place.X[-2 + i]) for place in places] for i, name in enumerate(names)}, arrays,
        special, kind=locus.kind, period_number=locus.shooting.period_number,
        signature=locus.shooting.signature.text(system.traced), endings=locus.endings, ended=ended,
    )  # fmt: skip
    return unless_interrupted(found, ended)
