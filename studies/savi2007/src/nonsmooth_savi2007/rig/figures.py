"""The measurements behind the paper's figures: the settings that it prints, set on the rig.

The paper gives the forcing as a force rho; here it is a crank length rho / k. A gap is set so that it is the paper's
as seen from the car's mean position under the drive, which string and motor move: the screw reads that much more.
Source: Savi et al. (2007), Figs. 4-18.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth import Recording
from nonsmooth_savi2007.printed import FIGURE_12, FIGURE_14, FIGURE_18
from nonsmooth_savi2007.rig import sensors
from nonsmooth_savi2007.rig.driven import SteadyRun, at_rest, records
from nonsmooth_savi2007.rig.motor import frequency, mean_position, passages, voltage_for
from nonsmooth_savi2007.rig.physics import simulated

if TYPE_CHECKING:
    from nonsmooth_savi2007.rig.virtual_rig import VirtualRig

#: Settings of the sections: frequency (rad/s), forcing (N), gap (m).
SECTIONS: dict[int, tuple[tuple[float, float, float], ...]] = {
    12: tuple((3.69, rho, -0.0045) for rho in FIGURE_12),
    **dict.fromkeys((13, 14), tuple((11.15, 0.33, g) for g in FIGURE_14)),
    **dict.fromkeys((15, 16), ((11.15, 0.33, 0.0018),)),
    17: tuple((omega, 0.23, 0.0036) for omega in np.round(np.arange(8.4, 10.21, 0.05), 2).tolist()),
    18: tuple((omega, 0.23, 0.0036) for omega in FIGURE_18),
}
_PERIODS = {15: 1500, 16: 1500, 17: 60}
#: Where else the car is let go at each setting (m): of motions that coexist, the start at rest shows one.
RELEASES: dict[int, tuple[float, ...]] = {14: (-0.01, -0.02, -0.03, -0.04)}
_RISE = (3.69, 0.2, 0.5, -0.0045)  # rad/s, N, N, m
_SETTLE = 30.0  # s, before a rise begins
_RESPONSES = {9: (0.14, 0.02), 10: (0.16, 0.0145)}
_STEPS = {9: (3.0, 6.6), 10: (2.4, 7.4)}  # rad/s
#: What each figure shows. Those with the support mounted also need a few runs without it, in ``response``, and taps:
#: where the car swings about, from which the gap is counted, and where it rests, from which the screw counts.
FIGURES: dict[int, tuple[str, ...]] = {
    4: ("springs", "support"),
    5: ("impulse",),
    6: ("response",),
    7: ("drop",),
    8: ("voltage", "crank"),
    **dict.fromkeys(_RESPONSES, ("response",)),
    11: ("rise",),
    **dict.fromkeys(SECTIONS, ("section",)),
}
#: Velocities (m/s) of the taps that show where the car rests.
TAPS = (0.3, -0.3, 0.2)


def crank_for(rig: VirtualRig, rho: float) -> float:
    """The crank length (m) whose force k a is ``rho``, to 0.01 mm."""
    return round(rho / rig.truth["k"], 5)


def screw_for(rig: VirtualRig, gap: float, crank_length: float) -> float:
    """The reading of the support's screw (m) at which the gap, from the car's mean position, is ``gap``."""
    return round(gap + mean_position(rig, crank_length) - rig.true_gap(0.0), 7)


def section(
    rig: VirtualRig,
    *,
    figure: int = 14,
    periods: int | None = None,
    releases: Sequence[float] | None = None,
    settle: float = 60.0,
) -> Recording:
    """Long steady records at the settings of Figs. 12 to 18, ``periods`` turns of the crank each.

    First all settings from rest, then all again for each of ``releases`` (m), the places where the car is let go
    while the motor runs; for Fig. 14 four of them where not given. ``settle`` seconds pass before a record.
    """
    if figure not in SECTIONS:
        shown = ", ".join(map(str, SECTIONS))
        raise ValueError(f"figure = {figure!r} shows no sections of steady motion; those are {shown}")
    n = _PERIODS.get(figure, 200) if periods is None else periods
    settings = []
    for place in (None, *(RELEASES.get(figure, ()) if releases is None else releases)):
        let_go = "" if place is None else f"; the car let go at {1e3 * place:g} mm"
        for omega, rho, gap in SECTIONS[figure]:
            length = crank_for(rig, rho)
            reading = screw_for(rig, gap, length)
            notes = {"figure": figure, "note": f"rho {rho} N, gap {gap} m, omega {omega} rad/s{let_go}"}
            duration = n * 2 * np.pi / omega
            settings.append(SteadyRun(voltage_for(rig, omega), length, reading, duration, notes, place))
    return records(rig, "section", settings, settle=settle, carry=figure == 17)


def rise(
    rig: VirtualRig,
    *,
    crank_length: tuple[float, float] | None = None,
    voltage: float | None = None,
    gap: float | None = None,
    duration: float = 900.0,
) -> Recording:
    """The slow rise of the forcing of Fig. 11: the crank grows evenly from one length to the other (m) in ``duration``
    seconds; the gap is the screw's reading."""
    wanted, low, high, at_zero = _RISE
    first, last = (crank_for(rig, low), crank_for(rig, high)) if crank_length is None else crank_length
    knob = voltage_for(rig, wanted) if voltage is None else voltage
    screw = screw_for(rig, at_zero, 0.0) if gap is None else gap
    rng, name, true = rig.generator("rise", 0), "Run #1", rig.true_gap(screw)
    omega, rate = frequency(rig, knob), (last - first) / duration
    wander, period, side = rig.wander("rise", 0, omega), 2 * np.pi / omega, rig.truth["motor_side"]
    system, start = rig.system(rising=True, omega=omega, g=true, **wander), {**at_rest(true), "a": first}
    turns = 0, int(np.ceil(_SETTLE / period))
    _, settled = simulated(system, name, instants=np.array([0.0]), turns=turns, start=start, side=side)
    time, at = sensors.instants(rig, rng, duration)
    rising, length = system.with_parameters(crank_rate=rate), duration + 1 / sensors.RATE
    (x, v), _ = simulated(rising, name, instants=at, duration=length, start=settled, side=side)
    channels = rig.channels(rng, name, time, x, v, crossed=passages(rig, omega, 0.0, duration, **wander))
    stated = {
        "crank_length": first,
        "crank_length_end": last,
        "voltage": knob,
        "gap": screw,
        "figure": 11,
        "note": f"crank grows evenly, {rate:.3e} m/s, {rate * period:.3e} m per turn",
    }
    return rig.recording("rise", [(name, channels, stated)])


