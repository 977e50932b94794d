"""One picture of what was measured and fitted: points with errors, curves, bands, residuals at its foot."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from functools import wraps
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import MEASURED, measured_label
from nonsmooth.plot.figure import figure
from nonsmooth.plot.labels import name_axes

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_SHARE = 0.30  # of the height of the axes, for residuals


def data_of(finding: Any, *needed: str) -> xr.Dataset:
    """The Dataset of a ``Finding``, or the Dataset itself, with the variables that a picture needs.

    ValueError: no data, or a variable that is missing: this is the picture of another procedure."""
    data: Any = finding if hasattr(finding, "data_vars") else getattr(finding, "data", None)
    if data is None:
        raise ValueError("this finding kept no data to draw")
    if missing := [name for name in needed if name not in data.variables]:
        held = ", ".join(sorted(map(str, data.variables)))
        raise ValueError(f"this picture needs {', '.join(missing)}; the data of this finding hold {held}")
    return data


def number(data: xr.Dataset, name: str) -> float:
    """A number of the data, the first of several; NaN where it is not there."""
    return float(data[name].values.flat[0]) if name in data.variables else float("nan")


def picture(
    needed: str,
    x: tuple[str, str] | str = ("", ""),
    y: tuple[str, str] | str = ("", ""),
    *,
    loc: str = "",
    columns: int = 2,
    margin: float = 0.02,
    strip: str | None = None,
    **size: float,
) -> Callable[[Callable[..., None]], Callable[..., Axes]]:
    """Make a figure ``(finding, ax=None, ...) -> ax`` of a function ``(one, finding, ...)`` that draws with a
    :class:`Picture`; then axes are named, residuals drawn below and the legend set, ``loc`` or above the axes.

    The data of the finding have the variables ``needed``; where none is, the function sets ``one.data``. ``x`` and
    ``y`` are names with units, or a variable of the data that has them; the function may set ``one.x`` and ``one.y``.
    The unit of the residuals is that of ``y``, or ``strip``.
    """

    def made(draw: Callable[..., None]) -> Callable[..., Axes]:
        @wraps(draw)
        def drawn(ax: Axes, *given: Any, **named: Any) -> None:
            one = Picture(ax, data_of(given[0], *needed.split()) if needed else None, x, y)
            draw(one, *given, **named)
            if one.data is None:  # what was drawn has its own axes and words
                return
            ax.margins(x=margin)
            names = (
                name
                if isinstance(name, tuple)
                else (one.data[name].attrs.get("long_name", name), one.data[name].attrs.get("units", ""))
                for name in (one.x, one.y)
            )
            across, up = names
            name_axes(ax, across, up)
            if one.left:
                one.draw_residuals(up[1] if strip is None else strip)
            style.legend(ax, loc, columns)

        own, *others = inspect.signature(draw).parameters.values()
        drawn.__signature__ = inspect.Signature([own.replace(name="ax", annotation="Axes"), *others])  # type: ignore[attr-defined]
        return figure("", **size)(drawn)

    return made


class Picture:
    """Axes, the data that are drawn in them, and the words for what was measured."""

    def __init__(self, ax: Axes, data: Any, x: tuple[str, str] | str, y: tuple[str, str] | str) -> None:
        self.ax, self.data, self.x, self.y = ax, data, x, y
        self.left: list[tuple[Any, Any, Any, Any, style.Properties]] = []

    @property
    def word(self) -> str:
        """Word for the measured side."""
        return measured_label(self.data)

    def values(self, *names: str) -> list[Any]:
        """The values of variables."""
        return [self.data[name].values for name in names]

    def text(self, name: str, unit: str = "", scale: float = 1.0, before: str = "") -> str:
        """A number of the data behind some words, ``8.470 ± 0.012 N/m``; nothing where it is not there.

        Two digits of the error stand there; without a finite one, four digits of the value."""
        value, error = (scale * number(self.data, key) for key in (name, f"{name}_error"))
        tail = f" {unit}" if unit else ""
        if not np.isfinite(value):
            return ""
        if not (np.isfinite(error) and error > 0):
            return f"{before}{value:.4g}{tail}"
        digits = max(0, 1 - int(np.floor(np.log10(error))))
        return f"{before}{value:.{digits}f} ± {error:.{digits}f}{tail}"

    def points(self, x: str, y: str, label: str = "", *, where: Any = True, scale: float = 1.0, **looks: Any) -> None:
        """Measured points of two variables, with the error of the second where the data have one."""
        here = np.broadcast_to(where, self.data[y].shape)
        if here.size and not here.any():
            return
        error = scale * self.data[f"{y}_error"].values[here] if f"{y}_error" in self.data else np.nan
        at, heights = (self.data[name].values[here] for name in (x, y))
        words = style.once(self.ax, label or self.word)
        style.points(self.ax, at, scale * heights, yerr=error, size=2.8, label=words, **looks)

    def cloud(self, x: Any, y: Any, label: str = "", color: str = MEASURED) -> None:
        """Small dots of many samples."""
        style.cloud(self.ax, (x, y), 3.0, color, label or self.word)

    def line(self, x: Any, y: Any, label: str = "", color: str = "first", line: str = "-", **looks: Any) -> None:
        """A curve; its words stand in the legend once."""
        words = style.once(self.ax, label) if label else None
        self.ax.plot(x, y, line, color=style.COLORS.get(color, color), label=words, **looks)

    def span(self, low: float, high: float, label: str, **looks: Any) -> None:
        """An interval of the abscissa; nothing where it is not known."""
        if np.isfinite([low, high]).all():
            looks = {"color": style.COLORS["zone"], "alpha": 0.25, "linewidth": 0, "zorder": 0, **looks}
            self.ax.axvspan(low, high, label=label, **looks)

    def level(self, value: float, label: str) -> None:
        """A level of the ordinate; nothing where it is not known."""
        if np.isfinite(value):
            self.ax.axhline(value, color=style.COLORS["second"], linestyle="--", linewidth=0.9, label=label)

    def note(self, x: float, y: float, *lines: str) -> None:
        """Words in the axes, at a place in their own units."""
        sides = "left" if x < 0.5 else "right" if x > 0.5 else "center", "top" if y > 0.5 else "bottom"
        looks: style.Properties = {"ha": sides[0], "va": "center" if y == 0.5 else sides[1]}
        text, size = "\n".join(filter(None, lines)), style.small(self.ax)
        self.ax.text(x, y, text, transform=self.ax.transAxes, fontsize=size, **looks)

    def residual(
        self, x: Any, left: Any, label: str = "", *, error: Any = None, band: Any = None, **looks: Any
    ) -> None:
        """Residuals for the foot of the picture: ``band`` (x, low, high) less the fit, ``looks`` unlike black dots."""
        usual = {"linestyle": "none", "marker": ".", "color": MEASURED, "markersize": 2.4, "markeredgewidth": 0}
        looks = {**usual, **looks}
        self.left.append((x, left, error, band, looks))
        if label:
            self.ax.plot([], [], label=label, **looks)

    def draw_residuals(self, unit: str) -> None:
        """Make room below what is drawn, and draw residuals there against an axis of their own on the right."""
        from matplotlib.ticker import FixedLocator, MaxNLocator

        from nonsmooth.plot.units import name_axis

        ax = self.ax
        low, high = ax.get_ylim()
        ticks = [tick for tick in ax.get_yticks() if low <= tick <= high]
        ax.set_ylim(low - _SHARE / (1 - _SHARE) * (high - low), high)
        ax.yaxis.set_major_locator(FixedLocator(ticks))
        ax.axhline(low, color=style.COLORS["section"], linewidth=0.5)
        strip = ax.twinx()
        far = 0.0
        for x, left, error, band, looks in self.left:
            if band is not None:
                strip.fill_between(*band, color=style.COLORS["first"], alpha=0.25, linewidth=0)
                far = max(far, float(np.nanmax(np.abs(band[1:]))))
            strip.plot(x, left, rasterized=True, **looks)
            if error is not None:
                strip.errorbar(x, left, yerr=error, fmt="none", ecolor=looks["color"], elinewidth=0.6)
            far = max(far, float(np.nanmax(np.abs(left) + (0.0 if error is None else error))))
        strip.axhline(0, color=style.COLORS["muted"], linewidth=0.5)
        reach = 1.15 * far or 1.0
        strip.set_ylim(-reach, -reach + 2 * reach / _SHARE)
        inside = [tick for tick in MaxNLocator(3, symmetric=True).tick_values(-reach, reach) if abs(tick) < reach]
        strip.yaxis.set_major_locator(FixedLocator(inside))
        name_axis(strip.yaxis, "residual", unit, max(inside))
        strip.yaxis.label.set(y=_SHARE / 2, horizontalalignment="center")
        ax.tick_params(right=False)


def pictures(found: Any) -> Iterator[tuple[str, Axes]]:
    """The pictures of a parameter set's findings, each with a name for its file.

    Parameters
    ----------
    found : ParameterSet
        As ``identify`` returned it: a set that was read from a file has no data to draw.
    """
    from nonsmooth.plot import identification

    drawn: list[Any] = []
    for finding in found.findings:
        if not finding.plot or finding.data is None or any(finding.data is data for data in drawn):
            continue  # two findings of one fit share its picture
        drawn.append(finding.data)
        yield finding.name, getattr(identification, finding.plot)(finding)
        if finding.plot == "impulse_response":
            yield f"{finding.name}_history", identification.impulse_history(finding)
