r"""The period number of a measured section cloud whose noise is known, and the flips along a slow rise.

A measured return is never exact. With a standard error :math:`\sigma_i` of each coordinate, the scaled return

.. math:: r_p^2 = \Big\langle \tfrac{(s_{k+p} - s_k)_i^2}{2 \sigma_i^2} \Big\rangle_{k, i}

is 1 for a motion of period p and larger for any other. The period number is the smallest p with r_p below a bound;
0 where there is none: chaos, or a motion that has not settled. A period-doubled orbit whose points are closer together
than the noise cannot be told from the one before the doubling.

A rise is late: near the flip the amplitude A by which successive section points part, :math:`\pm A`, settles ever more
slowly, and it is seen to vanish (or to appear) only some way beyond. How far depends on the rate and on the noise, so
the place where it is lost is no property of the motion. What holds on the way is the amplitude equation of a flip,

.. math::

    \frac{\mathrm d A}{\mathrm d n} = \kappa A \Big[ y + q y^2 - \frac{A^2}{C} \Big], \qquad y = \pm (\rho_f - \rho_n)

with y > 0 on the side of the doubled motion and n counting returns. Its steady amplitude is the square root law
:math:`A^2 = C (y + q y^2)`; the flip is at :math:`\rho_f` whatever the rate. With :math:`w = A^{-2}` it is linear, and
is solved step by step. The four numbers and the first amplitude are fitted to the record. Source of the equation: the
normal form of the flip, Kuznetsov, *Elements of Applied Bifurcation Theory* (2004), Section 4.5, with its parameter
drifting.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from nonsmooth.arrays import BoolArray, FloatArray, IntArray

BOUND = 2.0  # of r_p: the stated noise may be wrong by as much before a period is lost
FEWEST_RETURNS = 4


class MeasuredPeriod(NamedTuple):
    """Period number (0: none found) with the scaled returns r_1, r_2, ... it rests on."""

    number: int
    returns: FloatArray


def measured_period(
    points: ArrayLike, noise: ArrayLike, *, max_period: int = 16, drifting: bool = False
) -> MeasuredPeriod:
    r"""The period number of successive section points (n, states), of which each has the standard error ``noise``
    (states,).

    A point that is NaN is missing, and the others keep their places. Of points (n, phases, states) each phase has a
    scaled return, and their median counts: the period is that of the motion, and samples do not tell where it is beside
    an impact. ``drifting``: judge second differences, :math:`s_{k+2p} - 2 s_{k+p} + s_k` over :math:`\sqrt{6} \sigma`,
    which a motion of period p that drifts evenly leaves at 1, too.
    """
    cloud, sigma = np.asarray(points, float), np.asarray(noise, float)
    cloud = cloud[:, None] if cloud.ndim == 2 else cloud
    if not (np.isfinite(sigma).all() and (sigma > 0).all()):
        raise ValueError(f"noise must be a positive standard error for each state, got {sigma.tolist()}")
    order = 2 if drifting else 1
    count = np.isfinite(cloud).all(axis=(1, 2)).sum()
    longest = min(max_period, (count - FEWEST_RETURNS) // order)
    if longest < 1:
        raise ValueError(
            f"{count} section points are too few for a period number; at least {FEWEST_RETURNS + 1} are needed"
        )
    scaled = cloud / (np.sqrt(6.0 if drifting else 2.0) * sigma)
    returns = np.full(longest, np.inf)
    for p in range(1, longest + 1):
        change = scaled[p:] - scaled[:-p]
        change = change[p:] - change[:-p] if drifting else change
        if len(known := change[np.isfinite(change).all(axis=(1, 2))]) >= FEWEST_RETURNS:
            returns[p - 1] = np.sqrt(np.median(np.mean(known**2, axis=(0, 2))))
    found = np.flatnonzero(returns <= BOUND)
    return MeasuredPeriod(int(found[0]) + 1 if len(found) else 0, returns)


def period_numbers(points: ArrayLike, noise: ArrayLike, *, window: int = 24, max_period: int = 8) -> IntArray:
    """The period number in a window that moves along a slow rise of a parameter, one for each point.

    The points of an orbit drift with the parameter: an even drift within the window is no return's fault.
    Points within half a window of an end have that of the first and last whole window.
    """
    cloud = np.asarray(points, float)
    if len(cloud) < window:
        raise ValueError(f"{len(cloud)} section points are fewer than one window of {window}")
    count = len(cloud) - window + 1
    parts = (cloud[i : i + window] for i in range(count))
    numbers = [measured_period(part, noise, max_period=max_period, drifting=True).number for part in parts]
    return np.pad(numbers, (window // 2, window - 1 - window // 2), mode="edge").astype(np.int64)


class Doubling(NamedTuple):
    """A flip in a row of period numbers: ``word`` is ``1-2`` or ``2-4``; ``above``: the doubled motion lies above."""

    word: str
    above: bool
    value: float


STRAYS = 0.75  # of a change of the period number, in values on the wrong side: one value alone is no flip and back


def flips(values: ArrayLike, numbers: ArrayLike, least: float = 1.0) -> list[Doubling]:
    """Values at which the period number doubles, as many as there are, from period 1 on and from the lowest value on.

    Between the two numbers there may be values where none is found, 0 (the motion is slow near a flip, and passes
    through it with a delay when the parameter moves); the value given is the one that separates the two numbers with
    the fewest points on the wrong side. Fewer than 1.5 ``least`` points of another number between others are no
    flip and back.
    """
    order = np.argsort(np.asarray(values, float), kind="stable")
    x, n = np.asarray(values, float)[order], np.asarray(numbers)[order]
    found = []
    for p in (1, 2):
        single, double = n == p, n == 2 * p
        changes = _changes(single, double, STRAYS * least)
        for first, at, last in zip([0, *changes], changes, [*changes[1:], len(x)], strict=False):
            above = double[at:last].sum() > single[at:last].sum()
            below, over = (one[first:last].astype(int) for one in ((double, single) if above else (single, double)))
            # Points on the wrong side of each cut; a tie is cut in its middle.
            wrong = over.sum() + np.concatenate([[0], np.cumsum(below - over)])
            best = first + np.flatnonzero(wrong == wrong.min())
            edges = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
            found.append(Doubling(f"{p}-{2 * p}", bool(above), 0.5 * (edges[best[0]] + edges[best[-1]])))
    return found


def _changes(single: BoolArray, double: BoolArray, price: float) -> list[int]:
    """Places of the changes between the numbers that cost least: ``price`` each, 1 a point on the wrong side."""
    cost, ways = np.zeros(2), []
    for wrong in zip(double, single, strict=True):
        came = cost > cost[::-1] + price  # it is cheaper to have come from the other number
        ways.append(came)
        cost = np.where(came, cost[::-1] + price, cost) + wrong
    here, changes = int(cost[1] < cost[0]), []
    for i in range(len(ways) - 1, 0, -1):
        if ways[i][here]:
            changes.append(i)
            here = 1 - here
    return changes[::-1]


FEWEST = 12  # points with a splitting that can be seen
STRAY = 12  # points of another period number in a row that end the doubled side
ALIKE = 8 / 3  # second differences overlap: as many of them say as much as one
SEEN = 3.0  # standard errors of a point: a splitting that can be seen


class MeasuredFlip(NamedTuple):
    """A flip found in a slow rise.

    Attributes
    ----------
    value, error : float
        The parameter at the flip and its standard error; NaN where the amplitude could not be followed.
    read : Doubling
        Where the record itself changes its period number: later than the flip.
    """

    value: float
    error: float
    read: Doubling


def delayed_flips(at: FloatArray, points: FloatArray, noise: FloatArray, numbers: IntArray) -> list[MeasuredFlip]:
    """The flips along a slow and even rise (or fall) of a parameter.

    ``at`` (n,) is the parameter at each section point, ``numbers`` (n,) its period number, by :func:`period_numbers`.
    """
    return [_followed(at, points / noise, numbers, read) for read in flips(at, numbers, STRAY)]


def _followed(at: FloatArray, points: FloatArray, numbers: IntArray, read: Doubling) -> MeasuredFlip:
    p = int(read.word.split("-")[0])
    nothing = MeasuredFlip(np.nan, np.nan, read)
    cut = int(np.argmin(np.abs(at - read.value)))
    # Time runs from the doubled side to the other (closing), or the other way round.
    closing = read.above == (at[-1] < at[0])
    order = slice(None, None, 1 if closing else -1)  # now the doubled side comes first
    where, cloud, known = at[order], points[order], numbers[order]
    cut = cut if closing else len(at) - 1 - cut
    begin, end = _reach(known, cut, 2 * p), len(known) - _reach(known[::-1], len(known) - 1 - cut, p)
    parts = (slice(begin + k, end, p) for k in range(p))
    splits = (_splitting(where[part], cloud[part]) for part in parts)
    widest = max(splits, key=lambda one: float(one[1].max(initial=0.0)))
    wide, near = (_near(*widest, share, 1.0 if closing else -1.0) for share in (0.5, 0.25))
    if wide is None or near is None:
        return nothing
    # By how much the flip moves with what is taken for near is an error of the equation.
    return MeasuredFlip(wide[0], float(np.hypot(wide[1], wide[0] - near[0])), read)


def _near(rho: FloatArray, size: FloatArray, share: float, time: float) -> tuple[float, float] | None:
    """Flip and its standard error, from the last amplitude on whose square exceeds this share of the largest square.

    The square root law and its next order hold near the flip. None where too few of these can be seen: of a fast
    opening all but the end is lost in noise, and nothing says where it began."""
    first = np.flatnonzero(size**2 > share * size.max(initial=0.0) ** 2).max(initial=-1) + 1
    rho, size = rho[first:], size[first:]
    seen = np.count_nonzero(size > SEEN)
    if seen < FEWEST:
        return None
    stop = min(len(size), 2 * seen + FEWEST)
    return _fitted(rho[:stop], size[:stop], time)


def _reach(numbers: IntArray, cut: int, number: int) -> int:
    """Length, back from the cut, over which the record keeps this period number, strays apart."""
    stray = 0
    for i in range(cut, -1, -1):
        stray = 0 if numbers[i] == number else stray + 1
        if stray > STRAY and i < cut - 2 * STRAY:
            return i + stray
    return 0


def _splitting(at: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Amplitude of the alternation along its main direction, in standard errors of a point; an even drift has none."""
    if len(points) < FEWEST:
        return at[:0], at[:0]
    parity = np.where(np.arange(len(points) - 2) % 2 == 0, 0.25, -0.25)[:, None]
    parted = parity * (points[2:] - 2 * points[1:-1] + points[:-2])
    size = parted @ np.linalg.svd(parted, full_matrices=False)[2][0]
    return at[1:-1], size if size.sum() > 0 else -size


