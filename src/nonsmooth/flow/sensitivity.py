"""``sensitivity``: how a whole run, through all its transitions, answers to its start and to parameters."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray, IntArray
from nonsmooth.flow.engines.engine import State, TrajectoryLog
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.failure import warn_if_slow
from nonsmooth.flow.inputs import DelayedInputs, driven
from nonsmooth.flow.options import Length, as_called
from nonsmooth.flow.saltation import Jump, OneOrderOnly
from nonsmooth.flow.sampled import SampledRun, held, sampled
from nonsmooth.flow.simulate import check_complete, run_length
from nonsmooth.flow.starts import first_state
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.system.arguments import checked

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System

CHANGE = -1  # of inputs, among transitions
RTOL = 1e-15  # where the flow is not exact


class Variation:
    """One run taken apart: its segments, which end at samples too, the jumps between them, and their products.

    Segments behind samples begin with the states there; behind the last sample there is none.

    Attributes
    ----------
    times : list of float
        Of the start, and of each jump.
    segments : Segments
    jumps : list of Jump or None
        Transitions at one instant are one. None: nothing but inputs change.
    transitions : list of tuple of int
        Of each jump; ``CHANGE`` before them, or alone, where inputs change.
    start : Jump or None
        The transitions taken at the start because they held already: nothing moves in time there.
    D : array (N, n, n + n_active), rate, of_time : array (N, n)
        At the samples: derivatives in the start and in the parameters, at fixed times; dz/dt; derivatives in the time
        of the whole run.
    """

    def __init__(self, flow: VariationalFlow, values: FloatArray, run: SampledRun) -> None:
        n, size, course = flow.n, flow.n + flow.n_active, run.course
        flow.catch_up()
        self.start = settled(flow, values, run.start, run.begun, run.begin)
        modes, starts, times, transitions, before = apart(flow, run.log, run.begun, run.begin, run.changes)
        # A sample at a crossing is the limit after it; segments behind the last sample's are left out.
        behind = np.searchsorted(times[1:], run.time, "right") + run.moved
        count = int(behind.max()) + 1
        self.times, self.transitions = times[:count], transitions[: count - 1]
        segment = np.concatenate([np.arange(count), behind])
        order = np.argsort(segment, kind="stable")
        is_sample, back = (order >= count)[1:], np.argsort(order[order >= count])
        t = np.concatenate([self.times, run.time])[order]
        begins, of_mode = np.vstack([*starts[:count], run.z])[order], np.array(modes)[segment[order]]
        legs = self.segments = flow.segments(values, of_mode[:-1], t[:-1], np.diff(t), begins[:-1])
        steps = np.zeros((len(is_sample), size, size))
        steps[:, :n, :n], steps[:, :n, n:] = legs.Phi, legs.P
        steps[:, range(n, size), range(n, size)] = 1.0
        ending = np.flatnonzero(~is_sample)
        states, rates = (legs.z[ending], begins[ending + 1]), (legs.f_end[ending], legs.f_begin[ending + 1])
        at = self.transitions, t[ending + 1], of_mode[ending]
        between, self.jumps = steps_between(flow, values, *at, states, before, rates, course)
        steps[ending + 1] @= between
        total = np.eye(size)
        if course is not None:
            total[:n, n:] = course.by_delays(flow, legs.f_begin[0])
        products = np.empty_like(steps)
        for step, product in zip(steps, products, strict=True):
            total = step.dot(total, out=product)  # of small matrices three times as quick as @
        self.D, self.rate = products[is_sample, :n][back], legs.f_end[is_sample][back]
        rate = legs.f_begin[0].copy()
        if course is not None:  # inputs have their course, whenever the run begins
            rate[course.first :] = 0.0
        self.of_time = self.rate - self.D[:, :, :n] @ rate
        if self.start is not None:  # transitions that are taken at once, whenever the run begins
            self.of_time += self.D[:, :, :n] @ self.start.R_t
            self.D = self.D @ self.start.R

    @property
    def log_determinant(self) -> float:
        """log\\|det Phi\\| from the determinants of the segments' matrices and of the saltation matrices."""
        return float(np.linalg.slogdet(self.segments.Phi)[1].sum()) + self._of_jumps()

    @property
    def trace(self) -> float:
        """The value it must have: the integral of div f, and log\\|det S\\| of every transition."""
        return float(self.segments.divergence.sum()) + self._of_jumps()

    def _of_jumps(self) -> float:
        at_start = 0.0 if self.start is None else float(np.linalg.slogdet(self.start.R_z)[1])
        return at_start + sum(-np.inf if jump is None else jump.log_determinant for jump in self.jumps)


