"""The sums in which forces that hold together leave their bounds first: the faces of the body of all that they give.

A force between two bounds moves a sum along a segment, a contact that pushes along a ray, one that sticks within its
cone of friction along two. By how much a single one of several that hold the same rates pulls is not known, and not
asked.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from itertools import combinations

import numpy as np

from nonsmooth.arrays import FloatArray

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
    from scipy.sparse.csgraph import connected_components

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
    number, labels = connected_components(touched.T.astype(int) @ touched.astype(int), directed=False)
    found: list[FloatArray] = []
    for here in (labels == g for g in range(number)):
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
