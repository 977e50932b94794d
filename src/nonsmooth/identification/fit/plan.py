"""``plan_experiment`` and ``select_model``: what runs not yet made would tell, and how well systems predict others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, Unpack

import numpy as np
import xarray as xr

from nonsmooth.arrays import BoolArray, FloatArray, IntArray
from nonsmooth.blas import one_blas_thread
from nonsmooth.errors import SolveError, check_keys
from nonsmooth.flow.simulate import simulate
from nonsmooth.identification.arrow import concerned, inverted, reduced
from nonsmooth.identification.fit.first_windows import first_length, first_windows
from nonsmooth.identification.fit.fit import best_of, problem_of
from nonsmooth.identification.fit.growth import Grown
from nonsmooth.identification.fit.sensors import read_sensors
from nonsmooth.identification.fit.windows import Windows
from nonsmooth.identification.options import Prior, Recorded
from nonsmooth.results.labels import labelled
from nonsmooth.results.progress import progress as watched
from nonsmooth.system.arguments import check_system, checked
from nonsmooth.system.kinds import at_least
from nonsmooth.system.system import System

_OF_A_RUN = ("duration", "periods", "samples", "start", "mode", "inputs", "settings")


@checked
@one_blas_thread()
def plan_experiment(
    system: System,
    runs: Mapping[str, Mapping[str, Any]],
    parameters: Sequence[str],
    *,
    measured: Mapping[str, Any] | Sequence[str] | str,
    inputs: Any = None,
    **options: Unpack[Prior],
) -> xr.Dataset:
    r"""Return the information of candidate runs about parameters, and the order in which to make them.

    A run with readings y and noise :math:`\sigma` has the Fisher information

    .. math:: F = \sum_{k, c} \frac{1}{\sigma_c^2}
        \frac{\partial y_{kc}}{\partial \theta} \frac{\partial y_{kc}}{\partial \theta}^T

    in all unknowns, with derivatives through every transition; starts and phases, which are unknowns of each run, are
    eliminated. The inverse of what is known before and of F together is the covariance that a fit will have, where the
    model is right and the noise white (Cramer and Rao's bound).

    Parameters
    ----------
    system : System
        At the parameters for which to plan: the best guess.
    runs : mapping of str to mapping
        The candidates: ``duration`` or ``periods`` and ``samples`` as in :func:`nonsmooth.simulate` (the number of
        readings, or their times), and where needed ``start``, ``mode``, and ``settings``, the parameters that are set
        in the run: ``{"slow": {"duration": 20, "samples": 2000, "settings": {"omega": 3.0}}}``.
    parameters : sequence of str
        The unknowns, as :func:`nonsmooth.fit` takes them.
    measured : mapping of str to Sensor
        What is measured, each with ``Sensor(noise=...)`` or ``Sensor(resolution=...)``.
    inputs : mapping of input to (time, values) or Input, optional
        The courses of the system's inputs, as in :func:`nonsmooth.simulate`; a run may have ``inputs`` of its own.

    Returns
    -------
    xarray.Dataset
        ``uncertainty(run, parameter)``: standard uncertainties with that run alone (and the priors), infinite where it
        does not determine the parameter; ``best(parameter)`` names the run with the least. ``log_det(run)``: logarithm
        of the determinant of the information about the parameters in units of their values, the D-optimal measure;
        ``-inf`` where a direction is not determined. ``information(run, parameter, other)`` is F. ``order(step)``: the
        runs, each the one that adds most to the determinant; ``uncertainty_after(step, parameter)`` and
        ``log_det_after(step)``. ``["uncertainty"].to_pandas()`` is a table.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit; a quantity without noise.
    SolveError
        A run that cannot be simulated.

    Notes
    -----
    The table holds for the parameters of ``system``: through impacts it may differ at others, so plan again when the
    first run has been fitted.

    References
    ----------
    A.C. Atkinson, A.N. Donev, R.D. Tobias, Optimum Experimental Designs, with SAS (2007), chapters 6 and 11.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> s = ns.mechanical(1.0, "c", "k", parameters={"c": 0.2, "k": 4.0}, coordinates=["q"])
    >>> decay = {"samples": 400, "start": {"q": 1.0}}
    >>> plan = ns.plan_experiment(
    ...     s, {"short": {"duration": 2, **decay}, "long": {"duration": 20, **decay}}, ["c", "k"],
    ...     measured={"q": ns.Sensor(noise=0.01)},
    ... )
    >>> str(plan["order"].values[0])
    'long'
    """
    if not runs:
        raise TypeError("runs = {}: give the candidates by name, {'slow': {'duration': 20.0, 'samples': 2000}}")
    sensors = {name: replace(one, channel=name) for name, one in read_sensors(system, measured, []).items()}
    noise = np.array([np.hypot(one.noise or 0.0, one.floor) for one in sensors.values()])
    for name, size in zip(sensors, noise, strict=True):
        if not size > 0:
            raise ValueError(f"measured[{name!r}] says no noise: give ns.Sensor(noise=...) or resolution=")
    for name, run in runs.items():
        check_keys(run, _OF_A_RUN, f"runs[{name!r}]", "a property", "a run")
    every = {str(name): {"inputs": inputs, **run} for name, run in runs.items()}
    rows = [_information(system, name, run, parameters, sensors, noise, options) for name, run in every.items()]
    names, _, precision, theta = rows[-1]
    found = [told for _, told, *_ in rows]
    alone = np.array([_uncertainties(one + precision) for one in found])
    size = np.where(theta != 0, np.abs(theta), 1.0)
    order, totals, known = list[int](), list[FloatArray](), precision
    while left := [i for i in range(len(found)) if i not in order]:  # each time the run that adds most
        order.append(max(left, key=lambda i: _gain(known + found[i], size)))
        totals.append(known := known + found[order[-1]])
    units = [system.parameters[name].unit if name in system.parameters else "" for name in names]
    labels = np.array([*map(str, runs)])
    return xr.Dataset(
        {
            "uncertainty": labelled(("run", "parameter"), alone, "standard uncertainty by this run"),
            "log_det": labelled(
                "run",
                [_log_det(one + precision, size) for one in found],
                "log det of the information, in units of the parameters' values",
            ),
            "best": labelled("parameter", labels[alone.argmin(axis=0)], "run with the least uncertainty"),
            "information": labelled(("run", "parameter", "other"), np.array(found), "Fisher information"),
            "order": labelled("step", labels[order], "run that adds most to the determinant"),
            "uncertainty_after": labelled(
                ("step", "parameter"),
                np.array([*map(_uncertainties, totals)]),
                "standard uncertainty by this run and those before",
            ),
            "log_det_after": labelled(
                "step", [_log_det(one, size) for one in totals], "log det by this run and those before"
            ),
        },
        {
            "run": labels,
            "parameter": names,
            "other": names,
            "step": np.arange(1, len(order) + 1),
            "unit": ("parameter", units),
        },
    )


def _information(
    system: System,
    name: str,
    run: Mapping[str, Any],
    parameters: Sequence[str],
    sensors: Mapping[str, Any],
    noise: FloatArray,
    known_before: Prior,
) -> tuple[list[str], FloatArray, FloatArray, FloatArray]:
    """Names of the unknowns that runs share, what the run tells of them, what is known before, and their values."""
    settings = dict(run.get("settings", {}))
    there = system.with_parameters(settings)
    motion = simulate(there, **{key: run[key] for key in run if key != "settings"})
    mode = list(system.modes)[int(motion["mode"].values[0])] if motion["mode"].dtype.kind in "iu" else None
    given = {"measured": sensors, "priors": known_before["priors"]}
    problem = problem_of(there, motion, parameters, given, run.get("mode") or mode, inputs=run["inputs"])
    problem = replace(problem, noise=noise)
    theta = problem.unknowns.guess
    begin = motion["u"].values[:1]
    whole = problem.of(first_windows(problem, theta, np.inf, np.nan_to_num(begin), known_before["free_start"]))
    refusal = SolveError(f"run {name!r} cannot be followed to its end; shorten it", status="no_convergence")
    if not whole.pieces:
        raise refusal
    for window in whole.pieces:
        course = whole.motion(theta, window, window.start)
        if course is None:
            raise refusal
        window.values[window.readings] = whole.shown(window, whole.readings(theta, window, course, False)[0])
    state = whole.residuals(theta, whole.starts, True)
    normal = reduced(whole, state, whole.weights(None, starts=False))[0]
    shared = len(theta) - problem.unknowns.phases
    names, known = list(problem.unknowns.names[:shared]), problem.unknowns.precision
    own = np.linalg.pinv((normal + known)[shared:, shared:], hermitian=True)
    eliminated = normal[:shared, :shared] - normal[:shared, shared:] @ own @ normal[shared:, :shared]
    for i in (names.index(name) for name in settings if name in names):  # known in this run, which tells nothing of it
        eliminated[i] = eliminated[:, i] = 0.0
        theta[i] = system.values[names[i]]
    return names, eliminated, known[:shared, :shared], theta[:shared]


def _uncertainties(information: FloatArray) -> FloatArray:
    """Standard uncertainties; infinite of what a direction has in it that is not determined."""
    covariance, loose = inverted(information)
    found = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    found[concerned(loose).any(axis=1)] = np.inf
    return found


def _log_det(information: FloatArray, size: FloatArray) -> float:
    if not np.isfinite(_uncertainties(information)).all():
        return -np.inf
    return np.linalg.slogdet(information * np.outer(size, size))[1]


def _gain(information: FloatArray, size: FloatArray) -> float:
    """The determinant with a little known of every direction, so that runs can be compared that leave one open."""
    scaled = information * np.outer(size, size)
    return np.linalg.slogdet(scaled + 1e-9 * max(np.trace(scaled), 1e-300) * np.eye(len(size)))[1]


_BLOCK = 2.0  # first windows: the length of a part that is held out


@checked(tries=4)
@one_blas_thread()
def select_model(
    models: Mapping[str, Any],
    recording: Any,
    *,
    folds: Annotated[int, at_least(2)] = 5,
    inputs: Any = None,
    **options: Unpack[Recorded],
) -> xr.Dataset:
    r"""Errors with which systems predict parts of a recording that they were not fitted to.

    The recording is cut into short blocks, and every ``folds``-th of them is held out in turn; of readings of steady
    states every ``folds``-th setting. Each system is fitted to
    the rest (:func:`nonsmooth.fit`), and its motion is compared with the readings that were held out. So a model with
    more parameters is not better for that alone.

    Parameters
    ----------
    models : mapping of str to (System, parameters)
        The systems to compare, each with what is to be found of it, as :func:`nonsmooth.fit` takes it.
    recording : Recording, Dataset, DataFrame, mapping or list of these
        See :func:`nonsmooth.fit`; the measured states or outputs are those of every system.
    folds : int
        How many times a part is held out.
    inputs : mapping of input to channel, Input or (time, values), optional
        The courses of the systems' inputs, as in :func:`nonsmooth.fit`.

    Returns
    -------
    xarray.Dataset
        ``squared_error(model, fold)``: mean squared error of the prediction, over the variance that the record's own
        irregularity shows (1: as good as its noise allows), or over that given with a steady reading (a twentieth of
        the largest, where none is). A reading of which a model has no motion counts as if its mean were predicted.
        ``rms(model)``; ``difference(model)``: mean excess of ``squared_error`` over that of the best model, with its
        standard error over the folds, ``difference_error``. The attribute ``best`` names the model with the least
        error.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit.

    Notes
    -----
    A difference below twice its error does not tell two models apart; take the simpler one.

    References
    ----------
    P. Burman, E. Chow, D. Nolan, Biometrika 81 (1994) 351-358 (cross-validation of dependent data).
    """
    if len(models) < 2:
        raise ValueError(
            "models must name at least two systems, each with what is to be found of it: "
            '{"viscous": (system, ["k", "c"]), "dry": (other, ["k", "f"])}'
        )
    progress, tries, seed = options["progress"], options["tries"], options["seed"]
    problems = {}
    for name, pair in models.items():
        if not isinstance(pair, list | tuple) or len(pair) != 2:
            given = f"{len(pair)} things" if isinstance(pair, list | tuple) else type(pair).__name__
            raise TypeError(f"models[{name!r}] must be a pair (system, parameters), not {given}")
        check_system(pair[0], "select_model", inputs=True)
        problems[str(name)] = problem_of(pair[0], recording, pair[1], options, inputs=inputs)
    held = _held_out(next(iter(problems.values())), folds)
    found = np.empty((len(problems), folds))
    with watched(len(problems) * folds, "models", progress) as advance:
        for i, problem in enumerate(problems.values()):
            for fold in range(folds):
                found[i, fold] = _error(problem, [part == fold for part in held], tries, seed)
                advance()
    best = int(np.argmin(found.mean(axis=1)))
    excess = found - found[best]
    return xr.Dataset(
        {
            "squared_error": (("model", "fold"), found, {"units": "1"}),
            "rms": ("model", np.sqrt(found.mean(axis=1)), {"units": "1"}),
            "difference": ("model", excess.mean(axis=1), {"units": "1"}),
            "difference_error": ("model", excess.std(axis=1, ddof=1) / np.sqrt(folds), {"units": "1"}),
        },
        {"model": list(problems), "fold": np.arange(folds)},
        {"best": list(problems)[best]},
    )


def _held_out(problem: Windows, folds: int) -> list[IntArray]:
    """The fold in which each instant of a record (-1: never, at its beginning), or each steady reading, is held out."""
    length, block, found = _BLOCK * first_length(problem) if problem.records else 0.0, 0, list[IntArray]()
    for record in problem.records:
        number = np.floor((record.time - record.time[0]) / length).astype(np.int64)
        found.append(np.where(number == 0, -1, (number - 1 + block) % folds))
        block += int(number[-1])
    found += [one.setting[one.run] % folds for one in problem.steady]
    if not {*range(folds)} <= {*np.concatenate(found).tolist()}:
        raise ValueError(
            f"the recording is too short for folds = {folds}: it holds {block} blocks of {length:.3g}, beside settings "
            "of steady states; ask for fewer folds"
        )
    return found


def _error(problem: Windows, held: list[BoolArray], tries: int, seed: int) -> float:
    """Mean squared error at the readings held out, over the noise."""
    records = [
        replace(record, values=np.where(part[:, None], np.nan, record.values))
        for record, part in zip(problem.records, held, strict=False)
    ]
    steady = tuple(one.only(~part) for one, part in zip(problem.steady, held[len(records) :], strict=True))
    # where there is no prediction
    far = [(record.values - np.nanmean(record.values, axis=0)) / problem.noise for record in problem.records]
    far += [(one.measured - np.mean(one.measured)) / one.noise for one in problem.steady]
    try:
        grown = best_of(replace(problem, records=records, steady=steady), None, True, np.inf, tries, seed, False)
    except SolveError:
        pass
    else:
        _predict(problem, grown, far)
    rows = [part[out][np.isfinite(part[out])] for part, out in zip(far, held, strict=True)]
    return np.mean(np.concatenate(rows) ** 2)


def _predict(problem: Windows, grown: Grown, far: list[FloatArray]) -> None:
    """Errors over the noise of all readings of which the fit has a motion, in place."""
    fitted = grown.problem
    for window, start in zip(fitted.pieces, grown.starts, strict=True):
        whole = window.cut(problem.records[window.record], window.last)
        motion = fitted.motion(grown.theta, whole, start)
        if motion is not None:
            predicted, _ = fitted.readings(grown.theta, whole, motion, False)
            k, c = whole.readings
            left = whole.values[k, c] - fitted.shown(whole, predicted)
            far[window.record][window.first + k, c] = left / problem.noise[c]
    for i, (one, left) in enumerate(zip(problem.steady, far[len(problem.records) :], strict=True)):
        there = replace(fitted, steady=problem.steady).of_steady(grown.theta, i)[0]
        np.copyto(left, (one.measured - there) / one.noise, where=np.isfinite(there))
