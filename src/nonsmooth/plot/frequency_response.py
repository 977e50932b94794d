"""The resonance curve: amplitude over frequency, up and down told apart, jumps marked with their values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.plot import style
from nonsmooth.plot.bifurcation import sorted_out
from nonsmooth.plot.branch import draw_branch
from nonsmooth.plot.labels import column, first_states, name_and_unit, name_axes, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["frequency_response"]

_LOOKS: dict[str, dict[str, Any]] = {
    "up": {"color": style.COLORS["first"], "linestyle": "-"},
    "down": {"color": style.COLORS["second"], "linestyle": "--"},
    "none": {"color": style.COLORS["section"], "linestyle": "none", "marker": ".", "markersize": 1.5},
}
_WORDS = {"up": "increasing", "down": "decreasing", "none": "each from its start"}


def frequency_response(
    result: xr.Dataset,
    *over: xr.Dataset | Axes | None,
    ax: Axes | None = None,
    y: str | None = None,
    quantity: str = "amplitude",
    jumps: bool = True,
    digits: int = 4,
) -> Axes:
    """Draw a ``frequency_response`` result.

    Parameters
    ----------
    result
        What ``frequency_response`` gave.
    *over
        Branches of ``continue_orbit`` over the same parameter: stable parts as a pale seam under the response, unstable
        ones dashed, special points marked. Axes to draw on may stand here too, as in the other plots.
    ax
        Where to draw; a new one-column figure if None.
    y
        The state; by default the first. Or a variable over the parameter alone, such as a load (``"stop_energy"``).
    quantity
        ``"amplitude"`` (half the peak-to-peak value), ``"maximum"`` or ``"minimum"``.
    jumps
        Mark each jump of what is drawn by a dotted arrow and its value of the parameter with ``digits`` significant
        digits.
    """
    variable_along(result, "amplitude", "frequency_response")
    if quantity not in ("amplitude", "maximum", "minimum"):
        raise ValueError(f"quantity is {quantity!r}; allowed: 'amplitude', 'maximum', 'minimum'")
    (name,) = first_states(result, y)
    parameter = str(result["maximum"].dims[0])
    values = result[parameter].values
    alone = name in result.data_vars and result[name].dims == result["status"].dims
    heights = result[name] if alone else column(result, quantity, name)
    ax, branches = sorted_out(over, ax, parameter)
    with style.axes(ax) as drawn:
        for i, direction in enumerate(np.atleast_1d(result["direction"].values).astype(str)):
            one = heights.isel(direction=i) if "direction" in heights.dims else heights
            curves = one.transpose(parameter, ...).values.reshape(len(values), -1)
            for k, curve in enumerate(curves.T):
                found = _intervals(values, curve, _jumps(result, name, direction, k))
                at = [i for _, i in found]
                broken = np.insert(values, at, np.nan), np.insert(curve, at, np.nan)
                drawn.plot(*broken, label=_WORDS[direction] if k == 0 else None, **_LOOKS[direction])
                if jumps:
                    for place, i in found:
                        _mark(drawn, curve, i, values[0] <= values[-1], place, direction, digits)
        for behind in branches:
            draw_branch(drawn, behind, y=name, quantity=quantity, color=style.COLORS["section"], width=0.7, behind=True)
        drawn.margins(x=0)
        name_axes(drawn, name_and_unit(result, parameter), _ordinate(result, name, "" if alone else quantity))
        style.clear_legend(drawn)
    return drawn


def _jumps(result: xr.Dataset, name: str, direction: str, start: int) -> list[float]:
    """The jumps of one curve: those of its state, its direction and, where there are several starts, of its start."""
    first = str(result["state"].values[0])  # older results hold no others
    if "jump_value" not in result or ("jump_variable" not in result and name != first):
        return []
    mine = result["jump_direction"].values == direction
    if "jump_variable" in result:
        mine = mine & (result["jump_variable"].values == name)
    if "jump_start" in result:
        mine = mine & (result["jump_start"].values == start)
    return [float(value) for value in result["jump_value"].values[mine]]


def _intervals(values: NDArray[np.float64], curve: NDArray[np.float64], places: list[float]) -> list[tuple[float, int]]:
    """Each jump with the i such that it lies between the points i - 1 and i.

    A jump may be reported at a point itself, on either side: of the intervals next to it the steepest is meant.
    """
    order = np.argsort(values)
    steps = np.abs(np.diff(curve[order]))
    found = []
    for place in places:
        low = int(np.searchsorted(values[order], place)) - 1
        near = [i for i in (low - 1, low, low + 1) if 0 <= i < len(steps) and np.isfinite(steps[i])]
        if near:
            i = max(near, key=lambda k: steps[k])
            found.append((place, int(max(order[i], order[i + 1]))))
    return found


def _mark(
    ax: Axes, curve: NDArray[np.float64], at: int, rising: bool, place: float, direction: str, digits: int
) -> None:
    """An arrow from the height before the jump to the height after it, in the sense of the sweep."""
    before, after = (curve[at - 1], curve[at]) if (direction == "up") == rising else (curve[at], curve[at - 1])
    color = _LOOKS[direction]["color"]
    arrow = {"arrowstyle": "->", "color": color, "linestyle": ":", "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", (place, after), (place, before), arrowprops=arrow)
    side = 2 if direction == "up" else -2
    small = abs(after - before) < 0.2 * np.ptp(curve[np.isfinite(curve)])  # no room beside the arrow: below it
    where, offset = (min(before, after), (side, -3)) if small else ((before + after) / 2, (side, 0))
    ax.annotate(
        f"{place:.{digits}g}", (place, where), offset, textcoords="offset points", color=color, rotation=90,
        fontsize=style.small(ax), va="top" if small else "center", ha="left" if side > 0 else "right", zorder=6,
        path_effects=style.halo(),
    )  # fmt: skip


def _ordinate(result: xr.Dataset, name: str, quantity: str) -> tuple[str, str]:
    text, unit = name_and_unit(result, name)
    return f"{quantity} of {text}" if quantity else text, unit
