"""A fit of any system over its record, and where in the motion it fails."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.identification.picture import data_of, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["fit_residuals"]

_COLORS = ("first", "second", "third", "fourth", "zone", "pale")
_FEW = 3  # readings of a place, below which it has no bar


def fit_residuals(
    fitted: Any, ax: Axes | None = None, *, show: str = "time", quantity: str | None = None, run: str | None = None
) -> Axes:
    """Draw readings, fit and residuals over time, or the residuals' size at each place of the motion.

    Parameters
    ----------
    fitted
        A result of :func:`nonsmooth.fit`, or its ``residuals``.
    ax
        Where to draw; a new one-column figure if None.
    show
        ``"time"``: readings with the fit, coloured by mode, and residuals over their standard deviation below;
        ``"places"``: their root mean square in each mode, at each transition and at grazes.
    quantity, run
        Of which measured quantity, and of which run; the first ones where not given.
    """
    data = data_of(getattr(fitted, "residuals", fitted), "measured", "fitted", "residual", "place")
    if show not in ("time", "places"):
        raise ValueError(f"show = {show!r}; allowed: 'time', 'places'")
    return _over_time(data, ax, quantity, run) if show == "time" else _by_place(data, ax)


def _words(data: Any, name: str) -> list[str]:
    return [str(word) for word in data[name].attrs["flag_meanings"].split()]


def _chosen(data: Any, name: str, given: str | None) -> int:
    from nonsmooth.system.names import unknown

    words = _words(data, name)
    asked = words[0] if given is None else given.replace(" ", "_")
    if asked not in words:
        raise ValueError(unknown(given, f"a {name}", "this fit", words))
    return words.index(asked)


def _over_time(data: Any, ax: Axes | None, quantity: str | None, run: str | None) -> Axes:
    q, r = _chosen(data, "quantity", quantity), _chosen(data, "run", run)
    part = data.isel(sample=np.flatnonzero((data["quantity"].values == q) & (data["run"].values == r)))
    modes, unit = _words(data, "mode"), str(part["measured"].attrs.get("units", ""))
    labels, numbers = (("time", ""), (_words(data, "quantity")[q], unit)), np.unique(part["mode"].values)
    looks: dict[str, Any] = {"columns": min(3, len(numbers) + 1), "margin": 0.05, "ratio": 0.9}
    with picture(part, ax, "", *labels, strip="standard deviations", **looks) as one:
        time, mode, window, residual = one.values("time", "mode", "window", "residual")
        one.cloud(time, part["measured"].values)
        for k, m in enumerate(numbers):
            inside = (mode == m) & np.append(np.diff(window) == 0, False)
            line = np.where(inside | np.roll(inside, 1), part["fitted"].values, np.nan)
            one.line(time, line, f"fit: {modes[int(m)]}", _COLORS[k % len(_COLORS)], linewidth=0.9)
        one.residual(time, residual)
        near = part["place"].values >= len(modes)
        if near.any():
            color = style.COLORS["second"]
            one.residual(time[near], residual[near], "residual at a transition or graze", color=color, markersize=3.5)
    return one.ax


def _by_place(data: Any, ax: Axes | None) -> Axes:
    names, place, residual = _words(data, "place"), data["place"].values, data["residual"].values
    held = [i for i in np.unique(place) if np.count_nonzero(place == i) >= _FEW]
    n_modes = len(_words(data, "mode"))
    with style.axes(ax) as drawn:
        for row, i in enumerate(held):
            r = residual[place == i]
            size = float(np.sqrt(np.mean(r**2)))
            error = size / np.sqrt(2.0 * len(r))
            color = style.COLORS["first" if i < n_modes else "second"]
            drawn.barh(row, size, xerr=error, color=color, height=0.6, error_kw={"elinewidth": 0.8})
            drawn.text(0.0, row, f" {len(r)}", va="center", fontsize=style.small(drawn), color="white")
        drawn.axvline(1.0, color=style.COLORS["muted"], linewidth=0.7)
        drawn.set_yticks(
            range(len(held)), [names[i].replace("->", " \N{RIGHTWARDS ARROW} ").replace("_", " ") for i in held]
        )
        drawn.invert_yaxis()
        drawn.set_xlabel("rms of the residuals (standard deviations)")
    return drawn
