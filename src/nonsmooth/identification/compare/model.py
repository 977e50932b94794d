"""The theory of a comparison, with all by which it predicts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from nonsmooth.identification.compare.draws import Settings, draw_systems, drawn_variables, nominal

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["Model"]


@dataclass(frozen=True)
class Model:
    """A System with identified parameters and a run's settings, or a result at hand; draws, seed and band level.

    ``states``: those that were measured, in their order, in which the comparison is made.
    """

    theory: Any
    states: list[str]
    parameters: Any
    settings: Settings
    transient: int
    draws: int
    level: float
    seed: int
    options: Mapping[str, Any]

    @cached_property
    def system(self) -> System | None:
        """The system at parameters and settings; None where the theory is a result."""
        if hasattr(self.theory, "data_vars"):
            return None
        return nominal(self.theory, self.parameters, self.settings)

    def drawn(self) -> tuple[list[System], dict[str, Any]]:
        """Systems whose parameters are drawn, and the draws as variables."""
        systems, drawn = draw_systems(self.theory, self.parameters, self.settings, self.draws, self.seed)
        return systems, drawn_variables(drawn, self.theory)

    @property
    def places(self) -> list[int]:
        """Places of the compared states among those of the theory."""
        return [list(self.theory.states).index(name) for name in self.states]

    @property
    def quantiles(self) -> tuple[float, float, float]:
        """Of the band: low, median, high."""
        return (1 - self.level) / 2, 0.5, (1 + self.level) / 2
