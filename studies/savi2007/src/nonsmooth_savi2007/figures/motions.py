"""Steady motions of the virtual rig beside the model's: one record per setting, portraits in pairs, diagrams."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from nonsmooth import System, plot
from nonsmooth.identification.compare import measured_sections
from nonsmooth.models import discontinuous_support
from nonsmooth.plot import name_plane, prefixed, shade_zone, shared_legend
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, two_rows
from nonsmooth_savi2007.figures.portraits import QUANTITIES, titles
from nonsmooth_savi2007.laboratory import Laboratory, as_result
from nonsmooth_savi2007.measure import period_word, period_words

#: The two sides of a sheet, the model above the rig.
SIDES = {"theory": "model, identified", "measured": "virtual rig (synthetic)"}
GRID = 384  # samples of an orbit in each forcing period: enough for the eye within a contact

#: Measured motions and the settings that belong to them, by key.
Motions: TypeAlias = "dict[str, tuple[xr.Dataset, dict[str, Any]]]"


def motions(bench: Laboratory, number: int, values: Sequence[float], **options: Any) -> Motions:
    """Record what stands behind a figure and measure each run: the motion and its settings by ``<value>``.

    The runs follow the values, in turn; where they are gone through again, from other starts, the keys are
    ``<value>_2``, ``<value>_3``, ...
    """
    session = bench.record(f"fig{number:02d}", bench.rig.figure(number, **options))
    found = {}
    for i, run in enumerate(bench.with_support(session, "section")):
        again, place = divmod(i, len(values))
        key = f"{values[place]:g}" + (f"_{again + 1}" if again else "")
        found[key] = bench.measured(session, "section", run)
    return found


def compared(bench: Laboratory, found: Motions, **options: Any) -> Datasets:
    """Each motion over the model's."""
    return {key: bench.compare(motion, settings, **options) for key, (motion, settings) in found.items()}


def diagram_of(found: Motions, parameter: str) -> tuple[xr.Dataset, dict[str, Any]]:
    """Section points of motions at several values of a parameter, as ``compare`` takes a diagram; settings."""
    measured, settings = zip(*found.values(), strict=True)
    values = [_value(one, parameter) for one in settings]
    others = {key: value for key, value in settings[0].items() if key != parameter}
    return measured_sections(measured, parameter, values, unit=QUANTITIES[parameter][0]), others


def _value(settings: Mapping[str, Any], name: str) -> float:
    """The value of a setting, which may stand with its uncertainty."""
    return float(np.atleast_1d(settings[name])[0])


def model_at(bench: Laboratory, settings: Mapping[str, Any]) -> System:
    """The model with the parameters identified, at the settings of a measurement."""
    system = discontinuous_support().with_parameters(dict(bench.identified))
    values = {
        name: float(rule(system.values) if callable(rule) else np.atleast_1d(rule)[0])
        for name, rule in settings.items()
    }
    return system.with_parameters(values)


def runs_of(found: Motions, parameter: str) -> xr.Dataset:
    """Of each motion, at rising values of the parameter: its ``setting`` and measured ``value``, ``period_number``,
    ``contact`` (0 or 1); ``run`` is its key."""
    sections, _ = diagram_of(found, parameter)
    values = sections[parameter].values
    keys = sorted(found, key=lambda key: _value(found[key][1], parameter))  # as the sections are, and as stable
    touches = []
    for motion, settings in (found[key] for key in keys):
        # where turning points lie: one outlier is no contact
        reach = np.quantile(motion["u"].sel(state="x").values, 0.999)
        error = np.median(motion["u_error"].sel(state="x").values)
        touches.append(bool(reach > _value(settings, "g") + 3 * error))
    nominal = [float(key.partition("_")[0]) for key in keys]
    runs = xr.Dataset(
        {
            "setting": ("run", nominal, {"long_name": f"{parameter} that was meant"}),
            "value": ("run", values, {"long_name": f"{parameter} as measured"}),
            "period_number": ("run", sections["period_number"].values),
            "contact": ("run", np.array(touches, np.int8)),
        },
        {"run": keys},
    )
    return as_result(runs, f"steady runs over {parameter}")


def without_flips(result: xr.Dataset) -> xr.Dataset:
    """A diagram for a picture of steady runs: a few settings do not tell where a period doubles."""
    return result.isel(flip=slice(0, 0)) if "flip" in result.dims else result


def runs_at(data: Datasets, value: float) -> list[xr.Dataset]:
    """The comparisons of all runs at one value, in the order in which they were recorded."""
    key = f"{value:g}"
    return [result for name, result in data.items() if name == key or name.startswith(f"{key}_")]


def measured_periods_at(data: Datasets, value: float) -> dict[int, int]:
    """The period numbers measured at a value (0: none found), each with how many of the runs here have it."""
    numbers = [int(result["measured_period_number"]) for result in runs_at(data, value)]
    return {number: numbers.count(number) for number in sorted(set(numbers))}


def chosen(data: Datasets, value: float, wanted: int) -> xr.Dataset:
    """The first run with the wanted period number; the first of all where none has it."""
    runs = runs_at(data, value)
    return next((run for run in runs if int(run["measured_period_number"]) == wanted), runs[0])


def said(data: Datasets, shown: Mapping[float, int], unit: str) -> str:
    """Motions of the rig at each value, beside those of the model."""
    words = []
    for value in shown:
        rig = period_words(measured_periods_at(data, value))
        model = sorted({int(n) for run in runs_at(data, value) for n in run["coexisting_period_number"].values})
        words.append(f"{' '.join(prefixed(value, unit))}: {rig} (model: {', '.join(period_word(n) for n in model)})")
    return "; ".join(words)


def draw_pairs(canvas: Canvas, data: Datasets, *, parameter: str, shown: Mapping[float, int]) -> None:
    """Draw the motion at each value (columns): the model above, the rig below, in the same axes."""
    results = [chosen(data, value, wanted) for value, wanted in shown.items()]
    two_rows(
        canvas,
        list(SIDES.values()),
        titles(parameter, shown),
        lambda ax, i, j: _portrait(ax, results[j], list(SIDES)[i]),
    )
    shared_legend(canvas)


def _portrait(ax: Axes, result: xr.Dataset, side: str) -> None:
    """One side's orbit and section points; on the rig's, of motions with a period, the model's points as crosses."""
    color = plot.COLORS["first" if side == "theory" else "section"]
    word = "model" if side == "theory" else "virtual rig"
    closed = "phase" in result.coords
    orbit = result[f"{side}_orbit"].values
    orbit = np.vstack([orbit, orbit[:1]]) if closed else orbit
    ax.plot(*orbit.T, color=color, linewidth=0.7 if closed else 0.35, label=word)
    points = result[f"{side}_section"].values.reshape(-1, 2)
    ax.plot(
        *points.T,
        "o",
        color=plot.COLORS["second"],
        markersize=3.0 if closed else 1.4,
        markeredgewidth=0,
        rasterized=True,
        zorder=5,
        label=None if side == "theory" else "section points",
    )
    n = int(result["theory_period_number"])
    if n and side == "measured":
        expected = result["theory_section"].values.reshape(-1, 2)[:n]
        ax.plot(
            *expected.T,
            "x",
            color=plot.COLORS["first"],
            markersize=7,
            markeredgewidth=1.0,
            linestyle="none",
            zorder=4,
            label="section points of the model",
        )
    shade_zone(ax, float(result["g"]))
    name_plane(ax, result, "x", "v")
