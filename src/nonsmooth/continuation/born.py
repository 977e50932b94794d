"""The cycles that emanate from a Hopf point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.anchor import anchor_at
from nonsmooth.continuation.arclength import Curve, Point
from nonsmooth.continuation.equilibrium import Equilibria
from nonsmooth.continuation.shooting import Shooting
from nonsmooth.continuation.signature import Signature, Visit
from nonsmooth.system.system import System

__all__ = ["first_cycle"]

FloatArray = NDArray[np.float64]
SMALL = 1e-2  # amplitude of the first cycle, in units of the states' scales


def first_cycle(
    system: System, name: str, value: float, mode: int, u: FloatArray, width: float
) -> tuple[Curve, Point] | None:
    r"""A small cycle :math:`u + \epsilon \, \mathrm{Re}(q e^{i \omega t})`, corrected to an orbit."""
    equilibria = Equilibria(system, mode, name, width)
    rest = equilibria.at(u, value)
    if rest is None:
        return None
    eigenvalues, vectors = np.linalg.eig(rest.jacobian)
    i = int(np.argmin(np.abs(eigenvalues.real) + 1e3 * (np.abs(eigenvalues.imag) < 1e-9)))
    omega, q = abs(float(eigenvalues[i].imag)), vectors[:, i]
    scale = np.concatenate([system.scale_vector(), np.ones(len(system.memory))])
    own = np.zeros(len(scale), dtype=complex)
    own[equilibria.own] = q
    own /= np.abs(own / scale).max()
    # Begun where its real part is largest, so that the section lies across the flow.
    own *= np.exp(-1j * np.angle(np.sum(own**2 / scale**2)) / 2)
    shooting = Shooting(system, Signature((Visit(mode),)), 0, (name,))
    rested = np.concatenate([rest.u, system.memory_vector()])
    period = 2 * np.pi / omega
    curve = Curve(shooting, scale, period, width)
    for amplitude in (SMALL, 0.3 * SMALL, 3 * SMALL):
        z = rested + amplitude * own.real
        anchor_at(shooting, shooting.values, z, scale)
        Y = shooting.join(np.empty(0), z[None, :], period, [value]) / curve.scale
        border = np.zeros(curve.n)
        border[: shooting.n] = own.real / scale
        border /= np.linalg.norm(border)
        found = curve.correct(Y, border, float(border @ Y), most=20)
        if found is None:
            continue
        point = curve.point(found[0], found[1], border)
        if point is not None and np.nanmax(point.path.maximum - point.path.minimum) > 0:
            return curve, point
    return None
