"""The planar kernels for a given number of harmonics; the spectrum is a module of its own, compiled where it is used.

The planar files are written once, with the number of harmonics a constant at the top; here their text is
joined into one module with that constant set, so that every inner loop has constant bounds (a factor of two).
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from types import ModuleType

from nonsmooth.kernels.cache import load_module

__all__ = ["planar_module", "settle_module", "spectrum_module"]

PARTS = (
    "planar_tables", "planar_polynomial", "planar_search", "planar_march", "planar_extremes", "planar_layout",
    "planar_chain", "planar_record",
)  # fmt: skip
SPECTRUM = ("planar_tables", "planar_polynomial", "planar_search", "planar_march", "planar_layout", "planar_spectrum")


def _joined(parts: tuple[str, ...], states: int, harmonics: int) -> str:
    folder = Path(__file__).parent
    text = "\n".join((folder / f"{part}.py").read_text(encoding="utf-8") for part in parts)
    text = re.sub(r"^from \.planar_\w+ import (\([^)]*\).*|[^(\n]*)$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^from \.(\w+) import", r"from nonsmooth.kernels.\1 import", text, flags=re.MULTILINE)
    text = re.sub(r"^STATES = 2$", f"STATES = {states}", text, flags=re.MULTILINE)
    return re.sub(r"^HARMONICS = 1$", f"HARMONICS = {harmonics}", text, flags=re.MULTILINE)


@cache
def planar_module(states: int, harmonics: int) -> ModuleType:
    """The module with ``chain``, ``record`` and ``scratch`` for ``states`` >= 1 and ``harmonics`` >= 0 harmonics."""
    return load_module(_joined(PARTS, states, harmonics), f"planar_{states}_{harmonics}")


@cache
def settle_module(harmonics: int) -> ModuleType:
    """The module with ``settle_many`` over the planar kernels for that number of harmonics."""
    below = planar_module(2, harmonics).__name__
    text = (Path(__file__).parent / "planar_settle.py").read_text(encoding="utf-8")
    text = re.sub(r"^from \.planar_\w+ import", f"from {below} import", text, flags=re.MULTILINE)
    text = re.sub(r"^from \.(\w+) import", r"from nonsmooth.kernels.\1 import", text, flags=re.MULTILINE)
    return load_module(text, f"planar_settle_{harmonics}")


@cache
def spectrum_module(harmonics: int) -> ModuleType:
    """The module with ``spectrum`` for forcing with ``harmonics`` >= 0 harmonics."""
    return load_module(_joined(SPECTRUM, 2, harmonics), f"planar_spectrum_{harmonics}")
