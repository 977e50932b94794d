"""``continue_equilibrium``: follow an equilibrium of an autonomous system to its Hopf points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from nonsmooth.continuation.arguments import LargestStep, allowed_range, limits
from nonsmooth.continuation.branches.following import both_ways, dataset
from nonsmooth.continuation.branches.records import record_of
from nonsmooth.continuation.events.of_equilibria import AlongEquilibria, standing
from nonsmooth.continuation.march.march import Limits, MarkedPoint
from nonsmooth.continuation.problems.equilibrium import equilibria_near
from nonsmooth.errors import SolveError
from nonsmooth.flow.mode_fields import MOST, every_mode, mode_field
from nonsmooth.flow.options import Varied
from nonsmooth.flow.starts import first_state
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Range, at_least
from nonsmooth.system.system import System

if TYPE_CHECKING:
    import xarray as xr

STARTS, FARTHEST = 64, 2.0  # of Newton's method where modes are not affine, and how far off, in units of the scales


@checked
def continue_equilibrium(
    system: System,
    parameter: Varied,
    range: Range,
    *,
    start: Any = None,
    mode: str | None = None,
    step: LargestStep = 0.02,
    points: Annotated[int, at_least(1)] = 1000,
) -> xr.Dataset:
    """Follow an equilibrium of an autonomous system in a parameter.

    Parameters
    ----------
    system : System
    parameter : str
    range : (low, high)
        From the system's own value it goes both ways.
    start : state, optional
        A guess; zeros where not given.
    mode : str, optional
        The mode it lies in; that of the equilibrium nearest to the guess where not given.
    step : float
        The largest step, in units of the range and of the states' scales.
    points : int
        The largest number of points each way.

    Returns
    -------
    xarray.Dataset
        Over ``point``: the parameter, ``u(point, state)``, ``eigenvalues``, ``stable``, ``mode``; of a set of
        equilibria, as dry friction leaves it, ``u`` is the mean of its extreme points, and ``u_lower`` and
        ``u_upper`` are its extent in each state (infinite where it has no end). Special points as in
        :func:`nonsmooth.special_points`: ``fold``, ``pitchfork``, ``transcritical``, ``hopf`` (a row given to
        ``continue_orbit`` gives the cycles that emanate from it), ``boundary_equilibrium``.
        Over ``end`` how the branch ends: ``ended`` and, in a sentence, ``ended_because``.

    Raises
    ------
    ValueError, TypeError
        A system with time in its equations, arguments that do not fit.
    SolveError
        No equilibrium was found near the guess.
    Interrupted
        Ctrl-C; what was found until then is its ``result``.
    """
    from nonsmooth.results.branches import EQUILIBRIUM, SPECIAL_EQUILIBRIUM

    if (every := every_mode(system.traced, system.parameter_vector())) is None:
        raise ValueError(f"{system.name!r} has more than {MOST} combinations of contact states: take fewer elements")
    if system.depends_on_time:
        raise ValueError(f"{system.name!r} depends on time: it has no equilibria; find_orbit finds its periodic orbits")
    low, high = limits(system, parameter, range, system.values.get(parameter), what="the system")
    here = system.values[parameter]
    state = first_state(system, start, mode)
    modes, rng = None if mode is None else [int(state.counters[0])], np.random.default_rng(0)
    affine = all(mode_field(system.traced, one).affine for one in modes or every)
    for away in np.linspace(0.0, FARTHEST, 1 if affine else STARTS):
        guess = np.nan_to_num(state.u) + away * system.scale_vector() * rng.normal(size=len(state.u))
        near = equilibria_near(system, parameter, high - low, guess, here, modes)
        if (first := next(filter(None, map(standing, near)), None)) is not None:
            break
    else:
        raise SolveError(
            "no equilibrium was found from this start, nor from others around it: Newton's method did not converge in "
            "any mode, or what it found lies outside its mode or behind a contact. Give a nearer start",
            status="no_convergence",
        )
    box = ((-1, *allowed_range(system, parameter, low, high)),)
    policy, ahead = AlongEquilibria(), first.facing(1.0)
    record = both_ways(policy, Limits(box, step, points), first.facing(-1.0), [record_of(MarkedPoint(ahead))], ahead)
    options = {
        "parameter": parameter,
        "range": (low, high),
        "step": step,
        "points": points,
        "mode": mode,
        "start": [float(x) for x in state.u],
    }
    values, tables = {parameter: [point.value for point in record.points]}, (EQUILIBRIUM, SPECIAL_EQUILIBRIUM)
    attrs, method = {"parameter": parameter}, "pseudo-arclength"
    return dataset(system, "continue_equilibrium", values, tables, record, policy, options, {}, attrs, method)
