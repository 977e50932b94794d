"""``chart``: long-time behaviour over a plane of two parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Unpack, cast

import numpy as np

from nonsmooth.attractors.settler import settler_for
from nonsmooth.campaign.run import run, whole_or_part
from nonsmooth.campaign.work import CHUNK, STORED, inputs
from nonsmooth.diagrams.chart_work import ChartWork
from nonsmooth.errors import shortened
from nonsmooth.flow.engines.devices import BATCH
from nonsmooth.flow.equilibria import refuse_resting
from nonsmooth.flow.failure import warn_if_small
from nonsmooth.flow.loads import checked_loads
from nonsmooth.flow.options import Campaign, as_called, kept_of, workers_of
from nonsmooth.flow.starts import first_states, is_one_start
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import at_least, swept_values

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.flow.engines.engine import FloatArray
    from nonsmooth.system.system import System

EXPONENT_RETURNS = 1000


@checked
def chart(
    system: System,
    grid: Mapping[str, Any],
    *,
    start: Any = None,
    carry: Annotated[Mapping[str, Literal["up", "down"]], 'write carry={"rho": "up"} (or "down")'] | None = None,
    stop_early: bool = True,
    extremes: bool = True,
    loads: bool = False,
    lyapunov: bool | Annotated[int, at_least(0)] = False,
    refine: bool | float = False,
    **options: Unpack[Campaign],
) -> xr.Dataset:
    """Period numbers, contacts and extremes over a plane of two parameters.

    Parameters
    ----------
    system : System
    grid : mapping
        Two parameters and their values: ``{"omega": (A,), "rho": (B,)}``.
    start : state or list of states, optional
        Every point begins there, as in :func:`nonsmooth.simulate`; zeros where not given. Several starts add the dim
        ``start`` and ``n_attractors``.
    carry : mapping, optional
        ``{"rho": "up"}`` or ``{"rho": "down"}``: along this parameter the state is carried from point to point. On a
        GPU the rows run side by side, so it needs many of them.
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
    device : {"cpu", "cuda"}
        ``"cuda"`` runs the points on an NVIDIA GPU, one per thread, by the exact flow or by ``method="taylor"``;
        with ``carry`` by the exact flow of two states only. See the guide "A chart on a GPU".

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
    Interrupted
        Ctrl-C; a chart with the points computed until then is its ``result`` (with ``store`` they are there).
    ImportError, RuntimeError
        ``device="cuda"`` without the package numba-cuda, or without a GPU.

    Notes
    -----
    No section points are stored: without extremes a chart takes 19 bytes per point.
    With ``refine`` a coarse grid is computed, cells whose corners differ are halved down to single points, and so are
    those beside them where a point in between disagrees; see :mod:`nonsmooth.diagrams.chart_refine`.
    """
    asked = as_called(locals())
    work, result = plan_chart(system, **asked)
    label = f"chart over {' and '.join(grid)}"
    chunked = options["store"] is not None or options["client"] is not None
    if not isinstance(refine, bool) or refine:
        from nonsmooth.diagrams.chart_refine import refined

        if chunked:
            raise ValueError("refine decides from its results what to compute next: it takes no store and no client")
        fill = partial(refined, work, part=refine, threads=workers_of(options), progress=options["progress"])
    else:
        if chunked and work.device == "cpu":
            work = replace(work, chunk=STORED)
        fill = partial(run, work, **kept_of(options))
    return whole_or_part(fill, label, result)


class PlannedChart(NamedTuple):
    """A chart's work, and what makes a result of its columns, of all of them or of those that are there."""

    work: ChartWork
    result: Callable[[Mapping[str, Any], bool], xr.Dataset]


@checked(of=chart)
def plan_chart(system: System, grid: Mapping[str, Any], **options: Any) -> PlannedChart:
    """The work of a :func:`chart`, checked and laid out, without computing anything."""
    asked, values = as_called(locals()), _grid(system, grid)
    edges = _edges(system, values)
    along = _carry(values, options["carry"])
    begun = first_states(system, options["start"])
    starts = np.array([state.u for state in begun])
    lyapunov = options["lyapunov"]
    n_exponent = (EXPONENT_RETURNS if lyapunov else 0) if isinstance(lyapunov, bool) else lyapunov
    if 0 < n_exponent < 40:
        raise ValueError(f"lyapunov = {lyapunov} returns are too few for an exponent; at least 40")
    # attractors are told apart by extremes; neighbours are as near as the motion is wide
    extremes = options["extremes"] or len(starts) > 1 or n_exponent > 0
    settler = settler_for(
        system,
        "chart",
        cast(Campaign, options),
        carried=along is not None,
        stop_early=options["stop_early"],
        extremes=extremes,
    )
    if settler.plan.indicator >= 0:
        refuse_resting(system, begun, edges, "chart")
    measured = checked_loads(system, options["loads"], "chart")
    axes, order = _axes(values, along)
    work = ChartWork(
        settler,
        axes,
        np.array([state.place for state in begun]),
        settler.told(np.array([state.counters[0] for state in begun])),
        along is not None,
        n_exponent,
        tuple(measured),
        chunk=CHUNK if settler.device == "cpu" else BATCH,
        described=inputs(system, "chart", asked | {"grid": values}),
    )

    def result(flat: Mapping[str, Any], whole: bool) -> xr.Dataset:
        from nonsmooth.results.global_schema import chart as build
        from nonsmooth.results.labels import labels_of
        from nonsmooth.results.provenance import provenance

        arrays = {name: order(column) for name, column in flat.items()}
        if whole and "maximum" in arrays:
            warn_if_small(system, starts, arrays["maximum"], arrays["minimum"])
        labels = labels_of(settler.system)
        record = provenance(labels, "chart", asked | {"grid": values}, method=settler.engine.name)
        one_start = is_one_start(options["start"]) or len(starts) == 1
        return build(labels, record, values, arrays, starts=starts, one_start=one_start, loads=measured)

    return PlannedChart(work, result)


def _grid(system: System, grid: Any) -> dict[str, FloatArray]:
    if not isinstance(grid, Mapping) or len(grid) != 2:
        given = list(grid) if isinstance(grid, Mapping) else grid
        form = '{"omega": values, "rho": values}'
        raise ValueError(f"grid must name two parameters, {form}; given: {shortened(given)}")
    return {str(name): swept_values(system, name, values) for name, values in grid.items()}


def _edges(system: System, values: Mapping[str, FloatArray]) -> FloatArray:
    """The parameter points at the edges of the plane: what the system cannot have is told before any is computed."""
    (a, first), (b, second) = values.items()
    places = [np.meshgrid(first[[0, -1]], second), np.meshgrid(first, second[[0, -1]])]
    x, y = (np.concatenate([one.ravel() for one in of]) for of in zip(*places, strict=True))
    return system.parameter_points({a: x, b: y})


def _carry(values: Mapping[str, FloatArray], carry: Any) -> tuple[str, str] | None:
    if carry is None:
        return None
    if len(carry) != 1 or not carry.keys() <= values.keys():
        raise ValueError(f"carry = {shortened(carry)}: the state is carried along one of the grid's {list(values)}")
    return next(iter(carry.items()))


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
