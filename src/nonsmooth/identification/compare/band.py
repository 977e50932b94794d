"""The predicted motion for drawn parameters: a band about the orbit, and distances with their spread."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.identification.compare.clouds import energy_distance
from nonsmooth.identification.compare.model import Model
from nonsmooth.identification.compare.orbits import common_length, orbit_distance
from nonsmooth.identification.compare.predict import Attractor, Motions

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["motion_band"]


POINTS = 500  # of the clouds whose distance is taken for each draw


def motion_band(
    systems: list[System], model: Model, nearest: Attractor, sections: list[FloatArray], phases: list[float],
    noise: FloatArray, scale: FloatArray, closed: tuple[FloatArray, FloatArray] | None, *, grid: int, max_period: int,
) -> dict[str, Any]:  # fmt: skip
    """Carry the nearest motion on to each drawn system, and say how the prediction spreads.

    Parameters
    ----------
    systems : list of System
        As the model has drawn them.
    model : Model
    nearest : Attractor
        The nominal motion; each drawn system begins on it.
    sections : list of array (n, states)
        The measured clouds.
    closed : (measured, predicted) orbits of shape (periods * grid, states), optional
        Where both motions are periodic.

    Notes
    -----
    A draw with another period number has another motion, not a point of the band: ``band_share`` says how many kept
    theirs.
    """
    rng = np.random.default_rng(model.seed)
    draws = len(systems)
    numbers = np.zeros(draws, dtype=np.int64)
    distances = np.full((draws, len(phases)), np.nan)
    to_measured = np.full(draws, np.nan)
    orbits: list[FloatArray] = []
    motions = Motions(
        systems, transient=model.transient, keep=64, max_period=max_period, options=model.options, places=model.places
    )
    for i in range(draws):
        (one,) = motions.attractors(i, nearest.point)
        numbers[i] = one.period_number
        for j, phase in enumerate(phases):
            points = motions.cloud(i, one, phase, POINTS)
            points = points + noise * rng.standard_normal(points.shape)
            distances[i, j] = energy_distance(sections[j][-POINTS:] / scale, points / scale)
        length = 0 if closed is None else len(closed[0]) // grid
        if closed is not None and one.period_number and length % one.period_number == 0:
            motion = common_length(motions.orbit(i, one, grid, one.period_number), one.period_number, length)
            motion = np.roll(motion, orbit_distance(closed[1], motion, length).whole_shift * grid, axis=0)
            orbits.append(motion)
            to_measured[i] = orbit_distance(closed[0], motion, length).distance
    variables: dict[str, Any] = {
        "draw_period_number": (("draw",), numbers, {"long_name": "period number for drawn parameters"}),
        "draw_energy_distance": (("section_phase", "draw"), distances.T, {
            "long_name": "energy distance of the section clouds for drawn parameters, scaled"}),
    }  # fmt: skip
    if closed is None:
        return variables
    variables["draw_orbit_distance"] = (("draw",), to_measured, {
        "long_name": "normalised distance of the orbits for drawn parameters"})  # fmt: skip
    variables["band_share"] = ((), len(orbits) / draws, {
        "long_name": "share of the draws that keep the period; these make the band"})  # fmt: skip
    if orbits:
        stack = np.stack(orbits)
        low, middle, high = np.quantile(stack, model.quantiles, axis=0)
        for word, values in (("low", low), ("median", middle), ("high", high)):
            variables[f"theory_{word}"] = (("phase", "state"), values, {"long_name": f"{word} of the band"})
        inside = ((closed[0] >= low) & (closed[0] <= high)).mean(axis=0)
        variables["inside_band"] = (("state",), inside, {
            "long_name": "share of the measured orbit that lies inside the band"})  # fmt: skip
    return variables
