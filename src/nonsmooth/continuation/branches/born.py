"""The cycles that emanate from a Hopf point, and from a focus-centre."""

from __future__ import annotations

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.continuation.problems.equilibrium import Equilibria
from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits
from nonsmooth.continuation.problems.rounds import Rounds
from nonsmooth.continuation.problems.shooting import Shooting
from nonsmooth.continuation.problems.signature import Signature, Visit
from nonsmooth.flow.equilibria import ModeField
from nonsmooth.system.system import System

__all__ = ["cycle_about_a_centre", "first_cycle"]

ANGLES = 720
LARGEST = 1e6  # of the states' scales
SMALL = 1e-2  # amplitude of the first cycle, in units of the states' scales


def first_cycle(
    system: System, name: str, value: float, mode: int, u: FloatArray, width: float
) -> tuple[Orbits, OrbitPoint] | None:
    r"""A small cycle :math:`u + \epsilon \, \mathrm{Re}(q e^{i \omega t})`, corrected to an orbit."""
    eigen = _rotation(system, name, value, mode, u, width)
    if eigen is None:
        return None
    rested, own, omega = eigen
    scale = np.concatenate([system.scale_vector(), np.ones(len(system.memory))])
    # Begun where its real part is largest, so that the section lies across the flow.
    own = own * np.exp(-1j * np.angle(np.sum(own**2 / scale**2)) / 2)
    shooting = Shooting(system, Signature((Visit(mode),)), 0, (name,))
    period = 2 * np.pi / omega
    curve = Orbits(shooting, scale, period, (width,))
    for amplitude in (SMALL, 0.3 * SMALL, 3 * SMALL):
        z = rested + amplitude * own.real
        shooting.anchor(z, shooting.values, scale)
        Y = shooting.join(np.empty(0), z[None, :], period, [value]) / curve.scale
        border = np.zeros(curve.n)
        border[: shooting.n] = own.real / scale
        border /= np.linalg.norm(border)
        point = curve.near(Y, border, most=20)
        if point is not None and np.nanmax(point.path.maximum - point.path.minimum) > 0:
            return curve, point
    return None


def cycle_about_a_centre(
    system: System, name: str, value: float, mode: int, u: FloatArray, width: float
) -> tuple[Orbits, OrbitPoint] | None:
    r"""A cycle a little larger than the closed orbit of a linear mode that touches the mode's boundary.

    At a focus-centre every :math:`u + A \, \mathrm{Re}(q e^{i \theta})` within the mode is closed; the cycle leaves the
    largest of them, which touches. Its size is kept and the parameter solved for.
    """
    eigen = _rotation(system, name, value, mode, u, width)
    if eigen is None:
        return None
    rested, own, omega = eigen
    n, values = len(system.states), system.parameter_vector()
    values[list(system.values).index(name)] = value
    field = ModeField(system.traced, mode, ())
    turns = np.exp(2j * np.pi * np.arange(ANGLES) / ANGLES)

    def margins(amplitude: float) -> FloatArray:
        states = (rested + amplitude * (own * turns[:, None]).real)[:, :n]
        return np.array([field.margins(field.indicators(one, values, rested[n:])[0]).max() for one in states])

    small, large = 0.0, 1.0
    while margins(large).max() < 0.0:
        small, large = large, 2.0 * large
        if large > LARGEST:
            return None  # nothing bounds the mode: no cycle
    for _ in range(40):
        middle = 0.5 * (small + large)
        small, large = (small, middle) if margins(middle).max() >= 0.0 else (middle, large)
    scale = np.concatenate([np.abs(large * own).real.max() * np.ones(n), np.ones(len(system.memory))])
    period = 2 * np.pi / omega
    curve = Orbits(Shooting(system, Signature((Visit(mode),)), 0, (name,)), scale, period, (width,))
    rounds = Rounds(curve.shooting)
    inside = turns[int(margins(large).argmin())]
    for beyond in (0.03, 0.1, 0.01, 0.3):
        z = rested + (1.0 + beyond) * large * (own * inside).real
        guess = rounds.free(values, z, mode, 0.0, period)
        if guess is None or not len(guess.times):
            continue
        fresh, X = curve.around(guess, [value])
        Y = X / fresh.scale
        border = np.zeros(fresh.n)
        border[: curve.shooting.n] = (X[: curve.shooting.n] - rested) / scale
        border /= np.linalg.norm(border)
        point = fresh.near(Y, border, most=20)
        if point is not None and not point.virtual:
            return fresh, point
    return None


def _rotation(
    system: System, name: str, value: float, mode: int, u: FloatArray, width: float
) -> tuple[FloatArray, ComplexArray, float] | None:
    """(equilibrium with memory, eigenvector of the imaginary pair of unit size, its frequency)."""
    equilibria = Equilibria(system, mode, name, width)
    rest = equilibria.at(u, value)
    if rest is None:
        return None
    eigenvalues, vectors = np.linalg.eig(rest.jacobian)
    i = int(np.argmin(np.abs(eigenvalues.real) + 1e3 * (np.abs(eigenvalues.imag) < 1e-9)))
    scale = np.concatenate([system.scale_vector(), np.ones(len(system.memory))])
    own = np.zeros(len(scale), dtype=complex)
    own[equilibria.own] = vectors[:, i]
    return np.concatenate([rest.u, system.memory_vector()]), own / np.abs(own / scale).max(), abs(eigenvalues[i].imag)
