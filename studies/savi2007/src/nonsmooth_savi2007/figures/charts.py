"""Basins beside Figs. 13 and 17, where two attractors coexist; charts over two parameters.

The charts have a million points each, are made by ``make reproduce-full`` only, and are resumable: period numbers over
(omega, rho) at the gap of Fig. 9 and over (g, rho) at the frequency of Fig. 13, from rest, with the curves of folds,
flips and grazing that pass through the special points of these figures.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nonsmooth import SolveError, basins, chart, continue_curve, continue_orbit, find_orbit, plot, simulate
from nonsmooth.plot import prefixed, shade_zone
from nonsmooth_savi2007.figures.branches import VARIED, branches, branches_of, rows_of
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure
from nonsmooth_savi2007.flows import EXACT, Settings
from nonsmooth_savi2007.measure import period_word, status_names
from nonsmooth_savi2007.printed import FIGURE_9, FIGURE_13, FIGURE_17

_FULL, _QUICK = 1000, 24  # points along each parameter
_FOLLOWED = ("fold", "flip", "neimark_sacker", "grazing")


class Plane(NamedTuple):
    """A chart: the figure whose branches its curves begin on, its parameters and the ranges of the two others.

    ``further``: periods and values of the figure's parameter at which further branches begin, from rest.
    """

    figure: str
    parameters: Mapping[str, float]
    ranges: Mapping[str, tuple[float, float]]
    further: Mapping[int, float]


CHARTS = {
    "chart09": Plane("fig09", {"g": FIGURE_9["g"]}, {"omega": (3.0, 7.0), "rho": (0.1, 0.3)}, {}),
    "chart13": Plane(
        "fig13", {"omega": FIGURE_13["omega"]}, {"g": (-0.0015, 0.002), "rho": (0.2, 0.5)}, {3: 0.0014, 6: 0.0002}
    ),
}


def grid_of(plane: Plane, n: int) -> dict[str, np.ndarray]:
    """n values of each of the two parameters."""
    return {name: np.linspace(*ends, n) for name, ends in plane.ranges.items()}


def _compute(settings: Settings, name: str) -> Datasets:
    plane = CHARTS[name]
    store = None if settings.folder is None else settings.folder / f"{name}_store.zarr"
    found = chart(
        EXACT.system(**plane.parameters),
        grid_of(plane, _QUICK if settings.quick else _FULL),
        extremes=False,
        store=store,
        progress=settings.progress,
        **EXACT.options,
    )
    return {"chart": found} | {f"curve_{k}": one for k, one in enumerate(curves(plane))}


def curves(plane: Plane) -> list[xr.Dataset]:
    """Curves through the folds, flips and grazing points of the figure's branches, each curve once."""
    found: list[xr.Dataset] = []
    begin = VARIED[plane.figure]
    lines = branches_of(branches(plane.figure))
    for period, value in plane.further.items():
        system = EXACT.system(**{**begin.parameters, begin.parameter: value})
        orbit = find_orbit(system, period_number=period, progress=False)
        lines.append(continue_orbit(orbit, begin.parameter, begin.range))
    for branch in lines:
        table = rows_of(branch)
        for i in range(table.sizes["special"]):
            row = table.isel(special=i)
            if str(row["kind"].values) not in _FOLLOWED or any(_on(one, row, begin.parameter) for one in found):
                continue
            try:
                found.append(continue_curve(row, plane.ranges))
            except SolveError:  # a point where two boundaries meet begins no curve
                continue
    return found


def _on(curve: xr.Dataset, row: xr.Dataset, parameter: str) -> bool:
    """Return whether a special point lies on a known curve: of its kind and period, and through its two values."""
    if any(curve[name].values != row[name].values for name in ("kind", "period_number")):
        return False
    names = [str(name) for name, values in curve.coords.items() if values.dims == ("point",)]
    other = next(name for name in names if name != parameter)
    along, across = curve[other].values, curve[parameter].values
    level, value = float(row[other]), float(row[parameter])
    for k in np.flatnonzero((along[:-1] - level) * (along[1:] - level) <= 0):
        part = (level - along[k]) / (along[k + 1] - along[k] or 1.0)
        if abs(across[k] + part * (across[k + 1] - across[k]) - value) < 1e-3 * np.ptp(across):
            return True
    return False


