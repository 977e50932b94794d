"""Runs with the motor on: the car is let settle, then recorded from some phase on, with the photogate's times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from nonsmooth import Recording
from nonsmooth_savi2007.rig import sensors
from nonsmooth_savi2007.rig.motor import frequency, passages
from nonsmooth_savi2007.rig.physics import NO_SUPPORT, Wander
from nonsmooth_savi2007.rig.sampled import simulated

if TYPE_CHECKING:
    from nonsmooth_savi2007.rig.virtual_rig import VirtualRig


@dataclass(frozen=True)
class SteadyRun:
    """One steady run: voltage (V), crank length and gap at the screw (m; None: no support), and what to note.

    ``release`` is where the car is held and let go (m), the motor running; None: it begins at rest.
    """

    voltage: float
    crank_length: float
    gap: float | None = None
    duration: float = 15.0
    notes: tuple[tuple[str, Any], ...] = ()
    release: float | None = None

    def stated(self) -> dict[str, Any]:
        """The settings as they go into the notebook."""
        gap = {} if self.gap is None else {"gap": self.gap}
        return {"crank_length": self.crank_length, "voltage": self.voltage, **gap, **dict(self.notes)}


def records(
    rig: VirtualRig, procedure: str, settings: Sequence[SteadyRun], *, settle: float = 20.0, carry: bool = False
) -> Recording:
    """One run per setting, steady after ``settle`` seconds; with ``carry`` each begins where the one before ended."""
    runs = []
    last: xr.Dataset | None = None
    for i, setting in enumerate(settings):
        rng, name = rig.generator(procedure, i), f"Run #{i + 1}"
        wander = rig.wander(procedure, i, frequency(rig, setting.voltage))
        channels, ended = _steady(rig, rng, name, setting, settle, last, wander)
        last = ended if carry else None
        runs.append((name, channels, setting.stated()))
    return rig.recording(procedure, runs)


def _steady(
    rig: VirtualRig,
    rng: np.random.Generator,
    name: str,
    setting: SteadyRun,
    settle: float,
    last: xr.Dataset | None,
    wander: Wander,
) -> tuple[Mapping[str, Any], xr.Dataset]:
    omega = frequency(rig, setting.voltage)
    gap = NO_SUPPORT if setting.gap is None else rig.true_gap(setting.gap)
    set_to = rig.parameters(omega=omega, crank_length=setting.crank_length, g=gap) | named(wander)
    system = rig.system().with_parameters(set_to)
    period = 2 * np.pi / omega
    before, phase = int(np.ceil(settle / period)), float(rng.uniform())
    # Whole periods in all, so that the next run can begin where this one ends.
    recorded = int(np.ceil(phase + (setting.duration + 1 / sensors.RATE) / period))
    time, at = sensors.instants(rig, rng, setting.duration)
    begin = (before + phase) * period
    start = _at_rest(gap, setting.release or 0.0) if last is None else last
    (x, v), result = simulated(
        system,
        name,
        instants=begin + at,
        turns=(before, recorded),
        start=start,
        side=rig.truth["motor_side"],
    )
    crossed = passages(rig, omega, begin, begin + setting.duration, wander) - begin
    return rig.channels(rng, name, time, x, v, crossed=crossed), result


def rise(
    rig: VirtualRig,
    *,
    voltage: float,
    crank_length: tuple[float, float],
    gap: float,
    duration: float,
    settle: float = 30.0,
) -> Recording:
    """The forcing rises slowly: the crank grows evenly from one length to the other (m) in ``duration`` seconds."""
    rng, name = rig.generator("rise", 0), "Run #1"
    omega = frequency(rig, voltage)
    period = 2 * np.pi / omega
    first, last = crank_length
    rate = (last - first) / duration
    wander = rig.wander("rise", 0, omega)
    set_to = rig.parameters(rising=True, omega=omega, g=rig.true_gap(gap)) | named(wander)
    system = rig.system(rising=True).with_parameters(set_to)
    whole = int(np.ceil(settle / period))
    start: Any = {**_at_rest(rig.true_gap(gap)), "a": first}
    side = rig.truth["motor_side"]
    _, settled = simulated(
        system,
        name,
        instants=np.array([0.0]),
        turns=(0, whole),
        start=start,
        side=side,
    )
    time, at = sensors.instants(rig, rng, duration)
    x, v = simulated(
        system.with_parameters(crank_rate=rate),
        name,
        instants=at,
        duration=duration + 1 / sensors.RATE,
        start=settled,
        side=side,
    )[0]
    channels = rig.channels(rng, name, time, x, v, crossed=passages(rig, omega, 0.0, duration, wander))
    note = f"crank grows evenly, {rate:.3e} m/s, {rate * period:.3e} m per turn"
    stated = {
        "crank_length": first,
        "crank_length_end": last,
        "voltage": voltage,
        "gap": gap,
        "figure": 11,
        "note": note,
    }
    return rig.recording("rise", [(name, channels, stated)])


def named(wander: Wander) -> dict[str, float]:
    """The slow terms of the motor's angle as parameters of the system."""
    words = ("wander", "wander_rate", "wander_phase")
    return {f"{word}_{j}": term[i] for j, term in enumerate(wander, 1) for i, word in enumerate(words)}


def _at_rest(gap: float, place: float = 0.0) -> dict[str, float]:
    """Held still at ``place``, the rest position where not given, or just clear of a support that reaches beyond."""
    return {"x": min(place, gap)}
