"""Orbits of twice the period that are a shorter one gone round twice."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits

__all__ = ["is_doubled"]


def is_doubled(curve: Orbits, point: OrbitPoint) -> bool:
    """Return whether an orbit is a shorter one gone round twice, as where a doubled branch meets its flip."""
    shooting = curve.shooting
    visits, m = shooting.signature.visits, shooting.m
    if m % 2 or (shooting.forced and shooting.period_number % 2):
        return False
    word = [(v.mode, v.transition, v.row) for v in visits[:-1]]
    if word[: m // 2] != word[m // 2 :]:
        return False
    i, half = m // 2, 0.5 * float(point.solved.times[-1])
    begin, z = float(point.solved.times[i]), shooting.split(point.X)[1][i]
    there = shooting.flow.segments(point.solved.values, [visits[i].mode], [begin], [half - begin], z[None, :]).z[0]
    n = len(shooting.system.states)
    return bool(np.abs((there - point.X[: shooting.n])[:n] / curve.size[:n]).max() < 1e-4)
