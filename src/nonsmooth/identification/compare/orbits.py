r"""Distances of motions: of two closed orbits, folded by the phase of the drive, and of two clouds of points.

Measured samples fall anywhere in a period. Folded, a motion stands on equal grids of phase, period after period;
between samples each state is interpolated by the cubic through the four samples nearest by: of fourth order where the
motion is smooth, and a kink that an impact leaves reaches no further than two samples.

Two orbits are given on equal grids of phase, over the same whole number of forcing periods. With s_i the root mean
square size of state i about its mean (of both orbits together), or its noise where that is larger,

.. math:: d(\delta)^2 = \frac1n \sum_i \Big\langle \frac{(a_i(\varphi) - b_i(\varphi - \delta))^2}{s_i^2} \Big\rangle

is 0 for equal orbits, about :math:`\sqrt 2` for unrelated ones of equal size, and :math:`2 |\sin(\delta / 2)|` for two
harmonic ones that are :math:`\delta` apart. Where the drive's phase is known, only shifts by whole forcing periods are
free (which of p alike points is called the first); modulo phase, all are.

The energy distance of Székely and Rizzo (J. Stat. Plan. Inference 143 (2013) 1249-1272, Eq. 2.1) of the laws of
X and Y,

.. math:: E^2 = 2\,\mathrm E|X - Y| - \mathrm E|X - X'| - \mathrm E|Y - Y'|,

is zero only where the laws are equal, in any number of dimensions; SciPy has it in one. A finite cloud is at a distance
from the law it came from, so a distance says something only beside those of the cloud's own halves. The halves are
made of whole blocks of successive points: points of a motion that follow each other are alike, and halves of
single points would be closer than two records are.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment, minimize_scalar
from scipy.spatial.distance import cdist, pdist

from nonsmooth.arrays import BoolArray, FloatArray

FEWEST_SAMPLES = 8  # per forcing period: fewer do not show an orbit
NEAREST = 0.25  # of the mean step: a cubic through samples nearer to each other magnifies their errors


def fold(phase: ArrayLike, u: ArrayLike, grid: int) -> FloatArray:
    """The motion on ``grid`` equal steps of phase in each whole forcing period, the first at phase 0: (periods, grid,
    states).

    ``phase`` (samples,) rises through all periods, of which each has at least eight samples. Of ``u`` (samples,
    states) a sample that is missing is NaN; a period that touches one is NaN, or an interval of more than a quarter of
    a period without samples.
    """
    turns, values = np.asarray(phase, float), np.asarray(u, float)
    rises = np.diff(turns)
    if (rises < 0).any():
        i = np.argmax(rises < 0)
        raise ValueError(
            f"the phase goes back from {turns[i]:.6g} to {turns[i + 1]:.6g} forcing periods (sample {i + 1})"
        )
    keep = np.concatenate([[True], rises > 0])  # a crossing stands twice in a trajectory
    turns, values = turns[keep], values[keep]
    first, last = int(np.ceil(turns[0] - 1e-9)), int(np.floor(turns[-1] + 1e-9))
    if last <= first:
        raise ValueError(
            f"the record covers {turns[-1] - turns[0]:.3g} forcing periods; at least one whole one is needed"
        )
    rate = len(turns) / (turns[-1] - turns[0])
    if rate < FEWEST_SAMPLES:
        raise ValueError(f"{rate:.3g} samples per forcing period are too few; at least {FEWEST_SAMPLES} are needed")
    at = first + np.arange((last - first) * grid) / grid
    good = np.isfinite(values).all(axis=1)
    turns, lost = turns[good], turns[~good]
    far = _apart(turns, NEAREST / rate)
    folded = _cubic(turns[far], values[good][far], np.clip(at, turns[0], turns[-1])).reshape(-1, grid, values.shape[1])
    step = np.diff(turns)[np.clip(np.searchsorted(turns, at), 1, len(turns) - 1) - 1]
    for missing in np.unique(np.floor(np.append(lost, at[step > 2 / FEWEST_SAMPLES])).astype(int) - first):
        if 0 <= missing < len(folded):
            folded[missing] = np.nan
    return folded


def _apart(x: FloatArray, least: float) -> BoolArray:
    """Choose samples of which none is less than ``least`` behind the one before."""
    stay = np.ones(len(x), bool)
    last = -1
    for i in np.flatnonzero(np.diff(x) < least) + 1:
        last = int(i) - 1 if stay[i - 1] else last
        stay[i] = x[i] - x[last] >= least
    return stay


def _cubic(x: FloatArray, y: FloatArray, at: FloatArray) -> FloatArray:
    """Lagrange's cubic through the four samples about each place."""
    nodes = np.clip(np.searchsorted(x, at, side="right") - 2, 0, max(len(x) - 4, 0))[:, None] + np.arange(4)
    away = at[:, None] - x[nodes]
    apart = x[nodes][:, :, None] - x[nodes][:, None, :]
    apart[:, np.arange(4), np.arange(4)] = 1.0
    products = np.stack([np.delete(away, i, axis=1).prod(axis=1) for i in range(4)], axis=1)
    return np.einsum("ij,ijk->ik", products / apart.prod(axis=2), y[nodes])


