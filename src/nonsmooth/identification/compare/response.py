"""A measured response, or sections along a parameter, against theory: the overlay, jumps and flips, the band."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray, IntArray
from nonsmooth.diagrams.response import jumps_in
from nonsmooth.identification.compare.draws import Model, intervals
from nonsmooth.identification.compare.periods import (
    Doubling,
    MeasuredFlip,
    delayed_flips,
    flips,
    measured_period,
    period_numbers,
)
from nonsmooth.identification.compare.predict import carried
from nonsmooth.identification.measured_units import units_of
from nonsmooth.results.labels import labelled
from nonsmooth.system.system import System

STEEPER = 2.5  # a jump exceeds the steps on both sides by this factor
LEAST = 0.02  # and this part of the amplitude
CERTAIN = 6.0  # and its standard error by this factor


class AmplitudeJump(NamedTuple):
    """A jump in the middle of a ``step``, which it is known to; amplitude before and after it, in the sweep's order."""

    value: float
    step: float = 0.0
    before: float = np.nan
    after: float = np.nan


Jumps = Mapping[str, Sequence[AmplitudeJump]]


def jumps_in_steps(x: FloatArray, heights: FloatArray, error: FloatArray) -> list[AmplitudeJump]:
    """The jumps in an amplitude measured step by step, in the order in which the steps were taken.

    On the way to a fold the steps grow, so a jump need not be many times its neighbours. It is one where the step is
    larger than both by 2.5 times, and where the steps before and the steps after, each carried on evenly, both leave
    more than half of it over. ``error``: standard errors of the amplitudes, 0 where not known.
    """
    step = np.diff(heights)
    beyond = np.pad(step, 1, mode="edge") if len(step) else step  # where there is no further step, one as the last
    found = []
    for i in range(len(step)):
        beside = [(step[j], beyond[2 * j - i + 1]) for j in (i - 1, i + 1) if 0 <= j < len(step)]
        if not beside or abs(step[i]) <= STEEPER * max(abs(near) for near, _ in beside):
            continue
        least = max(LEAST * max(abs(heights[i : i + 2])), CERTAIN * np.hypot(*error[i : i + 2]))
        carried = (2 * near - far for near, far in beside)
        if abs(step[i]) <= least or any(abs(step[i] - one) < 0.5 * abs(step[i]) for one in carried):
            continue
        found.append(AmplitudeJump(0.5 * (x[i] + x[i + 1]), abs(x[i + 1] - x[i]), heights[i], heights[i + 1]))
    return found


def jumps_of_runs(value: FloatArray, amplitude: FloatArray, error: FloatArray, direction: NDArray[Any]) -> Jumps:
    """The jumps in each direction in which runs were reached, in the order of the steps."""
    found = {}
    for word in ("up", "down"):
        mine = np.flatnonzero(direction == word)
        order = mine[np.argsort(value[mine])][:: -1 if word == "down" else 1]
        if len(order):
            found[word] = jumps_in_steps(*(np.nan_to_num(column[order]) for column in (value, amplitude, error)))
    return found


def match_jumps(measured: Jumps, theory: Jumps, drawn: Sequence[Jumps], unit: str, level: float) -> dict[str, Any]:
    """Pair the jumps of each direction in the order in which they are met, rises with rises and falls with falls.

    Where one side has more of a kind, those stay without a partner that leave the sum of the distances least, the
    order being kept. Variables over ``jump``: ``jump_direction``, ``measured_jump``, ``theory_jump`` (NaN: no
    partner), ``jump_difference`` (theory minus measurement), ``jump_tolerance`` (both half steps together: the
    difference is not known better), and with draws ``theory_jump_low``, ``theory_jump_high``.
    """
    rows: list[tuple[str, AmplitudeJump, AmplitudeJump]] = []
    nothing = AmplitudeJump(np.nan)
    for word in dict.fromkeys([*measured, *theory]):
        both = seen, expected = list(measured.get(word, ())), list(theory.get(word, ()))
        kinds = ([jump.after > jump.before for jump in jumps] for jumps in both)
        pairs = nearest_alike(*([jump.value for jump in jumps] for jumps in both), *kinds)
        rows += [(word, jump, expected[pairs[i]] if i in pairs else nothing) for i, jump in enumerate(seen)]
        rows += [(word, nothing, jump) for j, jump in enumerate(expected) if j not in pairs.values()]
    (m, own), (t, step) = (np.array([row[k][:2] for row in rows], float).reshape(-1, 2).T for k in (1, 2))
    over = "jump"
    variables = {
        "jump_direction": labelled(over, np.array([row[0] for row in rows], str), "direction in which the jump is met"),
        "measured_jump": labelled(over, m, "measured jump (NaN: none was seen)", unit),
        "theory_jump": labelled(over, t, "predicted jump (NaN: none is predicted)", unit),
        "jump_difference": labelled(over, t - m, "predicted minus measured jump", unit),
        "jump_tolerance": labelled(over, 0.5 * (own + step), "half steps of both", unit),
    }
    table = [[nearest([one.value for one in of.get(word, ())], jump.value) for word, _, jump in rows] for of in drawn]
    return variables | intervals("theory_jump", over, table, unit, level)


