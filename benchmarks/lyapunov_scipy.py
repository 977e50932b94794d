"""The Lyapunov spectrum by SciPy: `solve_ivp` with the variational equations, terminal events and saltation by hand."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, pi

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from oscillator_scipy import ATOL, RTOL, boundaries

UNITS = 10.0  # the frame's velocities are counted in cm/s, its positions in mm


def exponents(p: Mapping[str, float], u: NDArray[np.float64], n_periods: int) -> NDArray[np.float64]:
    """Both exponents over `n_periods` from `u` at phase 0, the frame being made orthonormal at every crossing."""
    m, k, k_s, c, c_s, g, rho, omega = (p[n] for n in ("m", "k", "k_s", "c", "c_s", "g", "rho", "omega"))
    tau = c_s / k_s
    stiffness, damping = (2 * k / m, (2 * k + k_s) / m), (c / m, (c + c_s) / m)

    def field(mode: int):
        def augmented(t: float, z: NDArray[np.float64]) -> tuple[float, ...]:
            x, v, a, b, d, e = z
            push = (k_s * g / m) if mode else 0.0
            force = rho / m * cos(omega * t) - stiffness[mode] * x - damping[mode] * v + push
            spring, damper = stiffness[mode] / UNITS, damping[mode]
            return v, force, UNITS * d, UNITS * e, -spring * a - damper * d, -spring * b - damper * e

        return augmented

    entry, separation, second_entry = boundaries(g, tau)
    saltation = np.array([[1.0, 0.0], [-c_s / m / UNITS, 1.0]])
    q, sums = np.eye(2), np.zeros(2)
    inside = u[0] > g and separation(0.0, u) < 0
    t, end = 0.0, n_periods * 2 * pi / omega
    while t < end:
        events = [separation] if inside else [entry, second_entry]
        s = solve_ivp(
            field(int(inside)), (t, end), [*u, *q.ravel()], method="DOP853", rtol=RTOL, atol=ATOL, events=events
        )
        t, u, q = float(s.t[-1]), s.y[:2, -1], s.y[2:, -1].reshape(2, 2)
        if s.status == 1:
            # Both entries' events may stand in the list, in either order: second_entry jumps where x passes g.
            if not inside and abs(u[0] - g) < 1e-10:
                q = saltation @ q
            inside = not inside
        q, r = np.linalg.qr(q)
        sums += np.log(np.abs(np.diag(r)))
    return sums / end
