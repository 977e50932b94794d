"""The spectrum of planar systems for a given number of harmonics: a module of its own, compiled where it is used."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from types import ModuleType

from nonsmooth.kernels.cache import load_module

__all__ = ["planar_spectrum_module"]

PARTS = (
    "planar_tables", "planar_polynomial", "planar_search", "planar_march", "planar_layout", "planar_spectrum",
)  # fmt: skip


@cache
def planar_spectrum_module(harmonics: int) -> ModuleType:
    """The module with ``spectrum`` and ``scratch`` for forcing with ``harmonics`` >= 0 harmonics."""
    folder = Path(__file__).parent
    text = "\n".join((folder / f"{part}.py").read_text(encoding="utf-8") for part in PARTS)
    text = re.sub(r"^from \.planar_\w+ import (\([^)]*\).*|[^(\n]*)$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^from \.(\w+) import", r"from nonsmooth.kernels.\1 import", text, flags=re.MULTILINE)
    text = re.sub(r"^HARMONICS = 1$", f"HARMONICS = {harmonics}", text, flags=re.MULTILINE)
    return load_module(text, f"planar_spectrum_{harmonics}")
