"""Colours for numbers that are names: period numbers, attractors, modes."""

from __future__ import annotations

from collections.abc import Sequence
from colorsys import hls_to_rgb

from nonsmooth.plot.style import COLORS

#: Period numbers 1 ... 8, told apart by all common colour visions: light and dark alternate (after Paul Tol's schemes).
PERIODS = ("#DDDDDD", "#4477AA", "#EE6677", "#228833", "#CCBB44", "#66CCEE", "#AA3377", "#EE8866")
LONGER = "#8C6D31"
NO_PERIOD = "#000000"
UNKNOWN = "#FFFFFF"
DIVERGED = "#8C8C8C"

_ATTRACTORS = ("#88CCEE", "#CC6677", "#DDCC77", "#117733", "#332288", "#AA4499", "#44AA99", "#999933", "#882255")
_LINES = tuple(COLORS[name] for name in ("first", "second", "third", "fourth", "zone", "pale"))


def nth(k: int, own: Sequence[str] = _LINES) -> str:
    """The k-th colour of a list; behind its end hues advance by the golden angle, so that none comes again."""
    if k < len(own):
        return own[k]
    return "#" + "".join(f"{round(255 * part):02X}" for part in hls_to_rgb(0.618034 * k % 1, 0.3 + 0.12 * (k % 3), 0.7))


def attractor_color(number: int) -> str:
    """Colour of an attractor; white where there is none."""
    return UNKNOWN if number < 0 else nth(number, _ATTRACTORS)
