r"""The controller: a force from the difference of a periodic reference and the position, sample by sample.

.. math::

    F_k = K_p e_k + K_d d_k, \quad e_k = r(\varphi_k) - y_k, \quad
    d_k = \alpha d_{k-1} + (1 - \alpha) \frac{e_k - e_{k-1}}{t_k - t_{k-1}}, \quad
    \alpha = e^{-(t_k - t_{k-1}) / \tau}
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.control.rig import Rig


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
