"""``continue_curve``: follow a special point in two parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.begin import size_of
from nonsmooth.continuation.codimension_two import ENDED, root, sign_changes
from nonsmooth.continuation.codimension_two import numbers as numbers_of
from nonsmooth.continuation.files import special_row
from nonsmooth.continuation.locus import KINDS, Locus, Place
from nonsmooth.continuation.path import VIOLATIONS
from nonsmooth.continuation.physical import allowed_range
from nonsmooth.continuation.shooting import Shooting
from nonsmooth.errors import SolveError
from nonsmooth.flow.arguments import real_number, whole_number

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System

__all__ = ["ENDS", "continue_curve"]

FloatArray = NDArray[np.float64]
ENDS = {
    "range": "The curve reached the edge of the box.",
    "closed": "The curve came back to where it began.",
    "points": "The largest number of points was reached.",
    "no_convergence": "Newton's method did not converge, however small the step.",
    "grazing": "A contact begins or ends here: beyond this point the orbit has another signature.",
    "corner": "The orbit meets the corner of two boundaries: beyond this point it has another signature.",
    "resonance": "Both multipliers meet on the real axis: beyond this point they are real, and no torus is born.",
}
#: The point of codimension two at which a curve meets a graze (another one, for a grazing curve).
MEETS = {
    "fold": "grazing_fold", "flip": "grazing_flip", "neimark_sacker": "grazing_neimark_sacker",
    "grazing": "double_grazing",
}  # fmt: skip
FIRST, LEAST = 1e-3, 1e-8
COSINE = 0.97
BESIDE = 1e-6


@dataclass
class _March:
    places: list[Place] = field(default_factory=list)
    special: list[tuple[str, int]] = field(default_factory=list)
    ending: str = "points"


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
        ``double_grazing`` (a second touch), ``corner``.

    Raises
    ------
    ValueError, TypeError
        A kind that has no curve, parameters that do not exist, a special point outside the box.
    SolveError
        The curve could not be begun.
    """
    largest, most = real_number(step, "step"), whole_number(points, "points", 1)
    system, kind, own, point, period_number, _ = special_row(special_point, "continue_curve")
    if kind not in KINDS:
        raise ValueError(f"a {kind} has no curve here; possible: {', '.join(KINDS)}")
    names, box = _box(system, ranges)
    start = system.with_parameters({own: point.value})
    for name, (low, high) in zip(names, box, strict=True):
        if not low <= start.values[name] <= high:
            raise ValueError(f"the special point lies at {name} = {start.values[name]!r}, outside {low!r} ... {high!r}")
    shooting = Shooting(start, point.signature, period_number, names)
    size = size_of(point.maximum, point.minimum, system)
    if not shooting.forced and not shooting.m:
        from nonsmooth.continuation.anchor import free_anchor

        shooting.reference = free_anchor(
            shooting.flow, start.parameter_vector(), shooting.at_section, point.X[: shooting.n], size
        )
    X = np.concatenate([point.X[: shooting.size], [start.values[name] for name in names]])
    shooting.look_at_surfaces(X)
    widths = (box[0][1] - box[0][0], box[1][1] - box[1][0])
    locus = Locus(shooting, kind, size, point.period, widths)
    first = locus.first(X)
    if first is None:
        raise SolveError(f"the curve of the {kind} could not be begun at this point", status="no_convergence")
    allowed = tuple(allowed_range(start, name, *ends) for name, ends in zip(names, box, strict=True))
    ahead = _march(locus, first, allowed, largest, most, first)
    back = _March(ending="closed")
    if ahead.ending != "closed":
        back = _march(locus, replace(first, tangent=-first.tangent), allowed, largest, most, None)
    n = len(back.places)
    places = [*back.places[::-1], first, *ahead.places]
    special = [(name, n - 1 - i) for name, i in back.special[::-1]] + [(name, n + 1 + i) for name, i in ahead.special]
    return _dataset(system, locus, names, places, special, (back.ending, ahead.ending), {
        "ranges": {name: list(ends) for name, ends in zip(names, box, strict=True)}, "step": largest, "points": most,
        "kind": kind,
    })  # fmt: skip


def _box(system: System, ranges: Any) -> tuple[tuple[str, str], list[tuple[float, float]]]:
    if not isinstance(ranges, Mapping) or len(ranges) != 2:
        raise ValueError(
            f'ranges names two parameters with their ends, {{"omega": (3, 7), "rho": (0.1, 0.3)}}; not {ranges!r}'
        )
    box = []
    for name, ends in ranges.items():
        if name not in system.values:
            system.with_parameters({str(name): 0.0})  # raises with the names there are
        low, high = (real_number(x, f"an end of the range of {name}") for x in ends)
        if not low < high:
            raise ValueError(f"the range of {name}, {ends!r}: the first end must be below the second")
        box.append((low, high))
    first, second = ranges
    return (str(first), str(second)), box


