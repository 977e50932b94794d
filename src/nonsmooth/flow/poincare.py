"""``poincare``: the points in which trajectories meet a section."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Unpack

import numpy as np

from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.equilibria import refuse_resting
from nonsmooth.flow.failure import beyond_stops, refuse_beyond_stops, solve_error, warn_if_slow
from nonsmooth.flow.options import Solver, as_called, solver_of
from nonsmooth.flow.sections import Poincare, Stroboscopic, section_plan
from nonsmooth.flow.starts import first_states, is_one_start
from nonsmooth.kernels.hybrid import codes
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import at_least

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System


def result_status(code: int) -> int:
    """The status of a result for a kernel's code: a start beyond a stop is a point that did not converge."""
    return codes.NO_CONVERGENCE if code < 0 else int(code)


@checked
def poincare(
    system: System,
    *,
    section: Stroboscopic | Poincare | None = None,
    n: Annotated[int, at_least(1)] = 1000,
    transient: Annotated[int, at_least(0)] = 0,
    start: Any = None,
    **options: Unpack[Solver],
) -> xr.Dataset:
    """Section points of a trajectory, or of several.

    Parameters
    ----------
    system : System
    section : Stroboscopic or Poincare, optional
        ``Stroboscopic(0)`` where the system has a period.
    n : int
        Number of returns to record.
    transient : int
        Returns to pass over first.
    start : state or list of states, optional
        As in :func:`nonsmooth.simulate`; zeros where not given.

    Returns
    -------
    xarray.Dataset
        ``section(iterate, state)``, ``time``, ``mode``, ``status``; with the dim ``start`` for several starts.

    Raises
    ------
    ValueError
        A start at an equilibrium, from which no section is met.
    SolveError
        A single run that could not be completed.
    """
    asked = as_called(locals())
    plan = section_plan(system, section)[1]
    plan = plan._replace(extremes=False)
    begun = first_states(system, start)
    starts = np.array([state.u for state in begun])
    if is_one_start(start):
        refuse_beyond_stops(system, starts)
    if plan.indicator >= 0:
        refuse_resting(system, begun, system.parameter_vector()[None, :], "poincare")
    engine = engine_for(system, **solver_of(options))
    out = engine.kept(len(starts), n)
    points = np.tile(system.parameter_vector(), (len(starts), 1))
    tables = engine.prepare(points)
    for k, state in enumerate(begun):
        engine.chain(tables, k, k + 1, state, None, plan, transient, n, out)
    beyond = beyond_stops(system, points, starts)
    out.status[beyond], out.section[beyond], out.section_time[beyond] = codes.BEYOND_STOP, np.nan, np.nan
    if is_one_start(start) and out.status[0] not in (codes.OK, codes.NOT_GUARANTEED):
        raise solve_error(int(out.status[0]), begun=(system, starts[0]))
    warn_if_slow(system, starts, out.section)
    engine.hide(out.section, out.section_mode)
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance
    from nonsmooth.results.schema import section_points

    labels = labels_of(system)
    return section_points(
        labels,
        provenance(labels, "poincare", asked, method=engine.name),
        section=out.section,
        time=out.section_time,
        mode=out.section_mode,
        status=[result_status(code) for code in out.status],
        starts=starts,
        squeeze=("start",) if is_one_start(start) else (),
    )
