"""Measured sections along a parameter against a predicted bifurcation diagram: the overlay, and where it flips."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Event
from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.arrays import FloatArray, IntArray
from nonsmooth.attractors.settled import usable
from nonsmooth.diagrams.sweep_pieces import Slot
from nonsmooth.identification.compare.draws import Model, intervals
from nonsmooth.identification.compare.periods import MeasuredFlip, delayed_flips, flips, measured_period, period_numbers
from nonsmooth.identification.compare.predict import Motions
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
    at, points, numbers = _measured(measured, name, model)
    unit = measured[name].attrs.get("units", "1")
    grid = np.linspace(at.min(), at.max(), FINE) if values is None else np.asarray(values, float)
    words = ["up", "down"] if direction == "both" else [direction]

    def diagram(system: System) -> tuple[FloatArray, IntArray]:
        return _marched(system, model, name, grid, words, phase)

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
    drawn_flips: list[dict[str, float]] = []
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
    if name in measured["section"].dims:  # steady runs: a flip lies between two of them
        seen = {word: MeasuredFlip(place, np.nan, place) for word, place in flips(at, numbers).items()}
    else:
        seen = delayed_flips(at, points, model.noise, numbers)
        variables["rise_per_return"] = labelled(
            (), (at[-1] - at[0]) / (len(at) - 1), f"rise of {name} per return", unit
        )
    return variables | _flips(seen, flips(grid, periods[0]), drawn_flips, unit, model)


def _marched(
    system: System, model: Model, name: str, grid: FloatArray, words: Sequence[str], phase: float
) -> tuple[FloatArray, IntArray]:
    """The diagram, the state carried along; settings that follow from the parameter change with it."""
    rules = {key: setting for key, setting in model.settings.items() if setting.follows and key != name}
    # A drawn system is off its rule by an error that stays the same along the diagram.
    beside = {key: system.values[key] - rule.at(system.values) for key, rule in rules.items()}
    systems = []
    for value in grid:
        here = {**system.values, name: float(value)}
        systems.append(system.with_parameters(here | {k: rule.at(here) + beside[k] for k, rule in rules.items()}))
    motions, rising = Motions(systems, model, phase), np.argsort(grid, kind="stable").tolist()
    tables, rest = motions.settler.engine.prepare(motions.points), np.zeros(len(system.states))
    slots = [Slot(motions.settler, motions.points, None, ()) for _ in words]
    for word, slot in zip(words, slots, strict=True):
        slot.march(tables, rising if word == "up" else rising[::-1], rest, True, lambda _: None, Event())
        slot.kept.section[~usable(slot.status)] = np.nan
    return np.stack([slot.kept.section[..., model.places] for slot in slots]), np.stack(
        [slot.period_number for slot in slots]
    )


def _measured(measured: xr.Dataset, name: str, model: Model) -> tuple[FloatArray, FloatArray, IntArray]:
    """Values, points and period numbers, one row for each point: steady runs, or one slow rise."""
    section = measured["section"]
    if name in section.dims:
        stacked = section.transpose(name, "iterate", "state").values
        numbers = [measured_period(one, model.noise, max_period=model.max_period).number for one in stacked]
        good = np.isfinite(stacked).all(axis=2)
        at, found = (np.repeat(one, good.sum(axis=1)) for one in (measured[name].values.astype(float), numbers))
        return at, stacked[good], found
    points, at = section.transpose("iterate", "state").values, measured[name].values
    if at.shape != points.shape[:1]:
        raise ValueError(f"{name} must be given for each of the {len(points)} section points; got {at.shape}")
    good = np.isfinite(points).all(axis=1)
    return at[good], points[good], period_numbers(points[good], model.noise, max_period=min(model.max_period, 8))


def _flips(
    measured: dict[str, MeasuredFlip], theory: dict[str, float], drawn: list[dict[str, float]], unit: str, model: Model
) -> dict[str, Any]:
    words = sorted({*measured, *theory})
    nothing = MeasuredFlip(np.nan, np.nan, np.nan)
    m, error, read = np.array([measured.get(word, nothing) for word in words], float).reshape(-1, 3).T
    t = np.array([theory.get(word, np.nan) for word in words], float)
    over = "flip"
    variables = {
        "flip": labelled(over, np.array(words, str), "period numbers on the two sides of the flip"),
        "measured_flip": labelled(over, m, "measured flip (NaN: none was seen)", unit),
        "measured_flip_error": labelled(over, error, "standard error of it", unit),
        "measured_flip_read": labelled(
            over, read, "where the record changes its period number; in a rise later than the flip", unit
        ),
        "theory_flip": labelled(over, t, "predicted flip (NaN: none is predicted)", unit),
        "flip_relative_difference": labelled(over, t / m - 1, "predicted over measured flip, minus 1"),
    }
    table = [[one.get(word, np.nan) for word in words] for one in drawn]
    return variables | intervals("theory_flip", over, table, unit, model.level)
