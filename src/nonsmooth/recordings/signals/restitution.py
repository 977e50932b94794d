"""Impacts of a thrown body: the flights between them, and the restitution of each by fits to its two sides.

A camera sees an impact smeared over a sample or two. So it is not searched for as a kink: a body in flight has the
acceleration of gravity, and where the record does not, something touches it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings.recording import runs_of
from nonsmooth.recordings.signals.checks import even_rate, signal, whose
from nonsmooth.results.labels import labelled


def flights(time: ArrayLike, height: Any, *, threshold: float = 6.0, least: int = 4) -> xr.Dataset:
    """Intervals of a record in which the height of a body's centre falls freely.

    In flight the second differences of the height are gravity plus noise. Where a tenth of the record or more is
    flight, their lower tail is: of those between half and one and a half of their 10 % quantile, the densest half gives
    gravity by its median and the noise by its width. They are taken over as many samples as noise asks for: the fewest
    at which it leaves flights apart from rest. What those at a flight's ends cannot tell, its parabola does.

    Parameters
    ----------
    time, height : array_like, shape (N,)
        Seconds at an even rate, and the height of the centre of mass.
    threshold : float
        How far from free fall, in standard deviations of a second difference, a sample may be; at most by 0.4 g.
    least : int
        The fewest samples of a flight.

    Returns
    -------
    Dataset
        Over ``flight``: ``first`` and ``last`` (indices of its first and last sample), ``begin`` and ``end`` (times).
        Scalars: ``acceleration`` (with its error) of all flights, each fitted with a height and a velocity of its own,
        and ``noise``, the standard deviation of a sample about them.

    Raises
    ------
    ValueError
        If the record is too short, its rate is not even, or it holds no flight.
    """
    t, z = signal(time, height, least=12, purpose="finding flights")
    step = 1.0 / even_rate(t, height, "finding flights")
    lag, rows = 1, list[tuple[int, int]]()
    for span in _spans(len(z)):
        free, sure = _falling(z, step, span, threshold, least)
        seen = [(a, b - 1) for a, b in runs_of(free) if b - a >= least]
        if seen and (sure or not rows):  # where noise hides flights at any span, what the shortest shows
            lag, rows = span, seen
        if seen and sure:
            break
    if not rows:
        raise ValueError(
            f"{whose(height)}: no interval of at least {least} samples falls freely; give the height of the centre of "
            "mass, upwards, at a rate that shows its flights"
        )
    if lag > 1:
        fall, _, noise = _gravity(t, z, rows)
        for k, row in enumerate(rows):
            low, high = rows[k - 1][1] + 1 if k else 0, rows[k + 1][0] - 1 if k + 1 < len(rows) else len(z) - 1
            rows[k] = _whole(t, z, fall, noise, *row, low, high)
    acceleration, error, noise = _gravity(t, z, rows)
    first, last = np.array(rows).T
    return xr.Dataset(
        {
            "first": ("flight", first),
            "last": ("flight", last),
            "begin": ("flight", t[first], {"units": "s"}),
            "end": ("flight", t[last], {"units": "s"}),
            "acceleration": labelled((), acceleration, "acceleration in flight"),
            "acceleration_error": ((), error),
            "noise": labelled((), noise, "standard deviation of a sample"),
        }
    )


def _spans(n: int) -> Iterator[int]:
    """Spans of second differences of a record of n samples: each longer by a quarter, up to an eighth of it."""
    span = 1
    while span == 1 or 8 * span <= n:
        yield span
        span += 1 + span // 4


def _falling(z: FloatArray, step: float, lag: int, threshold: float, least: int) -> tuple[NDArray[np.bool_], bool]:
    """Mark the samples in the middle of free second differences over ``lag`` samples; and whether noise leaves these
    apart from what rests."""
    bend = (z[2 * lag :] - 2 * z[lag:-lag] + z[: -2 * lag]) / (lag * step) ** 2
    tail = np.quantile(bend, 0.1)
    falling = bend[(bend < 0.5 * tail) & (bend > 1.5 * tail)]
    fall = spread = 0.0
    if len(falling) >= least:  # the shortest interval that holds half of the values
        ordered, half = np.sort(falling), max(len(falling) // 2, 1)
        width = ordered[half:] - ordered[:-half]
        k = np.argmin(width)
        fall, spread = np.median(ordered[k : k + half + 1]), width[k] / (2 * 0.6745)
    spread = max(spread, 1e-9 * np.ptp(bend))
    tolerance = min(threshold * spread, 0.4 * abs(fall))  # at rest is never in flight, however great the noise
    free = np.zeros(len(z), dtype=bool)
    free[lag:-lag] = (np.abs(bend - fall) < tolerance) & (fall < 0)
    # the first and the last samples have no second difference of their own: they belong to what lies beside them
    free[:lag], free[-lag:] = free[lag], free[-lag - 1]
    return free, bool(3.0 * spread <= 0.4 * abs(fall))


def _gravity(t: FloatArray, z: FloatArray, rows: list[tuple[int, int]]) -> tuple[float, float, float]:
    """The acceleration of all flights with its error, and the noise of a sample; of each its own line is taken out."""
    parts, freedom = [], -1
    for a, b in rows:
        s = t[a : b + 1] - t[a]
        Q, _ = np.linalg.qr(np.column_stack([np.ones_like(s), s]))
        parts.append([y - Q @ (Q.T @ y) for y in (0.5 * s * s, z[a : b + 1])])
        freedom += len(s) - 2
    q, y = map(np.concatenate, zip(*parts, strict=True))
    acceleration = q @ y / (q @ q)
    left = y - acceleration * q
    noise = math.sqrt(left @ left / max(freedom, 1))
    return acceleration, noise / math.sqrt(q @ q), noise


def _whole(
    t: FloatArray, z: FloatArray, fall: float, noise: float, a: int, b: int, low: int, high: int
) -> tuple[int, int]:
    """A flight with the samples beside it, as far as they lie on its parabola within three errors."""

    def on(k: int) -> bool:
        s = t[a : b + 1] - t[k]
        (_, here), covariance = np.polyfit(s, z[a : b + 1] - 0.5 * fall * s * s, 1, cov="unscaled")
        return bool(abs(z[k] - here) <= 3.0 * noise * math.sqrt(1.0 + covariance[1, 1]))

    while a > low and on(a - 1):
        a -= 1
    while b < high and on(b + 1):
        b += 1
    return a, b


def restitution(
    time: ArrayLike, height: Any, flights: xr.Dataset, *, window: int = 7, longest: float | None = None
) -> xr.Dataset:
    """Restitution of the impact between each flight and the next, e = -v_after / v_before.

    A parabola is fitted to the last ``window`` samples of the flight before and to the first of that after; the impact
    is the instant between them at which they meet (their middle, where they do not), and their slopes there are the
    two velocities.

    Parameters
    ----------
    time, height : array_like, shape (N,)
        Seconds, and the height of the point that touches the ground (for a body that turns, not its centre).
    flights : Dataset
        As :func:`flights` finds them.
    window : int
        Samples on either side, at most; shorter flights are taken whole.
    longest : float, optional
        Seconds between two flights beyond which the contact between them is no single impact; default is 4 samples.

    Returns
    -------
    Dataset
        Over ``impact``: ``impact_time``, ``impact_height``, ``v_before``, ``v_after`` with errors, ``restitution`` and
        ``restitution_error`` (to first order, from the scatter about the fits; NaN where the point does not come down
        by three errors of v_before: something else was hit; and where the velocity does not jump by three of its own:
        nothing was, and noise has parted a flight), ``duration`` (from the last free
        sample to the next), ``flight`` (the number of the flight before).

    Raises
    ------
    ValueError
        If values are missing.
    """
    t, z = signal(time, height, least=12, purpose="restitution")
    found = []
    for k, before, after in single_contacts(t, flights, window, longest):
        if min(len(t[before]), len(t[after])) < 4:
            continue
        i, j = before.stop - 1, after.start
        left, right = _Side(t[before], z[before], t[i]), _Side(t[after], z[after], t[i])
        length, roots = t[j] - t[i], np.roots(left.p - right.p)
        real = np.real(roots[np.abs(np.imag(roots)) < 1e-9])
        inside = real[(real >= 0.0) & (real <= length)]
        when = inside[0] if len(inside) == 1 else 0.5 * length  # where the two parabolas meet
        row = {"flight": k, "impact_time": t[i] + when, "duration": t[j] - t[i]}
        found.append((row | {"impact_height": np.polyval(left.p, when)}, left, right, when))
    sides = [side for _, left, right, _ in found for side in (left, right)]
    freedom = sum(side.freedom for side in sides)
    noise = math.sqrt(sum(side.squares for side in sides) / freedom) if freedom else math.nan
    rows = [
        row | {"v_before": left.slope(when, noise), "v_after": right.slope(when, noise)}
        for row, left, right, when in found
    ]
    return impacts_of(rows, {"impact_height": (float, "height at the impact")}).assign_attrs(noise=noise)


def single_contacts(
    t: FloatArray, flights: xr.Dataset, window: int, longest: float | None
) -> Iterator[tuple[int, slice, slice]]:
    """Each flight that a short contact ends: its number, its last samples and the first of the flight behind it."""
    longest = 4.5 * np.median(np.diff(t)) if longest is None else longest
    first, last = flights["first"].values.tolist(), flights["last"].values.tolist()
    for k, (i, j) in enumerate(zip(last[:-1], first[1:], strict=True)):
        if t[j] - t[i] <= longest:
            yield k, slice(max(first[k], i - window + 1), i + 1), slice(j, min(last[k + 1], j + window - 1) + 1)


def impacts_of(rows: Sequence[Mapping[str, Any]], more: Mapping[str, tuple[type, str]]) -> xr.Dataset:
    """Impacts with their restitution, of rows whose velocities are (value, error); ``more``: other columns."""

    def column(name: str, kind: type = float) -> NDArray[Any]:
        return np.array([row[name] for row in rows], kind)

    data: dict[str, Any] = {}
    times = {"impact_time": "time of the impact", "duration": "from the last free sample to the next"}
    for name, long_name in times.items():
        data[name] = labelled("impact", column(name), long_name, "s")
    (v0, e0), (v1, e1) = sides = [column(f"v_{word}").reshape(-1, 2).T for word in ("before", "after")]
    for word, (v, error) in zip(("before", "after"), sides, strict=True):
        data[f"v_{word}"] = labelled("impact", v, f"velocity {word} the impact")
        data[f"v_{word}_error"] = ("impact", error)
    with np.errstate(divide="ignore", invalid="ignore"):
        e = np.where((v0 < -3.0 * e0) & (v1 - v0 > 3.0 * np.hypot(e0, e1)), -v1 / v0, np.nan)
        e_error = np.hypot(e1, e * e0) / np.abs(v0)
    data |= {"restitution": labelled("impact", e, "restitution"), "restitution_error": ("impact", e_error)}
    data["flight"] = labelled("impact", column("flight", int), "flight before")
    data |= {name: labelled("impact", column(name, kind), text) for name, (kind, text) in more.items()}
    return xr.Dataset(data)


class _Side:
    """A parabola fitted to the samples on one side, over the time since ``origin``."""

    def __init__(self, t: FloatArray, z: FloatArray, origin: float) -> None:
        self.p, self.C = np.polyfit(t - origin, z, 2, cov="unscaled")
        left = z - np.polyval(self.p, t - origin)
        self.squares, self.freedom = left @ left, len(t) - 3

    def slope(self, s: float, noise: float) -> tuple[float, float]:
        """The velocity and its error."""
        along = np.array([2.0 * s, 1.0, 0.0])
        return self.p @ along, noise * math.sqrt(along @ self.C @ along)
