"""Free decays, motor off: taps of the car (Fig. 5) and drops of the support with a test mass on it (Fig. 7)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth import Recording, System
from nonsmooth_savi2007.arrays import FloatArray
from nonsmooth_savi2007.rig import sensors
from nonsmooth_savi2007.rig.physics import NO_SUPPORT, hanging_mass
from nonsmooth_savi2007.rig.sampled import simulated

if TYPE_CHECKING:
    from nonsmooth_savi2007.rig.virtual_rig import VirtualRig

GRAVITY = 9.81  # m/s^2


def impulse(
    rig: VirtualRig,
    *,
    velocities: tuple[float, ...] = (0.5, -0.5, 0.35, -0.35, 0.2, -0.2, 0.1, -0.1),
    duration: float = 20.0,
) -> Recording:
    """Tap the resting car, no support, and let it stop: about these velocities (m/s), one run each: Fig. 5."""
    system = rig.system().with_parameters(rig.parameters(crank_length=0.0, g=NO_SUPPORT))
    runs = []
    for i, velocity in enumerate(velocities):
        rng = rig.generator("impulse", i)
        start = {"v": velocity * float(rng.uniform(0.9, 1.1)), **_stuck(rig, i)}
        slips = rig.truth["slipped_tap"] == i + 1
        runs.append(_decay(rig, rng, f"Run #{i + 1}", system, start, duration, slips=slips))
    return rig.recording("impulse", runs)


def _stuck(rig: VirtualRig, run: int) -> dict[str, float]:
    """Place at which friction holds the car before a tap: the first is made where the sensor was zeroed."""
    if not rig.holding:
        return {}
    held = rig.truth["friction"] / (2 * rig.truth["k"])
    place = rig.truth["sensor_zero"]
    if run:
        place = held * float(np.random.default_rng([rig.seed, 4, run]).uniform(-0.9, 0.9))
    return {"x": place}


def drop(rig: VirtualRig, *, n: int = 6, duration: float = 20.0) -> Recording:
    """Drop the test mass on the support's spring from where the spring is unloaded, or nearly; ``n`` runs: Fig. 7."""
    p = {name: rig.truth[name] for name in ("k_s", "c_s", "test_mass")}
    system = hanging_mass().with_parameters(p)
    sag = p["test_mass"] * GRAVITY / p["k_s"]
    runs = []
    for i in range(n):
        rng = rig.generator("drop", i)
        start = {"x": -sag * float(rng.uniform(0.6, 1.0))}
        runs.append(_decay(rig, rng, f"Run #{i + 1}", system, start, duration))
    return rig.recording("drop", runs)


def _decay(
    rig: VirtualRig,
    rng: np.random.Generator,
    name: str,
    system: System,
    start: dict[str, float],
    duration: float,
    *,
    slips: bool = False,
) -> tuple[str, dict[str, Any], dict[str, Any]]:
    """A run that begins to record a little before the motion begins."""
    begin = float(rng.uniform(0.4, 1.0))
    time, at = sensors.instants(rig, rng, begin + duration)
    moving = at >= begin
    states, _ = simulated(
        system, name, start=start, duration=duration + 0.01, instants=at[moving] - begin, side=rig.truth["motor_side"]
    )
    held = np.zeros((2, len(at)))
    held[0] = start.get("x", 0.0)  # held there until it is let go
    motion: FloatArray = held
    motion[:, moving] = states
    if slips:
        motion[0] -= _slip(rig, at - begin, states)
    return name, rig.channels(rng, name, time, motion[0], motion[1]), {}


def _slip(rig: VirtualRig, since: FloatArray, states: FloatArray) -> FloatArray:
    """Travel (m) that the sensor misses: within 50 ms the string slips on its wheel, in one of the first swings."""
    rng = np.random.default_rng([rig.seed, 5])
    begin = float(rng.uniform(0.5, 2.5))
    missed = float(rng.uniform(0.03, 0.3)) * float(np.max(np.abs(states[0]))) * float(rng.choice([-1.0, 1.0]))
    return np.asarray(missed * np.clip((since - begin) / 0.05, 0.0, 1.0))
