"""The kernels of the series methods."""

from __future__ import annotations

from functools import cache
from types import ModuleType

from nonsmooth.kernels.compile.assembly import joined
from nonsmooth.kernels.compile.cache import load_module

STEPPER = ("series.step", "series.watch", "series.instant", "series.stepper", "hybrid.loop")
OBSERVERS = ("series.growth", "hybrid.sections", "hybrid.record", "hybrid.growth", "hybrid.observers", "hybrid.run")


@cache
def series_module() -> ModuleType:
    """The module with ``run``, for both methods."""
    return load_module(joined((*STEPPER, *OBSERVERS)), "series")