def _draw(canvas: Canvas, data: Datasets) -> None:
    found = data["chart"]
    left, right = canvas.subplots(1, 2, sharey=True)
    simple = "omega" in found.dims  # few periods; what tells regions apart there is whether there is contact
    xlim, ylim = (found[str(name)].values[[0, -1]] for name in found["status"].dims)
    plot.chart(found, left, show="contacts_per_period" if simple else "period_number")
    plot.chart(found, right)
    for key, one in data.items():
        if key.startswith("curve"):
            plot.curve(one, right, special=False)
    if not simple:
        left.get_legend().remove()
    right.set_ylabel("")
    titles = ("(a) contacts per period" if simple else "(a) period", "(b) period, with folds, flips and grazing")
    for ax, words in zip((left, right), titles, strict=True):
        ax.set_title(words, y=1.0, pad=9)
        ax.set(xlim=xlim, ylim=ylim)


def _caption(data: Datasets) -> str:
    found = data["chart"]
    first, second = (str(dim) for dim in found["status"].dims)
    names, counts = np.unique(status_names(found), return_counts=True)
    ended = ", ".join(f"{name} {count}" for name, count in zip(names, counts, strict=True))
    kinds = [str(one["kind"].values) for key, one in data.items() if key.startswith("curve")]
    counted = ", ".join(f"{kinds.count(kind)} of {kind.replace('_', '-')}" for kind in _FOLLOWED if kind in kinds)
    fixed, shown, rays = "g", "Contacts per forcing period and period number", ""
    if "g" in found.dims:
        fixed, shown = "omega", "Period number"
        rays = " The system is piecewise linear, so all depends on g / rho alone: every boundary is a straight line."
    return (
        f"{shown} over {first} and {second} at {fixed} = {float(found[fixed]):g} {found[fixed].attrs['units']}, "
        f"{found.sizes[first]} x {found.sizes[second]} points from rest (exact flow). Statuses: {ended}. Curves: "
        f"{counted}, through the special points of the branches (continue_curve); where they do not bound a region, "
        f"the motion that changes there is not the one met from rest.{rays}"
    )


#: Parameters of each picture.
BASINS = {"basins13": {**FIGURE_13, "g": 0.0014}, "basins17": {**FIGURE_17, "omega": 9.55}}
_PLANE = {"x": (-0.02, 0.02), "v": (-0.2, 0.2)}
_POINTS, _FULL, _QUICK = 160, 500, 40  # along each side
_WANDERING = 60  # periods drawn of an attractor that is no cycle
_LOOKS = ("marker", "markersize", "markerfacecolor", "markeredgecolor", "markeredgewidth", "rasterized", "zorder")


def _compute_basins(settings: Settings, name: str) -> Datasets:
    n = _QUICK if settings.quick else _FULL if settings.full else _POINTS
    system = EXACT.system(**BASINS[name])
    found = basins(
        system,
        {state: np.linspace(*ends, n) for state, ends in _PLANE.items()},
        progress=settings.progress,
        **EXACT.options,
    )
    data = {"basins": found}
    for k in range(found.sizes["attractor"]):
        periods = int(found["period_number"][k]) or _WANDERING
        start = found["section_points"].values[found["point_attractor"].values == k][0]
        data[f"orbit_{k}"] = simulate(system, start=start, periods=periods, **EXACT.options)
    return data


def kinds_of(found: xr.Dataset) -> list[str]:
    """Each attractor by what it is."""
    rows = zip(found["period_number"].values.tolist(), found["chaotic"].values.tolist(), strict=True)
    return ["chaos" if chaotic else period_word(number) for number, chaotic in rows]


