"""``sweep``: brute force over a parameter, as a rig would do it; its picture is the bifurcation diagram."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from operator import attrgetter
from typing import TYPE_CHECKING, Annotated, Any, Literal, Unpack

import numpy as np

from nonsmooth.attractors.settled import usable
from nonsmooth.attractors.settler import Settler, settler_for
from nonsmooth.attractors.standing import standing_in_sweep
from nonsmooth.campaign.run import cores, over_items
from nonsmooth.diagrams.sweep_pieces import Slot, bin_edges, coarse_values, given_ranges, pieces_of, run_on_gpu
from nonsmooth.errors import Interrupted
from nonsmooth.flow.engines.engine import FloatArray, State
from nonsmooth.flow.engines.methods import warn_if_coarse
from nonsmooth.flow.equilibria import refuse_resting
from nonsmooth.flow.failure import warn_if_small
from nonsmooth.flow.loads import Quantities, checked_loads
from nonsmooth.flow.options import Settling, Varied, as_called, workers_of
from nonsmooth.flow.outputs import out_of_bounds
from nonsmooth.flow.starts import first_states, is_one_start
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.memory import room_for
from nonsmooth.results.progress import Progress
from nonsmooth.results.progress import progress as progress_bar
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Range, at_least, swept_values

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.symbolic.traced import Traced
    from nonsmooth.system.system import System

DIRECTIONS: dict[str | None, tuple[str, ...]] = {
    "up": ("up",),
    "down": ("down",),
    "both": ("up", "down"),
    None: ("none",),
}


@checked(keep=100)
def sweep(
    system: System,
    parameter: Varied,
    values: Any,
    *,
    direction: Literal["up", "down", "both", None] = "up",
    start: Any = None,
    judge: bool = True,
    extremes: bool = True,
    loads: bool = False,
    density: Annotated[bool | Mapping[str, Range], 'write density=True, or {"x": (lowest, highest)}'] = False,
    bins: Annotated[int, at_least(1)] = 400,
    **options: Unpack[Settling],
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
        First state, as in :func:`nonsmooth.simulate`; zeros where not given. Several starts show attractors that
        coexist.
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
    device : {"cpu", "cuda"}
        ``"cuda"`` runs the points on an NVIDIA GPU, one per thread, with ``direction=None`` and without
        ``density``: by the exact flow or by ``method="taylor"``. See the guide "A chart on a GPU".

    Returns
    -------
    xarray.Dataset
        Over the parameter (and ``direction``, ``start``): ``section(..., iterate, state)``, true extremes ``maximum``,
        ``minimum``, ``period_number`` (0: none found), ``residual``, ``crossings_per_period``,
        ``contacts_per_period``, ``clearance``, extremes of the outputs (of one that is not affine in the states
        NaN by the exact flow: give ``method="taylor"``; of elements that may share one load NaN: give ``loads=True``),
        ``status``. Where some point stands:
        ``equilibrium``, its name (empty where it moves), and the extent of the set of equilibria that it belongs to,
        ``equilibrium_minimum`` and ``equilibrium_maximum``. With ``density``, in place of
        ``section``: ``density(..., state, bin)`` (section points in each bin), ``outside(..., state)`` (those beyond
        the range) and ``bin_edge(state, edge)``. With ``loads``, of each element ``<element>_force_maximum``,
        ``_force_minimum`` and ``_energy``, of rigid stops ``_impact_speed_maximum``, ``_impacts`` and ``_impulse`` too,
        and of :func:`nonsmooth.mechanical` ``work_of_forcing``, ``work_of_damping`` and ``work_of_base``.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit, and starts at an equilibrium of a system without forcing. A point that fails keeps
        its status; the others are whole.
    Interrupted
        Ctrl-C; the sweep with the points run until then is its ``result``.
    ImportError, RuntimeError
        ``device="cuda"`` without the package numba-cuda, or without a GPU.

    Notes
    -----
    With ``density`` memory does not depend on ``keep``: points are counted as soon as they have been judged.
    A period number p is granted only where the p-th return is below 1e-9 of the motion's size and contracts:
    see :mod:`nonsmooth.kernels.judging.judge`.

    Loads are per return of the section (per forcing period), averaged over the returns of a cycle, from the last
    section point on; over ``keep`` returns, at most 200, where the motion has no period. Forces are without impulses. A
    contact at rest that takes an impulse from another one's impact has no impact of its own: its speed is 0, and it is
    not counted.
    The energy of an element is what it takes from the masses,

    .. math:: E = -\int \lambda\, w \cdot v\, dt - \sum \Lambda\, w \cdot (v^+ + v^-) / 2

    with the speed w.v of the masses along it (negative where a belt or a moving stop gives energy). Work of forcing and
    base is done on the masses, that of damping by them, so on a cycle ``work_of_forcing + work_of_base`` is
    ``work_of_damping`` and the energies of all elements (and ``work_of_stiffness`` where K is not symmetric). Forcing
    and damping of a system of another kind cannot be told apart, and their work is left out.
    """
    asked = as_called(locals())
    numbers = swept_values(system, parameter, values)
    carried = direction is not None
    settler = settler_for(system, "sweep", options, carried=carried, stop_early=False, device="cpu")
    gpu = options["device"] == "cuda"
    if judge and not extremes:
        raise ValueError("a period number rests on the size of the motion: give judge=False with extremes=False")
    if not judge and (gpu or density is not False):
        raise ValueError('judge=False records section points on the processor: leave out density and device="cuda"')
    if gpu and density is not False:
        raise ValueError('section points are counted on the processor: leave out density, or device="cuda"')
    threads, begun = workers_of(options), first_states(system, start)
    settler = replace(
        settler, plan=settler.plan._replace(extremes=extremes), max_period=settler.max_period if judge else 0
    )
    points = system.parameter_points({parameter: numbers})
    if settler.plan.indicator >= 0:
        refuse_resting(system, begun, points, "sweep")
    ranges = {} if density is False else given_ranges(system, density)
    work = _Sweep(
        settler,
        parameter,
        numbers,
        points,
        DIRECTIONS[direction],
        begun,
        0 if density is False else bins,
        checked_loads(system, loads, "sweep"),
    )
    if density is not False:
        coarse = None
        if len(ranges) < len(system.states):
            few = min(settler.keep, 1000)
            shorter: Settling = {"keep": few, "max_period": min(settler.max_period, few - 1), "progress": False}
            coarse = (
                sweep(system, parameter, coarse_values(numbers), direction=direction, start=start, **options | shorter)[
                    "section"
                ]
                .transpose(..., "state")
                .values
            )
        work.edges = bin_edges(system, ranges, bins, coarse)
    squeeze = (() if direction == "both" else ("direction",)) + (("start",) if is_one_start(start) else ())
    if gpu:
        run_on_gpu(points, begun, work.slots, options["progress"], parameter)
    else:
        try:
            work.run(threads, options["progress"])
        except KeyboardInterrupt as error:
            raise work.ended(error, asked, squeeze) from None
    largest = work.largest(extremes)
    warn_if_coarse(system, settler.engine, largest)
    warn_if_small(system, largest)
    return work.dataset(asked, squeeze)


