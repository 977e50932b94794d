"""``chart``: long-time behaviour over a plane of two parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.attractors.settle import longest_period
from nonsmooth.attractors.settler import Settler
from nonsmooth.campaign.run import run
from nonsmooth.campaign.work import CHUNK, STORED, inputs
from nonsmooth.diagrams.chart_work import ChartWork
from nonsmooth.errors import shortened
from nonsmooth.flow.arguments import check_options, check_system, swept_values, whole_number, yes_or_no
from nonsmooth.flow.engines.devices import BATCH, engine_on, on_gpu, workers_of
from nonsmooth.flow.engines.linear import PlanarEngine
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.equilibria import refuse_resting
from nonsmooth.flow.loads import Quantities, checked_loads
from nonsmooth.flow.scales import warn_if_small
from nonsmooth.flow.sections import Poincare, Stroboscopic, section_plan
from nonsmooth.flow.starts import is_one_start, plain_start, start_states
from nonsmooth.results.progress import Progress
from nonsmooth.system.names import by_name

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.flow.engines.engine import FloatArray
    from nonsmooth.system.system import System

__all__ = ["PlannedChart", "chart", "plan_chart"]

EXPONENT_RETURNS = 1000


@by_name
def chart(
    system: System,
    grid: Mapping[str, Any],
    *,
    start: Any = None,
    carry: Mapping[str, str] | None = None,
    section: Stroboscopic | Poincare | None = None,
    transient: int = 500,
    keep: int = 60,
    max_period: int | None = None,
    stop_early: bool = True,
    extremes: bool = True,
    loads: bool = False,
    lyapunov: bool | int = False,
    refine: bool | float = False,
    method: str = "auto",
    rtol: float | None = None,
    atol: Any = None,
    threads: int | None = None,
    device: str = "cpu",
    store: Any = None,
    client: Any = None,
    any_cpu: bool = False,
    progress: Progress = True,
    **expert: Any,
) -> xr.Dataset:
    """Period numbers, contacts and extremes over a plane of two parameters.

    Parameters
    ----------
    system : System
    grid : mapping
        Two parameters and their values: ``{"omega": (A,), "rho": (B,)}``.
    start : state or list of states, optional
        Every point begins there; zeros where not given. Several starts add the dim ``start`` and ``n_attractors``.
    carry : mapping, optional
        ``{"rho": "up"}`` or ``{"rho": "down"}``: along this parameter the state is carried from point to point. On a
        GPU the rows run side by side, so it needs many of them.
    section : Stroboscopic or Poincare, optional
        ``Stroboscopic(0)`` where the system has a period.
    transient : int
        Section returns passed over, so that the motion settles. A point that is still settling gets up to eight times
        as many.
    keep : int
        Section returns after them, from which the period number follows.
    max_period : int, optional
        Longest period number searched, less than ``keep``; the smaller of 16 and ``keep`` - 1 where not given.
    stop_early : bool
        A point ends as soon as its period number is certain (a small return, and multipliers inside the unit circle)
        instead of at the end of its transient. Labels are the same, but for chaotic transients that end about then.
    extremes : bool
        Whether ``maximum`` and ``minimum`` are wanted.
    loads : bool
        True: loads of elements and work per return, as in :func:`nonsmooth.sweep`.
    lyapunov : bool or int
        Largest exponent, from two neighbours over 1000 (or this many) returns. On a Poincare section of an autonomous
        system the largest beside the zero along the flow.
    refine : bool or float
        Compute points near boundaries only and infer the rest; a number is the largest part of the points to compute.
        See Notes.
    method, rtol, atol
        See :func:`nonsmooth.flow.engines.methods.engine_for`.
    threads : int, optional
        Threads for independent work; the result does not depend on it. Default: one per core.
    device : {"cpu", "cuda"}
        ``"cuda"`` runs the points on an NVIDIA GPU, one per thread, by the exact flow or by ``method="taylor"``;
        with ``carry`` by the exact flow of two states only. See the guide "A chart on a GPU".
    store : path, optional
        A Zarr store for finished chunks; what is there already is not computed again.
    client : dask.distributed.Client, optional
        Computes the chunks on its workers.
    any_cpu : bool
        Go on with a store that was begun on another type of processor, or of GPU with ``device="cuda"``.
    progress : bool, or function
        A bar, on a terminal and in a notebook; nothing elsewhere. A function hears the fraction done, and cancels the
        work by returning False (:func:`nonsmooth.results.progress.progress`).

    Returns
    -------
    xarray.Dataset
        Over the two parameters: ``period_number`` (0: none found), ``crossings_per_period``,
        ``contacts_per_period``, ``maximum``, ``minimum``, ``status``, and where asked for ``lyapunov`` (per unit
        time) with ``lyapunov_error``, ``n_attractors``, ``confidence`` and ``computed``, and the loads (NaN where a
        point was not computed).

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit, and starts at an equilibrium of a system without forcing. A point that fails keeps
        its status; the others are whole.
    ImportError, RuntimeError
        ``device="cuda"`` without the package numba-cuda, or without a GPU.

    Notes
    -----
    No section points are stored: without extremes a chart takes 19 bytes per point.
    With ``refine`` a coarse grid is computed, cells whose corners differ are halved down to single points, and so are
    those beside them where a point in between disagrees; see :mod:`nonsmooth.diagrams.chart_refine`.
    """
    given = dict(locals())
    for name in ("system", "grid", "threads", "store", "client", "any_cpu", "progress", "expert"):
        del given[name]
    planned = plan_chart(system, grid, campaign=store is not None or client is not None, **given, **expert)
    if threads is not None:
        threads = whole_number(threads, "threads", 1)
    threads = workers_of(device, threads, client)
    work, label = planned.work, f"chart over {' and '.join(planned.values)}"
    if not isinstance(refine, bool | np.bool_) or refine:
        from nonsmooth.diagrams.chart_refine import refined

        if store is not None or client is not None:
            raise ValueError("refine decides from its results what to compute next: it takes no store and no client")
        arrays = refined(work, refine, threads=threads, progress=progress, label=label)
    else:
        flat = run(work, threads=threads, progress=progress, label=label, store=store, client=client, any_cpu=any_cpu)
        arrays = {name: planned.order(column) for name, column in flat.items()}
    if "maximum" in arrays:
        warn_if_small(system, work.starts, arrays["maximum"], arrays["minimum"])
    from nonsmooth.results.global_schema import chart as build
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance

    labels = labels_of(system)
    return build(
        labels, provenance(labels, "chart", planned.options, method=work.settler.engine.name), planned.values, arrays,
        starts=work.starts, one_start=is_one_start(start) or len(work.starts) == 1, loads=planned.loads,
    )  # fmt: skip


@dataclass(frozen=True)
class PlannedChart:
    """A chart's work, and how its flat columns become arrays over the grid."""

    work: ChartWork
    values: Mapping[str, FloatArray]
    options: Mapping[str, Any]
    order: Callable[[Any], Any]
    loads: Quantities


