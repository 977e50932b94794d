"""One run of a system of the rig at given instants: ``simulate``, and a check that it stayed within its equations."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth import System, simulate
from nonsmooth_savi2007.arrays import FloatArray
from nonsmooth_savi2007.rig.physics import driven_tension, fixed_tension, wander_of

#: The paper's method. Over 40 periods with 121 crossings of a rig with friction it differs from the Taylor series at
#: rtol 1e-12 by 2e-10 m/s, far below what a sensor tells.
METHOD: dict[str, Any] = {"method": "rkf45", "rtol": 1e-9}


def simulated(
    system: System,
    run: str,
    *,
    instants: FloatArray,
    turns: tuple[int, int] | None = None,
    side: float = 1.0,
    **options: Any,
) -> tuple[FloatArray, xr.Dataset]:
    """Position and velocity at the instants, (2, n), and the whole result of ``simulate``.

    ``turns`` of the crank that pass before and that are recorded, in place of a duration: the last sample is then at
    their end, a start for the run that follows.

    Raises
    ------
    ValueError
        If a string would have to push while the car touches the support: the rig's equations have no mode for it.
    SolveError
        If the run could not be completed.
    """

    with_strings = "pretension" in system.parameters
    samples = instants
    if turns is not None:
        period = 2 * np.pi / system.values["omega"]
        before, recorded = (n * period for n in turns)
        samples = np.append(instants, before + recorded)
        options |= (
            {"transient": before, "duration": recorded}  # a wandering motor leaves no period
            if system.period() is None
            else {"transient": turns[0], "periods": turns[1]}
        )
    result = simulate(system, samples=samples, **options, **(METHOD if with_strings else {}))
    if with_strings:
        _check_strings(system, run, result, side)
    # Crossings stand twice in the result's time; each instant that was asked for is there exactly.
    rows = np.searchsorted(result["time"].values, instants)
    u = result["u"].values[rows]
    return np.ascontiguousarray(u[:, :2].T), result


def _check_strings(system: System, run: str, result: xr.Dataset, side: float) -> None:
    """Slack strings are modes of the car away from the support only."""
    p = SimpleNamespace(**system.values)
    u = {str(name): result["u"].sel(state=name).values for name in system.states}
    at_support = u["x"] > p.g
    if not at_support.any():
        return
    length = p.crank_length if "crank_length" in system.parameters else u["a"]
    tensions = {
        "driven": driven_tension(
            result["time"].values, u["x"], p, length, side, wander_of(p) if hasattr(p, "wander_1") else ()
        ),
        "fixed": fixed_tension(u["x"], p, side),
    }
    for which, tension in tensions.items():
        if tension[at_support].min() < 0:
            raise ValueError(
                f"{run}: the string of the {which} spring would have to push while the car is at the support; "
                "use less forcing or more pretension"
            )
