"""Texts of kernel files joined into one module, with sizes of a system as constants: the marches of both steppers.

A stepper, the loop and an observer are written once, each in its file. What one of them calls in another is found by
name in the joined text, so each can stand beside any of its siblings, and every inner loop has constant bounds (a
factor of two).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from types import ModuleType

from nonsmooth.kernels.compile.cache import load_module

_ROOM = Path(__file__).parents[1]
#: Files that name a place others can take: what is imported of them is in the joined text under the same name.
PLACES = ("linear.stepper", "linear.extremes", "linear.touches", "linear.growth")


def joined(parts: Iterable[str], absent: Iterable[str] = ()) -> str:
    """The text of some kernel files (``hybrid.loop``, ...) in one, without what they import of each other.

    Imports from ``absent`` files are left out too."""
    parts = tuple(parts)
    text = "\n".join(_ROOM.joinpath(*part.split(".")).with_suffix(".py").read_text(encoding="utf-8") for part in parts)
    own = "|".join(re.escape(part) for part in {*parts, *PLACES, *absent})
    return re.sub(rf"^from nonsmooth\.kernels\.(?:{own}) import (\([^)]*\).*|[^(\n]*)$", "", text, flags=re.MULTILINE)


def with_numbers(text: str, numbers: Mapping[str, int]) -> str:
    """The text with other numbers in its lines ``NAME = 0``."""
    for name, number in numbers.items():
        text, found = re.subn(rf"^{name} = \d+\b", f"{name} = {number}", text, flags=re.MULTILINE)
        assert found == 1, name
    return text


LINEAR_STEPPER = (
    "linear.tables",
    "linear.bands",
    "linear.build",
    "linear.polynomial",
    "linear.values",
    "linear.search",
    "linear.limits",
    "linear.stepper",
    "hybrid.loop",
)
OBSERVERS = ("hybrid.sections", "hybrid.record", "hybrid.growth", "hybrid.observers", "hybrid.run")
LINEAR_OBSERVERS = ("linear.extremes", "linear.touches", "linear.growth", *OBSERVERS)


@cache
def linear_module(planar: bool = False) -> ModuleType:
    """The module with ``run`` for the exact flow: of two states, all in every mode, with one harmonic; else of any
    number of them, and with ``stand``, which adds modes to tables."""
    text = joined((*LINEAR_STEPPER, *LINEAR_OBSERVERS, *(() if planar else ("linear.modes",))))
    return load_module(with_numbers(text, {"STATES": 2 if planar else 0}), "linear_planar" if planar else "linear")


SERIES_STEPPER = ("series.step", "series.watch", "series.instant", "series.stepper", "hybrid.loop")
SERIES_OBSERVERS = ("series.growth", *OBSERVERS)


@cache
def series_module() -> ModuleType:
    """The module with ``run`` for the series, for both methods."""
    return load_module(joined((*SERIES_STEPPER, *SERIES_OBSERVERS)), "series")
