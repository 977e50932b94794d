"""Sheets of phase portraits: one orbit per parameter value, exact above smoothed, with its section points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth import plot, simulate, sweep
from nonsmooth.plot.units import prefixed
from nonsmooth.studies.savi2007.figures.diagrams import shared_legend
from nonsmooth.studies.savi2007.figures.figure import Canvas, Datasets, Draw, drawn, only_outer
from nonsmooth.studies.savi2007.flows import FLOWS, Settings, starts
from nonsmooth.studies.savi2007.measure import APERIODIC, periods_reached

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["chosen_start", "describe", "draw_portraits", "portraits", "setting"]

CHAOTIC_PERIODS = 40  # drawn of an orbit without a period


def portraits(
    settings: Settings, parameters: Mapping[str, float], parameter: str, shown: Mapping[float, int], others: tuple = ()
) -> Datasets:
    """Survey each value from several starts, then record one orbit of the regime in ``shown`` (value -> period).

    ``<flow>`` holds the survey (a ``sweep`` from the starts, ``others`` surveyed too), ``<flow>_<value>`` the orbit.
    """
    data: Datasets = {}
    for flow in FLOWS:
        transient = settings.of(flow, exact=1000, smoothed=1000, quick=150)
        first = starts(settings.of(flow, exact=16, smoothed=16, quick=8))
        system = flow.system(**parameters)
        survey = sweep(
            system, parameter, sorted({*shown, *others}), direction=None, start=first, transient=transient, keep=64,
            progress=settings.progress, **flow.options,
        )  # fmt: skip
        data[flow.key] = survey
        for value, wanted in shown.items():
            periods = 2 * wanted if wanted != APERIODIC else CHAOTIC_PERIODS
            data[f"{flow.key}_{value:g}"] = simulate(
                system.with_parameters({parameter: value}), start=first[chosen_start(survey, value, wanted)],
                transient=transient, periods=periods, **flow.options,
            )  # fmt: skip
    return data


def chosen_start(survey: xr.Dataset, value: float, wanted: int) -> int:
    """The first start that ends in the wanted regime; the first of all where none does."""
    one = survey.sel({_parameter(survey): value}, method="nearest")
    at = np.flatnonzero(one["period_number"].values == wanted)
    return int(at[0]) if len(at) else 0


def draw_portraits(
    parameter: str, unit: str, symbol: str, shown: Mapping[float, int]
) -> Draw:
    """The sheet: columns are values, rows are flows."""

    @drawn(1.0, 1.24 / max(len(shown) - 1, 2) + 0.5 / plot.PAGE)
    def draw(canvas: Canvas, data: Datasets) -> None:
        grid = canvas.subplots(2, len(shown), sharex="col", sharey=True, squeeze=False)
        for row, flow in zip(grid, FLOWS, strict=True):
            for i, (ax, (value, wanted)) in enumerate(zip(row, shown.items(), strict=True)):
                orbit, survey = data[f"{flow.key}_{value:g}"], data[flow.key]
                points = survey.sel({parameter: value}, method="nearest").isel(
                    start=chosen_start(survey, value, wanted)
                )
                plot.phase_portrait(orbit, ax, section=points if wanted != APERIODIC else None, zone="g")
                if wanted == APERIODIC:
                    for line in ax.get_lines():
                        line.set(linewidth=0.35)
                    plot.section(points, ax, size=3.0)
                    ax.get_lines()[-1].set(zorder=4, label="section points")
                for line in ax.get_lines():
                    if str(line.get_label()).endswith("band"):
                        line.set_label("_")  # 2 eta wide: not to be seen
                ax.set_ylabel(f"{flow.short}\n{ax.get_ylabel()}")
                if flow is FLOWS[0]:
                    ax.set_title(f"({'abcd'[i]}) {setting(symbol, value, unit)}", y=1.0, pad=9)
        only_outer(grid)
        shared_legend(canvas)

    return draw


def setting(symbol: str, value: float, unit: str) -> str:
    """``$g = -1.2$ mm``: a setting in the unit of the axes."""
    number, prefix = prefixed(value, unit)
    return f"${symbol} = {number}$ {prefix}"


def describe(data: Datasets, shown: Mapping[float, int]) -> str:
    """Regimes that the starts reached at each value, by the exact flow."""
    survey = data["exact"]
    name = _parameter(survey)
    unit = str(survey[name].attrs["units"])
    words = [
        f"{name} = {' '.join(prefixed(value, unit))}: {words_of(periods_reached(survey, value))}" for value in shown
    ]
    return f"Reached by {survey.sizes['start']} starts (exact): " + "; ".join(words) + "."


def words_of(reached: Mapping[int, int]) -> str:
    """``period 3 (8 starts), period 4 (8 starts)``."""
    names = {APERIODIC: "no period", -1: "unsettled"}
    return ", ".join(f"{names.get(p, f'period {p}')} ({n})" for p, n in reached.items())


def _parameter(survey: xr.Dataset) -> str:
    return str(survey["maximum"].dims[0])
