"""A branch of periodic orbits by SciPy alone: shooting on `solve_ivp` with events, differences, arclength steps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from oscillator_scipy import march

SCALE = np.array([1e-3, 1e-2, 1.0])
NUDGE = 1e-4  # of the scale: the integrator's own error forbids smaller differences
STEP = 0.5


def follow(
    p: Mapping[str, float], u: NDArray[np.float64], n_points: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequencies and section points of ``n_points`` orbits of period 1 from (p, u) on, with rising frequency."""

    def defect(y: NDArray[np.float64]) -> NDArray[np.float64]:
        z = y * SCALE
        return np.asarray((march(dict(p, omega=float(z[2])), z[:2], 1) - z[:2]) / SCALE[:2])

    def jacobian(y: NDArray[np.float64], f: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.array([(defect(y + NUDGE * e) - f) / NUDGE for e in np.eye(3)]).T

    y = np.append(u, p["omega"]) / SCALE
    tangent = np.array([0.0, 0.0, 1.0])
    found = []
    for _ in range(n_points):
        f = defect(y)
        J = jacobian(y, f)
        tangent = np.linalg.solve(np.vstack([J, tangent]), [0.0, 0.0, 1.0])
        tangent /= np.linalg.norm(tangent)
        y = y + STEP * tangent
        level = tangent @ y
        for _ in range(8):
            f = defect(y)
            step = np.linalg.solve(np.vstack([J, tangent]), np.append(f, tangent @ y - level))
            y = y - step
            if np.abs(step).max() < 1e-6:
                break
        found.append(y * SCALE)
    points = np.array(found)
    return points[:, 2], points[:, :2]
