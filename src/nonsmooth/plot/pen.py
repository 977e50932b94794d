"""Masses on a line and what joins them; the pen that makes parts of their sketch, and its drawing on axes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style

GROUND = -1


@dataclass(frozen=True)
class Link:
    """A spring, a contact, ... between two masses, or the ground and a mass: ``left`` and ``right`` by their numbers.

    ``gap`` is the room of a contact at rest (``gap_at`` that of a stop that moves, by the time), ``words`` its label;
    ``half`` the half width of a play; ``damped`` an elastic contact with a damper; ``pulls`` a contact that closes when
    its masses part."""

    kind: str
    left: int
    right: int
    label: str = ""
    gap: float = 0.0
    words: str = ""
    half: float = 0.0
    damped: bool = False
    pulls: bool = False
    gap_at: Callable[[float], float] | None = None


@dataclass
class Scheme:
    """Masses in order along the line, by their coordinates and speeds, with their labels; links; loads by mass."""

    pairs: list[tuple[str, str]]
    masses: list[str]
    links: list[Link] = field(default_factory=list)
    forces: dict[int, str] = field(default_factory=dict)
    base: str = ""
    others: list[str] = field(default_factory=list)


if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: ``("line", x, y, color, width, fill)``, filled where a colour is given, or ``("text", x, y, words, color, size, ha,
#: va)``.
Part = tuple[Any, ...]

_DARK, GREY, _PAPER = style.COLORS["section"], style.COLORS["muted"], "#FFFFFF"
_STOP, _RUB = style.COLORS["second"], style.COLORS["fourth"]
PALE = f"{_RUB}8C"  # what rubs


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
        self.made.append(("line", *((other, one) if upright else (one, other)), GREY, 0.6, ""))

    def belt(self, a: float, b: float, words: str) -> None:
        """A belt over two rollers, with its upper side at the height 0."""
        radius, middle = 0.12, 0.5 * (a + b)
        for x in (a, b):
            self.circle(x, -radius, radius)
        for y in (0.0, -2 * radius):
            self.path(y, a, 0, b, 0, width=1.4)
        self.arrow(middle - 0.3, middle + 0.3, -radius, color=_RUB, heavy=True)
        self.text(middle, -2 * radius - 0.04, words, va="top")

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
        self.box(middle - 0.16, y - 0.07, 0.32, 0.14, PALE)
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
                self.path(y, x, -0.23, x, -0.13, color=GREY, width=0.5)
            self.arrow(face, pad, y - 0.19, color=GREY, both=True)
        if room > 0.12 or always:
            self.text(0.5 * (face + pad), y - 0.23, link.words, va="top", size=0.95)


def put(ax: Axes, parts: Iterable[Part]) -> list[Any]:
    """Draw parts of a sketch on axes, whose limits stay; the artists are returned."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Polygon

    made: list[Any] = []
    for kind, x, y, *looks in parts:
        if kind == "text":
            words, color, size, ha, va = looks
            made.append(ax.text(x, y, words, color=color, fontsize=size * style.small(ax), ha=ha, va=va))
            continue
        color, width, fill = looks
        common: style.Properties = {"linewidth": width, "clip_on": False, "zorder": 2}
        if fill:
            one: Any = Polygon(np.column_stack([x, y]), facecolor=fill, edgecolor=color, **common)
        else:
            one = Line2D(x, y, color=color, solid_capstyle="butt", **common)
        made.append(ax.add_artist(one))
    return made
