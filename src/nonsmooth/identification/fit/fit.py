"""``fit``: the parameters of any system from recordings and from readings of its steady states."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import Annotated, Any, Literal, Unpack

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.blas import one_blas_thread
from nonsmooth.errors import SolveError, check_keys
from nonsmooth.flow.starts import is_one_start, start_states
from nonsmooth.identification.fit.beginnings import beginnings, drawn
from nonsmooth.identification.fit.first_level import Stage, level, read_modes, without_disagreeing
from nonsmooth.identification.fit.first_windows import first_length, first_windows, states_from_samples
from nonsmooth.identification.fit.growth import Grown, finished, grow, seen, with_steady
from nonsmooth.identification.fit.likelihood import looked_beside, posterior_of
from nonsmooth.identification.fit.motion import Marcher
from nonsmooth.identification.fit.outcome import outcome
from nonsmooth.identification.fit.records import irregularity, read_records
from nonsmooth.identification.fit.sensors import read_unknowns
from nonsmooth.identification.fit.steady import ROUGHLY
from nonsmooth.identification.fit.windows import Windows
from nonsmooth.identification.options import Fitting
from nonsmooth.identification.parameter_set import ParameterSet
from nonsmooth.results.progress import Progress, progress
from nonsmooth.system.arguments import check_system, checked
from nonsmooth.system.kinds import above, at_least
from nonsmooth.system.system import System

_PHASES = 8  # first guesses of an unknown phase
_LONGER = 3.3  # the other length of first windows, in every second try
_LOSSES = {"linear": np.inf, "huber": 2.5}  # noise deviations from which on a residual counts linearly
_MORE = 3  # guesses that are looked at, for each that is fitted
_KNOWN, _ROUGH = 4.0, 0.25  # mean squared residual of a fit near the steady states: over known noise, and over a guess
_NONE = (
    "no fit from any of {tries} first guesses ({why}); start nearer, with system.with_parameters(...) and start=, or "
    "give bounds"
)


@checked
@one_blas_thread()
def fit(
    system: System,
    recording: Any,
    parameters: Mapping[str, Any] | Sequence[str] | str,
    *,
    start: Any = None,
    mode: Any = None,
    per_run: Sequence[str] = (),
    inputs: Any = None,
    window: Annotated[float, above(0)] | None = None,
    profile: Sequence[str] = (),
    loss: Literal["linear", "huber"] = "linear",
    leave_out: bool = False,
    posterior: Annotated[int, at_least(0)] = 0,
    **options: Unpack[Fitting],
) -> ParameterSet:
    r"""Parameters of a system from recorded motions, with their standard uncertainties.

    The weighted sum of squares

    .. math:: \sum_{k, c} \frac{[y_{kc} - g_c\, q_c(t_k - d_c;\, z_0, p) - o_c]^2}{\sigma_c^2}

    is minimized over the parameters p, the start z_0 of every window, and what is unknown of the sensors (gain g,
    offset o, delay d). The derivatives of the motion are exact, through every transition, as those of
    :func:`nonsmooth.sensitivity`. A reading that jumps at a transition (a speed at an impact, a state that is reset)
    tells its side: no farther than its step from there it is compared with the side that it fits. The windows grow from
    a part of a period to the whole record, as far as the motion can be followed; from a first guess that is near, the
    longest are taken at once.

    Parameters
    ----------
    system : System
        The model; the values of its parameters are the first guess.
    recording : Recording, Dataset, DataFrame, mapping or list of these
        A ``DataFrame`` with a column ``time`` (or time as its index), a ``Dataset`` over ``time``, ``{"x": (t, y)}``,
        ``{"time": t, "x": y}``, or several runs. Samples that are NaN are missing; channels may have clocks of their
        own. Times are those of the model: the forcing begins at t = 0, unless the phase is unknown. Among them, or
        alone, readings of steady states: the ``amplitude`` of a state (half its range) or the points of its
        ``section`` at phase 0 with their ``period_number``, and under its name each parameter that was set
        (``{"omega": w, "amplitude": a, "amplitude_error": s}``), as measured responses and sections, sweeps and
        :func:`nonsmooth.frequency_response` hold them. Each reading is compared with the nearest of the steady states
        that sweeps up and down reach at the parameters, and those of chaos are not used. Errors that are not given are
        found from the residuals.
    parameters : sequence of str, or mapping of str to (low, high)
        What is to be found: parameters of the system, ``"<quantity>.gain"``, ``".offset"`` and ``".delay"`` of sensors,
        ``"clock"`` (time of the model over that of the recording: 1.0001 where its clock is slow by that much, between
        0.9 and 1.1) and ``"phase"`` (of the forcing at t = 0, in periods, for each run). A mapping gives bounds (None:
        none).
    start : mapping or sequence of floats, optional
        First guess of the states that the first sample shows (by the longest delay of a sensor); measured states need
        none.
    mode : str or mapping of str to str, optional
        Mode in which the recording begins, or each run of it. Where not given, each one is tried in which a motion may
        begin there (a relay with hysteresis: both), and a note says which fits best and by how much.
    per_run : sequence of str
        Unknowns of which each run has its own, as ``"c, Run #1"`` in ``extra``; the others are shared by all runs.
    inputs : mapping of input to channel, Input or (time, values), optional
        The courses of the system's inputs: ``{"force": "motor force"}``, or
        ``{"force": ns.Input("motor force", between="steps", delay="late")}``, where ``late`` may be a parameter that is
        to be found. Channels named as inputs where not given.
    window : float, optional
        The longest window, in units of time, for motions that the model can be followed along only so far.
    profile : sequence of str
        Unknowns whose profile likelihood is computed, where the sum of squares may be no parabola within the
        uncertainty: a finding ``"<name>, profile"`` and a note give the 95 % limits.
    loss : {"linear", "huber"}
        ``"huber"``: residuals beyond 2.5 noise deviations count linearly, so that outliers hardly count. Outliers are
        named in the notes either way.
    leave_out : bool
        True: short windows that disagree with the rest (a knock at the table, a sensor that slipped) are left out, and
        the notes say when they were; the motion begins anew behind each.
    posterior : int
        Steps of an ensemble sampler (emcee, extra ``posterior``) that starts about the optimum: the finding
        ``"posterior"``, ``.posterior`` of the set, and what its ``draw`` then draws from. For a law that is no normal
        one; some thousand steps of a likelihood that costs a simulation of the record each.

    Returns
    -------
    ParameterSet
        The parameters; in ``extra`` the unknowns of sensors, phases, starts (``"x(0)"``) and ``"<quantity>.noise"``.
        Coloured noise is weighted by its correlation from reading to reading, estimated with the rest, and the
        covariance takes what is left of the residuals' own correlation into account; a parameter that the recording
        does not determine, or bounds on one side only, has an infinite uncertainty and says so in
        ``identifiability``. ``anomalies`` says where the model fails. ``.residuals`` is a Dataset of the readings, the
        fit and the residuals over ``sample``, drawn by ``ns.plot.identification.fit_residuals``; ``.steady`` the same
        for readings of steady states, drawn by ``ns.plot.identification.steady_readings``.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit.
    SolveError
        No first guess from which the windows of the record can be simulated or fitted.

    References
    ----------
    H.G. Bock, in Springer Ser. Chem. Phys. 18 (1981) 102-125; W.K. Newey, K.D. West, Econometrica 55 (1987) 703-708;
    J. Goodman, J. Weare, Comm. Appl. Math. Comp. Sci. 5 (2010) 65-80 (``posterior``).

    Examples
    --------
    >>> import numpy as np
    >>> import nonsmooth as ns
    >>> system = ns.models.discontinuous_support()
    >>> run = ns.simulate(system, periods=6, start={"x": 0.01}, samples=400)
    >>> found = ns.fit(system.with_parameters(k=9.0), run, ["k", "c"], measured=["x"])
    >>> round(found["k"], 6) == system.values["k"]
    True
    """
    problem = problem_of(system, recording, parameters, options, mode, loss, per_run, inputs)
    free, tries, seed, progress = options["free_start"], options["tries"], options["seed"], options["progress"]
    if start is not None and not is_one_start(start):
        raise ValueError("fit takes one first guess of the start, for all runs; settings= differ from run to run")
    if not free and start is None:
        raise ValueError("free_start=False says that the start is known: give start=, the states at the first sample")
    if leave_out and not problem.records:
        raise ValueError("leave_out=True leaves out parts of records over time; readings of steady states have none")
    if leave_out and not free:
        raise ValueError("leave_out=True begins anew behind what it leaves out: it needs free starts, free_start=True")
    if window is not None and problem.records and window < (least := 2 * problem.step.min()):
        raise ValueError(f"window = {window:g} holds no three readings: give at least {least:g}, twice their step")
    begin = None if start is None else np.tile(start_states(problem.system, start)[0], (len(problem.records), 1))
    check_keys(profile, problem.unknowns.names, "profile", "an unknown", "this fit")
    best, left = best_of(problem, begin, free, window or np.inf, tries, seed, progress), list[str]()
    if leave_out:
        problem, left = without_disagreeing(problem, best.theta)
        if len(problem.records) != len(best.problem.records) or problem.records[0] is not best.problem.records[0]:
            best = best_of(problem, None, True, window or np.inf, tries, seed, progress)
    asked = {"parameters": list(problem.unknowns.names), "window": window, "tries": tries, "seed": seed}
    given = recording if isinstance(recording, list | tuple) else [recording]
    return outcome(
        best,
        asked,
        synthetic=any(getattr(one, "synthetic", False) for one in given),
        profiles=profile,
        watched=progress,
        left=left,
        beside=[posterior_of(best, posterior, seed, progress)] if posterior else [],
    )


def problem_of(
    system: System,
    recording: Any,
    parameters: Any,
    options: Mapping[str, Any],
    mode: Any = None,
    loss: Any = "linear",
    per_run: Sequence[str] = (),
    inputs: Any = None,
) -> Windows:
    """The problem, without windows; the noise is the records' own irregularity. ``options``: those of `Fitting`."""
    check_system(system, "fit", inputs=True)
    system = system.written_out()  # any mode may be the first, and a force that is fitted needs its formula
    if system.is_map:
        raise ValueError(f"{system.name!r} is a map, whose time is a count: fit takes systems with vector fields")
    sensors, records, steady = read_records(system, recording, options, inputs)
    labels = [one.name for one in records] + [one.name for one in steady]
    known = [one.settings for one in records] + [one.settings for one in steady]
    unknowns = read_unknowns(system, sensors, parameters, options.get("priors"), labels, known, per_run, len(steady))
    if system.inputs and (unknowns.phases or unknowns.clock):
        raise ValueError("inputs have the time of the recording: with them neither 'phase' nor 'clock' can be found")
    within = [
        [y[sensor.limit(y) == 0] for record in records for y in [record.values[:, c]] if np.isfinite(y).any()]
        for c, sensor in enumerate(sensors.values())
    ]

    def noise(readings: list[FloatArray], moving: bool = False) -> float:
        return np.sqrt(np.mean([irregularity(y, moving) ** 2 for y in readings]))

    irregular = np.array(  # of a channel without noise that is mostly zero, as a contact's force, what moves
        [
            max(noise(readings), sensor.floor)
            or noise(readings, moving=True)
            or sensor.noise  # of a few readings, which show none
            or max(ROUGHLY * np.nanmax(np.abs(np.concatenate(readings)), initial=0.0), 1e-300)
            if readings
            else np.inf
            for readings, sensor in zip(within, sensors.values(), strict=True)
        ]
    )
    return Windows(
        system,
        Marcher(system, unknowns.active),
        records,
        sensors,
        unknowns,
        irregular,
        read_modes(system, mode, labels[: len(records)]),
        np.zeros(len(sensors)),
        _LOSSES[loss],
        steady=steady,
    )


