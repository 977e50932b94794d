"""A campaign: branches of random systems with sticks, corners and several events at once go on, or end rightly."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import test_ways_on as ways
import xarray as xr

import nonsmooth as ns

Drawn = tuple[ns.System, str, tuple[float, float], Any]


def coulomb(rng: np.random.Generator) -> Drawn:
    F, ratio, z = rng.uniform(0.05, 0.6), rng.uniform(0.6, 1.0), rng.uniform(0.01, 0.1)
    return ways.coulomb(rng.uniform(0.6, 0.9), F, ratio, z), "w", (0.35, 1.6), None


def threshold(rng: np.random.Generator) -> Drawn:
    """The same over the friction: from slip to sticking most of the time."""
    return ways.coulomb(rng.uniform(0.4, 1.5), 0.2, rng.uniform(0.7, 1.0), 0.05), "F", (0.05, 0.7), None


def gear(rng: np.random.Generator) -> Drawn:
    return ways.gear(rng.uniform(0.5, 1.1)).with_parameters(z=rng.uniform(0.05, 0.2)), "w", (0.4, 1.4), [0.3, 0.2]


def buck(rng: np.random.Generator) -> Drawn:
    system = ways.buck(rng.uniform(16.0, 24.0)).with_parameters(a=rng.uniform(6.0, 9.0))
    return system, "V", (14.0, 40.0), [12.0, 0.5, 0.0]


def support(rng: np.random.Generator) -> Drawn:
    system = ns.models.discontinuous_support(rho=rng.uniform(0.1, 0.3), g=rng.uniform(-0.004, 0.02), omega=4.0)
    return system, "omega", (3.0, 9.0), None


TEMPLATES: dict[str, Callable[[np.random.Generator], Drawn]] = {
    one.__name__: one for one in (coulomb, threshold, gear, buck, support)
}


@pytest.mark.slow
@pytest.mark.parametrize("template", TEMPLATES)
def test_random_systems(template: str) -> None:
    """Each branch ends at the edge of the range, closes, or loses its orbit where a sweep loses it too."""
    ended: dict[str, int] = {}
    wrong = []
    for seed in range(17):
        system, name, limits, start = TEMPLATES[template](np.random.default_rng([seed, len(template)]))
        try:
            orbit = ns.find_orbit(system, start=start, max_period=4, progress=False)
        except ns.SolveError:  # chaos: another draw
            continue
        branch = ns.continue_orbit(orbit, name, limits)
        words = str(branch["ended"].attrs["flag_meanings"]).split()
        for end in (0, -1):
            word = words[int(branch["ended"].values[end])]
            ended[word] = ended.get(word, 0) + 1
            assert word != "points"
            if word not in ("range", "closed", "branching") and goes_on(system, branch, name, end, limits):
                wrong.append((seed, end, word, float(branch[name][end])))
        if not agrees(system, branch, name):
            wrong.append((seed, 0, "returns", np.nan))
    print(f"\n{template}: {ended}, wrong {wrong}")
    assert sum(ended.values()) >= 20
    assert len(wrong) <= 0.05 * sum(ended.values())


def goes_on(system: ns.System, branch: xr.Dataset, name: str, end: int, limits: tuple[float, float]) -> bool:
    """Return whether a sweep over the end of a branch shows its stable orbit on both sides, near each other."""
    point = branch.isel(point=end)
    inner = branch.isel(point=3 if end == 0 else -4)
    if not bool(inner["stable"]):
        return False
    here, width = float(point[name]), limits[1] - limits[0]
    side = float(np.sign(here - float(inner[name])))
    values = here + side * width * np.array([-2e-4, -1e-4, 1e-4, 2e-4])
    swept = ns.sweep(system, name, values, start=inner["section"].values, transient=2000, keep=9, progress=False)
    number = swept["period_number"].values
    size = np.ptp(branch["section"].values, axis=0) + 1e-9
    jump = np.abs(np.diff(swept["section"].values[:, -1], axis=0)) / size
    return bool((number == number[0]).all() and number[0] > 0 and jump.max() < 0.02)


def agrees(system: ns.System, branch: xr.Dataset, name: str) -> bool:
    """Return whether some orbits of a branch come back in a simulation."""
    for i in range(0, branch.sizes["point"], max(1, branch.sizes["point"] // 12)):
        point = branch.isel(point=i)
        largest = float(np.abs(point["floquet_multipliers"].values).max())
        same, mode = system.with_parameters({name: float(point[name])}), system.modes[int(point["mode"])]
        run = ns.simulate(same, duration=float(point["period"]), start=point["section"].values, mode=mode)
        missed = np.nanmax(np.abs(run["u"].values[-1] - point["section"].values) / system.scale_vector())
        if largest < 100 and missed > 1e-8:
            return False
    return True
