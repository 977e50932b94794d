"""The branch of an experiment, held by a controller: amplitudes with their uncertainty, or the control force."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.branch import draw_branch
from nonsmooth.plot.labels import name_and_unit, name_axes, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["controlled_branch"]

#: Filling and words of each ``stability``.
_LOOKS = {1: ("first", "came back when let go: stable"), 0: ("white", "left when let go: unstable"),
          -1: ("muted", "held; stability not known")}  # fmt: skip
_EFFORTS = (
    ("control_effort_first", "s", "before the first correction"), ("control_effort", "o", "converged"),
    ("control_effort_noise", "_", "noise alone"),
)  # fmt: skip


def controlled_branch(
    result: xr.Dataset, ax: Axes | None = None, *, y: str = "amplitude", theory: xr.Dataset | None = None
) -> Axes:
    """Draw the result of ``control_based_continuation``.

    Parameters
    ----------
    result
        Of ``control_based_continuation``.
    ax
        Where to draw; a new one-column figure if None.
    y : {"amplitude", "control_effort"}
        Half the peak-to-peak value over the parameter, with bars of two standard uncertainties, and the folds; or the
        control force of each point, before and after the reference was corrected, over that of noise.
    theory
        A branch of ``continue_orbit`` in the same parameter, to be drawn behind the amplitudes.

    Raises
    ------
    ValueError, TypeError
        A result of another verb, another quantity, a branch in another parameter.
    """
    variable_along(result, "control_effort", "control_based_continuation")
    if y not in ("amplitude", "control_effort"):
        raise ValueError(f"y = {y!r}; allowed: 'amplitude', 'control_effort'")
    parameter = str(result.attrs["parameter"])
    if theory is not None and theory.attrs.get("parameter") != parameter:
        raise ValueError(f"the branch is in {theory.attrs.get('parameter')!r}, the result in {parameter!r}")
    with style.axes(ax) as drawn:
        if y == "amplitude":
            _amplitudes(drawn, result, parameter, theory)
        else:
            _efforts(drawn, result)
        drawn.legend(loc="best")
    return drawn


def _amplitudes(ax: Axes, result: xr.Dataset, parameter: str, theory: xr.Dataset | None) -> None:
    values, amplitude = result[parameter].values, result["amplitude"].values
    ax.plot(values, amplitude, "-", color=style.COLORS["muted"], linewidth=0.5, zorder=2)
    if theory is not None:
        draw_branch(ax, theory, y=str(result["state"].values[0]), quantity="amplitude", special=False, color="black")
        ax.set_xlim(*_with_margin(values))
        inside = amplitude[np.isfinite(amplitude)]
        ax.set_ylim(*_with_margin(inside))
    for kind, (color, words) in _LOOKS.items():
        here = result["stability"].values == kind
        if not here.any():
            continue
        ax.errorbar(
            values[here], amplitude[here], yerr=2 * result["amplitude_uncertainty"].values[here], fmt="o", zorder=4,
            color=style.COLORS["first"], markerfacecolor=style.COLORS.get(color, color), label=words, markersize=3.5,
            markeredgewidth=0.7, elinewidth=0.6,
        )  # fmt: skip
    if result.sizes["special"]:
        at = result["special_point"].values
        ax.errorbar(
            result["special_value"].values, amplitude[at], xerr=2 * result["special_value_uncertainty"].values,
            color=style.COLORS["second"], markerfacecolor="none", markersize=6.5, elinewidth=0.8, zorder=5, fmt="D",
            label="fold",
        )  # fmt: skip
    state = str(result["state"].values[0])
    text, unit = name_and_unit(result, state)
    name_axes(ax, name_and_unit(result, parameter), (f"amplitude of {text}", unit))


def _efforts(ax: Axes, result: xr.Dataset) -> None:
    for (name, mark, words), color in zip(_EFFORTS, ("second", "first", "muted"), strict=True):
        ax.semilogy(
            np.arange(result.sizes["point"]), result[name].values, mark, color=style.COLORS[color], markersize=3.5,
            label=words,
        )  # fmt: skip
    ax.set_xlabel("point along the branch")
    name_axes(ax, None, ("rms of the control force", result["control_effort"].attrs.get("units", "1")))


def _with_margin(values: Any) -> tuple[float, float]:
    low, high = float(np.min(values)), float(np.max(values))
    return low - 0.05 * (high - low), high + 0.08 * (high - low)
