"""Stability, seen: a held motion is displaced a little and let go, and either comes back or leaves."""

from __future__ import annotations

from nonsmooth.control.harmonics import fitted
from nonsmooth.control.held import Held, Holder

__all__ = ["STABLE", "UNKNOWN", "UNSTABLE", "release"]

STABLE, UNSTABLE, UNKNOWN = 1, 0, -1
PUSH = 0.01  # of the motion's first harmonic
LEFT = 3.0  # times the first distance


def release(holder: Holder, held: Held, turns: int) -> tuple[int, float]:
    """Hold a reference that is 1 % larger, let go, and watch the first harmonic for some turns of the drive.

    Returns
    -------
    int
        ``STABLE`` where the distance from the held motion fell below a third, ``UNSTABLE`` where it grew threefold,
        else ``UNKNOWN``.
    float
        Factor by which the distance changed per turn, from the first turn to the last before that happened.
    """
    pushed = held.reference.copy()
    pushed[1] *= 1.0 + PUSH
    holder.run(held.frequency, pushed, holder.settle)
    here = held.position.c[1]
    distances = []
    for _ in range(turns):
        seen = holder.run(held.frequency, None, 1)
        distances.append(abs(fitted(seen.phase, seen.position, 3).c[1] - here))
        if len(distances) > 1 and not 1 / LEFT < distances[-1] / distances[0] < LEFT:
            break
    ratio = distances[-1] / distances[0]
    factor = float(ratio ** (1.0 / (len(distances) - 1)))
    return (UNSTABLE if ratio >= LEFT else STABLE if ratio <= 1 / LEFT else UNKNOWN), factor