def _violation(locus: Locus, place: Place) -> FloatArray:
    """How far the path is from leaving its signature; on a grazing curve by another touch than its own."""
    path = place.path
    if locus.kind == "grazing":
        inner = path.inner.copy()
        inner[locus._touched or path.touched] = -np.inf
        path = replace(path, touch=float(inner.max(initial=-np.inf)))
    return path.violation()


def _march(locus: Locus, place: Place, box: Any, largest: float, most: int, begin: Place | None) -> _March:
    found, ds = _March(), min(FIRST, largest)
    second, safe = numbers_of(locus, place), _violation(locus, place)
    while len(found.places) < most:
        new = locus.step(place, ds)
        if new is not None and ds > LEAST and float(new.tangent @ place.tangent) < COSINE:
            new = None
        if new is None:
            ds *= 0.5
            if ds < LEAST:
                found.ending = "no_convergence"
                break
            continue
        events: list[tuple[float, str, Place]] = []
        for i, (low, high) in enumerate(box):
            value = float(new.X[-2 + i])
            if not low <= value <= high:
                edge = low if value < low else high
                there = root(locus, place, new, _Edge(i, edge))
                if there is not None:
                    events.append((there[0], "range", there[1]))
        now = _violation(locus, new)
        for i, name in enumerate(VIOLATIONS):
            if now[i] < 0.0 <= safe[i]:
                there = root(locus, place, new, _Leaving(locus, i))
                if there is not None:
                    events.append((there[0], "corner" if name in ("own", "others", "landed") else "grazing", there[1]))
        outside = any(not low <= float(new.X[-2 + i]) <= high for i, (low, high) in enumerate(box))
        if not events and (outside or ((now < 0.0) & (safe >= 0.0)).any()):  # not located: nearer
            ds *= 0.25
            if ds < LEAST:
                found.ending = "no_convergence"
                break
            continue
        stop = min((s for s, _, _ in events), default=np.inf)
        after = numbers_of(locus, new)
        events += sign_changes(locus, place, new, second, after, stop - BESIDE)
        # A cusp: both parameters turn round together.
        if float(place.tangent[-2:] @ new.tangent[-2:]) < 0.0:
            there = root(locus, place, new, _Turning(place))
            if there is not None and there[0] < stop - BESIDE:
                events.append((there[0], "cusp" if locus.kind == "fold" else "turn", there[1]))
        ended = False
        for _, name, there_place in sorted(events, key=lambda event: event[0]):
            if name == "turn":
                continue
            found.places.append(there_place)
            ends = name if name in ENDS else "resonance" if locus.kind == "neimark_sacker" and name in ENDED else ""
            if name == "grazing":
                name = MEETS[locus.kind]
            if name != "range":
                found.special.append((name, len(found.places) - 1))
            if ends:
                found.ending, ended = ends, True
                break
        if ended:
            break
        found.places.append(new)
        if begin is not None and len(found.places) > 3 and _met(begin, place, new):
            found.ending = "closed"
            break
        ds = min(ds * (1.7 if new.iterations <= 4 else 1.0), largest)
        place, second, safe = new, after, now
        if locus.shooting.reference is not None:
            _anchor_anew(locus, place)
    return found


def _anchor_anew(locus: Locus, place: Place) -> None:
    """Put the phase condition of an orbit without transitions through the last point."""
    field_ = place.solved.legs.f_begin[0] / locus.size**2
    unit = max(float(np.abs(field_ * locus.size).max()), 1e-300)
    locus.shooting.reference = place.X[: locus.shooting.n].copy(), field_ / unit
    found = locus.place((place.solved, place.Y, place.tangent, 0), place.tangent)
    if found is not None:
        place.tangent = found.tangent


@dataclass
class _Edge:
    """A parameter's distance from the edge of its range."""

    which: int
    edge: float

    def __call__(self, place: Place) -> float:
        return float(place.X[-2 + self.which]) - self.edge


@dataclass
class _Leaving:
    """How far the path is from leaving its signature in one of the ways of ``VIOLATIONS``."""

    locus: Locus
    way: int

    def __call__(self, place: Place) -> float:
        return float(np.clip(_violation(self.locus, place)[self.way], -1e3, 1e3))


@dataclass
class _Turning:
    """How the parameters move, against how they did."""

    before: Place

    def __call__(self, place: Place) -> float:
        return float(place.tangent[-2:] @ self.before.tangent[-2:])


def _met(begin: Place, a: Place, b: Place) -> bool:
    step = b.Y - a.Y
    x = float(step @ (begin.Y - a.Y)) / float(step @ step)
    near = float(np.abs(begin.Y - a.Y - x * step).max())
    return 1e-9 < x <= 1.0 and near < 0.3 * float(np.abs(step).max())


def _dataset(
    system: System, locus: Locus, names: tuple[str, str], places: list[Place], special: list[tuple[str, int]],
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
    return curve(
        labels, attrs, {name: [float(place.X[-2 + i]) for place in places] for i, name in enumerate(names)}, arrays,
        special, kind=locus.kind, period_number=locus.shooting.period_number,
        signature=locus.shooting.signature.text(system.traced), endings=ENDS, ended=ended,
    )  # fmt: skip
