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

__all__ = ["joined", "linear_module", "settle_module"]

STEPPER = ("linear_tables", "linear_polynomial", "linear_search", "linear_stepper", "linear_layout", "hybrid")
OBSERVERS = {
    "sections": ("linear_extremes", "sections"), "record": ("linear_touches", "every_step", "record"),
    "growth": ("every_step", "growth"),
}  # fmt: skip


def joined(parts: tuple[str, ...], states: int = 2, harmonics: int = 1, memory: int = 0) -> str:
    """The text of some kernel files in one, with the numbers of states, harmonics and values in memory set."""
    folder = Path(__file__).parent
    text = "\n".join((folder / f"{part}.py").read_text(encoding="utf-8") for part in parts)
    own = "|".join({*parts, *STEPPER, "linear_extremes", "linear_touches"})
    text = re.sub(rf"^from \.(?:{own}) import (\([^)]*\).*|[^(\n]*)$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^from \. import", "from nonsmooth.kernels import", text, flags=re.MULTILINE)
    text = re.sub(r"^from \.(\w+) import", r"from nonsmooth.kernels.\1 import", text, flags=re.MULTILINE)
    text = re.sub(r"^MEMORY = 0 ", f"MEMORY = {memory} ", text, flags=re.MULTILINE)
    text = re.sub(r"^STATES = 2$", f"STATES = {states}", text, flags=re.MULTILINE)
    return re.sub(r"^HARMONICS = 1$", f"HARMONICS = {harmonics}", text, flags=re.MULTILINE)


@cache
def linear_module(states: int, harmonics: int, observer: str = "sections", memory: int = 0) -> ModuleType:
    """The module for ``states`` >= 1 (the last ``memory`` of them being that) and ``harmonics`` >= 0
    harmonics, with ``scratch`` and one observer's kernel: ``chain`` (sections), ``record`` or ``grow`` (growth)."""
    text = joined((*STEPPER, *OBSERVERS[observer]), states, harmonics, memory)
    return load_module(text, f"linear_{observer}_{states}_{harmonics}" + (f"_{memory}" if memory else ""))


@cache
def settle_module(states: int, harmonics: int) -> ModuleType:
    """The module with ``settle_many`` over the kernels of those numbers of states and harmonics."""
    below = linear_module(states, harmonics).__name__
    text = (Path(__file__).parent / "planar_settle.py").read_text(encoding="utf-8")
    text = re.sub(r"^from \.(?:sections|linear_tables) import", f"from {below} import", text, flags=re.MULTILINE)
    text = re.sub(r"^from \.(\w+) import", r"from nonsmooth.kernels.\1 import", text, flags=re.MULTILINE)
    return load_module(text, f"planar_settle_{states}_{harmonics}")