def plan_chart(
    system: System, grid: Mapping[str, Any], *, start: Any = None, carry: Any = None, section: Any = None,
    transient: Any = 500, keep: Any = 60, max_period: Any = None, stop_early: bool = True, extremes: bool = True,
    loads: Any = False, lyapunov: Any = False, refine: Any = False, method: str = "auto", rtol: Any = None,
    atol: Any = None, device: str = "cpu", campaign: bool = False, **expert: Any,
) -> PlannedChart:  # fmt: skip
    """Check the arguments of :func:`chart` and lay its work out, without computing anything."""
    check_system(system, "chart")
    check_options(system, expert, chart)
    values = _grid(system, grid)
    transient, keep = whole_number(transient, "transient", 0), whole_number(keep, "keep", 2)
    max_period = longest_period(keep, max_period)
    _check_edges(system, values)
    section, plan = section_plan(system, section)
    along = _carry(values, carry)
    starts = start_states(system, start)
    if plan.indicator >= 0:
        refuse_resting(system, starts, _corners(system, values), "chart")
    measured = checked_loads(system, loads, "chart")
    n_exponent = (EXPONENT_RETURNS if lyapunov else 0) if isinstance(lyapunov, bool | np.bool_) else lyapunov
    n_exponent = whole_number(n_exponent, "lyapunov", 0)
    if 0 < n_exponent < 40:
        raise ValueError(f"lyapunov = {lyapunov} returns are too few for an exponent; at least 40")
    # attractors are told apart by them; neighbours are as near as the motion is wide
    stop_early = yes_or_no(stop_early, "stop_early")
    extremes = yes_or_no(extremes, "extremes") or len(starts) > 1 or n_exponent > 0
    engine = engine_on(device, engine_for(system, method, rtol, atol, **expert), plan)
    gpu = on_gpu(device, "chart", engine, plan, carried=along is not None and not isinstance(engine, PlanarEngine))
    settler = Settler(
        system, engine, plan, transient, keep, max_period, stop_early, extremes, rtol, atol, expert, device
    )
    options = {
        "grid": values, "start": plain_start(system, start), "carry": None if carry is None else dict(carry),
        "section": section, "transient": transient, "keep": keep, "max_period": max_period,
        "stop_early": stop_early, "extremes": extremes, **({"loads": True} if measured else {}),
        "lyapunov": n_exponent, "refine": refine,
        "method": method, "rtol": rtol, "atol": atol, **({"device": device} if gpu else {}), **expert,
    }  # fmt: skip
    axes, order = _axes(values, along)
    chunk = BATCH if gpu else STORED if campaign else CHUNK
    work = ChartWork(
        settler, axes, starts, along is not None, n_exponent, tuple(measured),
        chunk=chunk, described=inputs(system, "chart", options),
    )  # fmt: skip
    return PlannedChart(work, values, options, order, measured)


