"""A measured frequency response over the predicted one, with the band and the jumps of both."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import ABOVE, check_kind, measured_label, shade_reach
from nonsmooth.plot.labels import first_states, name_and_unit, name_axes, with_unit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["comparison_response"]

#: Height in points of a jump's number above its marks: a rising and a falling one may lie at one place.
_LIFT = {"up": 5, "down": 14}
_LOOKS = {"up": ("first", "^", "-", "increasing"), "down": ("second", "v", "--", "decreasing")}


def comparison_response(result: xr.Dataset, ax: Axes | None = None, *, digits: int = 3) -> Axes:
    """Draw a comparison of a response.

    Parameters
    ----------
    result
        A comparison of a response.
    ax
        Where to draw; a new one-column figure if None.
    digits
        Digits after the point of the differences between jumps, predicted less measured.
    """
    check_kind(result, "response")
    parameter = str(result["theory_amplitude"].dims[0])
    (state,) = first_states(result, None)
    word = measured_label(result)
    with style.axes(ax) as drawn:
        values = result[parameter].values
        runs = result["measured_direction"].values.astype(str)
        for i, direction in enumerate(result["direction"].values.astype(str)):
            color, marker, line, name = _LOOKS[direction]
            color = style.COLORS[color]
            shade_reach(drawn, result.isel(direction=i), values, color=color, alpha=0.2)
            drawn.plot(values, result["theory_amplitude"].values[:, i], line, color=color, label=f"theory, {name}")
            mine = runs == direction
            error = result["measured_amplitude_error"].values[mine]
            at, heights = result[f"measured_{parameter}"].values[mine], result["measured_amplitude"].values[mine]
            drawn.errorbar(
                at, heights, yerr=error if np.isfinite(error).any() else None, fmt=marker, color=color, markersize=3,
                markerfacecolor="white", markeredgewidth=0.7, elinewidth=0.6, label=f"{word}, {name}",
            )  # fmt: skip
        _jumps(drawn, result, digits)
        drawn.set_ylim(bottom=0)
        drawn.margins(x=0.02)
        drawn.legend(**ABOVE, ncols=2, handlelength=1.6, columnspacing=1.2)
        text, unit = name_and_unit(result, state)
        name_axes(drawn, name_and_unit(result, parameter), (f"amplitude of {text}", unit))
    return drawn


def _jumps(ax: Axes, result: xr.Dataset, digits: int) -> None:
    """A mark at the foot for each jump: filled where measured, open where predicted, with the difference."""
    foot = ax.get_xaxis_transform()
    names: dict[str, Any] = {"color": style.COLORS["muted"], "markersize": 3.5, "linestyle": "none"}
    for key, word, face in (("measured_jump", measured_label(result), None), ("theory_jump", "theory", "white")):
        if np.isfinite(result[key].values if key in result else np.nan).any():
            ax.plot([], [], "D", markerfacecolor=face, label=f"jump, {word}", **names)
    differences = False
    for row in range(result.sizes.get("jump", 0)):
        direction = str(result["jump_direction"].values[row])
        color = style.COLORS[_LOOKS[direction][0]]
        seen, expected = (float(result[name].values[row]) for name in ("measured_jump", "theory_jump"))
        for place, face in ((seen, color), (expected, "white")):
            if np.isfinite(place):
                looks: dict[str, Any] = {"markersize": 3.5, "transform": foot, "clip_on": False, "zorder": 6}
                ax.plot([place], [0.03], "D", color=color, markerfacecolor=face, **looks)
        if np.isfinite(seen) and np.isfinite(expected):
            number = f"{expected - seen:+.{digits}f}".replace("-", "\N{MINUS SIGN}")
            ax.annotate(
                number, ((seen + expected) / 2, 0.03), (0, _LIFT[direction]), xycoords=foot,
                textcoords="offset points", ha="center", fontsize=style.small(ax), color=color, zorder=6,
                path_effects=style.halo(),
            )  # fmt: skip
            differences = True
    if differences:
        unit = name_and_unit(result, str(result["theory_amplitude"].dims[0]))[1]
        ax.plot([], [], linestyle="none", label=with_unit("numbers: theory less measured", unit))
