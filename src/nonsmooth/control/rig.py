"""``Rig``: the three methods by which an experiment is steered."""

from __future__ import annotations

from typing import Protocol


class Rig(Protocol):
    """An experiment that can be driven, pushed and read.

    Any object with these three methods is a rig: an interface to hardware, or a simulation (:class:`SimulatedRig`).
    Nothing else is asked of it. Three attributes are used where they are there: ``mass`` (from which the gains follow),
    ``names`` (a mapping from "frequency", "amplitude", "position" and "velocity" to the names in results) and ``units``
    (from these names, and "force", to units).
    """

    def set_drive(self, frequency: float, amplitude: float) -> tuple[float, float]:
        """Set the drive's angular frequency and amplitude; return what was really set, to the last step of a knob."""

    def apply_force(self, force: float) -> None:
        """Set the control force on the moving mass; it stays until it is set again."""

    def read(self) -> tuple[float, float]:
        """Wait for the next sample; return the drive's phase in turns, which counts on, and the position."""
