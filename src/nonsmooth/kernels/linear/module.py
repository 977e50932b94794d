"""The kernels of the exact flow: for two states with one harmonic, and for all other numbers of them."""

from __future__ import annotations

from functools import cache
from types import ModuleType

from nonsmooth.kernels.compile.assembly import joined, with_numbers
from nonsmooth.kernels.compile.cache import load_module

STEPPER = (
    "linear.tables", "linear.bands", "linear.build", "linear.polynomial", "linear.values", "linear.search",
    "linear.limits", "linear.stepper", "hybrid.loop",
)  # fmt: skip
OBSERVERS = (
    "linear.extremes", "linear.touches", "hybrid.sections", "hybrid.record", "hybrid.growth", "hybrid.observers",
    "hybrid.run",
)  # fmt: skip


def is_planar(states: int, harmonics: int) -> bool:
    """Return whether numbers of states (memory counted) and harmonics are those of the module with constant bounds."""
    return states == 2 and harmonics == 1


@cache
def linear_module(planar: bool = False) -> ModuleType:
    """The module with ``run``: for two states, all in every mode, with one harmonic; else for any number of them."""
    text = with_numbers(joined((*STEPPER, *OBSERVERS)), {"STATES": 2 if planar else 0})
    return load_module(text, "linear_planar" if planar else "linear")


@cache
def modes_module() -> ModuleType:
    """The module with ``stand``, which adds modes to tables."""
    text = with_numbers(joined(("linear.tables", "linear.bands", "linear.build", "linear.modes")), {"STATES": 0})
    return load_module(text, "linear_modes")