def _fitted(rho: FloatArray, size: FloatArray, time: float) -> tuple[float, float] | None:
    """Flip and its standard error; ``rho`` leads from the doubled side across, ``time`` is -1 where it runs back.

    The next order of the equation is fitted in two ways, of which data rarely choose one: the better is taken, and
    half of what they differ counts as an error of its own.
    """
    span = rho[-1] - rho[0]
    forward = slice(None, None, 1 if time > 0 else -1)
    place = (rho - rho[0]) / span  # 0 ... 1 from the doubled side across
    guess = _guess(place[forward], size[forward])
    if guess is None:
        return None
    edge = -2 * np.log(max(size[forward][:4].mean(), 0.3))
    tried = (_one_fit(place, size, forward, [*guess, 0.0, edge, *more]) for more in ([], [0.0]))
    held = sorted(filter(None, tried))
    if not held:
        return None
    _, flip, error = held[0]
    spread = 0.5 * (max(one[1] for one in held) - min(one[1] for one in held))
    return rho[0] + span * flip, abs(span) * np.hypot(error, spread)


def _one_fit(
    place: FloatArray, size: FloatArray, forward: slice, start: list[float]
) -> tuple[float, float, float] | None:
    """Cost (with its price for parameters), flip and standard error in 0 ... 1; None where nothing is found there."""
    from scipy.optimize import least_squares

    def model(z: FloatArray) -> FloatArray:
        y = z[0] - place
        growth = (2 * np.exp(z[1]) * (y + z[3] * y**2))[forward]
        gain = (2 * np.exp(z[1] - 2 * z[2]) * (1 + (z[5] * y if len(z) > 5 else 0 * y)))[forward]
        return _amplitude(growth, gain, z[4])[forward]

    found = least_squares(
        lambda z: model(z) - size,
        start,
        x_scale=[0.1, *[1.0] * (len(start) - 1)],
        loss="soft_l1",
        f_scale=2.0,
        max_nfev=200,
    )
    if not found.success:  # 200 evaluations and not there
        return None
    variance = max(np.sum((model(found.x) - size) ** 2) / max(len(size) - len(start), 1), 0.375)
    try:
        covariance = np.linalg.inv(found.jac.T @ found.jac) * variance * ALIKE
    except np.linalg.LinAlgError:
        return None
    flip, error = found.x[0], np.sqrt(covariance[0, 0])
    if not (0 < flip < 1 and error < 0.5):
        return None
    return found.cost / variance + len(start), flip, error