def best_of(
    problem: Windows, start: FloatArray | None, free: bool, longest: float, tries: int, seed: int, watched: Progress
) -> Grown:
    """The fit from the first guess that leads to one, else the best of all."""
    if not problem.records:
        return _of_steady(problem, tries, seed, watched)
    both, problem = problem, replace(problem, steady=())
    length = min(first_length(problem), longest)
    best: Grown | None = None
    why: SolveError | None = None
    levels = 12
    with progress(levels * tries, "fit", watched) as advance:
        for guess, times, begin in islice(_guesses(problem, start, free, length, tries, seed), tries):
            left = [levels]

            def told(left: list[int] = left) -> None:
                step = min(left[0], 1)
                left[0] -= step
                advance(step)

            try:
                found = grow(problem, guess, (length, min(times * length, longest), longest), begin, free, told)
            except SolveError as reason:
                why = reason
            else:
                if best is None or found.good or found.rank < best.rank:
                    best = found
            advance(left[0])
            if best is not None and best.good:
                break
    if best is None:
        assert why is not None
        raise SolveError(_NONE.format(tries=tries, why=why))
    best = looked_beside(seen(best, length, start, free), lambda stage: finished(stage, problem.noise))
    best = seen(best, length, start, free)
    return with_steady(both, best.theta, best) if both.steady else best


