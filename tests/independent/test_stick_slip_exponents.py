"""Lyapunov spectra of chaotic stick-slip motion against the onset map of an independent program.

Both exponents are known there: a stick forgets a direction, so that one is minus infinity; the other is the mean of the
logarithm of the map's derivative over the mean time between onsets.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from stick_slip_reference import StickSlip

import nonsmooth as ns

pytestmark = pytest.mark.physics

BEGIN = [0.3, 0.1]
BATCHES = 32


def dry() -> tuple[ns.System, StickSlip]:
    """Kinetic friction of half the static one: the exact flow."""
    system = ns.models.dry_friction_oscillator(f_0=0.5, f_k=0.5, f_s=1.0, v_b=0.2, omega=1.225)
    return system, StickSlip(0.5, 1.225, lambda v: 0.5 + 0 * v, 1.0, 0.2)


def stribeck() -> tuple[ns.System, StickSlip]:
    """A friction that falls with the speed: Taylor series."""
    system = ns.models.stribeck_oscillator(v_b=0.3, u_0=0.3, omega=0.6)
    return system, StickSlip(0.3, 0.6, lambda v: 0.3 / (1 + 1.42 * v) + 0.1 + 0.01 * v * v, 0.4, 0.3)


def onsets(system: ns.System, periods: int) -> tuple[np.ndarray, np.ndarray]:
    """Times at which sticks end, and the directions of the slips that begin."""
    run = ns.simulate(system, periods=periods, start=BEGIN, samples=2)
    names = [system.transitions[i].label for i in run.crossing_transition.values]
    sticks = np.array(["stick ->" in name for name in names])
    side = np.where([name.endswith("forward") for name in names], 1.0, -1.0)
    return run.crossing_time.values[sticks][1:], side[sticks][1:]


@pytest.mark.parametrize("make", [dry, stribeck])
def test_growth_over_some_onsets(make: Callable[[], tuple[ns.System, StickSlip]]) -> None:
    """Just before an onset x alone depends on the start, and the onset moves by dx / (d pull / dt)."""
    system, reference = make()
    t, side = onsets(system, 20)
    first, last = 1, 9

    def moved(k: int) -> float:
        early = 1e-9
        slope = ns.sensitivity(system, duration=t[k] - early, start=BEGIN).Phi.values[0]
        return slope[0] / (-reference.amplitude * reference.w * np.sin(reference.w * t[k]) - reference.belt)

    slopes = reference.slope(t[first:last], side[first:last])
    assert moved(last) / moved(first) == pytest.approx(np.prod(slopes), rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("make", [dry, stribeck])
def test_spectra_of_chaotic_stick_slip(make: Callable[[], tuple[ns.System, StickSlip]]) -> None:
    system, reference = make()
    periods = 3000
    t, side = onsets(system, periods)
    phase = np.mod(t[:-1], 2 * np.pi / reference.w)
    gaps = np.abs(reference.next_onset(phase, side[:-1]) - phase - np.diff(t))
    grown = np.log(np.abs(reference.slope(phase, side[:-1])))
    parts = [
        batch.sum() / np.diff(t)[i].sum()
        for i in np.array_split(np.arange(len(grown)), BATCHES)
        for batch in [grown[i]]
    ]
    expected, error = grown.sum() / np.diff(t).sum(), np.std(parts, ddof=1) / BATCHES**0.5
    found = ns.lyapunov(system, periods=periods, start=BEGIN, progress=False)
    exponents, own = found.exponents.values, float(found.standard_error[0])
    print(
        f"\n{system.name}: {len(t)} onsets, next ones within {gaps.max():.1e}; exponents {exponents[0]:.5f} +- "
        f"{own:.5f} and {exponents[1]}, map {expected:.5f} +- {error:.5f}"
    )
    assert len(t) > 2000 and gaps.max() < 1e-6
    assert exponents[1] == -np.inf
    assert exponents[0] > 0.02
    assert abs(exponents[0] - expected) < 4 * np.hypot(own, error)
    assert np.hypot(own, error) < 0.05 * expected
