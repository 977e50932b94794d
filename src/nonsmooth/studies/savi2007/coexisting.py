"""Basins beside Figs. 13 and 17: where two attractors coexist, which start leads to which."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth import plot
from nonsmooth.analysis.basins import basins
from nonsmooth.flow.simulate import simulate
from nonsmooth.plot.basins import kind_of
from nonsmooth.plot.palette import attractor_color
from nonsmooth.studies.savi2007.figure import Figure, sheet
from nonsmooth.studies.savi2007.flows import EXACT, Settings
from nonsmooth.studies.savi2007.printed import FIGURE_13, FIGURE_17

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure as Canvas

__all__ = ["BASINS", "FIGURES", "names_of"]

#: Parameters of each picture.
BASINS = {"basins13": {**FIGURE_13, "g": 0.0014}, "basins17": {**FIGURE_17, "omega": 9.55}}
_PLANE = {"x": (-0.02, 0.02), "v": (-0.2, 0.2)}
_POINTS, _FULL, _QUICK = 160, 500, 40  # along each side
_WANDERING = 60  # periods drawn of an attractor that is no cycle


def _compute(name: str) -> Callable[[Settings], dict[str, xr.Dataset]]:
    def compute(settings: Settings) -> dict[str, xr.Dataset]:
        n = _QUICK if settings.quick else _FULL if settings.full else _POINTS
        system = EXACT.system(**BASINS[name])
        found = basins(
            system, {state: np.linspace(*ends, n) for state, ends in _PLANE.items()}, progress=settings.progress,
            **EXACT.options,
        )  # fmt: skip
        data = {"basins": found}
        for k in range(found.sizes["attractor"]):
            periods = int(found["period_number"][k]) or _WANDERING
            start = found["section_points"].values[found["point_attractor"].values == k][0]
            data[f"orbit_{k}"] = simulate(system, start=start, periods=periods, **EXACT.options)
        return data

    return compute


def names_of(found: xr.Dataset) -> list[str]:
    """``0: period 3, 67.30 ± 0.29 %`` of each attractor: its number, what it is, its share with the binomial error."""
    words = []
    for k in range(found.sizes["attractor"]):
        kind = kind_of(int(found["period_number"][k]), bool(found["chaotic"][k]))
        share, error = (100 * float(found[name][k]) for name in ("fraction", "fraction_error"))
        words.append(f"{k}: {kind}, {share:.2f} ± {error:.2f} %")
    return words


def _draw(data: Mapping[str, xr.Dataset]) -> Canvas:
    found = data["basins"]
    with plot.journal():
        canvas = sheet(plot.PAGE, 0.46 * plot.PAGE)
        left, right = canvas.subplots(1, 2)
        plot.basins(found, left)
        left.get_legend().remove()
        left.set_title("(a) basins, section at phase 0", y=1.0, pad=9)
        for k, name in enumerate(names_of(found)):
            cycle = int(found["period_number"][k]) > 0
            begun = len(right.get_lines())
            plot.phase_portrait(data[f"orbit_{k}"], right)
            for line in right.get_lines()[begun:]:
                line.set(color=attractor_color(k), linewidth=1.1 if cycle else 0.3, zorder=3 if cycle else 2, label="_")
            points = found["section_points"].values[found["point_attractor"].values == k]
            right.plot(
                points[:, 0], points[:, 1], "o", color="black", markersize=3.0 if cycle else 0.6, zorder=4,
                markeredgecolor="white", markeredgewidth=0.5 if cycle else 0, rasterized=not cycle,
            )  # fmt: skip
            right.plot([], [], "s", color=attractor_color(k), markersize=5, markeredgecolor="black",
                       markeredgewidth=0.4, label=name)  # fmt: skip
        right.plot([], [], "o", color="black", markersize=3, label="section points")
        limits = right.get_xlim()
        right.axvspan(float(found["g"]), limits[1], color=plot.COLORS["zone"], alpha=0.18, linewidth=0, zorder=0,
                      label="contact zone")  # fmt: skip
        right.set_xlim(limits)
        right.ticklabel_format(axis="y", style="plain")
        right.set_title("(b) attractors", y=1.0, pad=9)
        entries = dict(zip(*reversed(right.get_legend_handles_labels()), strict=True))
        canvas.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=5)
    return canvas


def _caption(data: Mapping[str, xr.Dataset]) -> str:
    found = data["basins"]
    lost = int((found["label"].values < 0).sum())
    at = ", ".join(
        f"{name} = {float(found[name]):g} {found[name].attrs['units']}" for name in ("omega", "rho", "g")
    )
    first, second = (str(dim) for dim in found["label"].dims)
    return (
        f"Basins at {at}, from {found.sizes[first]} x {found.sizes[second]} starts at phase 0 (exact flow). The share "
        f"of each attractor of this plane, with its binomial standard error: {'; '.join(names_of(found))}. "
        f"{lost or 'No'} start{'' if lost == 1 else 's'} reached none. Least jump of the state from a section point "
        "into another basin: "
        + ", ".join(f"{k}: {float(value):.2g}" for k, value in enumerate(found["minimal_shock"].values))
        + " (in units of 1 mm and 1 cm/s). Dimension of the boundary by box counting: "
        + f"{float(found['boundary_dimension']):.3f}; basin entropy {float(found['entropy']):.3f}."
    )


FIGURES = tuple(
    Figure(name, None, f"Basins at {words}", _compute(name), _draw, _caption, beside=beside)
    for name, words, beside in (
        ("basins13", "g = 0.0014 m", 13), ("basins17", "omega = 9.55 rad/s", 17),
    )
)  # fmt: skip
