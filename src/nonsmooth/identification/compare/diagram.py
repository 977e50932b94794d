"""Measured sections along a parameter against a predicted bifurcation diagram: the overlay, and where it flips."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.arrays import FloatArray, IntArray
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
from nonsmooth.identification.compare.response import nearest, nearest_alike
from nonsmooth.results.labels import labelled
from nonsmooth.system.system import System

FINE = 201


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
    grid = np.linspace(at.min(), at.max(), FINE) if values is None else np.asarray(values, float)
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