def apart(
    flow: VariationalFlow,
    log: TrajectoryLog,
    first: tuple[int, FloatArray],
    t_begin: float,
    changes: tuple[FloatArray, IntArray],
) -> tuple[list[int], list[FloatArray], list[float], list[tuple[int, ...]], list[FloatArray]]:
    """Segments of a run that begins in ``first`` = (mode, z): their modes, starts and times; the transitions between
    them, those at one instant as one, and the state before each.

    ``changes`` of inputs (their times, and which samples are there) stand between segments too, as ``CHANGE``."""
    flow.catch_up()
    n_u, targets = flow.n_u, [jump.target for jump in flow.traced.transitions]
    modes, starts, times = [first[0]], [first[1]], [t_begin]
    transitions: list[tuple[int, ...]] = []
    before: list[FloatArray] = []
    memory = first[1][n_u:]
    instants, places = changes
    u_before, u_after = held(log.u_before), held(log.u_after)
    taken, crossings = 0, len(log.crossing_time)

    def change(upto: float, crossing: int) -> None:
        """Take the changes up to a time; one at the very time of a crossing comes before it."""
        nonlocal taken
        here = slice(taken, int(np.searchsorted(instants, upto, "right")))
        taken = here.stop
        count = here.stop - here.start
        if count == 0:
            return
        u = held(log.sample_u[places[here]])
        if crossing < crossings and log.crossing_time[crossing] == instants[taken - 1]:
            u[-1] = u_before[crossing]
        states = [*np.hstack([u, np.tile(memory, (count, 1))])]
        transitions.extend([(CHANGE,)] * count)
        before.extend(states)
        modes.extend([modes[-1]] * count)
        starts.extend(states)
        times.extend(instants[here].tolist())

    for i, t in enumerate(log.crossing_time):
        change(t, i)
        k = int(log.crossing_transition[i])
        after = np.concatenate([u_after[i], log.memory_after[i]])
        if transitions and t == times[-1]:  # a chain at one instant
            transitions[-1] += (k,)
            modes[-1], starts[-1] = targets[k], after
        else:
            transitions.append((k,))
            before.append(np.concatenate([u_before[i], memory]))
            modes.append(targets[k])
            starts.append(after)
            times.append(float(t))
        memory = log.memory_after[i]
    change(np.inf, crossings)
    return modes, starts, times, transitions, before


def steps_between(
    flow: VariationalFlow,
    values: FloatArray,
    transitions: Sequence[tuple[int, ...]],
    times: FloatArray,
    modes: IntArray,
    states: tuple[FloatArray, FloatArray],
    before: Sequence[FloatArray],
    rates: tuple[FloatArray, FloatArray],
    course: DelayedInputs | None,
) -> tuple[FloatArray, list[Jump | None]]:
    """Derivatives (J, N, N) from the end of each segment that :func:`apart` names to the beginning of the next, and the
    jumps there, None where nothing but inputs change; of the times, the modes that end, states and rates at the ends,
    and at the beginnings."""
    S = np.empty((len(transitions), flow.n + flow.n_active, flow.n + flow.n_active))
    jumps: list[Jump | None] = [None] * len(transitions)
    change = np.array([chain[0] == CHANGE for chain in transitions], dtype=bool)
    if course is not None and change.any():
        ends = states[0][change], states[1][change]
        lasting = course.lasting(flow, values, modes[change], times[change], ends, rates[0][change])
        S[change] = course.steps(flow, times[change], lasting, rates[1][change])
    for i, chain in enumerate(transitions):
        if chain[0] != CHANGE:
            found = flow.jump(values, chain, times[i], before[i])
        elif chain[1:]:
            assert course is not None
            then, here = flow.jump(values, chain[1:], times[i], before[i], at_change=True), slice(i, i + 1)
            longer = lasting[np.count_nonzero(change[:i])]
            if course.moved(flow, times[here])[1].any():
                warnings.warn(
                    "two inputs with delays of their own change at one instant, and a transition follows: its "
                    "derivatives are those of a transition that waits for both. Let one change a little later for "
                    "another.",
                    RuntimeWarning,
                    stacklevel=2,
                )
            both = course.steps(flow, times[here], longer[None], rates[1][here], then)[0]
            found = replace(then, S=both, row=-1)  # at the time of the change
        else:
            continue
        S[i], jumps[i] = found.S, found
    return S, jumps