def mean_orbit(folded: FloatArray, period_number: int) -> tuple[FloatArray, FloatArray]:
    """The orbit over ``period_number`` forcing periods, averaged over the record (periods, grid, states), and the
    standard deviation of one pass about it (NaN from a single pass), both (period_number * grid, states).
    """
    passes = len(folded) // period_number
    stacked = folded[: passes * period_number].reshape(passes, period_number * folded.shape[1], folded.shape[2])
    stacked = stacked[np.isfinite(stacked).all(axis=(1, 2))]
    if not len(stacked):
        raise ValueError("no pass of the orbit is without missing samples")
    scatter = stacked.std(axis=0, ddof=1) if len(stacked) > 1 else np.full(stacked.shape[1:], np.nan)
    return stacked.mean(axis=0), scatter


class OrbitDistance(NamedTuple):
    """Distances of two orbits.

    Attributes
    ----------
    distance : float
        The least over shifts by whole forcing periods.
    any_phase : float
        The least over all shifts.
    whole_shift : int
        The periods by which the second orbit leads in ``distance``.
    phase_shift : float
        Forcing periods, in -1/2 ... 1/2, by which the second orbit leads the first beyond whole ones in
        ``any_phase``.
    """

    distance: float
    any_phase: float
    whole_shift: int
    phase_shift: float