def without_support(rig: VirtualRig, number: int) -> list[SteadyRun]:
    """Runs at the crank lengths of a figure with the support taken away: they show where the car swings about."""
    if number in _RESPONSES:
        pairs = {(6.5, crank_for(rig, _RESPONSES[number][0]))}
    elif number == 11:
        omega, low, high, _ = _RISE
        pairs = {(omega, crank_for(rig, rho)) for rho in (low, 0.5 * (low + high), high)}
    else:
        pairs = {(SECTIONS[number][0][0], crank_for(rig, rho)) for _, rho, _ in SECTIONS[number]}
    notes = {"figure": number, "note": "no support: the place about which the car swings"}
    return [SteadyRun(voltage_for(rig, omega), length, None, 30.0, notes) for omega, length in sorted(pairs)]


def figure(rig: VirtualRig, number: int, **options: Any) -> dict[str, Recording]:
    """The recordings behind a figure, by procedure; the options are those of its (first) procedure.

    Raises
    ------
    ValueError
        If the figure shows no measurement.
    """
    if number not in FIGURES:
        raise ValueError(f"figure {number!r}: measurements stand behind Figs. {', '.join(map(str, sorted(FIGURES)))}")
    own: dict[str, Any] = {"figure": number} if number in SECTIONS else {}
    if number == 6:
        own = {"crank_lengths": (crank_for(rig, 0.14),)}
    elif number in _RESPONSES:
        rho, gap = _RESPONSES[number]
        length = crank_for(rig, rho)
        own = {
            "crank_lengths": (length,),
            "gap": screw_for(rig, gap, length),
            "duration": 20.0,
            "voltages": [voltage_for(rig, omega) for omega in np.arange(*_STEPS[number], 0.05).tolist()],
            "after": without_support(rig, number),
        }
    made = {procedure: rig.record(procedure, **{**own, **options}) for procedure in FIGURES[number]}
    if number > 8:  # the support is mounted
        if number not in _RESPONSES:
            made["response"] = records(rig, "response", without_support(rig, number))
        made["impulse"] = rig.impulse(velocities=TAPS)
    return made
