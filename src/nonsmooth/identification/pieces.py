"""Problems of multiple shooting: pieces of motion, each with its own free start, with residuals and derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from nonsmooth.arrays import FloatArray

__all__ = ["Fittable", "State"]


@dataclass(frozen=True, eq=False)
class State:
    """Residuals and derivatives of all pieces at one point, not weighted."""

    fitted: list[FloatArray]
    residuals: list[FloatArray]
    in_parameters: list[FloatArray]
    in_start: list[FloatArray]

    def chi2(self, weights: list[FloatArray], used: Any = None) -> float:
        """Sum of the weighted residuals' squares, of all pieces or of those that are used."""
        rows = zip(self.residuals, weights, strict=True)
        return sum(float(np.sum((r * w) ** 2)) for i, (r, w) in enumerate(rows) if used is None or used[i])


class Fittable(Protocol):
    """Problem that the iteration and the covariance take: pieces, each with its start, and their residuals."""

    @property
    def pieces(self) -> Any:
        """Each with ``which``, ``n_free``, ``by_instant`` and ``correlation``."""

    def residuals(self, theta: FloatArray, starts: FloatArray) -> State:
        """Residuals of all pieces."""

    def derivatives(self, theta: FloatArray, starts: FloatArray) -> State:
        """The same with derivatives in the parameters of each piece and in its start."""

    def weights(self, state: State, spread: float) -> list[FloatArray]:
        """One over each residual's standard deviation."""
