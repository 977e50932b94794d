"""The sketch of a mechanical system: masses on a line, springs, dampers, stops with gaps, friction, belts, base."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.parts import GROUND, Link, Scheme
from nonsmooth.system.parameter import latex_name

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from nonsmooth.system.system import System

__all__ = ["Part", "Sketch", "mechanism", "put", "sketch_of_run"]

#: ``("line", x, y, color, width, fill)``, filled where a colour is given, or ``("text", x, y, words, color, size, ha,
#: va)``.
Part = tuple[Any, ...]

_WIDTH, _ZONE, _FLOOR = 1.1, 1.75, 0.2  # of a mass, between two of them, below them
_LANE = 0.44  # height that one link takes
_GAP = 0.32  # of a contact in a sketch that is not to scale
_ORDER = ("spring", "preload", "damper", "backlash", "friction", "stop", "elastic")  # from above
_DARK, _GREY, _PAPER = style.COLORS["section"], style.COLORS["muted"], "#FFFFFF"
_STOP, _RUB, _FORCE = (style.COLORS[name] for name in ("second", "fourth", "first"))
_PALE = f"{_RUB}8C"  # what rubs


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
    q = np.stack([run["u"].sel(state=name).values for name in sketch.scheme.coordinates], axis=1)
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
            pen.box(x + 0.15 * _WIDTH, 0.0, 0.7 * _WIDTH, _FLOOR, _PALE)
            pen.text(middle, 0.5 * _FLOOR, rubs.label, size=0.9)
            if rubs.words:
                pen.belt(self.faces[i] - 0.2, self.faces[i] + _WIDTH + 0.2, rubs.words)
        if not self.moving:
            pen.path(top, middle, 0.06, middle, 0.26, color=_GREY)
            pen.arrow(middle, middle + 0.38, top + 0.16, color=_GREY)
            pen.text(middle + 0.43, top + 0.16, latex_name(self.scheme.coordinates[i]), ha="left")
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


class Pen:
    """Parts of a sketch as data, made of lines and words: :func:`put` draws them."""

    def __init__(self, labels: bool = True) -> None:
        self.labels, self.made = labels, list[Part]()

    def path(self, y: float, *places: float, color: str = _DARK, width: float = 0.9, fill: str = "") -> None:
        """A line through places, each by its abscissa and its height above y; a filled shape where it has a colour."""
        self.made.append(("line", places[::2], [y + high for high in places[1::2]], color, width, fill))

    def text(
        self,
        x: float,
        y: float,
        words: str,
        color: str = _DARK,
        size: float = 1.0,
        ha: str = "center",
        va: str = "center",
        plain: bool = False,
    ) -> None:
        if self.labels and words:
            self.made.append(("text", x, y, words if plain else f"${words}$", color, size, ha, va))

    def box(self, x: float, y: float, width: float, height: float, fill: str) -> None:
        self.path(y, x, 0, x + width, 0, x + width, height, x, height, x, 0, fill=fill)

    def circle(self, x: float, y: float, radius: float) -> None:
        turn = np.linspace(0, 2 * np.pi, 21)
        self.path(y, *np.stack([x + radius * np.cos(turn), radius * np.sin(turn)], axis=1).ravel(), fill=_PAPER)

    def arrow(self, a: float, b: float, y: float, color: str = _DARK, both: bool = False, heavy: bool = False) -> None:
        width, size = (1.3, 0.12) if heavy else (0.8, 0.09)
        way, high = size if b > a else -size, 0.4 * size
        ends = [(b, b - way), (a, a + way)][: 1 + both]
        self.path(y, ends[1][1] if both else a, 0, b - way, 0, color=color, width=width)
        for tip, back in ends:
            self.path(y, tip, 0, back, high, back, -high, tip, 0, color=color, width=0.5, fill=color)

    def hatch(self, a: float, b: float, at: float, upright: int = 0) -> None:
        """Strokes behind a line of the ground: below it, or to the left (-1) or right (1) of an upright one."""
        places = np.arange(a + 0.08, b + 1e-9, 0.13)
        gone = np.full(len(places), np.nan)
        one = np.stack([places, places - 0.1, gone], axis=1).ravel()
        other = np.tile([at, at + (0.1 * upright or -0.1), np.nan], len(places))
        self.made.append(("line", *((other, one) if upright else (one, other)), _GREY, 0.6, ""))

    def belt(self, a: float, b: float, words: str) -> None:
        for x in (a, b):
            self.circle(x, -0.12, 0.12)
        for y in (0.0, -0.24):
            self.path(y, a, 0, b, 0, width=1.4)
        middle = 0.5 * (a + b)
        self.arrow(middle - 0.3, middle + 0.3, -0.12, color=_RUB, heavy=True)
        self.text(middle, -0.28, words, va="top")

    def spring(
        self, a: float, b: float, y: float, words: str = "", boxed: bool = False, color: str = _DARK, high: float = 0.1
    ) -> None:
        a, b = min(a, b), max(a, b)
        end = min(0.18, 0.15 * (b - a))
        zigzag = [0.0, *(high * (-1) ** k for k in range(12)), 0.0]
        inner = [one for pair in zip(np.linspace(a + end, b - end, 14), zigzag, strict=True) for one in pair]
        self.path(y, a, 0, *inner, b, 0, color=color)
        if boxed:
            low, far = a + end, b - end
            self.path(y, low, -0.15, low, 0.15, far, 0.15, far, -0.15, low, -0.15)
        self.text(0.5 * (a + b), y + (0.19 if boxed else 0.13), words, va="bottom")

    def damper(self, a: float, b: float, y: float, words: str = "", color: str = _DARK, high: float = 0.11) -> None:
        a, b = min(a, b), max(a, b)
        middle, half = 0.5 * (a + b), 0.2 * min(1.0, b - a)
        end = middle + half
        self.path(y, a, 0, middle, 0, color=color)
        self.path(y, middle, -0.7 * high, middle, 0.7 * high, color=color, width=1.6)
        self.path(y, middle - half, high, end, high, end, -high, middle - half, -high, color=color)
        self.path(y, end, 0, b, 0, color=color)
        self.text(middle, y + 0.13, words, va="bottom")

    def slider(self, a: float, b: float, y: float, words: str) -> None:
        """Friction between two masses: a block on a rod between two plates."""
        middle = 0.5 * (a + b)
        end = middle + 0.36
        self.path(y, a, 0, middle - 0.16, 0)
        self.box(middle - 0.16, y - 0.07, 0.32, 0.14, _PALE)
        self.path(y, middle - 0.3, -0.1, end, -0.1, end, 0.1, middle - 0.3, 0.1, width=1.4)
        self.path(y, end, 0, b, 0)
        self.text(middle, y + 0.13, words, va="bottom")

    def play(self, a: float, b: float, y: float, half: float, rest: float, words: str, room: str) -> None:
        """A pin in a fork with a spring behind: it pushes only where the pin has gone through the play."""
        pin = a + 0.3 * rest  # at rest in the middle of the fork
        fork = b - 0.7 * rest
        fork += pin - fork - np.clip(pin - fork, -half, half)
        low, far = fork - half - 0.03, fork + half + 0.03
        self.path(y, a, 0, pin, 0)
        for x, foot, top in ((pin, -0.1, 0.1), (low, -0.14, -0.04), (far, -0.14, -0.04)):
            self.path(y, x, foot, x, top, color=_STOP, width=1.8)
        self.path(y, low, -0.14, far, -0.14, far, 0, color=_STOP)
        self.spring(far, b, y, words)
        self.text(fork, y + 0.13, room, va="bottom")

    def catch(self, a: float, b: float, y: float, rest: float, gap: float, words: str) -> None:
        """A hook on each mass: they meet where the masses have parted by the gap."""
        hook, pin = a + 0.6 * rest, b - 0.4 * rest - gap
        for end, at, rod, tip in ((a, hook, 0.1, -0.02), (b, pin, -0.1, 0.03)):
            self.path(y, end, rod, at, rod, color=_STOP)
            self.path(y, at, rod, at, tip, color=_STOP, width=2.2)
        if gap > 0.1:
            self.text(0.5 * (hook + pin), y - 0.13, words, va="top")

    def pad(self, face: float, pad: float, ground: float, y: float, link: Link, always: bool) -> None:
        """A stop by its pad, on a rod, or on a spring (and a damper) where it is elastic; with its gap."""
        sign = 1.0 if ground > pad else -1.0
        back = pad + 0.07 * sign
        self.box(min(pad, back), y - 0.13, 0.07, 0.26, _STOP)
        if link.kind == "stop":
            self.path(y, back, 0, ground, 0, color=_STOP, width=2.0)
            self.text(0.5 * (back + ground), y + 0.06, link.label, va="bottom")
        else:
            raised, high = (0.08, 0.05) if link.damped else (0.0, 0.1)
            self.spring(back, ground, y + raised, link.label, color=_STOP, high=high)
            if link.damped:
                self.damper(back, ground, y - 0.08, color=_STOP, high=0.06)
        room = abs(pad - face)
        if self.labels and room > 0.12 and (pad - face) * sign > 0:
            for x in (face, pad):
                self.path(y, x, -0.23, x, -0.13, color=_GREY, width=0.5)
            self.arrow(face, pad, y - 0.19, color=_GREY, both=True)
        if room > 0.12 or always:
            self.text(0.5 * (face + pad), y - 0.23, link.words, va="top", size=0.95)


def put(ax: Axes, parts: Iterable[Part]) -> list[Any]:
    """Draw parts of a sketch on axes; the artists are returned."""
    made: list[Any] = []
    for kind, x, y, *looks in parts:
        if kind == "text":
            words, color, size, ha, va = looks
            made.append(ax.text(x, y, words, color=color, fontsize=size * style.small(ax), ha=ha, va=va))
            continue
        color, width, fill = looks
        common: dict[str, Any] = {"linewidth": width, "clip_on": False, "zorder": 2}
        if fill:
            made += ax.fill(x, y, facecolor=fill, edgecolor=color, **common)
        else:
            made += ax.plot(x, y, "-", color=color, solid_capstyle="butt", **common)
    return made
