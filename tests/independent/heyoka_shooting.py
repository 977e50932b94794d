"""Periodic orbits of the paper's oscillator by shooting on heyoka's return map; their folds and flips.

The Jacobian is a central difference of the map itself: no variational equation and no saltation matrix enters,
so the numbers found here can judge ours. `reference_values` holds what this module found;
`test_heyoka_references.py` recomputes it.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import heyoka_support as hs
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

SCALE = np.array([1e-3, 1e-2])


def period_map(p: Mapping[str, float], n: int, u: NDArray[np.float64]) -> NDArray[np.float64]:
    return hs.run(p, n, u, record=False).states[-1]


def jacobian(p: Mapping[str, float], n: int, u: NDArray[np.float64], step: float = 1e-5) -> NDArray[np.float64]:
    """d P^n / d u in scaled coordinates (its eigenvalues are the Floquet multipliers), O(step^4) differences."""
    columns = []
    for axis in range(2):
        h = np.zeros(2)
        h[axis] = step * SCALE[axis]
        near = period_map(p, n, u + h) - period_map(p, n, u - h)
        far = period_map(p, n, u + 2 * h) - period_map(p, n, u - 2 * h)
        columns.append((8 * near - far) / (12 * step) / SCALE)
    return np.array(columns).T


def solve_orbit(p: Mapping[str, float], n: int, u: NDArray[np.float64], step: float = 1e-5) -> NDArray[np.float64]:
    """Fixed point of the n-period map near `u`."""
    u = np.array(u, dtype=float)
    for _ in range(30):
        residual = (period_map(p, n, u) - u) / SCALE
        if np.linalg.norm(residual) < 1e-12:
            return u
        du = np.linalg.solve(np.eye(2) - jacobian(p, n, u, step), residual)
        if np.linalg.norm(du) < 1e-13:
            return u
        u = u + du * SCALE
    raise RuntimeError(f"shooting did not converge: n = {n}, residual {residual}, parameters {dict(p)}")


def settle(p: Mapping[str, float], n_periods: int, start: tuple[float, float] = (0.0, 0.0)) -> NDArray[np.float64]:
    return hs.run(p, n_periods, start, record=False).states[-1]


def flip(
    p: Mapping[str, float],
    name: str,
    n: int,
    u: NDArray[np.float64],
    to: float,
    *,
    n_steps: int = 20,
    step: float = 1e-5,
) -> float:
    """Value of parameter `name` between ``p[name]`` and `to` where det(DP^n + I) of the n-periodic orbit through
    `u` changes sign: followed in `n_steps` steps, then bracketed (Brent)."""
    orbit = {"u": solve_orbit(p, n, u, step)}

    def determinant(value: float) -> float:
        q = dict(p, **{name: value})
        orbit["u"] = solve_orbit(q, n, orbit["u"], step)
        return float(np.linalg.det(jacobian(q, n, orbit["u"], step) + np.eye(2)))

    values = np.linspace(p[name], to, n_steps + 1)
    last = determinant(values[0])
    for before, value in itertools.pairwise(values):
        u_before = orbit["u"]
        current = determinant(value)
        if last * current <= 0:
            orbit["u"] = u_before
            return float(brentq(determinant, before, value, xtol=1e-12))
        last = current
    raise RuntimeError(f"no flip of the period-{n} orbit between {p[name]} and {to}")


def fold(
    p: Mapping[str, float],
    name: str,
    n: int,
    u: NDArray[np.float64],
    *,
    state: int = 0,
    arc: float = 1e-3,
    step: float = 1e-5,
) -> float:
    """Extreme value of parameter `name` along the branch of n-periodic orbits that passes near `u` (multiplier +1).

    The branch is parametrised by the section coordinate ``u[state]``, which goes on monotonically through the
    fold; `arc` (units of `SCALE`) is its first step. The parameter's extremum is found by golden section and
    a parabola, so no multiplier is needed.
    """
    other = 1 - state
    guess = {"z": np.array([u[other] / SCALE[other], p[name]])}

    def value(s: float) -> float:
        """Parameter for which the orbit has ``u[state] = s``: Newton in (other coordinate, parameter)."""
        z = guess["z"].copy()
        increments = np.array([step, 1e-3 * step])

        def defect(z: NDArray[np.float64]) -> NDArray[np.float64]:
            w = np.empty(2)
            w[state], w[other] = s * SCALE[state], z[0] * SCALE[other]
            return (period_map(dict(p, **{name: z[1]}), n, w) - w) / SCALE

        for _ in range(30):
            derivative = np.empty((2, 2))
            for i in range(2):
                h = np.zeros(2)
                h[i] = increments[i]
                derivative[:, i] = (defect(z + h) - defect(z - h)) / (2 * increments[i])
            dz = np.linalg.solve(derivative, -defect(z))
            z = z + dz
            if np.all(np.abs(dz) < (1e-11, 1e-13)):
                break
        guess["z"] = z
        return float(z[1])

    s0 = float(u[state] / SCALE[state])
    start = value(s0)
    towards = value(s0 + arc)
    if towards == start:
        raise RuntimeError("no change of the parameter along the branch")
    # March towards the extremum: the side on which the parameter keeps moving the way `arc` moved it.
    sign = np.sign(towards - start)
    points = [(s0, start), (s0 + arc, towards)]
    while sign * (points[-1][1] - points[-2][1]) > 0:
        s = points[-1][0] + arc
        points.append((s, value(s)))
        if len(points) > 20000:
            raise RuntimeError("no fold within 20000 steps along the branch")
    low, high = points[-3][0] if len(points) > 2 else points[0][0], points[-1][0]
    guess["z"][1] = points[-2][1]
    found = minimize_scalar(
        lambda s: -sign * value(s),
        bounds=(min(low, high), max(low, high)),
        method="bounded",
        options={"xatol": 1e-6 * abs(arc)},
    )
    return float(-sign * found.fun)
