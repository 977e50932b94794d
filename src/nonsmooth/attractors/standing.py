"""Runs that stand: equilibria, and sets of them as dry friction leaves them, as attractors.

Under a forcing such a run repeats itself with nothing moving; without one it meets no section any more.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.attractors.basins_found import Attractor
from nonsmooth.attractors.settled import Settled
from nonsmooth.attractors.settler import Settler
from nonsmooth.flow.engines.engine import FloatArray, IntArray
from nonsmooth.flow.equilibria import sorted_eigenvalues
from nonsmooth.flow.equilibrium_sets import EquilibriumSet, equilibrium_sets
from nonsmooth.flow.mode_fields import mode_field
from nonsmooth.kernels.hybrid import codes

if TYPE_CHECKING:
    from nonsmooth.system.system import System

STANDS = 1e2  # tolerances of a return: a run that moves less, and ends as near to an equilibrium, stands there
CREEPS = 1e-5  # of the scales: the same of one that creeps towards the end of a set, ever more slowly
TRIES = 20  # states of a nonlinear system beside which equilibria are looked for in vain


def label_standing(
    settler: Settler,
    point: FloatArray,
    runs: Settled,
    which: IntArray,
    found: list[Attractor],
    labels: IntArray,
    status: IntArray,
) -> None:
    """Label the runs that ended at equilibria; sets of them not met before become attractors."""
    system, tolerance = settler.system, STANDS * settler.tolerance
    u, memory = runs.last[:, : len(system.states)], _memory(system, runs.last)
    still = _stands(system, tolerance, u, runs.maximum, runs.minimum, runs.period_number, runs.status)
    near = np.where(runs.status == codes.SLOW, CREEPS, tolerance)

    def label(stood: EquilibriumSet, number: int, there: FloatArray) -> None:
        here = still & (memory == there).all(axis=1)
        here[here] = stood.holds(u[here], near[here])
        labels[which[here]], status[which[here]] = number, codes.OK
        still[here] = False

    for number, attractor in enumerate(found):
        if attractor.standing is not None and still.any():
            label(attractor.standing, number, _memory(system, attractor.end[None])[0])
    affine, known, at, tried = False, [], memory[:0], 0
    while still.any() and tried < TRIES:
        first = int(np.argmax(still))
        if not (affine and (memory[first] == at).all()):
            at = memory[first]
            known = equilibrium_sets(system, u[first], values=point[0], memory=at)
            traced = system.traced
            affine = all(mode_field(traced, mode).affine for mode in range(len(traced.mode_names)))
        stood = next((one for one in known if one.holds(u[first : first + 1], near[first])[0]), None)
        if stood is None:
            still[first], tried = False, tried + (not affine)
            continue
        label(stood, len(found), at)
        found.append(_attractor(settler, point, runs[first : first + 1], stood, at))


def _memory(system: System, last: FloatArray) -> FloatArray:
    """The memory at places (..., width), on which equilibria depend: that of a start where no field and no condition
    knows it (a count of impacts tells no equilibria apart)."""
    traced, n, memory = system.traced, len(system.states), system.memory_vector()
    expressions = (*chain.from_iterable(traced.fields), *traced.indicators)
    if traced.m and any(one.free_symbols & set(traced.m) for one in expressions):
        return last[..., n : n + len(memory)]
    return np.broadcast_to(memory, (*last.shape[:-1], len(memory)))


def standing_in_sweep(
    settler: Settler, points: FloatArray, arrays: dict[str, Any], first: FloatArray, modes: IntArray, last: FloatArray
) -> dict[str, Any]:
    """Complete the arrays of a sweep (directions, starts, values) where its points stand, and return what else is known
    of them: the name of the equilibrium, or of the set of them, and its extent. ``first`` are the first kept points,
    ``modes`` those there, ``last`` the places where runs ended."""
    system, tolerance = settler.system, STANDS * settler.tolerance
    shape, n = first.shape[:-1], first.shape[-1]
    status, period = arrays["status"], arrays["period_number"]
    stands = _stands(system, tolerance, first, arrays["maximum"], arrays["minimum"], period, status)
    names, extent = np.full(shape, "", dtype=object), np.full((2, *shape, n), np.nan)
    for d, k, i in np.argwhere(stands):
        u = first[d, k, i]
        known = equilibrium_sets(system, u, values=points[i], memory=_memory(system, last[d, k, i]))
        stood = next((one for one in known if one.holds(u[None, :], tolerance)[0]), None)
        if stood is None:
            continue
        shown = np.array([u, stood.lower, stood.upper])
        settler.engine.hide(shown, np.full(3, modes[d, k, i]))
        names[d, k, i], extent[:, d, k, i] = stood.name(system.modes), shown[1:]
        if status[d, k, i] == codes.NO_CONVERGENCE:
            status[d, k, i], period[d, k, i] = codes.OK, 1
            for key in ("section", "maximum", "minimum"):
                arrays[key][d, k, i] = shown[0]
            for key in ("residual", "crossings_per_period", "contacts_per_period"):
                arrays[key][d, k, i] = 0.0
    if not names.any():
        return {}
    return {"equilibrium": names.astype(str), "equilibrium_minimum": extent[0], "equilibrium_maximum": extent[1]}


def _stands(
    system: System,
    tolerance: float,
    u: FloatArray,
    maximum: FloatArray,
    minimum: FloatArray,
    period: IntArray,
    status: IntArray,
) -> Any:
    """Marks of runs that do not move any more, or hardly, at places u (..., n)."""
    with np.errstate(invalid="ignore"):
        still = ~(maximum - minimum > tolerance * (system.scale_vector() + np.abs(u))).any(axis=-1)
    still &= (period == 1) | (status == codes.SLOW)
    if system.period() is None and not system.explicit_time:
        still |= (status == codes.NO_CONVERGENCE) & np.isfinite(u).all(axis=-1)
    return still


def _attractor(
    settler: Settler, point: FloatArray, run: Settled, stood: EquilibriumSet, memory: FloatArray
) -> Attractor:
    """The attractor of a run that has ended at an equilibrium; neighbours within a set neither part nor meet."""
    system, mode = settler.system, stood.modes[0]
    points = np.array([stood.point, *(one.u for one in stood.extremes)]) if stood.free else stood.point[None, :]
    multiplier, exponent, period = 1.0, 0.0, system.period_at(point[0])
    if not stood.free and period is None:
        J = mode_field(system.traced, mode).evaluate(stood.point, point[0], memory)[1]
        multiplier, exponent = np.nan, float(sorted_eigenvalues(J)[0].real)
    elif not stood.free:
        multiplier = float(run.multiplier[0])
        with np.errstate(divide="ignore"):
            exponent = float(np.log(multiplier) / period)
    extent = np.array([stood.upper, stood.lower])
    settler.engine.hide(extent, np.full(2, mode))
    return Attractor(
        1,
        points,
        np.array([mode] * len(points)),
        run.last[0],
        int(run.mode[0]),
        extent[0],
        extent[1],
        multiplier,
        exponent,
        0.0,
        settler.least_at(run.last[0, : len(system.states)], run.last[0, : len(system.states)]),
        True,
        name=stood.name(system.modes),
        standing=stood,
    )