def settled(
    flow: VariationalFlow, values: FloatArray, start: tuple[int, FloatArray], first: tuple[int, FloatArray], t: float
) -> Jump | None:
    """The transitions that lead at once from the start's (mode, z) to that in which the run begins.

    What elements decide together at a start needs none, but for an impact."""
    if start[0] == first[0]:
        return None
    if flow.traced.asks:
        if not (np.abs(start[1] - first[1]) <= 1e-10 * (flow.scale + np.abs(first[1]))).all():
            raise ValueError("the run begins with an impact of several contacts: give a start just before or behind it")
        return None
    chains: list[tuple[int, ...]] = [()]
    while chains:
        chain = chains.pop(0)
        mode = flow.traced.transitions[chain[-1]].target if chain else start[0]
        visited = {start[0], *(flow.traced.transitions[k].target for k in chain)}
        for k, jump in enumerate(flow.traced.transitions):
            again = jump.target in visited and (jump.target != mode or jump.reset is None)  # an impact may lead back
            if jump.source != mode or again or k in chain or jump.at is not None:
                continue
            if jump.target == first[0]:
                found = flow.jump(values, (*chain, k), t, start[1], at_change=True)
                # a start within a forcing period is known to the rounding of its time
                if (np.abs(found.z_after - first[1]) <= 1e-10 * (flow.scale + np.abs(first[1]))).all():
                    return found
            chains.append((*chain, k))
    raise AssertionError("a run begins in a mode that no transitions lead to")


def variation(
    system: System, flow: VariationalFlow, state: State, t_end: float, course: DelayedInputs | None = None
) -> tuple[Variation, TrajectoryLog]:
    """Run from ``state`` (t = 0) to ``t_end`` and take the run apart.

    Raises
    ------
    SolveError
        The run could not be completed.
    """
    engine, values = engine_for(system, rtol=RTOL), system.parameter_vector()
    run = sampled(engine, engine.prepare(values[None, :]), state, 0.0, np.array([t_end]), course)
    check_complete(run.log, system, state, system.period())
    return Variation(flow, values, run), run.log


def order_matters(system: System, engine: Engine, values: FloatArray, state: State, duration: float) -> bool:
    """Return whether transitions at one instant of the motion from ``state`` on have an order that matters to small
    changes (:func:`nonsmooth.flow.saltation.of_one_instant`)."""
    state, flow = state.copy(), VariationalFlow.of(system)
    state.clock[1], t = 0.0, float(state.clock[0])
    first = int(state.counters[0]), np.concatenate([held(state.u), state.memory])
    log = engine.record(engine.prepare(values[None, :]), state, t + duration, np.zeros(0))
    _, _, times, chains, before = apart(flow, log, first, t, (np.zeros(0), np.zeros(0, dtype=np.int64)))
    with warnings.catch_warnings():
        warnings.simplefilter("error", OneOrderOnly)
        try:
            for chain, instant, z in zip(chains, times[1:], before, strict=True):
                flow.jump(values, chain, instant, z)
        except OneOrderOnly:
            return True
    return False