def nearest(found: Sequence[float], value: float) -> float:
    """The number nearest to a value; NaN where there is none, or no value."""
    return min(found, key=lambda one: abs(one - value), default=np.nan) if np.isfinite(value) else np.nan


def nearest_alike(ours: Any, theirs: Any, our_kinds: Any, their_kinds: Any) -> dict[int, int]:
    """Pairs of values of one kind, by their places, so that the sum of their distances is least; the order is kept."""
    from scipy.optimize import linear_sum_assignment

    pairs: dict[int, int] = {}
    for kind in dict.fromkeys(our_kinds):
        mine, other = (
            sorted((i for i, one in enumerate(kinds) if one == kind), key=values.__getitem__)
            for values, kinds in ((ours, our_kinds), (theirs, their_kinds))
        )
        away = np.abs(np.subtract.outer([ours[i] for i in mine], [theirs[j] for j in other]))
        # Of numbers along a line those in order leave the least sum too.
        rows, columns = map(sorted, linear_sum_assignment(away))
        pairs |= {mine[i]: other[j] for i, j in zip(rows, columns, strict=True)}
    return pairs


_OF_A_RESPONSE = 301  # values of the predicted curve


def compare_response(measured: xr.Dataset, model: Model, *, name: str) -> dict[str, Any]:
    """The variables of the comparison, ``{name: (dims, values, attributes)}``; see :func:`compare` for each."""
    state = model.states[0]
    own, runs = units_of(model.theory)[state], _runs(measured, name, state)
    unit, at_runs = measured[name].attrs.get("units", "1"), np.full(len(runs["value"]), np.nan)
    if others := sorted({*runs["direction"]} - {"up", "down"}):
        raise ValueError(
            "`direction` says of each run whether it was reached up or down (up where not given); got "
            + ", ".join(others)
        )
    directions = [word for word in ("up", "down") if (runs["direction"] == word).any()]
    parts = [runs["direction"] == word for word in directions]

    def predicted(system: System) -> tuple[FloatArray, FloatArray]:
        """The curve on a regular grid, and at the runs: one carried sweep over both for each direction."""
        curves, at_runs = np.empty((len(values), len(directions))), np.full(len(runs["value"]), np.nan)
        for d, (word, mine) in enumerate(zip(directions, parts, strict=True)):
            every = np.union1d(values, runs["value"][mine])
            (slot,) = carried(system, model, name, every, [word])
            heights = 0.5 * (slot.kept.high - slot.kept.low)[:, model.places[0]]
            curves[:, d] = heights[np.searchsorted(every, values)]
            at_runs[mine] = heights[np.searchsorted(every, runs["value"][mine])]
        return curves, at_runs

    if model.system is None:
        values, curves = _given(model.theory, name, state, directions)
        for mine, curve in zip(parts, curves.T, strict=True):
            at_runs[mine] = np.interp(runs["value"][mine], values, curve)
    else:
        values = np.linspace(runs["value"].min(), runs["value"].max(), _OF_A_RESPONSE)
        curves, at_runs = predicted(model.system)
    variables = {
        f"measured_{name}": labelled("run", runs["value"], f"measured {name}", unit),
        "measured_direction": labelled("run", runs["direction"], "direction in which the run was reached"),
        "measured_amplitude": labelled("run", runs["amplitude"], "measured amplitude", own),
        "measured_amplitude_error": labelled("run", runs["error"], "standard error of it", own),
        "measured_period_number": labelled(
            "run", runs["period"], "measured period number (0: none found, -1: not known)"
        ),
        "theory_amplitude": labelled((name, "direction"), curves, "predicted amplitude", own),
        "theory_at_run": labelled("run", at_runs, "predicted amplitude at the run", own),
        "relative_difference": labelled("run", at_runs / runs["amplitude"] - 1, "prediction over measurement, minus 1"),
        name: labelled(name, values, name, unit),
        "direction": labelled("direction", np.array(directions), "direction of the sweep"),
    }
    expected = _jumps(values, curves, directions)
    seen = jumps_of_runs(*(runs[key] for key in ("value", "amplitude", "error", "direction")))
    drawn_jumps: list[Jumps] = []
    if model.system is not None and model.draws:
        systems, drawn = model.drawn()
        stack, stack_runs = zip(*map(predicted, systems), strict=True)
        drawn_jumps = [_jumps(values, curve, directions) for curve in stack]
        for word, curve in model.band(stack).items():
            variables[f"theory_{word}"] = labelled((name, "direction"), curve, f"{word} of the band", own)
        band, reach = model.band(stack_runs), 2 * np.nan_to_num(runs["error"])
        inside = (runs["amplitude"] + reach >= band["low"]) & (runs["amplitude"] - reach <= band["high"])
        variables["inside_band"] = labelled(
            (), inside.mean(), "share of the runs within two standard errors of the band"
        )
        variables |= drawn
    return variables | match_jumps(seen, expected, drawn_jumps, unit, model.level)


