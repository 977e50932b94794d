"""The kernels of the series methods, for one method."""

from __future__ import annotations

from functools import cache
from types import ModuleType

from nonsmooth.kernels.compile.assembly import joined, with_numbers
from nonsmooth.kernels.compile.cache import load_module
from nonsmooth.kernels.series.places import METHODS

STEPPER = ("series.step", "series.watch", "series.stepper", "hybrid.loop")
OBSERVERS = ("hybrid.sections", "hybrid.record", "hybrid.observers", "hybrid.run")


@cache
def series_module(method: str) -> ModuleType:
    """The module with ``run``.

    The method is a constant of the text: what another one needs is not in the way, nor compiled."""
    text = joined((*STEPPER, *OBSERVERS), absent=("hybrid.growth",))
    return load_module(with_numbers(text, {"METHOD": METHODS[method], "GROWS": 0}), f"series_{method}")
