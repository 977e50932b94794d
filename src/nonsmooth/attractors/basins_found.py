"""An attractor, and how long one is waited for."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nonsmooth.attractors.settled import half_ranges
from nonsmooth.flow.engines.engine import FloatArray, IntArray
from nonsmooth.flow.equilibrium_sets import EquilibriumSet
from nonsmooth.results.labels import kind_of


@dataclass(frozen=True)
class Patience:
    """Patience with runs without a period, in section returns."""

    candidate: int = 20_000  # for a candidate for a chaotic attractor
    more: int = 1000  # between two looks at the other runs
    rounds: int = 10  # of such looks
    exponent: int = 4000
    window: int = 60  # points compared with an attractor's


NONE = Patience(rounds=0)  # cycles and places of rest alone


@dataclass(frozen=True)
class Attractor:
    """One attractor on the section.

    ``period_number`` is 0 where it is no cycle; ``points`` are its section points (a sample of them then) with their
    ``modes``, and ``end``, ``mode`` a place on it from which a run can go on. ``exponent`` is the largest Lyapunov
    exponent per unit time, ``multiplier`` the largest multiplier of a cycle (else NaN); ``confirmed`` says that
    Newton's method has found the cycle. Of a set of equilibria the extremes are its extent.
    """

    period_number: int
    points: FloatArray  # (k, n)
    modes: IntArray  # (k,)
    end: FloatArray  # (width,)
    mode: int
    maximum: FloatArray  # (n,)
    minimum: FloatArray
    multiplier: float
    exponent: float
    exponent_error: float
    least: FloatArray  # (n,): a motion smaller than this is one that has come to rest
    confirmed: bool = False
    chaotic: bool = False  # its exponent is above zero beyond doubt
    near: float = 0.0  # of its size: section points nearer than this belong to it
    tree: Any = field(default=None, repr=False, compare=False)
    held: Any = np.nan  # (n,) how far states move that friction holds, and may elsewhere on others beside it; else NaN
    name: str = ""
    standing: EquilibriumSet | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not self.name:
            object.__setattr__(self, "name", kind_of(self.period_number, self.chaotic))

    @property
    def size(self) -> FloatArray:
        """Half the range of each state on it, and no less than the least size."""
        return half_ranges(self.maximum, self.minimum, self.least)
