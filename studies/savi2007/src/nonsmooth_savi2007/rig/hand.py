"""Runs with the motor off: pulls of the car and pushes of the support by hand (Fig. 4), free decays (Figs. 5, 7).

The hand prescribes the motion; the force that the sensor feels is what the rig's equations leave over for it. So the
force-displacement loop has the width 2 (F_C + c v), and a hand trembles.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth import Recording, System
from nonsmooth.arrays import FloatArray
from nonsmooth_savi2007.rig import sensors
from nonsmooth_savi2007.rig.physics import NO_SUPPORT, friction, hanging_mass, simulated

if TYPE_CHECKING:
    from nonsmooth_savi2007.rig.virtual_rig import VirtualRig


Run = tuple[str, Mapping[str, Any], Mapping[str, Any]]
_REACH, _PUSH = 0.12, 35.0  # m, of a pull of the car; N, of a push on the support
_TREMOR = 1e-4  # m, with the frequencies below in Hz
_TREMBLING = (1.1, 1.7, 2.6)
_TURNING = 1.0  # s, that the hand takes to start, to turn, and to stop


def springs(rig: VirtualRig, *, n: int = 6) -> Recording:
    """Pull the car slowly away and back by the force sensor, to both sides in turn; ``n`` runs: Fig. 4a."""
    p = rig.named_parameters(crank_length=0.0)
    limit = p.pretension / p.k
    if _REACH * 1.01 > limit:
        raise ValueError(f"a pull of {_REACH!r} m would slacken a string; stay below {limit:.3f} m")
    return _by_hand(
        rig,
        "springs",
        (40.0, 60.0),
        [(-1.0 if i % 2 else 1.0) * _REACH for i in range(n)],
        0.9,
        lambda x, v, acceleration: p.m * acceleration + 2 * p.k * x + friction(v, p),
    )


def support(rig: VirtualRig, *, n: int = 6) -> Recording:
    """Push the support's spring up and let it come back; ``n`` runs: Fig. 4b."""
    k_s, c_s = rig.truth["k_s"], rig.truth["c_s"]
    return _by_hand(rig, "support", (15.0, 25.0), [_PUSH / k_s] * n, 0.85, lambda y, v, _: k_s * y + c_s * v)


def _by_hand(
    rig: VirtualRig,
    procedure: str,
    lasting: tuple[float, float],
    reaches: Sequence[float],
    least: float,
    force: Callable[[FloatArray, FloatArray, FloatArray], FloatArray],
) -> Recording:
    """One run to about each of ``reaches``, from a share ``least`` of it on; ``force`` on position and its rates."""
    runs: list[Run] = []
    for i, reach in enumerate(reaches):
        rng, name = rig.generator(procedure, i), f"Run #{i + 1}"
        duration, far = rng.uniform(*lasting), reach * rng.uniform(least, 1.0)
        time, at = sensors.instants(rig, rng, duration)
        x, v, acceleration = _hand(rng, at, far, duration)
        runs.append((name, rig.channels(rng, name, time, x, v, pulled=force(x, v, acceleration)), {}))
    return rig.recording(procedure, runs)