def orbit_distance(x: FloatArray, y: FloatArray, periods: int, noise: ArrayLike = 0.0) -> OrbitDistance:
    """Normalised distance of two orbits, each (periods * grid, states) on equal grids of phase."""
    size = np.maximum(np.sqrt(0.5 * (x.var(axis=0) + y.var(axis=0))), noise)
    size = np.where(size > 0, size, 1.0)
    n, states = x.shape
    fx, fy = np.fft.fft(x / size, axis=0) / n, np.fft.fft(y / size, axis=0) / n
    order = np.fft.fftfreq(n, 1 / n)
    power = (np.abs(fx) ** 2 + np.abs(fy) ** 2).sum()
    cross = (np.conj(fx) * fy).sum(axis=1)

    def distance(lead: float) -> float:
        """``y`` led by this part of the whole length, against ``x``."""
        likeness = (cross * np.exp(-2j * np.pi * order * lead)).real.sum()
        return np.sqrt(max(power - 2 * likeness, 0.0) / states)

    # At the n leads i / n the likeness is one Fourier sum.
    grid = np.sqrt(np.maximum(power - 2 * np.fft.fft(cross).real, 0.0) / states)
    whole = grid[:: n // periods]
    best = int(np.argmin(whole))
    near = np.argmin(grid) / n
    found = minimize_scalar(distance, bounds=(near - 1 / n, near + 1 / n), method="bounded", options={"xatol": 1e-10})
    lead = found.x if found.fun <= grid.min() else near
    shift = (lead * periods + 0.5) % 1.0 - 0.5
    return OrbitDistance(whole[best], min(found.fun, grid.min()), best, shift)


def common_length(orbit: ArrayLike, periods: int, length: int) -> FloatArray:
    """An orbit over ``periods`` repeated to ``length`` forcing periods, a multiple of them."""
    return np.tile(orbit, (length // periods, 1))


FEWEST_BLOCKS = 20
LIKENESS = 0.1  # successive points are taken as unrelated where their mean distance is within 10 % of that of any two
MOST = 3000  # points of one cloud, the last ones: the matrix of distances grows like the square
ASSIGNED = 500  # points of each cloud in the assignment that gives the Wasserstein distance


class CloudDistance(NamedTuple):
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
        return self.matched / np.quantile(self.halves, 0.95)


def energy_distance(a: ArrayLike, b: ArrayLike) -> float:
    r"""Energy distance :math:`E = \sqrt{2 E|X-Y| - E|X-X'| - E|Y-Y'|}` of two clouds, each (points, states).

    In one dimension it equals ``scipy.stats.energy_distance``. The clouds must be in one common unit.
    """
    x, y = _two_clouds(a, b)
    return _root(2 * cdist(x, y).mean() - cdist(x, x).mean() - cdist(y, y).mean())


def wasserstein(a: ArrayLike, b: ArrayLike, seed: int = 0) -> float:
    """Wasserstein distance (order 1) of two clouds: the least mean distance in moving one onto the other.

    For equal numbers of points this is SciPy's linear assignment, exactly; seeded parts of at most 500 points are
    taken.
    """
    x, y = _two_clouds(a, b)
    size = min(len(x), len(y), ASSIGNED)
    rng = np.random.default_rng(seed)
    x, y = (cloud if len(cloud) == size else rng.choice(cloud, size, replace=False) for cloud in (x, y))
    cost = cdist(x, y)
    return cost[linear_sum_assignment(cost)].mean()


def block_length(cloud: FloatArray) -> int:
    """Successive points that are still alike: the lag beyond which their mean distance is that of any two points.

    At most a twentieth of the points, so that random halves of blocks can be drawn.
    """
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
    """Energy distance of two clouds (points, states) beside those of their own random halves.

    The points are successive, in one common unit. ``block`` of them stay together: :func:`block_length` of ``a`` where
    not given.
    """
    x, y = _two_clouds(a, b)
    x, y = x[-MOST:], y[-MOST:]  # thinning would separate successive points
    length = block_length(x) if block is None else block
    rng = np.random.default_rng(seed)
    xx, yy, xy = cdist(x, x), cdist(y, y), cdist(x, y)
    pairs = [_halves(len(x), length, rng) for _ in range(splits)]
    size = pairs[0][0].sum()
    others = [_parts(len(y), length, size, rng) for _ in range(splits)]
    (left, right), (first, second) = (np.array(rows, float).transpose(1, 2, 0) for rows in (pairs, others))
    to_left, to_right, to_first, to_second = xx @ left, xx @ right, yy @ first, yy @ second
    within, beyond = _mean(left, to_left, left), _mean(first, to_first, first)
    halves = _root(2 * _mean(left, to_right, right) - within - _mean(right, to_right, right))
    other_halves = _root(2 * _mean(first, to_second, second) - beyond - _mean(second, to_second, second))
    matched = np.median(_root(2 * _mean(left, xy @ first, first) - within - beyond))
    whole = _root(2 * xy.mean() - xx.mean() - yy.mean())
    return CloudDistance(whole, matched, halves, other_halves, length, size)


def _mean(part: FloatArray, product: FloatArray, other: FloatArray) -> FloatArray:
    """Mean distance between two parts, for many pairs at once: columns say which points are in, ``product`` is the
    matrix of distances times ``other``."""
    return np.einsum("ij,ij->j", part, product) / (part.sum(axis=0) * other.sum(axis=0))


def _halves(n: int, block: int, rng: np.random.Generator) -> tuple[BoolArray, BoolArray]:
    """Two random halves of n points, in blocks; what does not fill a pair of blocks is left out at a random end."""
    count = n // (2 * block)
    first = rng.integers(0, n - 2 * count * block + 1)
    owner = np.repeat(rng.permutation(np.arange(2 * count) % 2), block)
    halves = np.zeros((2, n), bool)
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


def _two_clouds(a: ArrayLike, b: ArrayLike) -> list[FloatArray]:
    clouds = [np.asarray(cloud, float).reshape(len(np.asarray(cloud)), -1) for cloud in (a, b)]
    if not all(np.isfinite(cloud).all() for cloud in clouds):
        raise ValueError("section points must be finite numbers: compare states that all modes have")
    return clouds


def _root(square: Any) -> Any:
    return np.sqrt(np.maximum(square, 0.0))
