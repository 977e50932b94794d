"""Stability, seen: a held motion is displaced a little and let go, and either comes back or leaves."""

from __future__ import annotations

import numpy as np

from nonsmooth.control.holding import Held, Holder, fitted

STABLE, UNSTABLE, UNKNOWN = 1, 0, -1
PUSH, LARGEST = 0.01, 0.05  # of the motion's first harmonic
SEEN = 6.0  # times the noise of one turn: the least displacement
FAR = 3.0  # times the displacement


def release(holder: Holder, held: Held, turns: int) -> tuple[int, float]:
    """Hold a reference that is 1 % larger, let go, and watch the first harmonic for some turns of the drive.

    More than 1 % where the noise of one turn asks for it, up to 5 %; beyond that nothing is seen.

    Returns
    -------
    int
        ``UNSTABLE`` where its distance from the held motion grew to three times the displacement, ``STABLE`` where it
        ended below a third of it, else ``UNKNOWN``.
    float
        Mean factor by which the distance changed per turn.
    """
    here = held.position.c[1]
    noise = held.position.u[1] * np.sqrt(2.0 * holder.holding.record)
    push = max(PUSH, SEEN * float(noise / abs(here)))
    if push > LARGEST:
        return UNKNOWN, float("nan")
    pushed = held.reference.copy()
    pushed[1] *= 1.0 + push
    holder.run(held.frequency, pushed, holder.holding.settle)
    displacement = push * float(abs(here))
    distances: list[float] = []
    for _ in range(turns):
        seen = holder.run(held.frequency, None, 1)
        distances.append(float(abs(fitted(seen.phase, seen.position, holder.harmonics).c[1] - here)))
        if distances[-1] > FAR * displacement:
            break  # it has left; how far it goes, the rig need not suffer
    last = distances[-1]
    factor = (last / distances[0]) ** (1.0 / (len(distances) - 1)) if len(distances) > 1 else float("inf")
    if last > FAR * displacement:
        return UNSTABLE, factor
    return (STABLE if last < displacement / FAR else UNKNOWN), factor
