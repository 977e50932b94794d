"""One measurement of a motion that is held to a reference: its harmonics, and those of the control force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nonsmooth.arrays import ComplexArray
from nonsmooth.control.controller import Controller, Samples
from nonsmooth.control.harmonics import FourierSeries, fitted, mean_square
from nonsmooth.control.holding import Holding
from nonsmooth.control.rig import Guard

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