def _runs(measured: xr.Dataset, name: str, state: str) -> dict[str, NDArray[Any]]:
    """One row for each run: value, direction, amplitude, error, period number, sorted by direction and value."""
    one = measured.sel(state=state) if "state" in measured["amplitude"].dims else measured
    over = {*one["amplitude"].dims} - {"direction"}
    if name not in one.variables or len(over) != 1 or {*one[name].dims} != over:
        raise ValueError(
            f"a measured response holds `amplitude` over its runs, with `{name}` (and `direction`) for each; this "
            f"one has {one['amplitude'].dims} and {', '.join(map(str, measured.variables))}"
        )
    absent = {"direction": "up", "amplitude_error": np.nan, "period_number": -1}
    held = [key for key in ("amplitude", name, *absent) if key in one.variables]
    frame = one[held].to_dataframe().reset_index().assign(**{key: absent[key] for key in {*absent} - {*held}})
    frame = frame[np.isfinite(frame[name]) & np.isfinite(frame["amplitude"])].sort_values(["direction", name])
    if frame.empty:
        raise ValueError("the measured response has no run with a finite amplitude")
    columns = {"value": name, "amplitude": "amplitude", "error": "amplitude_error", "period": "period_number"}
    direction = {"direction": frame["direction"].to_numpy(str)}
    return direction | {key: frame[column].to_numpy() for key, column in columns.items()}


def _given(theory: xr.Dataset, name: str, state: str, directions: list[str]) -> tuple[FloatArray, FloatArray]:
    if "amplitude" not in theory or name not in theory["amplitude"].dims:
        raise ValueError(
            f"the theory must be a System or a result of frequency_response over {name}; it holds "
            f"{', '.join(map(str, theory.data_vars))}"
        )
    heights = theory["amplitude"].sel(state=state)
    heights = heights.expand_dims([d for d in ("direction",) if d not in heights.dims]).sortby(name)
    words = np.atleast_1d(heights["direction"].values).astype(str).tolist()
    if missing := [word for word in directions if word not in words]:
        raise ValueError(f"runs were made {' and '.join(missing)}, the theory has only: {', '.join(words)}")
    chosen = heights.transpose(name, "direction").isel(direction=[words.index(word) for word in directions])
    return chosen[name].values, chosen.values


def _jumps(values: FloatArray, curves: FloatArray, directions: list[str]) -> Jumps:
    """The jumps of each direction: middle and width of the step in which they lie, amplitude before and after."""
    found = {}
    for d, word in enumerate(directions):
        x, heights = (values, curves[:, d]) if word == "up" else (values[::-1], curves[::-1, d])
        steps = [(x[[i, j]], heights[[i, j]].tolist()) for i, j in jumps_in(x, heights)]
        found[word] = [AmplitudeJump(at.mean(), np.ptp(at), *both) for at, both in steps]
    return found


_OF_A_DIAGRAM = 201


