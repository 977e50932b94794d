"""The look of every figure: journal column widths, small fonts, colours that colour-blind readers can tell apart.

A plot function given no axes draws on its own, in this style. Given axes, it leaves the caller's style alone, but for
what it adds itself: a legend has no frame and letters in proportion to the axes' labels, unless the caller's own
settings say otherwise. Keep a ``with nonsmooth.plot.journal():`` block around making the figure and drawing on it to
get the whole style.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from colorsys import hls_to_rgb
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from nonsmooth.errors import shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

#: Widths of one column (84 mm) and of the page (174 mm), in inches.
COLUMN = 84 / 25.4
PAGE = 174 / 25.4

#: What a colour stands for. The palette is that of Okabe and Ito (2008), told apart by all common colour visions.
COLORS = {
    "first": "#0072B2",  # blue: the first mode, the rising sweep
    "pale": "#56B4E9",  # the rising sweep as a wide seam under the falling one
    "second": "#D55E00",  # vermilion: the other modes, the falling sweep
    "section": "#000000",
    "third": "#009E73",
    "fourth": "#CC79A7",
    "zone": "#E69F00",  # filled areas only, drawn pale
    "muted": "#7F7F7F",
}

#: Period numbers 1 ... 8, told apart by all common colour visions: light and dark alternate (after Paul Tol's schemes).
PERIODS = ("#DDDDDD", "#4477AA", "#EE6677", "#228833", "#CCBB44", "#66CCEE", "#AA3377", "#EE8866")
LONGER = "#8C6D31"
NO_PERIOD = "#000000"
UNKNOWN = "#FFFFFF"
DIVERGED = "#8C8C8C"

_ATTRACTORS = ("#88CCEE", "#CC6677", "#DDCC77", "#117733", "#332288", "#AA4499", "#44AA99", "#999933", "#882255")
_LINES = tuple(COLORS[name] for name in ("first", "second", "third", "fourth", "zone", "pale"))


def nth(k: int, own: Sequence[str] = _LINES) -> str:
    """The k-th colour of a list; behind its end hues advance by the golden angle, so that none comes again."""
    if k < len(own):
        return own[k]
    return "#" + "".join(f"{round(255 * part):02X}" for part in hls_to_rgb(0.618034 * k % 1, 0.3 + 0.12 * (k % 3), 0.7))


def attractor_color(number: int) -> str:
    """Colour of an attractor; white where there is none."""
    return UNKNOWN if number < 0 else nth(number, _ATTRACTORS)


#: Properties of what is drawn, as Matplotlib takes them.
Properties = dict[str, Any]
#: A legend above the axes, for pictures that fill theirs.
_ABOVE: Properties = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.2, "handlelength": 1.6}


def beside(height: float) -> Properties:
    """Place of a legend to the right of the axes, its top at their top (1) or its foot at theirs (0)."""
    where = "upper left" if height else "lower left"
    return {"loc": where, "bbox_to_anchor": (1.01, height), "borderaxespad": 0.0}


_DOT = 7.0  # of a point cloud in a legend, in points; the mark "." is half of it wide


#: The style in which new figures are made, and that of each figure made so.
_style: ContextVar[str] = ContextVar("style", default="journal")
_made: WeakKeyDictionary[Any, str] = WeakKeyDictionary()


@cache
def _settings(name: str = "journal") -> Any:
    """The settings of a style's file."""
    import matplotlib as mpl

    return mpl.rc_params_from_file(Path(__file__).with_name(f"{name}.mplstyle"), use_default_template=False)


def journal() -> AbstractContextManager[None]:
    """The package's style, for the figures made inside the ``with`` block.

    ``plt.style.use("nonsmooth.plot.journal")`` sets it for all figures that follow.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> import nonsmooth as ns
    >>> with ns.plot.journal():
    ...     figure, ax = plt.subplots()
    """
    return _in("journal")


def slides() -> AbstractContextManager[None]:
    """A style for slides, for the figures made inside the ``with`` block: wide, large letters, strong lines.

    ``plt.style.use("nonsmooth.plot.slides")`` sets it for figures of your own that follow.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> run = ns.simulate(ns.models.impact_oscillator(), periods=2)
    >>> with ns.plot.slides():
    ...     ax = ns.plot.time_history(run)
    """
    return _in("slides")


@contextmanager
def _in(name: str) -> Iterator[None]:
    """Set a style, and make it that of the figures made inside."""
    token = _style.set(name)
    try:
        with _set(_settings(name)):
            yield
    finally:
        _style.reset(token)


@contextmanager
def _set(settings: Any) -> Iterator[None]:
    """Set these and no others: a notebook's first figure makes Matplotlib interactive, and ``rc_context`` undoes it."""
    import matplotlib as mpl

    before: Any = {key: mpl.rcParams[key] for key in settings}
    mpl.rcParams.update(settings)
    try:
        yield
    finally:
        mpl.rcParams.update(before)


