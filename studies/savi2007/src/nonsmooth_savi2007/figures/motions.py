"""Steady motions of the virtual rig, one record per setting; Figs. 12, 14 and 18 on the rig: beside the model's.

Figures 15 and 16: the strange attractor at g = 0.0018 m, sections at four phases: by the model, and from the rig.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache, partial
from typing import Any, TypeAlias

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from nonsmooth import Stroboscopic, lyapunov, plot, poincare
from nonsmooth.identification.compare import measured_sections
from nonsmooth.plot import comparison_phase_portrait, name_plane, prefixed, shade_zone, shared_legend
from nonsmooth_savi2007.figures.diagrams import PATIENCE
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure, only_outer, two_rows
from nonsmooth_savi2007.figures.portraits import EXPONENT_PERIODS, QUANTITIES, SHEETS
from nonsmooth_savi2007.flows import FLOWS, Settings
from nonsmooth_savi2007.laboratory import Laboratory, as_result
from nonsmooth_savi2007.measure import period_word, period_words
from nonsmooth_savi2007.printed import FIGURE_13
from nonsmooth_savi2007.rig.figures import SECTIONS

#: The two sides of a sheet, the model above the rig.
SIDES = {"theory": "model, identified", "measured": "virtual rig (synthetic)"}
_GRID = 384  # samples of an orbit in each forcing period: enough for the eye within a contact

#: Of the figures with steady records: what is varied, and the turns of a record in a quick and in a whole run.
_RECORDED = {
    12: ("rho", 60, 200),
    14: ("g", 60, 100),
    16: ("g", 300, 1500),
    17: ("omega", 40, 60),
    18: ("omega", 60, 200),
}

#: Measured motions and the settings that belong to them, by key.
MeasuredMotions: TypeAlias = "dict[str, tuple[xr.Dataset, dict[str, Any]]]"


@lru_cache(maxsize=8)
def motions(bench: Laboratory, number: int) -> MeasuredMotions:
    """Record what stands behind a figure and measure each run: the motion and its settings by ``<value>``.

    The runs follow the values, in turn; where they are gone through again, from other starts, the keys are
    ``<value>_2``, ``<value>_3``, ... Measured once: Figs. 13 and 14 share their records.
    """
    parameter, quick, whole = _RECORDED[number]
    place = ("omega", "rho", "g").index(parameter)
    values = [f"{setting[place]:g}" for setting in SECTIONS[number]]
    made = bench.rig.figure(number, periods=quick if bench.quick else whole)
    session, found = bench.record(f"fig{number:02d}", made), {}
    for i, item in enumerate(session.recordings("section")):
        again, at = divmod(i, len(values))
        found[values[at] + (f"_{again + 1}" if again else "")] = bench.measured(session, "section", item.run)
    return found


def diagram_of(found: MeasuredMotions, parameter: str) -> tuple[xr.Dataset, dict[str, Any]]:
    """Section points of motions at several values of a parameter, as ``compare`` takes a diagram; settings."""
    measured, settings = zip(*found.values(), strict=True)
    values = [_value(one, parameter) for one in settings]
    others = {key: value for key, value in settings[0].items() if key != parameter}
    return measured_sections(measured, parameter, values, unit=QUANTITIES[parameter][0]), others


def _value(settings: Mapping[str, Any], name: str) -> float:
    """The value of a setting, which may stand with its uncertainty."""
    return np.atleast_1d(settings[name])[0]


def runs_of(found: MeasuredMotions, parameter: str) -> xr.Dataset:
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
        touches.append(reach > _value(settings, "g") + 3 * error)
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
        model = sorted({n for run in runs_at(data, value) for n in run["coexisting_period_number"].values})
        words.append(f"{' '.join(prefixed(value, unit))}: {rig} (model: {', '.join(period_word(n) for n in model)})")
    return "; ".join(words)


def _compared(settings: Settings, number: int) -> Datasets:
    """Each motion over the model's."""
    options: dict[str, Any] = {"transient": 600 if settings.quick else PATIENCE} if number == 18 else {}
    found = motions(settings.bench, number)
    if number == 14:  # at each gap the first record of each period number that its starts lead to
        runs = runs_of(found, "g")
        first = dict[tuple[float, int], str]()
        names = ("run", "setting", "period_number")
        for key, setting, period in zip(*(runs[name].values.tolist() for name in names), strict=True):
            first.setdefault((setting, period), key)
        found = {key: found[key] for key in first.values()}
    return {key: settings.bench.compare(*one, grid=_GRID, **options) for key, one in found.items()}


def _draw_pairs(canvas: Canvas, data: Datasets, number: int) -> None:
    """Draw the motion at each value (columns): the model above, the rig below, in the same axes."""
    sheet, sides = SHEETS[number], list(SIDES)
    results = [chosen(data, value, wanted) for value, wanted in sheet.shown.items()]
    two_rows(canvas, list(SIDES.values()), sheet.titles, lambda ax, i, j: _portrait(ax, results[j], sides[i]))
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


