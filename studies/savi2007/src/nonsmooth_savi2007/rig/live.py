"""The virtual rig under the hands of a controller: its motor, its rotary sensor, and an actuator on the car."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nonsmooth import SimulatedRig
from nonsmooth_savi2007.rig.figures import screw_for
from nonsmooth_savi2007.rig.motor import frequency as motor_frequency
from nonsmooth_savi2007.rig.motor import voltage_for
from nonsmooth_savi2007.rig.physics import METHOD
from nonsmooth_savi2007.rig.sensors import COUNT, RATE

if TYPE_CHECKING:
    from nonsmooth_savi2007.rig.virtual_rig import VirtualRig


class LiveRig(SimulatedRig):
    """A virtual rig as the three methods of a live one.

    The position is read in counts of the rotary sensor, at the interface's 100 Hz with its jitter; the motor turns at
    the frequency of the nearest step of its voltage. The actuator is one that the paper's rig has not: it pushes the
    car with the force that it is told to, without error or delay.

    Parameters
    ----------
    rig : VirtualRig
    gap : float
        Gap (m) from the car's mean position under the drive of this crank.
    crank_length : float
        Length of the crank (m) at the beginning.
    omega : float
        Frequency of the drive (rad/s) at the beginning.
    run : int
        Number of the run, which has random numbers of its own.
    """

    def __init__(self, rig: VirtualRig, *, gap: float, crank_length: float, omega: float = 4.5, run: int = 0) -> None:
        if rig.wanders:
            raise ValueError("a motor that wanders has no phase to which a reference could be tied: motor_wander = 0")
        self._rig = rig
        screw = screw_for(rig, gap, crank_length)
        at_rest = rig.true_gap(screw)
        super().__init__(
            rig.system().with_parameters(rig.parameters(omega=omega, crank_length=crank_length, g=at_rest)),
            amplitude="crank_length",
            rate=RATE,
            resolution=COUNT if rig.quantisation else 0.0,
            jitter=rig.truth["clock_jitter"],
            seed=rig.seed + 1000 * run,
            start={"x": min(0.0, at_rest)},
            method=METHOD["method"],
        )
        self.units["force"] = "N"

    def set_drive(self, frequency: float, amplitude: float) -> tuple[float, float]:
        """Set the motor's voltage and the crank; return the frequency (rad/s) that it turns at, and the crank (m)."""
        return super().set_drive(motor_frequency(self._rig, voltage_for(self._rig, frequency)), amplitude)

    def reading(self, position: float) -> float:
        """Return what the rotary sensor shows at a position (m)."""
        counts = self._rig.truth["encoder_zero"] * COUNT - self._rig.truth["sensor_zero"]
        return super().reading(position + counts)
