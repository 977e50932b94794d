"""``sweep``: brute force over a parameter, as a rig would do it; its picture is the bifurcation diagram."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.attractors.settle import longest_period
from nonsmooth.attractors.settler import Settler
from nonsmooth.attractors.standing import standing_in_sweep
from nonsmooth.diagrams.density import bin_edges, coarse_values, given_ranges
from nonsmooth.diagrams.sweep_pieces import Report, Slot, ended, largest_of, pieces_of, run_on_gpu, run_pieces
from nonsmooth.flow.arguments import check_options, check_system, swept_values, whole_number
from nonsmooth.flow.engines.devices import engine_on, on_gpu, workers_of
from nonsmooth.flow.engines.engine import FloatArray
from nonsmooth.flow.engines.methods import engine_for, warn_if_coarse
from nonsmooth.flow.equilibria import refuse_resting
from nonsmooth.flow.loads import Quantities, checked_loads
from nonsmooth.flow.scales import warn_if_small
from nonsmooth.flow.sections import Poincare, Stroboscopic, section_plan
from nonsmooth.flow.starts import is_one_start, plain_start, start_states
from nonsmooth.results.memory import room_for
from nonsmooth.results.progress import Progress
from nonsmooth.system.names import by_name

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System

__all__ = ["DIRECTIONS", "sweep"]

DIRECTIONS: dict[str | None, tuple[str, ...]] = {
    "up": ("up",), "down": ("down",), "both": ("up", "down"), None: ("none",),
}  # fmt: skip


@by_name
def sweep(
    system: System,
    parameter: str,
    values: Any,
    *,
    direction: str | None = "up",
    start: Any = None,
    section: Stroboscopic | Poincare | None = None,
    transient: int = 500,
    keep: int = 100,
    max_period: int | None = None,
    judge: bool = True,
    extremes: bool = True,
    loads: bool = False,
    density: bool | Mapping[str, Any] = False,
    bins: int = 400,
    method: str = "auto",
    rtol: float | None = None,
    atol: Any = None,
    threads: int | None = None,
    device: str = "cpu",
    progress: Progress = True,
    **expert: Any,
) -> xr.Dataset:
    r"""Long-time behaviour over a parameter: section points, extremes, period numbers.

    Parameters
    ----------
    system : System
    parameter : str
        The parameter that is varied.
    values : array (P,)
        Its values, in any order; the result keeps it.
    direction : {"up", "down", "both", None}
        Carry the state along with rising or falling values (at equal phase of the forcing), both, or begin every point
        at ``start``.
    start : state or list of states, optional
        First state; zeros where not given. Several starts show attractors that coexist.
    section : Stroboscopic or Poincare, optional
        ``Stroboscopic(0)`` where the system has a period.
    transient : int
        Section returns passed over at each value, so that the motion settles. A point that is still settling gets up to
        eight times as many; what is not settled then has the status ``slow``.
    keep : int
        Section returns recorded after them, at each value.
    max_period : int, optional
        Longest period number searched, less than ``keep``; the smaller of 16 and ``keep`` - 1 where not given.
    judge : bool
        False: record what follows one transient, settled or not, and leave out ``period_number`` and ``residual``. A
        first look, in half the time.
    extremes : bool
        False, with ``judge=False``: leave out the extremes of states, indicators and outputs too, which takes half the
        time of the kept returns away.
    loads : bool
        True: impulses, impact speeds and energies of each element and the work of forcing, damping and base, per return
        (a millisecond or more for each point). See Notes.
    density : bool or mapping
        Store a histogram of each state's section points instead of the points. A mapping gives ranges,
        ``{"x": (lowest, highest)}``; where none is given it is that of a coarse sweep and a twentieth more either side.
    bins : int
        Bins of these histograms.
    method, rtol, atol
        See :func:`nonsmooth.flow.engines.methods.engine_for`.
    threads : int, optional
        Threads for independent work; the result does not depend on it. Default: one per core.
    device : {"cpu", "cuda"}
        ``"cuda"`` runs the points on an NVIDIA GPU, one per thread, with ``direction=None`` and without
        ``density``: by the exact flow or by ``method="taylor"``. See the guide "A chart on a GPU".
    progress : bool, or function
        A bar, on a terminal and in a notebook; nothing elsewhere. A function hears the fraction done, and cancels the
        work by returning False (:func:`nonsmooth.results.progress.progress`).

    Returns
    -------
    xarray.Dataset
        Over the parameter (and ``direction``, ``start``): ``section(..., iterate, state)``, true extremes ``maximum``,
        ``minimum``, ``period_number`` (0: none found), ``residual``, ``crossings_per_period``,
        ``contacts_per_period``, ``clearance``, extremes of the outputs, ``status``. Where some point stands:
        ``equilibrium``, its name (empty where it moves), and the extent of the set of equilibria that it belongs to,
        ``equilibrium_minimum`` and ``equilibrium_maximum``. With ``density``, in place of
        ``section``: ``density(..., state, bin)`` (section points in each bin), ``outside(..., state)`` (those beyond
        the range) and ``bin_edge(state, edge)``. With ``loads``, of each element ``<element>_force_maximum`` and
        ``<element>_energy``, of rigid stops ``_impact_speed_maximum``, ``_impacts`` and ``_impulse`` too, and of
        :func:`nonsmooth.mechanical` ``work_of_forcing``, ``work_of_damping`` and ``work_of_base``.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit, and starts at an equilibrium of a system without forcing. A point that fails keeps
        its status; the others are whole.
    ImportError, RuntimeError
        ``device="cuda"`` without the package numba-cuda, or without a GPU.

    Notes
    -----
    With ``density`` memory does not depend on ``keep``: points are counted as soon as they have been judged.
    A period number p is granted only where the p-th return is below 1e-9 of the motion's size and contracts:
    see :mod:`nonsmooth.kernels.judging.judge`.

    Loads are per return of the section (per forcing period), averaged over the returns of a cycle, from the last
    section point on; over ``keep`` returns, at most 200, where the motion has no period. Forces are without impulses.
    The energy of an element is what it takes from the masses,

    .. math:: E = -\int \lambda\, w \cdot v\, dt - \sum \Lambda\, w \cdot (v^+ + v^-) / 2

    with the speed w.v of the masses along it (negative where a belt or a moving stop gives energy). Work of forcing and
    base is done on the masses, that of damping by them, so on a cycle ``work_of_forcing + work_of_base`` is
    ``work_of_damping`` and the energies of all elements (and ``work_of_stiffness`` where K is not symmetric). Forcing
    and damping of a system of another kind cannot be told apart, and their work is left out.
    """
    check_system(system, "sweep")
    check_options(system, expert, sweep)
    numbers = swept_values(system, parameter, values)
    directions = _directions(direction)
    transient, keep = whole_number(transient, "transient", 0), whole_number(keep, "keep", 2)
    max_period = longest_period(keep, max_period)
    if threads is not None:
        threads = whole_number(threads, "threads", 1)
    section, plan = section_plan(system, section)
    engine = engine_on(device, engine_for(system, method, rtol, atol, **expert), plan)
    gpu = on_gpu(device, "sweep", engine, plan, carried=direction is not None)
    if not isinstance(judge, bool):
        raise TypeError(f"judge = {judge!r}: give True or False")
    if not isinstance(extremes, bool):
        raise TypeError(f"extremes = {extremes!r}: give True or False")
    if judge and not extremes:
        raise ValueError("a period number rests on the size of the motion: give judge=False with extremes=False")
    if not judge and (gpu or density is not False):
        raise ValueError('judge=False records section points on the processor: leave out density and device="cuda"')
    if gpu and density is not False:
        raise ValueError('section points are counted on the processor: leave out density, or device="cuda"')
    threads = workers_of(device, threads)
    starts = start_states(system, start)
    points = system.parameter_points({parameter: numbers})
    if plan.indicator >= 0:
        refuse_resting(system, starts, points, "sweep")
    ranges, n_bins = ({}, 0) if density is False else given_ranges(system, density, bins)
    width = keep * (len(system.states) + 2) if density is False else len(system.states) * (n_bins + 1) / 2
    room_for(
        16.0 * width * len(points) * len(directions) * len(starts), f"a sweep over {len(points)} values",
        "take fewer values, starts or bins, keep fewer returns, or count them with density=True",
    )  # fmt: skip
    edges = None
    measured = checked_loads(system, loads, "sweep")
    if density is not False:
        coarse = None
        if len(ranges) < len(system.states):
            few = min(keep, 1000)
            coarse = sweep(
                system, parameter, coarse_values(numbers), direction=direction, start=start, section=section,
                transient=transient, keep=few, max_period=min(max_period, few - 1), method=method, rtol=rtol,
                atol=atol, threads=threads, progress=False, **expert,
            )["section"].transpose(..., "state").values  # fmt: skip
        edges = bin_edges(system, ranges, n_bins, coarse)
    settler = Settler(
        system, engine, plan._replace(extremes=extremes), transient, keep, max_period if judge else 0, False, rtol=rtol
    )
    slots = {(d, k): Slot(settler, points, edges, measured) for d in range(len(directions)) for k in range(len(starts))}
    options = {
        "parameter": parameter, "values": values, "direction": direction, "start": plain_start(system, start),
        "section": section, "transient": transient, "keep": keep, "max_period": max_period,
        **({} if judge else {"judge": False}), **({} if extremes else {"extremes": False}),
        **({"loads": True} if measured else {}),
        **({} if density is False else {"density": density, "bins": bins}),
        "method": method, "rtol": rtol, "atol": atol, **({"device": device} if gpu else {}), **expert,
    }  # fmt: skip
    squeeze = (() if direction == "both" else ("direction",)) + (("start",) if is_one_start(start) else ())
    if gpu:
        run_on_gpu(points, starts, slots, progress, parameter)
    else:
        settler.load()
        tables = engine.prepare(points)

        def march(slot: tuple[int, int], order: Sequence[int], report: Report) -> None:
            d, k = slot
            slots[slot].march(tables, order, starts[k], directions[d] != "none", report)

        run_pieces(march, pieces_of(directions, len(starts), numbers), threads, progress, parameter)
    largest = largest_of(starts, slots.values(), extremes)
    warn_if_coarse(system, engine, largest)
    warn_if_small(system, largest)
    return _dataset(
        system, engine.name, parameter, numbers, directions, starts, slots, options, squeeze, judge, extremes, measured
    )


def _directions(direction: Any) -> tuple[str, ...]:
    if not isinstance(direction, str | None) or direction not in DIRECTIONS:
        raise ValueError(f"direction = {direction!r}; allowed: {', '.join(map(repr, DIRECTIONS))}")
    return DIRECTIONS[direction]


def _dataset(
    system: System,
    method: str,
    parameter: str,
    numbers: FloatArray,
    directions: Sequence[str],
    starts: FloatArray,
    slots: Mapping[tuple[int, int], Slot],
    options: Mapping[str, Any],
    squeeze: Iterable[str],
    judge: bool,
    extremes: bool,
    measured: Quantities,
) -> xr.Dataset:
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance
    from nonsmooth.results.schema import sweep as build

    def gather(read: Callable[[Slot], Any]) -> np.ndarray:
        return np.stack([np.stack([read(slots[d, k]) for k in range(len(starts))]) for d in range(len(directions))])

    failed = gather(lambda slot: ~ended(slot))
    sides = armed_signs(system)

    def whole(values: np.ndarray) -> np.ndarray:
        """NaN where the point failed: the kernel's buffers hold what it had by then."""
        return np.where(failed.reshape(failed.shape + (1,) * (values.ndim - 3)), np.nan, values)

    returns = gather(lambda slot: np.full(len(numbers), slot.settler.keep, dtype=float))
    arrays = {
        "section": whole(gather(lambda s: s.kept.section)),
        "maximum": whole(gather(lambda s: s.extremes()[0])),
        "minimum": whole(gather(lambda s: s.extremes()[3])),
        "period_number": gather(lambda s: s.period_number),
        "residual": gather(lambda s: s.residual),
        "crossings_per_period": whole(gather(lambda s: s.kept.crossings) / returns),
        "contacts_per_period": whole(gather(lambda s: s.kept.contacts) / returns),
        "clearance": whole(gather(lambda s: np.where(sides > 0, -s.extremes()[1], s.extremes()[4]))),
        "output_maximum": whole(gather(lambda s: s.extremes()[2])),
        "output_minimum": whole(gather(lambda s: s.extremes()[5])),
        "status": gather(lambda s: s.status),
    }
    settler = slots[0, 0].settler
    if judge and slots[0, 0].counter is None and settler.device == "cpu":
        first = gather(lambda s: s.kept.section[:, 0])
        arrays |= standing_in_sweep(settler, system.parameter_points({parameter: numbers}), arrays, first)
    if not system.outputs or arrays["output_maximum"].shape[-1] != len(system.outputs):
        del arrays["output_maximum"], arrays["output_minimum"]
    if not judge:
        del arrays["period_number"], arrays["residual"]
    if not extremes:
        for name in ("maximum", "minimum", "clearance", "output_maximum", "output_minimum"):
            arrays.pop(name, None)
    counter = next(iter(slots.values())).counter
    if counter is not None:
        del arrays["section"]
        for name, part in (("density", "counts"), ("outside", "outside")):
            arrays[name] = gather(attrgetter(f"counter.{part}"))

    def of_load(name: str) -> np.ndarray:
        return gather(lambda s: s.loads[name])

    labels = labels_of(system)
    return build(
        labels, provenance(labels, "sweep", options, method=method), parameter, numbers, arrays,
        directions=directions, starts=starts, squeeze=tuple(squeeze),
        edges=None if counter is None else counter.edges,
        loads={name: (of_load(name), *measured[name]) for name in measured},
    )  # fmt: skip


def armed_signs(system: System) -> np.ndarray:
    """+1 or -1 for each indicator: the sign with which it first stands in a transition (+1 where in none)."""
    signs = np.ones(len(system.indicators), dtype=np.int64)
    for jump in reversed(system.transitions):
        for row in reversed(jump.rows):
            signs[row.indicator] = row.sign
    return signs
