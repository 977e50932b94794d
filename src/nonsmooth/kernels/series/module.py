"""The kernels of the series methods, for one observer and one method."""

from __future__ import annotations

from functools import cache
from types import ModuleType

from nonsmooth.kernels.compile.assembly import joined, with_numbers
from nonsmooth.kernels.compile.cache import load_module
from nonsmooth.kernels.series.places import METHODS

__all__ = ["METHODS", "OBSERVERS", "series_module"]

STEPPER = ("series.step", "series.watch", "series.stepper", "hybrid.loop")
OBSERVERS = {"sections": ("hybrid.sections",), "record": ("hybrid.every_step", "hybrid.record")}


@cache
def series_module(observer: str, method: str) -> ModuleType:
    """The module with ``chain`` (sections) or ``record``.

    The method is a constant of the text: what another one needs is not in the way, nor compiled."""
    text = with_numbers(joined((*STEPPER, *OBSERVERS[observer])), {"METHOD": METHODS[method]})
    return load_module(text, f"series_{observer}_{method}")