def names_of(found: xr.Dataset) -> list[str]:
    """``period 3, 67.30 ± 0.29 %`` of each attractor: what it is, its share with the binomial error."""
    rows = zip(kinds_of(found), found["fraction"].values, found["fraction_error"].values, strict=True)
    return [f"{kind}, {100 * share:.2f} ± {100 * error:.2f} %" for kind, share, error in rows]


def _draw_basins(canvas: Canvas, data: Datasets) -> None:
    found = data["basins"]
    left, right = canvas.subplots(1, 2)
    plot.basins(found, left)
    left.get_legend().remove()
    marks, cells = left.get_lines(), left.collections[0]
    left.set_title("(a) basins, section at phase 0", y=1.0, pad=9)
    handles: list[Any] = []
    for k in range(found.sizes["attractor"]):
        cycle = int(found["period_number"][k]) > 0
        begun = len(right.get_lines())
        plot.phase_portrait(data[f"orbit_{k}"], right)
        for line in right.get_lines()[begun:]:
            line.set(color=cells.to_rgba(k), linewidth=1.1 if cycle else 0.3, zorder=3 if cycle else 2)
        looks = {name: getattr(marks[k], f"get_{name}")() for name in _LOOKS}
        right.plot(*marks[k].get_data(), linestyle="", **looks)
        sign = Line2D([], [], linestyle="", **{**looks, "markersize": 3.6 if cycle else 2.4})
        handles.append((Patch(facecolor=cells.to_rgba(k), edgecolor="black", linewidth=0.4), sign))
    limits = right.get_xlim()
    shade_zone(right, float(found["g"]))
    right.set_xlim(limits)
    right.set_title("(b) attractors", y=1.0, pad=9)
    zone = Patch(facecolor=plot.COLORS["zone"], alpha=0.18, linewidth=0)
    canvas.legend(
        [*handles, zone],
        [*names_of(found), "contact zone"],
        loc="outside lower center",
        ncols=4,
        handler_map={tuple: HandlerTuple(ndivide=1)},
        title="attractors with their section points, and basins",
    )


def _caption_basins(data: Datasets) -> str:
    found = data["basins"]
    lost = (found["label"].values < 0).sum()
    at = ", ".join(
        f"{name} = {' '.join(prefixed(float(found[name]), found[name].attrs['units']))}"
        for name in ("omega", "rho", "g")
    )
    first, second = (str(dim) for dim in found["label"].dims)
    return (
        f"Basins at {at}, from {found.sizes[first]} x {found.sizes[second]} starts at phase 0 (exact flow). The share "
        f"of each attractor of this plane, with its binomial standard error: {'; '.join(names_of(found))}. "
        f"{lost or 'No'} start{'' if lost == 1 else 's'} reached none. Least jump of the state from a section point "
        "into another basin: "
        + ", ".join(
            f"{kind} {float(value):.2g}"
            for kind, value in zip(kinds_of(found), found["minimal_shock"].values, strict=True)
        )
        + " (in units of 1 mm and 10 mm/s). Dimension of the boundary by box counting: "
        + f"{float(found['boundary_dimension']):.3f}; basin entropy {float(found['entropy']):.3f}."
    )


_BASINS = tuple(
    Figure(
        name,
        None,
        f"Basins at {words}",
        partial(_compute_basins, name=name),
        _draw_basins,
        _caption_basins,
        beside=beside,
    )
    for name, words, beside in (
        ("basins13", "g = 1.4 mm", 13),
        ("basins17", "omega = 9.55 rad/s", 17),
    )
)
FIGURES = _BASINS + tuple(
    Figure(
        name,
        None,
        f"Chart over {words}",
        partial(_compute, name=name),
        _draw,
        _caption,
        (1.0, 0.42),
        beside=beside,
        full=True,
    )
    for name, words, beside in (
        ("chart09", "frequency and amplitude at the gap of Fig. 9", 9),
        ("chart13", "gap and amplitude at the frequency of Fig. 13", 13),
    )
)
