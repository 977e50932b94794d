r"""``manifolds``: the stable and unstable manifolds of a saddle orbit in the stroboscopic section.

With P the section map over as many periods as the orbit has (twice as many where the multiplier is negative, so that
each side maps to itself), u* the orbit's point and e the eigenvector of the monodromy matrix with multiplier mu, a side
of the unstable manifold is the union of the images of one fundamental segment,

.. math::

    W = \bigcup_{k \ge 0} P^k(c_0), \quad c_0(s) = (1 - s)\, q + s\, P(q), \quad q = u^* \pm \delta e,
    \quad 0 \le s < 1 .

Each image is made as fine as asked for by new values of s, so every point is an image of a point of the segment and no
interpolated point is mapped. The segment is straight where the manifold is curved by :math:`O(\delta^2)`; that error
lies along the other directions, which shrink under the map. The stable manifold is grown in the same way by the inverse
of P (see :mod:`nonsmooth.continuation.section_map`).

References
----------
Z. You, E.J. Kostelich, J.A. Yorke, Int. J. Bifurcation and Chaos 1 (1991) 605-623 (images of a segment).
D. Hobson, J. Computational Physics 104 (1993) 14-22 (distance and angle of neighbours).
B. Krauskopf, H. Osinga, J. Computational Physics 146 (1998) 404-419.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.begin import size_of
from nonsmooth.continuation.orbit import EDGE, Orbit
from nonsmooth.continuation.section_map import SectionMap
from nonsmooth.flow.arguments import real_number, whole_number

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ENDS", "manifolds"]

FloatArray = NDArray[np.float64]
ENDS = {
    "length": "The length asked for was reached.",
    "closed": "The manifold ends: its images no longer grow (it runs into another orbit).",
    "points": "The largest number of points was reached.",
    "lost": "The next points have no image, or no preimage was found: the motion diverges, starts beyond a stop, or "
    "the section map cannot be inverted there.",
}
BEGIN = 9  # points of the first segment
FINEST = 1e-3  # of the distance: neighbours nearer than this are never parted
NARROW = 1e-12  # in s: a gap that remains is a jump of the section map
SHORT = 1e-3  # of the distance: segments shorter than this, and shrinking, add nothing
RETURN = 1e-6
MOST_LEVELS = 2000


@dataclass
class _Arc:
    """One side of the manifold of one point of the orbit, in scaled states."""

    points: list[FloatArray] = field(default_factory=list)
    iterate: list[NDArray[np.int64]] = field(default_factory=list)
    piece: list[NDArray[np.int64]] = field(default_factory=list)
    length: float = 0.0
    count: int = 0
    pieces: int = 0
    ending: str = "length"


def manifolds(
    orbit: Orbit,
    *,
    length: float = 10.0,
    kind: str = "both",
    distance: float = 0.02,
    angle: float = 0.2,
    delta: float = 1e-5,
    points: int = 20_000,
) -> xr.Dataset:
    """Grow the stable and unstable manifolds of a saddle orbit in the stroboscopic section.

    All lengths are measured in states divided by half their range over the orbit (at least 1e-3 of the state's scale).

    Parameters
    ----------
    orbit : Orbit
        A saddle of a forced system: one real multiplier beyond the unit circle for ``"unstable"``, one within it for
        ``"stable"``.
    length : float
        Arc length of each side.
    kind : {"both", "unstable", "stable"}
    distance : float
        The largest distance of neighbouring points.
    angle : float
        The largest turn at a point, in radians (points nearer to each other than ``1e-3 * distance`` apart).
    delta : float
        Distance of the first point from the orbit.
    points : int
        The largest number of points of each side.

    Returns
    -------
    xarray.Dataset
        Over ``point``, from the orbit outwards: ``section``, ``arc_length``, ``iterate`` (the image of the first
        segment it lies on), ``piece`` (it changes where the map jumps), ``arc_number``. Over ``arc``: ``manifold``
        (unstable, stable), ``side``, ``orbit_point`` (a period-n orbit has n points), ``multiplier``, ``ended``,
        ``ended_because``. ``orbit_section`` holds the orbit's own points, ``size`` what a scaled state of 1 is.

    Raises
    ------
    TypeError
        Something that is no orbit.
    ValueError
        An orbit without such a manifold (no saddle, complex multipliers, an autonomous or virtual orbit), or whose mode
        or memory at the section does not follow from the states.
    """
    if not isinstance(orbit, Orbit):
        raise TypeError(f"manifolds takes an Orbit, a result of find_orbit; not {type(orbit).__name__}")
    if kind not in ("both", "unstable", "stable"):
        raise ValueError(f'kind = {kind!r}; allowed: "both", "unstable", "stable"')
    reach, near, turn, first = (
        _positive(value, name)
        for value, name in ((length, "length"), (distance, "distance"), (angle, "angle"), (delta, "delta"))
    )
    most = whole_number(points, "points", 2 * BEGIN)
    size = _checked(orbit)
    wanted = ("unstable", "stable") if kind == "both" else (kind,)
    directions = {one: _direction(orbit, one, size) for one in wanted}
    once = SectionMap(orbit.system, size, 1)
    cycle = [orbit.u / size]
    for _ in range(orbit.period_number):
        cycle.append(once.forward(cycle[-1][None, :])[0])
    missed = float(np.abs(cycle.pop() - cycle[0]).max())
    if not missed <= RETURN:
        raise ValueError(
            f"the section map does not bring the orbit back (it misses by {missed:.1e} of its size): its mode at the "
            f"section, {orbit.mode!r}, does not follow from the states alone, so the section has no manifolds of points"
        )
    arcs: list[tuple[str, int, int, float, _Arc]] = []
    for one, (mu, e) in directions.items():
        section_map = SectionMap(orbit.system, size, orbit.period_number * (2 if mu < 0.0 else 1))
        step = section_map.forward if one == "unstable" else section_map.backward
        for side in (1, -1):
            q = cycle[0] + side * first * e
            for j, u in enumerate(cycle):
                if j:
                    q = once.forward(q[None, :])[0]
                    q = u + (q - u) * (first / np.linalg.norm(q - u))
                arcs.append((one, side, j, mu, _grow(step, u, q, reach, near, turn, most)))
    options = {"length": reach, "kind": kind, "distance": near, "angle": turn, "delta": first, "points": most}
    return _dataset(orbit, size, np.array(cycle), arcs, options)


def _positive(value: Any, name: str) -> float:
    number = real_number(value, name)
    if number <= 0.0:
        raise ValueError(f"{name} = {value!r} must be positive")
    return number


def _checked(orbit: Orbit) -> FloatArray:
    """The orbit's size, of one that manifolds can be grown from."""
    if not orbit.period_number:
        raise ValueError("an orbit without forcing has no stroboscopic section; manifolds needs a forced system")
    if orbit.virtual:
        raise ValueError("the orbit is virtual: its path goes through a boundary it should obey")
    if len(orbit.memory):
        names = ", ".join(orbit.system.memory)
        raise ValueError(
            f"{orbit.system.name!r} remembers {names}: a state at the section does not tell how the motion goes on"
        )
    return size_of(orbit.maximum, orbit.minimum, orbit.system)


def _direction(orbit: Orbit, kind: str, size: FloatArray) -> tuple[float, FloatArray]:
    """The one multiplier outside (inside) the unit circle and its eigenvector, in scaled states, of length 1."""
    M = orbit.monodromy_matrix * size[None, :] / size[:, None]
    mu, vectors = np.linalg.eig(M)
    modulus = np.abs(mu)
    chosen = np.flatnonzero(modulus > 1.0 + EDGE if kind == "unstable" else modulus < 1.0 - EDGE)
    where = "outside" if kind == "unstable" else "inside"
    numbers = ", ".join(f"{value:.6g}" for value in orbit.floquet_multipliers)
    if len(chosen) != 1 or abs(mu[chosen[0]].imag) > 0.0:
        raise ValueError(
            f"the orbit has no {kind} manifold that is a curve: {len(chosen)} multipliers lie {where} the unit circle "
            f"({numbers}); one real one is needed"
        )
    value = float(mu[chosen[0]].real)
    if kind == "stable" and abs(value) < 1e-12:
        raise ValueError(f"the section map cannot be inverted at the orbit (multipliers {numbers}); ask for 'unstable'")
    e = vectors[:, chosen[0]].real
    return value, e / np.linalg.norm(e) * (1.0 if e[np.abs(e).argmax()] > 0.0 else -1.0)


def _grow(
    step: Callable[[FloatArray, FloatArray], FloatArray], u: FloatArray, q: FloatArray, reach: float, near: float,
    turn: float, most: int,
) -> _Arc:  # fmt: skip
    """One side: images of the fundamental segment until the length is reached."""
    arc = _Arc()
    end = step(q[None, :], q[None, :])[0]
    if not np.isfinite(end).all():
        arc.ending = "lost"
        return arc
    s = np.linspace(0.0, 1.0, BEGIN)
    levels = [(1.0 - s)[:, None] * q + s[:, None] * end]
    arc.length = float(np.linalg.norm(q - u))
    last = np.inf
    for k in range(MOST_LEVELS):
        if k:
            guess = levels[-1] + (levels[-1][-1] - levels[-1][0])
            levels.append(step(levels[-1], guess))
        s, levels, whole = _refine(step, s, levels, reach - arc.length, near, turn, most - arc.count)
        if not whole:  # as far as it is fine
            fine = int(np.flatnonzero(_bad(levels[-1], s, reach - arc.length, near, turn))[0]) + 1
            _emit(arc, levels[-1][:fine], s[:fine], k, reach, near)
            arc.ending = "points"
            return arc
        here = _emit(arc, levels[-1], s, k, reach, near)
        if arc.ending != "length" or arc.length >= reach:
            return arc
        if here < SHORT * near and here < last and k > 0 and arc.length > 10 * np.linalg.norm(q - u):
            arc.ending = "closed"
            return arc
        last = here
        s, levels = _thin(s, levels, near, turn)
    arc.ending = "closed"
    return arc


def _bad(x: FloatArray, s: FloatArray, left: float, near: float, turn: float) -> NDArray[np.bool_]:
    """Which gaps between neighbours want another point; none beyond the length that is left."""
    chord = np.diff(x, axis=0)
    d = np.linalg.norm(chord, axis=1)
    wide: NDArray[np.bool_] = np.logical_not(d <= near)  # NaN is wide: the edge of what has an image
    lost: NDArray[np.bool_] = np.asarray(~np.isfinite(x).all(axis=1), dtype=np.bool_)
    wide[lost[:-1] & lost[1:]] = False
    with np.errstate(invalid="ignore", divide="ignore"):
        along = chord / d[:, None]
        cosine = np.clip((along[1:] * along[:-1]).sum(axis=1), -1.0, 1.0)
    sharp = np.arccos(cosine) > turn
    far = d > FINEST * near
    wide[:-1] |= sharp & far[:-1]
    wide[1:] |= sharp & far[1:]
    reached = np.concatenate([[0.0], np.cumsum(np.nan_to_num(d))])[:-1]
    return np.asarray(wide & (np.diff(s) > NARROW) & (reached <= left))


def _refine(
    step: Callable[[FloatArray, FloatArray], FloatArray], s: FloatArray, levels: list[FloatArray], left: float,
    near: float, turn: float, room: int,
) -> tuple[FloatArray, list[FloatArray], bool]:  # fmt: skip
    """New points on the first segment, mapped up to the last image, until that is as fine as asked for."""
    for _ in range(60):
        at = np.flatnonzero(_bad(levels[-1], s, left, near, turn))
        if not len(at):
            break
        if len(s) + len(at) > max(room, BEGIN) + BEGIN:
            return s, levels, False
        new = 0.5 * (s[at] + s[at + 1])
        q, end = levels[0][0], levels[0][-1]
        x = (1.0 - new)[:, None] * q + new[:, None] * end
        s = np.insert(s, at + 1, new)
        grown = [np.insert(levels[0], at + 1, x, axis=0)]
        for old in levels[1:]:
            between = 0.5 * (old[at] + old[at + 1])
            between = np.where(np.isfinite(between), between, np.where(np.isfinite(old[at]), old[at], old[at + 1]))
            x = step(x, between)
            grown.append(np.insert(old, at + 1, x, axis=0))
        levels = grown
    return s, levels, True


def _emit(arc: _Arc, x: FloatArray, s: FloatArray, k: int, reach: float, near: float) -> float:
    """Add an image to the arc, up to the length asked for or the first point that is lost; its length."""
    lost = np.flatnonzero(~np.isfinite(x).all(axis=1))
    if len(lost):
        x, arc.ending = x[: lost[0]], "lost"
    d = np.linalg.norm(np.diff(x, axis=0), axis=1)
    jump = (d > 4.0 * near) & (np.diff(s)[: len(d)] <= 4.0 * NARROW)
    d[jump] = 0.0
    run = arc.length + np.concatenate([[0.0], np.cumsum(d)])
    over = np.flatnonzero(run >= reach)
    last = int(over[0]) + 1 if len(over) else len(x)
    if len(over):
        arc.ending = "length"
    begin = 0 if not arc.points else 1  # the first point is the last of the image before
    pieces = arc.pieces + np.concatenate([[0], np.cumsum(jump)]).astype(np.int64)
    arc.points.append(x[begin:last])
    arc.iterate.append(np.full(max(last - begin, 0), k, dtype=np.int64))
    arc.piece.append(pieces[begin:last])
    arc.count += max(last - begin, 0)
    if last:
        arc.length, arc.pieces = float(run[last - 1]), int(pieces[last - 1])
    return float(d.sum())


def _thin(s: FloatArray, levels: list[FloatArray], near: float, turn: float) -> tuple[FloatArray, list[FloatArray]]:
    """Leave out every other point where the last image stays fine without it."""
    x = levels[-1]
    chord = np.diff(x, axis=0)
    d = np.linalg.norm(chord, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        along = chord / d[:, None]
        cosine = np.clip((along[1:] * along[:-1]).sum(axis=1), -1.0, 1.0)
    spare = np.zeros(len(s), dtype=bool)
    spare[1:-1] = (d[1:] + d[:-1] < 0.2 * near) & (np.arccos(cosine) < 0.2 * turn)
    spare[::2] = False
    if len(s) - int(spare.sum()) < BEGIN:
        return s, levels
    return s[~spare], [level[~spare] for level in levels]


def _dataset(
    orbit: Orbit, size: FloatArray, cycle: FloatArray, arcs: list[tuple[str, int, int, float, _Arc]],
    options: dict[str, Any],
) -> xr.Dataset:  # fmt: skip
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.manifolds import manifolds as build
    from nonsmooth.results.provenance import provenance

    n = len(size)
    labels = labels_of(orbit.system)
    sections, lengths, iterates, pieces, numbers = [], [], [], [], []
    for number, (_, _, j, _, arc) in enumerate(arcs):
        x = np.concatenate([np.empty((0, n)), *arc.points])
        piece = np.concatenate([np.empty(0, np.int64), *arc.piece])
        d = np.linalg.norm(np.diff(x, axis=0), axis=1)
        d[np.diff(piece) > 0] = 0.0
        begin = float(np.linalg.norm(x[0] - cycle[j])) if len(x) else 0.0
        sections.append(x * size)
        lengths.append(begin + np.concatenate([[0.0], np.cumsum(d)])[: len(x)])
        iterates.append(np.concatenate([np.empty(0, np.int64), *arc.iterate]))
        pieces.append(piece)
        numbers.append(np.full(len(x), number, dtype=np.int64))
    attrs = provenance(labels, "manifolds", options, method="images of a fundamental segment")
    return build(
        labels, attrs,
        {"section": np.concatenate(sections), "arc_length": np.concatenate(lengths),
         "iterate": np.concatenate(iterates), "piece": np.concatenate(pieces), "arc": np.concatenate(numbers)},
        kinds=[one for one, *_ in arcs], sides=[side for _, side, *_ in arcs],
        orbit_points=[j for _, _, j, _, _ in arcs], multipliers=[mu for _, _, _, mu, _ in arcs],
        orbit_section=cycle * size, scale=size, endings=ENDS, ended=[arc.ending for *_, arc in arcs],
    )  # fmt: skip
