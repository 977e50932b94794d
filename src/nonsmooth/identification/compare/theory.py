"""The theory's side of a comparison: computed from a System, or read from a result that is at hand."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.identification.compare.clouds import energy_distance
from nonsmooth.identification.compare.fold import fold, mean_orbit
from nonsmooth.identification.compare.periods import measured_period
from nonsmooth.identification.compare.predict import Attractor, Motions

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Prediction", "from_result", "predict"]


EXACT = 1e-6  # noise of a computed section point, in parts of the motion's size
SHOWN = 16  # forcing periods of a motion without a period number that are kept for the overlays


@dataclass(frozen=True)
class Prediction:
    """One motion as the theory has it.

    Attributes
    ----------
    period_number : int
    sections : list of array (n, states)
        Section points, one cloud for each phase asked for.
    orbit : array (periods * grid, states), optional
        Over ``period_number`` forcing periods, or an interval of a motion without one; from phase 0.
    coexisting : array of int
        Period numbers of all motions found.
    attractor : Attractor, optional
        Where it came from a System.
    """

    period_number: int
    sections: list[FloatArray]
    orbit: FloatArray | None
    coexisting: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    attractor: Attractor | None = None


def predict(
    motions: Motions,
    measured: list[FloatArray],
    phases: list[float],
    scale: FloatArray,
    *,
    starts: Any,
    n: int,
    grid: int,
) -> Prediction:
    """Of all motions that the starts lead to the one whose section clouds lie nearest to the measured ones."""
    found = motions.attractors(0, starts)
    best: tuple[float, Attractor, list[FloatArray]] | None = None
    for one in found:
        sections = [motions.cloud(0, one, phase, n) for phase in phases]
        away = sum(energy_distance(a[-400:] / scale, b[-400:] / scale) for a, b in zip(measured, sections, strict=True))
        if best is None or away < best[0]:
            best = (away, one, sections)
    assert best is not None  # `attractors` raises where there is none
    _, one, sections = best
    motion = motions.orbit(0, one, grid, one.period_number or SHOWN)
    numbers = np.array([item.period_number for item in found], dtype=np.int64)
    return Prediction(one.period_number, sections, motion, numbers, one)


def from_result(result: xr.Dataset, states: list[str], phases: list[float], grid: int, max_period: int) -> Prediction:
    """Theory read from a result of ``simulate``, ``poincare`` or ``sweep`` at one setting.

    Raises
    ------
    ValueError
        Neither a motion nor one section cloud.
    """
    result = result.sel(state=states)
    if "u" in result:
        turns = _phase(result)
        whole = fold(turns, result["u"].values, grid)
        sections = [fold(turns - phase, result["u"].values, 8)[:, 0] for phase in phases]
        number = _number(sections[0], max_period)
        motion = mean_orbit(whole, number)[0] if number else whole[-SHOWN:].reshape(-1, whole.shape[2])
        return Prediction(number, sections, motion, np.array([number]))
    if "section" in result:
        if len(phases) > 1:
            raise ValueError("a result with one section has one phase: give section_phase as one number, or a System")
        points = result["section"].squeeze()
        if points.dims != ("iterate", "state"):
            raise ValueError(f"the theory's section has dims {points.dims}; choose one setting, start and direction")
        number = (
            int(result["period_number"].squeeze()) if "period_number" in result else _number(points.values, max_period)
        )
        return Prediction(number, [points.values], None, np.array([number]))
    raise ValueError(
        f"this Dataset holds neither `u` nor `section` ({', '.join(map(str, result.data_vars))}); give a System, or a "
        "result of simulate, poincare or sweep"
    )


def _phase(result: xr.Dataset) -> FloatArray:
    if "phase" in result:
        return np.asarray(result["phase"].values, dtype=float)
    if "omega" in result.coords:
        return np.asarray(result["time"].values * float(result["omega"]) / (2 * np.pi), dtype=float)
    raise ValueError("the phase of the drive is not known: give `phase` (in forcing periods) over time, or omega")


def _number(points: FloatArray, max_period: int) -> int:
    size = np.ptp(points, axis=0)
    return measured_period(points, EXACT * np.where(size > 0, size, 1.0), max_period=max_period).number
