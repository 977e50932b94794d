"""Orbits by brute force, for the ends of branches: fixed points of simulated return maps, without any signature."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import nonsmooth as ns

__all__ = ["goes_on", "misses", "retraced"]

FloatArray = NDArray[np.float64]
BESIDE = (1e-2, 2e-3, 4e-4)  # of the range: how far from an end fixed points are looked for
NEAR = 0.3  # of the size of the orbit at the end: farther off it is another orbit
NEARER = 0.6  # an orbit that the end belongs to comes nearer by this factor from one distance to the next
STARTS = 24
SOLVED = 1e-8
AT_SECTION = 1e-9  # of the period: an impact as near to the section lies on either side of it
SAME = 1e-3  # nearer to the branch itself, between two of its points, is the branch


def return_map(system: ns.System, u: FloatArray, period: int, mode: str | None) -> FloatArray | None:
    """State after so many forcing periods; None where the run fails."""
    try:
        run = ns.simulate(system, duration=period * float(system.period() or 0.0), start=u, mode=mode, samples=2)
    except (ValueError, ns.SolveError):
        return None
    return None if int(run["status"]) else np.asarray(np.nan_to_num(run["u"].values[-1]))


def _fixed_point(system: ns.System, u: FloatArray, period: int, mode: str | None, size: FloatArray) -> Any:
    """Newton's method by finite differences, from u."""
    last = np.inf
    for _ in range(12):
        here = return_map(system, u, period, mode)
        if here is None:
            return None
        gap = (here - u) / size
        wide = float(np.abs(gap).max())
        if wide < SOLVED:
            return u
        if wide > 3.0 * last:
            return None
        last = wide
        slopes = np.empty((len(u), len(u)))
        for j in range(len(u)):
            h = max(1e-7, 1e-2 * min(wide, 1e-2)) * size[j]
            moved = u.copy()
            moved[j] += h
            there = return_map(system, moved, period, mode)
            if there is None:
                moved[j] -= 2 * h
                there = return_map(system, moved, period, mode)
                h = -h
            if there is None:
                return None
            slopes[:, j] = (there - here) / size / h * size[j]
        step = np.linalg.lstsq(slopes - np.eye(len(u)), -gap, rcond=1e-10)[0] * size
        if not np.isfinite(step).all() or np.abs(step / size).max() > 10 * NEAR:
            return None
        u = u + step
    return None


def goes_on(system: ns.System, branch: xr.Dataset, name: str, end: int, limits: tuple[float, float]) -> bool:
    """Return whether an orbit other than the branch's own comes to its end as the parameter does.

    On either side of the end, fixed points of the simulated return map are looked for from random states about it. One
    that is not the branch itself, and is nearer to the end the nearer the parameter is, shows that the branch goes on.
    """
    last, inner = branch.isel(point=end), branch.isel(point=1 if end == 0 else -2)
    period, width = int(branch["period_number"]), limits[1] - limits[0]
    here, u = float(last[name]), last["section"].values
    side = float(np.sign(here - float(inner[name]))) or 1.0
    size = np.maximum(np.ptp(branch["section"].values, axis=0), 1e-3 * system.scale_vector())
    amplitude = np.nanmax(branch["maximum"].values - branch["minimum"].values, axis=0)
    size = np.maximum(size, amplitude)
    random = np.random.default_rng(0)
    mode = system.modes[int(last["mode"])]
    for s in (side, -side):
        nearest = np.inf
        for aside in BESIDE:
            value = here + s * aside * width
            at, own = system.with_parameters({name: value}), _own(branch, name, end, value)
            found = np.inf
            for k in range(STARTS):
                spread = 0.0 if k == 0 else 10.0 ** random.uniform(-6.0, 0.0)
                begun = u + spread * size * random.uniform(-1, 1, len(u))
                root = _fixed_point(at, begun, period, mode if k % 2 else None, size)
                if root is None or (own is not None and np.abs((root - own) / size).max() < SAME):
                    continue
                found = min(found, float(np.abs((root - u) / size).max()))
                if found < NEARER * min(nearest, NEAR / NEARER):
                    break
            if not found < NEARER * min(nearest, NEAR / NEARER):
                break
            nearest = found
        else:
            return True
    return False


def _own(branch: xr.Dataset, name: str, end: int, value: float) -> FloatArray | None:
    """The branch's own orbit near its end at a value of the parameter, by interpolation."""
    order = slice(0, 12) if end == 0 else slice(-12, None)
    values, states = branch[name].values[order], branch["section"].values[order]
    for i in range(len(values) - 1) if end == 0 else range(len(values) - 2, -1, -1):
        a, b = values[i], values[i + 1]
        if (a - value) * (b - value) <= 0 and a != b:
            x = (value - a) / (b - a)
            return np.asarray((1 - x) * states[i] + x * states[i + 1])
    return None


def misses(system: ns.System, branch: xr.Dataset, name: str, count: int = 12) -> float:
    """Return the largest distance by which simulated orbits of a branch miss their beginning, scaled."""
    worst, special = 0.0, set(branch["special_point"].values.tolist())
    for i in range(0, branch.sizes["point"], max(1, branch.sizes["point"] // count)):
        point = branch.isel(point=i)
        if i in special or np.abs(point["floquet_multipliers"].values).max() > 100:
            continue
        same, mode = system.with_parameters({name: float(point[name])}), system.modes[int(point["mode"])]
        period = float(point["period"])
        run = ns.simulate(same, duration=period, start=point["section"].values, mode=mode)
        at = run["crossing_time"].values
        if (np.minimum(np.abs(at), np.abs(at - period)) < AT_SECTION * period).any():
            continue  # before the impact or behind it
        missed = np.abs(run["u"].values[-1] - point["section"].values) / system.scale_vector()
        worst = max(worst, float(np.nanmax(missed)))
    return worst


def retraced(branch: xr.Dataset, name: str) -> bool:
    """Return whether a closed branch goes back through its own orbits."""
    values, states = branch[name].values, branch["section"].values
    middle = 0.5 * (values.min() + values.max())
    met = []
    for i in np.flatnonzero((values[:-1] - middle) * (values[1:] - middle) < 0.0):
        x = (middle - values[i]) / (values[i + 1] - values[i])
        met.append((1 - x) * states[i] + x * states[i + 1])
    apart = [np.abs(a - b).max() for k, a in enumerate(met) for b in met[:k]]
    return min(apart, default=0.0) < SAME * np.abs(states).max()
