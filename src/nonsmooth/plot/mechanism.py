"""The sketch of a mechanical system: masses on a line, springs, dampers, stops with gaps, friction, belts, base."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.pen import GREY, GROUND, PALE, Link, Part, Pen, Scheme, put
from nonsmooth.system.arguments import checked
from nonsmooth.system.parameter import latex_name

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from nonsmooth.system.system import System

_WIDTH, _ZONE, _FLOOR = 1.1, 1.75, 0.2  # of a mass, between two of them, below them
_LANE = 0.44  # height that one link takes
_GAP = 0.32  # of a contact in a sketch that is not to scale
_ORDER = ("spring", "preload", "damper", "backlash", "friction", "stop", "elastic")  # from above
_FORCE = style.COLORS["first"]


@checked
def mechanism(system: System, ax: Axes | None = None, *, labels: bool = True) -> Axes:
    """Draw a mechanical system as masses on a line with what joins them.

    Parameters
    ----------
    system
        Made by :func:`nonsmooth.mechanical`, a model of :mod:`nonsmooth.models` that is a mass or several on a line, or
        any system whose states are coordinates and their speeds.
    ax
        Where to draw; a new figure that is as wide as the sketch needs, if None.
    labels
        Write symbols or numbers to the parts.

    Returns
    -------
    Axes
        Not to scale, in the position in which all coordinates are zero. Contacts are coloured: stops with their gaps,
        elastic ones with a spring, friction as a block that rubs the floor, a belt or the next mass.

    Raises
    ------
    ValueError
        A system without masses on a line: no coordinates with speeds, a mass matrix that is not diagonal, a contact
        along a curve.

    Notes
    -----
    Springs and dampers are the linear parts of the accelerations where all states are zero, so a nonlinear spring is
    drawn with its tangent. What is not drawn stands in a line below the sketch.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> ax = ns.plot.mechanism(ns.models.impact_damper())
    """
    from nonsmooth.plot.scheme import scheme_of

    sketch = Sketch(scheme_of(system))
    with style.axes(ax, width=min(0.56 * sketch.width, style.PAGE), ratio=sketch.height / sketch.width) as drawn:
        sketch.frame(drawn)
        put(drawn, sketch.parts(labels=labels))
    return drawn


def sketch_of_run(system: System, run: xr.Dataset) -> tuple[Sketch, Callable[[int], list[Part]]] | None:
    """The sketch of a system, and a function that gives its parts at each instant of a run; None where the system has
    no masses on a line."""
    from nonsmooth.plot.scheme import scheme_of

    try:
        sketch = Sketch(scheme_of(system), moving=True)
    except ValueError:
        return None
    q = np.stack([run["u"].sel(state=name).values for name, _ in sketch.scheme.pairs], axis=1)
    scale, q, time = sketch.scale_for(q), np.nan_to_num(q), run["time"].values
    return sketch, lambda k: sketch.parts(scale * q[k], scale, float(time[k]))


class Sketch:
    """A scheme laid out on the paper, in units of its own; one that is ``moving`` shows no forces and coordinates."""

    def __init__(self, scheme: Scheme, moving: bool = False) -> None:
        self.scheme, self.moving = scheme, moving
        n = len(scheme.masses)
        self.zones: list[list[Link]] = [[] for _ in range(n + 1)]
        self.above: list[Link] = []
        self.below: dict[int, Link] = {}
        for link in sorted(scheme.links, key=lambda one: _ORDER.index(one.kind)):
            if link.kind == "friction" and link.left == GROUND:
                self.below[link.right] = link
            elif link.left == GROUND and link.kind in ("spring", "damper", "backlash", "preload"):
                last = n > 1 and link.right == n - 1
                self.zones[n if last else link.right].append(link)
            elif GROUND in (link.left, link.right):
                self.zones[link.right if link.left == GROUND else link.left + 1].append(link)
            elif link.right - link.left == 1:
                self.zones[link.right].append(link)
            else:
                self.above.append(link)
        self.tall = max(1.0, _LANE * max(map(len, self.zones)) + 0.1)
        self.left = 0.0 if self.zones[0] else _ZONE - 0.5
        self.faces = [_ZONE + i * (_WIDTH + _ZONE) for i in range(n)]  # left faces at rest
        self.right = self.faces[-1] + _WIDTH + (_ZONE if self.zones[-1] else 0.5)
        roof = 0.62 if scheme.forces else 0.36
        self.top = _FLOOR + self.tall + (0.15 if moving and not self.above else roof + 0.5 * len(self.above))
        self.bottom = -0.3 - (0.22 if any(link.words for link in self.below.values()) else 0.0)
        self.bottom -= (0.3 if scheme.base else 0.0) + 0.24 * len(scheme.others)
        self.width, self.height = self.right - self.left + 0.4, self.top - self.bottom + 0.1

    def frame(self, ax: Axes, room: float = 0.0) -> None:
        """Limits of the axes, which show nothing but the sketch; ``room`` more on both sides."""
        ax.set_xlim(self.left - 0.2 - room, self.right + 0.2 + room)
        ax.set_ylim(self.bottom - 0.05, self.top + 0.05)
        ax.set_aspect("equal")
        ax.axis("off")

    def scale_for(self, q: Any) -> float:
        """Length on the paper of one unit of a coordinate, for positions (instants, masses): no zone is crossed."""
        parted = np.diff(np.pad(np.nan_to_num(q), ((0, 0), (1, 1))), axis=1)
        largest = float(np.abs(parted).max(initial=0.0))
        gaps = [abs(one.gap) for one in self.scheme.links if np.isfinite(one.gap) and 0 < abs(one.gap) < 3 * largest]
        return float(min(0.5 / largest, 0.7 / max(gaps, default=largest))) * _ZONE if largest > 0 else 1.0

    def parts(
        self, moved: Sequence[float] | None = None, scale: float | None = None, time: float = 0.0, labels: bool = True
    ) -> list[Part]:
        """Its parts with the masses ``moved`` by so much on the paper at an instant; ``scale``: length on the paper of
        one unit of a coordinate, to which gaps are drawn then."""
        pen, self.time, self.scale = Pen(labels), time, scale
        self.now = [
            face + by
            for face, by in zip(self.faces, np.zeros(len(self.faces)) if moved is None else moved, strict=True)
        ]
        self._ground(pen)
        for i, face in enumerate(self.now):
            self._mass(pen, i, face)
        for z, zone in enumerate(self.zones):
            for k, link in enumerate(zone):
                self._link(pen, z, link, self._lane(zone, k))
        for k, link in enumerate(self.above):
            y = _FLOOR + self.tall + (0.8 if self.scheme.forces else 0.46) + 0.45 * k
            first, last = (self.now[i] + 0.25 * _WIDTH for i in (link.left, link.right))
            for x in (first, last):
                pen.path(0, x, _FLOOR + self.tall, x, y)
            self._between(pen, link, first, last, y, _WIDTH + _ZONE)
        for k, words in enumerate(reversed(self.scheme.others)):
            pen.text(self.left, self.bottom + 0.24 * k, words, ha="left", va="bottom", plain=True)
        return pen.made

    def _lane(self, zone: list[Link], k: int) -> float:
        """The height of the k-th link of a zone."""
        return _FLOOR + self.tall * (1 - (k + 0.5) / len(zone))

    # What stands still

    def _ground(self, pen: Pen) -> None:
        high = _FLOOR + self.tall + 0.1
        belts = [self.faces[i] for i, link in self.below.items() if link.words]
        edges = [self.left, *[x for face in belts for x in (face - 0.3, face + _WIDTH + 0.3)], self.right]
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            pen.path(0, a, 0, b, 0, width=1.2)
            pen.hatch(a, b, 0.0)
        for side, x in ((-1, self.left), (1, self.right)):
            if self.zones[0 if side < 0 else -1]:
                pen.path(0, x, 0, x, high, width=1.2)
                pen.hatch(0.0, high, x, upright=side)
        if self.scheme.base:
            y = self.bottom + 0.24 * len(self.scheme.others) + 0.22
            pen.arrow(self.left + 0.1, self.left + 0.9, y, both=True)
            pen.text(self.left + 1.0, y, self.scheme.base, ha="left")
        for z, zone in enumerate(self.zones[1:-1], 1):
            grounded = [k for k, link in enumerate(zone) if GROUND in (link.left, link.right)]
            if grounded:
                x = self._anchor(z)
                pen.path(0, x, 0, x, self._lane(zone, grounded[0]) + 0.14, width=2.2)

    def _anchor(self, z: int) -> float:
        """The place of the ground in a zone: a wall, or a post with room beside it."""
        if z in (0, len(self.faces)):
            return self.right if z else self.left
        held = {link.left == GROUND for link in self.zones[z] if GROUND in (link.left, link.right)}
        return self.faces[z] - (0.5 if len(held) > 1 else 0.68 if True in held else 0.32) * _ZONE

    def _mass(self, pen: Pen, i: int, x: float) -> None:
        pen.box(x, _FLOOR, _WIDTH, self.tall, "#DCE6EE")
        middle, top = x + 0.5 * _WIDTH, _FLOOR + self.tall
        pen.text(middle, _FLOOR + 0.5 * self.tall, self.scheme.masses[i], size=1.25)
        rubs = self.below.get(i)
        if rubs is None:
            for at in (0.25, 0.75):
                pen.circle(x + at * _WIDTH, 0.5 * _FLOOR, 0.5 * _FLOOR)
        else:
            pen.box(x + 0.15 * _WIDTH, 0.0, 0.7 * _WIDTH, _FLOOR, PALE)
            pen.text(middle, 0.5 * _FLOOR, rubs.label, size=0.9)
            if rubs.words:
                pen.belt(self.faces[i] - 0.2, self.faces[i] + _WIDTH + 0.2, rubs.words)
        if not self.moving:
            pen.path(top, middle, 0.06, middle, 0.26, color=GREY)
            pen.arrow(middle, middle + 0.38, top + 0.16, color=GREY)
            pen.text(middle + 0.43, top + 0.16, latex_name(self.scheme.pairs[i][0]), ha="left")
            if force := self.scheme.forces.get(i):
                pen.arrow(middle - 0.2, middle + 0.34, top + 0.46, color=_FORCE, heavy=True)
                pen.text(middle + 0.42, top + 0.46, force, ha="left", color=_FORCE)

    # What joins

    def _link(self, pen: Pen, z: int, link: Link, y: float) -> None:
        """A link in a zone, between two faces or a face and the ground."""
        near = self.now[z - 1] + _WIDTH if z else self.left
        far = self.now[z] if z < len(self.now) else self.right
        if GROUND not in (link.left, link.right):
            self._between(pen, link, near, far, y, _ZONE)
        elif link.kind in ("stop", "elastic"):
            on_right = link.right == GROUND  # of the mass
            face, rest = (near, self.faces[z - 1] + _WIDTH) if on_right else (far, self.faces[z])
            self._pad(pen, link, face, rest, self._anchor(z), y, _ZONE)
        else:
            ends = (near, self._anchor(z)) if z == len(self.now) else (self._anchor(z), far)
            self._between(pen, link, *ends, y, _ZONE)

    def _between(self, pen: Pen, link: Link, left: float, right: float, y: float, rest: float) -> None:
        words = link.label
        match link.kind:
            case "spring" | "preload":
                pen.spring(left, right, y, words, boxed=link.kind == "preload")
            case "damper":
                pen.damper(left, right, y, words)
            case "friction":
                pen.slider(left, right, y, words)
            case "backlash":
                half = 0.16 if self.scale is None else min(0.6 * rest, self.scale * link.half)
                pen.play(left, right, y, half, rest, words, link.words and rf"\pm {link.words}")
            case _ if link.pulls:
                pen.catch(left, right, y, rest, self._room(link, rest), link.words or words)
            case _:
                self._pad(pen, link, left, right - rest, right, y, rest)

    def _pad(self, pen: Pen, link: Link, face: float, at: float, ground: float, y: float, rest: float) -> None:
        sign = 1.0 if ground > at else -1.0
        pad = at + sign * self._room(link, rest)
        pad = sign * max(sign * pad, sign * face) if link.kind == "elastic" else pad
        pen.pad(face, pad, ground, y, link, always=not self.moving)

    def _room(self, link: Link, rest: float) -> float:
        gap = link.gap if link.gap_at is None else float(link.gap_at(self.time))
        if self.scale is not None and np.isfinite(gap):
            return float(np.clip(self.scale * gap, -0.7 * rest, 0.8 * rest))
        return 0.0 if gap <= 0 else _GAP
