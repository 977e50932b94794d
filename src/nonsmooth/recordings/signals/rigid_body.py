r"""Corners of a tossed rigid body: where they are, how fast, and the restitution of the one that hits the ground.

In flight the centre falls with the acceleration of gravity, and a body with three equal moments of inertia (a cube,
a ball) keeps its angular velocity. Both sides of an impact are therefore known from several samples each, and the
velocity of a corner at r from the centre follows, v = v_c + omega x r, at the instant of the impact itself. Its
vertical part before and after gives the restitution, e = -v_after / v_before (Newton's, of the point of contact).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings.signals.checks import whose
from nonsmooth.recordings.signals.restitution import impacts_of, single_contacts
from nonsmooth.recordings.signals.sections import first_zero

_COLUMNS = {
    "corner": (int, "row of the corner"),
    "half_sample": (float, "change of the restitution by half a sample"),
    "height": (float, "height of the corner"),
    "touching": (int, "corners at the ground"),
    "single": (bool, "one corner alone touches, and comes down"),
}


def cube(half_width: float = 1.0) -> FloatArray:
    """The eight corners of a cube about its centre, shape (8, 3)."""
    signs = np.array(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], indexing="ij"))
    return half_width * signs.reshape(3, -1).T


def corner_heights(position: ArrayLike, orientation: ArrayLike, corners: ArrayLike) -> FloatArray:
    """Heights of all corners over time.

    Parameters
    ----------
    position : array_like, shape (N, 3)
        The centre of mass; the third component points upwards.
    orientation : array_like, shape (N, 4)
        Unit quaternions (w, x, y, z) that turn the body's axes into those of ``position``.
    corners : array_like, shape (V, 3)
        Corners in the body's axes, about the centre of mass.

    Returns
    -------
    array, shape (N, V)

    Raises
    ------
    ValueError
        If a quaternion is not of length 1 within 1 %: their order may be another, or they are no quaternions.
    """
    place, turned = np.asarray(position, float), _turns(orientation).as_matrix()
    return place[:, 2, None] + turned[:, 2, :] @ np.transpose(corners)


def corner_restitution(
    time: ArrayLike,
    position: Any,
    orientation: ArrayLike,
    corners: ArrayLike,
    flights: xr.Dataset,
    *,
    window: int = 7,
    longest: float | None = None,
    near: float = 0.1,
) -> xr.Dataset:
    """Restitution of the corner that hits the ground between each flight and the next.

    Parameters
    ----------
    time, position, orientation, corners
        As in :func:`corner_heights`, with the times in seconds.
    flights : Dataset
        As :func:`~nonsmooth.recordings.signals.restitution.flights` finds them in the height of the centre.
    window : int
        Samples on either side, at most; shorter flights are taken whole.
    longest : float, optional
        Seconds between two flights beyond which the contact between them is no single impact; default is 4 samples.
    near : float
        A corner that is no higher than this over the lowest one at the impact touches too, as a part of the distance of
        the farthest corner from the centre.

    Returns
    -------
    Dataset
        Over ``impact``: ``impact_time``, ``corner`` (its row), ``v_before``, ``v_after`` (vertical, of that corner)
        with errors, ``restitution`` and ``restitution_error`` (to first order, from the scatter about the fits),
        ``half_sample`` (how far the restitution moves with the impact half a sample earlier or later: what a contact
        that lasts, or a camera that blurs, can do to it), ``height`` of the corner there, ``touching`` (corners at
        the ground), ``duration`` (from the last free sample to the next), ``single``: one corner touches, before and
        after the same one, and comes down by more than three errors of its velocity. Attribute ``left_out``: contacts
        between flights that lasted too long.

    Raises
    ------
    ValueError
        If shapes do not agree or values are missing.
    """
    t = np.asarray(time, float)
    place, points = np.asarray(position, float), np.asarray(corners, float)
    if place.shape != (len(t), 3) or np.shape(orientation) != (len(t), 4) or points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(
            f"{whose(position)}: needs time (N,), position (N, 3), orientation (N, 4) and corners (V, 3); got "
            f"{t.shape}, {place.shape}, {np.shape(orientation)} and {points.shape}"
        )
    if not (np.isfinite(t).all() and np.isfinite(place).all() and np.isfinite(np.asarray(orientation)).all()):
        raise ValueError(f"{whose(position)}: values are missing; take the intervals of the record that are whole")
    turns, fall = _turns(orientation), float(flights["acceleration"])
    half_sample = 0.5 * np.median(np.diff(t))
    reach = near * np.max(np.linalg.norm(points, axis=1))
    rows = []
    for k, *sides in single_contacts(t, flights, window, longest):
        before, after = (_Flight(t, place, turns, side, fall) for side in sides)
        begin, end = t[sides[0].stop - 1], t[sides[1].start]
        corner = np.argmin(before.heights(0.5 * (begin + end), points))
        grid = np.linspace(begin, end, 41)
        apart = np.array([before.heights(s, points)[corner] - after.heights(s, points)[corner] for s in grid])
        when = first_zero(grid, apart)
        when = grid[np.argmin(np.abs(apart))] if math.isnan(when) else when
        heights, point = before.heights(when, points), points[corner]
        moved = (when + half_sample, when - half_sample)
        late, early = (-after.velocity(s, point)[0] / before.velocity(s, point)[0] for s in moved)
        v0, e0 = before.velocity(when, point)
        touching = np.count_nonzero(heights < heights[corner] + reach)
        same = corner == np.argmin(after.heights(when, points))
        rows.append(
            {
                "flight": k,
                "impact_time": when,
                "duration": end - begin,
                "v_before": (v0, e0),
                "v_after": after.velocity(when, point),
                "corner": corner,
                "half_sample": 0.5 * abs(late - early),
                "height": heights[corner],
                "touching": touching,
                "single": touching == 1 and same and v0 < -3.0 * e0,
            }
        )
    return impacts_of(rows, _COLUMNS).assign_attrs(left_out=max(flights.sizes["flight"] - 1, 0) - len(rows))


class _Flight:
    """Centre and orientation on one side of an impact: a parabola of known acceleration, a constant spin."""

    def __init__(self, t: FloatArray, place: FloatArray, turns: Any, here: slice, fall: float) -> None:
        self.origin = t[here].mean()
        s = t[here] - self.origin
        self.fall, self.spread, n = fall, s @ s, len(s)
        z = place[here, 2] - 0.5 * fall * s * s
        self.z, self.v = z.mean(), s @ z / self.spread
        left = z - self.z - self.v * s
        self.v_error = math.sqrt(left @ left / max(n - 2, 1) / self.spread)
        self.middle = turns[here][n // 2]
        for _ in range(2):  # one sample's noise, carried along by the spin, would be no residual
            vectors = (turns[here] * self.middle.inv()).as_rotvec()  # turns about the axes of the room
            self.middle = Rotation.from_rotvec(vectors.mean(axis=0)) * self.middle
        self.spin = s @ vectors / self.spread
        left_turn = vectors - vectors.mean(axis=0) - np.outer(s, self.spin)
        self.spin_error = math.sqrt(np.sum(left_turn**2) / 3 / max(n - 2, 1) / self.spread)

    def _arms(self, when: float, points: FloatArray) -> FloatArray:
        """Corners about the centre, in the axes of the room."""
        turn = Rotation.from_rotvec(self.spin * (when - self.origin)) * self.middle
        return turn.apply(points)

    def heights(self, when: float, points: FloatArray) -> FloatArray:
        """Heights of the corners, extrapolated."""
        s = when - self.origin
        return self.z + self.v * s + 0.5 * self.fall * s * s + self._arms(when, points)[:, 2]

    def velocity(self, when: float, point: FloatArray) -> tuple[float, float]:
        """Vertical velocity of a corner and its error."""
        arm = self._arms(when, point[None, :])[0]
        velocity = self.v + self.fall * (when - self.origin) + np.cross(self.spin, arm)[2]
        return velocity, math.hypot(self.v_error, self.spin_error * math.hypot(arm[0], arm[1]))


def _turns(orientation: ArrayLike) -> Any:
    q = np.asarray(orientation, float)
    length = np.linalg.norm(q, axis=-1)
    if not np.all(np.abs(length - 1.0) < 0.01):
        raise ValueError(
            f"orientation must be unit quaternions (w, x, y, z); their lengths run from {length.min():.3g} to "
            f"{length.max():.3g}"
        )
    return Rotation.from_quat(np.roll(q, -1, axis=-1))  # SciPy's order is x, y, z, w
