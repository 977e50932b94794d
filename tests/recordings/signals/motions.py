"""Motions in closed form, as an encoder of 1440 counts on a wheel of 78.9 mm per turn sees them at 100 Hz."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
COUNT = 0.0789 / 1440


@dataclass(frozen=True)
class Motion:
    t: Floats
    x: Floats
    v: Floats
    a: Floats

    @property
    def counted(self) -> Floats:
        return np.round(self.x / COUNT) * COUNT


def sine(amplitude: float, omega: float, phase: float = 0.0, duration: float = 60.0, rate: float = 100.0) -> Motion:
    t = np.arange(round(duration * rate)) / rate
    angle = omega * t - phase
    return Motion(
        t, amplitude * np.cos(angle), -amplitude * omega * np.sin(angle), -amplitude * omega**2 * np.cos(angle)
    )


def decay(amplitude: float, omega: float, rate: float, duration: float) -> Motion:
    t = np.arange(round(duration * 100)) / 100
    s = complex(-rate, omega)
    z = amplitude * np.exp(s * t)
    return Motion(t, z.real, (s * z).real, (s * s * z).real)


def bounces(restitution: float, speed: float, n: int, rate: float = 100.0) -> tuple[Motion, Floats, Floats]:
    """A ball on a rigid floor: motion until impact n + 1, times of the n impacts, speeds before them."""
    g, begin, starts, speeds = 9.81, 0.0, [0.0], [speed]
    for _ in range(n):
        begin += 2 * speeds[-1] / g
        starts.append(begin)
        speeds.append(restitution * speeds[-1])
    end = begin + 2 * speeds[-1] / g
    t = np.arange(int(end * rate)) / rate
    k = np.searchsorted(starts, t, side="right") - 1
    s, u = t - np.array(starts)[k], np.array(speeds)[k]
    return Motion(t, u * s - g / 2 * s * s, u - g * s, np.full_like(t, -g)), np.array(starts[1:]), np.array(speeds[:-1])


def rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
