r"""Distance of two clouds of points, and how large it is when both come from the same motion.

The energy distance of Székely and Rizzo (J. Stat. Plan. Inference 143 (2013) 1249-1272, Eq. 2.1) of the laws of
X and Y,

.. math:: E^2 = 2\,\mathrm E|X - Y| - \mathrm E|X - X'| - \mathrm E|Y - Y'|,

is zero only where the laws are equal, in any number of dimensions; SciPy has it in one. A finite cloud is at a distance
from the law it came from, so a distance says something only beside those of the cloud's own halves. The halves are
made of whole blocks of successive points: points of a motion that follow each other are alike, and halves of
single points would be closer than two records are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nonsmooth.arrays import BoolArray, FloatArray

FEWEST_BLOCKS = 20
LIKENESS = 0.1  # successive points are taken as unrelated where their mean distance is within 10 % of that of any two
MOST = 3000  # points of one cloud, the last ones: the matrix of distances grows like the square
ASSIGNED = 500  # points of each cloud in the assignment that gives the Wasserstein distance


@dataclass(frozen=True)
class CloudDistance:
    """Energy distances (the root E, in units of ``scale``) and what the clouds' own halves give.

    Attributes
    ----------
    distance : float
        Of the whole clouds.
    matched : float
        Median over random parts of both clouds, each of as many points as half the first cloud: this one can be
        laid beside ``halves``, because the distance of finite clouds falls with their size.
    halves : array (splits,)
        Distances of random halves of the first cloud.
    other_halves : array (splits,)
        The same for the second cloud, in parts of the same size.
    block : int
        Successive points that stay together.
    points : int
        Points in each half.
    """

    distance: float
    matched: float
    halves: FloatArray
    other_halves: FloatArray
    block: int
    points: int

    @property
    def ratio(self) -> float:
        """``matched`` over the 95th percentile of ``halves``."""
        return float(self.matched / np.quantile(self.halves, 0.95))


def energy_distance(a: ArrayLike, b: ArrayLike) -> float:
    r"""Energy distance :math:`E = \sqrt{2 E|X-Y| - E|X-X'| - E|Y-Y'|}` of two clouds, each (points, states).

    In one dimension it equals ``scipy.stats.energy_distance``. The clouds must be in one common unit.
    """
    from scipy.spatial.distance import cdist

    x, y = _two_clouds(a, b)
    return float(_root(2 * cdist(x, y).mean() - cdist(x, x).mean() - cdist(y, y).mean()))


def wasserstein(a: ArrayLike, b: ArrayLike, seed: int = 0) -> float:
    """Wasserstein distance (order 1) of two clouds: the least mean distance in moving one onto the other.

    For equal numbers of points this is SciPy's linear assignment, exactly; seeded parts of at most 500 points are
    taken.
    """
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial.distance import cdist

    x, y = _two_clouds(a, b)
    size = min(len(x), len(y), ASSIGNED)
    rng = np.random.default_rng(seed)
    x, y = (cloud if len(cloud) == size else rng.choice(cloud, size, replace=False) for cloud in (x, y))
    cost = cdist(x, y)
    return float(cost[linear_sum_assignment(cost)].mean())


def block_length(points: ArrayLike) -> int:
    """Successive points that are still alike: the lag beyond which their mean distance is that of any two points.

    At most a twentieth of the points, so that random halves of blocks can be drawn.
    """
    from scipy.spatial.distance import pdist

    cloud = _cloud(points, "points")
    n = len(cloud)
    longest = max(1, n // FEWEST_BLOCKS)
    overall = pdist(cloud[:: max(1, n // 1000)]).mean()
    if overall == 0:
        return 1
    near = max(LIKENESS, 3 / np.sqrt(n))
    last = 0
    for lag in range(1, longest):
        mean = np.linalg.norm(cloud[lag:] - cloud[:-lag], axis=1).mean()
        if abs(mean / overall - 1) > near:
            last = lag
    return min(last + 1, longest)


def cloud_distance(
    a: ArrayLike, b: ArrayLike, *, splits: int = 400, seed: int = 0, block: int | None = None
) -> CloudDistance:
    """Energy distance of two clouds beside those of their own random halves.

    Parameters
    ----------
    a, b : array (points, states)
        Successive section points, in the order in which they came, in one common unit.
    splits : int
        Random halves drawn.
    seed : int
        Of ``numpy.random.default_rng``.
    block : int, optional
        Points that stay together; :func:`block_length` of ``a`` where not given.

    Raises
    ------
    ValueError
        Fewer than 40 points in a cloud: halves of it say nothing.
    """
    from scipy.spatial.distance import cdist

    x, y = _two_clouds(a, b)
    for name, cloud in (("first", x), ("second", y)):
        if len(cloud) < 2 * FEWEST_BLOCKS:
            raise ValueError(
                f"the {name} cloud has {len(cloud)} points; its halves are compared, which takes at least "
                f"{2 * FEWEST_BLOCKS}: record longer"
            )
    x, y = x[-MOST:], y[-MOST:]  # thinning would separate successive points
    length = block_length(x) if block is None else block
    rng = np.random.default_rng(seed)
    xx, yy, xy = cdist(x, x), cdist(y, y), cdist(x, y)
    pairs = [_halves(len(x), length, rng) for _ in range(splits)]
    size = int(pairs[0][0].sum())
    others = [_parts(len(y), length, size, rng) for _ in range(splits)]
    (left, right), (first, second) = (np.array(rows, dtype=float).transpose(1, 2, 0) for rows in (pairs, others))
    to_left, to_right, to_first, to_second = xx @ left, xx @ right, yy @ first, yy @ second
    within, beyond = _mean(left, to_left, left), _mean(first, to_first, first)
    halves = _root(2 * _mean(left, to_right, right) - within - _mean(right, to_right, right))
    other_halves = _root(2 * _mean(first, to_second, second) - beyond - _mean(second, to_second, second))
    matched = float(np.median(_root(2 * _mean(left, xy @ first, first) - within - beyond)))
    whole = float(_root(2 * xy.mean() - xx.mean() - yy.mean()))
    return CloudDistance(whole, matched, halves, other_halves, length, size)


def _mean(part: FloatArray, product: FloatArray, other: FloatArray) -> FloatArray:
    """Mean distance between two parts, for many pairs at once: columns say which points are in, ``product`` is the
    matrix of distances times ``other``."""
    return np.asarray(np.einsum("ij,ij->j", part, product) / (part.sum(axis=0) * other.sum(axis=0)))


def _halves(n: int, block: int, rng: np.random.Generator) -> tuple[BoolArray, BoolArray]:
    """Two random halves of n points, in blocks; what does not fill a pair of blocks is left out at a random end."""
    count = n // (2 * block)
    first = int(rng.integers(0, n - 2 * count * block + 1))
    owner = np.repeat(rng.permutation(np.arange(2 * count) % 2), block)
    halves = np.zeros((2, n), dtype=bool)
    halves[owner, np.arange(first, first + len(owner))] = True
    return halves[0], halves[1]


def _parts(n: int, block: int, size: int, rng: np.random.Generator) -> tuple[BoolArray, BoolArray]:
    """Two random parts of n points, apart from each other, each of ``size`` points or half of all."""
    one, two = _halves(n, block, rng)
    for part in (one, two):
        blocks = np.flatnonzero(part).reshape(-1, block)
        surplus = len(blocks) - max(1, size // block)
        if surplus > 0:
            part[rng.choice(blocks, surplus, replace=False).ravel()] = False
    return one, two


def _cloud(points: ArrayLike, name: str) -> FloatArray:
    cloud = np.asarray(points, dtype=float)
    cloud = cloud[:, None] if cloud.ndim == 1 else cloud
    if cloud.ndim != 2 or not len(cloud) or not np.isfinite(cloud).all():
        raise ValueError(f"{name} must be a cloud (points, states) of finite numbers, got shape {cloud.shape}")
    return cloud


def _two_clouds(a: ArrayLike, b: ArrayLike) -> tuple[FloatArray, FloatArray]:
    x, y = _cloud(a, "a"), _cloud(b, "b")
    if x.shape[1] != y.shape[1]:
        raise ValueError(f"the clouds have {x.shape[1]} and {y.shape[1]} states; compare the same ones")
    return x, y


def _root(square: Any) -> Any:
    return np.sqrt(np.maximum(square, 0.0))
