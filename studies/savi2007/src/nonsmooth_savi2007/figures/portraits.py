"""Sheets of phase portraits: an orbit per parameter value, exact above smoothed; and neighbours on an attractor."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from nonsmooth import System, plot, poincare, simulate, sweep
from nonsmooth.plot import prefixed, shared_legend
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, two_rows
from nonsmooth_savi2007.flows import EXACT, FLOWS, Flow, Settings, starts
from nonsmooth_savi2007.measure import APERIODIC, parameter_of, period_word, periods_reached

#: Units and symbols of what the figures vary.
QUANTITIES = {"g": ("m", "g"), "omega": ("rad/s", r"\omega"), "rho": ("N", r"\rho")}

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
    at = np.flatnonzero(one["period_number"].values == wanted)
    return int(at[0]) if len(at) else 0


def sheet_size(shown: Mapping[float, int]) -> tuple[float, float]:
    """Size of a sheet of two rows with a square for each value."""
    return 1.0, 1.24 / max(len(shown) - 1, 2) + 0.5 / plot.PAGE


def titles(parameter: str, shown: Mapping[float, int]) -> list[str]:
    """``$g = -1.2$ mm``: each setting in the unit of the axes."""
    unit, symbol = QUANTITIES[parameter]
    return ["${} = {}$ {}".format(symbol, *prefixed(value, unit)) for value in shown]


def draw_portraits(canvas: Canvas, data: Datasets, *, parameter: str, shown: Mapping[float, int]) -> None:
    """Draw a portrait for each value (columns) and flow (rows)."""
    rows = list(shown.items())

    def cell(ax: Axes, i: int, j: int) -> None:
        (value, wanted), key = rows[j], FLOWS[i].key
        points = data[key].sel({parameter: value}, method="nearest").isel(start=chosen_start(data[key], value, wanted))
        plot.phase_portrait(data[f"{key}_{value:g}"], ax, section=points if wanted != APERIODIC else None, zone="g")
        if wanted == APERIODIC:
            for line in ax.get_lines():
                line.set(linewidth=0.35)
            plot.section(points, ax, size=3.0)
            ax.get_lines()[-1].set(zorder=4, label="section points")
        for line in ax.get_lines():
            if str(line.get_label()).endswith("band"):
                line.set_label("_")  # 2 eta wide: not to be seen

    two_rows(canvas, [flow.short for flow in FLOWS], titles(parameter, shown), cell)
    shared_legend(canvas)


def describe(data: Datasets, shown: Mapping[float, int]) -> str:
    """Regimes that the starts reached at each value, by the exact flow."""
    survey = data["exact"]
    name = parameter_of(survey)
    words = [
        f"{name} = {' '.join(prefixed(value, QUANTITIES[name][0]))}: {words_of(periods_reached(survey, value))}"
        for value in shown
    ]
    return f"Reached by {survey.sizes['start']} starts (exact): " + "; ".join(words) + "."


def words_of(reached: Mapping[int, int]) -> str:
    """``period 3 (8 starts), period 4 (8 starts)``."""
    return ", ".join(f"{period_word(p)} ({n})" for p, n in reached.items())


PAIRS = 400
RETURNS = 12
APART = {"exact": 1e-9, "smoothed": 1e-6}  # m; above what rounding (exact) or rtol 1e-6 (smoothed) does by itself


def twins(flow: Flow, system: System, attractor: xr.Dataset) -> xr.Dataset:
    """Sections from points of an ``attractor`` (the first half of the starts) and from their twins (the second).

    A twin begins 1e-9 m beside its point in x (1e-6 m for the smoothed switch).
    """
    points = attractor["section"].transpose("iterate", "state").values
    chosen = points[np.linspace(0, len(points) - 1, PAIRS).astype(int)]
    beside = chosen + np.array([APART[flow.key], 0.0])
    options = flow.options if flow is EXACT else {**flow.options, "rtol": 1e-9}
    return poincare(system, start=np.vstack([chosen, beside]).tolist(), n=RETURNS, **options)
