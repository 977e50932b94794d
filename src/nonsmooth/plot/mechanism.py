"""The sketch of a mechanical system: masses on a line, springs, dampers, stops with gaps, friction, belts, base."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.parts import GROUND, Link, Scheme

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from nonsmooth.system.system import System

__all__ = ["FLOOR", "Paper", "Pen", "Sketch", "mechanism"]

_WIDTH, _ZONE, FLOOR = 1.1, 1.75, 0.2  # of a mass, between two of them, below them
_LANE = 0.44  # height that one link takes
_GAP = 0.32  # of a contact in a sketch that is not to scale
_ORDER = ("spring", "preload", "damper", "backlash", "slider", "stop", "elastic")  # from above
_DARK, _GREY, _FILL = style.COLORS["section"], style.COLORS["muted"], "#DCE6EE"
_STOP, _RUB = style.COLORS["second"], style.COLORS["fourth"]


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
        sketch.draw(Paper(drawn, labels))
    return drawn


class Sketch:
    """A scheme laid out on the paper, in units of its own; it can be drawn with its masses displaced."""

    def __init__(self, scheme: Scheme) -> None:
        self.scheme = scheme
        n = len(scheme.masses)
        self.zones: list[list[Link]] = [[] for _ in range(n + 1)]
        self.above: list[Link] = []
        self.below: dict[int, Link] = {}
        for link in sorted(scheme.links, key=lambda one: _ORDER.index(_kind(one))):
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
        most = max(len(zone) for zone in self.zones)
        self.tall = max(1.0, _LANE * most + 0.1)
        self.left = 0.0 if self.zones[0] else _ZONE - 0.5
        self.faces = [_ZONE + i * (_WIDTH + _ZONE) for i in range(n)]  # left faces at rest
        self.right = self.faces[-1] + _WIDTH + (_ZONE if self.zones[-1] else 0.5)
        self.top = FLOOR + self.tall + (0.62 if scheme.forces else 0.36) + 0.5 * len(self.above)
        self.bottom = -0.3 - (0.22 if any(link.words for link in self.below.values()) else 0.0)
        self.bottom -= (0.3 if scheme.base else 0.0) + 0.24 * len(scheme.others)
        self.width, self.height = self.right - self.left + 0.4, self.top - self.bottom + 0.1
        self.time = 0.0

    def frame(self, ax: Axes, room: float = 0.0) -> None:
        """Limits of the axes, which show nothing but the sketch; ``room`` more on both sides."""
        ax.set_xlim(self.left - 0.2 - room, self.right + 0.2 + room)
        ax.set_ylim(self.bottom - 0.05, self.top + 0.05)
        ax.set_aspect("equal")
        ax.axis("off")

    def scale_for(self, q: Any) -> float:
        """Length on the paper of one unit of a coordinate, for positions (instants, masses): no zone is crossed."""
        parted = np.diff(np.pad(q, ((0, 0), (1, 1))), axis=1)
        largest = float(np.abs(parted).max(initial=0.0))
        gaps = [abs(one.gap) for one in self.scheme.links if np.isfinite(one.gap) and 0 < abs(one.gap) < 3 * largest]
        return float(min(0.5 / largest, 0.7 / max(gaps, default=largest))) * _ZONE if largest > 0 else 1.0

    def draw(
        self, pen: Pen, moved: Sequence[float] | None = None, scale: float | None = None, time: float = 0.0
    ) -> None:
        """Draw it with the masses ``moved`` by so much on the paper at an instant; ``scale``: length on the paper of
        one unit of a coordinate, to which gaps are drawn then."""
        pen.moving, self.time = moved is not None, time
        shift = np.zeros(len(self.faces)) if moved is None else np.asarray(moved, dtype=float)
        self._ground(pen)
        for i, face in enumerate(self.faces):
            self._mass(pen, i, face + shift[i])
        for z, zone in enumerate(self.zones):
            for k, link in enumerate(zone):
                y = FLOOR + self.tall * (1 - (k + 0.5) / len(zone))
                self._link(pen, z, link, y, shift, scale)
        for k, link in enumerate(self.above):
            y = FLOOR + self.tall + (0.8 if self.scheme.forces else 0.46) + 0.45 * k
            first, last = (self.faces[i] + shift[i] + 0.25 * _WIDTH for i in (link.left, link.right))
            for x in (first, last):
                pen.line([x, x], [FLOOR + self.tall, y])
            self._between(pen, link, first, last, y, _WIDTH + _ZONE, scale)
        for k, words in enumerate(self.scheme.others):
            pen.text(self.left, self.bottom + 0.24 * (len(self.scheme.others) - 1 - k), words, ha="left", va="bottom")

    # What stands still

    def _ground(self, pen: Pen) -> None:
        high = FLOOR + self.tall + 0.1
        belts = [self.faces[i] for i, link in self.below.items() if link.words]
        edges = [self.left, *[x for face in belts for x in (face - 0.3, face + _WIDTH + 0.3)], self.right]
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            pen.line([a, b], [0, 0], width=1.2)
            pen.hatch(a, b, 0.0)
        for side, x in ((-1, self.left), (1, self.right)):
            if self.zones[0 if side < 0 else -1]:
                pen.line([x, x], [0, high], width=1.2)
                pen.hatch(0.0, high, x, upright=side)
        if self.scheme.base:
            y = self.bottom + 0.24 * len(self.scheme.others) + 0.22
            pen.arrow(self.left + 0.1, self.left + 0.9, y, both=True)
            pen.text(self.left + 1.0, y, f"${self.scheme.base}$", ha="left")
        for z, zone in enumerate(self.zones):
            grounded = [k for k, link in enumerate(zone) if GROUND in (link.left, link.right)]
            if 0 < z < len(self.zones) - 1 and grounded:
                x = self._anchor(z)
                pen.line([x, x], [0, FLOOR + self.tall * (1 - (grounded[0] + 0.5) / len(zone)) + 0.14], width=2.2)

    def _anchor(self, z: int) -> float:
        """The place of the ground in a zone: a wall, or a post with room beside it."""
        if z == 0:
            return self.left
        if z == len(self.faces):
            return self.right
        held = {link.left == GROUND for link in self.zones[z] if GROUND in (link.left, link.right)}
        return self.faces[z] - (0.5 if len(held) > 1 else 0.68 if True in held else 0.32) * _ZONE

    def _mass(self, pen: Pen, i: int, x: float) -> None:
        pen.box(x, FLOOR, _WIDTH, self.tall, _FILL)
        middle, top = x + 0.5 * _WIDTH, FLOOR + self.tall
        if self.scheme.masses[i]:
            pen.text(middle, FLOOR + 0.5 * self.tall, f"${self.scheme.masses[i]}$", size=1.25)
        rubs = self.below.get(i)
        if rubs is None:
            for at in (0.25, 0.75):
                pen.circle(x + at * _WIDTH, 0.5 * FLOOR, 0.5 * FLOOR)
        else:
            pen.box(x + 0.15 * _WIDTH, 0.0, 0.7 * _WIDTH, FLOOR, _RUB, alpha=0.55)
            if rubs.label:
                pen.text(middle, 0.5 * FLOOR, f"${rubs.label}$", size=0.9)
            if rubs.words:
                pen.belt(self.faces[i] - 0.2, self.faces[i] + _WIDTH + 0.2, f"${rubs.words}$")
        if not pen.moving:
            pen.line([middle, middle], [top + 0.06, top + 0.26], color=_GREY)
            pen.arrow(middle, middle + 0.38, top + 0.16, color=_GREY)
            pen.text(middle + 0.43, top + 0.16, f"${_symbol(self.scheme.coordinates[i])}$", ha="left")
        if (force := self.scheme.forces.get(i)) and not pen.moving:
            pen.arrow(middle - 0.2, middle + 0.34, top + 0.46, color=style.COLORS["first"], heavy=True)
            pen.text(middle + 0.42, top + 0.46, f"${force}$", ha="left", color=style.COLORS["first"])

    # What joins

    def _link(self, pen: Pen, z: int, link: Link, y: float, shift: Any, scale: float | None) -> None:
        """A link in a zone, between two faces or a face and the ground."""
        near = self.faces[z - 1] + _WIDTH + shift[z - 1] if z else self.left
        far = self.faces[z] + shift[z] if z < len(self.faces) else self.right
        n = len(self.faces)
        if GROUND not in (link.left, link.right):
            self._between(pen, link, near, far, y, _ZONE, scale)
        elif link.kind in ("stop", "elastic"):
            on_right = link.right == GROUND  # of the mass
            face, rest = (near, self.faces[z - 1] + _WIDTH) if on_right else (far, self.faces[z])
            self._pad(pen, link, face, rest, self._anchor(z), y, scale)
        else:
            left, right = (near, self._anchor(z)) if z == n else (self._anchor(z), far)
            self._between(pen, link, left, right, y, _ZONE, scale)

    def _between(
        self, pen: Pen, link: Link, left: float, right: float, y: float, rest: float, scale: float | None
    ) -> None:
        words = f"${link.label}$" if link.label else ""
        match link.kind:
            case "spring":
                pen.spring(left, right, y, words)
            case "preload":
                pen.spring(left, right, y, words, boxed=True)
            case "damper":
                pen.damper(left, right, y, words)
            case "friction":
                pen.slider(left, right, y, words)
            case "backlash":
                half = 0.16 if scale is None else min(0.6 * rest, scale * link.half)
                pen.play(left, right, y, half, rest, words, f"$\\pm {link.words}$" if link.words else "")
            case "stop" | "elastic" if link.pulls:
                gap = self._room(link, rest, scale)
                pen.catch(left, right, y, rest, gap, f"${link.words}$" if link.words else words)
            case "stop" | "elastic":
                face, pad = left, right - rest + self._room(link, rest, scale)
                pen.pad(face, max(face, pad) if link.kind == "elastic" else pad, right, y, link)

    def _pad(
        self, pen: Pen, link: Link, face: float, rest: float, ground: float, y: float, scale: float | None
    ) -> None:
        sign = 1.0 if ground > rest else -1.0
        pad = rest + sign * self._room(link, _ZONE, scale)
        if link.kind == "elastic":
            pad = sign * max(sign * pad, sign * face)
        pen.pad(face, pad, ground, y, link)

    def _room(self, link: Link, rest: float, scale: float | None) -> float:
        gap = link.gap if link.gap_at is None else float(link.gap_at(self.time))
        if scale is not None and np.isfinite(gap):
            return float(np.clip(scale * gap, -0.7 * rest, 0.8 * rest))
        return 0.0 if gap <= 0 else _GAP


def _kind(link: Link) -> str:
    return "slider" if link.kind == "friction" else link.kind


def _symbol(name: str) -> str:
    from nonsmooth.system.parameter import latex_name

    return latex_name(name)


class Pen:
    """Parts of a sketch, made of lines, boxes, circles, arrows and words, which each kind of paper draws its own way."""

    labels = True
    moving = False

    def line(self, x: Any, y: Any, color: str = _DARK, width: float = 0.9) -> None:
        raise NotImplementedError

    def words(self, x: float, y: float, words: str, color: str, size: float, ha: str, va: str) -> None:
        raise NotImplementedError

    def box(self, x: float, y: float, width: float, height: float, fill: str, alpha: float = 1.0) -> None:
        raise NotImplementedError

    def circle(self, x: float, y: float, radius: float) -> None:
        raise NotImplementedError

    def arrow(self, a: float, b: float, y: float, color: str = _DARK, both: bool = False, heavy: bool = False) -> None:
        raise NotImplementedError

    def text(
        self, x: float, y: float, words: str, color: str = _DARK, size: float = 1.0, ha: str = "center",
        va: str = "center",
    ) -> None:  # fmt: skip
        if self.labels and words:
            self.words(x, y, words, color, size, ha, va)

    def hatch(self, a: float, b: float, at: float, upright: int = 0) -> None:
        """Strokes behind a line of the ground: below it, or to the left (-1) or right (1) of an upright one."""
        places = np.arange(a + 0.08, b + 1e-9, 0.13)
        gone = np.full(len(places), np.nan)
        one = np.stack([places, places - 0.1, gone], axis=1).ravel()
        other = np.stack([np.full(len(places), at), np.full(len(places), at + (0.1 * upright or -0.1)), gone], axis=1)
        self.line(*((other.ravel(), one) if upright else (one, other.ravel())), color=_GREY, width=0.6)

    def belt(self, a: float, b: float, words: str) -> None:
        for x in (a, b):
            self.circle(x, -0.12, 0.12)
        for y in (0.0, -0.24):
            self.line([a, b], [y, y], width=1.4)
        middle = 0.5 * (a + b)
        self.arrow(middle - 0.3, middle + 0.3, -0.12, color=_RUB, heavy=True)
        self.text(middle, -0.28, words, va="top")

    def spring(
        self, a: float, b: float, y: float, words: str = "", boxed: bool = False, color: str = _DARK, high: float = 0.1
    ) -> None:
        a, b = min(a, b), max(a, b)
        end = min(0.18, 0.15 * (b - a))
        x = np.linspace(a + end, b - end, 14)
        zigzag = np.r_[0.0, [high * (-1) ** k for k in range(12)], 0.0]
        self.line(np.r_[a, x, b], y + np.r_[0.0, zigzag, 0.0], color=color)
        if boxed:
            self.line(np.r_[a, b, b, a, a][[0, 0]] + end, [y - 0.15, y + 0.15])
            for sign in (-1, 1):
                self.line([a + end, b - end], [y + 0.15 * sign] * 2)
            self.line([b - end] * 2, [y - 0.15, y + 0.15])
        self.text(0.5 * (a + b), y + (0.19 if boxed else 0.13), words, va="bottom")

    def damper(self, a: float, b: float, y: float, words: str = "", color: str = _DARK, high: float = 0.11) -> None:
        a, b = min(a, b), max(a, b)
        middle, half = 0.5 * (a + b), 0.2 * min(1.0, b - a)
        self.line([a, middle], [y, y], color=color)
        self.line([middle, middle], [y - 0.7 * high, y + 0.7 * high], color=color, width=1.6)
        mouth, end = middle - half, middle + half
        self.line([mouth, end, end, mouth], [y + high, y + high, y - high, y - high], color=color)
        self.line([middle + half, b], [y, y], color=color)
        self.text(middle, y + 0.13, words, va="bottom")

    def slider(self, a: float, b: float, y: float, words: str) -> None:
        """Friction between two masses: a block on a rod between two plates."""
        middle = 0.5 * (a + b)
        self.line([a, middle - 0.16], [y, y])
        self.box(middle - 0.16, y - 0.07, 0.32, 0.14, _RUB, alpha=0.55)
        for sign in (-1, 1):
            self.line([middle - 0.3, middle + 0.36], [y + 0.1 * sign] * 2, width=1.4)
        self.line([middle + 0.36] * 2, [y - 0.1, y + 0.1], width=1.4)
        self.line([middle + 0.36, b], [y, y])
        self.text(middle, y + 0.13, words, va="bottom")

    def play(self, a: float, b: float, y: float, half: float, rest: float, words: str, room: str) -> None:
        """A pin in a fork with a spring behind: it pushes only where the pin has gone through the play."""
        pin = a + 0.3 * rest  # at rest in the middle of the fork
        fork = b - 0.7 * rest
        fork += pin - fork - np.clip(pin - fork, -half, half)
        self.line([a, pin], [y, y])
        self.line([pin, pin], [y - 0.1, y + 0.1], color=_STOP, width=1.8)
        for sign in (-1, 1):
            self.line([fork + sign * (half + 0.03)] * 2, [y - 0.14, y - 0.04], color=_STOP, width=1.8)
        self.line([fork - half - 0.03, fork + half + 0.03], [y - 0.14] * 2, color=_STOP)
        self.line([fork + half + 0.03] * 2, [y - 0.14, y], color=_STOP)
        self.spring(fork + half + 0.03, b, y, words)
        self.text(fork, y + 0.13, room, va="bottom")

    def catch(self, a: float, b: float, y: float, rest: float, gap: float, words: str) -> None:
        """A hook on each mass: they meet where the masses have parted by the gap."""
        hook, pin = a + 0.6 * rest, b - 0.4 * rest - gap
        self.line([a, hook], [y + 0.1] * 2, color=_STOP)
        self.line([hook] * 2, [y - 0.02, y + 0.1], color=_STOP, width=2.2)
        self.line([pin, b], [y - 0.1] * 2, color=_STOP)
        self.line([pin] * 2, [y - 0.1, y + 0.03], color=_STOP, width=2.2)
        if gap > 0.1:
            self.text(0.5 * (hook + pin), y - 0.13, words, va="top")

    def pad(self, face: float, pad: float, ground: float, y: float, link: Link) -> None:
        """A stop by its pad, on a rod, or on a spring (and a damper) where it is elastic; with its gap."""
        sign = 1.0 if ground > pad else -1.0
        back = pad + 0.07 * sign
        self.box(min(pad, back), y - 0.13, 0.07, 0.26, _STOP)
        words = f"${link.label}$" if link.label else ""
        if link.kind == "stop":
            self.line([back, ground], [y, y], color=_STOP, width=2.0)
            self.text(0.5 * (back + ground), y + 0.06, words, va="bottom")
        elif link.damped:
            self.spring(back, ground, y + 0.08, words, color=_STOP, high=0.05)
            self.damper(back, ground, y - 0.08, color=_STOP, high=0.06)
        else:
            self.spring(back, ground, y, words, color=_STOP)
        room = abs(pad - face)
        if self.labels and room > 0.12 and (pad - face) * sign > 0:
            low = y - 0.19
            for x in (face, pad):
                self.line([x, x], [low - 0.04, y - 0.13], color=_GREY, width=0.5)
            self.arrow(face, pad, low, color=_GREY, both=True)
        if link.words and (room > 0.12 or not self.moving):
            self.text(0.5 * (face + pad), y - 0.23, f"${link.words}$", va="top", size=0.95)


class Paper(Pen):
    """Draws on axes, and keeps what it has drawn."""

    def __init__(self, ax: Axes, labels: bool = True) -> None:
        self.ax, self.labels, self.made = ax, labels, list[Any]()

    def line(self, x: Any, y: Any, color: str = _DARK, width: float = 0.9) -> None:
        self.made += self.ax.plot(x, y, "-", color=color, linewidth=width, solid_capstyle="butt", clip_on=False)

    def words(self, x: float, y: float, words: str, color: str, size: float, ha: str, va: str) -> None:
        size *= style.small(self.ax)
        self.made.append(self.ax.text(x, y, words, color=color, fontsize=size, ha=ha, va=va))

    def box(self, x: float, y: float, width: float, height: float, fill: str, alpha: float = 1.0) -> None:
        from matplotlib.patches import Rectangle

        looks: dict[str, Any] = {"edgecolor": _DARK, "linewidth": 0.9, "alpha": alpha}
        self.made.append(self.ax.add_patch(Rectangle((x, y), width, height, facecolor=fill, **looks)))

    def circle(self, x: float, y: float, radius: float) -> None:
        from matplotlib.patches import Circle

        self.made.append(self.ax.add_patch(Circle((x, y), radius, facecolor="white", edgecolor=_DARK, linewidth=0.9)))

    def arrow(self, a: float, b: float, y: float, color: str = _DARK, both: bool = False, heavy: bool = False) -> None:
        looks = {"arrowstyle": "<|-|>" if both else "-|>", "color": color, "shrinkA": 0, "shrinkB": 0,
                 "linewidth": 1.3 if heavy else 0.8, "mutation_scale": 8 if heavy else 6}  # fmt: skip
        self.made.append(self.ax.annotate("", (b, y), (a, y), arrowprops=looks, annotation_clip=False))
