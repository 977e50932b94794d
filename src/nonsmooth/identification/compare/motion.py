"""One measured motion against theory: orbits modulo phase, section clouds, period numbers, and the band."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.arrays import FloatArray
from nonsmooth.identification.compare.draws import Model
from nonsmooth.identification.compare.orbits import (
    FEWEST_BLOCKS,
    cloud_distance,
    common_length,
    energy_distance,
    fold,
    mean_orbit,
    orbit_distance,
    wasserstein,
)
from nonsmooth.identification.compare.periods import measured_period
from nonsmooth.identification.compare.predict import SHOWN, Motions, Prediction, SteadyState, from_result, predict
from nonsmooth.results.labels import labelled
from nonsmooth.system.system import System

CLOUD = 2000  # section points of a predicted motion without a period number
MEASURED_STARTS = 4


def compare_motion(
    measured: xr.Dataset,
    model: Model,
    start: Any,
    phases: list[float],
) -> dict[str, Any]:
    """The variables of the comparison, ``{name: (dims, values, attributes)}``; see :func:`compare` for each."""
    noise, known = model.noise, np.empty(0)
    if "u" in measured:
        turns, u = (measured[name].values.astype(float) for name in ("phase", "u"))
        folded, returns = fold(turns, u, model.grid), [fold(turns - phase, u, 8)[:, 0] for phase in phases]
        known = turns[np.isfinite(u).all(axis=1)]
    else:
        folded, returns = None, [measured["section"].values.astype(float)]
    sections = [points[np.isfinite(points).all(axis=1)] for points in returns]
    scale = np.maximum(np.concatenate(sections).std(axis=0), noise)
    number = measured_period(returns[0] if folded is None else folded, noise, max_period=model.max_period).number
    rng = np.random.default_rng(model.seed)
    motions = None
    if model.system is not None:
        starts = _starts(sections[0] if phases[0] == 0 else None, folded, model, start)
        motions = Motions([model.system], model)
        predicted = predict(motions, sections, phases, scale, starts=starts, n=max(CLOUD, len(sections[0])))
    else:
        predicted = from_result(model, phases)
    blurred = [points + noise * rng.standard_normal(points.shape) for points in predicted.sections]
    variables = _clouds(sections, blurred, predicted.sections, scale, model)
    variables |= _periods(number, predicted, returns[0], scale, model.states)
    if motions is not None and sorted(model.places) == list(range(len(motions.system.states))):
        # where neither has a period the motion begins at the first measured state that is shown
        whole = None if folded is None or number or predicted.period_number else _shown(folded)
        if whole is not None and len(whole):
            at = np.empty(len(motions.places))
            at[motions.places] = whole[0, 0]
            predicted = predicted._replace(orbit=motions.orbit(0, at, len(whole)))
    variables |= _orbits(folded, number, predicted, model, motions, known)
    if model.system is not None and model.draws:
        assert predicted.attractor is not None  # a System's prediction has one
        systems, drawn = model.drawn()
        closed = None
        if "phase" in variables and folded is not None:
            scatter = np.fmax(variables["measured_scatter"][1], noise)
            error = scatter / np.sqrt(max(len(folded) // number, 1))
            closed = variables["measured_orbit"][1], variables["theory_orbit"][1], error
        variables |= motion_band(systems, model, predicted.attractor, sections, phases, scale, closed, known)
        variables |= drawn
    named = {"long_name": "phase of the section", "units": "forcing periods"}
    return variables | {"section_phase": ("section_phase", np.array(phases), named)}


def _starts(points: FloatArray | None, folded: FloatArray | None, model: Model, start: Any) -> Any:
    """The starts given; else rest and measured points at phase 0, so that theory begins where the experiment was.

    States that were not measured begin at 0.
    """
    if start is not None:
        return np.atleast_2d(np.asarray(start, float))
    at_zero = points if folded is None else folded[np.isfinite(folded[:, 0]).all(axis=1), 0]
    at_zero = np.zeros((0, len(model.states))) if at_zero is None else at_zero
    count = min(MEASURED_STARTS, len(at_zero))
    starts = np.zeros((1 + count, len(model.theory.states)))
    starts[1:, model.places] = at_zero[np.linspace(0, len(at_zero) - 1, count).astype(int)]
    return starts


def _clouds(
    sections: list[FloatArray],
    blurred: list[FloatArray],
    exact: list[FloatArray],
    scale: FloatArray,
    model: Model,
) -> dict[str, Any]:
    from scipy.stats import wasserstein_distance

    size = min(len(points) for points in sections)
    at = "section_phase"
    variables = {
        "measured_section": labelled(
            (at, "measured_iterate", "state"), np.stack([p[:size] for p in sections]), "measured section points"
        ),
        "theory_section": labelled((at, "theory_iterate", "state"), np.stack(exact), "predicted section points"),
        "section_scale": labelled("state", scale, "unit of each state in the distances of clouds"),
    }
    pairs = list(zip(sections, blurred, strict=True))
    scaled = [(a / scale, b / scale) for a, b in pairs]
    found = [
        cloud_distance(a, b, splits=model.splits, seed=model.seed) if min(len(a), len(b)) >= 2 * FEWEST_BLOCKS else None
        for a, b in scaled
    ]
    moved = [[wasserstein_distance(*column) for column in zip(a.T, b.T, strict=True)] for a, b in pairs]
    both = [wasserstein(a, b, model.seed) for a, b in scaled]
    variables["wasserstein_distance"] = labelled(
        (at, "state"), np.array(moved), "Wasserstein distance of the section clouds, in the state's unit"
    )
    variables["wasserstein_distance_joint"] = labelled(
        at, np.array(both), "Wasserstein distance of the section clouds in all states, scaled"
    )

    words = {
        "energy_distance": "energy distance of the section clouds (root), scaled",
        "energy_distance_matched": "median energy distance of parts as large as a half, scaled",
        "energy_ratio": "energy_distance_matched over the 95th percentile of measured halves",
        "measured_halves_median": "energy distance of random halves of the measured cloud: median",
        "measured_halves_p95": "energy distance of random halves of the measured cloud: 95th percentile",
        "theory_halves_median": "energy distance of random halves of the theory cloud: median",
        "theory_halves_p95": "energy distance of random halves of the theory cloud: 95th percentile",
        "block": "successive section points kept together in random halves",
    }
    rows = np.full((len(found), len(words)), np.nan)
    for row, c in zip(rows, found, strict=True):
        if c is not None:
            halves = (np.quantile(one, (0.5, 0.95)) for one in (c.halves, c.other_halves))
            row[:] = np.concatenate([[c.distance, c.matched, c.ratio], *halves, [c.block]])
    variables |= {name: labelled(at, row, said) for (name, said), row in zip(words.items(), rows.T, strict=True)}
    return variables


def _periods(
    number: int, predicted: Prediction, section: FloatArray, scale: FloatArray, states: list[str]
) -> dict[str, Any]:
    theory = predicted.period_number
    same = number == theory
    words = "the same" if same else "others"
    if not number or not theory:
        words = "none found in either" if same else f"found in the {'measured' if number else 'predicted'} motion alone"
    rows = [(number, section, "measured"), (theory, predicted.sections[0], "predicted")]
    (low, single, _), (high, doubled, whose) = sorted(rows, key=lambda row: row[0])
    if low > 0 and high == 2 * low and (apart := _doubled(single, doubled, scale, low)) is not None:
        by = ", ".join(f"{far:.2g} in {name}" for far, name in zip(apart, states, strict=True))
        words = f"on either side of a flip: the {whose} motion is doubled, its section points part by {by}"
    coexisting = predicted.coexisting
    return {
        "measured_period_number": labelled((), np.int64(number), "measured period number (0: none found)"),
        "theory_period_number": labelled(
            (), np.int64(theory), "period number of the nearest predicted motion (0: none found)"
        ),
        "coexisting_period_number": labelled("attractor", coexisting, "period numbers of all predicted motions"),
        "period_agrees": labelled(
            (), np.int8(number == theory), "1 where the nearest predicted motion has the measured period number"
        ),
        "period_coexists": labelled(
            (), np.int8(number in coexisting), "1 where the measured period number is among the predicted ones"
        ),
        "period_relation": labelled((), words, "how the two period numbers lie to each other"),
    }


def _doubled(single: FloatArray, doubled: FloatArray, scale: FloatArray, number: int) -> FloatArray | None:
    """Distances by which a flip has split the section points of an orbit; None where those are not near these.

    Near: the middle of each pair is closer to a point of the orbit that is not doubled than the pair to each other.
    """
    points = np.array([np.nanmean(single[k::number], axis=0) for k in range(number)])
    split = np.array([np.nanmean(doubled[k :: 2 * number], axis=0) for k in range(2 * number)])
    middle, apart = 0.5 * (split[:number] + split[number:]), split[:number] - split[number:]
    away = np.min(np.linalg.norm((middle[:, None] - points) / scale, axis=2), axis=1)
    return np.abs(apart).max(axis=0) if np.linalg.norm(away) < np.linalg.norm(apart / scale) else None


def _shown(folded: FloatArray) -> FloatArray:
    """The last whole periods of the record."""
    return folded[np.isfinite(folded).all(axis=(1, 2))][-SHOWN:]


def _orbits(
    folded: FloatArray | None,
    number: int,
    predicted: Prediction,
    model: Model,
    motions: Motions | None,
    known: FloatArray,
) -> dict[str, Any]:
    if folded is None or predicted.orbit is None:
        return {}
    grid = model.grid
    closed = number > 0 and predicted.period_number > 0
    distances = (np.nan, np.nan, np.nan)
    scatter = None
    if closed:
        length = np.lcm(number, predicted.period_number)
        mean, spread = mean_orbit(folded, number)
        a, scatter = common_length(mean, number, length), common_length(spread, number, length)
        b = common_length(predicted.orbit, predicted.period_number, length)
        seen = b
        if motions is not None and predicted.attractor is not None:
            seen = motions.shown(0, predicted.attractor, length, known)
        found = orbit_distance(a, seen, length, model.noise)
        b = np.roll(b, found.whole_shift * grid, axis=0) if found.whole_shift else b
        distances = (found.distance, found.any_phase, found.phase_shift)
    else:
        a, b = _shown(folded).reshape(-1, folded.shape[2]), predicted.orbit
    over = ("phase", "state")
    names = ("phase", "phase") if closed else ("measured_phase", "theory_phase")
    variables = {
        "measured_orbit": labelled((names[0], "state"), a, "measured motion over the phase of the drive"),
        "theory_orbit": labelled((names[1], "state"), b, "predicted motion over the phase of the drive"),
        "orbit_distance": labelled((), distances[0], "normalised distance of the orbits, phase known"),
        "orbit_distance_any_phase": labelled((), distances[1], "normalised distance modulo phase"),
        "phase_shift": labelled(
            (), distances[2], "lead of the predicted orbit in orbit_distance_any_phase", "forcing periods"
        ),
    }
    if scatter is not None:
        variables["measured_scatter"] = labelled(over, scatter, "standard deviation of one pass")
    for name, values in zip(names, (a, b), strict=True):
        variables[name] = labelled(name, np.arange(len(values)) / grid, "phase of the drive", "forcing periods")
    return variables


POINTS = 500  # of the clouds whose distance is taken for each draw


def motion_band(
    systems: list[System],
    model: Model,
    nearest: SteadyState,
    sections: list[FloatArray],
    phases: list[float],
    scale: FloatArray,
    closed: tuple[FloatArray, FloatArray, FloatArray] | None,
    known: FloatArray,
) -> dict[str, Any]:
    """Carry the nearest motion on to each drawn system, and say how the prediction spreads.

    ``closed``: measured and predicted orbit (periods * grid, states), where both motions are periodic, and the standard
    error of the measured one. A draw with
    another period number has another motion, not a point of the band: ``band_share`` says how many kept theirs.
    """
    rng = np.random.default_rng(model.seed)
    draws = len(systems)
    numbers = np.zeros(draws, np.int64)
    distances = np.full((draws, len(phases)), np.nan)
    to_measured = np.full(draws, np.nan)
    orbits: list[FloatArray] = []
    motions = Motions(systems, model)
    for i in range(draws):
        (one,) = motions.attractors(i, nearest.point)
        numbers[i] = one.period_number
        for j, phase in enumerate(phases):
            points = motions.cloud(i, one, phase, POINTS)
            points = points + model.noise * rng.standard_normal(points.shape)
            distances[i, j] = energy_distance(sections[j][-POINTS:] / scale, points / scale)
        length = 0 if closed is None else len(closed[0]) // model.grid
        if closed is not None and one.period_number and length % one.period_number == 0:
            motion = common_length(motions.orbit(i, one.point, one.period_number), one.period_number, length)
            shift = orbit_distance(closed[1], motion, length, model.noise).whole_shift
            orbits.append(np.roll(motion, shift * model.grid, axis=0))
            seen = motions.shown(i, one, length, known)
            to_measured[i] = orbit_distance(closed[0], seen, length, model.noise).distance
    variables = {
        "draw_period_number": labelled("draw", numbers, "period number for drawn parameters"),
        "draw_energy_distance": labelled(
            ("section_phase", "draw"), distances.T, "energy distance of the section clouds for drawn parameters, scaled"
        ),
    }
    if closed is None:
        return variables
    variables["draw_orbit_distance"] = labelled(
        "draw", to_measured, "normalised distance of the orbits for drawn parameters"
    )
    variables["band_share"] = labelled(
        (), len(orbits) / draws, "share of the draws that keep the period; these make the band"
    )
    if orbits:
        band = model.band(orbits)
        for word, values in band.items():
            variables[f"theory_{word}"] = labelled(("phase", "state"), values, f"{word} of the band")
        reach = 2 * closed[2]
        inside = ((closed[0] + reach >= band["low"]) & (closed[0] - reach <= band["high"])).mean(axis=0)
        variables["inside_band"] = labelled(
            "state", inside, "share of the measured orbit within two standard errors of the band"
        )
    return variables
