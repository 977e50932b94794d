"""Free decays, motor off: taps of the car (Fig. 5) and drops of the support with a test mass on it (Fig. 7)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.experiment.rig import sensors
from nonsmooth.experiment.rig.physics import NO_SUPPORT, hanging_mass
from nonsmooth.experiment.rig.sampled import sampled

if TYPE_CHECKING:
    from nonsmooth.experiment.recording import Recording
    from nonsmooth.experiment.rig.virtual_rig import VirtualRig
    from nonsmooth.system.system import System

__all__ = ["drop", "impulse"]

GRAVITY = 9.81  # m/s^2


def impulse(
    rig: VirtualRig, *, velocities: tuple[float, ...] = (0.5, -0.5, 0.35, -0.35, 0.2, -0.2, 0.1, -0.1),
    duration: float = 20.0,
) -> Recording:  # fmt: skip
    """Tap the resting car, no support, and let it come to rest: about these velocities (m/s), one run each."""
    system = rig.system().with_parameters(rig.parameters(crank_length=0.0, g=NO_SUPPORT))
    runs = []
    for i, velocity in enumerate(velocities):
        rng = rig.generator("impulse", i)
        start = {"v": velocity * float(rng.uniform(0.9, 1.1))}
        runs.append(_decay(rig, rng, f"Run #{i + 1}", system, start, duration))
    return rig.recording("impulse", runs)


def drop(rig: VirtualRig, *, n: int = 6, duration: float = 20.0) -> Recording:
    """Hang the test mass on the support's spring, drop it from where the spring is unloaded, or nearly; ``n`` runs."""
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
    rig: VirtualRig, rng: np.random.Generator, name: str, system: System, start: dict[str, float], duration: float
) -> tuple[str, dict[str, Any], dict[str, Any]]:
    """A run that begins to record a little before the motion begins."""
    begin = float(rng.uniform(0.4, 1.0))
    time, at = sensors.instants(rig, rng, begin + duration)
    moving = at >= begin
    states = sampled(system, name, start=start, duration=duration + 0.01, instants=at[moving] - begin)
    held = np.zeros((2, len(at)))
    held[0] = start.get("x", 0.0)  # held there until it is let go
    motion: NDArray[np.float64] = held
    motion[:, moving] = states
    return name, rig.channels(rng, name, time, motion[0], motion[1]), {}
