"""What the theory predicts for one setting: the attractors that starts lead to, their orbits and section clouds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.analysis.sweep import sweep
from nonsmooth.flow.poincare import poincare
from nonsmooth.flow.sections import Stroboscopic
from nonsmooth.flow.simulate import simulate
from nonsmooth.identification.compare.fold import fold

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["Attractor", "attractors", "cloud", "forcing_period", "orbit"]

FloatArray = NDArray[np.float64]

SAME = 1e-6  # orbits whose points are nearer to each other than this part of the motion are one


@dataclass(frozen=True)
class Attractor:
    """A steady motion: period number (0: none found), a section point on it at phase 0, the start that led to it."""

    period_number: int
    point: FloatArray
    start: int


def forcing_period(system: System) -> float:
    """The forcing period; ValueError where there is none."""
    period = system.period()
    if period is None:
        raise ValueError(f"{system.name!r} has no forcing period; compare takes forced systems")
    return float(period)


def attractors(
    system: System, starts: Any, *, transient: int, keep: int, max_period: int, options: dict[str, Any]
) -> list[Attractor]:
    """The different motions that the starts settle on, in the order of the starts.

    All motions without a period number count as one. A start that diverges leads to none.

    Raises
    ------
    ValueError
        No start leads to a motion.
    """
    forcing_period(system)
    name = next(iter(system.parameters))
    kept = max(keep, max_period + 1)
    result = sweep(
        system, name, [system.values[name]], direction=None, start=[list(start) for start in np.atleast_2d(starts)],
        transient=transient, keep=kept, max_period=max_period, progress=False, **options,
    )  # fmt: skip
    sections = result["section"].isel({name: 0}).values
    numbers = result["period_number"].isel({name: 0}).values
    found: list[Attractor] = []
    orbits: list[FloatArray] = []
    for k, (points, number) in enumerate(zip(sections, numbers, strict=True)):
        if not np.isfinite(points).all():
            continue
        size = np.maximum(np.ptp(points, axis=0), 1e-3 * system.scale_vector())
        cycle = points[-max(int(number), 1) :]
        if any(
            one.period_number == number and (number == 0 or _apart(cycle[-1], other, size) < SAME)
            for one, other in zip(found, orbits, strict=True)
        ):
            continue
        found.append(Attractor(int(number), points[-1].copy(), k))
        orbits.append(cycle)
    if not found:
        statuses = sorted({int(code) for code in np.ravel(result["status"].values)})
        from nonsmooth.results.statuses import by_code

        words = "; ".join(by_code(code).sentence for code in statuses)
        raise ValueError(f"no start of {system.name!r} leads to a motion that can be compared: {words}")
    return found


def orbit(system: System, attractor: Attractor, grid: int, periods: int, options: dict[str, Any]) -> FloatArray:
    """The motion from phase 0 over whole forcing periods: (periods * grid, states)."""
    run = simulate(system, periods=periods, samples=periods * grid + 1, start=attractor.point, **options)
    phase = run["time"].values / forcing_period(system)
    return fold(phase, run["u"].values, grid)[:periods].reshape(periods * grid, -1)


def cloud(system: System, attractor: Attractor, phase: float, n: int, options: dict[str, Any]) -> FloatArray:
    """Successive points of the section at ``phase``: (n, states); those of a periodic motion come round again."""
    count = attractor.period_number or n
    section = Stroboscopic(phase)
    points = poincare(system, section=section, n=count, start=attractor.point, **options)["section"].values
    return np.resize(points, (n, points.shape[1])) if count < n else points


def _apart(point: FloatArray, cycle: FloatArray, size: FloatArray) -> float:
    return float(np.abs((cycle - point) / size).max(axis=1).min())
