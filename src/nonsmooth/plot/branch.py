"""Branches of periodic orbits over a parameter: stable solid, unstable dashed, special points marked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.labels import name_and_unit, name_axes, only_states, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

__all__ = ["MARKS", "branch", "draw_branch", "lines_of", "mark_special", "ordinates_of", "with_breaks"]

#: Marker and words of each kind of special point.
MARKS = {
    "fold": ("o", "fold"),
    "flip": ("s", "flip"),
    "neimark_sacker": ("D", "Neimark-Sacker"),
    "pitchfork": ("^", "pitchfork"),
    "transcritical": ("<", "transcritical"),
    "branch_point": ("v", "branch point"),
    "grazing": ("X", "grazing"),
    "corner": ("P", "corner"),
    "hopf": ("H", "Hopf"),
    "boundary_equilibrium": ("p", "boundary equilibrium"),
}
_OTHER = "*"
#: Diameters in points. Several kinds meet at one point where a branch grazes: the smaller one lies on the larger.
_SIZES = {"fold": 6.5, "flip": 5.5}
_SIZE = 4.0
_STATES = {"-": "stable", "--": "unstable", ":": "virtual"}
_SEAM = 0.3  # opacity of a stable branch under the points that lie on it
_WORDS = {"section": "", "maximum": "largest ", "minimum": "smallest ", "amplitude": "amplitude of "}


def branch(
    result: xr.Dataset,
    ax: Axes | None = None,
    *,
    y: str | None = None,
    quantity: str = "section",
    special: bool = True,
    color: str | None = None,
) -> Axes:
    """Draw a branch over its parameter: stable parts solid, unstable ones dashed, virtual ones dotted.

    Parameters
    ----------
    result
        A ``continue_orbit`` or ``continue_equilibrium``.
    ax
        Where to draw; a new one-column figure if None.
    y
        The state of the ordinate; by default the first.
    quantity : {"section", "maximum", "minimum", "amplitude"}
        Section points (all of a period-n orbit where the branch has ``returns``), extremes over the orbit, or half
        their distance. Of an equilibrium the state itself, and 0.
    special
        Mark the special points, each kind with its own sign, named in the legend.
    color
        Colour of the lines.
    """
    variable_along(result, "stable", "continue_orbit")
    with style.axes(ax) as drawn:
        draw_branch(drawn, result, y=y, quantity=quantity, special=special, color=color)
        (name,) = only_states(result, y)
        text, unit = name_and_unit(result, name)
        name_axes(drawn, name_and_unit(result, result.attrs["parameter"]), (_WORDS[quantity] + text, unit))
        style.clear_legend(drawn)
    return drawn


def draw_branch(
    ax: Axes,
    result: xr.Dataset,
    *,
    y: str | None = None,
    quantity: str = "section",
    special: bool = True,
    color: str | None = None,
    width: float = 0.9,
    behind: bool = False,
) -> None:
    """Draw the lines (``width`` in typographic points) and marks of a branch on axes that the caller labels.

    ``behind``: over points of a sweep, which lie on the stable parts: those become a pale, wide seam under them.
    """
    variable_along(result, "stable", "continue_orbit")
    if quantity not in _WORDS:
        raise ValueError(f"quantity = {quantity!r}; allowed: {', '.join(map(repr, _WORDS))}")
    (name,) = only_states(result, y)
    values = result[result.attrs["parameter"]].values
    ordinates = ordinates_of(result, name, quantity)
    shade = color or style.COLORS["first"]
    for line, at in lines_of(result):
        looks: dict[str, Any] = {"linewidth": width, "zorder": 3}
        if behind and line == "-":
            looks = {"linewidth": 3 * width, "alpha": _SEAM, "zorder": 0.5}
        for row in ordinates:
            label = style.once(ax, f"{_STATES[line]} branch")
            ax.plot(with_breaks(values, at), with_breaks(row, at), line, color=shade, label=label, **looks)
    if special and result.sizes.get("special", 0):
        mark_special(ax, result, values, ordinates, MARKS)


def ordinates_of(result: xr.Dataset, name: str, quantity: str) -> NDArray[np.float64]:
    """One line for each section point of the orbit, (lines, point); an equilibrium is its own maximum and minimum."""
    if "eigenvalues" in result:
        rest = result["u"].sel(state=name).values.astype(float)
        return np.zeros((1, len(rest))) if quantity == "amplitude" else rest[None, :]
    if quantity == "amplitude":
        chosen = 0.5 * (result["maximum"] - result["minimum"]).sel(state=name)
    else:
        source = "returns" if quantity == "section" and "returns" in result else quantity
        chosen = result[source].sel(state=name)
    others = [dim for dim in chosen.dims if dim != "point"]
    return np.asarray(chosen.transpose(*others, "point").values, dtype=float).reshape(-1, result.sizes["point"])


def mark_special(
    ax: Axes, result: xr.Dataset, x: Any, heights: NDArray[np.float64], marks: Mapping[str, tuple[str, str]]
) -> None:
    """The special points on each of the lines (lines, point), every kind with its own sign and words."""
    at = result["special_point"].values.astype(int)
    kinds = result["special_kind"].values.astype(str)
    for kind in dict.fromkeys(kinds.tolist()):
        here = at[kinds == kind]
        marker, words = marks.get(kind, (_OTHER, kind.replace("_", " ")))
        size = _SIZES.get(kind, _SIZE)
        rows = heights[:, here]
        style.mark(ax, (np.broadcast_to(x[here], rows.shape), rows), marker, words, size, zorder=5.7 - 0.1 * size)


def lines_of(result: xr.Dataset) -> list[tuple[str, NDArray[np.intp]]]:
    """The style of each kind of line, and the points that it joins (-1: a break).

    A segment that begins at a special point, where stability changes, is of the kind of its end.
    """
    kind = np.where(result["stable"].values.astype(bool), 0, 1)
    if "virtual" in result:
        kind[result["virtual"].values.astype(bool)] = 2
    first, last = kind[:-1].copy(), kind[1:]
    if result.sizes.get("special", 0):
        at = result["special_point"].values.astype(int)
        at = at[at < len(first)]
        first[at] = last[at]
    segments = np.where(last == 2, 2, first)
    found = []
    for number, line in enumerate(_STATES):
        here = np.flatnonzero(segments == number)
        runs = [run for run in np.split(here, np.flatnonzero(np.diff(here) > 1) + 1) if run.size]
        if runs:
            found.append((line, np.concatenate([[*run, run[-1] + 1, -1] for run in runs])[:-1]))
    return found


def with_breaks(values: NDArray[np.float64], at: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return the values at points of a line, NaN at its breaks."""
    return np.where(at < 0, np.nan, values[at])
