r"""``correlation_dimension``: how the number of close pairs of section points falls with their distance.

.. math:: C(r) = \frac{\#\{i < j - w : |x_i - x_j| < r\}}{\#\{i < j - w\}} \sim r^{D_2}

The exponent is read off where it holds, and the result says over which distances that is: the slope of log C against
log r at each distance, the range chosen, its width in decades and how much the slope varies in it. A dimension from
less than a decade, or from a slope that drifts, is not one. (On a Cantor set the slope swings about its mean for ever.)

References
----------
P. Grassberger, I. Procaccia, Physica D 9 (1983) 189-208; J. Theiler, Phys. Rev. A 34 (1986) 2427-2432 (the window w).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from nonsmooth.errors import shortened
from nonsmooth.flow.engines.engine import FloatArray
from nonsmooth.results.labels import labelled
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Range, at_least, float_array

if TYPE_CHECKING:
    import xarray as xr

PER_DECADE = 12
SPREAD = 0.06  # of the slope: a range is a scaling range where the slope's standard deviation stays below this
PAIRS = 200  # fewer close pairs than these make a slope of noise
WIDEST = 0.2  # of the extent: larger distances see the attractor's edges
LEAST_DECADES = 0.8
BLOCK = 256  # points that are near each other, whose neighbours are counted at once


@checked
def correlation_dimension(
    section: Any, *, window: Annotated[int, at_least(0)] = 1, scale: Any = None, range: Range | None = None
) -> xr.Dataset:
    """Correlation dimension of section points, with the scaling range it rests on (Grassberger and Procaccia).

    Parameters
    ----------
    section : xarray.Dataset or array (N, n) or (N,)
        A result of ``poincare`` (or one point of a ``sweep``), or points.
    window : int
        Pairs at most this many returns apart are left out: they are near in time, not in space.
    scale : sequence of float, optional
        Size of each state; its standard deviation where not given.
    range : (float, float), optional
        Distances (in units of ``scale``) between which the slope is fitted; found where not given.

    Returns
    -------
    xarray.Dataset
        ``dimension``, ``standard_error`` (of the fit, and half of what the slope drifts by), ``range_low``,
        ``range_high``, ``decades``, ``slope_spread`` (standard deviation of the local slopes in the range),
        ``n_points``; over ``radius``: ``correlation_sum``, ``n_pairs`` and ``local_slope``. ``scaling`` is 1 where
        the slope is constant (spread below 6 %) over 0.8 decades or more, else 0: the dimension is then only the
        steadiest part of a curve without a scaling range.

    Notes
    -----
    Where the density of points is singular the slope goes to its limit like 1/log r only, and stays below it at every
    distance that can be reached: the logistic map at r = 4, of dimension 1, gives 0.90.

    Raises
    ------
    ValueError, TypeError
        Points that are not finite, fewer than 200, or all the same.
    """
    import xarray as xr

    points = _points(section)
    size = points.std(axis=0) if scale is None else float_array(scale, "scale")
    if np.shape(size) != points.shape[1:] or not np.isfinite(size).all() or (np.asarray(size) < 0).any():
        raise ValueError(
            f"scale must be one positive number for each of the {points.shape[1]} states, not {shortened(scale)}"
        )
    moving = np.asarray(size) > 0
    if not moving.any():
        raise ValueError("all section points are the same: there are no distances to count (a period-1 orbit)")
    x = points[:, moving] / np.asarray(size)[moving]
    extent = float(np.ptp(x, axis=0).max())
    radius = extent * 10.0 ** -np.arange(0.0, 7.0, 1.0 / PER_DECADE)[::-1]
    pairs = _pairs(x, radius, window)
    total = 0.5 * (len(x) - window) * (len(x) - window - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.log(pairs)
    slope = _slopes(np.log(radius), logs)
    low, high = _range(radius, slope, pairs, extent) if range is None else _given(range, radius)
    chosen = (radius >= low * (1 - 1e-9)) & (radius <= high * (1 + 1e-9))
    a, b = np.log(radius[chosen]), logs[chosen]
    (dimension, _), covariance = np.polyfit(a, b, 1, cov=True) if chosen.sum() > 3 else (np.full(2, np.nan), None)
    spread = float(np.nanstd(slope[chosen]))
    decades = float(np.log10(high / low))
    found = bool(decades >= LEAST_DECADES and spread <= SPREAD * max(float(dimension), 1e-300))
    error = np.nan if covariance is None else float(np.hypot(np.sqrt(covariance[0, 0]), _drift(a, b)))
    return xr.Dataset(
        {
            "dimension": labelled((), float(dimension), "correlation dimension"),
            "standard_error": labelled((), error, "standard error: of the fit, and of the slope's drift"),
            "range_low": labelled((), low, "smallest distance of the scaling range"),
            "range_high": labelled((), high, "largest distance of the scaling range"),
            "decades": labelled((), decades, "width of the scaling range"),
            "slope_spread": labelled((), spread, "standard deviation of the slope in the range"),
            "scaling": labelled((), np.int8(found), "whether there is a scaling range"),
            "n_points": ((), len(x)),
            "correlation_sum": labelled("radius", pairs / total, "part of the pairs nearer than r"),
            "n_pairs": labelled("radius", pairs, "number of pairs nearer than r"),
            "local_slope": labelled("radius", slope, "d log C / d log r over half a decade"),
        },
        {"radius": labelled("radius", radius, "distance in units of the states' scale")},
    )


def _points(section: Any) -> FloatArray:
    if hasattr(section, "data_vars"):
        if "section" not in section or set(section["section"].dims) != {"iterate", "state"}:
            raise ValueError(
                "a Dataset must hold one section, section(iterate, state): a result of poincare, or one point of a "
                "sweep, e.g. swept.isel(rho=3, drop=True)"
            )
        section = section["section"].transpose("iterate", "state").values
    points = float_array(section, "section points")
    if points.ndim == 1:
        points = points[:, None]
    if points.ndim != 2 or len(points) < 200:
        raise ValueError(f"section points must be an array (N, n) with N >= 200, not of shape {points.shape}")
    if not np.isfinite(points).all():
        raise ValueError("section points must be finite; a point that failed has none")
    return points


def _pairs(x: FloatArray, radius: FloatArray, window: int) -> FloatArray:
    """Pairs nearer than each radius (largest coordinate difference), more than ``window`` apart in time."""
    from scipy.spatial import cKDTree

    tree = cKDTree(x)
    counts = np.full(len(radius), -0.5 * len(x))
    for near in np.array_split(tree.indices, np.ceil(len(x) / BLOCK)):  # Ctrl-C is heard between two of them
        counts += tree.count_neighbors(cKDTree(x[near]), radius, p=np.inf) / 2
    for lag in np.arange(1, window + 1):
        distance = np.sort(np.abs(x[lag:] - x[:-lag]).max(axis=1))
        counts -= np.searchsorted(distance, radius, side="right")
    return np.asarray(counts)


def _slopes(x: FloatArray, y: FloatArray) -> FloatArray:
    """Slope at each distance: a straight line through what lies within a quarter of a decade of it."""
    half = PER_DECADE // 4
    slope = np.full(len(x), np.nan)
    for i in np.arange(half, len(x) - half):
        part = slice(i - half, i + half + 1)
        if np.isfinite(y[part]).all():
            slope[i] = np.polyfit(x[part], y[part], 1)[0]
    return slope


def _drift(a: FloatArray, b: FloatArray) -> float:
    """Half the difference of the slopes of both halves of the range."""
    half = len(a) // 2
    low, high = (np.polyfit(a[part], b[part], 1)[0] for part in (slice(None, half + 1), slice(half, None)))
    return 0.5 * abs(float(high - low))


def _range(radius: FloatArray, slope: FloatArray, pairs: FloatArray, extent: float) -> tuple[float, float]:
    """The widest interval of a steady slope; where there is none, the steadiest of the least width."""
    usable = np.flatnonzero((pairs >= PAIRS) & (radius <= WIDEST * extent) & np.isfinite(slope))
    least = int(np.ceil(LEAST_DECADES * PER_DECADE))
    if len(usable) <= least:
        if len(usable) < 2:
            return float(radius[-2]), float(radius[-1])
        return float(radius[usable[0]]), float(radius[usable[-1]])
    first, last = int(usable[0]), int(usable[-1])
    steadiest, best = (first, first + least), np.inf
    for width in np.arange(last - first, least - 1, -1):
        for begin in np.arange(first, last - width + 1):
            part = slope[begin : begin + width + 1]
            spread = float(part.std() / max(part.mean(), 1e-300))
            if spread < best:
                steadiest, best = (int(begin), int(begin + width)), spread
        if best <= SPREAD:
            break
    return float(radius[steadiest[0]]), float(radius[steadiest[1]])


def _given(limits: tuple[float, float], radius: FloatArray) -> tuple[float, float]:
    low, high = limits
    if not radius[0] <= low < high <= radius[-1] * (1 + 1e-9):
        raise ValueError(f"range = {shortened(limits)} must lie within {radius[0]:.3g} ... {radius[-1]:.3g}")
    return low, high
