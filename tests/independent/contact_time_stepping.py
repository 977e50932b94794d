"""A time-stepping scheme (Moreau) for the systems of :mod:`contact_elements`: no events, of first order.

It judges the reference where that differs from the package: velocities at every step from one problem of all active
contacts and frictions, solved by sweeps. Preloads are steep instead of set-valued.
"""

from __future__ import annotations

import numpy as np
from contact_elements import Array, System, kinematics, parts
from numba import njit

STEEP = 2e-6  # width of the preload's ramp


@njit(cache=False)
def _march(h, steps, every, n, w, z, smooth, N, inverse, kind, direction, rate, zero, numbers):
    m = len(kind)
    out = np.empty((steps // every + 1, 2 * n))
    out[0] = z[: 2 * n]
    G = direction @ inverse @ direction.T
    stuck = np.zeros(m)
    for i in range(m):
        stuck[i] = 1.0 if kind[i] == 2 and abs(rate[i] @ z) < 1e-14 else 0.0
    for j in range(1, steps + 1):
        middle = z.copy()
        middle[:n] += h / 2 * z[n : 2 * n]
        middle[2 * n + 1], middle[2 * n + 2] = np.cos(w * (j - 0.5) * h), np.sin(w * (j - 0.5) * h)
        force = smooth @ middle
        active = np.zeros(m)
        for i in range(m):
            k, c, pulls, kinetic = numbers[i, 1], numbers[i, 2], numbers[i, 3], numbers[i, 5]
            g, rate_now = zero[i] @ middle, rate[i] @ middle
            if kind[i] == 1 and g < 0:
                f = -k * g - c * rate_now
                if pulls or f > 0:
                    force += direction[i] * f
            elif kind[i] == 3:
                force -= direction[i] * (kinetic * min(max(g / STEEP, -1.0), 1.0) + k * g)
            elif kind[i] == 2 or (kind[i] == 0 and g <= 0):
                active[i] = 1
        v = z[n : 2 * n] + h * inverse @ force
        end = z.copy()
        end[:n] += h * z[n : 2 * n]
        end[2 * n + 1], end[2 * n + 2] = np.cos(w * j * h), np.sin(w * j * h)
        offset = np.zeros(m)
        bound = np.zeros(m)
        for i in range(m):
            offset[i] = rate[i][2 * n :] @ end[2 * n :]
            bound[i] = h * (numbers[i, 4] if stuck[i] else numbers[i, 5])
            if kind[i] == 0:
                offset[i] += numbers[i, 0] * min(rate[i] @ z, 0.0) if rate[i] @ z < -50 * h else 0.0
        tried = stuck.copy()
        for _ in range(2 * m + 1):
            L = np.zeros(m)
            for _ in range(2000):
                change = 0.0
                for i in range(m):
                    if active[i]:
                        x = L[i] - (direction[i] @ v + offset[i] + G[i] @ L) / G[i, i]
                        x = max(x, 0.0) if kind[i] == 0 else min(max(x, -bound[i]), bound[i])
                        change = max(change, abs(x - L[i]))
                        L[i] = x
                if change < 1e-16:
                    break
            again = False
            for i in range(m):
                if kind[i] == 2 and stuck[i] and abs(L[i]) >= bound[i] * (1 - 1e-9):
                    slip = direction[i] @ v + offset[i] + G[i] @ L
                    if abs(slip) > 1e-12:
                        stuck[i], bound[i], again = 0.0, h * numbers[i, 5], True
            for i in range(m):
                if kind[i] == 2 and not tried[i] and not again:
                    slip = direction[i] @ v + offset[i] + G[i] @ L
                    if slip * (rate[i] @ z) <= 1e-12 * abs(rate[i] @ z):  # it arrives: the static bound may hold it
                        tried[i], stuck[i], bound[i], again = 1.0, 1.0, h * numbers[i, 4], True
            if not again:
                break
        after = v + inverse @ direction.T @ L
        for i in range(m):
            if kind[i] == 2:
                stuck[i] = 1.0 if abs(direction[i] @ after + offset[i]) < 1e-10 else 0.0
        z[:n] = middle[:n] + h / 2 * after
        z[n : 2 * n] = after
        z[2 * n + 1 :] = end[2 * n + 1 :]
        if j % every == 0:
            out[j // every] = z[: 2 * n]
    return out


def time_stepping(system: System, q: Array, v: Array, spacing: float, count: int, every: int = 2000) -> Array:
    """Return states at 0, spacing, ..., with ``every`` steps between."""
    n, listed = len(system.mass), parts(system)
    kinds = {"stop": 0, "elastic": 1, "friction": 2, "preload": 3}
    names = ("e", "k", "c", "pulls", "static", "kinetic")
    numbers = np.array([[float(p.numbers.get(key, 0.0)) for key in names] for p in listed])
    return _march(
        spacing / every,
        every * count,
        every,
        n,
        system.frequency,
        np.concatenate((np.asarray(q, float), np.asarray(v, float), [1.0, 1.0, 0.0])),
        np.hstack((-system.stiffness, -system.damping, system.loads)),
        kinematics(n, system.frequency),
        np.linalg.inv(system.mass),
        np.array([kinds[p.kind] for p in listed]),
        np.array([p.direction for p in listed]),
        np.array([p.rate for p in listed]),
        np.array([p.zero for p in listed]),
        numbers,
    )
