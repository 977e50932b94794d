"""Basins beside Figs. 13 and 17: where two attractors coexist, which start leads to which."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nonsmooth import basins, plot, simulate
from nonsmooth.plot import prefixed, shade_zone
from nonsmooth_savi2007.figures.figure import Canvas, Datasets, Figure
from nonsmooth_savi2007.flows import EXACT, Settings
from nonsmooth_savi2007.measure import period_word
from nonsmooth_savi2007.printed import FIGURE_13, FIGURE_17

#: Parameters of each picture.
BASINS = {"basins13": {**FIGURE_13, "g": 0.0014}, "basins17": {**FIGURE_17, "omega": 9.55}}
_PLANE = {"x": (-0.02, 0.02), "v": (-0.2, 0.2)}
_POINTS, _FULL, _QUICK = 160, 500, 40  # along each side
_WANDERING = 60  # periods drawn of an attractor that is no cycle
_LOOKS = ("marker", "markersize", "markerfacecolor", "markeredgecolor", "markeredgewidth", "rasterized", "zorder")


def _compute(settings: Settings, name: str) -> Datasets:
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


def _draw(canvas: Canvas, data: Datasets) -> None:
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


def _caption(data: Datasets) -> str:
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


FIGURES = tuple(
    Figure(name, None, f"Basins at {words}", partial(_compute, name=name), _draw, _caption, beside=beside)
    for name, words, beside in (
        ("basins13", "g = 1.4 mm", 13),
        ("basins17", "omega = 9.55 rad/s", 17),
    )
)
