"""An orbit that was solved for as one of p periods but closes after fewer: the shorter orbit it is.

Its equations hold for the longer period too, with the multipliers' powers. Near a flip, and in chaos, a motion returns
better after two or more periods than after its own one, so such solutions are met.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.shooting import Shooting, Solved
from nonsmooth.continuation.problems.signature import Round, Signature
from nonsmooth.continuation.problems.visits import led

SAME = 1e-8  # of the size: states nearer than this are one state
DOUBLED = 1e-4  # beside a flip the doubled orbit differs from the other one by a square root
LONGEST = 64  # rounds looked for where neither the period number nor the transitions tell how many there may be


def primitive(shooting: Shooting, solved: Solved, size: FloatArray) -> tuple[Shooting, FloatArray] | None:
    """The equations and the unknowns of the shorter orbit that a solved one is gone round, or None.

    ``size`` (n,) is that of the states and the memory.
    """
    p, m = shooting.period_number, shooting.m
    for rounds in range(p or m or LONGEST, 1, -1):
        once = _once_round(shooting, solved, size, rounds, SAME)
        if once is not None:
            values = shooting.parameters(solved.X)[shooting.places]
            short, X = Shooting.of(shooting.system, once, shooting.active, values)
            short.reference = shooting.reference
            return short, X
    return None


def is_doubled(point: Any) -> bool:
    """Return whether an orbit is a shorter one gone round twice, as where a doubled branch meets its flip."""
    return _once_round(point.shooting, point.solved, point.curve.size, 2, DOUBLED) is not None


def _once_round(shooting: Shooting, solved: Solved, size: FloatArray, rounds: int, near: float) -> Round | None:
    """Once round where a solved orbit closes after a part of its period."""
    p, m, visits = shooting.period_number, shooting.m, shooting.signature.visits
    if p % rounds or m % rounds:
        return None
    few = m // rounds
    signature = Signature((*visits[:few], visits[-1]))
    if signature.repeated(rounds, p // rounds) != shooting.signature:
        return None
    times, z = shooting.split(solved.X)
    period, begin = float(solved.times[-1]) / rounds, float(solved.times[few])
    there = led(shooting.flow, solved.values, visits[few].mode, begin, period - begin, z[few])
    once = Round(p // rounds, period, signature, times[:few], z[: few + 1])
    return once if np.abs((there - z[0]) / size).max() < near else None