def _grid(system: System, grid: Any) -> dict[str, FloatArray]:
    if not isinstance(grid, Mapping) or len(grid) != 2:
        given = list(grid) if isinstance(grid, Mapping) else grid
        form = '{"omega": values, "rho": values}'
        raise ValueError(f"grid must name two parameters, {form}; given: {shortened(given)}")
    return {str(name): swept_values(system, name, values) for name, values in grid.items()}


def _check_edges(system: System, values: Mapping[str, FloatArray]) -> None:
    """Values that the system cannot have are told before anything is computed, not at the last of many points."""
    (a, first), (b, second) = values.items()
    for along, across in ((first[[0, -1]], second), (first, second[[0, -1]])):  # the plane's edges
        x, y = np.meshgrid(along, across)
        system.parameter_points({a: x.ravel(), b: y.ravel()})


def _corners(system: System, values: Mapping[str, FloatArray]) -> FloatArray:
    """The parameter points at the plane's corners (4, n_parameters)."""
    (a, first), (b, second) = values.items()
    x, y = np.meshgrid(first[[0, -1]], second[[0, -1]])
    return system.parameter_points({a: x.ravel(), b: y.ravel()})


def _carry(values: Mapping[str, FloatArray], carry: Any) -> tuple[str, str] | None:
    if carry is None:
        return None
    form = f'carry={{"{next(iter(values))}": "up"}} (or "down")'
    if not isinstance(carry, Mapping) or len(carry) != 1:
        raise ValueError(f"carry = {shortened(carry)}: the state is carried along one parameter; write {form}")
    ((name, direction),) = carry.items()
    if name not in values or direction not in ("up", "down"):
        raise ValueError(f"carry = {shortened(carry)}: allowed are the grid's parameters {list(values)}; write {form}")
    return name, direction


def _axes(values: Mapping[str, FloatArray], along: tuple[str, str] | None) -> tuple[dict[str, FloatArray], Any]:
    """The plane in the order in which it is computed, and how a flat column of it becomes an array over the grid."""
    names = list(values)
    shape = tuple(len(values[name]) for name in names)
    if along is None:
        return dict(values), lambda column: column.reshape(*shape, *column.shape[1:])
    inner = along[0]
    outer = next(name for name in names if name != inner)
    met = np.argsort(values[inner], kind="stable")
    met = met[::-1] if along[1] == "down" else met
    back = np.argsort(met, kind="stable")

    def order(column: Any) -> Any:
        table = column.reshape(len(values[outer]), len(met), *column.shape[1:])[:, back]
        return table if names[0] == outer else np.swapaxes(table, 0, 1)

    return {outer: values[outer], inner: values[inner][met]}, order
