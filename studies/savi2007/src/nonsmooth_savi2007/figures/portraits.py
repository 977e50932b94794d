"""Figures 12, 14 and 18: phase portraits, an orbit per value, exact above smoothed; how neighbours separate."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from nonsmooth import lyapunov, plot, simulate, sweep
from nonsmooth.plot import prefixed, shared_legend
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure, two_rows
from nonsmooth_savi2007.flows import FLOWS, Settings, starts
from nonsmooth_savi2007.measure import APERIODIC, parameter_of, period_word, periods_reached
from nonsmooth_savi2007.printed import (
    FIGURE_11,
    FIGURE_12,
    FIGURE_13,
    FIGURE_14,
    FIGURE_14_TEXT,
    FIGURE_17,
    FIGURE_18,
)

#: Units and symbols of what the figures vary.
QUANTITIES = {"g": ("m", "g"), "omega": ("rad/s", r"\omega"), "rho": ("N", r"\rho")}

CHAOTIC_PERIODS = 40  # drawn of an orbit without a period


class PortraitSheet(NamedTuple):
    """Portraits of a figure: what is varied, the period number ``shown`` at each value, ``others`` surveyed too."""

    parameter: str
    varied: str
    shown: Mapping[float, int]
    parameters: Mapping[str, float]
    others: tuple[float, ...] = ()

    @property
    def titles(self) -> list[str]:
        """``$g = -1.2$ mm``: each setting in the unit of the axes."""
        unit, symbol = QUANTITIES[self.parameter]
        return ["${} = {}$ {}".format(symbol, *prefixed(value, unit)) for value in self.shown]

    @property
    def size(self) -> tuple[float, float]:
        """Size of two rows with a square for each value."""
        return 1.0, 1.24 / max(len(self.shown) - 1, 2) + 0.5 / plot.PAGE


SHEETS = {
    12: PortraitSheet("rho", "forcing amplitude", FIGURE_12, FIGURE_11),
    14: PortraitSheet("g", "gap", FIGURE_14, FIGURE_13, tuple(FIGURE_14_TEXT)),
    18: PortraitSheet("omega", "forcing frequency", FIGURE_18, FIGURE_17),
}


def _compute(settings: Settings, number: int) -> Datasets:
    """Survey each value from several starts, then record one orbit of the regime that is shown.

    ``<flow>`` holds the survey (a ``sweep`` from the starts), ``<flow>_<value>`` the orbit.
    """
    (parameter, _, shown, parameters, others), data = SHEETS[number], dict[str, xr.Dataset]()
    for flow in FLOWS:
        transient = settings.of(flow, exact=1000, smoothed=1000, quick=150)
        first = starts(settings.of(flow, exact=16, smoothed=16, quick=8))
        system = flow.system(**parameters)
        survey = sweep(
            system,
            parameter,
            sorted({*shown, *others}),
            direction=None,
            start=first,
            transient=transient,
            keep=64,
            progress=settings.progress,
            **flow.options,
        )
        data[flow.key] = survey
        for value, wanted in shown.items():
            periods = 2 * wanted if wanted != APERIODIC else CHAOTIC_PERIODS
            data[f"{flow.key}_{value:g}"] = simulate(
                system.with_parameters({parameter: value}),
                start=first[chosen_start(survey, value, wanted)],
                transient=transient,
                periods=periods,
                **flow.options,
            )
    return data


def chosen_start(survey: xr.Dataset, value: float, wanted: int) -> int:
    """The first start that ends in the wanted regime; the first of all where none does."""
    one = survey.sel({parameter_of(survey): value}, method="nearest")
    return int(np.argmax(one["period_number"].values == wanted))


def chosen_points(survey: xr.Dataset, value: float, wanted: int) -> xr.Dataset:
    """The part of a survey that belongs to that start."""
    one = survey.sel({parameter_of(survey): value}, method="nearest")
    return one.isel(start=chosen_start(survey, value, wanted))


def _draw(canvas: Canvas, data: Datasets, number: int) -> None:
    """Draw a portrait for each value (columns) and flow (rows)."""
    sheet = SHEETS[number]
    rows = list(sheet.shown.items())

    def cell(ax: Axes, i: int, j: int) -> None:
        (value, wanted), key = rows[j], FLOWS[i].key
        points = chosen_points(data[key], value, wanted)
        plot.phase_portrait(data[f"{key}_{value:g}"], ax, section=points if wanted != APERIODIC else None, zone="g")
        if wanted == APERIODIC:
            for line in ax.get_lines():
                line.set(linewidth=0.35)
            plot.section(points, ax, size=3.0)
            ax.get_lines()[-1].set(zorder=4, label="section points")
        for line in ax.get_lines():
            if str(line.get_label()).endswith("band"):
                line.set_label("_")  # 2 eta wide: not to be seen

    two_rows(canvas, [flow.short for flow in FLOWS], sheet.titles, cell)
    shared_legend(canvas)


def _caption(data: Datasets, number: int, about: str) -> str:
    """``about`` the figure, then the regimes that the starts reached at each value, by the exact flow."""
    survey, name = data["exact"], SHEETS[number].parameter
    words = [
        f"{name} = {' '.join(prefixed(value, QUANTITIES[name][0]))}: {words_of(periods_reached(survey, value))}"
        for value in SHEETS[number].shown
    ]
    return f"{about} Reached by {survey.sizes['start']} starts (exact): {'; '.join(words)}."


def words_of(reached: Mapping[int, int]) -> str:
    """``period 3 (8 starts), period 4 (8 starts)``."""
    return ", ".join(f"{period_word(p)} ({n})" for p, n in reached.items())


EXPONENT_PERIODS = 5000  # over which exponents are averaged
_CHAOTIC = 9.55


def _compute_18(settings: Settings, number: int) -> Datasets:
    """The portraits, and the exponents of the chaotic orbit."""
    data = _compute(settings, number)
    for flow in FLOWS:
        survey = data[flow.key]
        begin = starts(survey.sizes["start"])[chosen_start(survey, _CHAOTIC, APERIODIC)]
        system = flow.system(omega=_CHAOTIC, **FIGURE_17)
        data[f"{flow.key}_exponents"] = lyapunov(
            system, start=begin, periods=EXPONENT_PERIODS, progress=False, **flow.options
        )
    return data


_COEXIST = (
    "section points black, contact zone shaded. Where motions coexist, the first start that ends in the paper's is "
    "drawn."
)
FIGURES = tuple(
    Figure(
        f"fig{number}",
        number,
        f"Phase portraits over the {SHEETS[number].varied}",
        partial(compute, number=number),
        partial(_draw, number=number),
        partial(_caption, number=number, about=f"Phase portraits {about}"),
        SHEETS[number].size,
    )
    for number, compute, about in (
        (
            12,
            _compute,
            "with section points (black) at four amplitudes of Fig. 11; contact zone x > g shaded, orbit in contact in "
            "vermilion.",
        ),
        (14, _compute, f"at the gaps of the paper's caption; {_COEXIST}"),
        (18, _compute_18, f"at three frequencies of Fig. 17; {_COEXIST}"),
    )
)