@contextmanager
def axes(ax: Axes | None, *, width: float = COLUMN, ratio: float = 0.72) -> Iterator[Axes]:
    """The axes to draw on: the given ones (legends in the package's style), or a new figure of one column.

    TypeError: something else was given, such as the name of a quantity."""
    import matplotlib as mpl
    from matplotlib.axes import Axes as Drawable

    if ax is not None and not isinstance(ax, Drawable):
        hint = (
            "one of several is ax[0]" if isinstance(ax, np.ndarray) else "what to draw is given by name, as in show=..."
        )
        raise TypeError(f"ax = {shortened(ax)} is no matplotlib Axes: {hint}")
    if ax is not None:  # what the caller has set stays
        now: Any = mpl.rcParams
        plain: Any = mpl.rcParamsDefault
        wanted = {"legend.frameon": _settings()["legend.frameon"], "legend.fontsize": small(ax)}
        with _set({key: value for key, value in wanted.items() if now[key] == plain[key]}):
            yield ax
        return
    import matplotlib.pyplot as plt

    name = _style.get()
    with _in(name):
        wide, high = _settings(name)["figure.figsize"]
        size = (width, width * ratio) if name == "journal" else (wide * width / COLUMN, high * width / COLUMN)
        figure = plt.figure(figsize=size)
        _made[figure] = name
        try:
            yield figure.add_subplot()
        except BaseException:  # what could not be drawn leaves no empty figure
            plt.close(figure)
            raise


def small(ax: Axes) -> float:
    """Size of letters within axes: 7/8 of their labels', as in legends; 7 pt in the package's style."""
    settings = _settings(_style.get())
    return float(settings["legend.fontsize"] / settings["axes.labelsize"] * ax.xaxis.label.get_fontsize())


def halo(width: float = 2.0) -> list[Any]:
    """A white seam of ``width`` points, so that letters or a line show over whatever lies below."""
    from matplotlib import patheffects

    return [patheffects.withStroke(linewidth=width, foreground="white")]


def once(ax: Axes, words: str) -> str | None:
    """Return the words, or None where the axes' legend has them already."""
    return None if words in ax.get_legend_handles_labels()[1] else words


def line(ax: Axes, x: Any, y: Any, *form: str, **looks: Any) -> None:
    """Draw a curve with breaks (NaN); a point without a neighbour to be joined to is a dot."""
    alone = np.flatnonzero(np.convolve(np.isfinite(x * y), [1, 4, 1])[1:-1] == 4).tolist()
    ax.plot(x, y, *form, **({"marker": ".", "markersize": 4.0, "markevery": alone} | looks if alone else looks))


def cloud(ax: Axes, points: Iterable[Any], size: float, color: str, label: str | None = None) -> None:
    """Draw many points (x, y), broadcast, as dots without edges; they are pixels in a vector figure."""
    x, y = map(np.ravel, np.broadcast_arrays(*points))
    ax.plot(x, y, ".", color=color, label=label, markersize=size, markeredgewidth=0, rasterized=True)


def mark(ax: Axes, points: Iterable[Any], marker: str, words: str, size: float = 4.0, **looks: Any) -> None:
    """Draw white marks at points (x, y), broadcast, with a dark edge, named in the legend once."""
    looks = {"markerfacecolor": "white", "markeredgecolor": COLORS["section"], "markeredgewidth": 0.8, **looks}
    x, y = map(np.ravel, np.broadcast_arrays(*points))
    ax.plot(x, y, marker, linestyle="none", markersize=size, label=once(ax, words), **looks)


def points(
    ax: Axes,
    x: Any,
    y: Any,
    *,
    color: str = COLORS["section"],
    face: str | None = None,
    size: float = 3.0,
    mark: str = "o",
    **looks: Any,
) -> None:
    """Draw measured points with error bars, ``xerr`` or ``yerr``; none where no error is known."""
    for bar in ("xerr", "yerr"):
        if not np.isfinite(np.asarray(looks.get(bar, np.nan), dtype=float)).any():
            looks.pop(bar, None)
    ax.errorbar(
        x,
        y,
        fmt=mark,
        color=color,
        markerfacecolor=color if face is None else face,
        markersize=size,
        **{"markeredgewidth": 0.7, "elinewidth": 0.6, "zorder": 4, **looks},
    )


def annotate(ax: Axes, words: str, place: tuple[float, float], offset: tuple[float, float], **looks: Any) -> Any:
    """Write small words beside a place of the axes, so that they show over whatever lies below.

    Parameters
    ----------
    ax
    words
    place : (float, float)
        In the units of what is drawn, or of ``xycoords``.
    offset : (float, float)
        Of the words from it, in typographic points.
    **looks
        Of ``Axes.annotate``: ``rotation``, ``ha``, ``va``, ``color``, ``xycoords``, ...
    """
    looks = {"fontsize": small(ax), "zorder": 6, "path_effects": halo(), **looks}
    return ax.annotate(words, place, offset, textcoords="offset points", **looks)


def shade(ax: Axes, x: Any, where: Any, **looks: Any) -> None:
    """Shade the parts of the abscissa in which something holds, over the whole height."""
    looks = {"color": COLORS["zone"], "alpha": 0.25, "linewidth": 0, **looks}
    ax.fill_between(x, 0, 1, where=where, transform=ax.get_xaxis_transform(), **looks)


