"""The cycles that emanate from a Hopf point, and from a focus-centre."""

from __future__ import annotations

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.continuation.branches.records import RestRecord
from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits
from nonsmooth.continuation.problems.shooting import Shooting
from nonsmooth.continuation.problems.signature import Round, Signature, Visit
from nonsmooth.flow.mode_fields import ModeField, mode_field
from nonsmooth.system.system import System

ANGLES = 720
LARGEST = 1e6  # of the states' scales
SMALL = 1e-2  # amplitude of the first cycle, in units of the states' scales


def first_cycle(kind: str, system: System, name: str, rest: RestRecord, width: float) -> OrbitPoint | None:
    r"""The first of the cycles that emanate from a Hopf point, or from a focus-centre.

    Of a Hopf point a small one, :math:`u + \epsilon \, \mathrm{Re}(q e^{i \omega t})`. At a focus-centre every
    :math:`u + A \, \mathrm{Re}(q e^{i \theta})` within the linear mode is closed; the cycle leaves the largest of them,
    which touches, and the first is a little larger. Its size is kept and the parameter solved for.
    """
    mode, values, memory = rest.mode, system.parameter_vector(), system.memory_vector()
    field, size = mode_field(system.traced, mode), np.concatenate([system.scale_vector(), np.ones(len(memory))])
    eigenvalues, vectors = np.linalg.eig(field.evaluate(rest.u, values, memory)[1])
    i = int(np.argmin(np.abs(eigenvalues.real) + 1e3 * (np.abs(eigenvalues.imag) < 1e-9)))
    rested, own = np.concatenate([rest.u, memory]), np.zeros(len(size), dtype=complex)
    own[field.own] = vectors[:, i]
    own /= np.abs(own / size).max()  # the eigenvector of the imaginary pair, of unit size
    period, signature = 2 * np.pi / abs(eigenvalues[i].imag), Signature((Visit(mode),))
    # Begun where its real part is largest, so that the section lies across the flow.
    turn, amplitude = complex(np.exp(-1j * np.angle(np.sum(own**2 / size**2)) / 2)), SMALL
    if kind == "focus_centre":
        touching = _touching(field, rested, own, values)
        if touching is None:
            return None
        turn, amplitude = touching
        size[: len(rest.u)] = np.abs(amplitude * own).real.max()
    curve = Orbits(Shooting(system, signature, 0, (name,)), size, period, (width,))
    for factor in (1.0, 0.3, 3.0) if kind == "hopf" else (1.03, 1.1, 1.01, 1.3):
        z = rested + factor * amplitude * (own * turn).real
        once = Round(0, period, signature, np.empty(0), z[None, :])
        if kind == "focus_centre":
            read = curve.rounds.free(values, z, mode, 0.0, period)
            if read is None or not len(read.times):
                continue
            once = read
        fresh, X = curve.around(once, [rest.value])
        border = np.zeros(fresh.n)
        border[: len(size)] = (X[: len(size)] - rested) / size
        point = fresh.near(X / fresh.scale, border / np.linalg.norm(border), most=20)
        if point is not None and not point.virtual and np.nanmax(point.path.maximum - point.path.minimum) > 0:
            return point
    return None


def _touching(
    field: ModeField, rested: FloatArray, own: ComplexArray, values: FloatArray
) -> tuple[complex, float] | None:
    """A phase well within the mode, and the amplitude with which a closed orbit touches its boundary; None: none."""
    from scipy.optimize import brentq

    n = len(field.traced.u)
    turns = np.exp(2j * np.pi * np.arange(ANGLES) / ANGLES)

    def margins(amplitude: float) -> FloatArray:
        states = (rested + amplitude * (own * turns[:, None]).real)[:, :n]
        return np.array([field.margins(field.indicators(one, values, rested[n:])[0]).max() for one in states])

    large = 1.0
    while margins(large).max() < 0.0:
        large *= 2.0
        if large > LARGEST:
            return None  # nothing bounds the mode: no cycle
    large = brentq(lambda amplitude: margins(amplitude).max(), 0.0, large, xtol=1e-12)
    return complex(turns[int(margins(large).argmin())]), large
