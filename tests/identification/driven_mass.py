"""A mass on a spring before a wall under a force that is linear between its samples, in closed form between impacts."""

from itertools import pairwise

import numpy as np
from scipy.optimize import brentq


def free(state: np.ndarray, c: float, k: float, force: float, rise: float, s: float) -> np.ndarray:
    """Place and speed of q'' + c q' + k q = force + rise s after s, in closed form."""
    slope, swing = rise / k, np.sqrt(k - c * c / 4)
    level = (force - c * slope) / k
    at = state[0] - level
    of_sine = (state[1] - slope + c / 2 * at) / swing
    fade, sine, cosine = np.exp(-c / 2 * s), np.sin(swing * s), np.cos(swing * s)
    swings = fade * (at * cosine + of_sine * sine)
    speed = -c / 2 * swings + fade * swing * (of_sine * cosine - at * sine)
    return np.array([level + slope * s + swings, slope + speed])


def driven(t: np.ndarray, force: np.ndarray, c: float, k: float, wall: float, e: float) -> tuple[np.ndarray, int]:
    """Place and speed from rest at 0 under a force linear between its samples, and how often it met the wall."""
    state, found, hits = np.zeros(2), [np.zeros(2)], 0
    for span, (f, behind) in zip(np.diff(t), pairwise(force), strict=True):
        rise, now = (behind - f) / span, 0.0
        while free(state, c, k, f + rise * now, rise, span - now)[0] > wall:

            def gap(s: float, begin=(state, f + rise * now, rise)) -> float:
                return free(begin[0], c, k, *begin[1:], s)[0] - wall

            first = 1e-9 if state[0] == wall else 0.0
            s = brentq(gap, first, span - now, xtol=1e-15)
            at = free(state, c, k, f + rise * now, rise, s)
            state, now, hits = np.array([wall, -e * at[1]]), now + s, hits + 1
        state = free(state, c, k, f + rise * now, rise, span - now)
        found.append(state)
    return np.array(found), hits
