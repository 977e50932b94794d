"""The kernels of the series methods, for one observer."""

from __future__ import annotations

from functools import cache
from types import ModuleType

from nonsmooth.kernels.cache import load_module
from nonsmooth.kernels.linear_module import joined

__all__ = ["series_module"]

OBSERVERS = {"sections": "sections", "record": "record"}


@cache
def series_module(observer: str) -> ModuleType:
    """The module with ``chain`` (sections) or ``record``."""
    text = joined(("series_stepper", "hybrid", OBSERVERS[observer]))
    return load_module(text, f"series_{observer}")