def _hand(
    rng: np.random.Generator, t: FloatArray, far: float, duration: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position, velocity and acceleration: to ``far`` and back at an even speed, and a tremor that grows and dies."""
    pulses = ((0.0, 1.0), ((duration - _TURNING) / 2, -2.0), (duration - _TURNING, 1.0))
    x, v, a = np.sum([size * _pulse(t - begin) for begin, size in pulses], axis=0)
    peak = _pulse(np.array([duration / 2]))[0, 0] - 2 * _pulse(np.array([_TURNING / 2]))[0, 0]
    x, v, a = far / peak * np.array([x, v, a])
    w = np.pi / duration
    shape, rate, bend = np.sin(w * t) ** 2, w * np.sin(2 * w * t), 2 * w**2 * np.cos(2 * w * t)
    for frequency in _TREMBLING:
        q = 2 * np.pi * frequency * rng.uniform(0.9, 1.1)
        phase, size = rng.uniform(0, 2 * np.pi), _TREMOR * rng.uniform(0.3, 1.0)
        s, c = size * np.sin(q * t + phase), size * np.cos(q * t + phase)
        x = x + shape * s
        v = v + rate * s + shape * q * c
        a = a + bend * s + 2 * rate * q * c - shape * q**2 * s
    return x, v, a


def _pulse(t: FloatArray) -> FloatArray:
    """Way, velocity and acceleration of a start from rest to unit velocity within ``_TURNING`` seconds, smoothly."""
    tau = np.clip(t / _TURNING, 0.0, 1.0)
    turn = 2 * np.pi * tau
    way = _TURNING * (tau**2 / 2 + (np.cos(turn) - 1) / (4 * np.pi**2)) + np.maximum(t - _TURNING, 0.0)
    inside = (t > 0) & (t < _TURNING)
    return np.array([way, tau - np.sin(turn) / (2 * np.pi), inside * (1 - np.cos(turn)) / _TURNING])


GRAVITY = 9.81  # m/s^2


def impulse(
    rig: VirtualRig,
    *,
    velocities: tuple[float, ...] = (0.5, -0.5, 0.35, -0.35, 0.2, -0.2, 0.1, -0.1),
    duration: float = 20.0,
) -> Recording:
    """Tap the resting car, no support, and let it stop: about these velocities (m/s), one run each: Fig. 5."""
    system = rig.system(crank_length=0.0, g=NO_SUPPORT)
    runs = []
    for i, velocity in enumerate(velocities):
        rng = rig.generator("impulse", i)
        start = {"v": velocity * rng.uniform(0.9, 1.1), **_stuck(rig, i)}
        slips = rig.truth["slipped_tap"] == i + 1
        runs.append(_decay(rig, rng, f"Run #{i + 1}", system, start, duration, slips=slips))
    return rig.recording("impulse", runs)


def _stuck(rig: VirtualRig, run: int) -> dict[str, float]:
    """Place at which friction holds the car before a tap: the first is made where the sensor was zeroed."""
    if not rig.holding:
        return {}
    if not run:
        return {"x": rig.truth["sensor_zero"]}
    held = rig.truth["friction"] / (2 * rig.truth["k"])
    return {"x": held * np.random.default_rng([rig.seed, 4, run]).uniform(-0.9, 0.9)}


def drop(rig: VirtualRig, *, n: int = 6, duration: float = 20.0) -> Recording:
    """Drop the test mass on the support's spring from where the spring is unloaded, or nearly; ``n`` runs: Fig. 7."""
    p = {name: rig.truth[name] for name in ("k_s", "c_s", "test_mass")}
    system = hanging_mass().with_parameters(p)
    sag = p["test_mass"] * GRAVITY / p["k_s"]
    runs = []
    for i in range(n):
        rng = rig.generator("drop", i)
        start = {"x": -sag * rng.uniform(0.6, 1.0)}
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
) -> Run:
    """A run that begins to record a little before the motion begins."""
    begin = rng.uniform(0.4, 1.0)
    time, at = sensors.instants(rig, rng, begin + duration)
    moving = at >= begin
    states, _ = simulated(
        system, name, start=start, duration=duration + 0.01, instants=at[moving] - begin, side=rig.truth["motor_side"]
    )
    motion = np.zeros((2, len(at)))
    motion[0] = start.get("x", 0.0)  # held there until it is let go
    motion[:, moving] = states
    if slips:
        motion[0] -= _slip(rig, at - begin, states)
    return name, rig.channels(rng, name, time, *motion), {}


def _slip(rig: VirtualRig, since: FloatArray, states: FloatArray) -> FloatArray:
    """Travel (m) that the sensor misses: within 50 ms the string slips on its wheel, in one of the first swings."""
    rng = np.random.default_rng([rig.seed, 5])
    begin = rng.uniform(0.5, 2.5)
    missed = rng.uniform(0.03, 0.3) * np.max(np.abs(states[0])) * rng.choice([-1.0, 1.0])
    return missed * np.clip((since - begin) / 0.05, 0.0, 1.0)
