"""The kernels of the exact flow for given numbers of states, harmonics and values in memory."""

from __future__ import annotations

import re
from functools import cache
from types import ModuleType

from nonsmooth.kernels.compile.assembly import joined, with_numbers
from nonsmooth.kernels.compile.cache import load_module

__all__ = ["STEPPER", "linear_module", "modes_module", "settle_module"]

STEPPER = (
    "linear.tables", "linear.bands", "linear.build", "linear.polynomial", "linear.values", "linear.search",
    "linear.limits", "linear.stepper", "linear.layout", "hybrid.loop",
)  # fmt: skip
OBSERVERS = {
    "sections": ("linear.extremes", "hybrid.sections"),
    "record": ("linear.touches", "hybrid.every_step", "hybrid.record"),
    "growth": ("hybrid.every_step", "hybrid.growth"),
}


@cache
def linear_module(
    states: int, harmonics: int, observer: str = "sections", memory: int = 0, may_wait: bool = False
) -> ModuleType:
    """The module for ``states`` >= 1 (the last ``memory`` of them being that) and ``harmonics`` >= 0
    harmonics, with ``scratch`` and one observer's kernel: ``chain`` (sections), ``record`` or ``grow`` (growth).

    ``may_wait``: modes are made when they are first visited, and runs wait for their tables."""
    text = joined((*STEPPER, *OBSERVERS[observer]))
    numbers = {"STATES": states, "HARMONICS": harmonics, "MEMORY": memory, "MAY_WAIT": int(may_wait)}
    name = f"linear_{observer}_{states}_{harmonics}" + (f"_{memory}" if memory else "") + "_waits" * may_wait
    return load_module(with_numbers(text, numbers), name)


@cache
def modes_module(states: int, harmonics: int) -> ModuleType:
    """The module with ``stand``, which adds modes to the tables of those numbers of states and harmonics."""
    numbers = {"STATES": states, "HARMONICS": harmonics, "MEMORY": 0}
    text = with_numbers(joined(("linear.tables", "linear.bands", "linear.build", "linear.modes")), numbers)
    return load_module(text, f"linear_modes_{states}_{harmonics}")


@cache
def settle_module(states: int, harmonics: int) -> ModuleType:
    """The module with ``settle_many`` over the kernels of those numbers of states and harmonics."""
    below = linear_module(states, harmonics).__name__
    taken = r"^from nonsmooth\.kernels\.(?:hybrid\.sections|linear\.tables) import"
    text = re.sub(taken, f"from {below} import", joined(("linear.many",)), flags=re.MULTILINE)
    return load_module(text, f"linear_many_{states}_{harmonics}")
