r"""Regions of modes: those of a system in the plane of two states, sharp or smoothed.

With the signed indicators :math:`g_r` of the condition under which the first mode is left, the margin is
:math:`\mu = \min_r g_r`. A sharp system is in :math:`G_-` where :math:`\mu < 0` and in :math:`G_+` where
:math:`\mu > 0`, parted by the surfaces :math:`S_r` on which :math:`g_r` is the least and zero. A smoothed one
has bands :math:`|\mu| < \eta` in their place. For the discontinuous support these are Eqs. (4)-(5) and
(9)-(10), Fig. 2a and 2b, of Savi et al., J. Sound Vib. 301 (2007) 59-73.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.plot import style
from nonsmooth.plot.figure import figure
from nonsmooth.plot.labels import Name, name_axes, only_states, symbol_of
from nonsmooth.system.kinds import Range
from nonsmooth.system.symbolic.numeric import numeric

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from nonsmooth.system.system import System

_OUTSIDE, _INSIDE, _BANDS = "#FFFFFF", "#D6E6F2", ("#F7D9B8", "#CDE8DC", "#EED3E2")
_LINES = ("second", "third", "fourth")
_GRID = 401


@figure(ratio=0.85)
def regions(
    ax: Axes,
    system: System,
    *,
    xlim: Range,
    ylim: Range,
    x: Name | None = None,
    y: Name | None = None,
    t: float = 0.0,
) -> None:
    """Draw the regions of a system's first mode (G-), of the mode it changes to (G+), and the borders between them.

    Parameters
    ----------
    system
        As it is, or smoothed: then the bands S_a, S_b, ... take the place of the surfaces.
    ax
        Where to draw; a new one-column figure if None.
    xlim, ylim
        The part of the plane, in the states' units. A band of half-width eta shows if they are a few eta wide.
    x, y
        The states of the axes; by default the first two. Other states are zero.
    t
        The time, for indicators that depend on it.

    Raises
    ------
    ValueError
        A name that is no state, or a system whose first mode is never left by a condition.
    """
    names = only_states(system, x, y)
    first, second = np.meshgrid(np.linspace(*xlim, _GRID), np.linspace(*ylim, _GRID))
    margins = _margins(system, names, first, second, t)
    _draw(ax, first, second, margins, system.is_smoothed)
    ax.set(xlim=xlim, ylim=ylim)
    name_axes(ax, *((symbol_of(name), system.states[name]) for name in names))


def _margins(system: System, names: list[str], first: Any, second: Any, t: float) -> FloatArray:
    """The signed indicators of the condition that leaves the first mode, in units of eta where smoothed: (R, ...)."""
    sharp = system.smoothed(None).traced
    rows = next((item.rows for item in sharp.transitions if item.source == 0 and item.rows), None)
    if rows is None:
        raise ValueError(f"no condition on the state leaves the first mode of {system.name!r}: it has no regions")
    eta = system.eta if system.is_smoothed else 1.0
    u = np.zeros((first.size, len(sharp.u)))
    u[:, [sharp.state_names.index(name) for name in names]] = np.stack([first.ravel(), second.ravel()], axis=1)
    h = numeric(sharp, sharp.indicators)(system.parameter_vector(), t, u, np.zeros(len(sharp.m)))
    width = [eta[sharp.indicator_names[row.indicator]] if isinstance(eta, dict) else eta for row in rows]
    signs = np.array([row.sign for row in rows]) / width
    return np.asarray((h[:, [row.indicator for row in rows]] * signs).T.reshape(len(rows), *first.shape))


def _draw(ax: Axes, x: Any, y: Any, margins: FloatArray, band: bool) -> None:
    least, tilde = margins.min(axis=0), "" if band else r"\tilde "
    _fill(ax, x, y, least + band, _OUTSIDE, f"${tilde}G_-$")
    _fill(ax, x, y, band - least, _INSIDE, f"${tilde}G_+$")
    for r in range(len(margins)):
        others = np.delete(margins, r, axis=0).min(axis=0, initial=np.inf)
        color = style.COLORS[_LINES[r % 3]]
        name = f"${tilde}S{f'_{chr(97 + r)}' if len(margins) > 1 else ''}$"
        if band:
            inside = np.maximum(np.abs(margins[r]) - 1, margins[r] - others)
            _fill(ax, x, y, inside, _BANDS[r % 3], name)
            ax.contour(x, y, inside, levels=[0], colors=color, linewidths=0.8)
            continue
        here = np.where(margins[r] <= others, margins[r], np.nan)
        drawn = ax.contour(x, y, here, levels=[0], colors=color, linewidths=1.4)
        longest = max((np.asarray(path.vertices) for path in drawn.get_paths()), key=len)
        if len(longest):
            ax.annotate(name, longest[len(longest) // 2], (5, 2), textcoords="offset points", color=color)


def _fill(ax: Axes, x: Any, y: Any, outside: FloatArray, color: str, name: str) -> None:
    """Fill where ``outside`` is negative, and write the name where there is most room."""
    from scipy.ndimage import distance_transform_edt

    if not (outside < 0).any():
        return
    ax.contourf(x, y, outside, levels=[-np.inf, 0], colors=[color])
    room = distance_transform_edt(np.pad(outside < 0, 1))[1:-1, 1:-1]
    at = np.unravel_index(room.argmax(), room.shape)
    ax.text(x[at], y[at], name, ha="center", va="center")