def _of_steady(problem: Windows, tries: int, seed: int, watched: Progress) -> Grown:
    """The fit to readings of steady states alone: from the first guess that leads near, else from the best."""
    now, rng, rough, why = problem.of([]), np.random.default_rng(seed), list[tuple[float, FloatArray]](), ""

    def far(theta: FloatArray) -> float:
        """Mean squared residual over the noise as it is known, or at first."""
        return float(np.mean(now.residuals(theta, now.starts).alone ** 2))

    def guesses() -> Iterator[FloatArray]:
        yield problem.unknowns.guess
        yield from sorted((drawn(problem, rng) for _ in range(_MORE * (tries - 1))), key=far)

    good = _KNOWN if all(np.isfinite(run.error).all() for run in problem.steady) else _ROUGH
    with progress(tries, "fit", watched) as advance:
        for guess in islice(guesses(), tries):
            try:
                theta = level(Stage(now, guess, now.starts)).theta
            except SolveError as reason:
                why = f"{reason}"
            else:
                rough.append((far(theta), theta))
                if rough[-1][0] < good:
                    break
            advance(1)
    for _, theta in sorted(rough, key=lambda row: row[0]):
        try:
            return with_steady(problem, theta)
        except SolveError as reason:
            why = f"{reason}"
    raise SolveError(_NONE.format(tries=tries, why=why))