def _guess(place: FloatArray, size: FloatArray) -> tuple[float, float, float] | None:
    """Flip, log of the rate and of the height from d(ln A)/dn = rate (flip - place) - rate A^2 / height^2, linear."""
    smooth = np.convolve(size, np.ones(5) / 5, mode="valid")
    at = place[2 : len(place) - 2]
    good = smooth > 2.0
    both = good[4:] & good[:-4]
    if np.count_nonzero(both) < 6:
        return None
    middle = smooth[2:-2][both]
    slope = np.log(smooth[4:][both] / smooth[:-4][both]) / 4
    columns = np.column_stack([np.ones(len(middle)), -at[2:-2][both], -(middle**2)])
    weight = middle[:, None]  # the error of ln A goes like 1/A
    (constant, rate, fall), *_ = np.linalg.lstsq(columns * weight, slope * middle, rcond=None)
    if rate <= 0 or fall <= 0:
        return None
    return constant / rate, np.log(rate), 0.5 * np.log(rate / fall)


def _amplitude(growth: FloatArray, gain: float, first: float) -> FloatArray:
    """A along the record from w' = -growth w + gain, exact for constant growth within a step; w_0 = exp(first)."""
    w, found = float(np.exp(np.clip(first, -500.0, 500.0))), np.empty(len(growth))
    decay = np.exp(-np.clip(growth, -50.0, 50.0))
    fed = gain * np.where(np.abs(growth) < 1e-9, 1.0, (1 - decay) / np.where(growth == 0, 1.0, growth))
    for i in range(len(growth)):
        found[i] = w
        w = min(max(w * decay[i] + fed[i], 1e-250), 1e250)
    return found**-0.5
