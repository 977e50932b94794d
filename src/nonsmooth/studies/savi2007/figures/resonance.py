"""Figures 9 and 10: amplitude over the forcing frequency, up and down, with the jumps and the grazing frequencies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth import frequency_response, plot
from nonsmooth.plot.style import small
from nonsmooth.studies.savi2007.figures.branches import branches, branches_of
from nonsmooth.studies.savi2007.figures.diagrams import mark_grazing, shared_legend
from nonsmooth.studies.savi2007.figures.figure import Canvas, Compute, Datasets, Draw, Figure, drawn, only_outer
from nonsmooth.studies.savi2007.flows import EXACT, FLOWS, Settings
from nonsmooth.studies.savi2007.grazing import grazing_frequencies
from nonsmooth.studies.savi2007.printed import FIGURE_9, FIGURE_10, NUMBERS

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["FIGURES", "grazing_of", "mark_printed"]


def grazing_of(response: xr.Dataset) -> list[float]:
    """Closed-form grazing frequencies at the parameters of a response (rad/s): of g - eta where it is smoothed."""
    parameters = {name: float(response[name]) for name in ("m", "k", "c", "rho", "g")}
    band = float(response["eta"]) if "eta" in response.coords else 0.0
    return grazing_frequencies({**parameters, "g": parameters["g"] - band})


def _compute(
    name: str, parameters: Mapping[str, float], low: float, high: float
) -> Compute:
    def compute(settings: Settings) -> Datasets:
        data = {}
        for flow in FLOWS:
            step = settings.of(flow, exact=0.0025, smoothed=0.005, quick=0.02)
            values = np.linspace(low, high, round((high - low) / step) + 1)
            data[flow.key] = frequency_response(
                flow.system(**parameters), values, transient=settings.of(flow, exact=300, smoothed=150, quick=60),
                keep=16, max_period=4, progress=settings.progress, **flow.options,
            )  # fmt: skip
        return data | branches(name)

    return compute


def _draw(printed: Mapping[str, float]) -> Draw:
    @drawn(1.0, 0.5)
    def draw(canvas: Canvas, data: Datasets) -> None:
        grid = canvas.subplots(1, 2, sharey=True)
        for ax, flow, letter in zip(grid, FLOWS, "ab", strict=True):
            response = data[flow.key]
            found = branches_of(data) if flow is EXACT else []
            plot.frequency_response(response, *found, ax)
            _mark(ax, response, printed)
            ax.set_title(f"({letter}) {flow.title}", y=1.0, pad=14 if printed else 6)
        only_outer(grid)
        shared_legend(canvas)

    return draw


def _mark(ax: Axes, response: xr.Dataset, printed: Mapping[str, float]) -> None:
    """Grazing frequencies, the range of period 2, and the paper's numbers at the upper edge."""
    mark_grazing(ax, grazing_of(response))
    omega = response["omega"].values
    doubled = (response["period_number"] == 2).any("direction").values
    if doubled.any():
        ax.fill_between(
            omega, 0, 1, where=doubled, transform=ax.get_xaxis_transform(), color=plot.COLORS["zone"], alpha=0.25,
            linewidth=0, zorder=0, label="period 2",
        )  # fmt: skip
    mark_printed(ax, printed)
    ax.margins(y=0.12)


def mark_printed(ax: Axes, printed: Mapping[str, float]) -> None:
    """The paper's numbers at the upper edge."""
    for i, value in enumerate(printed.values()):
        ax.plot(
            value, 1.0, "v", transform=ax.get_xaxis_transform(), color="black", markersize=4, clip_on=False,
            label="printed in the paper (rad/s)" if i == 0 else None, linestyle="none",
        )  # fmt: skip
        ax.annotate(
            f"{value:.2f}", (value, 1.0), (0, 3.5), xycoords=ax.get_xaxis_transform(), textcoords="offset points",
            ha="center", fontsize=small(ax),
        )  # fmt: skip


def _caption(name: str) -> Callable[[Datasets], str]:
    def caption(data: Datasets) -> str:
        exact, smoothed = data["exact"], data["smoothed"]
        grazing = " and ".join(f"{omega:.5f}" for omega in grazing_of(exact))
        return (
            f"Frequency response for rho = {float(exact['rho']):g} N and g = {1e3 * float(exact['g']):g} mm: half the "
            "peak-to-peak displacement with rising and falling frequency; arrows: jumps, with their frequencies. "
            "Branches in (a): periodic orbits of the exact flow, continued from one of them. "
            f"Closed-form grazing at {grazing} rad/s (green; in (b) of g - eta). Steps of "
            f"{_step(exact):.4f} rad/s (exact) and {_step(smoothed):.4f} rad/s (smoothed; a shorter transient).{name}"
        )

    return caption


def _step(response: xr.Dataset) -> float:
    return float(np.diff(response["omega"].values).max())


_PRINTED_9 = {key: NUMBERS[key].value for key in ("period 2 near", "jump rising", "jump falling")}

FIGURES = (
    Figure(
        "fig09", 9, "Frequency response with a period-2 range", _compute("fig09", FIGURE_9, 3.0, 7.0),
        _draw(_PRINTED_9), _caption(" Triangles: printed in the paper."),
    ),
    Figure(
        "fig10", 10, "Frequency response with a small jump", _compute("fig10", FIGURE_10, 2.4, 7.4), _draw({}),
        _caption(" The paper prints no numbers for this figure."),
    ),
)  # fmt: skip
