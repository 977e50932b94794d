"""Forces between bounds: the convex problem that tells them, and the sums in which they leave their bounds first.

A force between two bounds moves a sum along a segment, a contact that pushes along a ray, one that sticks within its
cone of friction along two. By how much a single one of several that hold the same rates pulls is not known, and not
asked.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.kernels import convex

DEPENDENT, INDEPENDENT = 1e-13, 1e-7  # what is left of a unit row when those before are taken away


def independent(rows: FloatArray, order: Iterable[int]) -> tuple[list[int], float]:
    """The places of those unit rows that, in an order, are no sums of those before; the part left of one of which that
    cannot be told, or 0."""
    chosen: list[int] = []
    doubt = 0.0
    for i in order:
        before = rows[chosen]
        off = rows[i] - before.T @ np.linalg.lstsq(before.T, rows[i], rcond=None)[0] if chosen else rows[i]
        length = float(np.linalg.norm(off))
        if length > INDEPENDENT:
            chosen.append(i)
        elif length > DEPENDENT:
            doubt = length
    return chosen, doubt


def linked(acts: NDArray[Any]) -> list[list[int]]:
    """The places apart by which acts on which, or is acted on, directly or through others."""
    near = (acts != 0) | (acts.T != 0)
    left, found = list(range(len(near))), []
    while left:
        some = [left.pop(0)]
        for i in some:
            some += [j for j in left if near[i, j]]
            left = [j for j in left if not near[i, j]]
        found.append(sorted(some))
    return found


def as_sums(ways: FloatArray, chosen: Sequence[int]) -> FloatArray:
    """The rows of ``ways`` as sums of those that are chosen, (all, chosen)."""
    sums = np.linalg.lstsq(ways[chosen].T, ways.T, rcond=None)[0].T
    return np.where(np.abs(sums) < INDEPENDENT * np.abs(sums).max(), 0.0, sums)


def weakest(
    sums: FloatArray, bounded: Collection[int], cones: Sequence[tuple[int, int, float]] = ()
) -> list[FloatArray]:
    """Weights (held,) of forces that hold together, one for each sum that is no more than their bounds give.

    ``sums`` (held, independent) are what each of them is of independent ones; ``bounded`` those that have bounds of
    their own; ``cones`` contacts that stick: the place of the normal force, of the tangential one, and the friction.
    The others push only: their weights are not positive."""
    edges: list[FloatArray] = []
    one_sided: list[bool] = []
    for j, row in enumerate(sums):
        own = [row + s * share * sums[t] for n, t, share in cones if n == j for s in (-1, 1)]
        if not own and all(t != j for _, t, _ in cones):
            own = [row]
        edges += own
        one_sided += [j not in bounded] * len(own)
    body, pushes = np.array(edges), np.array(one_sided)
    touched = body != 0
    found: list[FloatArray] = []
    for here in linked(touched.T @ touched):
        some = touched[:, here].any(axis=1)
        found += [sums[:, here] @ normal for normal in _faces(body[np.ix_(some, here)], pushes[some])]
    return found


def _faces(edges: FloatArray, one_sided: FloatArray) -> list[FloatArray]:
    """Normals of the faces of one body: each lies along all but one of its independent edges."""
    size = edges.shape[1]
    found: list[FloatArray] = []
    for some in combinations(range(len(edges)), size - 1):
        along = edges[list(some)]
        if size > 1 and np.linalg.matrix_rank(along.real, tol=1e-9) < size - 1:
            continue
        normal = np.ones(1, dtype=edges.dtype)
        if size > 1:
            m = int(np.abs(np.linalg.svd(along.real)[2][-1]).argmax())
            others = [i for i in range(size) if i != m]
            normal = np.ones(size, dtype=edges.dtype)
            normal[others] = np.linalg.solve(along[:, others], -along[:, m])
            normal = np.where(np.abs(normal) < 1e-12, 0.0, normal)
        for side in (normal, -normal):
            reach = (edges @ side).real
            if (reach[one_sided] > 1e-9).any() or any(np.allclose(side, other, atol=1e-9) for other in found):
                continue
            found.append(side)
    return found


def least(G: FloatArray, a: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Minimise 1/2 x' G x + a' x between bounds, for G not negative and symmetric by factors (:mod:`.convex`)."""
    size, scale = len(a), _symmetric(G)
    x, sets, factor = np.empty((2, size)), np.empty((2, size), dtype=np.int64), np.empty((size, size + 1))
    unit = max(1.0, np.abs(a).max(initial=0.0))  # high derivatives may be beyond what counts as endless there
    status = convex.least(G * scale, a / unit, low / scale / unit, high / scale / unit, x[0], *sets, factor, x[1])
    if status:
        raise SolveError(
            "the forces of contacts and frictions that decide together were not found: "
            + ("no set is the last" if status == 1 else "contacts close on what cannot give way")
        )
    return x[0] * scale * unit


def least_within(sums: FloatArray, total: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """The forces x of least norm between bounds with ``x @ sums == total``."""
    weight = 1e8 / np.square(sums).sum()
    x = least(np.eye(len(sums)) + weight * sums @ sums.T, -weight * sums @ total, low, high)
    near = 1e-6 * np.abs(x).max()
    bound = np.where(x <= low + near, low, np.where(x >= high - near, high, np.nan))
    free = np.isnan(bound)
    x = np.where(free, 0.0, bound)
    x[free] = np.linalg.pinv(sums[free].T) @ (total - x @ sums)
    return x


def is_symmetric(G: FloatArray) -> bool:
    """Return whether positive factors of its columns make G symmetric."""
    scaled = G * _symmetric(G)
    return bool((np.abs(scaled - scaled.T) <= 1e-12 * np.abs(scaled).max(initial=0.0)).all())


def _symmetric(G: FloatArray) -> FloatArray:
    """Positive factors s of the columns that make G symmetric; ones where there are none."""
    size = len(G)
    scale = np.zeros(size)
    for first in range(size):
        if scale[first]:
            continue
        scale[first], known = 1.0, [first]
        for i in known:
            for j in range(size):
                if not scale[j] and G[i, j] and G[i, j] * G[j, i] > 0:
                    scale[j] = G[j, i] * scale[i] / G[i, j]
                    known.append(j)
    return scale
