"""An orbit that was solved for as one of p periods but closes after fewer: the shorter orbit it is.

Its equations hold for the longer period too, with the multipliers' powers. Near a flip, and in chaos, a motion returns
better after two or more periods than after its own one, so such solutions are met.
"""

from __future__ import annotations

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.shooting import Shooting, Solved
from nonsmooth.continuation.signature.signature import Signature

__all__ = ["primitive"]

SAME = 1e-8  # of the size: states nearer than this are one state
LONGEST = 64  # rounds looked for where neither the period number nor the transitions tell how many there may be


def primitive(shooting: Shooting, solved: Solved, size: FloatArray) -> tuple[Shooting, FloatArray] | None:
    """The equations and the unknowns of the shorter orbit that a solved one is gone round, or None.

    ``size`` (n,) is that of the states and the memory.
    """
    p, m = shooting.period_number, shooting.m
    visits = shooting.signature.visits
    times, states = shooting.split(solved.X)
    end = float(solved.times[-1])
    for rounds in range(p or m or LONGEST, 1, -1):
        if p % rounds or m % rounds:
            continue
        few, turns = m // rounds, p // rounds
        once = Signature((*visits[:few], visits[-1]))
        if once.repeated(rounds, turns) != shooting.signature:
            continue
        begin = float(times[few - 1]) if few else 0.0
        there = shooting.flow.segments(
            solved.values, [visits[few].mode], [begin], [end / rounds - begin], states[few][None, :]
        ).z[0]
        if not np.abs((there - states[0]) / size).max() < SAME:
            continue
        short = Shooting(shooting.system, once, turns, shooting.active)
        short.reference = shooting.reference
        X = short.join(times[:few], states[: few + 1], end / rounds, shooting.parameters(solved.X)[shooting.places])
        return short, X
    return None