def compare_diagram(
    measured: xr.Dataset,
    model: Model,
    *,
    name: str,
    direction: str,
    values: FloatArray | None,
    phase: float,
) -> dict[str, Any]:
    """The variables of the comparison, ``{name: (dims, values, attributes)}``; see :func:`compare` for each."""
    at, points, numbers, seen = _measured(measured, name, model)
    unit = measured[name].attrs.get("units", "1")
    grid = np.linspace(at.min(), at.max(), _OF_A_DIAGRAM) if values is None else np.asarray(values, float)
    words = ["up", "down"] if direction == "both" else [direction]

    def diagram(system: System) -> tuple[FloatArray, IntArray]:
        slots = carried(system, model, name, grid, words, phase)
        sections = np.stack([slot.kept.section[..., model.places] for slot in slots])
        return sections, np.stack([slot.period_number for slot in slots])

    theory = model.theory
    if model.system is not None:
        sections, periods = diagram(model.system)
    else:
        grid = theory[name].values
        words = np.atleast_1d(theory["direction"].values).astype(str).tolist()
        whole = theory["section"].sel(state=model.states).transpose(..., name, "iterate", "state").values
        sections = whole.reshape(-1, *whole.shape[-3:])
        periods = theory["period_number"].transpose(..., name).values.reshape(-1, len(grid))
    over = (name, "direction", "iterate", "state")
    variables = {
        f"measured_{name}": labelled("sample", at, f"measured {name}", unit),
        "measured_section": labelled(("sample", "state"), points, "measured section points"),
        "measured_period_number": labelled("sample", numbers, "measured period number (0: none found)"),
        "theory_section": labelled(over, np.moveaxis(sections, 0, 1), "predicted section points"),
        "theory_period_number": labelled((name, "direction"), periods.T, "predicted period number (0: none)"),
        name: labelled(name, grid, name, unit),
        "direction": labelled("direction", np.array(words), "direction of the sweep"),
    }
    drawn_flips: list[list[Doubling]] = []
    if model.system is not None and model.draws:
        systems, drawn = model.drawn()
        clouds = []
        for one in systems:
            (cloud, *_), counts = diagram(one)
            clouds.append(cloud)
            drawn_flips.append(flips(grid, counts[0]))
        for word, stack in (("low", np.min(clouds, axis=2)), ("high", np.max(clouds, axis=2))):
            variables[f"theory_{word}"] = labelled(
                (name, "state"), model.band(stack)[word], f"{word} edge of the section points for drawn parameters"
            )
        variables |= drawn
    if name not in measured["section"].dims:
        variables["rise_per_return"] = labelled(
            (), (at[-1] - at[0]) / (len(at) - 1), f"rise of {name} per return", unit
        )
    return variables | _flips(seen, flips(grid, periods[0]), drawn_flips, unit, model)


def _measured(
    measured: xr.Dataset, name: str, model: Model
) -> tuple[FloatArray, FloatArray, IntArray, list[MeasuredFlip]]:
    """Values, points and period numbers, one row for each point, and flips: of steady runs, or of one slow rise."""
    section = measured["section"]
    if name in section.dims:
        stacked, values = section.transpose(name, "iterate", "state").values, measured[name].values.astype(float)
        numbers = [measured_period(one, model.noise, max_period=model.max_period).number for one in stacked]
        seen = [MeasuredFlip(one.value, np.nan, one) for one in flips(values, numbers)]  # between two runs
        good = np.isfinite(stacked).all(axis=2)
        at, found = (np.repeat(one, good.sum(axis=1)) for one in (values, numbers))
        return at, stacked[good], found, seen
    points, at = section.transpose("iterate", "state").values, measured[name].values
    if at.shape != points.shape[:1]:
        raise ValueError(f"{name} must be given for each of the {len(points)} section points; got {at.shape}")
    good = np.isfinite(points).all(axis=1)
    at, points = at[good], points[good]
    found = period_numbers(points, model.noise, max_period=min(model.max_period, 8))
    return at, points, found, delayed_flips(at, points, model.noise, found)


def _flips(
    measured: list[MeasuredFlip], theory: list[Doubling], drawn: list[list[Doubling]], unit: str, model: Model
) -> dict[str, Any]:
    """Pair the flips of one kind: of one period number, with the doubled motion on the same side."""
    read = [one.read for one in measured]
    places, kinds = zip(*(([f.value for f in one], [f[:2] for f in one]) for one in (read, theory)), strict=True)
    pairs = nearest_alike(*places, *kinds)
    nothing = MeasuredFlip(np.nan, np.nan, Doubling("", False, np.nan))
    rows = [
        (one, theory[pairs[i]] if i in pairs else one.read._replace(value=np.nan)) for i, one in enumerate(measured)
    ]
    rows += [(nothing, one) for j, one in enumerate(theory) if j not in pairs.values()]
    rows.sort(key=lambda row: (row[1].word, np.nanmin([row[0].read.value, row[1].value])))
    m, error = np.array([row[0][:2] for row in rows], float).reshape(-1, 2).T
    r, t = np.array([(row[0].read.value, row[1].value) for row in rows], float).reshape(-1, 2).T
    over = "flip"
    variables = {
        "flip": labelled(
            over, np.array([row[1].word for row in rows], str), "period numbers on the two sides of the flip"
        ),
        "measured_flip": labelled(over, m, "measured flip (NaN: none was seen)", unit),
        "measured_flip_error": labelled(over, error, "standard error of it", unit),
        "measured_flip_read": labelled(
            over, r, "where the record changes its period number; in a rise later than the flip", unit
        ),
        "theory_flip": labelled(over, t, "predicted flip (NaN: none is predicted)", unit),
        "flip_relative_difference": labelled(over, t / m - 1, "predicted over measured flip, minus 1"),
    }
    table = [
        [nearest([f.value for f in one if f[:2] == expected[:2]], expected.value) for _, expected in rows]
        for one in drawn
    ]
    return variables | intervals("theory_flip", over, table, unit, model.level)
