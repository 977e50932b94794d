"""Attractors of a system from random starts, and which of two systems' attractors are counterparts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.attractors.basin_fractions import basin_fractions

if TYPE_CHECKING:
    from nonsmooth.flow.sections import Poincare, Stroboscopic
    from nonsmooth.system.system import System

ALIKE = 0.1  # of the largest attractor: what extremes of counterparts may differ


@dataclass(frozen=True)
class Box:
    """Random starts."""

    n_starts: int
    box: dict[str, tuple[float, float]]
    section: Stroboscopic | Poincare | None
    seed: int


@dataclass(frozen=True)
class FoundAttractor:
    """An attractor: its period number (0 without a period), and its extremes."""

    period_number: int
    extremes: Any  # (2, n) maxima, minima


def attractors_of(system: System, search: Box, parameter: str, value: float) -> list[FoundAttractor]:
    """Attractors that the starts reach at one value of a parameter."""
    found = basin_fractions(
        system,
        parameter,
        [value],
        n_starts=search.n_starts,
        box=search.box,
        section=search.section,
        seed=search.seed,
        progress=False,
    ).isel({parameter: 0})
    return [
        FoundAttractor(int(one.period_number), np.array([one.maximum.values, one.minimum.values]))
        for k in range(found.sizes["attractor"])
        if (one := found.isel(attractor=k)).period_number >= 0
    ]


def matched(own: Sequence[FoundAttractor], others: Sequence[FoundAttractor]) -> tuple[int, int]:
    """Numbers of attractors without a counterpart: of the first, of the others.

    Pairs are taken in the order of their distances."""
    if not own or not others:
        return len(own), len(others)
    size = np.max([one.extremes[0] - one.extremes[1] for one in (*own, *others)], axis=0)
    size = np.where(size > 0, size, 1.0)
    pairs = sorted(
        (float(np.abs((a.extremes - b.extremes) / size).max()), i, j)
        for i, a in enumerate(own)
        for j, b in enumerate(others)
        if a.period_number == b.period_number
    )
    left, free = set(range(len(own))), set(range(len(others)))
    for distance, i, j in pairs:
        if distance < ALIKE and i in left and j in free:
            left.remove(i)
            free.remove(j)
    return len(left), len(free)