def _guesses(
    problem: Windows, start: FloatArray | None, free: bool, length: float, tries: int, seed: int
) -> Iterator[tuple[FloatArray, float, FloatArray | None]]:
    """First guesses, how much longer their first windows are, and starts: the given guess, then others.

    Of those the nearest first: whose first windows fit best before any step. Longer windows hold what hidden states do;
    where there are such, every second guess comes from the beginnings of the records.
    """
    u = problem.unknowns

    def far(guess: FloatArray) -> FloatArray:
        """Mean squared residual of the first windows of each record before any fit, infinite where there is none."""
        total, count = np.zeros((2, len(problem.records)))
        windows = problem.of(first_windows(problem, guess, length, start, free))
        residuals, weights = windows.residuals(guess, windows.starts).residuals, windows.weights(None)
        for w, r, weight in zip(windows.pieces, residuals, weights, strict=True):
            if np.isfinite(r).all():
                total[w.record] += np.sum((r * weight) ** 2)
                count[w.record] += len(r)
        return np.where(count > 0, total / np.maximum(count, 1), np.inf)

    def with_phases(guess: FloatArray) -> FloatArray:
        """The guess with the phase of each run, of a few, at which its first windows fit best."""
        if not u.phases or u.phases != len(problem.records):  # of parts of runs they are known already
            return guess
        shared = len(u.names) - u.phases
        phases = np.arange(_PHASES) / _PHASES
        every = np.array([far(np.append(guess[:shared], np.full(u.phases, phase))) for phase in phases])
        return np.append(guess[:shared], phases[np.argmin(every, axis=0)])

    given, rng = with_phases(u.guess), np.random.default_rng(seed)
    hidden = free and any(
        np.isnan(states_from_samples(problem, given, run, slice(0, 1))).any() for run in range(len(problem.records))
    )

    def others() -> Iterator[tuple[FloatArray, float, FloatArray | None]]:
        yield given, _LONGER, start
        guesses = [with_phases(drawn(problem, rng)) for _ in range(_MORE * max(tries - 2, 1))]
        order = np.argsort([np.sum(far(guess)) for guess in guesses], kind="stable")
        yield from ((guesses[i], _LONGER if k % 2 else 1.0, start) for k, i in enumerate(order))

    yield given, 1.0, start
    for other in others():
        if hidden and (begun := beginnings(problem, length, start, rng)) is not None:
            yield begun[0], _LONGER, begun[1]
        yield other
