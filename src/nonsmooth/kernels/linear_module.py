"""The kernels of the exact flow for given numbers of states and harmonics.

Their files are written once, with these two numbers constants at the top; here their text is
joined into one module with that constant set, so that every inner loop has constant bounds (a factor of two).
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from types import ModuleType

from nonsmooth.kernels.cache import load_module

__all__ = ["linear_module", "settle_module", "spectrum_module"]

PARTS = (
    "linear_tables", "linear_polynomial", "linear_search", "linear_march", "linear_extremes", "linear_layout",
    "linear_chain", "linear_record",
)  # fmt: skip
SPECTRUM = ("linear_tables", "linear_polynomial", "linear_search", "linear_march", "linear_layout", "planar_spectrum")


def _joined(parts: tuple[str, ...], states: int, harmonics: int) -> str:
    folder = Path(__file__).parent
    text = "\n".join((folder / f"{part}.py").read_text(encoding="utf-8") for part in parts)
    text = re.sub(r"^from \.linear_\w+ import (\([^)]*\).*|[^(\n]*)$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^from \.(\w+) import", r"from nonsmooth.kernels.\1 import", text, flags=re.MULTILINE)
    text = re.sub(r"^STATES = 2$", f"STATES = {states}", text, flags=re.MULTILINE)
    return re.sub(r"^HARMONICS = 1$", f"HARMONICS = {harmonics}", text, flags=re.MULTILINE)


@cache
def linear_module(states: int, harmonics: int) -> ModuleType:
    """The module with ``chain``, ``record`` and ``scratch`` for ``states`` >= 1 and ``harmonics`` >= 0 harmonics."""
    return load_module(_joined(PARTS, states, harmonics), f"linear_{states}_{harmonics}")


@cache
def settle_module(states: int, harmonics: int) -> ModuleType:
    """The module with ``settle_many`` over the kernels of those numbers of states and harmonics."""
    below = linear_module(states, harmonics).__name__
    text = (Path(__file__).parent / "planar_settle.py").read_text(encoding="utf-8")
    text = re.sub(r"^from \.linear_\w+ import", f"from {below} import", text, flags=re.MULTILINE)
    text = re.sub(r"^from \.(\w+) import", r"from nonsmooth.kernels.\1 import", text, flags=re.MULTILINE)
    return load_module(text, f"planar_settle_{states}_{harmonics}")


@cache
def spectrum_module(harmonics: int) -> ModuleType:
    """The module with ``spectrum`` for two states and ``harmonics`` >= 0 harmonics."""
    return load_module(_joined(SPECTRUM, 2, harmonics), f"planar_spectrum_{harmonics}")
