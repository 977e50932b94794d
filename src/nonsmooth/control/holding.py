r"""``Holding``: how a controller holds a motion to a reference, what one measurement gives, and how it is let go.

.. math::

    F_k = K_p e_k + K_d d_k, \quad e_k = r(\varphi_k) - y_k, \quad
    d_k = \alpha d_{k-1} + (1 - \alpha) \frac{e_k - e_{k-1}}{t_k - t_{k-1}}, \quad
    \alpha = e^{-(t_k - t_{k-1}) / \tau}
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.control.rig import Guard, Rig
from nonsmooth.errors import SolveError
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Count, Natural, Positive, Range, at_least, real_number


class Samples(NamedTuple):
    """Samples of a run: phase of the drive (turns), position, and the force that was applied."""

    phase: FloatArray
    position: FloatArray
    force: FloatArray


@dataclass
class Controller:
    """Gains, and the rig that they act on."""

    rig: Rig
    proportional: float
    derivative: float
    smoothing: float  # tau

    def run(self, reference: ComplexArray | None, frequency: float, turns: int) -> Samples:
        """March the rig for whole turns of the drive, held to the reference; without one no force acts."""
        rows: list[tuple[float, float, float]] = []
        order = None if reference is None else 2j * np.pi * np.arange(len(reference))
        error = slope = begin = before = 0.0
        if reference is None:
            self.rig.apply_force(0.0)
        while True:
            phase, position = self.rig.read()
            if not rows:
                begin = phase
            elif phase - rows[-1][0] >= 1.0:
                why = f"the phase of the drive went from {rows[-1][0]:.6g} to {phase:.6g} between two readings"
                raise SolveError(
                    f"stopped: {why}, a turn or more: some are missing, or it is not in turns", status="stopped"
                )
            elif phase - begin >= turns:
                break
            force = 0.0
            if order is not None:
                now = float(np.real(np.exp(order * phase) @ reference)) - position
                if rows:
                    elapsed = 2 * np.pi * (phase - before) / frequency
                    kept = math.exp(-elapsed / self.smoothing)
                    slope = kept * slope + (1 - kept) * (now - error) / elapsed
                    force = self.proportional * now + self.derivative * slope
                error, before = now, phase
                self.rig.apply_force(force)
            rows.append((phase, position, force))
        table = np.array(rows)
        return Samples(table[:, 0], table[:, 1], table[:, 2])


SEEN = 4.0  # standard uncertainties


@dataclass(frozen=True)
class FourierSeries:
    """Coefficients c_0 ... c_H, and the standard uncertainty of each one's real and imaginary part."""

    c: ComplexArray
    u: FloatArray

    @property
    def seen(self) -> ComplexArray:
        """Coefficients that stand out of their noise, and 0 for the others, whose noise would add to extremes."""
        return np.where(np.abs(self.c) > SEEN * self.u, self.c, 0.0)


def values_at(c: ComplexArray, phase: FloatArray, derivative: int = 0) -> FloatArray:
    """Values of a series at phases (in turns), or of its derivative with respect to the angle."""
    h = np.arange(len(c))
    return np.asarray(np.real(np.exp(2j * np.pi * np.multiply.outer(phase, h)) @ ((1j * h) ** derivative * c)))


def mean_square(c: ComplexArray) -> float:
    """Mean square of a series over a turn."""
    return float(np.abs(c[0]) ** 2 + 0.5 * np.sum(np.abs(c[1:]) ** 2))


def fitted(phase: FloatArray, values: FloatArray, harmonics: int) -> FourierSeries:
    """Fit the harmonics 0 ... H to samples over whole turns, by least squares.

    The uncertainties are from the scatter between turns, so that noise of any colour, drift, and motion that does not
    repeat with each turn are all in them.
    """
    h = np.arange(1, harmonics + 1)
    angle = 2 * np.pi * np.multiply.outer(phase, h)
    design = np.hstack([np.ones((len(phase), 1)), np.cos(angle), np.sin(angle)])
    found, *_ = np.linalg.lstsq(design, values, rcond=None)
    c = np.concatenate([found[:1], found[1 : harmonics + 1] - 1j * found[harmonics + 1 :]]).astype(complex)
    left = values - design @ found
    turn = np.floor(phase - phase[0]).astype(int)
    turns = int(turn[-1]) + 1
    waves = np.exp(-2j * np.pi * np.multiply.outer(phase, np.arange(harmonics + 1))) * left[:, None]
    rows = np.array([waves[turn == k].mean(axis=0) for k in range(turns)])
    rows[:, 1:] *= 2.0
    spread = np.sqrt(np.sum(np.abs(rows) ** 2, axis=0) / max(turns - 1, 1) / turns)
    spread[1:] /= np.sqrt(2.0)  # of each part
    return FourierSeries(c, spread)


