"""The kernels of the exact flow: for two states with one harmonic, and for all other numbers of them."""

from __future__ import annotations

from functools import cache
from types import ModuleType

from nonsmooth.kernels.compile.assembly import joined, with_numbers
from nonsmooth.kernels.compile.cache import load_module

STEPPER = (
    "linear.tables",
    "linear.bands",
    "linear.build",
    "linear.polynomial",
    "linear.values",
    "linear.search",
    "linear.limits",
    "linear.stepper",
    "hybrid.loop",
)
OBSERVERS = (
    "linear.extremes",
    "linear.touches",
    "linear.growth",
    "hybrid.sections",
    "hybrid.record",
    "hybrid.growth",
    "hybrid.observers",
    "hybrid.run",
)


def is_planar(states: int, harmonics: int) -> bool:
    """Return whether numbers of states (memory counted) and harmonics are those of the module with constant bounds."""
    return states == 2 and harmonics == 1


@cache
def linear_module(planar: bool = False) -> ModuleType:
    """The module with ``run``: for two states, all in every mode, with one harmonic; else for any number of them, and
    with ``stand``, which adds modes to tables."""
    text = joined((*STEPPER, *OBSERVERS) if planar else (*STEPPER, *OBSERVERS, "linear.modes"))
    return load_module(with_numbers(text, {"STATES": 2 if planar else 0}), "linear_planar" if planar else "linear")
