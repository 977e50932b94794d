"""Plausibility of a session, before anything is fitted: what no rig on a table can do, whatever its parameters are.

The criteria are ratios of scales between what was recorded and what the notebook states, wide enough for any rig and
far narrower than a factor of a thousand between m and mm or s and ms. What is finer (a wheel 1.4 % wrong) shows only
where two procedures tell one quantity: see :mod:`nonsmooth_savi2007.identification.cross_checks`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from nonsmooth.recordings import Quantity
from nonsmooth_savi2007.identification.directions import few
from nonsmooth_savi2007.identification.evidence import NEEDS, Evidence, Run
from nonsmooth_savi2007.identification.free_decay import DecayFit
from nonsmooth_savi2007.identification.steady import Steady

FASTEST = 20.0  # m/s: no car on a table goes faster
LARGEST = 50.0  # times the crank: a car that swings so much further would need a damping ratio of 0.5 %
SMALLEST = 0.02  # of the crank: the largest amplitude of all steps of a response; far above resonance it is smaller
REACH = 5.0  # times what the car moves: a support so far away is not met
RATES = 20.0  # times: sample rates of one sensor in one session
STATED = 2.0  # times the notebook's sample rate
STILL = 3.0  # counts: what moves by no more does not move


def check_plausible(evidence: Evidence) -> None:
    """Check channels, clocks and lengths of all runs against each other and against the notebook.

    Raises
    ------
    ValueError
        With one sentence for each thing that cannot be: runs, what was found, what is possible, what to look at.
    """
    everything = [run for rows in evidence.runs.values() for run in rows]
    wrong = [*_constant(everything), *_clocks(everything, evidence.apparatus)]
    # where a channel is constant or a clock wrong, lengths say nothing
    wrong = wrong or [*_cranks(evidence.runs), *_gaps(evidence.runs)]
    if wrong:
        raise ValueError("this session cannot be right: " + "; ".join(wrong))


def _constant(runs: Sequence[Run]) -> Iterator[str]:
    for channel, name, counts in (("Angle", "x", STILL), ("Force", "force", 0.0)):
        dead = []
        for run in (run for run in runs if channel in NEEDS[run.procedure]):
            values = getattr(run, name).values
            if np.nanmax(values) - np.nanmin(values) <= counts * run.resolution:
                dead.append(run.label)
        if dead:
            yield (
                f"channel {channel!r} does not change in {len(dead)} of {len(runs)} runs ({few(dead)}): was the sensor "
                "connected, and is it the right column? Leave these runs out of the notebook, or name the column"
            )


def _clocks(runs: Sequence[Run], apparatus: Mapping[str, Quantity]) -> Iterator[str]:
    moving = [run for run in runs if run.x is not None and len(run.time) > 1]
    rates = np.array([1.0 / np.median(np.diff(run.time)) for run in moving])
    if len(rates) and rates.max() > RATES * rates.min():
        low, high = moving[rates.argmin()], moving[rates.argmax()]
        yield (
            f"channel 'Angle' has {rates.min():.4g} samples per second in {low.label} and {rates.max():.4g} in "
            f"{high.label}: the time of one of them is labelled in another unit than it is in (s, ms)"
        )
    elif len(rates) and (stated := apparatus.get("sample_rate")) is not None:
        off = np.median(rates) / stated.value
        if not 1 / STATED < off < STATED:
            yield (
                f"channel 'Angle' has {np.median(rates):.4g} samples per second, the notebook says sample_rate = "
                f"{stated.value:g} Hz: is the time labelled in another unit than it is in (s, ms)?"
            )
    fast = {run.label: speed for run in moving if (speed := _speed(run)) > FASTEST}
    if fast:
        yield (
            f"the car would move at {max(fast.values()):.3g} m/s in {len(fast)} runs ({few(list(fast))}), where "
            f"{FASTEST:g} m/s is more than any car on a table does: look at the units of time (s, ms) and of channel "
            "'Angle', and at distance_per_turn (m)"
        )


def _speed(run: Run) -> float:
    """Root of the mean square velocity (m/s) over a tenth of a second or five samples: the larger hides steps."""
    time, x = run.time, run.positions
    lag = min(max(5, round(0.1 / max(np.median(np.diff(time)), 1e-12))), len(x) - 1)
    lag = min(lag, max(5, len(x) // 20))
    if lag < 1:
        return 0.0
    return np.sqrt(np.nanmean(((x[lag:] - x[:-lag]) / (time[lag:] - time[:-lag])) ** 2))


def _cranks(runs: Mapping[str, Sequence[Run]]) -> Iterator[str]:
    for procedure, channels in NEEDS.items():
        rows = runs[procedure]
        if not rows or channels != ("Angle", "Turn"):
            continue
        ratio = np.array([0.5 * _travel(run) / _length(run) for run in rows])
        labels = np.array([run.label for run in rows])
        long, short = labels[ratio < SMALLEST].tolist(), labels[ratio > LARGEST].tolist()
        if ratio.max() < SMALLEST or short:
            worst = rows[int(ratio.argmax())]
            yield (
                f"{procedure}: cranks of {_length(worst):.4g} m and a car that swings by "
                f"{0.5e3 * _travel(worst):.3g} mm do not go together ({len(short or long)} of {len(rows)} runs, "
                f"{few(short or long)}): is crank_length in m, and are the unit of 'Angle' and distance_per_turn right?"
            )


def _gaps(runs: Mapping[str, Sequence[Run]]) -> Iterator[str]:
    far = []
    for run in (run for rows in runs.values() for run in rows if run.mounted and run.x is not None):
        reach = max(np.nanmax(np.abs(run.positions)), _travel(run))
        if abs(run.gap) > REACH * reach:
            far.append((run, reach))
    if far:
        run, reach = far[0]
        yield (
            f"a gap of {run.gap:.4g} m, and a car that comes no further than {1e3 * reach:.3g} mm, "
            f"in {len(far)} runs ({few([run.label for run, _ in far])}): is the gap in m?"
        )


def not_driven(seen: Steady) -> str:
    """A sentence on steady runs whose motion does not repeat with the crank; empty where all do."""
    loose = [
        run.label
        for run, size, rest in zip(seen.runs, seen.amplitude, seen.rest, strict=True)
        if _travel(run) > 20 * run.resolution and rest > 0.5 * size
    ]
    if not loose:
        return ""
    return (
        f"the car does not move with the crank in {len(loose)} of {len(seen)} runs of the response ({few(loose)}): "
        "does channel 'Turn' have one row for each turn, and is the time of both channels in one unit?"
    )


def _travel(run: Run) -> float:
    """Way from end to end (m), a thousandth of the samples on either side left out."""
    low, high = np.nanquantile(run.positions, (0.001, 0.999))
    return high - low


def _length(run: Run) -> float:
    if not abs(run.crank) > 0:
        raise ValueError(f"{run.label}: crank_length = {run.crank!r} must be a positive length in m")
    return abs(run.crank)


def slipped_late(decay: DecayFit) -> Iterator[str]:
    """A sentence for each tap that ends farther from rest than friction can hold a car: the string slipped later."""
    for run in (part.run for part in decay.parts):
        held = decay.held + 2 * run.resolution
        off = np.median(run.positions[-max(10, len(run.time) // 20) :]) - decay.rest
        if abs(off) > held:
            yield (
                f"impulse: run {run.name!r}, channel 'Angle': ends {1e3 * off:+.2f} mm from where the car rests, and "
                f"friction holds it within ±{1e3 * held:.2f} mm: the string slipped on the wheel after the part that "
                "is used"
            )
