"""``simulate``: one trajectory, with every crossing and touch, and both limits of each crossing between the samples."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from nonsmooth.flow.engines.engine import FloatArray, State, TrajectoryLog
from nonsmooth.flow.engines.methods import engine_for, warn_if_coarse
from nonsmooth.flow.equilibria import ROUNDING, equilibrium_at
from nonsmooth.flow.failure import reason_of, refuse_beyond_stops, solve_error, warn_if_slow
from nonsmooth.flow.inputs import driven, under
from nonsmooth.flow.loads import meter_of
from nonsmooth.flow.options import LONGEST_RUN, Length, Solver, as_called, solver_of
from nonsmooth.flow.starts import first_state, is_one_start
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.memory import room_for
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import above, at_least, float_array, real_number, whole_number

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System


SAMPLES_PER_PERIOD = 256
SAMPLES = 4096
MOST_STEPS = 1e9  # an hour and more


@checked
def simulate(
    system: System,
    *,
    periods: Length | None = None,
    duration: Length | None = None,
    start: Any = None,
    mode: str | None = None,
    transient: Annotated[float, at_least(0, LONGEST_RUN)] = 0,
    samples: Any = None,
    step: Annotated[float, above(0)] | None = None,
    ramps: Mapping[str, Any] | None = None,
    inputs: Any = None,
    **options: Unpack[Solver],
) -> xr.Dataset:
    """March one trajectory and return it as segments between crossings.

    Parameters
    ----------
    system : System
    periods, duration : float
        Length of the run in forcing periods, or in time: one of the two.
    start : mapping, sequence of n floats, or a result of ``simulate``, optional
        State at t = 0; zeros where not given. A mapping may name the memory too, and a ``"mode"``. A result gives its
        last state, mode and memory; the forcing begins anew, so let it end after whole periods.
    mode : str, optional
        Mode at the start; that of ``start``, else the first, where not given. Transitions that already hold are
        taken first.
    transient : float
        Run this long before recording, in the unit of the length. Time goes on: the record begins at t = transient.
    samples : int or array, optional
        Number of equidistant instants, or the instants themselves. Default: 256 per period, or 4096 in all.
    step : float, optional
        Fixed step of ``"taylor"`` and ``"rkf45"``.
    ramps : mapping of parameter to (first, last) or callable, optional
        Parameters as functions of time in this run: linear over the recorded time, or ``f(t)``.
    inputs : mapping of input to (time, values) or Input, or a table with a column ``time``, optional
        The courses of the system's inputs, see :class:`nonsmooth.Input`. They begin at their own times, whatever the
        transient.

    Returns
    -------
    xarray.Dataset
        ``u(time, state)``, ``mode``, ``segment`` (each crossing stands twice in ``time``: the limits before and
        after), ``crossing_time``, ``crossing_transition``, ``u_before``, ``u_after``, the touches (``touch_time``,
        ``touch_indicator``, ``touch_u``, ``touch_clearance``: maxima of an armed indicator that do not reach zero),
        the outputs, and ``status``. For each rigid stop among the elements, over ``crossing``: ``<element>_impulse``,
        ``<element>_impact_speed`` (of approach; 0 where it rests and takes an impulse of another one's impact; else
        NaN) and ``<element>_energy_lost``, the energy that the impact dissipates. The output ``<element>_force`` is the
        force between impacts, without impulses. A run that stays at an equilibrium from its start says so in the
        attribute ``note``, and in a warning where the equilibrium is unstable.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit.
    SolveError
        The run could not be completed; it says where and why.
    """
    asked = as_called(locals())
    period = system.period()
    unit, length = run_length(system, periods, duration, period)
    if not is_one_start(start):
        raise ValueError("simulate marches one trajectory: give one start; sweep and poincare take several")
    t_begin, t_end = transient * unit, transient * unit + length
    if step is not None and t_end / step > MOST_STEPS:
        raise ValueError(f"step = {step!r}: a run to t = {t_end:.6g} would take more than {MOST_STEPS:g} steps")
    traced = system.traced
    if ramps:
        from nonsmooth.flow.ramps import values_along, with_ramps

        system.refuse_patterns("ramps")
        if options["method"] == "exact":
            raise ValueError('method="exact" needs constant parameters; with ramps use "taylor" or "rkf45"')
        traced = with_ramps(system, ramps, t_begin, t_end)
    width = 2 * len(traced.u) + len(traced.outputs) + 3  # of the log and of the result
    instants = _instants(samples, t_begin, t_end, None if ramps and period is None else period, width)
    state, drive = first_state(system, start, mode), driven(system, inputs)
    course = None if drive is None else drive.at(system.values)
    changes = under(course, state, 0.0, t_begin or t_end)
    if not ramps:
        refuse_beyond_stops(system, state.u[None, :])
    engine = engine_for(system, **solver_of(options), step=step, traced=traced if ramps else None)
    begun = np.abs(state.u)
    tables = engine.prepare(system.parameter_vector()[None, :])
    if t_begin > 0:
        check_complete(engine.record(tables, state, t_begin, np.empty(0), changes=changes), system, state, period)
        changes = under(course, state, t_begin, t_end)
    log = engine.record(tables, state, t_end, instants, changes=changes)
    check_complete(log, system, state, period)
    largest = np.nanmax(np.abs(np.vstack([begun, log.sample_u, log.u_before, log.u_after])), axis=0)
    warn_if_coarse(system, engine, largest)
    warn_if_slow(system, largest)
    asked["ramps"] = None if not ramps else {k: v if not callable(v) else str(v) for k, v in ramps.items()}
    asked["inputs"] = None if drive is None else drive.data()
    traced = engine.traced if ramps else system.traced  # with what the run has visited and found
    found = _dataset(system, traced, engine.name, asked, log, instants, period)
    meter = meter_of(system)
    if meter is not None and meter.striking:
        from nonsmooth.results.schema import with_impacts

        values: FloatArray = system.parameter_vector()
        if ramps:
            values = values_along(system, ramps, t_begin, t_end, log.crossing_time)
        crossings = log.crossing_time, log.u_before, log.u_after, log.memory_after
        found = with_impacts(found, meter.at_crossings, meter.impacts(values, *crossings, largest)[:3])
    note = "" if ramps or drive is not None else _resting(system, begun, log, state)
    return found.assign_attrs(note=note) if note else found


def _resting(system: System, begun: FloatArray, log: TrajectoryLog, state: State) -> str:
    """The equilibrium at which a run begins and stays, in a sentence; a warning too where it is unstable."""
    still = ROUNDING * (system.scale_vector() + begun)
    few = log.sample_u[:: max(1, len(log.sample_u) // 64)]  # most runs are seen to move by these
    for u in (begun * np.sign(state.u), few, log.sample_u, log.u_before, log.u_after):
        if (np.abs(u - state.u) > still).any():
            return ""
    at = equilibrium_at(system, state.u, int(state.counters[0]), memory=state.memory)
    if at is None:
        return ""
    text = f"{at.words(list(system.states))}: the run begins and stays there"
    if at.kind == "unstable":
        warnings.warn(
            f"simulate of {system.name!r}: {text}, though any other motion nearby leaves it; give start=, a state "
            "beside it",
            stacklevel=4,
        )
    return text


def run_length(
    system: System, periods: float | None, duration: float | None, period: float | None
) -> tuple[float, float]:
    """The unit of the length (the period, or 1) and the length in time."""
    if (periods is None) == (duration is None):
        raise ValueError("give the length of the run once: periods=... or duration=...")
    if periods is not None and period is None:
        raise ValueError(f"{system.name!r} has no forcing period: give duration=... in place of periods")
    unit = 1.0 if periods is None or period is None else period
    return unit, (periods or duration or 0.0) * unit


def _instants(samples: Any, t_begin: float, t_end: float, period: float | None, width: int) -> FloatArray:
    """The instants that are recorded, each with ``width`` numbers."""
    if samples is None:
        steps = SAMPLES if period is None else (t_end - t_begin) / period * SAMPLES_PER_PERIOD
        samples = max(np.ceil(steps - 1e-6), 1) + 1  # behind a transient whole periods are whole up to rounding
    if np.ndim(samples) == 0:
        n = real_number(samples, "samples")
        room_for(8.0 * n * width, f"a run with {n:.6g} samples", "give samples=, a number of instants or the instants")
        return np.linspace(t_begin, t_end, whole_number(samples, "samples", 2))
    instants = float_array(samples, "samples")
    if instants.ndim != 1 or not np.isfinite(instants).all() or (np.diff(instants) <= 0).any():
        raise ValueError("samples must be a number, or increasing finite instants")
    rounding = 1e-12 * max(abs(t_begin), abs(t_end))
    if len(instants) and (instants[0] < t_begin - rounding or instants[-1] > t_end + rounding):
        raise ValueError(
            f"samples from {instants[0]:.6g} to {instants[-1]:.6g} lie outside the recorded time "
            f"{t_begin:.6g} ... {t_end:.6g}; they are instants, in time and not in periods"
        )
    return np.clip(instants, t_begin, t_end)


def check_complete(log: TrajectoryLog, system: System, state: State, period: float | None) -> None:
    """Raise for a run that stopped early, with the place where it did."""
    if log.status in (codes.OK, codes.NOT_GUARANTEED):
        return
    time = state.clock[0] + (state.clock[1] * period if period is not None else 0.0)
    where = dict(zip(system.states, map(float, state.u), strict=True))
    raise solve_error(
        log.status,
        reason_of(system, log),
        begun=(system, state.u),
        time=float(time),
        state=where,
        mode=system.modes[int(state.counters[0])],
    )


def _dataset(
    system: System,
    traced: Any,
    method: str,
    options: Mapping[str, Any],
    log: TrajectoryLog,
    instants: FloatArray,
    period: float | None,
) -> xr.Dataset:
    from nonsmooth.flow.outputs import output_values
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance
    from nonsmooth.results.schema import trajectory

    labels = labels_of(system)
    ends = np.array([(jump.source, jump.target) for jump in traced.transitions], dtype=np.int64).reshape(-1, 2)
    merged = with_crossings(instants, log, *ends[log.crossing_transition].T)
    memory = None
    if traced.memory_names:  # constant within a segment
        first = system.memory_vector()[None, :] if not len(log.sample_memory) else log.sample_memory[:1]
        memory = np.concatenate([first, log.memory_after])[merged.segment]
    outputs = None
    if traced.output_names:
        kept = np.zeros((len(merged.time), 0)) if memory is None else memory
        outputs = output_values(traced, system.parameter_vector(), merged.time, merged.u, kept, merged.mode)
    own = {name: one for name, one in vars(log).items() if not name.startswith(("sample_", "memory_"))}
    record = provenance(labels, "simulate", options, method=method)
    return trajectory(labels, record, **merged._asdict(), **own, outputs=outputs, memory=memory)


class Segmented(NamedTuple):
    """Samples and both limits of each crossing, by time."""

    time: NDArray[np.float64]
    u: NDArray[np.float64]
    mode: NDArray[np.int64]
    segment: NDArray[np.int64]


def with_crossings(
    instants: FloatArray, log: TrajectoryLog, mode_before: NDArray[np.int64], mode_after: NDArray[np.int64]
) -> Segmented:
    """Samples and crossings in one list in which every crossing stands twice.

    The limit before crossing k ends segment k, the limit after it begins segment k + 1; samples lie within
    their segment in the order given. A sample exactly at a crossing is kept beside the limits.
    """
    n, count = len(instants), len(log.crossing_time)
    index = np.arange(count)
    segment = np.concatenate([log.sample_segment, index, index + 1])
    # Within a segment: the limit after the crossing that opened it, the samples, the limit before the next.
    place = np.concatenate([np.ones(n), np.full(count, 2.0), np.zeros(count)])
    inner = np.concatenate([np.arange(n), np.zeros(2 * count)])
    order = np.lexsort((inner, place, segment))
    return Segmented(
        np.concatenate([instants, log.crossing_time, log.crossing_time])[order],
        np.concatenate([log.sample_u, log.u_before, log.u_after])[order],
        np.concatenate([log.sample_mode, mode_before, mode_after])[order],
        segment[order],
    )
