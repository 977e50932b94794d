"""``continue_curve``: follow a special point in two parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from nonsmooth.continuation.arguments import LargestStep, allowed_range, limits
from nonsmooth.continuation.branches.following import both_ways, dataset
from nonsmooth.continuation.branches.reading import special_row
from nonsmooth.continuation.branches.records import record_of
from nonsmooth.continuation.events.codimension_two import KINDS, AlongCurve
from nonsmooth.continuation.march.march import Limits, MarkedPoint
from nonsmooth.continuation.problems.locus import Locus
from nonsmooth.errors import SolveError, shortened
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Range, at_least
from nonsmooth.system.system import System

if TYPE_CHECKING:
    import xarray as xr


@checked
def continue_curve(
    special_point: Any,
    ranges: Mapping[str, Range],
    *,
    step: LargestStep = 0.05,
    points: Annotated[int, at_least(1)] = 1000,
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
    from nonsmooth.results.branches import CURVE, SPECIAL
    from nonsmooth.results.labels import labels_of

    system, kind, own, point, period_number, _ = special_row(special_point, "continue_curve")
    if kind not in KINDS:
        raise ValueError(f"a {kind} has no curve here; possible: {', '.join(KINDS)}")
    start = system.with_parameters({own: point.value})
    names, box = _box(start, ranges)
    first = Locus.through(start, kind, point, period_number, names, np.ptp(box, axis=1).tolist())
    if first is None:
        raise SolveError(f"the curve of the {kind} could not be begun at this point", status="no_convergence")
    allowed = tuple((i - 2, *allowed_range(start, names[i], *ends)) for i, ends in enumerate(box))
    policy = AlongCurve(kind, first.shooting.forced)
    within = Limits(allowed, step, points, first.curve.landmark(first))
    record = both_ways(policy, within, first.turned(), [record_of(MarkedPoint(first))], first)
    options = {
        "ranges": {name: list(ends) for name, ends in zip(names, box, strict=True)},
        "step": step,
        "points": points,
        "kind": kind,
    }
    more = {
        "kind": ((), kind, {"long_name": "kind of the special point that is followed"}),
        "period_number": ((), np.int64(period_number), {"long_name": f"{labels_of(system).turn}s (0: autonomous)"}),
        "signature": ((), point.signature.text(system.traced), {"long_name": "signature"}),
    }
    values = {name: [float(one.X[i - 2]) for one in record.points] for i, name in enumerate(names)}
    return dataset(system, "continue_curve", values, (CURVE, SPECIAL), record, policy, options, more, {})


def _box(system: System, ranges: Mapping[str, Range]) -> tuple[tuple[str, str], list[Range]]:
    """The two parameters and their ranges, which hold the system's own values."""
    if len(ranges) != 2:
        raise ValueError(
            'ranges names two parameters with their ends, {"omega": (3, 7), "rho": (0.1, 0.3)}; '
            f"not {shortened(ranges)}"
        )
    box = [
        limits(system, name, ends, system.values.get(name), what="the special point") for name, ends in ranges.items()
    ]
    first, second = ranges
    return (str(first), str(second)), box