def _draw_18(canvas: Canvas, data: Datasets, number: int) -> None:
    grid = canvas.subplots(1, 3, sharey=True)
    for ax, letter, (omega, wanted) in zip(grid, "abc", SHEETS[number].shown.items(), strict=True):
        comparison_phase_portrait(chosen(data, omega, wanted), ax, zone="g")
        ax.set_title(rf"({letter}) $\omega = {omega:g}$ rad/s", loc="left")
    grid[0].autoscale(axis="y")  # no room for legends of their own
    only_outer(grid)
    shared_legend(canvas)


def _figure(
    number: int,
    about: str,
    draw: Callable[..., None] = _draw_pairs,
    size: tuple[float, float] | None = None,
) -> Figure:
    sheet = SHEETS[number]
    unit = QUANTITIES[sheet.parameter][0]
    return Figure(
        f"fig{number}_rig",
        number,
        f"State space over the {sheet.varied}",
        partial(_compared, number=number),
        partial(draw, number=number),
        lambda data: f"State space {about} Rig: {said(data, sheet.shown, unit)}.",
        size or sheet.size,
        rig=True,
    )


PHASES = {"0": 0.0, "quarter": 0.25, "half": 0.5, "three_quarters": 0.75}  # of a forcing period
_ANGLES = ("0", r"\pi/2", r"\pi", r"3\pi/2")
_ABOUT = "Strange attractor at g = 1.8 mm, omega = 11.15 rad/s, rho = 0.33 N: sections at four phases of the forcing"


def _draw(canvas: Canvas, rows: Iterable[str], cell: Callable[[Axes, int, int], object]) -> None:
    """A row of sections at the four phases for each of ``rows``."""
    two_rows(canvas, list(rows), [f"phase ${angle}$" for angle in _ANGLES], cell, sharey="col")


def _compute(settings: Settings) -> Datasets:
    data = {}
    for flow in FLOWS:
        system = flow.system(g=0.0018, **FIGURE_13)
        n = settings.of(flow, exact=20_000, smoothed=20_000, quick=2_000)
        for key, phase in PHASES.items():
            data[f"{flow.key}_{key}"] = poincare(
                system, section=Stroboscopic(phase), n=n, transient=300, **flow.options
            )
        data[f"{flow.key}_exponents"] = lyapunov(system, periods=EXPONENT_PERIODS, progress=False, **flow.options)
    return data


def _draw_model(canvas: Canvas, data: Datasets) -> None:
    keys = list(PHASES)
    _draw(
        canvas,
        (flow.short for flow in FLOWS),
        lambda ax, i, j: plot.section(data[f"{FLOWS[i].key}_{keys[j]}"], ax, size=0.7),
    )


def _caption(data: Datasets) -> str:
    sizes = " and ".join(f"{data[f'{flow.key}_0'].sizes['iterate']} ({flow.key})" for flow in FLOWS)
    return f"{_ABOUT}, {sizes} points each, from rest. Both rows have the same axes."


def _measure(settings: Settings) -> Datasets:
    ((measured, set_),) = motions(settings.bench, 16).values()
    return {"attractor": settings.bench.compare(measured, set_, section_phase=list(PHASES.values()))}


def _draw_rig(canvas: Canvas, data: Datasets) -> None:
    result = data["attractor"]

    def cell(ax: Axes, i: int, j: int) -> None:
        points = result[f"{list(SIDES)[i]}_section"].isel(section_phase=j).values
        color = plot.COLORS[("first", "section")[i]]
        ax.plot(*points.T, ".", color=color, markersize=1.4, markeredgewidth=0, rasterized=True)
        plot.name_plane(ax, result, "x", "v")

    _draw(canvas, SIDES.values(), cell)


def _caption_rig(data: Datasets) -> str:
    result = data["attractor"]
    far, halves = result["energy_distance_matched"].values, result["measured_halves_p95"].values
    words = ", ".join(f"{a:.3f} ({a / b:.2f})" for a, b in zip(far, halves, strict=True))
    return (
        f"{_ABOUT} by the model with the parameters identified (above) and from one record of the virtual rig "
        f"(synthetic, below, {result.sizes['measured_iterate']} turns). Energy distances of the two clouds at the four "
        f"phases, and over the 95th percentile of those of the record's own halves: {words}."
    )


_TITLE, _SIZE = "Strange attractor at four section phases", (1.0, 0.56)
_ATTRACTORS = (
    Figure("fig15", 15, _TITLE, _compute, _draw_model, _caption, _SIZE),
    Figure("fig16", 16, _TITLE, _measure, _draw_rig, _caption_rig, _SIZE, rig=True),
)
FIGURES = (
    _figure(
        12,
        "with section points at four amplitudes of Fig. 11, the model with the parameters identified (above) and the "
        "virtual rig (synthetic, below); crosses: the model's section points; contact zone shaded.",
    ),
    _figure(
        14,
        "at the gaps of the paper's caption, the model with the parameters identified (above) and the virtual rig "
        "(synthetic, below); crosses are the model's section points, the contact zone is shaded. Where starts lead to "
        "several motions, that of the paper is drawn.",
    ),
    _figure(
        18,
        "at three frequencies of Fig. 17: the virtual rig (synthetic, dashed, section points black) over the model "
        "with the parameters identified; the contact zone is shaded.",
        _draw_18,
        (1.0, 0.44),
    ),
    *_ATTRACTORS,
)
