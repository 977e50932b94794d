"""Colours for numbers that are names: period numbers and attractors."""

from __future__ import annotations

#: Period numbers 1 ... 8, told apart by all common colour visions: light and dark alternate (after Paul Tol's schemes).
PERIODS = ("#DDDDDD", "#4477AA", "#EE6677", "#228833", "#CCBB44", "#66CCEE", "#AA3377", "#EE8866")
LONGER = "#8C6D31"
NO_PERIOD = "#000000"
UNKNOWN = "#FFFFFF"
DIVERGED = "#8C8C8C"

_ATTRACTORS = ("#88CCEE", "#CC6677", "#DDCC77", "#117733", "#332288", "#AA4499", "#44AA99", "#999933", "#882255")


def attractor_color(number: int) -> str:
    """Colour of an attractor; white where there is none. Colours come again after nine."""
    return UNKNOWN if number < 0 else _ATTRACTORS[number % len(_ATTRACTORS)]