@checked
@dataclass(frozen=True, kw_only=True)
class Holding:
    r"""Gains and limits of the controller, and the turns of the drive that each measurement takes.

    Every reading and every force is checked. Where one is beyond its limit, no finite number, or the same for a whole
    turn of the drive, and where the rig raises an exception, the force is set to zero before the next reading and the
    points measured until then are the result.

    Parameters
    ----------
    mass : float, optional
        The moving mass, from which the gains follow; where not given, the rig's attribute ``mass``.
    gains : (K_p, K_d), optional
        In place of the rule :math:`K_p = 0`, :math:`K_d = m \omega`.
    greatest_force : float, optional
        Of the actuator: a larger one is never commanded. Where not given, three times the force with which the
        controller answers to a displacement of the motion's own size.
    greatest_position : float or (low, high), optional
        Range of the readings: up to this distance from 0, or from low to high. No limit where not given.
    harmonics : int, optional
        Of the reference; 20 where not given, fewer where the rig is read fewer than 50 times per turn.
    transient : int
        Turns of the drive before the first measurement.
    settle, record : int
        Turns of the drive to wait and to record in each measurement.
    release : int
        Turns of the drive for which each motion found is let go, to see whether it is stable; 0: that is not done.
    tolerance : float
        Largest control force at convergence, over that which would move the reference by the size of the motion; the
        force may be larger where its noise is.

    Raises
    ------
    ValueError, TypeError
        Values that make no sense.
    """

    mass: Positive | None = None
    gains: Annotated[tuple[float, float], "give (K_p, K_d), two numbers"] | None = None
    greatest_force: Positive | None = None
    greatest_position: Positive | Range | None = None
    harmonics: Natural | None = None
    transient: Count = 50
    settle: Natural = 5
    record: Annotated[int, at_least(3)] = 10
    release: Count = 12
    tolerance: Positive = 1e-3

    def __post_init__(self) -> None:
        if self.gains is not None and self.gains[1] <= 0:
            raise ValueError(f"K_d = {self.gains[1]:g}: without damping the controller holds nothing; give more than 0")

    @property
    def positions(self) -> tuple[float, float]:
        """Least and greatest reading."""
        far = math.inf if self.greatest_position is None else self.greatest_position
        return far if isinstance(far, tuple) else (-far, far)

    def mass_of(self, rig: Any) -> float:
        """Mass from which the gains follow; 1 where they are given.

        Raises
        ------
        ValueError
            It is not known.
        """
        if self.gains is not None:
            return 1.0
        mass = getattr(rig, "mass", None) if self.mass is None else self.mass
        if mass is None:
            raise ValueError(
                "the gains follow from the moving mass: give holding=Holding(mass=...), roughly, or "
                "holding=Holding(gains=(K_p, K_d))"
            )
        if real_number(mass, "mass") <= 0:
            raise ValueError(f"mass = {mass!r} of the rig must be positive")
        return float(mass)


REPEATS = 0.01  # scatter of the first harmonic over its size: beyond it a motion is not of the drive's period
FORCE = 3.0  # the greatest where none is given, over that which answers to a displacement of the motion's size


@dataclass(frozen=True)
class Held:
    """A held motion. ``reference`` is what the controller aimed at."""

    frequency: float
    amplitude: float
    reference: ComplexArray
    position: FourierSeries
    force: FourierSeries
    force_rms: float

    @property
    def repeats(self) -> bool:
        """Return whether the motion repeats with each turn of the drive."""
        return bool(self.position.u[1] < REPEATS * abs(self.position.c[1]))

    @property
    def effort(self) -> float:
        """Root mean square of the control force that repeats with each turn."""
        return float(np.sqrt(mean_square(self.force.c)))

    @property
    def effort_noise(self) -> float:
        """The same of noise alone."""
        return float(np.sqrt(np.sum(self.force.u**2)))


@dataclass
class Holder:
    """A rig that is held as `Holding` says, with the mass by which its gains go."""

    rig: Guard
    holding: Holding
    mass: float
    harmonics: int = 3
    size: float = 0.0  # of the first motion
    turns: int = 0  # of the drive, so far

    def stiffness(self, frequency: float) -> float:
        """Force per displacement of the controller at the drive's frequency."""
        proportional, derivative = self.gains_at(frequency)
        return float(np.hypot(proportional, frequency * derivative))

    def gains_at(self, frequency: float) -> tuple[float, float]:
        """Gains: K_d = m omega, K_p = 0 where none were given."""
        return self.holding.gains or (0.0, self.mass * frequency)

    def run(self, frequency: float, reference: ComplexArray | None, turns: int) -> Samples:
        """March for whole turns, held to the reference or free."""
        controller = Controller(self.rig, *self.gains_at(frequency), smoothing=1.0 / (5.0 * frequency))
        self.turns += turns
        if reference is not None:
            size = max(self.size, float(np.linalg.norm(reference[1:])))
            self.rig.force = self.holding.greatest_force or FORCE * self.stiffness(frequency) * size
        return controller.run(reference, frequency, turns)

    def hold(self, frequency: float, amplitude: float, reference: ComplexArray | None) -> Held:
        """Set the drive, wait, record."""
        frequency, amplitude = self.rig.set_drive(frequency, amplitude)
        settle = self.holding.settle
        samples = self.run(frequency, reference, settle + self.holding.record)
        kept = samples.phase >= samples.phase[0] + settle
        phase, position, force = (column[kept] for column in samples)
        shown = fitted(phase, position, self.harmonics)
        aimed = shown.c if reference is None else reference
        pushed = fitted(phase, force, self.harmonics)
        return Held(frequency, amplitude, aimed, shown, pushed, float(np.sqrt(np.mean(force**2))))


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
