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
of P (see :mod:`nonsmooth.continuation.manifolds.section_map`). At another phase of the section they are the images of
both under the flow from phase 0.

References
----------
Z. You, E.J. Kostelich, J.A. Yorke, Int. J. Bifurcation and Chaos 1 (1991) 605-623 (images of a segment).
D. Hobson, J. Computational Physics 104 (1993) 14-22 (distance and angle of neighbours).
B. Krauskopf, H. Osinga, J. Computational Physics 146 (1998) 404-419.
"""

from __future__ import annotations

from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.branches.orbit import Orbit
from nonsmooth.continuation.manifolds.arcs import BEGIN, Arc
from nonsmooth.continuation.manifolds.section_map import SectionMap
from nonsmooth.continuation.problems.multipliers import EDGE
from nonsmooth.continuation.problems.orbits import size_of
from nonsmooth.flow.sections import Stroboscopic
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import above, at_least

if TYPE_CHECKING:
    import xarray as xr

ENDS = {
    "length": "The length asked for was reached.",
    "closed": "The manifold ends: its images no longer grow (it runs into another orbit).",
    "points": "The largest number of points was reached.",
    "images": "Two thousand images of the first segment are shorter than the length asked for: it grows too slowly.",
    "lost": "The next points have no image, or no preimage was found: the motion diverges, starts beyond a stop, or "
    "the section map cannot be inverted there.",
}
RETURN = 1e-6


@checked
def manifolds(
    orbit: Orbit,
    *,
    section: Stroboscopic | None = None,
    length: Annotated[float, above(0)] = 10.0,
    kind: Literal["both", "unstable", "stable"] = "both",
    distance: Annotated[float, above(0)] = 0.02,
    angle: Annotated[float, above(0)] = 0.2,
    delta: Annotated[float, above(0)] = 1e-5,
    points: Annotated[int, at_least(2 * BEGIN)] = 20_000,
) -> xr.Dataset:
    """Grow the stable and unstable manifolds of a saddle orbit in the stroboscopic section.

    All lengths are measured in states divided by half their range over the orbit (at least 1e-3 of the state's scale).

    Parameters
    ----------
    orbit : Orbit
        A saddle of a forced system: one real multiplier beyond the unit circle for ``"unstable"``, one within it for
        ``"stable"``.
    section : Stroboscopic, optional
        The phase at which the manifolds are looked at; 0 where not given.
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
    phase = 0.0 if section is None else float(section.phase)
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
    view = partial(once.at_phase, phase=phase)
    arcs: list[tuple[str, int, int, float, Arc]] = []
    for one, (mu, e) in directions.items():
        section_map = SectionMap(orbit.system, size, orbit.period_number * (2 if mu < 0.0 else 1))
        step = section_map.forward if one == "unstable" else section_map.backward
        for side in (1, -1):
            q = cycle[0] + side * delta * e
            for j, u in enumerate(cycle):
                if j:
                    q = once.forward(q[None, :])[0]
                    q = u + (q - u) * (delta / np.linalg.norm(q - u))
                arcs.append((one, side, j, mu, Arc(step, view, length, distance, angle, points).grow(u, q)))
    options = {
        "length": length,
        "kind": kind,
        "distance": distance,
        "angle": angle,
        "delta": delta,
        "points": points,
        "section": f"Stroboscopic(phase={phase!r})",
    }
    return _dataset(orbit, size, view(np.array(cycle)), arcs, options)


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


def _dataset(
    orbit: Orbit,
    size: FloatArray,
    cycle: FloatArray,
    arcs: list[tuple[str, int, int, float, Arc]],
    options: dict[str, Any],
) -> xr.Dataset:
    from nonsmooth.results.branches import manifolds as build
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance

    labels, none = labels_of(orbit.system), np.empty(0)
    of_arcs = [[(np.empty((0, len(size))), none, none.astype(int), none.astype(int)), *arc.parts] for *_, arc in arcs]
    x, lengths, iterates, pieces = (np.concatenate(one) for one in zip(*chain(*of_arcs), strict=True))
    numbers = np.repeat(np.arange(len(arcs)), [sum(len(part[0]) for part in parts) for parts in of_arcs])
    attrs = provenance(labels, "manifolds", options, method="images of a fundamental segment")
    return build(
        labels,
        attrs,
        {
            "section": x * size,
            "arc_length": lengths,
            "iterate": iterates,
            "piece": pieces,
            "arc": numbers,
            "side": [side for _, side, *_ in arcs],
            "orbit_point": [j for _, _, j, _, _ in arcs],
            "multiplier": [mu for _, _, _, mu, _ in arcs],
            "orbit_section": cycle * size,
            "size": size,
        },
        kinds=[one for one, *_ in arcs],
        endings=ENDS,
        ended=[arc.ending for *_, arc in arcs],
    )