def shared_legend(figure: Figure, columns: int = 5) -> Legend:
    """Put one legend under all axes of a figure in place of their own, so that it hides nothing.

    What several axes have in their legends stands in it once. The figure's layout must be ``constrained`` for it to
    have a place of its own, as :func:`journal` has it.

    Parameters
    ----------
    figure
    columns : int
        The most entries in a row.
    """
    entries: dict[str, Any] = {}
    for ax in figure.axes:
        for handle, words in zip(*ax.get_legend_handles_labels(), strict=True):
            entries.setdefault(words, handle)
        if (own := ax.get_legend()) is not None:
            own.remove()
    legend = figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=columns)
    even_dots(legend)
    return legend


def scattered(line: Any) -> bool:
    """Return whether something drawn is points that no line joins."""
    return hasattr(line, "get_marker") and line.get_linestyle() == "None"


def even_dots(legend: Legend) -> None:
    """Show the dots of point clouds in a legend large enough to be told apart, whatever their size in the figure."""
    shown: list[Any] = [one for one in legend.legend_handles if scattered(one)]
    for one in shown:
        if one.get_marker() == ".":
            one.set_markersize(_DOT)


def legend(ax: Axes, loc: str = "", columns: int = 2) -> Legend:
    """Place the legend in the axes, or above them, in as many columns as the figure has room for.

    Above them it ends at their right edge; a wider one goes on over what stands beside them."""
    whole: Any = ax.figure.canvas.figure  # of a figure within a figure too
    if not loc:
        whole.draw_without_rendering()
    box = ax.get_window_extent()
    for number in range(columns, 0, -1):  # names of modes may be long
        made = ax.legend(**({"loc": loc} if loc else _ABOVE), ncols=number, columnspacing=1.0)
        width = made.get_window_extent().width
        if width <= 0.9 * whole.bbox.width:
            break
    if not loc:
        made.set_bbox_to_anchor((1.0 + max(width - 0.98 * box.x1, 0.0) / box.width, 1.0), ax.transAxes)
    even_dots(made)
    return made


def clear_legend(ax: Axes) -> Legend:
    """Place the legend in the axes where it covers nothing, else above them; call it when all is drawn."""
    inside = legend(ax, "best", columns=1)
    whole: Any = ax.figure.canvas.figure
    whole.draw_without_rendering()
    box = inside.get_window_extent()
    for line in ax.lines:
        path = line.get_path().transformed(line.get_transform())
        crossed = not scattered(line) and path.cleaned(remove_nans=True).intersects_bbox(box, filled=False)
        if crossed or box.count_contains(path.vertices):
            return legend(ax)
    return inside


def apart(ax: Axes, labels: Iterable[Any]) -> None:
    """Move labels into the axes, and those that stand over others up or down; call it when all is drawn."""
    whole: Any = ax.figure.canvas.figure
    whole.draw_without_rendering()
    low, high = ax.get_window_extent().intervaly
    middle = 0.5 * (low + high)
    placed: list[Any] = []
    for label in labels:
        (bottom, top), (x, y) = label.get_window_extent().intervaly, label.xyann
        label.xyann = x, y + (max(low - bottom, 0.0) - max(top - high, 0.0)) * 72.0 / whole.dpi
        rises = sum(label.get_window_extent().intervaly) < 2.0 * middle
        for _ in placed:
            box = label.get_window_extent()
            other = next((one for one in placed if one.overlaps(box)), None)
            if other is None:
                break
            x, y = label.xyann
            by = other.y1 - box.y0 + 1.0 if rises else other.y0 - box.y1 - 1.0
            label.xyann = x, y + by * 72.0 / whole.dpi
        placed.append(label.get_window_extent())


def save_figure(figure: Figure | Axes, path: str | os.PathLike[str]) -> Path:
    """Save a figure (or the figure of some axes) in the format of the path's ending.

    Lines and text stay vectors in PDF and SVG; point clouds are pixels at 600 dpi. The file holds no date,
    so equal input gives equal files. The path is returned, with the ending ``.png`` where it has none. A file that
    cannot be written is a DataFileError, and what stood there before stays.
    """
    from nonsmooth.results.whole import placed

    owner: Any = getattr(figure, "figure", figure)
    if not hasattr(owner, "savefig"):
        raise TypeError(f"save_figure takes the figure (or its axes) first, then the file; not {shortened(figure)}")
    target = Path(path)
    if not target.suffix:
        target = target.with_name(f"{target.name}.{owner.canvas.get_default_filetype()}")
    if target.suffix[1:].lower() not in (known := owner.canvas.get_supported_filetypes()):
        raise ValueError(f"{target}: the ending is that of no format of figures; allowed: {', '.join(sorted(known))}")
    metadata: Properties | None = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}.get(target.suffix)
    with _in(_made.get(owner, "journal")), placed(target) as fresh:
        owner.savefig(fresh, metadata=metadata)
    return target
