"""``select_model``: systems ranked by how well each predicts parts of a recording that it was not fitted to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Unpack

import numpy as np
import xarray as xr

from nonsmooth.arrays import BoolArray, FloatArray, IntArray
from nonsmooth.blas import one_blas_thread
from nonsmooth.errors import SolveError
from nonsmooth.identification.fit.first_windows import first_length
from nonsmooth.identification.fit.fit import best_of, problem_of
from nonsmooth.identification.fit.growth import Grown
from nonsmooth.identification.fit.windows import Windows
from nonsmooth.identification.options import Recorded
from nonsmooth.results.progress import progress as watched
from nonsmooth.system.arguments import check_system, checked
from nonsmooth.system.kinds import at_least

_BLOCK = 2.0  # first windows: the length of a part that is held out


@checked(tries=4)
@one_blas_thread()
def select_model(
    models: Mapping[str, Any],
    recording: Any,
    *,
    folds: Annotated[int, at_least(2)] = 5,
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
        problems[str(name)] = problem_of(pair[0], recording, pair[1], options)
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
