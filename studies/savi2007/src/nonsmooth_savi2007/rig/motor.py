r"""The motor: its turning, and the calibrations of its voltage and of the crank (Fig. 8).

The crank's angle is :math:`\varphi = \omega t + \epsilon \sin(\omega t + \beta)` with
:math:`\omega = s (V - V_0)`: no turning below an offset, and a ripple that repeats with each turn. The photogate sees
the crank pass :math:`\varphi = 0` modulo one turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth import Recording
from nonsmooth.arrays import FloatArray
from nonsmooth_savi2007.rig import sensors
from nonsmooth_savi2007.rig.physics import crank_angle, drive

if TYPE_CHECKING:
    from nonsmooth_savi2007.rig.virtual_rig import VirtualRig

MAX_VOLTAGE = 12.0  # V
_TURNS, _HELD = 40, 20.0  # turns of the motor alone; s, of a car that is held
VOLTAGE_STEP = 0.001  # V, of the supply's knob


def frequency(rig: VirtualRig, voltage: float) -> float:
    """Mean angular frequency (rad/s) at a voltage (V).

    Raises
    ------
    ValueError
        Beyond the supply's range, or too low for the motor to turn.
    """
    offset = rig.truth["motor_offset"]
    if not offset < voltage <= MAX_VOLTAGE:
        raise ValueError(f"voltage = {voltage!r} V: this motor turns from {offset:.2f} V on, to {MAX_VOLTAGE:.0f} V")
    return rig.truth["motor_slope"] * (voltage - offset)


def voltage_for(rig: VirtualRig, omega: float) -> float:
    """The voltage for a wanted frequency, to the last step of the knob."""
    exact = rig.truth["motor_offset"] + omega / rig.truth["motor_slope"]
    return round(VOLTAGE_STEP * round(exact / VOLTAGE_STEP), 6)


def mean_position(rig: VirtualRig, crank_length: float) -> float:
    r"""Mean position (m) of the car that swings freely under the drive: half the mean of the driven end.

    To first order :math:`s [a^2 / (8 L) - a \epsilon \cos(\beta) / 4]`: the string's part and the uneven turning's.
    """
    turn = np.arange(4096) * (2 * np.pi / 4096)
    moved = np.mean(drive(turn, rig.named_parameters(omega=1.0), crank_length)) / 2
    return rig.truth["motor_side"] * moved


def passages(rig: VirtualRig, omega: float, begin: float, end: float, **wander: float) -> FloatArray:
    """The times in [begin, end] at which the crank's angle is a multiple of 2 pi; ``wander`` as `VirtualRig.wander`.

    Each by Newton's method from where even turning has it: the slope is omega (1 +- the ripple), so this contracts.
    """
    p = rig.named_parameters(omega=omega, **wander)
    first, last = crank_angle(np.array([begin, end]), p, bool(wander)) / (2 * np.pi)
    target = 2 * np.pi * np.arange(np.ceil(first), np.floor(last) + 1)
    at = target / omega
    for _ in range(50):
        off = crank_angle(at, p, bool(wander)) - target
        at = at - off / omega
        if np.max(np.abs(off), initial=0.0) < 1e-12:
            break
    return at


def voltage(rig: VirtualRig, *, voltages: Sequence[float] = range(2, 13)) -> Recording:
    """The motor alone, at one voltage (V) per run, for some forty passages of the photogate: Fig. 8a."""
    runs = []
    for i, setting in enumerate(voltages):
        rng = rig.generator("voltage", i)
        omega = frequency(rig, setting)
        begin = rng.uniform(0, 2 * np.pi / omega)
        end = begin + _TURNS * 2 * np.pi / omega
        crossed = passages(rig, omega, begin, end, **rig.wander("voltage", i, omega)) - begin
        runs.append((f"Run #{i + 1}", {"Turn": sensors.turns(rig, crossed)}, {"voltage": float(setting)}))
    return rig.recording("voltage", runs)


def crank(
    rig: VirtualRig,
    *,
    lengths: Sequence[float] = (0.01, 0.015, 0.02, 0.025, 0.03, 0.04, 0.05, 0.06),
    voltage: float = 4.0,
) -> Recording:
    """The car held at x = 0 by the force sensor, at one crank length (m) per run, feels k d(phi): Fig. 8b."""
    runs = []
    omega = frequency(rig, voltage)
    for i, length in enumerate(lengths):
        rng, name = rig.generator("crank", i), f"Run #{i + 1}"
        begin = rng.uniform(0, 2 * np.pi / omega)
        time, at = sensors.instants(rig, rng, _HELD)
        wander = rig.wander("crank", i, omega)
        p = rig.named_parameters(omega=omega, crank_length=length, **wander)
        pulled = rig.truth["motor_side"] * p.k * drive(begin + at, p, p.crank_length, rig.wanders)
        crossed = passages(rig, omega, begin, begin + _HELD, **wander) - begin
        channels = {"Force": sensors.force(rig, rng, name, time, pulled), "Turn": sensors.turns(rig, crossed)}
        runs.append((name, channels, {"crank_length": float(length), "voltage": voltage}))
    return rig.recording("crank", runs)