@checked
def sensitivity(
    system: System,
    *,
    periods: Length | None = None,
    duration: Length | None = None,
    start: Any = None,
    mode: str | None = None,
    parameters: Sequence[str] = (),
    inputs: Any = None,
) -> xr.Dataset:
    r"""Derivatives of a run's end in its start and in parameters, through every transition.

    .. math:: \Phi = \frac{\partial z(t)}{\partial z(0)}, \qquad P = \frac{\partial z(t)}{\partial p},
        \qquad z = (u, \text{memory})

    Parameters
    ----------
    system : System
    periods, duration : float
        Length of the run, one of the two. After ``periods`` the end is taken at fixed phase, so that P has the part
        that comes from dT/dp; after a ``duration``, at fixed time.
    start, mode : state, str, optional
        As in :func:`nonsmooth.simulate`.
    parameters : sequence of str
        Parameters in which to differentiate; the delay of an input is one.
    inputs : mapping, optional
        As in :func:`nonsmooth.simulate`.

    Returns
    -------
    xarray.Dataset
        ``Phi(state, initial_state)``, ``P(state, parameter)``, ``end(state)``; over ``crossing``: ``crossing_time``,
        ``crossing_transition``, ``saltation``, ``log_det_saltation`` and ``transversality``
        \|h'\| / (\|h_z\| \|f\|); ``log_det`` = log\|det Phi\|, ``divergence`` (integral of div f over the run) and
        ``trace_defect``, the difference that must be rounding: log\|det Phi\| - (divergence + sum of log\|det S\|),
        0 where both are minus infinity (a matrix without full rank: sticking, memory that is written anew).
        The states are followed by the memory.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit.
    SolveError
        The run could not be completed.

    Notes
    -----
    Transitions taken at the same instant stand as one crossing, with the last one's number; where several happen by
    themselves and their order matters, derivatives are those of one order, and a warning says so. Where two inputs
    change at once, the derivative in the delay of one is that towards a greater delay. A parameter that has
    the name of a variable above (``P``, ``end``) is no coordinate of the result; `system_of` gives its value.
    """
    asked = as_called(locals())
    drive = driven(system, inputs)
    course = None if drive is None else drive.at(system.values)
    names = tuple(parameters)
    if twice := [name for name in names if names.count(name) > 1]:
        raise ValueError(f"parameters names {twice[0]!r} twice; name each once")
    flow = VariationalFlow.of(system, names)
    _, length = run_length(system, periods, duration, system.period())
    found, log = variation(system, flow, first_state(system, start, mode), length, course)
    warn_if_slow(system, found.segments.z[:, : len(system.states)], log.u_before, log.u_after)
    (derivatives,), n = found.D, flow.n
    parameter_part = derivatives[:, n:]
    if periods is not None and names:
        _, gradient = flow.period(system.parameter_vector())
        parameter_part = parameter_part + np.outer(found.segments.f_end[-1], periods * gradient)
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance
    from nonsmooth.results.variations import derivatives_of_run

    labels = labels_of(system)
    asked |= {"parameters": list(names), "inputs": None if drive is None else drive.data()}
    crossings = [
        (t, chain[-1], jump)
        for t, chain, jump in zip(found.times[1:], found.transitions, found.jumps, strict=True)
        if jump is not None
    ]
    return derivatives_of_run(
        labels,
        provenance(labels, "sensitivity", asked, method="variational"),
        names,
        Phi=derivatives[:, :n],
        P=parameter_part,
        end=found.segments.z[-1],
        crossing_time=[t for t, _, _ in crossings],
        crossing_transition=[k for _, k, _ in crossings],
        saltation=np.array([jump.saltation for _, _, jump in crossings]).reshape(-1, n, n),
        log_det_saltation=[jump.log_determinant for _, _, jump in crossings],
        transversality=[jump.transversality for _, _, jump in crossings],
        log_det=found.log_determinant,
        divergence=float(found.segments.divergence.sum()),
        trace=found.trace,
        status=log.status,
    )
