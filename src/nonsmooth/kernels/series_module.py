"""The kernels of the series methods, for one observer and one method."""

from __future__ import annotations

import re
from functools import cache
from types import ModuleType

from nonsmooth.kernels.cache import load_module
from nonsmooth.kernels.linear_module import joined
from nonsmooth.kernels.series_places import METHODS

__all__ = ["METHODS", "OBSERVERS", "series_module"]

OBSERVERS = {"sections": ("sections",), "record": ("every_step", "record")}


@cache
def series_module(observer: str, method: str) -> ModuleType:
    """The module with ``chain`` (sections) or ``record``.

    The method is a constant of the text: what another one needs is not in the way, nor compiled."""
    text = joined(("series_step", "watch", "series_stepper", "hybrid", *OBSERVERS[observer]))
    text = re.sub(r"^METHOD = 0$", f"METHOD = {METHODS[method]}", text, flags=re.MULTILINE)
    return load_module(text, f"series_{observer}_{method}")
