"""The frame of every figure: a check of what is drawn, axes where none are given, and the options that all have."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import wraps
from typing import TYPE_CHECKING, Annotated, Any, TypedDict, Unpack

from nonsmooth.plot import style
from nonsmooth.plot.labels import variable_along
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Default, Positive, at_least

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Look(TypedDict, total=False):
    """Options of every figure.

    Parameters
    ----------
    title : str
        Above the axes.
    legend : bool
        False: none.
    unit : str or mapping
        The unit of the ordinate, ``"mm"``, or of both axes: ``{"x": "mm", "y": "mm/s"}``.
    alpha, color, linestyle, linewidth, marker, markersize, rasterized, zorder
        Properties of lines, as Matplotlib takes them: of all lines and points that the figure draws.
    """

    title: str | None
    legend: Annotated[bool, Default(True)]
    unit: str | Mapping[str, str] | None
    alpha: Annotated[float, at_least(0, 1)] | None
    color: Any
    linestyle: Any
    linewidth: Annotated[float, at_least(0)] | None
    marker: Any
    markersize: Positive | None
    rasterized: bool | None
    zorder: float | None


_LINE = [*Look.__annotations__][3:]
_KEYWORD = inspect.Parameter.KEYWORD_ONLY


def figure(verb: str = "", *variables: str, **size: float) -> Callable[[Callable[..., None]], Callable[..., Axes]]:
    """Make a figure ``(result, ax=None, ...) -> ax`` of a function ``(ax, result, ...)`` that draws on axes.

    The result must be a Dataset with the ``variables`` that those of a ``verb`` have. A new figure has the ``size``
    that ``style.axes`` takes. The arguments are read as their declarations say, and the options of :class:`Look` are
    applied when all is drawn.
    """

    def made(draw: Callable[..., None]) -> Callable[..., Axes]:
        known = inspect.signature(draw).parameters
        own, *others = known.values()
        many = any(one.kind is one.VAR_POSITIONAL for one in others)  # results, among which the axes may stand
        at = next((i for i, one in enumerate(others) if one.kind is _KEYWORD), len(others))
        others.insert(at, own.replace(default=None, annotation="Axes | None", kind=_KEYWORD if many else own.kind))
        taken = inspect.Signature(others)

        @wraps(draw)
        def drawn(*given: Any, **options: Any) -> Axes:
            look = {key: options.pop(key) for key in Look.__annotations__ if key in options and key not in known}
            if many:
                for one in given[1:]:
                    if one is not None and not hasattr(one, "data_vars"):
                        options["ax"] = one
                given = given[:1] + tuple(one for one in given[1:] if hasattr(one, "data_vars"))
            bound = taken.bind(*given, **options)
            ax = bound.arguments.pop("ax", None)
            for variable in variables:
                variable_along(bound.args[0], variable, verb)
            there = {*getattr(ax, "lines", ()), *getattr(ax, "collections", ())}
            with style.axes(ax, **size) as paper:
                draw(paper, *bound.args, **bound.kwargs)
                _finish(paper, there, look, draw.__name__)
            return paper

        rest = inspect.Parameter("look", inspect.Parameter.VAR_KEYWORD, annotation=Unpack[Look])
        drawn.__signature__ = taken.replace(parameters=[*others, rest])  # type: ignore[attr-defined]
        return checked(drawn)

    return made


def _finish(ax: Axes, there: set[Any], look: Mapping[str, Any], name: str) -> None:
    """Apply what all figures take; properties of lines to those drawn, bars and entries of the legend among them."""
    from matplotlib.collections import LineCollection

    shown, looks = ax.get_legend(), {key: look[key] for key in _LINE if look.get(key) is not None}
    bars = [one for one in ax.collections if isinstance(one, LineCollection)]
    new: list[Any] = [one for one in (*ax.lines, *bars) if one not in there]
    if looks and not new:
        raise TypeError(f"{', '.join(looks)}: no property of this picture, in which {name} has drawn no line or point")
    if "linestyle" in looks and all(map(style.scattered, new)):
        raise TypeError(f"linestyle: no property of this picture, in which {name} has drawn no line, but points alone")
    signs: list[Any] = [] if shown is None else [one for one in shown.legend_handles if hasattr(one, "get_markersize")]
    for line in (*new, *signs) if looks else ():
        kept = {"linestyle"} if style.scattered(line) else set()  # points are not joined
        line.set(**{key: value for key, value in looks.items() if hasattr(line, f"set_{key}") and key not in kept})
        if "marker" in looks and hasattr(line, "set_marker"):  # at all points; a cross is nothing but an edge
            line.set(markevery=None, markeredgewidth=0.7)
    if (unit := look.get("unit")) is not None:
        from nonsmooth.plot.units import in_unit

        for axis, wanted in ({"y": unit} if isinstance(unit, str) else unit).items():
            if axis not in ("x", "y"):
                raise ValueError(f"unit = {unit!r}: a unit of the ordinate, or {{'x': 'mm', 'y': 'mm/s'}}")
            in_unit(ax.xaxis if axis == "x" else ax.yaxis, wanted)
    if (title := look.get("title")) is not None:
        said = ax.get_title(loc="left")  # of contours and regions: the title stands above it
        ax.set_title(title + "\n" * len(said.splitlines()))
    if not look.get("legend", True) and shown is not None:
        shown.remove()