@dataclass
class _Sweep:
    """A sweep that has been checked: its points, how they settle, and what is kept of them."""

    settler: Settler
    parameter: str
    numbers: FloatArray
    points: FloatArray
    directions: tuple[str, ...]
    begun: Sequence[State]
    bins: int  # 0: section points are kept
    measured: Quantities
    edges: FloatArray | None = None  # of bins in which they are counted

    @cached_property
    def starts(self) -> FloatArray:
        """The states (S, n) at the starts."""
        return np.array([state.u for state in self.begun])

    @cached_property
    def slots(self) -> dict[tuple[int, int], Slot]:
        """Points, verdicts and loads of each direction and start."""
        both, n = [*product(range(len(self.directions)), range(len(self.starts)))], self.starts.shape[1]
        width = n * (self.bins + 1) / 2 if self.bins else self.settler.keep * (n + 2)
        room_for(
            16.0 * width * len(self.points) * len(both),
            f"a sweep over {len(self.points)} values",
            "take fewer values, starts or bins, keep fewer returns, or count them with density=True",
        )
        return {key: Slot(self.settler, self.points, self.edges, self.measured) for key in both}

    def run(self, threads: int | None, progress: Progress) -> None:
        """All points on threads (the kernels release the lock); Ctrl-C stops them after their present point."""
        self.settler.load()  # before threads ask for it
        tables, stop = self.settler.engine.prepare(self.points), threading.Event()
        pieces = pieces_of(self.directions, len(self.starts), self.numbers)

        def march(piece: tuple[tuple[int, int], list[int]]) -> None:
            (d, k), order = piece
            self.slots[d, k].march(tables, order, self.begun[k], self.directions[d] != "none", advance, stop)

        total = len(self.slots) * len(self.points)
        with progress_bar(total, f"sweep over {self.parameter}", progress) as advance:
            over_items(pieces, march, lambda *_: None, min(threads or cores(), len(pieces)), stop)

    def ended(self, error: KeyboardInterrupt, asked: Mapping[str, Any], squeeze: tuple[str, ...]) -> KeyboardInterrupt:
        """The exception of a sweep that Ctrl-C ended, with the points that were run, where there are any."""
        done = self.gather("status") != codes.INTERRUPTED
        if not done.any():
            return error
        part = self.dataset(asked, squeeze)
        return Interrupted.with_points(error, int(done.sum()), done.size, f"sweep over {self.parameter}", part)

    def largest(self, extremes: bool) -> FloatArray:
        """The largest size of each state, of the starts and of all runs that came to their end; without their extremes
        that of their section points."""
        n, sizes = self.starts.shape[1], [np.abs(self.starts)]
        for slot in self.slots.values():
            kept, there = slot.kept, usable(slot.status)
            ends = (kept.high[:, :n], kept.low[:, :n]) if extremes else (np.abs(kept.section).max(axis=1),)
            sizes += [np.abs(end[there]) for end in ends]
        return np.nan_to_num(np.vstack(sizes), posinf=0.0).max(axis=0)

    def gather(self, name: str) -> np.ndarray:
        """An array of all slots, over direction and start."""
        read = attrgetter(name)
        every = range(len(self.starts))
        return np.stack([np.stack([read(self.slots[d, k]) for k in every]) for d in range(len(self.directions))])

    def dataset(self, asked: Mapping[str, Any], squeeze: tuple[str, ...]) -> xr.Dataset:
        """The result."""
        from nonsmooth.results.labels import labels_of
        from nonsmooth.results.provenance import provenance
        from nonsmooth.results.schema import sweep as build

        gather, settler, system = self.gather, self.settler, self.settler.system
        failed = ~usable(gather("status"))

        def whole(values: np.ndarray) -> np.ndarray:
            """NaN where the point failed: the kernel's buffers hold what it had by then."""
            return np.where(failed.reshape(failed.shape + (1,) * (values.ndim - 3)), np.nan, values)

        arrays: dict[str, Any] = {
            "crossings_per_period": whole(gather("crossings")),
            "contacts_per_period": whole(gather("contacts")),
            "status": gather("status"),
        }
        if self.edges is None:
            arrays["section"], modes = whole(gather("kept.section")), gather("kept.section_mode")
            settler.engine.hide(arrays["section"], modes)
        else:
            arrays["density"] = gather("counts")
            arrays["outside"] = gather("outside")
        if asked["judge"]:
            arrays["period_number"] = gather("period_number")
            arrays["residual"] = gather("residual")
        if asked["extremes"]:
            traced, n = system.traced, len(system.states)
            ends = [n, n + len(traced.indicators)]
            tops, bottoms = (whole(gather(f"kept.{end}")) for end in ("high", "low"))
            seen = ~np.isinf(tops)  # by the kernel: else a state that no mode visited has, or an output
            high, low = (np.split(np.where(seen, one, np.nan), ends, axis=-1) for one in (tops, bottoms))
            arrays["maximum"], arrays["minimum"] = high[0], low[0]
            arrays["clearance"] = np.where(armed_signs(traced, self.points[0]) > 0, -high[1], low[1])
            if system.outputs:
                unknown = out_of_bounds(traced, self.points, high[2], low[2])
                arrays["output_maximum"], arrays["output_minimum"] = (
                    np.where(unknown, np.nan, one[2]) for one in (high, low)
                )
        if asked["judge"] and self.edges is None:
            first = gather("kept.section")[..., 0, :], modes[..., 0], gather("last")
            arrays |= standing_in_sweep(settler, self.points, arrays, *first)
        loaded = gather("loads")  # by name
        loads = {
            name: (np.array([[one[name] for one in row] for row in loaded]), *words)
            for name, words in self.measured.items()
        }
        labels = labels_of(system)
        record = provenance(labels, "sweep", asked, method=settler.engine.name)
        return build(
            labels,
            record,
            self.parameter,
            self.numbers,
            arrays,
            directions=self.directions,
            starts=self.starts,
            squeeze=squeeze,
            edges=self.edges,
            loads=loads,
        )


def armed_signs(traced: Traced, values: np.ndarray) -> np.ndarray:
    """+1 or -1 for each indicator: the sign with which it first stands in a transition (+1 where in none); of modes
    that are made when they are visited in any way out of a contact state, whatever was visited."""
    signs = np.ones(len(traced.indicators), dtype=np.int64)
    rows = [row for jump in traced.transitions for row in jump.rows]
    for row in reversed(rows if traced.patterns is None else traced.patterns.armed(values)):
        signs[row.indicator] = row.sign
    return signs
