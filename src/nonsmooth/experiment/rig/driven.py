"""Runs with the motor on: the car is let settle, then recorded from some phase on, with the photogate's times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.experiment.rig import sensors
from nonsmooth.experiment.rig.motor import frequency, passages
from nonsmooth.experiment.rig.physics import NO_SUPPORT
from nonsmooth.experiment.rig.sampled import simulated

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.experiment.recording import Recording
    from nonsmooth.experiment.rig.virtual_rig import VirtualRig
    from nonsmooth.system.system import System

__all__ = ["Setting", "records", "rise"]


@dataclass(frozen=True)
class Setting:
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
    rig: VirtualRig, procedure: str, settings: Sequence[Setting], *, settle: float = 20.0, carry: bool = False
) -> Recording:
    """One run per setting, steady after ``settle`` seconds; with ``carry`` each begins where the one before ended."""
    runs = []
    last: xr.Dataset | None = None
    for i, setting in enumerate(settings):
        rng, name = rig.generator(procedure, i), f"Run #{i + 1}"
        channels, ended = _steady(rig, rng, name, setting, settle, last)
        last = ended if carry else None
        runs.append((name, channels, setting.stated()))
    return rig.recording(procedure, runs)


def _steady(
    rig: VirtualRig, rng: np.random.Generator, name: str, setting: Setting, settle: float, last: xr.Dataset | None
) -> tuple[Mapping[str, Any], xr.Dataset]:
    omega = frequency(rig, setting.voltage)
    gap = NO_SUPPORT if setting.gap is None else rig.true_gap(setting.gap)
    system = rig.system().with_parameters(rig.parameters(omega=omega, crank_length=setting.crank_length, g=gap))
    period = 2 * np.pi / omega
    before, phase = int(np.ceil(settle / period)), float(rng.uniform())
    # Whole periods in all, so that the next run can begin where this one ends.
    recorded = int(np.ceil(phase + (setting.duration + 1 / sensors.RATE) / period))
    time, at = sensors.instants(rig, rng, setting.duration)
    begin = (before + phase) * period
    start = _at_rest(gap, setting.release or 0.0) if last is None else last
    (x, v), result = simulated(
        system, name, instants=begin + at, end=_end(system, before, recorded), periods=recorded, transient=before,
        start=start,
    )  # fmt: skip
    crossed = passages(rig, omega, begin, begin + setting.duration) - begin
    return rig.channels(rng, name, time, x, v, crossed=crossed), result


def rise(
    rig: VirtualRig, *, voltage: float, crank_length: tuple[float, float], gap: float, duration: float,
    settle: float = 30.0,
) -> Recording:  # fmt: skip
    """The forcing rises slowly: the crank grows evenly from one length to the other (m) in ``duration`` seconds."""
    rng, name = rig.generator("rise", 0), "Run #1"
    omega = frequency(rig, voltage)
    period = 2 * np.pi / omega
    first, last = crank_length
    rate = (last - first) / duration
    system = rig.system(rising=True).with_parameters(rig.parameters(rising=True, omega=omega, g=rig.true_gap(gap)))
    whole = int(np.ceil(settle / period))
    start: Any = {**_at_rest(rig.true_gap(gap)), "a": first}
    _, settled = simulated(
        system, name, instants=np.array([0.0]), end=_end(system, 0, whole), periods=whole, start=start
    )  # fmt: skip
    time, at = sensors.instants(rig, rng, duration)
    x, v = simulated(
        system.with_parameters(crank_rate=rate), name, instants=at, duration=duration + 1 / sensors.RATE, start=settled
    )[0]
    channels = rig.channels(rng, name, time, x, v, crossed=passages(rig, omega, 0.0, duration))
    note = f"crank grows evenly, {rate:.3e} m/s, {rate * period:.3e} m per turn"
    stated = {
        "crank_length": first, "crank_length_end": last, "voltage": voltage, "gap": gap, "figure": 11, "note": note,
    }  # fmt: skip
    return rig.recording("rise", [(name, channels, stated)])


def _end(system: System, before: int, recorded: int) -> float:
    """The end of a run over whole periods, as ``simulate`` computes it."""
    period = system.period()
    assert period is not None
    return before * period + recorded * period


def _at_rest(gap: float, place: float = 0.0) -> dict[str, float]:
    """Held still at ``place``, the rest position where not given, or just clear of a support that reaches beyond."""
    return {"x": min(place, gap)}
