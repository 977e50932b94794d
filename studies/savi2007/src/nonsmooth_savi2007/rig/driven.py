"""Runs with the motor on: settled, then recorded from some phase on; settings that an experimenter would choose.

The steps are taken relative to what is roughly known by then: the natural frequency from a tap, the frequency at
which the car first touches from listening.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from nonsmooth import Recording, SolveError
from nonsmooth_savi2007.rig import sensors
from nonsmooth_savi2007.rig.motor import frequency, mean_position, passages, voltage_for
from nonsmooth_savi2007.rig.physics import NO_SUPPORT, simulated
from nonsmooth_savi2007.rig.truth import NOMINAL_GAP

if TYPE_CHECKING:
    from nonsmooth_savi2007.rig.virtual_rig import VirtualRig


class SteadyRun(NamedTuple):
    """One steady run: voltage (V), crank length and gap at the screw (m; None: no support), and what to note.

    ``release`` is where the car is held and let go (m), the motor running; None: it begins at rest.
    """

    voltage: float
    crank_length: float
    gap: float | None = None
    duration: float = 15.0
    notes: Mapping[str, Any] = MappingProxyType({})
    release: float | None = None


def records(
    rig: VirtualRig, procedure: str, settings: Sequence[SteadyRun], *, settle: float = 20.0, carry: bool = False
) -> Recording:
    """One run per setting, steady after ``settle`` seconds; with ``carry`` each begins where the one before ended."""
    runs = []
    last: xr.Dataset | None = None
    omegas = [frequency(rig, setting.voltage) for setting in settings]  # what cannot be is refused before any run
    for i, (setting, omega) in enumerate(zip(settings, omegas, strict=True)):
        rng, name = rig.generator(procedure, i), f"Run #{i + 1}"
        wander, period = rig.wander(procedure, i, omega), 2 * np.pi / omega
        gap = NO_SUPPORT if setting.gap is None else rig.true_gap(setting.gap)
        before, phase = int(np.ceil(settle / period)), rng.uniform()
        # Whole periods in all, so that the next run can begin where this one ends.
        recorded = int(np.ceil(phase + (setting.duration + 1 / sensors.RATE) / period))
        time, at = sensors.instants(rig, rng, setting.duration)
        begin = (before + phase) * period
        (x, v), ended = simulated(
            rig.system(omega=omega, crank_length=setting.crank_length, g=gap, **wander),
            name,
            instants=begin + at,
            turns=(before, recorded),
            start=at_rest(gap, setting.release or 0.0) if last is None else last,
            side=rig.truth["motor_side"],
        )
        last = ended if carry else None
        crossed = passages(rig, omega, begin, begin + setting.duration, **wander) - begin
        stated = {"crank_length": setting.crank_length, "voltage": setting.voltage, **setting.notes}
        stated |= {} if setting.gap is None else {"gap": setting.gap}
        runs.append((name, rig.channels(rng, name, time, x, v, crossed=crossed), stated))
    return rig.recording(procedure, runs)


def at_rest(gap: float, place: float = 0.0) -> dict[str, float]:
    """Held still at ``place``, the rest position where not given, or just clear of a support that reaches beyond."""
    return {"x": min(place, gap)}


#: Relative to the natural frequency, dense where the curve bends.
RELATIVE = (
    0.55,
    0.7,
    0.8,
    0.86,
    0.9,
    0.93,
    0.95,
    0.97,
    0.985,
    1.0,
    1.015,
    1.03,
    1.05,
    1.07,
    1.1,
    1.14,
    1.2,
    1.3,
    1.45,
    1.7,
)
#: Regimes with contact: frequency (rad/s) and crank length (m), periodic and chaotic ones among them.
REGIMES = (
    (11.15, 0.039),
    (9.55, 0.027),
    (9.88, 0.027),
    (6.0, 0.0165),
    (4.6, 0.0165),
    (3.69, 0.034),
    (10.3, 0.039),
    (8.0, 0.030),
)


def response(
    rig: VirtualRig,
    *,
    crank_lengths: Sequence[float] = (0.0165, 0.035),
    voltages: Sequence[float] | None = None,
    gap: float | None = None,
    duration: float = 12.0,
    after: Sequence[SteadyRun] = (),
) -> Recording:
    """Frequency steps up and then down at each crank length (m), one run per step, the motion carried along: Fig. 6.

    With a ``gap`` (m) Figs. 9 and 10. ``after``: runs that follow, for figures with the support mounted those without
    it.
    """
    natural = np.sqrt(2 * rig.truth["k"] / rig.truth["m"])
    steps = [voltage_for(rig, natural * r) for r in RELATIVE] if voltages is None else list(voltages)
    settings = [
        SteadyRun(voltage, length, gap, duration, {"direction": direction})
        for length in crank_lengths
        for direction, row in (("up", steps), ("down", steps[::-1]))
        for voltage in row
    ]
    return records(rig, "response", [*settings, *after], carry=True)


_GRAZING = 0.010, 0.05  # m, length of the crank; rad/s, from step to step


def grazing(rig: VirtualRig, *, half_width: float = 0.5, duration: float = 15.0) -> Recording:
    """Frequency steps down through the first contact, ``half_width`` rad/s to either side, the motion carried along."""
    length, step = _GRAZING
    centre = graze_frequency(rig, length, NOMINAL_GAP) + rig.generator("grazing", 9999).uniform(-2, 2) * step
    omegas = np.arange(centre + half_width, centre - half_width, -step)
    voltages = dict.fromkeys(voltage_for(rig, omega) for omega in omegas)
    settings = [SteadyRun(voltage, length, NOMINAL_GAP, duration, {"direction": "down"}) for voltage in voltages]
    return records(rig, "grazing", settings, carry=True)


def graze_frequency(rig: VirtualRig, crank_length: float, gap: float) -> float:
    """Above resonance, where a sinusoid just reaches the gap, friction in its first harmonic: where one listens."""
    p = rig.named_parameters(crank_length=crank_length)
    room = rig.true_gap(gap) - mean_position(rig, crank_length)
    dry = 4 / np.pi * p.friction
    omega = 2.0 * np.sqrt(2 * p.k / p.m)
    for _ in range(200):
        along = np.sqrt(max((p.k * crank_length) ** 2 - (dry + p.c * omega * room) ** 2, 0.0))
        before, omega = omega, np.sqrt((2 * p.k + along / room) / p.m)
        if abs(omega - before) < 1e-9 * omega:
            return omega
    raise SolveError(
        f"no frequency above resonance at which a crank of {crank_length:g} m reaches a gap of {room:g} m was found; "
        "use a longer crank or a smaller gap"
    )


def contact(rig: VirtualRig, *, regimes: Sequence[tuple[float, float]] = REGIMES, duration: float = 20.0) -> Recording:
    """Records with contact at (frequency in rad/s, crank length in m), each begun at rest."""
    settings = [SteadyRun(voltage_for(rig, omega), length, NOMINAL_GAP, duration) for omega, length in regimes]
    return records(rig, "contact", settings)
